//! One level of subdivision where it is needed, and no more than once: vertices are gathered and parents get their
//! ten nodes when the plane first comes near them.
//!
//! In: a complex that grows at its ends, and planes. Out: the parents whose children a plane cuts. What was refined
//! before more tets came to a vertex is refined anew, so that the result is that of the complex as it is.

use glam::{IVec3, Vec3, Vec3A};

use super::children::{CHILDREN, diagonal};
use super::complex::{Complex, Stars};
use super::level::{blend, place};
use super::parallel::map_chunks;
use super::rings::{Gather, NodeMask};
use crate::mesh::EDGES;

/// Vertices or tets that a thread takes at a time.
const CHUNK: usize = 512;

/// Binary digits after the point of colours. They are integers, as positions are, so that what is drawn depends
/// neither on how the mesh is numbered nor on what was drawn before.
pub(super) const COLOR_BITS: u32 = 16;

/// A fine node with all that drawing needs, in one piece of memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(32))]
pub(super) struct FineNode {
    /// In fine units.
    pub(super) position: IVec3,
    /// RGB in fine levels: 2^-[`COLOR_BITS`] of an 8-bit level.
    pub(super) color: IVec3,
}

impl FineNode {
    pub(super) const ZERO: Self = Self { position: IVec3::ZERO, color: IVec3::ZERO };

    /// RGB in 8-bit levels.
    #[inline]
    pub(super) fn levels(&self) -> Vec3A {
        self.color.as_vec3a() * (1.0 / FINE_LEVEL)
    }
}

/// A level in fine levels.
const FINE_LEVEL: f32 = (1 << COLOR_BITS) as f32;

/// RGB in fine levels from 8-bit levels. Far beyond [0, 255] it is cut off, which keeps sums in range.
pub(super) fn fine_color(levels: Vec3) -> IVec3 {
    const LIMIT: f32 = 8192.0;
    // Casts turn what is no number into 0.
    (levels.clamp(Vec3::splat(-LIMIT), Vec3::splat(LIMIT)) * FINE_LEVEL).round().as_ivec3()
}

/// Names a level-1 node.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NodeName {
    /// The node of a control node.
    Corner(u32),
    /// A node of an edge.
    Edge(u32),
}

/// A parent's six edge nodes and its diagonal (row of [`CHILDREN`]).
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Parent {
    pub(super) edges: [u32; 6],
    pub(super) diagonal: u8,
}

/// A closed range of times in fine units.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    low: i32,
    high: i32,
}

impl Span {
    pub(super) const EMPTY: Self = Self { low: i32::MAX, high: i32::MIN };

    /// The times of these positions.
    pub(super) fn of(positions: impl IntoIterator<Item = IVec3>) -> Self {
        positions.into_iter().fold(Self::EMPTY, |span, p| span.hull(Self { low: p.z, high: p.z }))
    }

    /// From `low` to `high`.
    pub(super) fn new(low: i32, high: i32) -> Self {
        Self { low, high }
    }

    /// The earliest time.
    #[inline]
    pub(super) fn low(self) -> i32 {
        self.low
    }

    /// The smallest range that holds both.
    pub(super) fn hull(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    /// Whether the plane at `t` has something of the range below and something above it.
    #[inline]
    pub(super) fn is_cut(self, t: i32) -> bool {
        self.low < t && t <= self.high
    }
}

/// A complex and what is known of its next level.
#[derive(Debug, Default)]
pub(super) struct Refiner {
    stars: Stars,
    /// Vertex points, one a node of the complex; valid where the point was gathered.
    corners: Vec<FineNode>,
    /// Edge points, one an edge and label, in the order they were first needed.
    edges: Vec<FineNode>,
    /// One an edge node: the first node of the same edge, which stands for their common point.
    edge_points: Vec<u32>,
    /// For each point the edges it owns (those to points with a higher number): (far node, edge node), ascending.
    owned: Vec<Box<[(u32, u32)]>>,
    gathered: Vec<bool>,
    /// For each point the times of its star. A point's masks reach no further.
    reach: Vec<Span>,
    /// For each tet the times of its ten nodes where it is refined, else bounds of them.
    spans: Vec<Span>,
    refined: Vec<bool>,
    parents: Vec<Parent>,
    /// Nodes whose values changed since [`Self::take_changed`].
    changed: Vec<NodeName>,
}

/// What gathering a run of vertices gave.
struct Gathered {
    masks: Vec<(NodeMask, FineNode)>,
    /// (point, end of its masks).
    ends: Vec<(u32, usize)>,
}

impl Refiner {
    /// Takes in what `complex` gained since the last call.
    pub(super) fn extend(&mut self, complex: &Complex) {
        let first = self.spans.len();
        self.stars.extend(complex);
        self.corners.resize(complex.nodes.len(), FineNode::ZERO);
        self.owned.resize(complex.points.len(), Box::default());
        self.gathered.resize(complex.points.len(), false);
        self.reach.resize(complex.points.len(), Span::EMPTY);
        self.spans.resize(complex.tets.len(), Span::EMPTY);
        self.refined.resize(complex.tets.len(), false);
        self.parents.resize(complex.tets.len(), Parent::default());
        let mut touched = Vec::new();
        for corners in &complex.tets[first..] {
            let span = Span::of(corners.map(|node| complex.position(node)));
            for point in corners.map(|node| complex.point(node)) {
                self.reach[point as usize] = self.reach[point as usize].hull(span);
                touched.push(point);
            }
        }
        touched.sort_unstable();
        touched.dedup();
        self.forget(complex, &touched);
    }

    /// Forgets what followed from the positions, colours or sides of `points`: the masks of these and of their
    /// neighbours. Points not taken in yet are passed over.
    pub(super) fn forget_around(&mut self, complex: &Complex, points: &[u32]) {
        let mut around: Vec<u32> = Vec::new();
        for &point in points.iter().filter(|&&point| (point as usize) < self.gathered.len()) {
            for (tet, _) in self.stars.star(point) {
                let span = Span::of(complex.tets[tet].map(|node| complex.position(node)));
                for point in complex.tets[tet].map(|node| complex.point(node)) {
                    self.reach[point as usize] = self.reach[point as usize].hull(span);
                    around.push(point);
                }
            }
        }
        around.sort_unstable();
        around.dedup();
        self.forget(complex, &around);
    }

    /// Forgets what was refined around `points`, whose masks have changed.
    fn forget(&mut self, complex: &Complex, points: &[u32]) {
        for &point in points {
            self.gathered[point as usize] = false;
            for (tet, _) in self.stars.star(point) {
                let points = complex.tets[tet].map(|node| complex.point(node));
                let hull = |span: Span, point: u32| span.hull(self.reach[point as usize]);
                self.spans[tet] = points.into_iter().fold(Span::EMPTY, hull);
                self.refined[tet] = false;
            }
        }
    }

    /// The tets whose children the plane at `t` may cut, ascending; all of them are refined.
    pub(super) fn cut(&mut self, complex: &Complex, colors: &[IVec3], t: i32) -> Vec<u32> {
        let cut = |spans: &[Span]| (0..spans.len() as u32).filter(|&i| spans[i as usize].is_cut(t)).collect();
        let near: Vec<u32> = cut(&self.spans);
        if near.iter().all(|&tet| self.refined[tet as usize]) {
            return near;
        }
        self.refine(complex, colors, &near);
        near.into_iter().filter(|&tet| self.spans[tet as usize].is_cut(t)).collect()
    }

    /// Makes sure that `tets` are refined.
    pub(super) fn refine(&mut self, complex: &Complex, colors: &[IVec3], tets: &[u32]) {
        let missing: Vec<u32> = tets.iter().copied().filter(|&tet| !self.refined[tet as usize]).collect();
        let mut points = Vec::new();
        for &tet in &missing {
            for point in complex.tets[tet as usize].map(|node| complex.point(node)) {
                // Marked before it is done, so that it is listed once.
                if !std::mem::replace(&mut self.gathered[point as usize], true) {
                    points.push(point);
                }
            }
        }
        for gathered in map_chunks(points.len(), CHUNK, |run| self.gather(complex, colors, &points[run])) {
            self.store(complex, &gathered);
        }
        let found = map_chunks(missing.len(), CHUNK, |run| {
            missing[run].iter().map(|&tet| self.parent(complex, tet)).collect::<Vec<_>>()
        });
        for (&tet, parent) in missing.iter().zip(found.concat()) {
            self.parents[tet as usize] = parent;
            self.spans[tet as usize] = Span::of(self.ten(complex, tet).map(|node| node.position));
            self.refined[tet as usize] = true;
        }
    }

    /// The ten nodes of a refined parent: corners, then edges.
    #[inline]
    pub(super) fn ten(&self, complex: &Complex, tet: u32) -> [FineNode; 10] {
        let (corners, edges) = (&complex.tets[tet as usize], &self.parents[tet as usize].edges);
        std::array::from_fn(
            |i| {
                if i < 4 { self.corners[corners[i] as usize] } else { self.edges[edges[i - 4] as usize] }
            },
        )
    }

    /// A refined parent's children over its ten nodes.
    #[inline]
    pub(super) fn children(&self, tet: u32) -> &'static [[u8; 4]; 8] {
        &CHILDREN[self.parents[tet as usize].diagonal as usize]
    }

    /// A refined parent's edge nodes, and what stands for their points.
    pub(super) fn edge_nodes(&self, tet: u32) -> [(u32, u32); 6] {
        self.parents[tet as usize].edges.map(|node| (node, self.edge_points[node as usize]))
    }

    /// Level-1 nodes whose values changed since the last call; a corner counts as changed when it is first gathered.
    pub(super) fn take_changed(&mut self) -> Vec<NodeName> {
        std::mem::take(&mut self.changed)
    }

    /// The present values of a level-1 node.
    pub(super) fn node(&self, name: NodeName) -> FineNode {
        match name {
            NodeName::Corner(node) => self.corners[node as usize],
            NodeName::Edge(node) => self.edges[node as usize],
        }
    }

    /// The tets around a point.
    pub(super) fn star(&self, point: u32) -> impl Iterator<Item = u32> {
        self.stars.star(point).map(|(tet, _)| tet as u32)
    }

    fn gather(&self, complex: &Complex, colors: &[IVec3], points: &[u32]) -> Gathered {
        let mut gather = Gather::default();
        let mut result = Gathered { masks: Vec::new(), ends: Vec::new() };
        for &point in points {
            gather.run(complex, &self.stars, point);
            for mask in &gather.masks {
                let position = place(complex, mask, &gather.rings);
                let color = blend(mask, &gather.rings, |node| colors[node as usize]);
                result.masks.push((*mask, FineNode { position, color }));
            }
            result.ends.push((point, result.masks.len()));
        }
        result
    }

    fn store(&mut self, complex: &Complex, gathered: &Gathered) {
        let mut first = 0;
        for &(point, end) in &gathered.ends {
            let masks = &gathered.masks[first..end];
            let (corners, edges) = masks.split_at(masks.partition_point(|(mask, _)| !mask.is_edge()));
            first = end;
            for (mask, node) in corners {
                let slot = &mut self.corners[mask.near as usize];
                if *slot != *node {
                    *slot = *node;
                    self.changed.push(NodeName::Corner(mask.near));
                }
            }
            let before = std::mem::take(&mut self.owned[point as usize]);
            let mut owned = Vec::with_capacity(edges.len());
            for labels in edges.chunk_by(|(a, _), (b, _)| complex.point(a.far) == complex.point(b.far)) {
                self.store_edge(labels, &before, &mut owned);
            }
            owned.sort_unstable();
            self.owned[point as usize] = owned.into_boxed_slice();
        }
    }

    /// Stores all labels' nodes of one edge: those it had `before` in their old places.
    fn store_edge(&mut self, labels: &[(NodeMask, FineNode)], before: &[(u32, u32)], owned: &mut Vec<(u32, u32)>) {
        let old = |mask: &NodeMask| before.binary_search_by_key(&mask.far, |&(far, _)| far).map(|i| before[i].1).ok();
        let known = labels.iter().find_map(|(mask, _)| old(mask));
        let point = known.map_or(self.edges.len() as u32, |node| self.edge_points[node as usize]);
        for (mask, node) in labels {
            let number = old(mask).unwrap_or(self.edges.len() as u32);
            if number as usize == self.edges.len() {
                self.edges.push(*node);
                self.edge_points.push(point);
            } else if self.edges[number as usize] != *node {
                self.edges[number as usize] = *node;
                self.changed.push(NodeName::Edge(number));
            }
            owned.push((mask.far, number));
        }
    }

    fn parent(&self, complex: &Complex, tet: u32) -> Parent {
        let corners = complex.tets[tet as usize];
        let edges = EDGES.map(|ends| {
            let [mut near, mut far] = ends.map(|end| corners[end]);
            if complex.point(near) > complex.point(far) {
                (near, far) = (far, near);
            }
            let owned = &self.owned[complex.point(near) as usize];
            // Missing only where a tet's corners share a point or differ in label, which no valid mesh has.
            owned.binary_search_by_key(&far, |&(far, _)| far).map_or(0, |i| owned[i].1)
        });
        Parent { edges, diagonal: diagonal(corners.map(|node| complex.position(node))) as u8 }
    }
}
