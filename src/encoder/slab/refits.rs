//! Fits on the way to the goal.
//!
//! Quadrics know what the lattice was, not what the mesh has become: what is left of it drifts from the lattice's colours,
//! and a fit moves it further. So a slab that is in the window as a whole is brought close to its goal in stages. At each
//! it is fitted to the frames, and quadrics are built anew from what was fitted, which is closer to the frames at as many
//! vertices than the mesh that quadrics alone led to. (An eighth less error in the end, docs/benchmarks.md.) Where the error is
//! given and not the number of vertices, the fitted meshes say how many they are to be.

use std::collections::VecDeque;

use super::{SlabEncoder, Source, fit_in_parts};
use crate::encoder::EncodeError;
use crate::encoder::observer::{Event, Observer, Stage};
use crate::encoder::proof::Proof;
use crate::mesh::TetMesh;
use crate::vectorize::fit::FitParams;
use crate::vectorize::simplify::{BlockGoal, Goal, Unfrozen, WedgeQuadric, WorkMesh};

/// Vertices at the first stage, over those of the goal. From there to the goal each stage has the same part of the last.
pub(super) const FIRST_STAGE: f64 = 2.0;
/// Where more stages begin higher: factor a stage.
const MORE_FIRST: f64 = 1.25;

/// Steps of the position optimisation at a stage: what follows undoes more than further steps would gain.
const STEPS: u32 = 3;

/// A stage that turns out to have more than so many times the vertices of the goal is followed by another like it.
const FAR: f64 = 3.0;
/// Most such stages: the error of the first is foretold from costs, which in some pictures say little.
const MOST_DETOURS: u32 = 2;

/// Vertices over those of the goal, stage by stage.
fn stages(count: u32) -> impl Iterator<Item = f64> {
    let first = FIRST_STAGE * MORE_FIRST.powi(count as i32 - 2);
    (0..count).map(move |stage| first.powf(1.0 - f64::from(stage) / f64::from(count)))
}

/// Vertices of the first stage over those of the goal: runs must not have lost more before.
pub(super) fn first_stage(count: u32) -> f64 {
    stages(count).next().unwrap_or(1.0)
}

impl<Q: WedgeQuadric> SlabEncoder<Q> {
    /// Brings the window, which holds the slab, close to its goal; it has fitted quadrics then. Where the error decides, the
    /// stages tell how many vertices the goal is to be.
    pub(super) fn refit(
        &mut self,
        unfrozen: Unfrozen,
        mut goal: Goal,
        observer: &mut Observer,
    ) -> Result<Goal, EncodeError> {
        let params = FitParams {
            position_iterations: self.fit_params.position_iterations.min(STEPS),
            // Edges are told from their neighbourhood in the end.
            quarter_weight: 0.0,
            ..self.fit_params.clone()
        };
        let mut fitted: Option<TetMesh> = None;
        let mut ahead: VecDeque<f64> = stages(self.refits).collect();
        let mut detours = 0;
        while let Some(ratio) = ahead.pop_front() {
            observer.tell(Event::Began(Stage::Simplify));
            match fitted.take() {
                Some(mesh) => self.start_again(&mesh, ratio * goal.vertices as f64, observer),
                None => self.simplify_blocks(unfrozen, self.goal_of_first(ratio, goal), observer),
            }
            let mut mesh = TetMesh::empty(self.committed.domain);
            self.work.commit(i32::MAX, &mut mesh);
            observer.tell(Event::Ended);
            let free = vec![true; mesh.positions.len()];
            let source = Source { frames: &self.volume, labels: self.labels.make_contiguous() };
            let report = observer.stage(Stage::Fit, || fit_in_parts(&mut mesh, &free, source, &params))?;
            log::debug!("stage of {} vertices: {report:?}", mesh.positions.len());
            if self.is_steered() {
                goal = self.aim_by(&mesh, ahead.len(), goal)?;
                if detours < MOST_DETOURS && mesh.positions.len() as f64 > FAR * goal.vertices as f64 {
                    detours += 1;
                    ahead.push_front(ratio);
                }
            }
            fitted = Some(mesh);
        }
        if let Some(mesh) = fitted {
            observer.tell(Event::Began(Stage::Simplify));
            self.start_again(&mesh, mesh.positions.len() as f64, observer);
            observer.tell(Event::Ended);
        }
        Ok(goal)
    }

    /// How far the window is simplified before its first fit.
    fn goal_of_first(&self, ratio: f64, goal: Goal) -> BlockGoal {
        if self.is_steered() {
            let max_error = self.aim.first_part() as f32 * goal.max_error;
            return BlockGoal { keep: 0.0, max_error, shift: 0.0 };
        }
        self.keep_of_window((ratio * goal.vertices as f64) as usize, 0.0)
    }

    /// The goal after a stage, whose mesh is shown to have the error that it has.
    fn aim_by(&mut self, mesh: &TetMesh, stages_left: usize, goal: Goal) -> Result<Goal, EncodeError> {
        let mut proof = Proof::new(self.fit_params.subdivision_levels);
        if let Some(error) = proof.compare(mesh, self.volume.frames())? {
            self.aim.pass(mesh.positions.len(), error, stages_left as u32 + 1);
        }
        let vertices = self.aim.vertices().min(self.most_vertices) as usize;
        log::debug!("{:?}: {vertices} vertices", self.aim);
        Ok(Goal { vertices, max_error: f32::INFINITY, ..goal })
    }

    /// The window anew from a fitted mesh, simplified in blocks to about so many vertices.
    fn start_again(&mut self, mesh: &TetMesh, wanted: f64, observer: &mut Observer) {
        self.work = WorkMesh::new(self.committed.domain);
        let keep = (wanted / mesh.positions.len() as f64).min(1.0);
        let goal = BlockGoal { keep, max_error: f32::INFINITY, shift: 0.5 };
        let report = self.work.append_fitted(mesh, goal, &self.simplify_params);
        log::debug!("blocks of a stage: {report:?}");
        observer.tell(Event::Simplified(report));
    }
}
