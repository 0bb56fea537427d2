//! Vertices of the front near a gate, ranked: where an apex is looked for that lies across none of the gate's edges.
//!
//! In: the front, a gate. Out: vertices, the most likely first. Forbidden here: coding.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::connectivity::{Gate, SCAN};
use super::front::Front;
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Finds the rings around gates. Kept from gate to gate for its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    /// Per vertex the last search that met it.
    met: Vec<u32>,
    search: u32,
}

impl Rings {
    /// Near vertices: other corners of the open faces at the gate's corners.
    pub(super) fn near(&mut self, front: &Front, vertices: &Vertices, gate: &Gate) -> Vec<VertexId> {
        self.met.resize(vertices.len(), 0);
        self.search += 1;
        self.ring(front, vertices, &gate.corners)
    }

    /// Far vertices: the same one ring farther, without those of the first.
    pub(super) fn far(&mut self, front: &Front, vertices: &Vertices, gate: &Gate) -> Vec<VertexId> {
        let first = self.near(front, vertices, gate);
        self.ring(front, vertices, &first)
    }

    /// Other corners of the youngest open faces `around` some vertices that this search has not met yet.
    fn ring(&mut self, front: &Front, vertices: &Vertices, around: &[VertexId]) -> Vec<VertexId> {
        let mut found = Vec::with_capacity(8 * around.len());
        for &vertex in around {
            for spoke in front.at(vertices, vertex).take(SCAN) {
                for other in [spoke.second, spoke.third] {
                    let met = &mut self.met[other.index()];
                    if *met != self.search {
                        *met = self.search;
                        found.push(other);
                    }
                }
            }
        }
        found
    }
}

/// Vertices in the order of their distance from a gate, then of their ids; only those that could be its apex and are
/// not its candidates. A heap, not a sorted list: it is the first of them nearly always.
pub(super) struct Ranking<'a> {
    coded: &'a Vertices,
    gate: &'a Gate,
    /// Distances, not negative, by their bits, which order them just so.
    vertices: BinaryHeap<Reverse<(u64, VertexId)>>,
}

impl<'a> Ranking<'a> {
    pub(super) fn new(coded: &'a Vertices, gate: &'a Gate, vertices: Vec<VertexId>) -> Self {
        let place = |v: VertexId| Reverse((gate.distance2(coded, v).to_bits(), v));
        Self { coded, gate, vertices: vertices.into_iter().map(place).collect() }
    }
}

impl Iterator for Ranking<'_> {
    type Item = VertexId;

    fn next(&mut self) -> Option<VertexId> {
        loop {
            let Reverse((_, nearest)) = self.vertices.pop()?;
            if !self.gate.has_candidate(nearest) && self.gate.is_positive(self.coded, nearest) {
                return Some(nearest);
            }
        }
    }
}
