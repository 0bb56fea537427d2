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
use faces::Faces;

/// No tet, or no vertex.
const NONE: u32 = u32::MAX;

/// Frames from here on are one: no slab is so long.
const LAST_FRAME: usize = 1 << 19;

/// What is known about the source mesh beyond itself, from packet to packet.
#[derive(Debug)]
pub(super) struct Source {
    /// Tets across the face opposite each corner.
    neighbours: Vec<[u32; 4]>,
    faces: Faces,
    /// Per source tet: whether it is coded.
    is_coded: Vec<bool>,
    /// How many are not.
    left: usize,
    /// Source tets that were not coded when last looked at, by the frame in which their first vertex lies.
    pending: Vec<Vec<u32>>,
    /// t of the source vertices for which that holds.
    times: Vec<i32>,
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
            faces: Faces::default(),
            is_coded: Vec::new(),
            left: 0,
            pending: Vec::new(),
            times: Vec::new(),
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
        self.follow_times(mesh);
        for tet in known..mesh.tets.len() {
            check_tet(mesh, tet)?;
            self.is_uniform &= mesh.tet_label(tet) == mesh.tet_label(0);
            self.neighbours.push([NONE; 4]);
            self.is_coded.push(false);
            self.left += 1;
            self.wait(mesh, tet as u32);
        }
        let neighbours = &mut self.neighbours;
        self.faces.pair(mesh, known, |one, other| {
            neighbours[one.tet()][one.corner()] = other.tet() as u32;
            neighbours[other.tet()][other.corner()] = one.tet() as u32;
        });
        Ok(())
    }

    /// Takes in what has become of the vertices' times. Those that are not coded may have moved.
    fn follow_times(&mut self, mesh: &TetMesh) {
        let has_moved = self.times.iter().zip(&mesh.positions).any(|(&t, position)| t != position.z);
        self.times.clear();
        self.times.extend(mesh.positions.iter().map(|position| position.z));
        if has_moved {
            for tet in std::mem::take(&mut self.pending).into_iter().flatten() {
                self.wait(mesh, tet);
            }
        }
    }

    /// Notes a tet that is to be coded.
    fn wait(&mut self, mesh: &TetMesh, tet: u32) {
        let first = mesh.tet_positions(tet as usize).iter().map(|position| position.z).min().unwrap_or(0);
        let frame = usize::try_from(first >> mesh.domain.subpixel_bits).unwrap_or(0).min(LAST_FRAME);
        if self.pending.len() <= frame {
            self.pending.resize(frame + 1, Vec::new());
        }
        self.pending[frame].push(tet);
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

    fn has_pins(&self) -> bool {
        self.mesh.pinned.contains(&true)
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
        self.source.left -= usize::from(!std::mem::replace(&mut self.source.is_coded[self.tet], true));
        self.source.source_tet.push(self.tet as u32);
    }

    fn check(&self) -> Result<(), MeshFault> {
        Ok(())
    }
}
