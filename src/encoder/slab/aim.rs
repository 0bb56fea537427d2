//! How many vertices a slab needs for the error that is asked for.
//!
//! In: vertices and errors of meshes on the way there. Out: how many are to be left. Forbidden here: meshes, pictures.
//!
//! The error of a fitted mesh is near to a power of its number of vertices: -0.3 to -0.5 from clip to clip. Each mesh on the way
//! is closer to the goal than the one before, so what the power is matters less and less (docs/benchmarks.md).

use super::refits::FIRST_STAGE;

/// What slabs tell the next ones about the way from costs and vertices to the error that decoders show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::encoder) struct ErrorModel {
    /// Cost of the last collapse times vertices a pixel, over the squared mean absolute error after a fit.
    gain: f64,
    /// The error after the next fit over what the power foretells from the one before.
    fit: f64,
}

impl Default for ErrorModel {
    /// What natural clips have: gains of 140 to 180, fits of 0.88 to 0.96.
    fn default() -> Self {
        Self { gain: 150.0, fit: 0.92 }
    }
}

/// The error falls with the number of vertices to this power.
const EXPONENT: f64 = 0.4;
/// [`ErrorModel::fit`], whatever the content.
const FIT: std::ops::RangeInclusive<f64> = 0.75..=1.25;
/// Factors by which one slab may change the gain.
const GAIN_CHANGE: std::ops::RangeInclusive<f64> = 0.5..=2.0;
/// The part of the last stage's vertices that is left at least: the power holds for no more, and slabs to come are led closer.
const LEAST_PART: f64 = 0.25;

/// A fitted mesh on the way.
#[derive(Debug, Clone, Copy)]
struct Waypoint {
    vertices: f64,
    error: f64,
    /// Fits to come, with the last.
    fits_left: u32,
}

/// The way of one slab to its error.
#[derive(Debug, Clone, Copy)]
pub(super) struct Aim {
    target: f64,
    model: ErrorModel,
    stages: u32,
    last: Option<Waypoint>,
}

impl Aim {
    /// The way to `target` by so many stages and a last fit.
    pub(super) fn new(target: f64, stages: u32, model: ErrorModel) -> Self {
        Self { target, model, stages, last: None }
    }

    /// Whether there is a target, so that the error decides.
    pub(super) fn is_wanted(&self) -> bool {
        self.target > 0.0
    }

    /// Cost of the last collapse times vertices a pixel that is foretold to lead to the target by one fit.
    pub(super) fn allowed(&self) -> f64 {
        self.model.gain * self.target.powi(2)
    }

    /// The same for the first stage: what is allowed there, over what is allowed for the target by one fit.
    pub(super) fn first_part(&self) -> f64 {
        (self.first_error() / self.target).powi(2)
    }

    /// The error that the first stage is to have.
    fn first_error(&self) -> f64 {
        self.target * FIRST_STAGE.powf(-EXPONENT) / self.model.fit.powi(self.stages as i32)
    }

    /// A stage's fitted mesh has so many vertices and this error; so many fits follow, with the last.
    pub(super) fn pass(&mut self, vertices: usize, error: f64, fits_left: u32) {
        if self.last.is_none() {
            self.model.correct_gain(self.first_error(), error);
        }
        self.last = Some(Waypoint { vertices: vertices as f64, error, fits_left });
    }

    /// Vertices that lead to the target, no more than there are, nor much fewer.
    pub(super) fn vertices(&self) -> f64 {
        let Some(Waypoint { vertices, error, fits_left }) = self.last else { return f64::INFINITY };
        let fitted = error * self.model.fit.powi(fits_left as i32);
        vertices * (fitted / self.target).powf(1.0 / EXPONENT).clamp(LEAST_PART, 1.0)
    }

    /// What was coded has so many vertices and this error.
    pub(super) fn arrive(&mut self, vertices: usize, error: f64) {
        match self.last {
            None => self.model.correct_gain(self.target, error),
            // Pictures without an error teach nothing.
            Some(last) if last.error > 0.0 && error > 0.0 && vertices > 0 => {
                let foretold = last.error * (last.vertices / vertices as f64).powf(EXPONENT);
                self.model.fit = (error / foretold).clamp(*FIT.start(), *FIT.end());
            }
            Some(_) => {}
        }
    }

    /// What is known by now.
    pub(super) fn model(&self) -> ErrorModel {
        self.model
    }
}

impl ErrorModel {
    /// Learns from an error that was reached where another was meant.
    fn correct_gain(&mut self, meant: f64, reached: f64) {
        if reached > 0.0 {
            self.gain *= (meant / reached).powi(2).clamp(*GAIN_CHANGE.start(), *GAIN_CHANGE.end());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The error of a clip that the model is wrong about: another power, and fits that take nothing away.
    fn error(vertices: f64) -> f64 {
        2.0 * (vertices / 10_000.0).powf(-0.5)
    }

    #[test]
    fn slabs_teach_the_next_ones() {
        let mut model = ErrorModel::default();
        let mut off = Vec::new();
        for _ in 0..5 {
            let mut aim = Aim::new(2.0, 2, model);
            for (vertices, fits_left) in [(25_000.0, 2), (14_000.0, 1)] {
                aim.pass(vertices as usize, error(vertices), fits_left);
            }
            let vertices = aim.vertices();
            let coded = 1.1 * error(vertices);
            aim.arrive(vertices as usize, coded);
            model = aim.model();
            off.push((coded / 2.0 - 1.0).abs());
        }
        assert!(off[0] > 0.1, "the clip is no other: {off:?}");
        assert!(off.is_sorted_by(|earlier, later| earlier > later) && off[3] < 0.01, "{off:?}");
    }

    #[test]
    fn what_is_gone_does_not_come_back() {
        let mut aim = Aim::new(1.0, 2, ErrorModel::default());
        assert_eq!(aim.vertices(), f64::INFINITY);
        aim.pass(1000, 1.5, 1);
        assert_eq!(aim.vertices(), 1000.0);
        assert!(aim.model().gain < ErrorModel::default().gain, "the next slab is to stop earlier");
    }

    #[test]
    fn pictures_without_an_error_teach_nothing_wild() {
        let mut aim = Aim::new(1.0, 2, ErrorModel::default());
        aim.pass(1000, 0.0, 2);
        aim.pass(800, 0.0, 1);
        assert_eq!(aim.vertices(), 200.0);
        aim.arrive(0, 0.0);
        assert_eq!(aim.model(), ErrorModel::default());
    }
}
