//! Runs of mesh for the window: frames and labels in, cleaved lattice out, dense or adaptive.

use std::sync::Arc;

use super::{EncodeError, EncoderConfig, LatticeKind};
use crate::mesh::{Domain, TetMesh};
use crate::vectorize::cleave::{cleave, cleave_tets};
use crate::vectorize::lattice::{AdaptiveLattice, Lattice, TetLattice};
use crate::vectorize::segment::{halfway, is_moving};
use crate::video::{Frame, LabelPlane};

/// A frame and its labels.
type Plane = (Arc<Frame>, LabelPlane);

/// A run of mesh that continues the last one at its lowest plane.
pub(super) struct Run {
    /// The mesh of it.
    pub(super) mesh: TetMesh,
    /// Frame number of its highest plane.
    pub(super) last: u32,
    /// Planes that its lattice has for each frame, between which is nothing but lattice.
    pub(super) planes_a_frame: i32,
}

/// What is known of a run whose lattice is held back.
struct Held {
    last: u32,
    planes_a_frame: i32,
}

/// What a vertex of the lattice counts at which nothing changes in time.
const REPEATS: f64 = 0.25;

/// Collects planes and makes runs of them.
pub(super) struct Runs {
    domain: Domain,
    /// None where the lattice is dense.
    adaptive: Option<AdaptiveLattice>,
    /// Frame steps of a run.
    steps: u32,
    /// Planes that are not in a lattice yet, and before them the one that the next run starts with.
    waiting: Vec<Plane>,
    /// Number of the first plane waiting.
    first: u32,
    /// The run that is to come out next, where the adaptive lattice holds one back.
    held: Option<Held>,
}

impl Runs {
    pub(super) fn new(domain: Domain, config: &EncoderConfig) -> Self {
        let is_small = domain.width.min(domain.height) < AdaptiveLattice::MIN_CUT;
        let adaptive = config.lattice == LatticeKind::Adaptive && !(config.superpixels != 1 && is_small);
        // A short window has no room to collapse them.
        let repeats = if config.holds_slab() { REPEATS } else { 1.0 };
        Self {
            domain,
            adaptive: adaptive.then(|| AdaptiveLattice::new(domain, config.lattice_ratio()).with_repeats(repeats)),
            steps: config.run_steps(),
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
        if self.first == 0 && steps < AdaptiveLattice::MIN_CUT && is_cut(&self.waiting) {
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
        let first = self.first;
        self.first += steps;
        match &mut self.adaptive {
            Some(adaptive) => {
                let (times, planes) = with_halves(planes, first, self.domain.unit());
                let planes_a_frame = if times.len() > 2 * steps as usize { 2 } else { 1 };
                let (frames, labels): (Vec<Arc<Frame>>, Vec<LabelPlane>) = planes.into_iter().unzip();
                let lattice = adaptive.push_planes(&times, &frames, &labels)?;
                self.cleave_held(lattice, Some(Held { last: first + steps, planes_a_frame }))
            }
            None => {
                let (frames, labels): (Vec<Arc<Frame>>, Vec<LabelPlane>) = planes.into_iter().unzip();
                let mesh = cleave(&Lattice::try_new(self.domain, first, &frames, &labels)?)?;
                Ok(Some(Run { mesh, last: first + steps, planes_a_frame: 1 }))
            }
        }
    }

    /// The run of a lattice that was held back, while `next` is.
    fn cleave_held(&mut self, lattice: Option<TetLattice>, next: Option<Held>) -> Result<Option<Run>, EncodeError> {
        let held = std::mem::replace(&mut self.held, next);
        match (lattice, held) {
            (Some(lattice), Some(Held { last, planes_a_frame })) => {
                Ok(Some(Run { mesh: cleave_tets(&lattice)?, last, planes_a_frame }))
            }
            _ => Ok(None),
        }
    }
}

/// Whether labels differ anywhere.
fn is_cut(planes: &[Plane]) -> bool {
    let first = planes.first().map(|(_, labels)| labels.label(0, 0));
    planes.iter().any(|(_, labels)| Some(labels.label(0, 0)) != first || !labels.is_uniform())
}

/// A run's planes and their times, with planes between frames where labels move by more than a pixel a frame: as many as
/// the lattice's cells have room for, which it would otherwise fill with what it knows.
fn with_halves(planes: Vec<Plane>, first: u32, unit: i32) -> (Vec<i64>, Vec<Plane>) {
    const CELL: usize = AdaptiveLattice::MAX_STEPS as usize;
    let steps = planes.len() - 1;
    let room = if steps == CELL { steps } else { CELL.saturating_sub(steps) };
    let is_worth_it = room <= steps && planes.windows(2).any(|pair| is_moving(&pair[0].1, &pair[1].1));
    let halves = if is_worth_it { room } else { 0 };
    let unit = i64::from(unit);
    let time = |n: usize| (i64::from(first) + n as i64) * unit;
    // The last ones, as where the lattice fills cells by itself.
    let between: Vec<(i64, Plane)> = (steps - halves..steps)
        .map(|n| {
            let [before, after] = [&planes[n], &planes[n + 1]];
            let (frame, labels) = halfway((&before.0, &before.1), (&after.0, &after.1));
            (time(n) + unit / 2, (Arc::new(frame), labels))
        })
        .collect();
    let mut all: Vec<(i64, Plane)> = (0..).map(time).zip(planes).chain(between).collect();
    all.sort_by_key(|(time, _)| *time);
    all.into_iter().unzip()
}
