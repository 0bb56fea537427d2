//! Scene cuts: does a frame continue the one before?
//!
//! In: two frames. Out: yes or no. Forbidden here: labels.
//!
//! Two tests must agree: the colours differ as a whole (histograms), and most of the picture cannot be found in the
//! frame before even where it moved (block matching at a reduced size). Motion keeps histograms; a change of exposure
//! keeps what can be found.

use super::motion::{BLOCK, MotionField};
use super::pyramid::{Gray, pyramid};
use crate::video::Frame;

/// Levels from one bin of a histogram to the next.
const BIN_LEVELS: usize = 16;
/// Bins of a channel, the one for level 256 included.
const BINS: usize = 256 / BIN_LEVELS + 1;
/// Share of pixels that changed their bin, above which colours differ as a whole. Measured: up to 0.03 between
/// consecutive frames of a shot and 0.19 between those 20 apart, 0.29 to 0.74 between shots.
const CHANGED_COLORS: f64 = 0.15;
/// Share of blocks not found, above which the picture is another one. Measured as above: up to 0.03, up to 0.19, and
/// 0.75 to 0.94.
const CHANGED_BLOCKS: f64 = 0.4;
/// Blocks are matched at the first level of the pyramid that is no wider than this, in pixels.
const MATCH_WIDTH: usize = 180;
/// A block is not found if its mean difference exceeds half of its own mean deviation by this much, in levels: a
/// predictor that does not halve what there is to code predicts nothing.
const MATCH_LEVELS: u32 = 8;

/// What is kept of a frame to compare the next one to.
#[derive(Debug, Clone)]
pub(super) struct SceneView {
    levels: Vec<Gray>,
    histogram: Vec<u64>,
}

impl SceneView {
    pub(super) fn new(frame: &Frame) -> Self {
        let mut levels = pyramid(frame);
        let wide = levels.iter().take_while(|level| level.width > MATCH_WIDTH).count();
        levels.drain(..wide.min(levels.len() - 1));
        Self { levels, histogram: histogram(frame) }
    }

    /// Whether a frame that looks like `self` does not continue one of the same size that looks like `before`.
    pub(super) fn is_cut_from(&self, before: &Self) -> bool {
        self.color_change(before) > CHANGED_COLORS && self.block_change(before) > CHANGED_BLOCKS
    }

    /// Share of pixels whose colour has no counterpart, 0 to 1.
    fn color_change(&self, before: &Self) -> f64 {
        let missing: u64 = self.histogram.iter().zip(&before.histogram).map(|(a, b)| a.saturating_sub(*b)).sum();
        missing as f64 / self.histogram.iter().sum::<u64>().max(1) as f64
    }

    /// Share of blocks that are nowhere in the frame before, 0 to 1.
    fn block_change(&self, before: &Self) -> f64 {
        let field = MotionField::estimate(&self.levels, &before.levels);
        let (now, then) = (&self.levels[0], &before.levels[0]);
        let blocks = (0..field.rows).flat_map(|row| (0..field.columns).map(move |column| (column, row)));
        let lost = blocks.filter(|&(column, row)| {
            let vector = field.vectors[row * field.columns + column];
            is_lost(now, then, [column * BLOCK, row * BLOCK], vector)
        });
        lost.count() as f64 / field.vectors.len().max(1) as f64
    }
}

fn is_lost(now: &Gray, then: &Gray, [x0, y0]: [usize; 2], vector: [i32; 2]) -> bool {
    let block = || {
        let columns = x0..(x0 + BLOCK).min(now.width);
        (y0..(y0 + BLOCK).min(now.height)).flat_map(move |y| columns.clone().map(move |x| (x, y)))
    };
    let (sum, count) =
        block().fold((0, 0), |(sum, count), (x, y)| (sum + u32::from(now.pixels[y * now.width + x]), count + 1));
    let mean = (sum / count) as u8;
    let (mut deviation, mut difference) = (0, 0);
    for (x, y) in block() {
        let here = now.pixels[y * now.width + x];
        let there = then.clamped(x as isize + vector[0] as isize, y as isize + vector[1] as isize);
        deviation += u32::from(here.abs_diff(mean));
        difference += u32::from(here.abs_diff(there));
    }
    difference > deviation / 2 + MATCH_LEVELS * count
}

/// Levels of each channel, 17 bins a channel, 16 levels apart. A level is shared out between the two bins around it, so
/// that a slight change of brightness changes little; 16 units a pixel.
fn histogram(frame: &Frame) -> Vec<u64> {
    let mut counts = vec![0u64; 3 * BINS];
    for pixel in frame.pixels() {
        for (channel, &level) in pixel.iter().enumerate() {
            let bin = channel * BINS + usize::from(level) / BIN_LEVELS;
            let beyond = usize::from(level) % BIN_LEVELS;
            counts[bin] += (BIN_LEVELS - beyond) as u64;
            counts[bin + 1] += beyond as u64;
        }
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::SceneView;
    use crate::video::Frame;

    fn view(color: impl Fn(f32, f32) -> [f32; 3]) -> SceneView {
        let pixel = |x: u32, y: u32| color(x as f32, y as f32).map(|level| level.clamp(0.0, 255.0) as u8);
        SceneView::new(&Frame::from_fn(320, 200, pixel).expect("size"))
    }

    fn meadow(x: f32, y: f32) -> [f32; 3] {
        let wave = 40.0 * ((x * 0.09).sin() + (y * 0.13).cos() + (x * 0.02 * y * 0.03).sin());
        [60.0 + wave, 120.0 + wave, 40.0]
    }

    fn street(x: f32, y: f32) -> [f32; 3] {
        let stripe = if ((x + y) / 7.0) as i32 % 2 == 0 { 180.0 } else { 90.0 };
        [stripe, stripe * 0.8 + y * 0.2, 150.0]
    }

    #[test]
    fn another_picture_is_a_cut() {
        assert!(view(street).is_cut_from(&view(meadow)));
        assert!(view(meadow).is_cut_from(&view(street)));
        assert!(view(|_, _| [10.0, 10.0, 10.0]).is_cut_from(&view(|_, _| [230.0, 220.0, 250.0])));
    }

    #[test]
    fn motion_noise_and_fades_are_none() {
        let before = view(meadow);
        assert!(!view(meadow).is_cut_from(&before));
        assert!(!view(|x, y| meadow(x + 23.0, y - 14.0)).is_cut_from(&before), "pan");
        assert!(!view(|x, y| meadow(x, y).map(|level| level * 0.9)).is_cut_from(&before), "fade");
        let noise = |seed: u32| {
            view(move |x, y| {
                [0u32, 1, 2].map(|c| {
                    ((x as u32 * 7919 + y as u32 * 104_729 + seed + c).wrapping_mul(2_654_435_761) >> 24) as f32
                })
            })
        };
        assert!(!noise(1).is_cut_from(&noise(77_777)), "noise");
    }

    #[test]
    fn tiny_pictures_are_judged_too() {
        let flat = |level| SceneView::new(&Frame::from_fn(1, 1, |_, _| [level; 3]).expect("size"));
        assert!(flat(250).is_cut_from(&flat(5)));
        assert!(!flat(250).is_cut_from(&flat(245)));
    }
}
