//! The control mesh: what the stages hand on, the stream carries and the renderer draws.

use glam::{IVec3, Vec3};

use super::{Domain, VertexId, WedgeId};
use crate::video::Label;

/// One label's share of a vertex. A vertex inside a label has one wedge, a K-class boundary vertex (§III-B) has K.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wedge {
    /// The vertex whose position this wedge shares.
    pub vertex: VertexId,
    /// The label on this side; wedges of one vertex have different labels.
    pub label: Label,
    /// RGB in 8-bit levels; may lie outside [0, 255], the renderer clamps.
    pub color: Vec3,
}

/// A tetrahedral mesh over a slab's box (or part of it), flat arrays throughout.
///
/// Tets refer to wedges: a tet's four wedges carry the same label, which is the tet's label, and its vertices are the
/// wedges' vertices. Tets are positively oriented: [`super::volume6`] of the four positions is > 0.
#[derive(Debug, Clone, PartialEq)]
pub struct TetMesh {
    /// The box and the lattice of positions.
    pub domain: Domain,
    /// (x, y, t) of each vertex in lattice units, t since the slab's first frame.
    pub positions: Vec<IVec3>,
    /// Vertices that subdivision must not move: where smoothing would fold the mesh over, the encoder pins.
    /// As long as `positions`.
    pub pinned: Vec<bool>,
    /// Colours, one a vertex and label.
    pub wedges: Vec<Wedge>,
    /// Four wedges a tet.
    pub tets: Vec<[WedgeId; 4]>,
}

/// Lengths of a mesh's arrays, as far as somebody knows them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct MeshCounts {
    /// Of positions and pins.
    pub vertices: usize,
    /// Of wedges.
    pub wedges: usize,
    /// Of tets.
    pub tets: usize,
}

/// The ends of a mesh's arrays. Ids in it count from the mesh's beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshTail<'a> {
    /// The box and the lattice of positions of the whole mesh.
    pub domain: Domain,
    /// As of [`TetMesh::positions`].
    pub positions: &'a [IVec3],
    /// As of [`TetMesh::pinned`].
    pub pinned: &'a [bool],
    /// As of [`TetMesh::wedges`].
    pub wedges: &'a [Wedge],
    /// As of [`TetMesh::tets`].
    pub tets: &'a [[WedgeId; 4]],
}

impl MeshTail<'_> {
    /// A copy, in the arrays of a mesh that has nothing before them.
    pub fn to_mesh(&self) -> TetMesh {
        TetMesh {
            domain: self.domain,
            positions: self.positions.to_vec(),
            pinned: self.pinned.to_vec(),
            wedges: self.wedges.to_vec(),
            tets: self.tets.to_vec(),
        }
    }
}

impl TetMesh {
    /// A mesh without vertices.
    pub fn empty(domain: Domain) -> Self {
        Self { domain, positions: Vec::new(), pinned: Vec::new(), wedges: Vec::new(), tets: Vec::new() }
    }

    /// Lengths of the arrays.
    pub fn counts(&self) -> MeshCounts {
        MeshCounts { vertices: self.positions.len(), wedges: self.wedges.len(), tets: self.tets.len() }
    }

    /// What is beyond `known`, which is at most [`Self::counts`].
    pub fn tail(&self, known: MeshCounts) -> MeshTail<'_> {
        MeshTail {
            domain: self.domain,
            positions: &self.positions[known.vertices..],
            pinned: &self.pinned[known.vertices..],
            wedges: &self.wedges[known.wedges..],
            tets: &self.tets[known.tets..],
        }
    }

    /// Appends a vertex.
    pub fn push_vertex(&mut self, position: IVec3) -> VertexId {
        self.positions.push(position);
        self.pinned.push(false);
        VertexId(self.positions.len() as u32 - 1)
    }

    /// Appends a wedge.
    pub fn push_wedge(&mut self, wedge: Wedge) -> WedgeId {
        self.wedges.push(wedge);
        WedgeId(self.wedges.len() as u32 - 1)
    }

    /// The vertex of a wedge.
    #[inline]
    pub fn vertex(&self, wedge: WedgeId) -> VertexId {
        self.wedges[wedge.index()].vertex
    }

    /// The position of a wedge, in lattice units.
    #[inline]
    pub fn position(&self, wedge: WedgeId) -> IVec3 {
        self.positions[self.vertex(wedge).index()]
    }

    /// The four vertices of tet number `tet`.
    #[inline]
    pub fn tet_vertices(&self, tet: usize) -> [VertexId; 4] {
        self.tets[tet].map(|w| self.vertex(w))
    }

    /// The four positions of tet number `tet`, in lattice units.
    #[inline]
    pub fn tet_positions(&self, tet: usize) -> [IVec3; 4] {
        self.tets[tet].map(|w| self.position(w))
    }

    /// The label of tet number `tet`.
    #[inline]
    pub fn tet_label(&self, tet: usize) -> Label {
        self.wedges[self.tets[tet][0].index()].label
    }
}
