//! The masks of the paper (§V-A, Fig. 4b, 4c) for one vertex and the edges it owns, gathered from its star.
//!
//! In: a complex and a star. Out: for every node of the vertex, and of each edge that leads to a higher vertex, a
//! [`NodeMask`]. Each needs only the star of one vertex, so vertices can be done in any order and on any thread.
//!
//! Which mask applies follows from the classes of §V-B, where each side of the box counts as one more label:
//! a vertex or an edge among K = 1 labels takes the interior mask, among K = 2 Loop's mask on the surface between
//! them, and among more it stays (a vertex) or is split at its midpoint (an edge). Faces on the rim of a partial mesh
//! are no boundary: rings there are just incomplete.

use std::ops::Range;

use super::complex::{Complex, Stars};
use crate::mesh::Sides;
use crate::video::Label;

/// How a fine node follows from the nodes of the level below:
/// `(own * (near + far) + ring * sum of rings) / den`, without `far` where `near == far`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NodeMask {
    /// The node itself, or the end of the edge at the vertex that owns it.
    pub(super) near: u32,
    /// The other end of the edge; `near` for a vertex.
    pub(super) far: u32,
    /// Weight of the ends.
    pub(super) own: u32,
    /// Weight of each ring node.
    pub(super) ring: u32,
    /// What the weights add up to.
    pub(super) den: u32,
    /// Where the ring starts in the list of ring nodes.
    pub(super) start: u32,
    /// Where it ends.
    pub(super) end: u32,
}

impl NodeMask {
    /// A vertex that stays, an edge split at its midpoint.
    pub(super) fn stay(near: u32, far: u32) -> Self {
        Self { near, far, own: 1, ring: 0, den: if near == far { 1 } else { 2 }, start: 0, end: 0 }
    }

    /// Whether it is an edge's.
    #[inline]
    pub(super) fn is_edge(&self) -> bool {
        self.near != self.far
    }
}

/// One more corner of a face at the vertex: the face is (vertex, far, other), seen from a tet of one label.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Spoke {
    far_point: u32,
    far: u32,
    other: u32,
}

/// Scratch and results of [`Gather::run`]; reused from vertex to vertex.
#[derive(Debug, Default)]
pub(super) struct Gather {
    /// Masks of the vertex's nodes (by label), then those of its edges, by (far point, far node).
    pub(super) masks: Vec<NodeMask>,
    /// Ring nodes of all masks.
    pub(super) rings: Vec<u32>,
    /// Nodes of the vertex that its star uses, by label.
    near: Vec<(Label, u32)>,
    /// Both directions of every face at the vertex, once a label and side: sorted, without doubles.
    spokes: Vec<Spoke>,
    /// As long as `spokes`: whether the face lies on the surface of its label (another label or the box beyond it).
    surface: Vec<bool>,
    /// Faces seen by one tet only, as (far point, other point, spoke).
    singles: Vec<(u32, u32, u32)>,
}

impl Gather {
    /// Gathers the masks of `vertex` into `masks` and `rings`.
    pub(super) fn run(&mut self, complex: &Complex, stars: &Stars, vertex: u32) {
        self.masks.clear();
        self.rings.clear();
        self.collect(complex, stars, vertex);
        let sides = complex.sides[vertex as usize];
        let class = self.near.len() as u32 + sides.count();
        if class > 1 {
            self.find_surface(complex, sides);
        }
        self.mask_vertex(complex, class);
        self.mask_edges(complex, vertex, sides);
    }

    /// Fills `near`, `spokes` and, for faces seen from one tet only, `singles`.
    fn collect(&mut self, complex: &Complex, stars: &Stars, vertex: u32) {
        self.near.clear();
        self.spokes.clear();
        self.singles.clear();
        for (tet, place) in stars.star(vertex) {
            let corners = complex.tets[tet];
            self.near.push((complex.nodes[corners[place] as usize].label, corners[place]));
            for i in (0..4).filter(|&i| i != place) {
                let (far, far_point) = (corners[i], complex.point(corners[i]));
                for j in (0..4).filter(|&j| j != place && j != i) {
                    self.spokes.push(Spoke { far_point, far, other: corners[j] });
                }
            }
        }
        self.near.sort_unstable();
        self.near.dedup();
        self.spokes.sort_unstable();
        let mut kept = 0;
        let mut i = 0;
        while i < self.spokes.len() {
            let spoke = self.spokes[i];
            let doubles = self.spokes[i..].iter().take_while(|s| **s == spoke).count();
            if doubles == 1 {
                self.singles.push((spoke.far_point, complex.point(spoke.other), kept as u32));
            }
            self.spokes[kept] = spoke;
            kept += 1;
            i += doubles;
        }
        self.spokes.truncate(kept);
        self.surface.clear();
        self.surface.resize(kept, false);
    }

    /// Marks the spokes whose face has another label, or the outside of the box, on its other side. A face that is
    /// seen once and is neither lies on the rim of a partial mesh.
    fn find_surface(&mut self, complex: &Complex, sides: Sides) {
        self.singles.sort_unstable();
        for faces in self.singles.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
            let (far, other, _) = faces[0];
            let on_side = !sides.and(complex.sides[far as usize]).and(complex.sides[other as usize]).is_interior();
            if faces.len() > 1 || on_side {
                for &(_, _, spoke) in faces {
                    self.surface[spoke as usize] = true;
                }
            }
        }
    }

    /// Masks of the vertex's nodes. Loop's weights are Warren's rational ones, beta = 3 / 8n and 3 / 16 for n = 3
    /// (Warren, "Subdivision methods for geometric design", 1995): exact in integers, unlike Loop's cosine.
    fn mask_vertex(&mut self, complex: &Complex, class: u32) {
        if class > 2 {
            return self.masks.extend(self.near.iter().map(|&(_, near)| NodeMask::stay(near, near)));
        }
        for &(label, near) in &self.near {
            let start = self.rings.len() as u32;
            let on_surface =
                |i: usize, spoke: &Spoke| self.surface[i] && complex.nodes[spoke.far as usize].label == label;
            let on_ring = |&(i, spoke): &(usize, &Spoke)| class == 1 || on_surface(i, spoke);
            self.rings.extend(self.spokes.iter().enumerate().filter(on_ring).map(|(_, spoke)| spoke.far));
            dedup_from(&mut self.rings, start as usize);
            let end = self.rings.len() as u32;
            let mask = NodeMask { start, end, ..NodeMask::stay(near, near) };
            self.masks.push(match (class, end - start) {
                (1, k) if k > 0 => NodeMask { own: 9 * k, ring: 7, den: 16 * k, ..mask },
                (2, 3) => NodeMask { own: 7, ring: 3, den: 16, ..mask },
                (2, n) if n > 3 => NodeMask { own: 5 * n, ring: 3, den: 8 * n, ..mask },
                _ => NodeMask { end: start, ..mask },
            });
        }
    }

    /// Masks of the edges to points with a higher number than `vertex`.
    fn mask_edges(&mut self, complex: &Complex, vertex: u32, sides: Sides) {
        let mut next = 0;
        while next < self.spokes.len() {
            let first = next;
            let far_point = self.spokes[first].far_point;
            next += self.spokes[first..].iter().take_while(|s| s.far_point == far_point).count();
            if far_point <= vertex {
                continue;
            }
            let labels = self.spokes[first..next].chunk_by(|a, b| a.far == b.far).count() as u32;
            let class = labels + sides.and(complex.sides[far_point as usize]).count();
            let mut i = first;
            while i < next {
                let end = i + self.spokes[i..next].iter().take_while(|s| s.far == self.spokes[i].far).count();
                self.mask_edge(complex, class, i..end);
                i = end;
            }
        }
    }

    /// The mask of one label's share of an edge, whose faces are `spokes`.
    fn mask_edge(&mut self, complex: &Complex, class: u32, spokes: Range<usize>) {
        let far = self.spokes[spokes.start].far;
        let label = complex.nodes[far as usize].label;
        // A far node without a near one of its label: a tet of mixed labels, which no valid mesh has.
        let Ok(near) = self.near.binary_search_by_key(&label, |&(label, _)| label) else { return };
        let near = self.near[near].1;
        let start = self.rings.len() as u32;
        let on_ring = |i: &usize| class == 1 || (class == 2 && self.surface[*i]);
        self.rings.extend(spokes.filter(on_ring).map(|i| self.spokes[i].other));
        let end = self.rings.len() as u32;
        let mask = NodeMask { start, end, ..NodeMask::stay(near, far) };
        self.masks.push(match (class, end - start) {
            (1, k) if k > 0 => NodeMask { own: 5 * k, ring: 6, den: 16 * k, ..mask },
            (2, 2) => NodeMask { own: 3, ring: 1, den: 8, ..mask },
            _ => NodeMask { end: start, ..mask },
        });
    }
}

/// Removes repetitions that follow one another in `list[start..]`.
fn dedup_from(list: &mut Vec<u32>, start: usize) {
    let mut kept = start;
    for i in start..list.len() {
        if i == start || list[i] != list[kept - 1] {
            list[kept] = list[i];
            kept += 1;
        }
    }
    list.truncate(kept);
}
