//! Where the vertex goes that an edge's ends merge into, and what that costs.
//!
//! In: a mesh, which part of it is frozen, an edge. Out: the best place with its cost, or other places. Arithmetic on the
//! two ends alone. Forbidden here: looking at tets other than for their labels; changing anything.

use glam::{IVec3, Vec3};

use super::SimplifyParams;
use super::collapse::Unfrozen;
use super::legality::{Refusal, Topology};
use super::quadric::{PositionQuadric, WedgeQuadric};
use super::work_mesh::{NONE, WorkMesh};

/// Where an edge's merged vertex would go, and what it would cost.
#[derive(Debug, Clone, Copy)]
pub(super) struct Proposal {
    pub(super) position: IVec3,
    /// With the price.
    pub(super) cost: f32,
    /// Whether it has the price in it of labels that hang together in another way then.
    pub(super) is_priced: bool,
}

/// Makes proposals.
pub(super) struct Proposer<'a, Q> {
    pub(super) mesh: &'a WorkMesh<Q>,
    pub(super) unfrozen: Unfrozen,
    pub(super) params: &'a SimplifyParams,
}

/// What is known of a merged vertex before its place is.
struct Merged {
    /// About `origin`.
    quadric: PositionQuadric,
    /// The position of one of the ends.
    origin: IVec3,
    /// Axes in which it is bound to the origin.
    fixed: [Option<f32>; 3],
    /// Whether there is no other place for it.
    stays: bool,
    /// Of changes of topology; 0 without.
    price: f32,
}

impl Merged {
    /// A position, moved to where the vertex is bound.
    fn bind(&self, mut position: IVec3) -> IVec3 {
        for axis in (0..3).filter(|&axis| self.fixed[axis].is_some()) {
            position[axis] = self.origin[axis];
        }
        position
    }

    fn at(&self, position: IVec3, offset: Vec3) -> Proposal {
        // What rounding makes of nothing may be less than nothing.
        let cost = self.quadric.at(offset).max(0.0) + self.price;
        Proposal { position, cost, is_priced: self.price > 0.0 }
    }
}

impl<Q: WedgeQuadric> Proposer<'_, Q> {
    pub(super) fn is_frozen(&self, v: u32) -> bool {
        let vertex = &self.mesh.vertices[v as usize];
        vertex.frozen || self.unfrozen.freezes(vertex.position.z)
    }

    /// Position and cost of merging `u` and `v`.
    pub(super) fn propose(&self, u: u32, v: u32) -> Result<Proposal, Refusal> {
        let merged = self.merged(u, v)?;
        if merged.stays {
            return Ok(merged.at(merged.origin, Vec3::ZERO));
        }
        Ok(self.best_position(&merged, [u, v]))
    }

    /// Other places for the merged vertex, the cheapest first: the ends of the edge and its middle.
    pub(super) fn other_places(&self, u: u32, v: u32) -> Option<[Proposal; 3]> {
        let merged = self.merged(u, v).ok().filter(|merged| !merged.stays)?;
        let [a, b] = [u, v].map(|w| self.mesh.vertices[w as usize].position);
        let mut places = [a, b, (a + b) / 2].map(|place| {
            let place = merged.bind(place);
            merged.at(place, self.mesh.offset(merged.origin, place))
        });
        places.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        Some(places)
    }

    /// What it costs that labels hang together in another way after a merger: a jump over so many cubic pixels.
    pub(super) fn topology_price(&self, u: u32, v: u32) -> f32 {
        let mesh = self.mesh;
        let colors = || mesh.wedges(u).chain(mesh.wedges(v)).map(|wedge| wedge.quadric.color_at(Vec3::ZERO));
        let jumps = colors().enumerate().flat_map(|(n, a)| colors().take(n).map(move |b| a.distance_squared(b)));
        self.params.topology_price * jumps.fold(0.0, f32::max)
    }

    fn merged(&self, u: u32, v: u32) -> Result<Merged, Refusal> {
        let mesh = self.mesh;
        let (fixed_u, fixed_v) = (self.is_frozen(u), self.is_frozen(v));
        if fixed_u && fixed_v {
            return Err(Refusal::Frozen);
        }
        let (sides_u, sides_v) = (mesh.vertices[u as usize].sides, mesh.vertices[v as usize].sides);
        let sides = sides_u.or(sides_v);
        if sides != sides_u && sides != sides_v {
            return Err(Refusal::Sides);
        }
        // The frozen end, else the one of higher category, keeps its place in the axes in which it is bound.
        let bound = if fixed_u || (!fixed_v && sides_u == sides) { u } else { v };
        if mesh.vertices[bound as usize].sides != sides {
            return Err(Refusal::Sides);
        }
        let mut price = 0.0;
        if self.params.topology != Topology::Free
            && let Err(refusal) = mesh.check_labels(u, v)
        {
            if self.params.topology == Topology::Strict {
                return Err(refusal);
            }
            price = self.topology_price(u, v);
        }
        Ok(Merged {
            quadric: self.merged_quadric(u, v, bound),
            origin: mesh.vertices[bound as usize].position,
            fixed: sides.free_axes().to_array().map(|free| (free == 0.0).then_some(0.0)),
            stays: fixed_u || fixed_v || (price == 0.0 && self.keeps_place(u, v, bound)),
            price,
        })
    }

    /// Where topology counts the vertex of higher class stays where it is.
    fn keeps_place(&self, u: u32, v: u32, bound: u32) -> bool {
        let other = if bound == u { v } else { u };
        self.params.topology != Topology::Free && self.mesh.wedges(bound).count() > self.mesh.wedges(other).count()
    }

    /// The quadric of the merged vertex, about the position of `origin` (one of the two).
    fn merged_quadric(&self, u: u32, v: u32, origin: u32) -> PositionQuadric {
        let mesh = self.mesh;
        let other = if origin == u { v } else { u };
        let shift = mesh.offset(mesh.vertices[other as usize].position, mesh.vertices[origin as usize].position);
        let (own, others) = (&mesh.vertices[origin as usize].first, &mesh.vertices[other as usize].first);
        if own.label == others.label && [own.next, others.next] == [NONE; 2] {
            // Inside a label, as most are, the loops below come down to this.
            let mut quadric = own.quadric;
            quadric.add(&others.quadric.recentered(shift));
            return quadric.reduced();
        }
        let mut total = PositionQuadric::default();
        for wedge in mesh.wedges(origin) {
            let mut quadric = wedge.quadric;
            if let Some(twin) = mesh.wedge(other, wedge.label) {
                quadric.add(&twin.quadric.recentered(shift));
            }
            total.add_scaled(&quadric.reduced(), 1.0);
        }
        for wedge in mesh.wedges(other).filter(|wedge| mesh.wedge(origin, wedge.label).is_none()) {
            total.add_scaled(&wedge.quadric.recentered(shift).reduced(), 1.0);
        }
        if let Some(surface) = mesh.surfaces.get(mesh.vertices[origin as usize].surface as usize) {
            total.add_scaled(surface, 1.0);
        }
        if let Some(surface) = mesh.surfaces.get(mesh.vertices[other as usize].surface as usize) {
            total.add_scaled(&surface.recentered(shift), 1.0);
        }
        total
    }

    /// The lattice point that costs least among the minimiser's, the ends' and the middle's; the minimiser is trusted
    /// only near the edge.
    fn best_position(&self, merged: &Merged, ends: [u32; 2]) -> Proposal {
        let mesh = self.mesh;
        let unit = mesh.domain.unit() as f32;
        let origin = merged.origin;
        let [a, b] = ends.map(|v| mesh.vertices[v as usize].position);
        let at = |position: IVec3| merged.at(position, mesh.offset(origin, position));
        let middle = mesh.offset(origin, a).midpoint(mesh.offset(origin, b));
        let reach = 2.0 * mesh.offset(a, b).length();
        if let Some(x) = merged.quadric.minimizer(merged.fixed).filter(|x| x.distance(middle) <= reach) {
            return at(origin + (x * unit).round().as_ivec3());
        }
        let mut best = at(merged.bind((a + b) / 2));
        for proposal in [a, b].into_iter().filter(|&p| merged.bind(p) == p).map(at) {
            if proposal.cost < best.cost {
                best = proposal;
            }
        }
        best
    }
}
