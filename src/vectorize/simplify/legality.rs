//! Which collapses are allowed, and under what name the others are refused.

use glam::IVec3;

use super::quadric::WedgeQuadric;
use super::work_mesh::WorkMesh;
use crate::mesh::{FACES, volume6};
use crate::video::Label;

/// Why a collapse was refused.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Refusal {
    /// Both ends lie in the frozen part of the window (§VI).
    Frozen,
    /// The ends lie on different sides of the box, so that merging them would bend the box.
    Sides,
    /// Strict topology: the ends' labels are such that merging would pinch or join label surfaces.
    Labels,
    /// Strict topology: surfaces between labels join both ends to a third vertex without a face of all three (link condition).
    Link,
    /// A tet would turn over or become too small to survive rounding.
    Flip,
    /// A tet would become a sliver, which subdivision's smoothing would fold over.
    Sliver,
    /// A tet would reach over more frames than the window allows.
    Extent,
}

impl Refusal {
    /// All refusals, in the order of [`RefusalCounts`].
    pub const ALL: [Self; 7] =
        [Self::Frozen, Self::Sides, Self::Labels, Self::Link, Self::Flip, Self::Sliver, Self::Extent];
}

/// How often each [`Refusal`] occurred.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct RefusalCounts([u64; 7]);

impl RefusalCounts {
    pub(super) fn note(&mut self, refusal: Refusal) {
        self.0[refusal as usize] += 1;
    }

    /// Times `refusal` occurred.
    pub fn count(&self, refusal: Refusal) -> u64 {
        self.0[refusal as usize]
    }

    /// Adds another run's counts.
    pub fn add(&mut self, other: &Self) {
        for (a, b) in self.0.iter_mut().zip(other.0) {
            *a += b;
        }
    }
}

/// How strictly labels' topology is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Topology {
    /// Labels may merge and pinch as long as the tets stay positive, and so tile the volume: reaches lower ratios at
    /// better quality.
    #[default]
    Free,
    /// What [`Self::Strict`] forbids has a price ([`super::SimplifyParams::topology_price`]): what keeps topology goes first, and
    /// the noise in it, that of strokes that move by more than they are wide, gives way before all else does.
    Priced,
    /// A vertex merges only into one whose labels include its own, along an edge of the surface they share, and under
    /// the link condition; the merged vertex stays where the one of higher category was (§IV-A3).
    Strict,
}

/// Volume and edges of a tet.
#[derive(Clone, Copy)]
pub(super) struct Form {
    /// Six times its volume, in cubic lattice units.
    pub(super) volume6: i64,
    /// Sum of its squared edges.
    edges: f32,
}

impl Form {
    #[inline(always)]
    pub(super) fn of([a, b, c, d]: [IVec3; 4]) -> Self {
        let (u, v, w) = ((b - a).as_vec3(), (c - a).as_vec3(), (d - a).as_vec3());
        // Squared distances between n points add up to n times their squares less the square of their sum.
        let squares = u.length_squared() + v.length_squared() + w.length_squared();
        Self { volume6: volume6(a, b, c, d), edges: 4.0 * squares - (u + v + w).length_squared() }
    }

    /// The cube of the mean ratio, 12 (3 V)^(2/3) over the sum of squared edges: 1 for a regular tet, 0 for a flat one.
    /// Liu and Joe, "Relationship between tetrahedron shape measures", 1994.
    #[inline]
    pub(super) fn shape(self) -> f32 {
        // (12 / edges)^3 (V6 / 2)^2
        432.0 * (self.volume6 as f32 / self.edges).powi(2) / self.edges
    }

    /// Whether [`Self::shape`] is less than `least`, without a division.
    #[inline(always)]
    fn is_flatter(self, least: f32) -> bool {
        432.0 * (self.volume6 as f32).powi(2) < least * self.edges * self.edges * self.edges
    }
}

/// What a merged vertex must respect.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits {
    /// Least six-fold volume of a tet, in cubic lattice units.
    pub(super) min_volume6: i64,
    /// Least cube of the mean ratio of a tet.
    pub(super) min_shape: f32,
    /// Most lattice units that a tet may reach through time.
    pub(super) max_extent: i32,
}

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Whether the tets around `u` and `v` stay positive when both move to `position`, those between them vanishing.
    ///
    /// Positivity suffices for a tiling: the sum of signed volumes is kept, so positive tets cover each point once.
    pub(super) fn check_geometry(&self, [u, v]: [u32; 2], position: IVec3, limits: &Limits) -> Result<(), Refusal> {
        for (moved, other) in [(u, v), (v, u)] {
            if self.place(moved) == position {
                // Only tets that move can turn over, but a vertex that stays can still gain long ones from `other`.
                continue;
            }
            for &tet in self.stars.star(moved) {
                let corners = self.tets[tet as usize];
                if corners.contains(&other) {
                    continue;
                }
                // Written out: this is where the loop spends its time, and a closure here is not inlined.
                let at = |n: usize| if corners[n] == moved { position } else { self.place(corners[n]) };
                let moved_corners = [at(0), at(1), at(2), at(3)];
                let form = Form::of(moved_corners);
                if form.volume6 <= 0 {
                    return Err(Refusal::Flip);
                }
                let (is_small, is_flat) = (form.volume6 < limits.min_volume6, form.is_flatter(limits.min_shape));
                if is_small || is_flat {
                    // A tet that was worse before is no reason to refuse what makes it better.
                    let now = Form::of(corners.map(|w| self.place(w)));
                    if is_small && form.volume6 < now.volume6 {
                        return Err(Refusal::Flip);
                    }
                    if is_flat && form.shape() < now.shape() {
                        return Err(Refusal::Sliver);
                    }
                }
                let times = moved_corners.map(|p| (p.z - position.z).abs());
                if times[0].max(times[1]).max(times[2]).max(times[3]) > limits.max_extent {
                    return Err(Refusal::Extent);
                }
            }
        }
        Ok(())
    }

    #[inline(always)]
    fn place(&self, vertex: u32) -> IVec3 {
        self.places[vertex as usize]
    }

    /// The label rule of [`Topology::Strict`]: one end's labels and sides include the other's, and an edge between two
    /// boundary vertices runs along the boundary.
    pub(super) fn check_labels(&self, u: u32, v: u32) -> Result<(), Refusal> {
        let includes = |a: u32, b: u32| {
            self.vertices[a as usize].sides.contains(self.vertices[b as usize].sides)
                && self.wedges(b).all(|wedge| self.wedge(a, wedge.label).is_some())
        };
        let class = |v: u32| self.wedges(v).count() as u32 + self.vertices[v as usize].sides.count();
        let (lower, upper) = if class(u) <= class(v) { (u, v) } else { (v, u) };
        if !includes(upper, lower) {
            return Err(Refusal::Labels);
        }
        // All tets around a vertex of one label have that label, the edge's too.
        let is_inside = self.wedges(lower).count() == 1;
        if is_inside || self.is_along(u, v, lower) { Ok(()) } else { Err(Refusal::Labels) }
    }

    /// Whether the tets around an edge have all labels of `end`, one of its ends. None of them has another one.
    fn is_along(&self, u: u32, v: u32, end: u32) -> bool {
        let count = self.wedges(end).count() as u32;
        let (mut found, mut last) = (0u64, None);
        for tet in self.around_edge(u, v) {
            let label = self.labels[tet as usize];
            if last == Some(label) {
                continue;
            }
            last = Some(label);
            // Of more labels than there are bits, which no picture has at a point, not all are found.
            let wedge = self.wedges(end).take(u64::BITS as usize).position(|wedge| wedge.label == label);
            found |= wedge.map_or(0, |n| 1 << n);
            if found.count_ones() == count {
                return true;
            }
        }
        false
    }

    /// The link condition on the surfaces between labels: a vertex that they join to both ends must share a face of them
    /// with both, and no face may lie between the same two vertices as seen from both ends. Dey, Edelsbrunner, Guha,
    /// Nekhayev, "Topology preserving edge contraction", 1999. Inside of labels positive tets are all that is to be kept.
    pub(super) fn check_link(&self, u: u32, v: u32, topology: Topology, marks: &mut Marks) -> Result<(), Refusal> {
        if [u, v].iter().any(|&w| self.wedges(w).count() == 1) {
            return Ok(());
        }
        let (near, shared) = marks.two();
        let [mut at_u, mut at_v] = std::mem::take(&mut marks.faces);
        self.surface_faces(u, topology, &mut at_u);
        self.surface_faces(v, topology, &mut at_v);
        at_v.iter().for_each(|face| face.ends().into_iter().for_each(|w| marks.set(w, near)));
        let common = at_v.iter().filter(|face| face.ends().contains(&u));
        common.for_each(|face| face.ends().into_iter().for_each(|w| marks.set(w, shared)));
        let is_apart = |w: u32| w != v && marks.has(w, near);
        let is_opposite = |face: &SurfaceFace| at_v.binary_search_by_key(&face.key, |other| other.key).is_ok();
        let is_linked = !at_u.iter().any(|face| face.ends().into_iter().any(is_apart) || is_opposite(face));
        marks.faces = [at_u, at_v];
        if is_linked { Ok(()) } else { Err(Refusal::Link) }
    }

    /// The faces at `v` between labels, ascending. To be strict, the sides of the box are one more label (§V-B): what lies at
    /// them could vanish into them.
    fn surface_faces(&self, v: u32, topology: Topology, faces: &mut Vec<SurfaceFace>) {
        faces.clear();
        for &tet in self.stars.star(v) {
            let (corners, label) = (self.tets[tet as usize], self.labels[tet as usize]);
            let at = corners.iter().position(|&w| w == v).unwrap_or(0);
            let [a, b, c] = FACES[at].map(|corner| corners[corner]);
            faces.extend([SurfaceFace::new(a, b, label), SurfaceFace::new(b, c, label), SurfaceFace::new(c, a, label)]);
        }
        faces.sort_unstable_by_key(|face| face.key);
        let (mut kept, mut n) = (0, 0);
        while n < faces.len() {
            let across = faces.get(n + 1).filter(|other| other.key == faces[n].key);
            let is_surface = across.map_or(topology == Topology::Strict, |other| other.label != faces[n].label);
            let step = 1 + usize::from(across.is_some());
            if is_surface {
                faces[kept] = faces[n];
                kept += 1;
            }
            n += step;
        }
        faces.truncate(kept);
    }
}

/// A face at a vertex.
#[derive(Debug, Clone, Copy)]
struct SurfaceFace {
    /// Its other two corners in one number: they are sorted again and again.
    key: u64,
    label: Label,
}

impl SurfaceFace {
    #[inline]
    fn new(a: u32, b: u32, label: Label) -> Self {
        Self { key: u64::from(a.max(b)) << 32 | u64::from(a.min(b)), label }
    }

    #[inline]
    fn ends(&self) -> [u32; 2] {
        [self.key as u32, (self.key >> 32) as u32]
    }
}

/// Marks on vertices that need no clearing.
#[derive(Debug)]
pub(super) struct Marks {
    of: Vec<u32>,
    last: u32,
    /// Memory for the faces around both ends of an edge.
    faces: [Vec<SurfaceFace>; 2],
}

impl Marks {
    pub(super) fn new(vertices: usize) -> Self {
        Self { of: vec![0; vertices], last: 0, faces: Default::default() }
    }

    /// Two marks that no vertex has.
    fn two(&mut self) -> (u32, u32) {
        if self.last > u32::MAX - 2 {
            self.of.fill(0);
            self.last = 0;
        }
        self.last += 2;
        (self.last - 1, self.last)
    }

    fn set(&mut self, vertex: u32, mark: u32) {
        self.of[vertex as usize] = mark;
    }

    fn has(&self, vertex: u32, mark: u32) -> bool {
        self.of[vertex as usize] == mark
    }
}
