//! Vertices of the front near a gate, ranked: where an apex is looked for that lies across none of the gate's edges.
//!
//! In: the front, a gate. Out: vertices, the most likely first. Forbidden here: coding.

use super::connectivity::{Gate, SCAN};
use super::front::Front;
use crate::mesh::{TetMesh, VertexId};

/// Other corners of the open faces at the gate's corners that could be its apex and are not its candidates.
pub(super) fn near_vertices(front: &Front, mesh: &TetMesh, gate: &Gate) -> Vec<VertexId> {
    let mut near = ring(front, &gate.corners);
    near.retain(|&v| !gate.has_candidate(v) && gate.is_positive(mesh, v));
    rank(mesh, gate, near)
}

/// The same one ring farther, without those of the first.
pub(super) fn far_vertices(front: &Front, mesh: &TetMesh, gate: &Gate) -> Vec<VertexId> {
    let first = ring(front, &gate.corners);
    let mut far = ring(front, &first);
    far.retain(|v| first.binary_search(v).is_err() && !gate.has_candidate(*v) && gate.is_positive(mesh, *v));
    rank(mesh, gate, far)
}

/// Other corners of the youngest open faces at `vertices`, by id.
fn ring(front: &Front, vertices: &[VertexId]) -> Vec<VertexId> {
    let mut found = Vec::with_capacity(16 * vertices.len());
    for &vertex in vertices {
        found.extend(front.at(vertex).take(SCAN).flat_map(|(_, [_, second, third])| [second, third]));
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// By distance from the gate's centre, then by id.
fn rank(mesh: &TetMesh, gate: &Gate, vertices: Vec<VertexId>) -> Vec<VertexId> {
    let mut ranked: Vec<(f64, VertexId)> = vertices.into_iter().map(|v| (gate.distance2(mesh, v), v)).collect();
    ranked.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    ranked.into_iter().map(|(_, v)| v).collect()
}
