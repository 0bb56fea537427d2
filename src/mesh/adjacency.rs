//! Stars: which tets touch a vertex.

use super::{TetMesh, VertexId};

/// Local corners of the four faces of a positive tet; face i is opposite corner i and seen anticlockwise from outside.
pub const FACES: [[usize; 3]; 4] = [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]];

/// The edges of a tet, by its corners.
pub const EDGES: [[usize; 2]; 6] = [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// Tets around each vertex, as compressed rows; tets ascend within a row.
#[derive(Debug, Clone)]
pub struct StarTable {
    start: Vec<u32>,
    tets: Vec<u32>,
}

impl StarTable {
    /// Builds the table by a counting sort over corners: time and space are linear in the mesh.
    pub fn new(mesh: &TetMesh) -> Self {
        let mut start = vec![0u32; mesh.positions.len() + 1];
        for tet in 0..mesh.tets.len() {
            for v in mesh.tet_vertices(tet) {
                start[v.index() + 1] += 1;
            }
        }
        for v in 1..start.len() {
            start[v] += start[v - 1];
        }
        let mut next = start.clone();
        let mut tets = vec![0u32; mesh.tets.len() * 4];
        for tet in 0..mesh.tets.len() {
            for v in mesh.tet_vertices(tet) {
                tets[next[v.index()] as usize] = tet as u32;
                next[v.index()] += 1;
            }
        }
        Self { start, tets }
    }

    /// The star of `vertex`: numbers of the tets that touch it, ascending.
    #[inline]
    pub fn star(&self, vertex: VertexId) -> &[u32] {
        &self.tets[self.start[vertex.index()] as usize..self.start[vertex.index() + 1] as usize]
    }
}
