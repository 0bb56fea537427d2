//! Fitting: the sparse mesh is moved and coloured until what the decoder will draw of it is closest to the frames.
//!
//! In: a mesh (or the committed part of one), which vertices may still change, the frames that they reach and the
//! original labels. Out: the same mesh with other positions and colours of the free vertices, all tets positive, and
//! vertices pinned where subdivision would fold one label over another. Topology is not touched. Forbidden here: changing what
//! is not free, labels, or the number of anything.
//!
//! [`fit`] does it all, in this order: surfaces (§IV-B), pins, colours (§IV-C), positions with colours (ours: the
//! largest gain there is), pins of what folds since, colours for good. Everything is fitted through the subdivision masks of the level that will
//! be shown. The other functions do one part each.

mod boundary;
mod color;
mod edges;
mod evidence;
mod guard;
mod interface;
mod marks;
mod model;
mod moments;
mod normal;
mod parallel;
mod params;
mod patch;
mod pin;
mod planes;
mod polygon;
mod pure;
mod quarters;
mod refine;
mod smoothness;
mod sparse;
mod surface;
#[cfg(test)]
mod tests;

pub use params::{COLOR_RANGE, FitError, FitParams, FitReport, FitRequest};
pub use pin::{PinReport, pin_folds};

use crate::mesh::TetMesh;
use crate::video::{LabelPlane, Volume};
use boundary::BoundaryPoints;
use color::Colors;
use evidence::{Beside, Evidence};
use guard::Guard;
use model::Model;
use patch::Patch;

/// Subdivision masks reach one ring, so what a free vertex has a share in lies within one ring of it, and is exact if
/// the tets of the next ring are there.
const RINGS: u8 = 2;

/// What colours are held to when positions stay, of what holds them while positions move: then they must not make up for
/// places, in the end they should. All of it in the end as well: 1.2 dB less at the source's size, 0.2 dB at eight times it.
const FREE_ANCHOR: f32 = 0.05;

/// Fits surfaces, colours and positions, pins folds and quantises colours.
///
/// # Errors
/// [`FitError`] where sizes or settings do not fit; the mesh is unchanged then.
pub fn fit(request: &mut FitRequest<'_>) -> Result<FitReport, FitError> {
    let mut fitting = Fitting::start(request)?;
    fitting.surfaces(request.labels);
    fitting.first_pins();
    fitting.first_colors();
    fitting.positions();
    fitting.final_pins();
    fitting.final_colors();
    Ok(fitting.finish(request.mesh))
}

/// Fits boundary surfaces alone; colours stay.
///
/// # Errors
/// [`FitError`] where sizes or settings do not fit; the mesh is unchanged then.
pub fn fit_surfaces(request: &mut FitRequest<'_>) -> Result<FitReport, FitError> {
    let mut fitting = Fitting::start(request)?;
    fitting.surfaces(request.labels);
    Ok(fitting.finish(request.mesh))
}

/// Fits colours alone and quantises them.
///
/// # Errors
/// [`FitError`] where sizes or settings do not fit; the mesh is unchanged then.
pub fn fit_colors(request: &mut FitRequest<'_>) -> Result<FitReport, FitError> {
    let mut fitting = Fitting::start(request)?;
    fitting.first_colors();
    fitting.final_colors();
    Ok(fitting.finish(request.mesh))
}

/// Fits positions and colours together; colours are not quantised.
///
/// # Errors
/// [`FitError`] where sizes or settings do not fit; the mesh is unchanged then.
pub fn fit_positions(request: &mut FitRequest<'_>) -> Result<FitReport, FitError> {
    let mut fitting = Fitting::start(request)?;
    fitting.first_colors();
    fitting.positions();
    Ok(fitting.finish(request.mesh))
}

/// A fit in progress.
struct Fitting<'a> {
    patch: Patch,
    model: Model,
    colors: Colors,
    frames: &'a Volume,
    params: &'a FitParams,
    report: FitReport,
    /// What the frames say at the present positions, if they have been looked at.
    seen: Option<Evidence>,
}

impl<'a> Fitting<'a> {
    fn start(request: &FitRequest<'a>) -> Result<Self, FitError> {
        request.check()?;
        let params = request.params;
        let patch = Patch::around(request.mesh, request.free, RINGS);
        let model = Model::new(&patch.mesh, &patch.free, params.subdivision_levels);
        let mut colors = Colors::new(patch.mesh.wedges.iter().map(|w| w.color).collect(), &patch.free_wedges());
        if params.flatness > 1.0 {
            let pure = pure::pure_colors(&patch.mesh, request.labels);
            colors.anchor.iter_mut().zip(pure).for_each(|(anchor, pure)| *anchor = pure.unwrap_or(*anchor));
        }
        let (frames, report) = (request.frames, FitReport::default());
        Ok(Self { patch, model, colors, frames, params, report, seen: None })
    }

    fn surfaces(&mut self, labels: &[(u32, LabelPlane)]) {
        // Where the pure colours of labels are known, edges were cut at their places within pixels; planes of labels know
        // pixels alone.
        let is_placed = labels.iter().any(|(_, plane)| plane.pure_colors().is_some());
        if is_placed || !self.patch.boundary.contains(&true) {
            return;
        }
        let boundary = BoundaryPoints::new(labels);
        let done = surface::optimize_surfaces(&mut self.patch, &self.model, &boundary, self.params);
        self.report.distance_before = done.distance_before;
        self.report.distance_after = done.distance_after;
        self.report.refused_moves += done.refused;
        self.follow_positions();
    }

    fn first_colors(&mut self) {
        let evidence = self.look(Beside::default());
        self.report.pixels = evidence.pixels();
        self.report.rms_before = self.rms(&evidence);
        self.colors.optimize(&self.model, &evidence, self.params.color_iterations, &self.anchored(FREE_ANCHOR));
        self.report.rms_colors = self.rms(&evidence);
        self.seen = Some(evidence);
    }

    /// Half of the steps without quarters of pixels, which cost as much as all else and hardly matter on the way.
    fn positions(&mut self) {
        let all = self.params.position_iterations;
        // What gradients cost would hold the vertices of long slivers, and with them the mesh: only what flat labels add
        // counts, without which the colours of thin ones would make up for places.
        let gradient_weight = self.params.gradient_weight * (self.params.flatness - 1.0);
        let fine = FitParams { position_iterations: all - all / 2, gradient_weight, ..self.anchored(1.0) };
        let rough = FitParams { position_iterations: all / 2, quarter_weight: 0.0, ..fine.clone() };
        let guard = Guard::new(&self.patch.mesh, self.params.minimum_altitude);
        for params in [rough, fine].iter().filter(|params| params.position_iterations > 0) {
            let evidence = self.look(params.beside());
            let (patch, model, colors) = (&mut self.patch, &self.model, &mut self.colors);
            let (evidence, refined) =
                refine::optimize_positions(patch, (model, &guard), colors, evidence, self.frames, params);
            self.report.position_steps += refined.steps;
            self.report.refused_moves += refined.refused;
            self.report.rms_positions = self.rms(&evidence);
            self.seen = Some(evidence);
            self.follow_positions();
        }
    }

    /// Pins what folds at level 1 before positions are optimised, so that they know of it: 0.5 dB better than pins
    /// that come after, and 2 dB better than positions held where nothing folds.
    fn first_pins(&mut self) {
        if self.is_subdivided() {
            self.report.pins = pin::pin_patch(&mut self.patch, 1);
            self.follow_positions();
        }
    }

    fn final_pins(&mut self) {
        if !self.is_subdivided() {
            return;
        }
        let pins = pin::pin_patch(&mut self.patch, 2);
        self.report.pins = PinReport {
            folded_tets: self.report.pins.folded_tets + pins.folded_tets,
            pinned_vertices: self.report.pins.pinned_vertices + pins.pinned_vertices,
            left_folded: pins.left_folded,
        };
        self.follow_positions();
    }

    fn final_colors(&mut self) {
        // Where positions stay nothing can fit the quarters.
        let quarter_weight = if self.params.position_iterations > 0 { self.params.quarter_weight } else { 0.0 };
        let gradient = self.params.gradient_weight * self.params.flatness;
        let evidence = self.look(Beside { quarter: quarter_weight, gradient });
        self.colors.optimize(&self.model, &evidence, self.params.color_iterations, &self.anchored(FREE_ANCHOR));
        self.report.rms_after = self.rms(&evidence);
        let points = self.model.points(&self.patch.mesh.positions);
        self.report.rms_within_tets = evidence.error_within_tets(&self.model, &points, &self.colors.now);
    }

    fn finish(mut self, mesh: &mut TetMesh) -> FitReport {
        self.patch.mesh.wedges.iter_mut().zip(&self.colors.now).for_each(|(wedge, color)| wedge.color = *color);
        self.patch.write_back(mesh);
        self.report
    }

    /// With the anchors of colours that flat labels ask for, or a share of it.
    fn anchored(&self, share: f32) -> FitParams {
        let params = self.params;
        FitParams { color_anchor: params.color_anchor * (1.0 + share * (params.flatness - 1.0)), ..params.clone() }
    }

    /// Level 0 is drawn as it is, whatever would fold at others.
    fn is_subdivided(&self) -> bool {
        self.params.subdivision_levels > 0
    }

    /// Which diagonal splits a tet's octahedron follows from positions, and masks from pins; level 0 has neither.
    fn follow_positions(&mut self) {
        if self.is_subdivided() {
            self.model = Model::new(&self.patch.mesh, &self.patch.free, self.params.subdivision_levels);
            self.seen = None;
        }
    }

    /// What the frames say at the present positions, with what counts beside the centres.
    fn look(&mut self, beside: Beside) -> Evidence {
        let memory = match self.seen.take() {
            Some(evidence) if evidence.beside == beside => return evidence,
            other => other.unwrap_or_default(),
        };
        let points = self.model.points(&self.patch.mesh.positions);
        let colors = self.model.node_colors(&self.colors.now);
        memory.gather(&self.model, (&points, &colors), self.frames, beside)
    }

    fn rms(&self, evidence: &Evidence) -> f64 {
        let values = (3.0 * evidence.weight()).max(1.0);
        let points = self.model.points(&self.patch.mesh.positions);
        (evidence.error_of_pixels(&self.model, &points, &self.colors.now) / values).sqrt()
    }
}
