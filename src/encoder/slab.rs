//! One slab through the sliding window (§VI): lattice, cleave, simplify, commit, fit, write.

mod aim;
mod goals;
mod labels;
mod refits;

use std::collections::VecDeque;
use std::sync::Arc;

use self::aim::Aim;
pub(super) use self::aim::ErrorModel;
use self::goals::RUN_RATIO;
use super::observer::{Event, Observer, Stage};
use super::proof::Proof;
use super::quantize::{color_steps, rounded_rms};
use super::readiness::hops;
use super::runs::{Run, Runs};
use super::{EncodeError, EncoderConfig, ErrorMetric, TopologyRule};
use crate::bitstream::{MAX_RINGS, Packet, SequenceHeader, SlabWriter, rings};
use crate::mesh::{Domain, StarTable, TetMesh};
use crate::vectorize::fit::{FitParams, FitReport, FitRequest, fit};
use crate::vectorize::lattice::AdaptiveLattice;
use crate::vectorize::segment::Flatness;
use crate::vectorize::simplify::{BlockGoal, Goal, SimplifyParams, Unfrozen, WedgeQuadric, WorkMesh, simplify};
use crate::video::{Frame, LabelPlane, Volume};

/// How many times the vertices that it is to have the window is simplified to in blocks at the slab's end, pass by pass, each
/// along other lines ([`BlockGoal::shift`]): the last pass, over the whole, runs on one core, so little is left to it.
const WINDOW_PASSES: [BlockPass; 2] = [BlockPass { shift: 0.5, ratio: 1.5 }, BlockPass { shift: 0.0, ratio: 1.1 }];

/// A pass over the window in blocks.
struct BlockPass {
    shift: f64,
    ratio: f64,
}

/// [`SimplifyParams::end_weights`] of a plane that is shown: half a frame makes up for the side that it does not have, the rest
/// for tets that reach into it from one side alone (docs/benchmarks.md).
const END_WEIGHT: f32 = 2.0;

/// Most vertices that are fitted at once: more take more memory, and no less time.
const FIT_VERTICES: usize = 50_000;

/// How a slab ends.
#[derive(Debug)]
pub(super) enum SlabEnd {
    /// With its last frame, which holds: a scene cut or the end of the stream.
    Held,
    /// At the next slab's first frame, given here with its labels as this slab continues them.
    Joined(Arc<Frame>, LabelPlane),
}

/// What a slab leaves behind.
pub(super) struct FinishedSlab {
    /// The packets left.
    pub(super) packets: Vec<Packet>,
    /// Vertices of the slab's mesh.
    pub(super) vertices: u64,
    /// What was learnt about the way to an error.
    pub(super) error_model: ErrorModel,
    /// Mean absolute error, where the error decides.
    pub(super) error: Option<f64>,
}

/// A slab's encoder, whatever its error metric.
pub(super) trait WindowEncoder: Send {
    /// Takes the next frame; gives the packets that became ready.
    fn push(
        &mut self,
        frame: Arc<Frame>,
        labels: LabelPlane,
        observer: &mut Observer,
    ) -> Result<Vec<Packet>, EncodeError>;
    /// Frames taken so far.
    fn planes(&self) -> u32;
    /// Ends the slab.
    fn finish(self: Box<Self>, end: SlabEnd, observer: &mut Observer) -> Result<FinishedSlab, EncodeError>;
}

/// Most frames between the arrival of a frame and its packet with windows of `window` frames: the packet's tets and
/// those around their vertices reach `MAX_RINGS + 1` tets of at most a window each beyond it, what is committed and what is
/// in the lattice lag behind by less than a window each, and packets leave by the window. An adaptive lattice waits for
/// the run after the next and for what could be too short to be one.
pub(super) fn latency_frames(config: &EncoderConfig) -> u32 {
    (u32::from(MAX_RINGS) + 3) * config.window + 2 * config.run_steps() + AdaptiveLattice::MIN_CUT + 2
}

/// Vectorises one slab.
pub(super) struct SlabEncoder<Q> {
    ratio: f64,
    aim: Aim,
    /// Most vertices that decoders accept.
    most_vertices: f64,
    proof: Proof,
    /// Frames behind the window's leading plane that are kept after a step.
    kept: u32,
    /// Packets that are fitted and written together, to look at each frame less often.
    batch: u32,
    /// Whether the window holds the slab as a whole and there is, or will be, a number of vertices to come to.
    has_stages: bool,
    /// Fits on the way to the goal, where there are stages.
    refits: u32,
    /// [`RUN_RATIO`], or what the first of these fits needs.
    run_ratio: f64,
    topology: TopologyRule,
    /// Whether labels differ anywhere so far.
    is_cut: bool,
    /// Of its labels, looked at in one frame of [`labels::FLATNESS_EVERY`].
    flatness: Flatness,
    simplify_params: SimplifyParams,
    fit_params: FitParams,
    work: WorkMesh<Q>,
    committed: TetMesh,
    /// Rings around the vertices of a packet that it brings, too.
    rings: u8,
    writer: SlabWriter,
    /// Whether the steps of colours are chosen: the slab's first fit decides.
    colors_measured: bool,
    runs: Runs,
    /// Frames that the fit may still need, and their labels.
    volume: Volume,
    labels: VecDeque<(u32, LabelPlane)>,
    planes: u32,
    /// Last plane in the lattice.
    lead: u32,
    frozen: i32,
    sent: u32,
}

impl<Q: WedgeQuadric> SlabEncoder<Q> {
    pub(super) fn try_new(
        config: &EncoderConfig,
        header: SequenceHeader,
        first_frame: u64,
        error_model: ErrorModel,
    ) -> Result<Self, EncodeError> {
        let domain = Domain {
            width: config.width,
            height: config.height,
            // Provisional: where the slab ends is known when it ends.
            duration: EncoderConfig::KEY_INT_MAX.end() + 1,
            subpixel_bits: header.subpixel_bits,
        };
        let is_whole = config.holds_slab();
        let has_stages = is_whole && (config.target_error <= 0.0 || config.refits > 0);
        let refits = if has_stages { config.refits } else { 0 };
        Ok(Self {
            ratio: config.simplification_ratio,
            aim: Aim::new(config.target_error, refits, error_model),
            most_vertices: config.most_vertices(),
            proof: Proof::new(config.subdivision_levels),
            kept: config.kept_frames(),
            batch: config.window,
            has_stages,
            refits,
            run_ratio: RUN_RATIO.max(refits::first_stage(refits)),
            topology: config.topology,
            is_cut: false,
            flatness: Flatness::default(),
            simplify_params: simplify_params(config, is_whole),
            fit_params: FitParams {
                subdivision_levels: config.subdivision_levels,
                position_iterations: config.position_steps,
                ..FitParams::default()
            },
            work: WorkMesh::new(domain),
            committed: TetMesh::empty(domain),
            rings: rings(header.subdivision_levels),
            writer: SlabWriter::try_new(header, first_frame)?,
            colors_measured: false,
            runs: Runs::new(domain, config),
            volume: Volume::new(0),
            labels: VecDeque::new(),
            planes: 0,
            lead: 0,
            frozen: -1,
            sent: 0,
        })
    }

    fn take(&mut self, frame: Arc<Frame>, labels: LabelPlane) {
        self.follow_labels(&frame, &labels);
        self.volume.push(frame.clone());
        self.labels.push_back((self.planes, labels.clone()));
        self.runs.push(frame, labels);
        self.planes += 1;
    }

    /// Puts the runs that are ready into the window, one after another.
    fn advance(&mut self, frames: Option<u32>, observer: &mut Observer) -> Result<Vec<Packet>, EncodeError> {
        let mut packets = Vec::new();
        let runs = observer.stage(Stage::Lattice, || self.runs.take_ready(frames.is_some()))?;
        let count = runs.len();
        for (n, Run { mesh, last, planes_a_frame }) in runs.into_iter().enumerate() {
            let goal = self.goal_of_run(&mesh, last - self.lead);
            let params = self.run_params();
            let report =
                observer.stage(Stage::Simplify, || self.work.append_simplified(&mesh, planes_a_frame, goal, &params));
            log::debug!("blocks: {report:?}");
            observer.tell(Event::Simplified(report));
            self.lead = last;
            log::debug!("run up to frame {last}: {} vertices, {} tets", mesh.positions.len(), mesh.tets.len());
            drop(mesh);
            packets.extend(self.step(frames.filter(|_| n + 1 == count), observer)?);
        }
        Ok(packets)
    }

    /// Simplifies and hands on; with `frames` the slab has ended and has that many.
    fn step(&mut self, frames: Option<u32>, observer: &mut Observer) -> Result<Vec<Packet>, EncodeError> {
        let is_whole = self.kept == u32::MAX;
        let lead = self.lead as i32;
        let goal = self.goal(frames, lead);
        let high = if frames.is_some() { i32::MAX } else { lead * self.committed.domain.unit() };
        let unfrozen = Unfrozen { low: self.frozen, high };
        if is_whole && frames.is_none() {
            // Nothing is handed on before the slab ends: only memory is at stake, and that roughly.
            if self.work.vertex_count() as f64 > self.growth() * goal.vertices_in_window as f64 {
                observer.tell(Event::Began(Stage::Simplify));
                self.simplify_blocks(unfrozen, self.keep_of_window(goal.vertices_in_window, 0.5), observer);
                observer.tell(Event::Ended);
            }
            return Ok(Vec::new());
        }
        let goal = self.refit(unfrozen, goal, observer)?;
        observer.tell(Event::Began(Stage::Simplify));
        self.simplify_to(unfrozen, goal, observer);
        observer.tell(Event::Ended);
        self.frozen = match frames {
            Some(_) => i32::MAX,
            // What the goal counted.
            None => self.frozen.max(goal.before - 1),
        };
        self.work.commit(self.frozen, &mut self.committed);
        self.send_ready(frames, observer)
    }

    /// Simplifies the window to its goal, or as far as it goes.
    fn simplify_to(&mut self, unfrozen: Unfrozen, goal: Goal, observer: &mut Observer) {
        if self.has_stages {
            for pass in &WINDOW_PASSES {
                let goal = self.keep_of_window((pass.ratio * goal.vertices as f64) as usize, pass.shift);
                self.simplify_blocks(unfrozen, goal, observer);
            }
        }
        let report = simplify(&mut self.work, unfrozen, goal, &self.simplify_params);
        log::debug!("simplify: {report:?}, {goal:?}");
        observer.tell(Event::Simplified(report));
    }

    /// About so many of the window's vertices.
    fn keep_of_window(&self, vertices: usize, shift: f64) -> BlockGoal {
        BlockGoal { keep: vertices as f64 / self.work.vertex_count() as f64, max_error: f32::INFINITY, shift }
    }

    /// Simplifies the window in blocks.
    fn simplify_blocks(&mut self, unfrozen: Unfrozen, goal: BlockGoal, observer: &mut Observer) {
        if goal.keep < 1.0 {
            let report = self.work.simplify_blocks(unfrozen, goal, &self.simplify_params);
            log::debug!("blocks of the window: {report:?}");
            observer.tell(Event::Simplified(report));
        }
    }

    /// Fits and writes the packets whose tets are committed.
    fn send_ready(&mut self, frames: Option<u32>, observer: &mut Observer) -> Result<Vec<Packet>, EncodeError> {
        let stars = StarTable::new(&self.committed);
        let incomplete = self.work.committed_vertices();
        let is_ready = |k: u32| {
            let hops = hops(&self.committed, &stars, k, self.rings);
            !self.committed.positions.is_empty() && incomplete.iter().all(|&v| hops[v as usize] > self.rings)
        };
        let end = match frames {
            Some(frames) => frames,
            None => (self.sent..self.planes).find(|&k| !is_ready(k)).unwrap_or(self.planes),
        };
        if end == self.sent || (frames.is_none() && end < self.sent + self.batch) {
            return Ok(Vec::new());
        }
        let report = observer.stage(Stage::Fit, || self.fit(&stars))?;
        observer.tell(Event::Fitted(report));
        observer.tell(Event::Began(Stage::Write));
        let mut packets = Vec::new();
        for k in self.sent..end {
            packets.push(self.writer.write_packet(&self.committed, Some(k + 1) == frames)?);
        }
        observer.tell(Event::Ended);
        if self.is_steered() {
            self.follow_error(end)?;
        }
        self.sent = end;
        self.forget_frames(&stars);
        Ok(packets)
    }

    /// Which vertices no packet has carried yet.
    fn unsent(&self, stars: &StarTable) -> Vec<bool> {
        if self.sent == 0 {
            return vec![true; self.committed.positions.len()];
        }
        hops(&self.committed, stars, self.sent - 1, self.rings).into_iter().map(|hop| hop > self.rings + 1).collect()
    }

    /// Fits what is unsent.
    fn fit(&mut self, stars: &StarTable) -> Result<FitReport, EncodeError> {
        let free = self.unsent(stars);
        let source = Source { frames: &self.volume, labels: self.labels.make_contiguous() };
        let mut total = fit_in_parts(&mut self.committed, &free, source, &self.fit_params)?;
        if !self.colors_measured {
            self.colors_measured = true;
            self.writer.set_color_steps(color_steps(&self.committed, total.rms_within_tets))?;
        }
        total.rms_after = rounded_rms(total.rms_after, total.rms_within_tets);
        Ok(total)
    }

    /// Learns from the packets before frame `end`, which have just been written, what their error has come to.
    fn follow_error(&mut self, end: u32) -> Result<(), EncodeError> {
        let Some(mesh) = self.writer.coded_mesh() else { return Ok(()) };
        let written = self.sent..end;
        let frames = self.volume.frames().filter(|(number, _)| written.contains(number));
        if let Some(reached) = self.proof.compare(mesh, frames)? {
            self.aim.arrive(mesh.positions.len(), reached);
        }
        Ok(())
    }

    /// Lets go of frames that no tet with an unsent vertex, nor any tet to come, reaches.
    fn forget_frames(&mut self, stars: &StarTable) {
        let unit = self.committed.domain.unit();
        let free = self.unsent(stars);
        let mut first =
            self.frozen.min(self.planes as i32 * unit) / unit - self.simplify_params.max_extent_frames as i32;
        for tet in 0..self.committed.tets.len() {
            let vertices = self.committed.tet_vertices(tet);
            if vertices.iter().any(|v| free[v.index()]) {
                let lowest = vertices.iter().map(|v| self.committed.positions[v.index()].z).min();
                first = first.min(lowest.unwrap_or(0) / unit);
            }
        }
        let first = first.max(self.volume.first() as i32) as u32;
        self.labels.retain(|&(frame, _)| frame >= first);
        self.volume.drop_before(first);
    }
}

impl<Q: WedgeQuadric> WindowEncoder for SlabEncoder<Q> {
    fn push(
        &mut self,
        frame: Arc<Frame>,
        labels: LabelPlane,
        observer: &mut Observer,
    ) -> Result<Vec<Packet>, EncodeError> {
        self.take(frame, labels);
        self.advance(None, observer)
    }

    fn planes(&self) -> u32 {
        self.planes
    }

    fn finish(mut self: Box<Self>, end: SlabEnd, observer: &mut Observer) -> Result<FinishedSlab, EncodeError> {
        let frames = self.planes;
        let is_shown = matches!(end, SlabEnd::Held);
        match end {
            SlabEnd::Joined(frame, labels) => self.take(frame, labels),
            SlabEnd::Held if frames == 1 => {
                // A slab of one frame repeats it: a mesh needs an extent in time.
                let labels = self.labels.front().map(|(_, labels)| labels.clone());
                if let (Some(frame), Some(labels)) = (self.volume.frame(0).cloned(), labels) {
                    self.take(frame, labels);
                }
            }
            SlabEnd::Held => {}
        }
        if is_shown {
            self.simplify_params.end_weights[1] = self.simplify_params.end_weights[0];
        }
        let duration = self.planes - 1;
        self.work.set_duration(duration);
        self.committed.domain.duration = duration;
        let packets = self.advance(Some(frames), observer)?;
        let vertices = self.committed.positions.len() as u64;
        Ok(FinishedSlab { packets, vertices, error_model: self.aim.model(), error: self.proof.error() })
    }
}

/// How a slab is simplified as long as nothing is known of its labels.
fn simplify_params(config: &EncoderConfig, is_whole: bool) -> SimplifyParams {
    // The paper's metric is no measure for distances, nor does it know more of one plane than of another.
    let (surface_weight, first_plane) = match config.error_metric {
        ErrorMetric::Color => (SimplifyParams::default().surface_weight, END_WEIGHT),
        ErrorMetric::Paper => (0.0, 0.0),
    };
    SimplifyParams {
        max_extent_frames: config.window,
        topology: labels::topology(config.topology, false),
        improve_at: labels::improve_at(config.topology, is_whole),
        surface_weight,
        end_weights: [first_plane, 0.0],
        ..SimplifyParams::default()
    }
}

/// What a mesh is fitted to.
#[derive(Clone, Copy)]
struct Source<'a> {
    frames: &'a Volume,
    labels: &'a [(u32, LabelPlane)],
}

/// Fits the free vertices of a mesh, in parts across the picture where they are many: memory follows the part. Tets are
/// long in time but not in space, so bands have few neighbours that would be looked at twice.
fn fit_in_parts(
    mesh: &mut TetMesh,
    free: &[bool],
    Source { frames, labels }: Source<'_>,
    params: &FitParams,
) -> Result<FitReport, EncodeError> {
    let axis = usize::from(mesh.domain.height > mesh.domain.width);
    let mut places: Vec<i32> =
        free.iter().zip(&mesh.positions).filter(|(free, _)| **free).map(|(_, p)| p[axis]).collect();
    places.sort_unstable();
    let parts = places.len().div_ceil(FIT_VERTICES).max(1);
    let mut total = FitReport::default();
    let mut low = i32::MIN;
    for part in 1..=parts {
        let high = if part == parts { i32::MAX } else { places[part * places.len() / parts] };
        let in_part = |v: usize| free[v] && (low..high).contains(&mesh.positions[v][axis]);
        let free: Vec<bool> = (0..free.len()).map(in_part).collect();
        let report = fit(&mut FitRequest { mesh, free: &free, frames, labels, params })?;
        log::debug!("fit: {report:?}");
        total = total.with(&report);
        // A vertex may have moved past the limit; it is fitted again in the next part, which does no harm.
        low = high;
    }
    Ok(total)
}
