//! Regions joined across boundaries that are weak, or too small to have one.
//!
//! In: pixels with their regions. Out: the same with fewer regions, numbered without gaps.

use std::collections::{BTreeMap, BTreeSet};

use glam::Vec3;

use super::super::raster::Raster;
use super::zones::{join, root};
use super::{Pixel, Region};

/// Which boundaries stay.
#[derive(Debug, Clone, Copy)]
pub(super) struct MergeRules {
    /// Least jump of colour, root mean square of the channels, in levels.
    pub(super) jump: f32,
    /// Fewest pixels of a region.
    pub(super) min_area: u32,
}

/// A boundary between two regions.
#[derive(Debug, Clone, Copy, Default)]
struct Boundary {
    /// Sum of the colour differences, and of their sizes.
    difference: Vec3,
    size: f32,
    sides: u32,
}

impl Boundary {
    /// The jump: what a boundary of texture has differs everywhere in another direction.
    fn jump(&self) -> f32 {
        let sides = self.sides as f32;
        0.5 * (self.difference.length() + self.size) / (sides * 3f32.sqrt())
    }
}

/// What is left of the regions of a frame.
#[derive(Debug, Clone, Default)]
pub(super) struct Regions {
    /// Pixels of each.
    pub(super) areas: Vec<u32>,
    /// Mean colour of each.
    pub(super) colors: Vec<Vec3>,
    /// Which have a side of a pixel in common, the lower number first.
    pub(super) neighbors: BTreeSet<(Region, Region)>,
}

/// Joins regions.
pub(super) fn merge(raster: Raster, pixels: &mut [Pixel], rules: MergeRules) -> Regions {
    let regions = pixels.iter().map(|pixel| pixel.region + 1).max().unwrap_or(0);
    let mut forest: Vec<Region> = (0..regions).collect();
    loop {
        let (boundaries, areas) = survey(raster, pixels, &mut forest);
        // Every region's weakest boundary at once (Boruvka 1926): a survey costs more than the rest.
        let mut weakest: Vec<Option<(f32, Region)>> = vec![None; regions as usize];
        for (&(a, b), boundary) in &boundaries {
            for (own, other) in [(a, b), (b, a)] {
                // A small region has to join someone, but nobody has to join a small region.
                let is_small = areas[own as usize] < rules.min_area;
                let jump = boundary.jump() - if is_small { SMALL } else { 0.0 };
                if jump < rules.jump && weakest[own as usize].is_none_or(|(least, _)| jump < least) {
                    weakest[own as usize] = Some((jump, other));
                }
            }
        }
        let mut joined = 0;
        for (own, weakest) in (0..).zip(&weakest) {
            if let Some((_, other)) = weakest {
                join(&mut forest, own, *other);
                joined += 1;
            }
        }
        if joined == 0 {
            let count = renumber(pixels, &mut forest);
            return Regions::new(raster, pixels, count as usize);
        }
    }
}

/// More than any jump.
const SMALL: f32 = 1000.0;

type Survey = (BTreeMap<(Region, Region), Boundary>, Vec<u32>);

/// The boundaries between roots, and the roots' areas.
fn survey(raster: Raster, pixels: &[Pixel], forest: &mut [Region]) -> Survey {
    let mut boundaries: BTreeMap<(Region, Region), Boundary> = BTreeMap::new();
    let mut areas = vec![0; forest.len()];
    pixels.iter().for_each(|pixel| areas[root(forest, pixel.region) as usize] += 1);
    for (p, q) in raster.side_pairs() {
        if pixels[p].region == pixels[q].region {
            continue;
        }
        let (a, b) = (root(forest, pixels[p].region), root(forest, pixels[q].region));
        if a == b {
            continue;
        }
        let difference = pixels[p].color - pixels[q].color;
        let boundary = boundaries.entry((a.min(b), a.max(b))).or_default();
        boundary.difference += if a < b { difference } else { -difference };
        boundary.size += difference.length();
        boundary.sides += 1;
    }
    (boundaries, areas)
}

impl Regions {
    fn new(raster: Raster, pixels: &[Pixel], count: usize) -> Self {
        let mut regions = Self { areas: vec![0; count], colors: vec![Vec3::ZERO; count], neighbors: BTreeSet::new() };
        for pixel in pixels {
            regions.areas[pixel.region as usize] += 1;
            regions.colors[pixel.region as usize] += pixel.color;
        }
        regions.colors.iter_mut().zip(&regions.areas).for_each(|(color, &area)| *color /= area.max(1) as f32);
        for (p, q) in raster.side_pairs() {
            let (a, b) = (pixels[p].region, pixels[q].region);
            if a != b {
                regions.neighbors.insert((a.min(b), a.max(b)));
            }
        }
        regions
    }

    /// The regions beside `region`.
    pub(super) fn beside(&self, region: Region) -> impl Iterator<Item = Region> + '_ {
        let other = move |&(a, b): &(Region, Region)| match region {
            r if r == a => Some(b),
            r if r == b => Some(a),
            _ => None,
        };
        self.neighbors.iter().filter_map(other)
    }
}

fn renumber(pixels: &mut [Pixel], forest: &mut [Region]) -> u32 {
    let mut names = vec![u32::MAX; forest.len()];
    let mut count = 0;
    for pixel in pixels.iter() {
        let name = &mut names[root(forest, pixel.region) as usize];
        if *name == u32::MAX {
            *name = count;
            count += 1;
        }
    }
    for pixel in pixels {
        pixel.region = names[root(forest, pixel.region) as usize];
    }
    count
}
