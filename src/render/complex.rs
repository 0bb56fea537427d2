//! The mesh as subdivision sees it: points, their labelled shares (nodes), and tets over nodes.
//!
//! Forbidden here: colours and weights; this is what both have in common.

use glam::IVec3;

use crate::mesh::{MeshCounts, MeshTail, Sides, TetMesh};
use crate::video::Label;

/// Binary digits that refined positions have beyond those of the control mesh: masks divide, and what they give is
/// rounded to 2^-`FINE_BITS` lattice units. At 1/8 px this is 1/1024 px, at which the design's prototype cracked
/// nowhere; two levels of midpoints need two digits, so pinned edges split exactly.
pub const FINE_BITS: u32 = 7;

/// One label's share of a point; the refined counterpart of a wedge.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Node {
    /// Number of its point.
    pub point: u32,
    /// Its label.
    pub label: Label,
}

/// A mesh at some level of subdivision, without colours.
#[derive(Debug, Clone, Default)]
pub(super) struct Complex {
    /// (x, y, t) in fine units: 2^-[`FINE_BITS`] of a lattice unit.
    pub(super) points: Vec<IVec3>,
    /// Points that the next level must not move; as long as `points`.
    pub(super) pinned: Vec<bool>,
    /// Sides of the box that a point belongs to; as long as `points`. From level 1 on they are inherited, so that
    /// they hold whatever rounding did.
    pub(super) sides: Vec<Sides>,
    /// Shares of points.
    pub(super) nodes: Vec<Node>,
    /// Tets over nodes, positively oriented at level 0.
    pub(super) tets: Vec<[u32; 4]>,
    /// The box's end in time in fine units, as of the last tail; `None` before the first, and from level 1 on.
    top: Option<i32>,
}

impl Complex {
    /// The control mesh as level 0.
    pub(super) fn new(mesh: &TetMesh) -> Self {
        let mut complex = Self::default();
        complex.extend(mesh);
        complex
    }

    /// Nothing, in the memory of this one.
    pub(super) fn emptied(self) -> Self {
        Self {
            points: emptied(self.points),
            pinned: emptied(self.pinned),
            sides: emptied(self.sides),
            nodes: emptied(self.nodes),
            tets: emptied(self.tets),
            top: None,
        }
    }

    /// Takes in what `mesh` gained at the ends of its arrays since the last call, and the present state of pins.
    /// Returns the points that changed sides.
    pub(super) fn extend(&mut self, mesh: &TetMesh) -> Vec<u32> {
        let (vertices, wedges, tets) = (self.points.len(), self.nodes.len(), self.tets.len());
        let moved = self.append(&mesh.tail(MeshCounts { vertices, wedges, tets }));
        self.pinned.clone_from(&mesh.pinned);
        moved
    }

    /// Appends what a mesh gained. Returns the points that changed sides, as they do when a slab's duration becomes known
    /// after its vertices.
    pub(super) fn append(&mut self, tail: &MeshTail<'_>) -> Vec<u32> {
        let top = tail.domain.extent().z << FINE_BITS;
        let mut moved = Vec::new();
        if let Some(before) = self.top.replace(top).filter(|&before| before != top) {
            for (point, position) in self.points.iter().enumerate().filter(|(_, p)| p.z == before || p.z == top) {
                let now = tail.domain.sides(*position >> FINE_BITS as i32);
                if std::mem::replace(&mut self.sides[point], now) != now {
                    moved.push(point as u32);
                }
            }
        }
        for &position in tail.positions {
            self.points.push(position << FINE_BITS as i32);
            self.sides.push(tail.domain.sides(position));
        }
        self.pinned.extend_from_slice(tail.pinned);
        self.nodes.extend(tail.wedges.iter().map(|wedge| Node { point: wedge.vertex.0, label: wedge.label }));
        self.tets.extend(tail.tets.iter().map(|corners| corners.map(|wedge| wedge.0)));
        moved
    }

    /// The point of a node.
    #[inline]
    pub(super) fn point(&self, node: u32) -> u32 {
        self.nodes[node as usize].point
    }

    /// The position of a node, in fine units.
    #[inline]
    pub(super) fn position(&self, node: u32) -> IVec3 {
        self.points[self.point(node) as usize]
    }

    /// The sides of the box that a node's point belongs to.
    #[inline]
    pub(super) fn sides(&self, node: u32) -> Sides {
        self.sides[self.point(node) as usize]
    }
}

/// A list without items in the memory of this one.
pub(super) fn emptied<T>(mut list: Vec<T>) -> Vec<T> {
    list.clear();
    list
}

/// Tets around each point, in a form that grows with the mesh: a list through the corners of tets, ascending.
#[derive(Debug, Clone, Default)]
pub(super) struct Stars {
    /// First and last corner of a point's list; a corner is 4 * tet + place.
    ends: Vec<[u32; 2]>,
    /// The next corner of the same point.
    next: Vec<u32>,
}

const NONE: u32 = u32::MAX;

impl Stars {
    /// Stars of a whole complex.
    pub(super) fn new(complex: &Complex) -> Self {
        let mut stars = Self::default();
        stars.extend(complex);
        stars
    }

    /// Takes in the points and tets that `complex` gained since the last call.
    pub(super) fn extend(&mut self, complex: &Complex) {
        self.ends.resize(complex.points.len(), [NONE; 2]);
        for tet in self.next.len() / 4..complex.tets.len() {
            for (place, &node) in complex.tets[tet].iter().enumerate() {
                let corner = (4 * tet + place) as u32;
                self.next.push(NONE);
                let [first, last] = &mut self.ends[complex.point(node) as usize];
                if *first == NONE {
                    *first = corner;
                } else {
                    self.next[*last as usize] = corner;
                }
                *last = corner;
            }
        }
    }

    /// The star of `point`: (number of a tet, the corner of it that is `point`), tets ascending.
    pub(super) fn star(&self, point: u32) -> impl Iterator<Item = (usize, usize)> {
        let mut corner = self.ends[point as usize][0];
        std::iter::from_fn(move || {
            if corner == NONE {
                return None;
            }
            let here = corner;
            corner = self.next[here as usize];
            Some((here as usize / 4, here as usize % 4))
        })
    }
}
