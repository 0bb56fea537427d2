//! Vertices of the front near a gate, ranked: where an apex is looked for that lies across none of the gate's edges.
//!
//! In: the front, a gate. Out: vertices, the most likely first. Forbidden here: coding.

use super::front::Front;
use super::gate::{Gate, SCAN};
use super::normals::{cross, dot};
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Finds the rings around gates. Kept from gate to gate for its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    near: Vec<Place>,
    far: Vec<Place>,
    /// Neighbours of the gate's corners, whether near or not.
    ring: Vec<VertexId>,
}

/// A vertex by its distance from a gate: the bits of that, which order what is not negative just so, then the vertex.
type Place = u64;

impl Rings {
    /// Near vertices: neighbours of the gate's corners. They are ranked without those `asked`.
    pub(super) fn near(
        &mut self,
        front: &Front,
        vertices: &Vertices,
        gate: &Gate,
        asked: [VertexId; 3],
    ) -> Ranking<'_> {
        self.near.clear();
        find_around(&gate.corners, (front, vertices), gate, asked, &mut self.near);
        Ranking { places: &self.near, others: &[], last: 0 }
    }

    /// Far vertices: neighbours of the near ones that are not near.
    pub(super) fn far(&mut self, front: &Front, vertices: &Vertices, gate: &Gate, asked: [VertexId; 3]) -> Ranking<'_> {
        self.near(front, vertices, gate, asked);
        self.near.sort_unstable();
        self.ring.clear();
        for vertex in gate.corners {
            for_each_neighbour(front, vertices, vertex, |other| self.ring.push(other));
        }
        self.ring.sort_unstable();
        self.ring.dedup();
        self.far.clear();
        find_around(&self.ring, (front, vertices), gate, asked, &mut self.far);
        Ranking { places: &self.far, others: &self.near, last: 0 }
    }
}

fn vertex(place: Place) -> VertexId {
    VertexId(place as u32)
}

/// Takes note of the neighbours of some vertices that make a positive tet with the gate, as often as they are met.
fn find_around(
    around: &[VertexId],
    (front, vertices): (&Front, &Vertices),
    gate: &Gate,
    asked: [VertexId; 3],
    found: &mut Vec<Place>,
) {
    let [a, b, c] = gate.corners.map(|v| vertices.position(v));
    let plane = cross(b - a, c - a);
    let mut take_note = |vertex: VertexId| {
        let is_positive = dot(plane, vertices.position(vertex) - a) > 0.0;
        if is_positive & !asked.contains(&vertex) & !gate.corners.contains(&vertex) {
            found.push(u64::from(gate.distance2(vertices, vertex).to_bits()) << 32 | u64::from(vertex.0));
        }
    };
    for &vertex in around {
        for_each_neighbour(front, vertices, vertex, &mut take_note);
    }
}

/// Other corners of the youngest open faces at a vertex: the second one of each, and the third where there is no partner
/// whose second it is.
fn for_each_neighbour(front: &Front, vertices: &Vertices, vertex: VertexId, mut take_note: impl FnMut(VertexId)) {
    for corner in front.at(vertices, vertex).take(SCAN) {
        let [_, second, third] = front.vertices_from(corner);
        take_note(second);
        if !front.has_partner(corner.previous()) {
            take_note(third);
        }
    }
}

/// Vertices in the order of their distance from a gate, then of their ids; only those that could be its apex. They are not
/// sorted: it is the first of them nearly always.
pub(super) struct Ranking<'a> {
    places: &'a [Place],
    /// Those left out, sorted.
    others: &'a [Place],
    /// The last one found.
    last: Place,
}

impl Iterator for Ranking<'_> {
    type Item = VertexId;

    fn next(&mut self) -> Option<VertexId> {
        loop {
            self.last = self.places.iter().copied().filter(|&place| place > self.last).min()?;
            if self.others.binary_search(&self.last).is_err() {
                return Some(vertex(self.last));
            }
        }
    }
}
