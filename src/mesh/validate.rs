//! Whether a mesh tiles its box.

use thiserror::Error;

use super::{FACES, TetMesh, volume6};

/// What is wrong with a mesh.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MeshError {
    /// A tet names a wedge, or a wedge a vertex, that does not exist.
    #[error("tet {tet}: wedge or vertex out of range")]
    Reference {
        /// Number of the tet.
        tet: usize,
    },
    /// A tet's wedges carry different labels.
    #[error("tet {tet}: corners of different labels")]
    MixedLabels {
        /// Number of the tet.
        tet: usize,
    },
    /// A tet is flat or inverted.
    #[error("tet {tet}: expected positive volume, found {volume6}/6")]
    NotPositive {
        /// Number of the tet.
        tet: usize,
        /// Six times its signed volume, in cubic lattice units.
        volume6: i64,
    },
    /// A face has a number of tets that a tiling cannot have.
    #[error("face {face:?}: expected {expected} tets, found {found}")]
    Face {
        /// Its vertices, ascending.
        face: [u32; 3],
        /// 1 on a side of the box, 2 inside.
        expected: usize,
        /// Tets that have this face.
        found: usize,
    },
    /// Volumes do not add up to the box.
    #[error("volume: expected {expected}/6, found {found}/6")]
    Volume {
        /// Six times the box's volume in cubic lattice units.
        expected: i64,
        /// The sum over tets.
        found: i64,
    },
}

/// Checks that `mesh` tiles its whole box: references in range, one label a tet, all tets positive, every face shared
/// by two tets (one on the sides of the box), volumes adding up exactly.
///
/// # Errors
/// The first violation found, in the order of [`MeshError`]'s variants.
pub fn validate(mesh: &TetMesh) -> Result<(), MeshError> {
    let (wedges, vertices) = (mesh.wedges.len(), mesh.positions.len());
    let mut found = 0i64;
    for (tet, corners) in mesh.tets.iter().enumerate() {
        if corners.iter().any(|w| w.index() >= wedges || mesh.wedges[w.index()].vertex.index() >= vertices) {
            return Err(MeshError::Reference { tet });
        }
        if corners.iter().any(|w| mesh.wedges[w.index()].label != mesh.tet_label(tet)) {
            return Err(MeshError::MixedLabels { tet });
        }
        let [a, b, c, d] = mesh.tet_positions(tet);
        let volume6 = volume6(a, b, c, d);
        if volume6 <= 0 {
            return Err(MeshError::NotPositive { tet, volume6 });
        }
        found += volume6;
    }
    check_faces(mesh)?;
    let expected = mesh.domain.volume6();
    if found == expected { Ok(()) } else { Err(MeshError::Volume { expected, found }) }
}

fn check_faces(mesh: &TetMesh) -> Result<(), MeshError> {
    let mut faces: Vec<[u32; 3]> = Vec::with_capacity(mesh.tets.len() * 4);
    for tet in 0..mesh.tets.len() {
        let v = mesh.tet_vertices(tet);
        for face in FACES {
            let mut key = face.map(|corner| v[corner].0);
            key.sort_unstable();
            faces.push(key);
        }
    }
    faces.sort_unstable();
    for group in faces.chunk_by(|a, b| a == b) {
        let face = group[0];
        let sides = face
            .map(|v| mesh.domain.sides(mesh.positions[v as usize]))
            .into_iter()
            .reduce(|a, b| a.and(b))
            .unwrap_or_default();
        let expected = if sides.is_interior() { 2 } else { 1 };
        if group.len() != expected {
            return Err(MeshError::Face { face, expected, found: group.len() });
        }
    }
    Ok(())
}
