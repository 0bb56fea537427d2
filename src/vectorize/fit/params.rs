//! Settings of a fit, what it is asked, what it answers.

use thiserror::Error;

use super::evidence::Beside;
use super::pin::PinReport;
use crate::mesh::TetMesh;
use crate::video::{LabelPlane, Volume};

/// Range of a colour in 8-bit levels: the stream's. Colours clamped to [0, 255] cost 0.35 dB.
pub const COLOR_RANGE: [f32; 2] = [-128.0, 383.0];

/// How a fit works.
#[derive(Debug, Clone, PartialEq)]
pub struct FitParams {
    /// Levels of subdivision to fit through: those that will be shown, 0 to 2.
    pub subdivision_levels: u8,

    /// The paper's lambda (Eq. 7): what a change of Laplacian coordinates costs beside a distance to the boundary.
    pub laplacian_weight: f32,
    /// Rounds of projecting and solving (the paper: 5); 0: boundaries stay.
    pub surface_iterations: u32,
    /// Steps of conjugate gradients within one.
    pub surface_cg_iterations: u32,
    /// How far from a fine boundary point the original boundary is looked for, in pixels.
    pub surface_reach_px: f32,

    /// Steps of conjugate gradients for the colours at the start and at the end.
    pub color_iterations: u32,
    /// The same after each step of the positions.
    pub color_steps_between: u32,
    /// How many pixels a wedge's first colour is worth: what keeps wedges without pixels.
    pub color_anchor: f32,

    /// What a quarter of a pixel counts beside the pixel's centre: what lies between centres is seen when the picture is
    /// enlarged. 0: it does not count.
    pub quarter_weight: f32,
    /// What the squared gradient of colour, in (levels / pixel)^2, costs over a pixel and a frame beside the squared error
    /// there, when colours are fitted for the last time: it decides where no pixel does. 0: nothing.
    pub gradient_weight: f32,
    /// How flat labels are, from 1 on ([`crate::vectorize::segment::Flatness`]): how many times gradients cost that, and how
    /// many times wedges count that have the pure colours of their labels, where these are known.
    pub flatness: f32,

    /// Steps of the position optimisation; 0: positions stay.
    pub position_iterations: u32,
    /// Steps of conjugate gradients within one. More go closer to the linearised optimum, where more vertices stand in
    /// each other's way: 1, 3, 8 steps gave 39.1, 38.5, 37.6 dB.
    pub position_cg_iterations: u32,
    /// Squared levels that a displacement of one pixel costs, so that noise alone moves nothing.
    pub position_stiffness: f32,
    /// Longest step of a vertex in one iteration, in pixels.
    pub max_step_px: f32,
    /// Smallest altitude, in lattice units, that a move may leave a tet with: 4, 1, 0.25 gave 37.3, 38.7, 39.1 dB.
    pub minimum_altitude: f32,

    /// Conjugate gradients end when the residual has fallen to this part of its start, the position optimisation
    /// when the error falls by less than this part in a step.
    pub tolerance: f64,
}

impl Default for FitParams {
    fn default() -> Self {
        Self {
            subdivision_levels: 1,
            laplacian_weight: 1.0,
            surface_iterations: 5,
            surface_cg_iterations: 50,
            surface_reach_px: 6.0,
            color_iterations: 30,
            color_steps_between: 3,
            color_anchor: 0.05,
            quarter_weight: 0.2,
            gradient_weight: 0.003,
            flatness: 1.0,
            position_iterations: 12,
            position_cg_iterations: 1,
            position_stiffness: 1.0,
            max_step_px: 1.0,
            minimum_altitude: 0.25,
            tolerance: 1e-3,
        }
    }
}

impl FitParams {
    /// What counts beside the centres of pixels.
    pub(super) fn beside(&self) -> Beside {
        Beside { quarter: self.quarter_weight, gradient: self.gradient_weight }
    }

    fn check(&self) -> Result<(), FitError> {
        expect("subdivision_levels", "0 to 2", self.subdivision_levels, (0..=2).contains(&self.subdivision_levels))?;
        let not_negative = [
            ("laplacian_weight", self.laplacian_weight),
            ("surface_reach_px", self.surface_reach_px),
            ("quarter_weight", self.quarter_weight),
            ("gradient_weight", self.gradient_weight),
            ("position_stiffness", self.position_stiffness),
            ("max_step_px", self.max_step_px),
            ("minimum_altitude", self.minimum_altitude),
        ];
        for (field, value) in not_negative {
            expect(field, "a finite number >= 0", value, value.is_finite() && value >= 0.0)?;
        }
        let flatness = self.flatness;
        expect("flatness", "a finite number >= 1", flatness, flatness.is_finite() && flatness >= 1.0)?;
        let anchored = self.color_anchor.is_finite() && self.color_anchor > 0.0;
        expect("color_anchor", "a finite number > 0", self.color_anchor, anchored)
    }
}

/// What to fit to what.
#[derive(Debug)]
pub struct FitRequest<'a> {
    /// The mesh, all tets positive; only its free vertices' positions, pins and colours change.
    pub mesh: &'a mut TetMesh,
    /// Per vertex: whether it may change. Where a partial mesh ends short of the box's sides, free vertices change
    /// their colours alone: what goes on there has the same vertices.
    pub free: &'a [bool],
    /// The frames; they should cover the time of every tet that touches a free vertex.
    pub frames: &'a Volume,
    /// The original labels, each plane with its frame number (since the slab's start), ascending; where the boundaries
    /// were. A slab of a single frame has its plane twice, as frames 0 and 1.
    pub labels: &'a [(u32, LabelPlane)],
    /// How.
    pub params: &'a FitParams,
}

impl FitRequest<'_> {
    pub(super) fn check(&self) -> Result<(), FitError> {
        self.params.check()?;
        let vertices = self.mesh.positions.len();
        expect("free", format!("{vertices} entries"), self.free.len(), self.free.len() == vertices)?;
        let size = (self.mesh.domain.width, self.mesh.domain.height);
        let frames = self.frames.frames().map(|(_, frame)| ("frame size", (frame.width(), frame.height())));
        let planes = self.labels.iter().map(|(_, plane)| ("label plane size", (plane.width(), plane.height())));
        for (field, found) in frames.chain(planes) {
            expect(field, format!("{size:?}"), format!("{found:?}"), found == size)?;
        }
        Ok(())
    }
}

/// Why a fit was refused.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FitError {
    /// A setting is out of its range, or a size does not match the mesh.
    #[error("{field}: expected {expected}, found {found}")]
    Field {
        /// Which one.
        field: &'static str,
        /// What would be accepted.
        expected: String,
        /// What was given.
        found: String,
    },
}

fn expect(field: &'static str, expected: impl Into<String>, found: impl ToString, holds: bool) -> Result<(), FitError> {
    if holds { Ok(()) } else { Err(FitError::Field { field, expected: expected.into(), found: found.to_string() }) }
}

/// What a fit reached. What a function does not do stays at its default.
///
/// Colour errors are root mean squares over the pixels and channels that free vertices have a share in, in levels;
/// distances are root mean squares over fine boundary points, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FitReport {
    /// Pixels that the free part covers, over all frames.
    pub pixels: u64,
    /// Distance of the boundaries from the original ones at the start.
    pub distance_before: f64,
    /// The same after surface fitting.
    pub distance_after: f64,
    /// Colour error before colours were first fitted, after surface fitting.
    pub rms_before: f64,
    /// Colour error after the first colour optimisation.
    pub rms_colors: f64,
    /// Colour error after the position optimisation.
    pub rms_positions: f64,
    /// Colour error at the end: folds pinned, colours quantised.
    pub rms_after: f64,
    /// Colour error at the end within a tet, a mean over all pixels: far below `rms_after` where few places have most of
    /// the error, as in drawings.
    pub rms_within_tets: f64,
    /// Steps of the position optimisation that stood.
    pub position_steps: u32,
    /// Moves that were refused since a tet would have become flat or too thin.
    pub refused_moves: u32,
    /// What became of folds.
    pub pins: PinReport,
}

impl FitReport {
    /// What two fits of different vertices reached together.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let pixels = (self.pixels + other.pixels).max(1) as f64;
        let mean = |of: fn(&Self) -> f64| {
            let squares = of(self).powi(2) * self.pixels as f64 + of(other).powi(2) * other.pixels as f64;
            (squares / pixels).sqrt()
        };
        Self {
            pixels: self.pixels + other.pixels,
            distance_before: mean(|report| report.distance_before),
            distance_after: mean(|report| report.distance_after),
            rms_before: mean(|report| report.rms_before),
            rms_colors: mean(|report| report.rms_colors),
            rms_positions: mean(|report| report.rms_positions),
            rms_after: mean(|report| report.rms_after),
            rms_within_tets: (self.rms_within_tets * self.pixels as f64 + other.rms_within_tets * other.pixels as f64)
                / pixels,
            position_steps: self.position_steps.max(other.position_steps),
            refused_moves: self.refused_moves + other.refused_moves,
            pins: PinReport {
                folded_tets: self.pins.folded_tets + other.pins.folded_tets,
                pinned_vertices: self.pins.pinned_vertices + other.pins.pinned_vertices,
                left_folded: self.pins.left_folded + other.pins.left_folded,
            },
        }
    }
}
