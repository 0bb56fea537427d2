//! Fits on the way to the simplification ratio.
//!
//! Quadrics know what the lattice was, not what the mesh has become: what is left of it drifts from the lattice's colours,
//! and a fit moves it further. So a slab that is in the window as a whole is brought close to its goal in stages. At each
//! it is fitted to the frames, and quadrics are built anew from what was fitted, which is closer to the frames at as many
//! vertices than the mesh that quadrics alone led to. (An eighth less error in the end, docs/benchmarks.md.)

use super::{SlabEncoder, Source, fit_in_parts};
use crate::encoder::EncodeError;
use crate::encoder::observer::{Event, Observer, Stage};
use crate::mesh::TetMesh;
use crate::vectorize::fit::FitParams;
use crate::vectorize::simplify::{BlockGoal, Unfrozen, WedgeQuadric, WorkMesh};

/// Vertices at the first stage, over those of the goal. From there to the goal each stage has the same part of the last.
const FIRST_STAGE: f64 = 2.0;
/// Where more stages begin higher: factor a stage.
const MORE_FIRST: f64 = 1.25;

/// Steps of the position optimisation at a stage: what follows undoes more than further steps would gain.
const STEPS: u32 = 3;

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
    /// Brings the window, which holds the slab, close to so many vertices; it has fitted quadrics then.
    pub(super) fn refit(
        &mut self,
        unfrozen: Unfrozen,
        vertices: usize,
        observer: &mut Observer,
    ) -> Result<(), EncodeError> {
        let params = FitParams {
            position_iterations: self.fit_params.position_iterations.min(STEPS),
            // Edges are told from their neighbourhood in the end.
            quarter_weight: 0.0,
            ..self.fit_params.clone()
        };
        let mut fitted: Option<TetMesh> = None;
        for wanted in stages(self.refits).map(|ratio| ratio * vertices as f64) {
            observer.tell(Event::Began(Stage::Simplify));
            match fitted.take() {
                Some(mesh) => self.start_again(&mesh, wanted, observer),
                None => self.simplify_blocks(unfrozen, wanted as usize, 0.0, observer),
            }
            let mut mesh = TetMesh::empty(self.committed.domain);
            self.work.commit(i32::MAX, &mut mesh);
            observer.tell(Event::Ended);
            let free = vec![true; mesh.positions.len()];
            let source = Source { frames: &self.volume, labels: self.labels.make_contiguous() };
            let report = observer.stage(Stage::Fit, || fit_in_parts(&mut mesh, &free, source, &params))?;
            log::debug!("stage of {} vertices: {report:?}", mesh.positions.len());
            fitted = Some(mesh);
        }
        if let Some(mesh) = fitted {
            observer.tell(Event::Began(Stage::Simplify));
            self.start_again(&mesh, mesh.positions.len() as f64, observer);
            observer.tell(Event::Ended);
        }
        Ok(())
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
