//! Vertices of the front near a gate, ranked: where an apex is looked for that lies across none of the gate's edges.
//!
//! In: the front, a gate. Out: vertices, the most likely first. Forbidden here: coding.

use super::front::Front;
use super::gate::{Gate, SCAN, plane};
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Finds the rings around gates. Kept from gate to gate for its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    /// Per vertex the last search that met it.
    met: Vec<u32>,
    search: u32,
    /// Vertices of the ring, and of the one before.
    ring: Vec<VertexId>,
    inner: Vec<VertexId>,
    /// Those of the ring by distance: its bits, which order what is not negative just so, then the vertex.
    places: Vec<u64>,
}

impl Rings {
    /// Near vertices: other corners of the open faces at the gate's corners. They are ranked without those `asked`.
    pub(super) fn near(
        &mut self,
        front: &Front,
        vertices: &Vertices,
        gate: &Gate,
        asked: [VertexId; 3],
    ) -> Ranking<'_> {
        self.find_near(front, vertices, gate);
        self.rank(vertices, gate, asked)
    }

    /// Far vertices: the same one ring farther, without those of the first.
    pub(super) fn far(&mut self, front: &Front, vertices: &Vertices, gate: &Gate, asked: [VertexId; 3]) -> Ranking<'_> {
        self.find_near(front, vertices, gate);
        std::mem::swap(&mut self.ring, &mut self.inner);
        self.find_ring(front, vertices);
        self.rank(vertices, gate, asked)
    }

    fn find_near(&mut self, front: &Front, vertices: &Vertices, gate: &Gate) {
        self.met.resize(vertices.len(), 0);
        self.search += 1;
        self.inner.clear();
        self.inner.extend(gate.corners);
        self.find_ring(front, vertices);
    }

    /// Other corners of the youngest open faces around the inner vertices that this search has not met yet.
    fn find_ring(&mut self, front: &Front, vertices: &Vertices) {
        self.ring.clear();
        for &vertex in &self.inner {
            for corner in front.at(vertices, vertex).take(SCAN) {
                let [_, second, third] = front.vertices_from(corner);
                for other in [second, third] {
                    let met = &mut self.met[other.index()];
                    if *met != self.search {
                        *met = self.search;
                        self.ring.push(other);
                    }
                }
            }
        }
    }

    fn rank(&mut self, vertices: &Vertices, gate: &Gate, asked: [VertexId; 3]) -> Ranking<'_> {
        let [a, b, c] = gate.corners.map(|v| vertices.position(v));
        let plane = plane([a, b, c]);
        let is_positive = |v: VertexId| plane.dot((vertices.position(v) - a).as_i64vec3()) > 0;
        let place = |v: VertexId| u64::from(gate.distance2(vertices, v).to_bits()) << 32 | u64::from(v.0);
        let found = self.ring.iter().copied().filter(|&v| is_positive(v) && !asked.contains(&v));
        self.places.clear();
        self.places.extend(found.map(place));
        Ranking { places: &mut self.places }
    }
}

/// Vertices in the order of their distance from a gate, then of their ids; only those that could be its apex. They are not
/// sorted: it is the first of them nearly always.
pub(super) struct Ranking<'a> {
    places: &'a mut Vec<u64>,
}

impl Iterator for Ranking<'_> {
    type Item = VertexId;

    fn next(&mut self) -> Option<VertexId> {
        let (place, &nearest) = self.places.iter().enumerate().min_by_key(|&(_, nearest)| nearest)?;
        self.places.swap_remove(place);
        Some(VertexId(nearest as u32))
    }
}
