//! The part of a mesh that a fit can change or feel.
//!
//! In: a mesh and which vertices may change. Out: a mesh of their neighbourhood, with the way back. A slab grows
//! while its older part is sent already; work and memory must follow the free part alone.

use glam::Vec3;

use crate::mesh::{FACES, TetMesh, VertexId, Wedge, WedgeId};

/// A mesh cut out around some vertices. Vertices, wedges and tets keep the order they have in the whole mesh.
#[derive(Debug, Clone)]
pub(super) struct Patch {
    /// The cut-out.
    pub(super) mesh: TetMesh,
    /// Which of its vertices may change at all.
    pub(super) free: Vec<bool>,
    /// Whether a vertex may move and be pinned: it is free and not at the rim.
    pub(super) movable: Vec<bool>,
    /// Where labels meet: vertices of several wedges.
    pub(super) boundary: Vec<bool>,
    /// Where the mesh ends short of the box's sides.
    rim: Vec<bool>,
    vertices: Vec<u32>,
    wedges: Vec<u32>,
    /// For each tet of the cut-out, its number in the whole mesh.
    pub(super) tets: Vec<u32>,
}

impl Patch {
    /// Cuts out every tet that touches a vertex within `rings` edges of `free` ones. Subdivision masks reach one ring,
    /// so the fine mesh is exact inside all tets of vertices within `rings`.
    pub(super) fn around(mesh: &TetMesh, free: &[bool], rings: u8) -> Self {
        let reached = Self::reach(mesh, free, rings);
        let touches = |tet: &u32| mesh.tet_vertices(*tet as usize).iter().any(|v| reached[v.index()]);
        Self::of_tets(mesh, free, (0..mesh.tets.len() as u32).filter(touches).collect())
    }

    /// Vertices within `rings` edges of `from`.
    pub(super) fn reach(mesh: &TetMesh, from: &[bool], rings: u8) -> Vec<bool> {
        let mut reached = from.to_vec();
        for _ in 0..rings {
            let before = reached.clone();
            for tet in 0..mesh.tets.len() {
                let corners = mesh.tet_vertices(tet);
                if corners.iter().any(|v| before[v.index()]) {
                    corners.iter().for_each(|v| reached[v.index()] = true);
                }
            }
        }
        reached
    }

    fn of_tets(mesh: &TetMesh, free: &[bool], tets: Vec<u32>) -> Self {
        const ABSENT: u32 = u32::MAX;
        let mut local_wedge = vec![ABSENT; mesh.wedges.len()];
        let mut local_vertex = vec![ABSENT; mesh.positions.len()];
        for corner in tets.iter().flat_map(|&tet| mesh.tets[tet as usize]) {
            local_wedge[corner.index()] = 0;
            local_vertex[mesh.vertex(corner).index()] = 0;
        }
        let number = |local: &mut Vec<u32>| {
            let present: Vec<u32> = (0..local.len() as u32).filter(|&i| local[i as usize] != ABSENT).collect();
            present.iter().zip(0..).for_each(|(&i, n)| local[i as usize] = n);
            present
        };
        let (vertices, wedges) = (number(&mut local_vertex), number(&mut local_wedge));
        let wedge = |&w: &u32| {
            let wedge = mesh.wedges[w as usize];
            Wedge { vertex: VertexId(local_vertex[wedge.vertex.index()]), ..wedge }
        };
        let cut = TetMesh {
            domain: mesh.domain,
            positions: vertices.iter().map(|&v| mesh.positions[v as usize]).collect(),
            pinned: vertices.iter().map(|&v| mesh.pinned[v as usize]).collect(),
            wedges: wedges.iter().map(wedge).collect(),
            tets: tets.iter().map(|&t| mesh.tets[t as usize].map(|w| WedgeId(local_wedge[w.index()]))).collect(),
        };
        let free: Vec<bool> = vertices.iter().map(|&v| free[v as usize]).collect();
        let mut wedges_at = vec![0u32; cut.positions.len()];
        cut.wedges.iter().for_each(|w| wedges_at[w.vertex.index()] += 1);
        let boundary = wedges_at.iter().map(|&wedges| wedges > 1).collect();
        let rim = rim(&cut);
        let movable = free.iter().zip(&rim).map(|(&free, &rim)| free && !rim).collect();
        Self { mesh: cut, free, movable, boundary, rim, vertices, wedges, tets }
    }

    /// Writes positions, pins and colours of the free vertices back into the whole mesh.
    pub(super) fn write_back(&self, whole: &mut TetMesh) {
        for (local, &v) in self.vertices.iter().enumerate().filter(|&(local, _)| self.free[local]) {
            whole.positions[v as usize] = self.mesh.positions[local];
            whole.pinned[v as usize] = self.mesh.pinned[local];
        }
        for (local, &w) in self.wedges.iter().enumerate() {
            if self.free[self.mesh.wedges[local].vertex.index()] {
                whole.wedges[w as usize].color = self.mesh.wedges[local].color;
            }
        }
    }

    /// Tets that touch a vertex within `rings` edges of `vertices` and a boundary between labels, ascending. Not those at
    /// the rim: their masks are not known before the mesh goes on there.
    pub(super) fn tets_to_check(&self, vertices: &[bool], rings: u8) -> Vec<u32> {
        let near = Self::reach(&self.mesh, vertices, rings);
        let is_concerned = |tet: &u32| {
            let corners = self.mesh.tet_vertices(*tet as usize).map(|v| v.index());
            corners.iter().any(|&v| near[v])
                && corners.iter().any(|&v| self.boundary[v])
                && corners.iter().all(|&v| !self.rim[v])
        };
        (0..self.mesh.tets.len() as u32).filter(is_concerned).collect()
    }

    /// 1 for the coordinates of a vertex that may change, 0 for others.
    pub(super) fn movable_components(&self, vertex: usize) -> Vec3 {
        match self.movable[vertex] {
            true => self.mesh.domain.sides(self.mesh.positions[vertex]).free_axes(),
            false => Vec3::ZERO,
        }
    }

    /// Which wedges may change.
    pub(super) fn free_wedges(&self) -> Vec<bool> {
        self.mesh.wedges.iter().map(|w| self.free[w.vertex.index()]).collect()
    }
}

/// Vertices of faces that only one tet has, other than those on the sides of the box: where a partial mesh ends, its
/// tiling goes on elsewhere with the same vertices.
fn rim(mesh: &TetMesh) -> Vec<bool> {
    let mut faces: Vec<[u32; 3]> = Vec::with_capacity(mesh.tets.len() * 4);
    for tet in 0..mesh.tets.len() {
        let corners = mesh.tet_vertices(tet);
        for face in FACES {
            let mut face = face.map(|corner| corners[corner].0);
            face.sort_unstable();
            faces.push(face);
        }
    }
    faces.sort_unstable();
    let on_side = |face: &[u32; 3]| {
        let sides = face.map(|v| mesh.domain.sides(mesh.positions[v as usize]));
        !sides[0].and(sides[1]).and(sides[2]).is_interior()
    };
    let mut rim = vec![false; mesh.positions.len()];
    for same in faces.chunk_by(|a, b| a == b).filter(|same| same.len() == 1 && !on_side(&same[0])) {
        same[0].iter().for_each(|&v| rim[v as usize] = true);
    }
    rim
}
