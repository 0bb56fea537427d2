//! Vertices of the front near a gate, ranked: where an apex is looked for that lies across none of the gate's edges.
//!
//! In: the front, a gate. Out: vertices, the most likely first. Forbidden here: coding.

use glam::Vec4;

use super::front::Front;
use super::gate::{Gate, SCAN};
use super::normals::cross;
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Finds the rings around gates. Kept from gate to gate for its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct Rings {
    /// Neighbours of the gate's corners, whether near or not.
    ring: Vec<VertexId>,
    /// Neighbours of these.
    next_ring: Vec<VertexId>,
    places: Vec<Place>,
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
        collect_around(&gate.corners, (front, vertices), &mut self.ring);
        find_before(&self.ring, vertices, gate, &mut self.places);
        Ranking { places: &self.places, others: [gate.corners, asked], ring: &[], last: 0 }
    }

    /// Far vertices: neighbours of the gate's corners' neighbours, near or not, that are not near.
    pub(super) fn far(&mut self, front: &Front, vertices: &Vertices, gate: &Gate, asked: [VertexId; 3]) -> Ranking<'_> {
        collect_around(&gate.corners, (front, vertices), &mut self.ring);
        self.ring.sort_unstable();
        self.ring.dedup();
        collect_around(&self.ring, (front, vertices), &mut self.next_ring);
        find_before(&self.next_ring, vertices, gate, &mut self.places);
        // Of the ring those that are before the gate are near, and no others are looked for.
        Ranking { places: &self.places, others: [gate.corners, asked], ring: &self.ring, last: 0 }
    }
}

fn vertex(place: Place) -> VertexId {
    VertexId(place as u32)
}

/// Other corners of the youngest open faces at some vertices, as often as they are met: the second one of each, and the
/// third where there is no partner whose second it is.
fn collect_around(around: &[VertexId], (front, vertices): (&Front, &Vertices), found: &mut Vec<VertexId>) {
    found.clear();
    for &vertex in around {
        for corner in front.at(vertices, vertex).take(SCAN) {
            found.push(front.vertex(corner.next()));
            let third = corner.previous();
            if !front.has_partner(third) {
                found.push(front.vertex(third));
            }
        }
    }
}

/// Those of some vertices that make a positive tet with the gate, by their distance from it: four at a time, and without
/// branches, as which they are is as good as random.
fn find_before(ring: &[VertexId], vertices: &Vertices, gate: &Gate, found: &mut Vec<Place>) {
    let [a, b, c] = gate.corners.map(|v| vertices.position(v));
    let plane = cross(b - a, c - a);
    found.clear();
    for four in ring.chunks(LANES) {
        // After the last one the gate's first corner, which is not before it.
        let ids: [VertexId; LANES] = std::array::from_fn(|lane| *four.get(lane).unwrap_or(&gate.corners[0]));
        let [p, q, r, s] = ids.map(|v| vertices.position(v));
        let [x, y, t] = [Vec4::new(p.x, q.x, r.x, s.x), Vec4::new(p.y, q.y, r.y, s.y), Vec4::new(p.z, q.z, r.z, s.z)];
        let height = plane.x * (x - a.x) + plane.y * (y - a.y) + plane.z * (t - a.z);
        let (height, distance2) = (height.to_array(), gate.distances2([x, y, t]).to_array());
        let mut here = [0; LANES];
        let mut count = 0;
        for lane in 0..LANES {
            here[count % LANES] = u64::from(distance2[lane].to_bits()) << 32 | u64::from(ids[lane].0);
            count += usize::from(height[lane] > 0.0);
        }
        let known = found.len();
        found.extend(here);
        found.truncate(known + count);
    }
}

/// Vertices that are measured at a time.
const LANES: usize = 4;

/// Vertices in the order of their distance from a gate, then of their ids; only those that could be its apex. They are not
/// sorted: it is the first of them nearly always.
pub(super) struct Ranking<'a> {
    places: &'a [Place],
    /// Those left out.
    others: [[VertexId; 3]; 2],
    /// Those left out, too.
    ring: &'a [VertexId],
    /// The last one found.
    last: Place,
}

impl Iterator for Ranking<'_> {
    type Item = VertexId;

    fn next(&mut self) -> Option<VertexId> {
        loop {
            self.last = self.places.iter().copied().filter(|&place| place > self.last).min()?;
            let found = vertex(self.last);
            if !self.others.as_flattened().contains(&found) && !self.ring.contains(&found) {
                return Some(found);
            }
        }
    }
}
