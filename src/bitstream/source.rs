//! The writer's side of the syntax: what the source mesh has behind a face.
//!
//! In: a slab's committed mesh, which only grows. Out: the truth, decision by decision, in ids of the stream.
//! Forbidden here: deciding anything; what is coded and in which order is the syntax's matter.

use std::collections::BTreeMap;

use glam::IVec3;

use super::colors::{Grains, to_grains};
use super::connectivity::Apex;
use super::range_coder::{BitCoder, BitModel, RangeEncoder};
use super::slab::Side;
use super::{MeshFault, WriteError};
use crate::mesh::{FACES, FaceMap, MeshError, TetMesh, VertexId, WedgeId};
use crate::video::Label;

/// No tet, or no vertex.
const NONE: u32 = u32::MAX;

/// What is known about the source mesh beyond itself, from packet to packet.
#[derive(Debug)]
pub(super) struct Source {
    /// Tets across the face opposite each corner.
    neighbours: Vec<[u32; 4]>,
    /// Faces met once so far, by ascending vertices.
    unpaired: FaceMap<(u32, u8)>,
    /// Per source tet: whether it is coded.
    is_coded: Vec<bool>,
    /// Source tets that were not coded when last looked at, ascending.
    pending: Vec<u32>,
    /// Stream id of each source vertex.
    coded_vertex: Vec<u32>,
    /// Source ids of the stream's vertices and tets.
    source_vertex: Vec<VertexId>,
    source_tet: Vec<u32>,
    source_wedge: Vec<WedgeId>,
    /// Stream numbers of labels.
    labels: BTreeMap<Label, u32>,
    /// Whether all tets have one label.
    is_uniform: bool,
}

impl Source {
    pub(super) fn new() -> Self {
        Self {
            neighbours: Vec::new(),
            unpaired: FaceMap::new(),
            is_coded: Vec::new(),
            pending: Vec::new(),
            coded_vertex: Vec::new(),
            source_vertex: Vec::new(),
            source_tet: Vec::new(),
            source_wedge: Vec::new(),
            labels: BTreeMap::new(),
            is_uniform: true,
        }
    }

    /// Takes in the tets that `mesh` has gained.
    ///
    /// # Errors
    /// A mesh that lost tets or vertices, or whose tets are not made of one label's wedges.
    pub(super) fn update(&mut self, mesh: &TetMesh) -> Result<(), WriteError> {
        let known = self.neighbours.len();
        if mesh.tets.len() < known || mesh.positions.len() < self.coded_vertex.len() {
            return Err(WriteError::NotAppended { expected: known, found: mesh.tets.len() });
        }
        if mesh.pinned.len() != mesh.positions.len() {
            return Err(WriteError::Pinned { expected: mesh.positions.len(), found: mesh.pinned.len() });
        }
        self.coded_vertex.resize(mesh.positions.len(), NONE);
        for tet in known..mesh.tets.len() {
            check_tet(mesh, tet)?;
            self.is_uniform &= mesh.tet_label(tet) == mesh.tet_label(0);
            self.neighbours.push([NONE; 4]);
            self.is_coded.push(false);
            self.pending.push(tet as u32);
            let vertices = mesh.tet_vertices(tet);
            for (corner, face) in FACES.into_iter().enumerate() {
                let mut key = face.map(|c| vertices[c]);
                key.sort_unstable();
                match self.unpaired.remove(key) {
                    Some((other, other_corner)) => {
                        self.neighbours[tet][corner] = other;
                        self.neighbours[other as usize][other_corner as usize] = tet as u32;
                    }
                    None => {
                        self.unpaired.insert(key, (tet as u32, corner as u8));
                    }
                }
            }
        }
        Ok(())
    }

    /// Checks that no vertex has changed since it was coded.
    ///
    /// # Errors
    /// The first vertex that has.
    pub(super) fn check_unchanged(&self, mesh: &TetMesh, coded: &TetMesh) -> Result<(), WriteError> {
        for (now, sent) in self.source_vertex.iter().zip(coded.positions.iter().zip(&coded.pinned)) {
            if (&mesh.positions[now.index()], &mesh.pinned[now.index()]) != sent {
                return Err(WriteError::Changed { vertex: now.0 });
            }
        }
        Ok(())
    }

    /// Forgets which tets were pending but are coded by now.
    pub(super) fn sweep(&mut self) {
        self.pending.retain(|&tet| !self.is_coded[tet as usize]);
    }

    /// Whether every source tet is coded.
    pub(super) fn is_drained(&self) -> bool {
        self.pending.is_empty()
    }
}

/// Checks references and labels of one tet.
fn check_tet(mesh: &TetMesh, tet: usize) -> Result<(), MeshError> {
    let corners = mesh.tets[tet];
    let exists = |w: crate::mesh::WedgeId| {
        mesh.wedges.get(w.index()).is_some_and(|wedge| wedge.vertex.index() < mesh.positions.len())
    };
    if !corners.into_iter().all(exists) {
        return Err(MeshError::Reference { tet });
    }
    if corners.into_iter().any(|w| mesh.wedges[w.index()].label != mesh.tet_label(tet)) {
        return Err(MeshError::MixedLabels { tet });
    }
    Ok(())
}

/// The writer at work on one packet.
pub(super) struct Writing<'a> {
    source: &'a mut Source,
    mesh: &'a TetMesh,
    /// Vertices before this t are low.
    low_until: i32,
    encoder: RangeEncoder,
    /// The current source tet.
    tet: usize,
    /// The source vertex that is coded next.
    vertex: VertexId,
    /// Place in `source.pending` from which on seeds are looked for.
    seeds_from: usize,
}

impl<'a> Writing<'a> {
    pub(super) fn new(source: &'a mut Source, mesh: &'a TetMesh, low_until: i32) -> Self {
        let encoder = RangeEncoder::new();
        Self { source, mesh, low_until, encoder, tet: 0, vertex: VertexId(0), seeds_from: 0 }
    }

    /// The payload.
    pub(super) fn finish(self) -> Vec<u8> {
        self.encoder.finish()
    }

    /// The stream's id of a source vertex.
    fn coded(&self, vertex: VertexId) -> Option<VertexId> {
        Some(self.source.coded_vertex[vertex.index()]).filter(|&id| id != NONE).map(VertexId)
    }
}

impl BitCoder for Writing<'_> {
    #[inline]
    fn bit(&mut self, model: &mut BitModel, bit: bool) -> bool {
        self.encoder.bit(model, bit)
    }

    fn raw(&mut self, count: u32, value: u32) -> u32 {
        self.encoder.raw(count, value)
    }
}

impl Side for Writing<'_> {
    fn seed(&mut self) -> bool {
        while let Some(&tet) = self.source.pending.get(self.seeds_from) {
            let is_low = self.mesh.tet_positions(tet as usize).iter().any(|p| p.z < self.low_until);
            if is_low && !self.source.is_coded[tet as usize] {
                self.tet = tet as usize;
                return true;
            }
            self.seeds_from += 1;
        }
        false
    }

    fn behind(&mut self, tet: u32, corners: [VertexId; 3]) -> Apex {
        let corners = corners.map(|v| self.source.source_vertex[v.index()]);
        let source_tet = self.source.source_tet[tet as usize] as usize;
        let vertices = self.mesh.tet_vertices(source_tet);
        let across = (0..4).find(|&corner| !corners.contains(&vertices[corner]));
        let next = across.map_or(NONE, |corner| self.source.neighbours[source_tet][corner]);
        if next == NONE || self.source.is_coded[next as usize] {
            let top = self.mesh.domain.extent().z;
            let at_top = corners.iter().all(|v| self.mesh.positions[v.index()].z == top);
            return if at_top { Apex::Top } else { Apex::Hole };
        }
        self.tet = next as usize;
        let apex = self.mesh.tet_vertices(self.tet).into_iter().find(|v| !corners.contains(v));
        self.vertex = apex.unwrap_or(corners[0]);
        self.coded(self.vertex).map_or(Apex::New, Apex::Known)
    }

    fn seed_corner(&mut self, corner: usize) -> Option<VertexId> {
        self.vertex = self.mesh.tet_vertices(self.tet)[corner];
        self.coded(self.vertex)
    }

    fn new_vertex(&self) -> Option<(IVec3, bool)> {
        Some((self.mesh.positions[self.vertex.index()], self.mesh.pinned[self.vertex.index()]))
    }

    fn vertex_coded(&mut self, id: VertexId) {
        self.source.coded_vertex[self.vertex.index()] = id.0;
        self.source.source_vertex.push(self.vertex);
    }

    fn is_uniform(&self) -> bool {
        self.source.is_uniform
    }

    fn label(&mut self, count: u32) -> u32 {
        *self.source.labels.entry(self.mesh.tet_label(self.tet)).or_insert(count)
    }

    fn wedge_made(&mut self, vertex: VertexId) {
        let vertex = self.source.source_vertex[vertex.index()];
        let wedges = self.mesh.tets[self.tet];
        let wedge = wedges.into_iter().find(|&w| self.mesh.vertex(w) == vertex).unwrap_or(wedges[0]);
        self.source.source_wedge.push(wedge);
    }

    fn color(&self, wedge: usize, step: i32) -> Grains {
        let wedge = self.source.source_wedge[wedge];
        to_grains(self.mesh.wedges[wedge.index()].color, step)
    }

    fn tet_coded(&mut self) {
        self.source.is_coded[self.tet] = true;
        self.source.source_tet.push(self.tet as u32);
    }

    fn check(&self) -> Result<(), MeshFault> {
        Ok(())
    }
}
