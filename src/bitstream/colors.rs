//! Colours of wedges.
//!
//! In: a colour, and the colours known around it. Out: the same, quantised and coded. Forbidden here: geometry.

use glam::Vec3;

use super::MeshFault;
use super::range_coder::BitCoder;
use super::symbols::IntModel;

/// A colour in quantisation steps: R, G, B.
pub(super) type Steps = [i32; 3];

/// Range of a channel in 8-bit levels. Wider than a picture's: clamping fitted colours to [0, 255] costs quality.
const LEVELS: [i32; 2] = [-128, 383];

/// Steps are counted in 1/16 of a level.
const STEPS_A_LEVEL: i32 = 16;

/// Range of a channel in steps of `step` sixteenths.
fn step_range(step: u8) -> [i32; 2] {
    LEVELS.map(|level| level * STEPS_A_LEVEL / i32::from(step.max(1)))
}

/// The colour in steps of `step` sixteenths of a level, clamped to the range of the format.
#[cfg(feature = "encode")]
pub(super) fn to_steps(color: Vec3, step: u8) -> Steps {
    let [low, high] = step_range(step);
    let scale = STEPS_A_LEVEL as f32 / f32::from(step.max(1));
    color.to_array().map(|channel| ((channel * scale).round() as i32).clamp(low, high))
}

/// The colour in 8-bit levels. Exact: a small integer over 16.
pub(super) fn from_steps(steps: Steps, step: u8) -> Vec3 {
    Vec3::from_array(steps.map(|s| (s * i32::from(step)) as f32 / STEPS_A_LEVEL as f32))
}

/// What a colour (8-bit levels) will be after the stream, with a sequence's `color_step`.
#[cfg(feature = "encode")]
pub fn quantize_color(color: Vec3, color_step: u8) -> Vec3 {
    from_steps(to_steps(color, color_step), color_step)
}

/// Classes of how much the known colours around a wedge differ; the last three are for one known, the label's last
/// and none.
const SPREADS: usize = 12;
/// Classes of the residual of green, the context of those of red and blue.
const GREEN_CLASSES: usize = 4;

/// What a wedge's colour is predicted from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Around {
    /// The tet's other wedges.
    Tet {
        /// How many, 1 to 3.
        count: u32,
        /// Weighted mean of their colours.
        mean: Steps,
        /// Greatest less least green.
        spread: u32,
    },
    /// The last wedge coded with this label.
    Label(Steps),
    /// Another label's wedge at the vertex, or nothing.
    Other(Steps),
}

/// Models of colour residuals.
#[derive(Debug, Clone)]
pub(super) struct ColorModels {
    green: [IntModel; SPREADS],
    red: [[IntModel; GREEN_CLASSES]; SPREADS],
    blue: [[IntModel; GREEN_CLASSES]; SPREADS],
}

impl ColorModels {
    pub(super) const NEW: Self = Self {
        green: [const { IntModel::NEW }; SPREADS],
        red: [const { [const { IntModel::NEW }; GREEN_CLASSES] }; SPREADS],
        blue: [const { [const { IntModel::NEW }; GREEN_CLASSES] }; SPREADS],
    };
}

impl Around {
    /// What the other wedges of a tet tell, each with its weight > 0; `None` if there are none.
    pub(super) fn of_tet(known: impl Iterator<Item = (Steps, f64)>) -> Option<Self> {
        let (mut total, mut sum) = (0.0, [0.0; 3]);
        let (mut count, mut low, mut high) = (0, i32::MAX, i32::MIN);
        for (steps, weight) in known {
            total += weight;
            sum = [0, 1, 2].map(|c| sum[c] + weight * f64::from(steps[c]));
            (count, low, high) = (count + 1, low.min(steps[1]), high.max(steps[1]));
        }
        let mean = sum.map(|channel| (channel / total + 0.5).floor() as i32);
        (count > 0).then(|| Self::Tet { count, mean, spread: high.abs_diff(low) })
    }

    fn prediction(&self) -> Steps {
        match *self {
            Self::Tet { mean, .. } => mean,
            Self::Label(steps) | Self::Other(steps) => steps,
        }
    }

    fn class(&self) -> usize {
        match *self {
            Self::Tet { count: 1, .. } => SPREADS - 3,
            Self::Tet { spread, .. } => ((spread + 1).ilog2() as usize).min(SPREADS - 4),
            Self::Label(_) => SPREADS - 2,
            Self::Other(_) => SPREADS - 1,
        }
    }
}

/// Codes a wedge's colour: the residual of green, then those of red and blue less that of green.
///
/// # Errors
/// A colour outside the range of the format.
pub(super) fn code_color(
    coder: &mut impl BitCoder,
    models: &mut ColorModels,
    around: &Around,
    step: u8,
    truth: Steps,
) -> Result<Steps, MeshFault> {
    let predicted = around.prediction();
    let class = around.class();
    let residual = [0, 1, 2].map(|c| truth[c] - predicted[c]);
    let green = models.green[class].code(coder, residual[1]);
    let context = (green.unsigned_abs().min(7) + 1).ilog2() as usize;
    let red = models.red[class][context].code(coder, residual[0] - residual[1]);
    let blue = models.blue[class][context].code(coder, residual[2] - residual[1]);
    let [low, high] = step_range(step);
    let mut steps = [0; 3];
    for (channel, (part, shared)) in [(red, green), (green, 0), (blue, green)].into_iter().enumerate() {
        let found = i64::from(predicted[channel]) + i64::from(part) + i64::from(shared);
        steps[channel] = i32::try_from(found).ok().filter(|s| (low..=high).contains(s)).ok_or(MeshFault::Range {
            field: "color",
            low: low.into(),
            high: high.into(),
            found,
        })?;
    }
    Ok(steps)
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;

    #[test]
    fn quantisation_is_idempotent_and_clamps() {
        for step in [1, 3, 16, 48, 128] {
            for level in [-1000.0, -128.0, -0.3, 0.0, 7.77, 128.0, 255.0, 382.9, 1e9, f32::NAN] {
                let once = quantize_color(Vec3::splat(level), step);
                assert_eq!(quantize_color(once, step), once);
                assert!((-128.0..=383.0).contains(&once.x));
                if (0.0..=255.0).contains(&level) {
                    assert!((once.x - level).abs() <= f32::from(step) / 32.0 + 1e-4);
                }
            }
        }
    }
}
