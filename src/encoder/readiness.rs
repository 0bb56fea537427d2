//! When a packet may leave: the hop rule of docs/architecture.md, seen from the encoder.

use std::collections::VecDeque;

use crate::bitstream::RINGS;
use crate::mesh::{StarTable, TetMesh, VertexId};

/// Hops beyond this one are not told apart.
pub(super) const FAR: u8 = RINGS + 2;

/// Distance in edges of every vertex from those before frame `k + 1`, [`FAR`] where it is greater than `RINGS + 1`.
///
/// The packets up to k hold the tets that touch a vertex within `RINGS`, and so the vertices within `RINGS + 1`.
pub(super) fn hops(mesh: &TetMesh, stars: &StarTable, k: u32) -> Vec<u8> {
    let end = (k as i32 + 1).saturating_mul(mesh.domain.unit());
    let mut hops: Vec<u8> = mesh.positions.iter().map(|p| if p.z < end { 0 } else { FAR }).collect();
    let mut front: VecDeque<u32> = (0..hops.len() as u32).filter(|&v| hops[v as usize] == 0).collect();
    while let Some(v) = front.pop_front() {
        let next = hops[v as usize] + 1;
        if next == FAR {
            break;
        }
        for &tet in stars.star(VertexId(v)) {
            for w in mesh.tet_vertices(tet as usize) {
                if hops[w.index()] > next {
                    hops[w.index()] = next;
                    front.push_back(w.0);
                }
            }
        }
    }
    hops
}
