//! Settings of a slab's stages that follow from its labels.
//!
//! In: frames with labels, as they come. Out: what simplification and fit are to do about labels. Forbidden here: calling a stage.

use super::SlabEncoder;
use crate::encoder::TopologyRule;
use crate::vectorize::simplify::{SimplifyParams, Topology, WedgeQuadric};
use crate::video::{Frame, LabelPlane};

/// [`SimplifyParams::improve_at`] for the window: collapses jam most when few vertices are left. Flat between 0.8 and 0.95
/// (docs/benchmarks.md).
const IMPROVE_AT: f32 = 0.9;

/// The same for runs, which are dense: rounds take long and collapses are many.
const RUN_IMPROVE_AT: f32 = 0.3;

/// One frame in so many says how flat labels are.
const FLATNESS_EVERY: u32 = 4;

impl<Q: WedgeQuadric> SlabEncoder<Q> {
    /// Takes in the labels of the next frame.
    pub(super) fn follow_labels(&mut self, frame: &Frame, labels: &LabelPlane) {
        let is_first_cut = !self.is_cut && !labels.is_uniform();
        self.is_cut |= is_first_cut;
        let is_due = self.is_cut && self.planes.is_multiple_of(FLATNESS_EVERY);
        if !(is_first_cut || is_due) {
            return;
        }
        self.flatness.look(frame, labels);
        let factor = self.flatness.factor();
        self.fit_params.flatness = factor;
        self.simplify_params.topology = topology(self.topology, self.is_cut);
        self.simplify_params.improve_at = improve_at(self.topology, true);
        if self.topology == TopologyRule::Auto {
            self.simplify_params.spread_weight = factor * SimplifyParams::default().spread_weight;
        }
    }

    /// How a run's blocks are simplified.
    pub(super) fn run_params(&self) -> SimplifyParams {
        let params = self.simplify_params;
        SimplifyParams { improve_at: params.improve_at.min(RUN_IMPROVE_AT), ..params }
    }
}

/// [`SimplifyParams::improve_at`] of a window, which gains most where it holds the slab or labels differ. The paper's
/// simplification, strict or free, knows no more than collapses.
pub(super) fn improve_at(rule: TopologyRule, is_worth_it: bool) -> f32 {
    if rule == TopologyRule::Auto && is_worth_it { IMPROVE_AT } else { 0.0 }
}

/// What is kept of the topology of labels, as far as there are any.
pub(super) fn topology(rule: TopologyRule, is_cut: bool) -> Topology {
    match rule {
        // Of one label there is no more to keep than positive tets keep.
        TopologyRule::Auto if is_cut => Topology::Priced,
        TopologyRule::Auto | TopologyRule::Free => Topology::Free,
        TopologyRule::Strict => Topology::Strict,
    }
}
