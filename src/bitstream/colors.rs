//! Colours of wedges.
//!
//! In: a colour, and the colours known around it. Out: the same, quantised and coded. Forbidden here: geometry.

use glam::Vec3;

use super::MeshFault;
use super::bits::Part;
use super::extents::ilog2;
use super::normals::floor;
use super::range_coder::BitCoder;
use super::symbols::{ResidualModel, UintModel};

/// A colour: R, G, B in grains.
pub(super) type Grains = [i32; 3];

/// A grain is this part of an 8-bit level; all steps are whole grains.
pub(super) const GRAINS_A_LEVEL: i32 = 128;

/// Range of a channel, in 8-bit levels. Wider than a picture's: clamping fitted colours to [0, 255] costs quality.
const LEVELS: [i32; 2] = [-128, 383];

/// Octaves that a wedge's step may be finer or coarser than the slab's.
const OCTAVES: [i32; 2] = [-3, 2];

/// How coarsely a slab's colours are quantised.
///
/// The squared error that a rounded colour adds grows with the volume it colours, what it costs does not. Both are best
/// spent where each step costs all wedges the same error: steps go with the square root of the tets' density (the
/// reverse of Gersho's rule for one density), in octaves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ColorSteps {
    /// The step of wedges of this size, in 1/16 of an 8-bit level: 1 to 128.
    pub step: u8,
    /// Binary logarithm of the product of the extents x, y and t that edges have around such a wedge, in 1/16 lattice
    /// units: 0 to 69.
    pub size: u8,
}

impl Default for ColorSteps {
    /// Two levels, whatever the size.
    fn default() -> Self {
        Self::even(2)
    }
}

impl ColorSteps {
    /// Least and greatest step.
    pub(super) const STEPS: [u8; 2] = [1, 128];
    /// Least and greatest size.
    pub(super) const SIZES: [u8; 2] = [0, 69];

    /// Steps of so many levels, 1 to 32, for wedges of all sizes: they are all small beside this one.
    pub const fn even(levels: u8) -> Self {
        Self { step: levels.saturating_mul(4), size: Self::SIZES[1] }
    }

    /// Whether both numbers are in range.
    #[cfg(feature = "encode")]
    pub(super) fn is_valid(self) -> bool {
        let [low, high] = Self::STEPS;
        (low..=high).contains(&self.step) && self.size <= Self::SIZES[1]
    }

    /// Octaves that wedges of a size differ in their step from the slab's.
    pub(crate) fn octaves(self, size: i32) -> i32 {
        let [low, high] = OCTAVES;
        ((i32::from(self.size) - size) >> 1).clamp(low, high)
    }

    /// The step of wedges of a size, in grains.
    pub(super) fn at(self, size: i32) -> i32 {
        i32::from(self.step) << (self.octaves(size) - OCTAVES[0])
    }
}

/// The multiple of `step` next to a colour in levels, within the range of the format.
#[cfg(feature = "encode")]
pub(super) fn to_grains(color: Vec3, step: i32) -> Grains {
    let [low, high] = LEVELS.map(|level| level * GRAINS_A_LEVEL / step);
    let scale = GRAINS_A_LEVEL as f32 / step as f32;
    color.to_array().map(|channel| ((channel * scale).round() as i32).clamp(low, high) * step)
}

/// The colour in 8-bit levels. Exact: a small integer over a power of two.
pub(super) fn from_grains(color: Grains) -> Vec3 {
    Vec3::from_array(color.map(|channel| channel as f32 / GRAINS_A_LEVEL as f32))
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

/// Magnitudes of a coded colour's residuals in grains: green's, and the sum of the others'.
pub(super) type Misses = [u16; 2];

/// Green, red less green, blue less green: what is predicted.
fn to_channels([red, green, blue]: Grains) -> [i64; 3] {
    [green, red - green, blue - green].map(i64::from)
}

/// A coded colour as predictions need it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct KnownColor {
    /// Green, red less green, blue less green.
    channels: [i32; 3],
    misses: Misses,
    /// 1; 0 in what stands for no colour.
    count: u16,
}

impl KnownColor {
    pub(super) fn new(color: Grains, misses: Misses) -> Self {
        Self { channels: to_channels(color).map(|channel| channel as i32), misses, count: 1 }
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
            let value = i64::from(value);
            self.sum[channel] += value;
            self.squares[channel] += value * value;
        }
        for (sum, miss) in self.misses.iter_mut().zip(color.misses) {
            *sum += i64::from(miss);
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// What sums are multiplied with to be means in steps.
    fn scale(&self, step: i32) -> f32 {
        1.0 / (self.count.max(1) * i64::from(step)) as f32
    }

    /// The mean in steps, rounded; 0 of nothing.
    fn prediction(&self, scale: f32) -> [i64; 3] {
        self.sum.map(|sum| floor(sum as f32 * scale + 0.5).into())
    }

    /// The square of the count times the variance of a channel.
    fn variance(&self, channel: usize) -> i64 {
        self.count * self.squares[channel] - self.sum[channel] * self.sum[channel]
    }

    /// Class of how uncertain the prediction is, in steps: how much the wedges around differ, and how badly they were
    /// predicted.
    fn class(&self, variance: i64, misses: i64, scale: f32) -> usize {
        match self.count {
            0 => CLASSES - 2,
            1 => CLASSES - 1,
            _ => {
                let spread = (variance + misses * misses) as f32 * (4.0 * scale * scale);
                (ilog2(spread + 1.0) as usize).min(CLASSES - 3)
            }
        }
    }
}

/// How one residual follows another: the slope of a line through 0, fitted to the last some thousand.
#[derive(Debug, Clone, Copy)]
struct Slope {
    products: i32,
    squares: i32,
}

impl Slope {
    const NEW: Self = Self { products: 0, squares: 64 };

    fn predict(&self, from: i64) -> i64 {
        floor(self.products as f32 * from as f32 / self.squares as f32 + 0.5).into()
    }

    fn learn(&mut self, from: i64, to: i64) {
        let [from, to] = [from, to].map(|residual| residual.clamp(-LEARNT_MAX, LEARNT_MAX) as i32);
        self.products += from * to - (self.products >> SLOPE_SHIFT);
        self.squares += from * from - (self.squares >> SLOPE_SHIFT);
    }
}

/// Models of colour residuals.
#[derive(Debug, Clone)]
pub(super) struct ColorModels {
    green: [ResidualModel; CLASSES],
    red: [[ResidualModel; GREEN_CLASSES]; CLASSES],
    blue: [[ResidualModel; GREEN_CLASSES]; CLASSES],
    escape: UintModel,
    red_of_green: Slope,
    blue_of_green: Slope,
    blue_of_red: Slope,
}

impl ColorModels {
    pub(super) const NEW: Self = Self {
        green: [const { ResidualModel::NEW }; CLASSES],
        red: [const { [const { ResidualModel::NEW }; GREEN_CLASSES] }; CLASSES],
        blue: [const { [const { ResidualModel::NEW }; GREEN_CLASSES] }; CLASSES],
        escape: UintModel::NEW,
        red_of_green: Slope::NEW,
        blue_of_green: Slope::NEW,
        blue_of_red: Slope::NEW,
    };
}

/// Codes a wedge's colour, a multiple of `step` grains. Returns it with the magnitudes of its residuals.
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
    step: i32,
    truth: Grains,
) -> Result<(Grains, Misses), MeshFault> {
    let scale = around.scale(step);
    let step = i64::from(step);
    let predicted = around.prediction(scale);
    let truth = to_channels(truth).map(|channel| channel / step);
    let residual = [0, 1, 2].map(|channel| truth[channel] - predicted[channel]);
    let [luma, chroma] = [(around.variance(0), 0), (around.variance(1) + around.variance(2), 1)]
        .map(|(v, m)| around.class(v, around.misses[m], scale));

    coder.enter(Part::Luma);
    let green = code_residual(coder, &mut models.escape, &mut models.green[luma], residual[0]);
    coder.enter(Part::Chroma);
    let context = (green.unsigned_abs().min(7) + 1).ilog2() as usize;
    let along = models.red_of_green.predict(green);
    let red = code_residual(coder, &mut models.escape, &mut models.red[chroma][context], residual[1] - along);
    models.red_of_green.learn(green, along + red);
    let along_red = models.blue_of_red.predict(red);
    let along_green = models.blue_of_green.predict(green);
    let blue = code_residual(
        coder,
        &mut models.escape,
        &mut models.blue[chroma][context],
        residual[2] - along_green - along_red,
    );
    models.blue_of_green.learn(green, along_green + along_red + blue);
    models.blue_of_red.learn(red, along_red + blue);

    let found = predicted[0] + green;
    let found = [found + predicted[1] + along + red, found, found + predicted[2] + along_green + along_red + blue];
    let [low, high] = LEVELS.map(|level| i64::from(level * GRAINS_A_LEVEL) / step);
    if let Some(found) = found.into_iter().find(|channel| !(low..=high).contains(channel)) {
        return Err(MeshFault::Range { field: "color", low, high, found });
    }
    let miss = |residual: u64| (residual * step.unsigned_abs()).min(u16::MAX.into()) as u16;
    let misses = [miss(green.unsigned_abs()), miss(red.unsigned_abs() + blue.unsigned_abs())];
    Ok((found.map(|channel| (channel * step) as i32), misses))
}

/// Codes a residual; the parser's `truth` is not looked at, and may be anything.
#[inline]
fn code_residual(coder: &mut impl BitCoder, escape: &mut UintModel, model: &mut ResidualModel, truth: i64) -> i64 {
    const LIMIT: i64 = 1 << 24;
    model.code(escape, coder, truth.clamp(-LIMIT, LIMIT) as i32)
}

#[cfg(all(test, feature = "encode"))]
mod tests {
    use super::*;

    #[test]
    fn quantisation_is_idempotent_and_clamps() {
        for step in [1, 3, 16, 128, 4096] {
            for level in [-1000.0, -128.0, -0.3, 0.0, 7.77, 128.0, 255.0, 382.9, 1e9, f32::NAN] {
                let once = to_grains(Vec3::splat(level), step);
                assert_eq!(to_grains(from_grains(once), step), once);
                let back = from_grains(once).x;
                assert!((-128.0..=383.0).contains(&back));
                if (0.0..=255.0).contains(&level) {
                    assert!((back - level).abs() <= step as f32 / 256.0 + 1e-4);
                }
            }
        }
    }

    #[test]
    fn a_quarter_of_the_size_has_twice_the_step() {
        let steps = ColorSteps { step: 16, size: 20 };
        // A level is 128 grains.
        assert_eq!([20, 21, 22, 19, 18].map(|size| steps.at(size)), [128, 64, 64, 128, 256]);
        assert_eq!([0, 69].map(|size| steps.at(size)), [512, 16]);
        assert_eq!([0, 60].map(|size| ColorSteps::even(3).at(size)), [384; 2]);
    }
}
