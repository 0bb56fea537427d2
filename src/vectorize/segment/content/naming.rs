//! Labels for regions, such that what was there in the frame before keeps its label.
//!
//! In: a frame's regions, and the frame before with its labels. Out: a label for each region. A region takes the label
//! that most of its pixels had where they come from, or else one that looks like it, unless a larger region beside it has
//! that label.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::super::motion::{BLOCK, MotionField};
use super::super::raster::Raster;
use super::Pixel;
use super::merge::Regions;
use crate::video::{Frame, LabelPlane};

/// Most that a channel may differ from where a pixel comes from, in levels, to vote.
const ALIKE: u8 = 30;

/// The frame before.
pub(super) struct Before<'a> {
    pub(super) frame: &'a Frame,
    pub(super) labels: &'a LabelPlane,
    /// From the frame now to the one before.
    pub(super) motion: MotionField,
}

/// Labels that a slab has used, and what they looked like lately.
#[derive(Debug, Clone, Default)]
pub(super) struct Palette {
    colors: Vec<Vec3>,
    /// Whether they were thin when they were new.
    thin: Vec<bool>,
}

impl Palette {
    /// A label for each region of a frame.
    pub(super) fn name(
        &mut self,
        raster: Raster,
        frame: &Frame,
        pixels: &[Pixel],
        regions: &Regions,
        before: Option<Before<'_>>,
    ) -> Vec<u32> {
        let votes = before.map_or_else(BTreeMap::new, |before| before.votes(raster, frame, pixels));
        let thin = thin_regions(raster, pixels, &regions.areas);
        let mut order: Vec<u32> = (0..regions.areas.len() as u32).collect();
        order.sort_by_key(|&region| std::cmp::Reverse(regions.areas[region as usize]));
        let mut names = vec![NONE; order.len()];
        for region in order {
            let taken: BTreeSet<u32> =
                regions.beside[region as usize].iter().map(|&other| names[other as usize]).collect();
            let color = regions.colors[region as usize];
            let is_thin = thin[region as usize];
            let mut voted: Vec<(u32, u32)> =
                votes.range((region, 0)..=(region, NONE)).map(|(&(_, label), &n)| (n, label)).collect();
            voted.sort_unstable_by_key(|&(n, label)| (std::cmp::Reverse(n), label));
            let least = regions.areas[region as usize] / LEAST_SHARE;
            let kept = voted.iter().filter(|(n, _)| *n >= least).map(|&(_, label)| label).find(|l| !taken.contains(l));
            let name = kept.or_else(|| self.nearest(color, is_thin, &taken)).unwrap_or_else(|| {
                self.colors.push(color);
                self.thin.push(is_thin);
                self.colors.len() as u32 - 1
            });
            self.colors[name as usize] = self.colors[name as usize].lerp(color, DRIFT);
            names[region as usize] = name;
        }
        names
    }

    /// The label that looks most like a colour, if one looks alike; parts of a picture that are not beside each other can
    /// share one. Thin ones do not share with others: no pixel has their colour, but a blend with what is beside them.
    fn nearest(&self, color: Vec3, is_thin: bool, taken: &BTreeSet<u32>) -> Option<u32> {
        let free = (0..)
            .zip(&self.colors)
            .filter(|(label, _)| !taken.contains(label) && self.thin[*label as usize] == is_thin);
        let near = free.map(|(label, own)| (own.distance_squared(color), label));
        let best = near.min_by(|a, b| a.0.total_cmp(&b.0))?;
        (best.0 < SAME_COLOR).then_some(best.1)
    }
}

/// Which regions have next to no pixel with all neighbours in it.
fn thin_regions(raster: Raster, pixels: &[Pixel], areas: &[u32]) -> Vec<bool> {
    let mut inside = vec![0u32; areas.len()];
    for (p, pixel) in pixels.iter().enumerate() {
        let is_inside = raster.sides(p).all(|q| pixels[q].region == pixel.region);
        inside[pixel.region as usize] += u32::from(is_inside);
    }
    inside.iter().zip(areas).map(|(inside, area)| inside * THIN < *area).collect()
}

/// A thin region has less than one pixel in so many inside.
const THIN: u32 = 20;
/// No label.
const NONE: u32 = u32::MAX;
/// A label that at least one in so many of a region's pixels had before can go on.
const LEAST_SHARE: u32 = 4;
/// Squared distance of colours that can share a label: 24 levels a channel.
const SAME_COLOR: f32 = 3.0 * 24.0 * 24.0;
/// How fast a label's colour follows its regions'.
const DRIFT: f32 = 0.3;

impl Before<'_> {
    /// How many of each region's pixels had each label.
    fn votes(&self, raster: Raster, frame: &Frame, pixels: &[Pixel]) -> BTreeMap<(u32, u32), u32> {
        let mut votes: BTreeMap<(u32, u32), u32> = BTreeMap::new();
        for (p, pixel) in pixels.iter().enumerate() {
            if let Some(label) = self.label(raster, frame, p) {
                *votes.entry((pixel.region, label)).or_default() += 1;
            }
        }
        votes
    }

    /// The label where a pixel comes from, if it looks alike there.
    fn label(&self, raster: Raster, frame: &Frame, p: usize) -> Option<u32> {
        let (x, y) = raster.xy(p);
        let [dx, dy] = self.motion.clamped((x / BLOCK) as isize, (y / BLOCK) as isize);
        let q = raster.index(x as i64 + i64::from(dx), y as i64 + i64::from(dy))?;
        let (here, there) = (frame.pixels()[p], self.frame.pixels()[q]);
        let is_alike = here.iter().zip(there).all(|(here, there)| here.abs_diff(there) <= ALIKE);
        is_alike.then(|| self.labels.labels()[q].0)
    }
}
