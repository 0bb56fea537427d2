//! Colours of wedges.
//!
//! In: a colour, and the colours known around it. Out: the same, quantised and coded. Forbidden here: geometry.

use glam::Vec3;

use super::MeshFault;
use super::bits::Part;
use super::range_coder::BitCoder;
use super::symbols::IntModel;

/// A colour in quantisation steps: R, G, B.
pub(super) type Steps = [i32; 3];

/// Range of a channel in 8-bit levels. Wider than a picture's: clamping fitted colours to [0, 255] costs quality.
const LEVELS: [i32; 2] = [-128, 383];

/// Steps are counted in 1/16 of a level.
const STEPS_A_LEVEL: i32 = 16;

/// Quantisation steps of colours that a slab may have, in 1/16 of an 8-bit level.
pub const COLOR_STEPS: std::ops::RangeInclusive<u8> = 1..=128;

/// The quantisation step of a slab that has chosen none: 2 levels.
#[cfg(feature = "encode")]
pub(super) const DEFAULT_COLOR_STEP: u8 = 32;

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

/// What a colour (8-bit levels) will be after the stream, with a slab's `color_step`.
#[cfg(feature = "encode")]
pub fn quantize_color(color: Vec3, color_step: u8) -> Vec3 {
    from_steps(to_steps(color, color_step), color_step)
}

/// Classes of how uncertain a prediction is: the binary logarithm of a variance, then one for a single wedge known and
/// one for none.
const CLASSES: usize = 18;
/// Classes of the residual of green, the context of those of red and blue.
const GREEN_CLASSES: usize = 4;

/// Largest magnitude of a residual that [`Slope`] learns from.
const LEARNT_MAX: i64 = 255;
/// Window of its averages, as a power of two.
const SLOPE_SHIFT: u32 = 10;

/// Magnitudes of a coded colour's residuals: green's, and the sum of the others'.
pub(super) type Misses = [u16; 2];

/// Green, red less green, blue less green: what is predicted.
fn to_channels([red, green, blue]: Steps) -> [i64; 3] {
    [green, red - green, blue - green].map(i64::from)
}

/// A coded colour as predictions need it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct KnownColor {
    /// Green, red less green, blue less green.
    channels: [i16; 3],
    misses: Misses,
    /// 1; 0 in what stands for no colour.
    count: u16,
}

impl KnownColor {
    pub(super) fn new(steps: Steps, misses: Misses) -> Self {
        // Of 14 bits at most: LEVELS in steps of a sixteenth, and their differences.
        Self { channels: to_channels(steps).map(|channel| channel as i16), misses, count: 1 }
    }

    pub(super) fn without_misses(self) -> Self {
        Self { misses: [0; 2], ..self }
    }
}

/// What a wedge's colour is predicted from: sums over the known wedges of its star, as often as tets have them.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Around {
    count: i64,
    sum: [i64; 3],
    squares: [i64; 3],
    misses: [i64; 2],
}

impl Around {
    /// Takes a wedge in.
    #[inline]
    pub(super) fn add(&mut self, color: KnownColor) {
        self.count += i64::from(color.count);
        for (channel, value) in color.channels.into_iter().enumerate() {
            self.sum[channel] += i64::from(value);
            self.squares[channel] += i64::from(i32::from(value) * i32::from(value));
        }
        for (sum, miss) in self.misses.iter_mut().zip(color.misses) {
            *sum += i64::from(miss);
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// The mean, rounded; 0 of nothing.
    fn prediction(&self) -> [i64; 3] {
        let n = self.count.max(1);
        self.sum.map(|sum| (2 * sum + n).div_euclid(2 * n))
    }

    /// The square of the count times the variance of a channel.
    fn variance(&self, channel: usize) -> i64 {
        self.count * self.squares[channel] - self.sum[channel] * self.sum[channel]
    }

    /// Class of how uncertain the prediction is: how much the wedges around differ, and how badly they were predicted.
    fn class(&self, variance: i64, misses: i64) -> usize {
        match self.count {
            0 => CLASSES - 2,
            1 => CLASSES - 1,
            n => ((4 * (variance + misses * misses) / (n * n) + 1).ilog2() as usize).min(CLASSES - 3),
        }
    }
}

/// How one residual follows another: the slope of a line through 0, fitted to the last some thousand.
#[derive(Debug, Clone, Copy)]
struct Slope {
    products: i64,
    squares: i64,
}

impl Slope {
    const NEW: Self = Self { products: 0, squares: 64 };

    fn predict(&self, from: i64) -> i64 {
        (2 * self.products * from + self.squares).div_euclid(2 * self.squares)
    }

    fn learn(&mut self, from: i64, to: i64) {
        let [from, to] = [from, to].map(|residual| residual.clamp(-LEARNT_MAX, LEARNT_MAX));
        self.products += from * to - (self.products >> SLOPE_SHIFT);
        self.squares += from * from - (self.squares >> SLOPE_SHIFT);
    }
}

/// Models of colour residuals.
#[derive(Debug, Clone)]
pub(super) struct ColorModels {
    green: [IntModel; CLASSES],
    red: [[IntModel; GREEN_CLASSES]; CLASSES],
    blue: [[IntModel; GREEN_CLASSES]; CLASSES],
    red_of_green: Slope,
    blue_of_green: Slope,
    blue_of_red: Slope,
}

impl ColorModels {
    pub(super) const NEW: Self = Self {
        green: [const { IntModel::NEW }; CLASSES],
        red: [const { [const { IntModel::NEW }; GREEN_CLASSES] }; CLASSES],
        blue: [const { [const { IntModel::NEW }; GREEN_CLASSES] }; CLASSES],
        red_of_green: Slope::NEW,
        blue_of_green: Slope::NEW,
        blue_of_red: Slope::NEW,
    };
}

/// Codes a wedge's colour. Returns it with the magnitudes of its residuals.
///
/// The residuals of the three channels still hang together, from clip to clip in another way, so what is left of red is
/// predicted from green's, and of blue from both.
///
/// # Errors
/// A colour outside the range of the format.
pub(super) fn code_color(
    coder: &mut impl BitCoder,
    models: &mut ColorModels,
    around: &Around,
    step: u8,
    truth: Steps,
) -> Result<(Steps, Misses), MeshFault> {
    let predicted = around.prediction();
    let truth = to_channels(truth);
    let residual = [0, 1, 2].map(|channel| truth[channel] - predicted[channel]);
    let [luma, chroma] = [(around.variance(0), 0), (around.variance(1) + around.variance(2), 1)]
        .map(|(v, m)| around.class(v, around.misses[m]));

    coder.enter(Part::Luma);
    let green = code_residual(coder, &mut models.green[luma], residual[0]);
    coder.enter(Part::Chroma);
    let context = (green.unsigned_abs().min(7) + 1).ilog2() as usize;
    let along = models.red_of_green.predict(green);
    let red = code_residual(coder, &mut models.red[chroma][context], residual[1] - along);
    models.red_of_green.learn(green, along + red);
    let along_red = models.blue_of_red.predict(red);
    let along_green = models.blue_of_green.predict(green);
    let blue = code_residual(coder, &mut models.blue[chroma][context], residual[2] - along_green - along_red);
    models.blue_of_green.learn(green, along_green + along_red + blue);
    models.blue_of_red.learn(red, along_red + blue);

    let found = predicted[0] + green;
    let found = [found + predicted[1] + along + red, found, found + predicted[2] + along_green + along_red + blue];
    let [low, high] = step_range(step).map(i64::from);
    if let Some(found) = found.into_iter().find(|channel| !(low..=high).contains(channel)) {
        return Err(MeshFault::Range { field: "color", low, high, found });
    }
    let miss = |residual: u64| residual.min(u16::MAX.into()) as u16;
    let misses = [miss(green.unsigned_abs()), miss(red.unsigned_abs() + blue.unsigned_abs())];
    Ok((found.map(|channel| channel as i32), misses))
}

/// Codes a residual; the parser's `truth` is not looked at, and may be anything.
fn code_residual(coder: &mut impl BitCoder, model: &mut IntModel, truth: i64) -> i64 {
    const LIMIT: i64 = 1 << 24;
    model.code(coder, truth.clamp(-LIMIT, LIMIT) as i32).into()
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
