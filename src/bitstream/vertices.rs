//! What the coding asks of a vertex again and again, side by side.
//!
//! In: vertices as they are coded. Out: one line of the cache for each. Forbidden here: what the fields are for is the
//! matter of the modules that they belong to.
//!
//! A packet touches every vertex near its time, in whatever part of memory it lies, and waiting for memory is most of the
//! time that coding takes: so columns, one a purpose, would each cost a wait.

use std::ops::{Index, IndexMut};

use glam::IVec3;

use super::front::Corner;
use super::stars::Star;
use crate::mesh::VertexId;

/// The bit of the slab's end among the sides of the box.
pub(super) const TOP: u8 = 1 << 5;

/// A coded vertex.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Vertex {
    /// In lattice units.
    pub(super) position: IVec3,
    /// Running mean of the extents of the edges at it ([`super::extents`]).
    pub(super) extent: IVec3,
    /// Where the list of its open faces ends.
    pub(super) open: Corner,
    /// Its coded tets, where hops are passed on.
    pub(super) star: Star,
    /// How many of them had been told a hop of this vertex, and which.
    pub(super) told_tets: u32,
    pub(super) told_hop: u8,
    /// The sides of the box that it lies on, as bits; the end of the slab is one once it is known.
    pub(super) sides: u8,
    pub(super) wedges: Wedges,
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
    pub(super) fn push(&mut self, position: IVec3, sides: u8, open: Corner) {
        self.0.push(Vertex {
            position,
            extent: IVec3::ZERO,
            open,
            star: Star::EMPTY,
            told_tets: 0,
            told_hop: u8::MAX,
            sides,
            wedges: Wedges { youngest: u32::MAX, label: 0, count: 0 },
        });
    }

    /// The slab ends at `top`.
    pub(super) fn mark_top(&mut self, top: i32) {
        for vertex in self.0.iter_mut().filter(|vertex| vertex.position.z == top) {
            vertex.sides |= TOP;
        }
    }

    pub(super) fn len(&self) -> usize {
        self.0.len()
    }

    #[inline]
    pub(super) fn position(&self, vertex: VertexId) -> IVec3 {
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
