//! When a packet may leave: the hop rule of docs/architecture.md, seen from the encoder.

use std::collections::VecDeque;

use crate::mesh::{StarTable, TetMesh, VertexId};

/// Distance in edges of every vertex from those before frame `k + 1`, `rings + 2` where it is greater than `rings + 1`.
///
/// The packets up to k hold the tets that touch a vertex within `rings`, and so the vertices within `rings + 1`.
pub(super) fn hops(mesh: &TetMesh, stars: &StarTable, k: u32, rings: u8) -> Vec<u8> {
    let far = rings + 2;
    let end = (k as i32 + 1).saturating_mul(mesh.domain.unit());
    let mut hops: Vec<u8> = mesh.positions.iter().map(|p| if p.z < end { 0 } else { far }).collect();
    let mut front: VecDeque<u32> = (0..hops.len() as u32).filter(|&v| hops[v as usize] == 0).collect();
    while let Some(v) = front.pop_front() {
        let next = hops[v as usize] + 1;
        if next == far {
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
