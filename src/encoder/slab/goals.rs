//! How far a slab is simplified, run by run, step by step.
//!
//! In: the ratio or the error that is asked for, and how far the slab has come. Out: goals for simplification. Forbidden here:
//! calling a stage.

use super::SlabEncoder;
use crate::mesh::TetMesh;
use crate::vectorize::simplify::{BlockGoal, Goal, WedgeQuadric};

/// Vertices a pixel of one frame that the transition from the sparse window to its dense leading layer may have.
const TRANSITION_RATIO: f64 = 0.1;

/// Vertices that blocks of a run are simplified to, over those that the simplification ratio allows: the rest is left to
/// the window, where they compete with all others. More where its first stage has more.
pub(super) const RUN_RATIO: f64 = 2.0;

/// The same where labels differ: what blocks have frozen, planes dense with borders, lets less of them go cheaply.
const CUT_RUN_RATIO: f64 = 4.0;

/// How many times the vertices that a window is to have it may grow to before its blocks are simplified.
const GROWTH: f64 = 1.5;

/// The same where labels differ, and a window has twice the vertices: memory before time.
const CUT_GROWTH: f64 = 1.2;

/// The part of the error allowed that blocks of a run may make, where the error decides.
const RUN_ERROR: f64 = 0.25;

/// The same over what the first stage of a window may make that holds the slab.
const RUN_ERROR_OF_STAGE: f64 = 0.7;

impl<Q: WedgeQuadric> SlabEncoder<Q> {
    /// How far a run's blocks are simplified before they join the window.
    pub(super) fn goal_of_run(&self, run: &TetMesh, frames: u32) -> BlockGoal {
        let pixels = self.pixels() * f64::from(frames);
        if self.is_steered() {
            let part = if self.has_stages { RUN_ERROR_OF_STAGE * self.aim.first_part() } else { RUN_ERROR };
            return BlockGoal { keep: 0.0, max_error: (part * self.allowed_error(pixels)) as f32, shift: 0.0 };
        }
        let keep = self.run_ratio() * self.ratio * pixels / run.positions.len() as f64;
        BlockGoal { keep: keep.min(1.0), max_error: f32::INFINITY, shift: 0.0 }
    }

    /// Vertices that the window may have over those that the simplification ratio allows, before the slab ends.
    fn run_ratio(&self) -> f64 {
        if self.is_cut { self.run_ratio.max(CUT_RUN_RATIO) } else { self.run_ratio }
    }

    /// Whether the error decides, not the ratio.
    pub(super) fn is_steered(&self) -> bool {
        self.aim.is_wanted()
    }

    /// Pixels of a frame.
    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.committed.domain.width) * f64::from(self.committed.domain.height)
    }

    /// [`Goal::max_error`] that leads to the target error over so many pixels.
    pub(super) fn allowed_error(&self, pixels: f64) -> f64 {
        self.aim.allowed() * pixels
    }

    /// How many times the vertices that the window is to have it may grow to before its blocks are simplified.
    pub(super) fn growth(&self) -> f64 {
        if self.is_cut { CUT_GROWTH } else { GROWTH }
    }

    /// What the next commit will take must have reached the simplification ratio. Between it and the frozen leading
    /// layer, next to which nothing becomes sparse, the same costs hold, and a bound for the window's memory.
    pub(super) fn goal(&self, frames: Option<u32>, lead: i32) -> Goal {
        let unit = self.committed.domain.unit();
        let pixels = self.pixels();
        let handed_on = self.committed.positions.len() - self.work.committed_vertices().len();
        let allowed = |frames: f64| ((self.ratio * frames * pixels).round() as usize).saturating_sub(handed_on);
        let trailing = frames.unwrap_or((lead as u32).saturating_sub(self.kept));
        let counted = f64::from(trailing) - f64::from(self.frozen.max(0)) / f64::from(unit);
        let steered = self.is_steered();
        Goal {
            vertices: if steered { 0 } else { allowed(trailing.into()) },
            before: if frames.is_some() { i32::MAX } else { trailing as i32 * unit },
            vertices_in_window: match frames {
                None if !steered => {
                    (self.run_ratio() * allowed(lead.into()) as f64 + TRANSITION_RATIO * pixels) as usize
                }
                _ => usize::MAX,
            },
            max_cost: f32::MAX,
            max_error: if steered { self.allowed_error(pixels * counted) as f32 } else { f32::INFINITY },
        }
    }
}
