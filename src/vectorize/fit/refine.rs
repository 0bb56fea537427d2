//! Position optimisation: vertices go where the frames are shown best. (The paper moves boundaries only, §IV-B.)
//!
//! In: a patch, its model, the frames. Out: the patch's free vertices at better positions of the integer lattice, with
//! the colours that go with them. Levenberg-Marquardt on colours and positions together: both are linear in the
//! pixels' moments, so a step costs one look at the pixels and a few products. A step stands only if the squared
//! error falls.

use glam::Vec3;

use super::FitParams;
use super::color::Colors;
use super::evidence::Evidence;
use super::guard::Guard;
use super::model::Model;
use super::normal::{NormalEquations, PositionDamping};
use super::patch::Patch;
use super::sparse::conjugate_gradient;
use crate::video::Volume;

/// What the optimisation did.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Refined {
    /// Steps that stood.
    pub(super) steps: u32,
    /// Moves that the guard refused, over all steps.
    pub(super) refused: u32,
}

/// Marquardt's factor: where it starts, how a good and a bad step change it, and where it ends.
const DAMPING_START: f32 = 0.1;
const DAMPING_GOOD: f32 = 0.4;
const DAMPING_BAD: f32 = 4.0;
const DAMPING_RANGE: [f32; 2] = [1e-3, 1e3];

/// Optimises positions and colours of `patch` from what the frames say at its positions; returns what they say at the
/// final ones.
pub(super) fn optimize_positions(
    patch: &mut Patch,
    (model, guard): (&Model, &Guard),
    colors: &mut Colors,
    evidence: Evidence,
    frames: &Volume,
    params: &FitParams,
) -> (Evidence, Refined) {
    let mut state = State { colors: colors.clone(), evidence, error: 0.0 };
    state.follow(model, params);
    let mut damping = DAMPING_START;
    let mut report = Refined::default();
    for _ in 0..params.position_iterations {
        let wish = state.step(patch, model, params, damping);
        let before = patch.mesh.positions.clone();
        report.refused += guard.move_all(&mut patch.mesh, &wish.steps);
        // The moments are most of a fit's memory: one set at a time. Steps that fail are few.
        let evidence = std::mem::take(&mut state.evidence);
        let mut tried = State { colors: state.colors.clone(), evidence, error: 0.0 };
        tried.colors.add(&wish.colors);
        tried.measure(patch, model, frames, params);
        tried.follow(model, params);
        if tried.error < state.error {
            let gain = (state.error - tried.error) / state.error;
            state = tried;
            report.steps += 1;
            damping = (damping * DAMPING_GOOD).max(DAMPING_RANGE[0]);
            if gain < params.tolerance {
                break;
            }
        } else {
            patch.mesh.positions = before;
            state.evidence = tried.evidence;
            state.measure(patch, model, frames, params);
            damping *= DAMPING_BAD;
            if damping > DAMPING_RANGE[1] {
                break;
            }
        }
    }
    *colors = state.colors;
    (state.evidence, report)
}

/// A point of the search: colours, what the frames say at the patch's positions, and the error.
struct State {
    colors: Colors,
    evidence: Evidence,
    error: f64,
}

/// A step that the linearised error asks for.
struct Wish {
    /// Change of each wedge's colour.
    colors: Vec<Vec3>,
    /// Displacement of each vertex, in lattice units.
    steps: Vec<Vec3>,
}

impl State {
    /// Lets the colours follow what was measured.
    fn follow(&mut self, model: &Model, params: &FitParams) {
        self.colors.optimize(model, &self.evidence, params.color_steps_between, params);
        self.error = self.evidence.squared_error(model, &self.colors.now);
    }

    fn measure(&mut self, patch: &Patch, model: &Model, frames: &Volume, params: &FitParams) {
        let points = model.points(&patch.mesh.positions);
        let evidence = std::mem::take(&mut self.evidence);
        let colors = model.node_colors(&self.colors.now);
        self.evidence = evidence.gather(model, (&points, &colors), frames, params.beside());
    }

    fn step(&self, patch: &Patch, model: &Model, params: &FitParams, damping: f32) -> Wish {
        let mesh = &patch.mesh;
        let points = model.points(&mesh.positions);
        let nodes = model.node_colors(&self.colors.now);
        let movable = (0..mesh.positions.len()).map(|v| patch.movable_components(v));
        let mask = self.colors.mask.iter().copied().chain(movable).collect();
        let damping =
            PositionDamping { relative: vec![damping; mesh.positions.len()], absolute: params.position_stiffness };
        let anchors = vec![params.color_anchor; self.colors.now.len()];
        let system = NormalEquations::of_colors_and_positions(
            (model, &self.evidence),
            (&points, &nodes),
            mask,
            anchors,
            &damping,
        );
        let rhs = system.right_hand_side(&nodes, |w| self.colors.anchor[w] - self.colors.now[w]);
        let mut colors = conjugate_gradient(&system, rhs, params.position_cg_iterations, params.tolerance);
        let unit = mesh.domain.unit() as f32;
        let steps = colors.split_off(self.colors.now.len());
        let steps = steps.iter().map(|d| d.clamp_length_max(params.max_step_px) * unit).collect();
        Wish { colors, steps }
    }
}
