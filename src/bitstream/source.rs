//! The writer's side of the syntax: what the source mesh has behind a face.
//!
//! In: a slab's committed mesh, which only grows. Out: the truth, decision by decision, in ids of the stream.
//! Forbidden here: deciding anything; what is coded and in which order is the syntax's matter.

mod faces;

use std::collections::BTreeMap;

use glam::IVec3;

use super::colors::{Grains, to_grains};
use super::connectivity::Apex;
use super::models::{BitModel, SymbolModel};
use super::range_coder::{BitCoder, RangeEncoder};
use super::slab::Side;
use super::{MeshFault, WriteError};
use crate::mesh::{MeshError, TetMesh, VertexId, WedgeId};
use crate::video::Label;
use faces::{FaceOfTet, Faces, SourceTet};

/// No tet, or no vertex.
const NONE: u32 = u32::MAX;

/// Frames from here on are one: no slab is so long.
const LAST_FRAME: usize = 1 << 19;

/// What is known about the source mesh beyond itself, from packet to packet.
#[derive(Debug)]
pub(super) struct Source {
    tets: Vec<SourceTet>,
    faces: Faces,
    /// Per source tet: whether it is coded.
    is_coded: Vec<bool>,
    /// How many are not.
    left: usize,
    /// Source tets that were not coded when last looked at, by the frame in which their first vertex lies.
    pending: Vec<Vec<u32>>,
    /// Positions and pins of the source vertices when last looked at.
    positions: Vec<IVec3>,
    pinned: Vec<bool>,
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
            tets: Vec::new(),
            faces: Faces::default(),
            is_coded: Vec::new(),
            left: 0,
            pending: Vec::new(),
            positions: Vec::new(),
            pinned: Vec::new(),
            coded_vertex: Vec::new(),
            source_vertex: Vec::new(),
            source_tet: Vec::new(),
            source_wedge: Vec::new(),
            labels: BTreeMap::new(),
            is_uniform: true,
        }
    }

    /// Takes in the tets that `mesh` has gained, and what has become of its vertices.
    ///
    /// # Errors
    /// A mesh that lost tets or vertices, whose coded vertices have changed, or whose tets are not made of one label's
    /// wedges.
    pub(super) fn update(&mut self, mesh: &TetMesh) -> Result<(), WriteError> {
        let known = self.tets.len();
        if mesh.tets.len() < known || mesh.positions.len() < self.coded_vertex.len() {
            return Err(WriteError::NotAppended { expected: known, found: mesh.tets.len() });
        }
        if mesh.pinned.len() != mesh.positions.len() {
            return Err(WriteError::Pinned { expected: mesh.positions.len(), found: mesh.pinned.len() });
        }
        self.follow_vertices(mesh)?;
        for tet in known..mesh.tets.len() {
            check_tet(mesh, tet)?;
            self.is_uniform &= mesh.tet_label(tet) == mesh.tet_label(0);
            self.tets.push(SourceTet::new(mesh.tet_vertices(tet)));
            self.is_coded.push(false);
            self.left += 1;
            self.wait(mesh, tet as u32);
        }
        self.faces.pair(&mut self.tets, known, mesh.positions.len());
        Ok(())
    }

    /// Takes in what has become of the vertices. Those that are not coded may have moved.
    ///
    /// # Errors
    /// One that is coded and has changed.
    fn follow_vertices(&mut self, mesh: &TetMesh) -> Result<(), WriteError> {
        let known = self.coded_vertex.len();
        let now = (&mesh.positions[..known], &mesh.pinned[..known]);
        self.coded_vertex.resize(mesh.positions.len(), NONE);
        // Mostly nothing has, which all at once is quickly seen.
        if now != (&self.positions[..], &self.pinned[..]) {
            let mut has_moved = false;
            for vertex in 0..known {
                let [old, new] = [(&self.positions, &self.pinned), (&mesh.positions, &mesh.pinned)]
                    .map(|(positions, pinned)| (positions[vertex], pinned[vertex]));
                if old != new && self.coded_vertex[vertex] != NONE {
                    return Err(WriteError::Changed { vertex: vertex as u32 });
                }
                has_moved |= old.0.z != new.0.z;
            }
            self.positions.copy_from_slice(now.0);
            self.pinned.copy_from_slice(now.1);
            if has_moved {
                for tet in std::mem::take(&mut self.pending).into_iter().flatten() {
                    self.wait(mesh, tet);
                }
            }
        }
        self.positions.extend_from_slice(&mesh.positions[known..]);
        self.pinned.extend_from_slice(&mesh.pinned[known..]);
        Ok(())
    }

    /// Notes a tet that is to be coded.
    fn wait(&mut self, mesh: &TetMesh, tet: u32) {
        let times = self.tets[tet as usize].vertices.map(|v| mesh.positions[v.index()].z);
        let first = times.into_iter().min().unwrap_or(0);
        let frame = usize::try_from(first >> mesh.domain.subpixel_bits).unwrap_or(0).min(LAST_FRAME);
        if self.pending.len() <= frame {
            self.pending.resize(frame + 1, Vec::new());
        }
        self.pending[frame].push(tet);
    }

    /// Whether every source tet is coded.
    pub(super) fn is_drained(&self) -> bool {
        self.left == 0
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
    /// Vertices before this frame are low.
    low_frames: u32,
    encoder: RangeEncoder,
    /// The current source tet.
    tet: usize,
    /// The source vertex that is coded next.
    vertex: VertexId,
}

impl<'a> Writing<'a> {
    pub(super) fn new(source: &'a mut Source, mesh: &'a TetMesh, low_frames: u32) -> Self {
        let encoder = RangeEncoder::new();
        Self { source, mesh, low_frames, encoder, tet: 0, vertex: VertexId(0) }
    }

    /// The bytes of decisions and symbols, and those of raw bits.
    pub(super) fn finish(self) -> [Vec<u8>; 2] {
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

    #[inline]
    fn symbol(&mut self, model: &mut SymbolModel, symbol: usize) -> usize {
        self.encoder.symbol(model, symbol)
    }

    #[inline]
    fn raw(&mut self, count: u32, value: u32) -> u32 {
        self.encoder.raw(count, value)
    }
}

impl Side for Writing<'_> {
    fn seed(&mut self) -> bool {
        let frames = usize::try_from(self.low_frames).unwrap_or(usize::MAX).min(self.source.pending.len());
        for pending in &mut self.source.pending[..frames] {
            while let Some(&tet) = pending.last() {
                if !self.source.is_coded[tet as usize] {
                    self.tet = tet as usize;
                    return true;
                }
                pending.pop();
            }
        }
        false
    }

    fn behind(&mut self, tet: u32, opposite: VertexId, corners: [VertexId; 3]) -> Apex {
        let source = &mut *self.source;
        let opposite = source.source_vertex[opposite.index()];
        let before = &source.tets[source.source_tet[tet as usize] as usize];
        let corner = before.vertices.iter().position(|&v| v == opposite);
        let across = corner.map_or(FaceOfTet::NONE, |corner| before.across[corner]);
        if across == FaceOfTet::NONE || source.is_coded[across.tet()] {
            let top = self.mesh.domain.extent().z;
            let is_at_top = |v: VertexId| self.mesh.positions[source.source_vertex[v.index()].index()].z == top;
            return if corners.into_iter().all(is_at_top) { Apex::Top } else { Apex::Hole };
        }
        self.tet = across.tet();
        self.vertex = source.tets[self.tet].vertices[across.corner()];
        self.coded(self.vertex).map_or(Apex::New, Apex::Known)
    }

    fn seed_corner(&mut self, corner: usize) -> Option<VertexId> {
        self.vertex = self.source.tets[self.tet].vertices[corner];
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

    fn has_pins(&self) -> bool {
        self.mesh.pinned.contains(&true)
    }

    fn label(&mut self, count: u32) -> u32 {
        *self.source.labels.entry(self.mesh.tet_label(self.tet)).or_insert(count)
    }

    fn wedge_made(&mut self, vertex: VertexId) {
        let vertex = self.source.source_vertex[vertex.index()];
        let corner = self.source.tets[self.tet].vertices.iter().position(|&v| v == vertex);
        let wedge = self.mesh.tets[self.tet][corner.unwrap_or(0)];
        self.source.source_wedge.push(wedge);
    }

    fn color(&self, wedge: usize, step: i32) -> Grains {
        let wedge = self.source.source_wedge[wedge];
        to_grains(self.mesh.wedges[wedge.index()].color, step)
    }

    fn tet_coded(&mut self) {
        self.source.left -= usize::from(!std::mem::replace(&mut self.source.is_coded[self.tet], true));
        self.source.source_tet.push(self.tet as u32);
    }

    fn check(&self) -> Result<(), MeshFault> {
        Ok(())
    }
}
