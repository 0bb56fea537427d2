//! Runs of mesh for the window: frames and labels in, cleaved lattice out, dense or adaptive.

use std::sync::Arc;

use super::{EncodeError, EncoderConfig, LatticeKind};
use crate::mesh::{Domain, TetMesh};
use crate::vectorize::cleave::{cleave, cleave_tets};
use crate::vectorize::lattice::{AdaptiveLattice, Lattice, TetLattice};
use crate::video::{Frame, LabelPlane};

/// A run of mesh that continues the last one at its lowest plane.
pub(super) struct Run {
    /// The mesh of it.
    pub(super) mesh: TetMesh,
    /// Frame number of its highest plane.
    pub(super) last: u32,
}

/// Collects planes and makes runs of them.
pub(super) struct Runs {
    domain: Domain,
    /// None where the lattice is dense.
    adaptive: Option<AdaptiveLattice>,
    /// Frame steps of a run.
    steps: u32,
    /// Whether labels may differ.
    is_cut: bool,
    /// Planes that are not in a lattice yet, and before them the one that the next run starts with.
    waiting: Vec<(Arc<Frame>, LabelPlane)>,
    /// Number of the first plane waiting.
    first: u32,
    /// Highest plane of the run that is to come out next, where the adaptive lattice holds one back.
    held: Option<u32>,
}

impl Runs {
    pub(super) fn new(domain: Domain, config: &EncoderConfig) -> Self {
        let is_cut = config.superpixels != 1;
        let is_small = domain.width.min(domain.height) < AdaptiveLattice::MIN_CUT;
        let adaptive = config.lattice == LatticeKind::Adaptive && !(is_cut && is_small);
        Self {
            domain,
            adaptive: adaptive.then(|| AdaptiveLattice::new(domain, config.lattice_ratio())),
            steps: config.run_steps(),
            is_cut,
            waiting: Vec::new(),
            first: 0,
            held: None,
        }
    }

    /// Takes the next plane.
    pub(super) fn push(&mut self, frame: Arc<Frame>, labels: LabelPlane) {
        self.waiting.push((frame, labels));
    }

    /// The runs that became ready; with `ended` no plane will follow.
    pub(super) fn take_ready(&mut self, ended: bool) -> Result<Vec<Run>, EncodeError> {
        let mut runs = Vec::new();
        while let Some(steps) = self.next_steps(ended) {
            runs.extend(self.lattice(steps)?);
        }
        if ended && let Some(lattice) = self.adaptive.as_mut().and_then(AdaptiveLattice::finish) {
            runs.extend(self.cleave_held(Some(lattice), None)?);
        }
        Ok(runs)
    }

    /// Steps of the next run, if it can be made yet.
    fn next_steps(&mut self, ended: bool) -> Option<u32> {
        let steps = (self.waiting.len() as u32).saturating_sub(1);
        if self.adaptive.is_none() {
            return if ended {
                (steps > 0).then_some(steps.min(self.steps))
            } else {
                (steps >= self.steps).then_some(self.steps)
            };
        }
        if !ended {
            // What is left at the end must not be too short to be cut.
            return (steps >= self.steps + AdaptiveLattice::MIN_CUT).then_some(self.steps);
        }
        if self.first == 0 && self.is_cut && steps < AdaptiveLattice::MIN_CUT {
            self.adaptive = None;
        }
        let runs = steps.div_ceil(AdaptiveLattice::MAX_STEPS);
        (steps > 0).then(|| steps.div_ceil(runs))
    }

    fn lattice(&mut self, steps: u32) -> Result<Option<Run>, EncodeError> {
        // The next run starts with this one's last plane.
        let next = self.waiting.split_off(steps as usize);
        let mut planes = std::mem::replace(&mut self.waiting, next);
        planes.push(self.waiting[0].clone());
        let (frames, labels): (Vec<Arc<Frame>>, Vec<LabelPlane>) = planes.into_iter().unzip();
        let first = self.first;
        self.first += steps;
        match &mut self.adaptive {
            Some(adaptive) => {
                let lattice = adaptive.push(first, &frames, &labels)?;
                self.cleave_held(lattice, Some(first + steps))
            }
            None => {
                let mesh = cleave(&Lattice::try_new(self.domain, first, &frames, &labels)?)?;
                Ok(Some(Run { mesh, last: first + steps }))
            }
        }
    }

    /// The run of a lattice that was held back, while one up to plane `next` is.
    fn cleave_held(&mut self, lattice: Option<TetLattice>, next: Option<u32>) -> Result<Option<Run>, EncodeError> {
        let last = std::mem::replace(&mut self.held, next);
        match (lattice, last) {
            (Some(lattice), Some(last)) => Ok(Some(Run { mesh: cleave_tets(&lattice)?, last })),
            _ => Ok(None),
        }
    }
}
