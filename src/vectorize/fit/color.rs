//! Colour optimisation (§IV-C) against the frames themselves.
//!
//! In: a model at its positions, and what the frames say about its tets. Out: wedge colours with the least squared
//! error, through the masks that the decoder will apply, by conjugate gradients. The paper samples the dense mesh's
//! colours at the fine vertices; here every pixel of the frames counts, which is what will be looked at.

use glam::Vec3;

use super::evidence::Evidence;
use super::model::Model;
use super::normal::NormalEquations;
use super::sparse::conjugate_gradient;
use super::{COLOR_RANGE, FitParams};

/// Wedge colours while they are fitted.
#[derive(Debug, Clone)]
pub(super) struct Colors {
    /// The colour of each wedge.
    pub(super) now: Vec<Vec3>,
    /// The colour that each wedge keeps where no pixel speaks for it.
    pub(super) anchor: Vec<Vec3>,
    /// 1 for wedges that may change, 0 for others.
    pub(super) mask: Vec<Vec3>,
}

impl Colors {
    /// Starts from colours that are also the anchors.
    pub(super) fn new(now: Vec<Vec3>, free: &[bool]) -> Self {
        let mask = free.iter().map(|&free| if free { Vec3::ONE } else { Vec3::ZERO }).collect();
        Self { anchor: now.clone(), now, mask }
    }

    /// `iterations` steps of conjugate gradients towards the least squared error.
    pub(super) fn optimize(&mut self, model: &Model, evidence: &Evidence, iterations: u32, params: &FitParams) {
        let damping = vec![params.color_anchor; self.now.len()];
        let system = NormalEquations::of_colors(model, evidence, self.mask.clone(), damping);
        let nodes = model.node_colors(&self.now);
        let rhs = system.right_hand_side(&nodes, |w| self.anchor[w] - self.now[w]);
        let change = conjugate_gradient(&system, rhs, iterations, params.tolerance);
        self.add(&change);
    }

    /// Adds a change per wedge, within the range that the stream can hold.
    pub(super) fn add(&mut self, change: &[Vec3]) {
        for ((now, change), mask) in self.now.iter_mut().zip(change).zip(&self.mask) {
            if mask.x > 0.0 && change.is_finite() {
                *now = clamp(*now + *change);
            }
        }
    }
}

fn clamp(color: Vec3) -> Vec3 {
    color.clamp(Vec3::splat(COLOR_RANGE[0]), Vec3::splat(COLOR_RANGE[1]))
}
