//! What the coding asks of a vertex again and again, side by side.
//!
//! In: vertices as they are coded. Out: one line of the cache for each. Forbidden here: what the fields are for is the
//! matter of the modules that they belong to.
//!
//! A packet touches every vertex near its time, in whatever part of memory it lies, and waiting for memory is most of the
//! time that coding takes: so columns, one a purpose, would each cost a wait.

use std::ops::{Index, IndexMut};

use glam::Vec3A;

use super::front::Corner;
use crate::mesh::VertexId;

/// The bit of the slab's end among the sides of the box.
pub(super) const TOP: u8 = 1 << 5;

/// A coded vertex.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Vertex {
    /// In lattice units.
    pub(super) position: Vec3A,
    /// Running mean of the extents of the edges at it ([`super::extents`]).
    pub(super) extent: Vec3A,
    /// [`Linked`] vertices: those at the other ends of its edges.
    pub(super) linked: Linked,
    /// Where the list of its open faces ends.
    pub(super) open: Corner,
    pub(super) wedges: Wedges,
    /// The sides of the box that it lies on, as bits; the end of the slab is one once it is known.
    pub(super) sides: u8,
}

/// A set of vertices in one word: it tells of most vertices that they are not in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Linked(u64);

impl Linked {
    pub(super) const NOTHING: Self = Self(0);

    /// This vertex alone.
    #[inline]
    pub(super) fn one(vertex: VertexId) -> Self {
        Self(1 << (vertex.0 % u64::BITS))
    }

    #[inline]
    pub(super) fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether the two may have a vertex in common.
    #[inline]
    pub(super) fn may_meet(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }
}

/// The wedges of a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Wedges {
    /// The youngest; it leads to the others.
    pub(super) youngest: u32,
    /// Its label.
    pub(super) label: u32,
    pub(super) count: u16,
}

/// All coded vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Vertices(Vec<Vertex>);

impl Vertices {
    pub(super) fn push(&mut self, position: Vec3A, sides: u8, open: Corner) {
        self.0.push(Vertex {
            position,
            extent: Vec3A::ZERO,
            linked: Linked::NOTHING,
            open,
            wedges: Wedges { youngest: u32::MAX, label: 0, count: 0 },
            sides,
        });
    }

    /// Makes room for so many more.
    pub(super) fn reserve(&mut self, count: usize) {
        self.0.reserve(count);
    }

    /// The slab ends at `top`.
    pub(super) fn mark_top(&mut self, top: f32) {
        for vertex in self.0.iter_mut().filter(|vertex| vertex.position.z == top) {
            vertex.sides |= TOP;
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    #[inline]
    pub(super) fn position(&self, vertex: VertexId) -> Vec3A {
        self[vertex].position
    }
}

impl Index<VertexId> for Vertices {
    type Output = Vertex;

    #[inline]
    fn index(&self, vertex: VertexId) -> &Vertex {
        &self.0[vertex.index()]
    }
}

impl IndexMut<VertexId> for Vertices {
    #[inline]
    fn index_mut(&mut self, vertex: VertexId) -> &mut Vertex {
        &mut self.0[vertex.index()]
    }
}

const _: () = assert!(size_of::<Vertex>() == 64);
