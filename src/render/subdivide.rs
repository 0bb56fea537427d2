//! Subdivision of a whole mesh (§V), for whoever fits through it: geometry here, colours by [`super::color_masks`].
//!
//! What is drawn is refined piece by piece, by the same masks to the same positions.

use glam::IVec3;

use super::complex::{Complex, Node};
use super::level::Level;
use crate::mesh::TetMesh;
use crate::video::Label;

/// A subdivided mesh, without colours.
#[derive(Debug, Clone, PartialEq)]
pub struct Refined {
    /// (x, y, t) of every fine vertex in fine units: 2^-[`super::FINE_BITS`] of the control mesh's lattice unit. The
    /// first ones are the vertex points of the control vertices, in their order.
    pub points: Vec<IVec3>,
    /// Fine wedges; the first ones are those of the control wedges, in their order.
    pub nodes: Vec<Node>,
    /// Fine tets over nodes, 8 a parent and level: the control tet of tet i is i / 8^levels. A child is positive
    /// where its parent is, unless smoothing folded it over.
    pub tets: Vec<[u32; 4]>,
}

impl Refined {
    /// Positions of a tet's corners, in fine units.
    #[inline]
    pub fn tet_positions(&self, tet: usize) -> [IVec3; 4] {
        self.tets[tet].map(|node| self.points[self.nodes[node as usize].point as usize])
    }

    /// The label of a tet.
    #[inline]
    pub fn tet_label(&self, tet: usize) -> Label {
        self.nodes[self.tets[tet][0] as usize].label
    }

    /// Six times the signed volume of a tet in cubic fine units, exact; negative where smoothing folded it over.
    pub fn volume6(&self, tet: usize) -> i128 {
        let [a, b, c, d] = self.tet_positions(tet);
        let [u, v, w] = [b - a, c - a, d - a].map(|e| e.to_array().map(i128::from));
        (u[1] * v[2] - u[2] * v[1]) * w[0] + (u[2] * v[0] - u[0] * v[2]) * w[1] + (u[0] * v[1] - u[1] * v[0]) * w[2]
    }
}

/// Subdivides `mesh` `levels` times, into 8^levels as many tets; with 0 levels the result is the mesh itself in fine units.
///
/// `mesh` may be a part of a tiling: where stars are incomplete, so are the rings of masks.
pub fn subdivide(mesh: &TetMesh, levels: u8) -> Refined {
    let mut complex = Complex::new(mesh);
    for _ in 0..levels {
        complex = Level::new(&complex).complex;
    }
    Refined { points: complex.points, nodes: complex.nodes, tets: complex.tets }
}
