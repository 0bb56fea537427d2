//! The growing mesh of a slab: the syntax of a packet's payload, walked by writer and parser alike.
//!
//! In: a [`Side`], which codes decisions and, on the writer's side, knows the truth about the source mesh. Out: the
//! coded mesh, vertices, wedges and tets numbered in the order of the stream. Forbidden here: bytes and framing.
//!
//! A packet completes the stars of all vertices near its time ([`super::hops`]), tet by tet over the open faces of the
//! front. What no face reaches (in a mesh of several pieces) starts with a seed, a tet in plain numbers.

mod wedges;

use glam::IVec3;

use super::bits::Part;
use super::colors::{ColorModels, ColorSteps, Grains, KnownColor};
use super::connectivity::{Apex, ConnectivityModels, code_apex, code_vertex_id};
use super::extents;
use super::front::{Corner, Front, MAX_VERTICES, Met, NOWHERE, NewTet};
use super::gate::Gate;
use super::hops::{Hops, place};
use super::labels::LabelModels;
use super::models::BitModel;
use super::near::Rings;
use super::neighbours::Neighbours;
use super::normals::{is_positive, point};
use super::positions::{Behind, Bounds, PositionModels, code_free_position, code_position};
use super::range_coder::BitCoder;
use super::stars::Stars;
use super::vertices::{Linked, Vertices};
use super::{Limits, MeshFault};
use crate::mesh::{Domain, MeshCounts, TetMesh, VertexId, volume6};

/// One side of the coding: the writer, who answers with the truth, or the parser, whose answers are ignored. Calls
/// follow the syntax; each tet begins with `seed` or `behind`.
pub(super) trait Side: BitCoder {
    /// Whether a tet is left that no open face leads to. Makes it the current tet.
    fn seed(&mut self) -> bool;
    /// What lies behind the face of these corners of the coded tet `tet`, whose fourth corner is `opposite`. Makes the tet
    /// there the current one.
    fn behind(&mut self, tet: u32, opposite: VertexId, corners: [VertexId; 3]) -> Apex;
    /// Corner number `corner` of the current tet, a seed, if it is coded; else it will be the next new vertex.
    fn seed_corner(&mut self, corner: usize) -> Option<VertexId>;
    /// Position of the next new vertex, and whether it is pinned, if that is known.
    fn new_vertex(&self) -> Option<(IVec3, bool)>;
    /// The next new vertex has this id.
    fn vertex_coded(&mut self, id: VertexId);
    /// Whether all tets that are left have one label.
    fn is_uniform(&self) -> bool;
    /// Whether a vertex that is left may be pinned.
    fn has_pins(&self) -> bool;
    /// Label of the current tet; `count`, the number of labels so far, for a new one.
    fn label(&mut self, count: u32) -> u32;
    /// The current tet has a new wedge at the coded vertex `vertex`.
    fn wedge_made(&mut self, vertex: VertexId);
    /// Colour of a coded wedge, a multiple of `step` grains.
    fn color(&self, wedge: usize, step: i32) -> Grains;
    /// The current tet is complete and has the next number.
    fn tet_coded(&mut self);
    /// Whether the payload still holds what was read.
    ///
    /// # Errors
    /// [`MeshFault::PayloadEnd`]
    fn check(&self) -> Result<(), MeshFault>;
}

/// All adaptive models. They carry on from packet to packet within a slab.
#[derive(Debug, Clone)]
struct Models {
    connectivity: ConnectivityModels,
    positions: PositionModels,
    labels: LabelModels,
    colors: ColorModels,
    /// Whether all tets of a payload have the label before their gate.
    uniform: BitModel,
    /// Whether vertices of a payload may be pinned.
    pins: BitModel,
    /// Whether a seed follows.
    seed: BitModel,
    /// Whether a seed's corner is known.
    seed_known: BitModel,
}

/// The coded part of a slab.
#[derive(Debug, Clone)]
pub(super) struct Slab {
    /// What is coded, its duration provisional until the end of the slab is known: the least that exceeds all t.
    mesh: TetMesh,
    /// Colours of `mesh.wedges` as far as they are coded.
    known: Vec<KnownColor>,
    color_steps: ColorSteps,
    bounds: Bounds,
    /// Longest duration allowed, in frames.
    max_duration: u32,
    limits: Limits,
    front: Front,
    rings: Rings,
    hops: Hops,
    models: Box<Models>,
    /// Whether tets of the current packet that lie behind a gate have the label before it.
    is_uniform: bool,
    /// Whether vertices of the current packet may be pinned.
    has_pins: bool,
    /// Number of labels.
    labels: u32,
    /// Per wedge the next older one of its vertex.
    wedge_next: Vec<u32>,
    vertices: Vertices,
    neighbours: Neighbours,
    /// Only where hops are passed on.
    stars: Stars,
    /// Lengths of the mesh's arrays, and its duration, when the last packet was complete.
    complete: Complete,
}

/// A parser looks whether its payload has ended once so many tets.
const CHECK: usize = 16;

/// How much of a mesh is complete.
#[derive(Debug, Clone, Copy, Default)]
struct Complete {
    vertices: usize,
    wedges: usize,
    tets: usize,
    duration: u32,
}

/// What a slab is made for.
#[derive(Debug, Clone, Copy)]
pub(super) struct SlabParams {
    /// The box; its duration is not used.
    pub(super) domain: Domain,
    /// Longest duration allowed, in frames.
    pub(super) max_duration: u32,
    /// How coarse colours are.
    pub(super) color_steps: ColorSteps,
    /// Rings around the low vertices that a packet completes.
    pub(super) rings: u8,
    /// Bounds on counts.
    pub(super) limits: Limits,
}

impl Slab {
    pub(super) fn new(params: SlabParams) -> Self {
        let domain = Domain { duration: 1, ..params.domain };
        Self {
            mesh: TetMesh::empty(domain),
            known: Vec::new(),
            color_steps: params.color_steps,
            bounds: Bounds { domain, top_known: false },
            max_duration: params.max_duration,
            limits: params.limits,
            front: Front::new(),
            rings: Rings::default(),
            hops: Hops::new(params.rings),
            models: Box::new(Models {
                connectivity: ConnectivityModels::NEW,
                positions: PositionModels::NEW,
                labels: LabelModels::NEW,
                colors: ColorModels::NEW,
                uniform: BitModel::NEW,
                pins: BitModel::NEW,
                seed: BitModel::NEW,
                seed_known: BitModel::NEW,
            }),
            is_uniform: false,
            has_pins: false,
            labels: 0,
            wedge_next: Vec::new(),
            vertices: Vertices::default(),
            stars: Stars::default(),
            neighbours: Neighbours::default(),
            complete: Complete { duration: 1, ..Complete::default() },
        }
    }

    /// Makes room for a mesh like the one of the last slab, which this one is likely to be: lists that grow are copied again and again.
    pub(super) fn reserve(&mut self, MeshCounts { vertices, wedges, tets }: MeshCounts) {
        self.mesh.positions.reserve(vertices);
        self.mesh.pinned.reserve(vertices);
        self.mesh.wedges.reserve(wedges);
        self.mesh.tets.reserve(tets);
        self.known.reserve(wedges);
        self.wedge_next.reserve(wedges);
        self.vertices.reserve(vertices);
    }

    /// How coarse colours are.
    pub(super) fn color_steps(&self) -> ColorSteps {
        self.color_steps
    }

    /// What is coded so far.
    pub(super) fn mesh(&self) -> &TetMesh {
        &self.mesh
    }

    /// Whether the mesh's duration is final.
    pub(super) fn is_duration_known(&self) -> bool {
        self.bounds.top_known
    }

    /// The mesh as it was after the last packet that was coded without an error.
    pub(super) fn into_complete_mesh(mut self) -> TetMesh {
        let Complete { vertices, wedges, tets, duration } = self.complete;
        self.mesh.positions.truncate(vertices);
        self.mesh.pinned.truncate(vertices);
        self.mesh.wedges.truncate(wedges);
        self.mesh.tets.truncate(tets);
        self.mesh.domain.duration = duration;
        self.mesh
    }

    /// Notes that a packet is complete.
    pub(super) fn keep(&mut self) {
        self.complete = Complete {
            vertices: self.mesh.positions.len(),
            wedges: self.mesh.wedges.len(),
            tets: self.mesh.tets.len(),
            duration: self.mesh.domain.duration,
        };
    }

    /// Codes one packet: every tet that the hop rule asks for when vertices before frame `low_frames` are low.
    ///
    /// # Errors
    /// A mesh that no slab may have; what was coded before stands.
    pub(super) fn code_packet(&mut self, side: &mut impl Side, low_frames: u32) -> Result<(), MeshFault> {
        self.hops.begin_packet(low_frames);
        side.enter(Part::Labels);
        let is_uniform = side.is_uniform();
        self.is_uniform = side.bit(&mut self.models.uniform, is_uniform);
        let has_pins = side.has_pins();
        self.has_pins = side.bit(&mut self.models.pins, has_pins);
        loop {
            while let Some((vertex, hop)) = self.hops.next() {
                while let Some(gate) = Gate::choose(&mut self.front, &self.vertices, vertex) {
                    self.close_gate(side, &gate)?;
                }
                self.pass_hop_on(vertex, hop);
            }
            side.enter(Part::Connectivity);
            let seed = side.seed();
            if !side.bit(&mut self.models.seed, seed) {
                self.code_colors(side)?;
                return side.check();
            }
            self.code_seed(side)?;
        }
    }

    /// The slab ends at `duration` frames.
    ///
    /// # Errors
    /// Vertices beyond it, or another end known before.
    pub(super) fn end_at(&mut self, duration: u32) -> Result<(), MeshFault> {
        let bits = self.bounds.domain.subpixel_bits;
        if duration == 0 || duration > self.max_duration {
            return Err(MeshFault::Range {
                field: "duration",
                low: 1,
                high: self.max_duration.into(),
                found: duration.into(),
            });
        }
        let top = (duration as i32) << bits;
        let known = (self.bounds.domain.duration as i32) << bits;
        if self.bounds.top_known && known != top {
            return Err(MeshFault::Top { expected: known, found: top });
        }
        if let Some(highest) = self.mesh.positions.iter().map(|p| p.z).max().filter(|&t| t > top) {
            return Err(MeshFault::Top { expected: highest, found: top });
        }
        self.bounds.domain.duration = duration;
        self.bounds.top_known = true;
        self.vertices.mark_top(top as f32);
        self.mesh.domain.duration = duration;
        Ok(())
    }

    /// The neighbours of `vertex`, whose star is complete, are one edge farther.
    fn pass_hop_on(&mut self, vertex: VertexId, hop: u8) {
        if self.hops.goes_on(hop) {
            self.stars.tell(vertex, hop, |neighbour| self.hops.lower(neighbour, hop + 1));
        }
    }

    /// Codes what lies behind an open face.
    fn close_gate(&mut self, side: &mut impl Side, gate: &Gate) -> Result<(), MeshFault> {
        if self.mesh.tets.len().is_multiple_of(CHECK) {
            side.check()?;
        }
        if gate.sides != 0 {
            // It lies on t = duration, which was not known when it was opened.
            self.front.give_up(gate.corner);
            return Ok(());
        }
        let before = self.front.before(gate.corner);
        let truth = side.behind(before.tet, before.opposite, gate.corners);
        let known = self.vertices.len();
        let around = (&mut self.front, &self.vertices);
        let apex = match code_apex(side, (&mut self.models.connectivity, &mut self.rings), around, gate, truth)? {
            Apex::Known(vertex) => vertex,
            Apex::New => self.code_apex_vertex(side, before.opposite, gate)?,
            nothing @ (Apex::Hole | Apex::Top) => {
                if nothing == Apex::Top {
                    self.end_at_face(gate.corners)?;
                }
                self.front.give_up(gate.corner);
                return Ok(());
            }
        };
        let [a, b, c] = gate.corners;
        let corners = [a, b, c, apex];
        // A new apex has no open faces.
        let is_known = apex.index() < known;
        let met = if is_known { self.front.meet(&self.vertices, gate, apex) } else { Met::NOTHING };
        self.attach(side, corners, &met, Some((gate.corner, before.label)))
    }

    /// The slab ends at the t of this face.
    fn end_at_face(&mut self, corners: [VertexId; 3]) -> Result<(), MeshFault> {
        let [t, second, third] = corners.map(|v| self.mesh.positions[v.index()].z);
        let bits = self.bounds.domain.subpixel_bits;
        for found in [second, third, t >> bits << bits] {
            if found != t {
                return Err(MeshFault::Top { expected: t, found });
            }
        }
        self.end_at((t >> bits) as u32)
    }

    /// Codes the new vertex behind a gate.
    fn code_apex_vertex(
        &mut self,
        side: &mut impl Side,
        opposite: VertexId,
        gate: &Gate,
    ) -> Result<VertexId, MeshFault> {
        let at = |v: VertexId| self.vertices.position(v);
        let behind = Behind {
            gate: gate.corners.map(at),
            opposite: at(opposite),
            across: gate.across.map(|vertex| (vertex != NOWHERE).then(|| at(vertex))),
            extent: gate.extent,
        };
        let truth = side.new_vertex();
        if let Some((position, _)) = truth {
            self.check_inside(position)?;
            let [a, b, c] = gate.corners.map(|v| self.mesh.positions[v.index()]);
            self.check_positive([a, b, c, position])?;
        }
        let (position, pinned) = truth.unwrap_or_default();
        let position = code_position(side, &mut self.models.positions, &behind, &self.bounds, position)?;
        self.push_vertex(side, position, pinned)
    }

    /// Checks that the next tet, with these corners, is positive.
    #[cold]
    fn check_positive(&self, [a, b, c, d]: [IVec3; 4]) -> Result<(), MeshFault> {
        let volume6 = volume6(a, b, c, d);
        let tet = self.mesh.tets.len() as u32;
        if volume6 > 0 { Ok(()) } else { Err(MeshFault::NotPositive { tet, volume6 }) }
    }

    /// Codes the pin of the next vertex, and appends it.
    fn push_vertex(&mut self, side: &mut impl Side, position: IVec3, pinned: bool) -> Result<VertexId, MeshFault> {
        self.check_inside(position)?;
        if position.z > (self.max_duration as i32) << self.bounds.domain.subpixel_bits {
            return Err(MeshFault::TooMany { field: "frames in a slab", limit: self.max_duration });
        }
        let limit = self.limits.max_vertices.min(MAX_VERTICES - 1);
        if self.mesh.positions.len() >= limit as usize {
            return Err(MeshFault::TooMany { field: "vertices", limit });
        }
        let pinned = self.has_pins && self.models.positions.code_pinned(side, pinned);
        let vertex = self.mesh.push_vertex(position);
        self.mesh.pinned[vertex.index()] = pinned;
        self.vertices.push(point(position), self.bounds.sides(position), self.front.push_list());
        let frame = (position.z >> self.bounds.domain.subpixel_bits) as u32;
        let place = place([position.x, position.y], self.bounds.domain.subpixel_bits);
        self.hops.push_vertex(frame, place);
        if !self.bounds.top_known {
            self.mesh.domain.duration = self.mesh.domain.duration.max(frame + 1);
        }
        side.vertex_coded(vertex);
        Ok(vertex)
    }

    fn check_inside(&self, position: IVec3) -> Result<(), MeshFault> {
        if position.cmpge(IVec3::ZERO).all() && position.cmple(self.bounds.far()).all() {
            return Ok(());
        }
        let vertex = self.mesh.positions.len() as u32;
        Err(MeshFault::Outside { vertex, position: position.to_array() })
    }

    /// Codes a tet that no open face leads to.
    fn code_seed(&mut self, side: &mut impl Side) -> Result<(), MeshFault> {
        side.check()?;
        let mut corners = [VertexId(0); 4];
        for (corner, slot) in corners.iter_mut().enumerate() {
            let truth = side.seed_corner(corner);
            *slot = if side.bit(&mut self.models.seed_known, truth.is_some()) {
                code_vertex_id(side, truth.unwrap_or(VertexId(0)), self.mesh.positions.len() as u32)?
            } else {
                let (position, pinned) = side.new_vertex().unwrap_or_default();
                self.check_inside(position)?;
                side.enter(Part::Space);
                let position = code_free_position(side, &self.bounds, position);
                self.push_vertex(side, position, pinned)?
            };
        }
        self.attach(side, corners, &Met::NOTHING, None)?;
        corners.into_iter().for_each(|v| self.hops.revisit(v));
        Ok(())
    }

    /// Appends a tet with its label and wedges, and moves the front over it. `gate` is its gate's first corner, with the
    /// label before it; a seed has none.
    fn attach(
        &mut self,
        side: &mut impl Side,
        corners: [VertexId; 4],
        met: &Met,
        gate: Option<(Corner, u32)>,
    ) -> Result<(), MeshFault> {
        let tet = self.mesh.tets.len() as u32;
        if tet >= self.limits.max_tets {
            return Err(MeshFault::TooMany { field: "tets", limit: self.limits.max_tets });
        }
        let around = corners.map(|v| &self.vertices[v]);
        let [a, b, c, d] = around.map(|v| v.position);
        let edges = [a - d, b - d, c - d];
        if !is_positive(edges) {
            let [a, b, c, d] = corners.map(|v| self.mesh.positions[v.index()]);
            self.check_positive([a, b, c, d])?;
        }
        let mut tet = NewTet {
            number: tet,
            label: 0,
            corners,
            sides: around.map(|v| v.sides),
            ends: around.map(|v| v.open),
            extents: extents::learn(around.map(|v| v.extent), edges),
            edges,
        };
        side.enter(Part::Labels);
        let before = gate.map(|(_, label)| label);
        let wedges = match before {
            Some(0) if self.is_uniform && self.labels == 1 => {
                let wedges = self.code_wedges(side, corners, 0)?;
                self.note_spokes(wedges, met);
                wedges
            }
            _ => {
                let closed = self.closed_labels(met);
                tet.label = self.code_tet_label(side, corners, before, &closed)?;
                let wedges = self.code_wedges(side, corners, tet.label)?;
                self.note_neighbours(wedges, tet.label, &[closed[0], closed[1], closed[2], before]);
                wedges
            }
        };
        self.mesh.tets.push(wedges);
        if self.hops.goes_on(0) {
            self.stars.push(corners);
        }
        let [a, b, c, d] = corners.map(Linked::one);
        let links = if gate.is_some() { [d, d, d, a.with(b).with(c)] } else { [a.with(b).with(c).with(d); 4] };
        for ((vertex, extent), links) in corners.into_iter().zip(tet.extents).zip(links) {
            let vertex = &mut self.vertices[vertex];
            (vertex.extent, vertex.linked) = (extent, vertex.linked.with(links));
        }
        let gate = match gate {
            Some((gate, _)) => gate,
            None => self.front.sow(&tet),
        };
        self.front.cover(&tet, gate, met)?;
        side.tet_coded();
        Ok(())
    }
}
