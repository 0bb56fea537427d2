//! Regions joined across boundaries that are weak, or too small to have one.
//!
//! In: pixels with their regions. Out: the same with fewer regions, numbered without gaps.

use std::collections::BTreeMap;

use glam::Vec3;

use super::super::raster::Raster;
use super::forest::Forest;
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
    /// Those that have a side of a pixel in common with each.
    pub(super) beside: Vec<Vec<Region>>,
}

/// Joins regions.
pub(super) fn merge(raster: Raster, pixels: &mut [Pixel], rules: MergeRules) -> Regions {
    let regions = pixels.iter().map(|pixel| pixel.region + 1).max().unwrap_or(0);
    let mut forest = Forest::new(regions as usize);
    loop {
        let (boundaries, areas) = survey(raster, pixels, &mut forest, regions as usize);
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
        if weakest.iter().all(Option::is_none) {
            let (numbers, count) = forest.number(pixels.iter().map(|pixel| pixel.region), 0);
            pixels.iter_mut().for_each(|pixel| pixel.region = numbers[pixel.region as usize]);
            let pairs = boundaries.into_keys().map(|pair| [pair.0, pair.1].map(|root| numbers[root as usize]));
            return Regions::new(pixels, count as usize, pairs);
        }
        for (own, weakest) in (0..).zip(&weakest) {
            if let Some((_, other)) = weakest {
                forest.join(own, *other);
            }
        }
    }
}

/// More than any jump.
const SMALL: f32 = 1000.0;

type Survey = (BTreeMap<(Region, Region), Boundary>, Vec<u32>);

/// The boundaries between roots, and the roots' areas.
fn survey(raster: Raster, pixels: &[Pixel], forest: &mut Forest, regions: usize) -> Survey {
    let mut boundaries: BTreeMap<(Region, Region), Boundary> = BTreeMap::new();
    let mut areas = vec![0; regions];
    pixels.iter().for_each(|pixel| areas[forest.root(pixel.region) as usize] += 1);
    for (p, q) in raster.side_pairs() {
        if pixels[p].region == pixels[q].region {
            continue;
        }
        let (a, b) = (forest.root(pixels[p].region), forest.root(pixels[q].region));
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
    /// Of `count` regions, given which lie beside each other.
    fn new(pixels: &[Pixel], count: usize, pairs: impl Iterator<Item = [Region; 2]>) -> Self {
        let mut regions =
            Self { areas: vec![0; count], colors: vec![Vec3::ZERO; count], beside: vec![Vec::new(); count] };
        for pixel in pixels {
            regions.areas[pixel.region as usize] += 1;
            regions.colors[pixel.region as usize] += pixel.color;
        }
        regions.colors.iter_mut().zip(&regions.areas).for_each(|(color, &area)| *color /= area.max(1) as f32);
        for [a, b] in pairs {
            regions.beside[a as usize].push(b);
            regions.beside[b as usize].push(a);
        }
        regions
    }
}
