//! Zones: connected pixels of one colour, or one that changes slowly.
//!
//! In: a frame. Out: for every pixel the zone that it is purely of, if it is of one.

use super::super::raster::Raster;
use super::forest::{Forest, NONE};
use crate::video::Frame;

/// No zone.
pub(super) const IMPURE: u32 = NONE;

/// Most that a channel may differ within two by two pixels of one zone, in levels: in the cleanest picture, where faint
/// edges are seen, and in any, since an edge of 60 levels blurred over three pixels must be steeper.
const RANGE: std::ops::RangeInclusive<usize> = 6..=18;
/// Which part of a picture's blocks decide what is clean, and how many times as much as within them is allowed.
const CLEAN_PART: f32 = 0.5;
const CLEAN_TIMES: usize = 3;
/// Fewest pixels of a zone: more than a block has.
const LEAST_PIXELS: u32 = 6;

/// The zones of a frame.
#[derive(Debug, Clone)]
pub(super) struct Zones {
    /// Zone of each pixel, or [`IMPURE`].
    pub(super) of_pixel: Vec<u32>,
    /// Number of zones.
    pub(super) count: u32,
}

/// Finds the zones: pixels of uniform two by two blocks, joined where blocks overlap.
pub(super) fn find_zones(raster: Raster, frame: &Frame) -> Zones {
    let Raster { width, height } = raster;
    let mut forest = Forest::new(raster.len());
    let allowed = allowed_range(raster, frame);
    for y in 0..height.saturating_sub(1) {
        let (upper, lower) = (frame.row(y as u32), frame.row(y as u32 + 1));
        for x in 0..width.saturating_sub(1) {
            if range_of([upper[x], upper[x + 1], lower[x], lower[x + 1]]) <= allowed {
                let p = y * width + x;
                [p + 1, p + width, p + width + 1].into_iter().for_each(|q| forest.join(p as u32, q as u32));
            }
        }
    }
    let mut areas = vec![0u32; raster.len()];
    (0..raster.len() as u32).for_each(|p| areas[forest.root(p) as usize] += 1);
    let large: Vec<u32> =
        (0..raster.len() as u32).filter(|&p| areas[forest.root(p) as usize] >= LEAST_PIXELS).collect();
    let (of_pixel, count) = forest.number(large.into_iter(), 0);
    Zones { of_pixel, count }
}

impl Zones {
    /// How much neighbouring pixels of the same zone differ: root mean square over the channels, in levels.
    pub(super) fn roughness(&self, raster: Raster, frame: &Frame) -> f32 {
        let (mut sum, mut count) = (0u64, 0u64);
        let pixels = frame.pixels();
        for (p, q) in raster.side_pairs() {
            if self.of_pixel[p] != IMPURE && self.of_pixel[p] == self.of_pixel[q] {
                let difference = |c: usize| u64::from(pixels[p][c].abs_diff(pixels[q][c]));
                sum += (0..3).map(|c| difference(c).pow(2)).sum::<u64>();
                count += 3;
            }
        }
        (sum as f32 / count.max(1) as f32).sqrt()
    }
}

/// Most that a channel may differ within a block of this frame.
fn allowed_range(raster: Raster, frame: &Frame) -> u8 {
    let mut histogram = [0usize; 256];
    for y in (0..raster.height.saturating_sub(1)).step_by(2) {
        let (upper, lower) = (frame.row(y as u32), frame.row(y as u32 + 1));
        for x in (0..raster.width.saturating_sub(1)).step_by(2) {
            histogram[usize::from(range_of([upper[x], upper[x + 1], lower[x], lower[x + 1]]))] += 1;
        }
    }
    let wanted = (CLEAN_PART * histogram.iter().sum::<usize>() as f32) as usize;
    let mut below = 0;
    let clean = histogram.iter().position(|&blocks| {
        below += blocks;
        below > wanted
    });
    (CLEAN_TIMES * clean.unwrap_or(0)).clamp(*RANGE.start(), *RANGE.end()) as u8
}

/// Most that a channel differs among some pixels.
fn range_of(pixels: [[u8; 3]; 4]) -> u8 {
    let range = |channel: usize| {
        let values = pixels.map(|pixel| pixel[channel]);
        let (low, high) = values.iter().fold((u8::MAX, 0), |(low, high), &v| (low.min(v), high.max(v)));
        high - low
    };
    range(0).max(range(1)).max(range(2))
}
