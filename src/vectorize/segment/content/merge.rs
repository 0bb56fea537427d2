//! Regions joined across boundaries that are weak or no jumps, or too small to have one.
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
    /// The jump that a region of so few must have, in levels; with a greater one fewer will do.
    pub(super) worth: f32,
}

impl MergeRules {
    /// Whether a region of so many pixels is not worth this jump at its weakest boundary. What counts is the squared error
    /// that it takes away.
    fn is_small(&self, area: u32, jump: f32) -> bool {
        area < self.min_area
            && (area < LEAST_AREA || area as f32 * jump.powi(2) < self.min_area as f32 * self.worth.powi(2))
    }
}

/// Fewest pixels of a region, whatever its colour.
const LEAST_AREA: u32 = 4;

/// A boundary between two regions.
#[derive(Debug, Clone, Copy, Default)]
struct Boundary {
    /// Sum of the colour differences, and of their sizes.
    difference: Vec3,
    size: f32,
    sides: u32,
    /// Sum over the pixels that both have a part of: from 0, next to nothing, to 1, half.
    mixed: f32,
    /// How many these are.
    blends: u32,
}

impl Boundary {
    /// The jump: what a boundary of texture has differs everywhere in another direction.
    fn jump(&self) -> f32 {
        let sides = self.sides as f32;
        0.5 * (self.difference.length() + self.size) / (sides * 3f32.sqrt())
    }

    /// Whether the colour changes within a pixel. A wider slope is no jump, however steep: colours that change show it best.
    /// One boundary alone says little, as one along the grid may have half of each pixel: it counts beside what is
    /// usual.
    fn is_sharp(&self, usual: Mixed) -> bool {
        let sides = self.sides as f32 + usual.sides;
        self.mixed + usual.sum <= WIDEST * sides || self.blends as f32 + usual.blends <= MOST_BLENDS * sides
    }
}

/// Most [`Boundary::mixed`] of a jump, a side. Where pixels are means over their squares, an edge along the grid has 2/3 a
/// length; a side stands for 0.8 of an edge's length. Edges through a lens have 0.8 to 2 a length.
const WIDEST: f32 = 0.65;
/// Most blends of a jump, a side, however much they are mixed: edges along the grid have one a side wherever they are in their
/// pixels, and those across it no more. Edges through a lens have 1.5 and more.
const MOST_BLENDS: f32 = 1.1;

/// How much is mixed at the boundaries of a slab so far.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Mixed {
    /// Of this many sides.
    sides: f32,
    /// As [`Boundary::mixed`].
    sum: f32,
    /// As [`Boundary::blends`].
    blends: f32,
}

impl Mixed {
    /// Takes in the boundaries of a frame's regions that jump by `jump`.
    pub(super) fn learn(&mut self, raster: Raster, pixels: &[Pixel], jump: f32) {
        let regions = count(pixels) as usize;
        let (boundaries, _) = survey(raster, pixels, &mut Forest::new(regions), regions);
        self.follow(boundaries.values().filter(|boundary| boundary.jump() >= jump), raster);
    }

    /// Takes boundaries in. All together weigh as much as a boundary around the picture, the last frames most.
    fn follow<'a>(&mut self, boundaries: impl Iterator<Item = &'a Boundary>, raster: Raster) {
        for boundary in boundaries {
            self.sides += boundary.sides as f32;
            self.sum += boundary.mixed;
            self.blends += boundary.blends as f32;
        }
        let around = (2 * (raster.width + raster.height)) as f32;
        let share = (around / self.sides.max(1.0)).min(1.0);
        self.sides *= share;
        self.sum *= share;
        self.blends *= share;
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

/// Joins regions, `usual` being what is usual in the slab so far.
pub(super) fn merge(raster: Raster, pixels: &mut [Pixel], rules: MergeRules, usual: Mixed) -> Regions {
    let regions = count(pixels);
    let mut forest = Forest::new(regions as usize);
    let (mut boundaries, mut areas) = survey(raster, pixels, &mut forest, regions as usize);
    loop {
        // Every region's weakest boundary at once (Boruvka 1926): a survey costs more than the rest.
        let mut weakest: Vec<Option<(f32, Region)>> = vec![None; regions as usize];
        for (&(a, b), boundary) in &boundaries {
            for (own, other) in [(a, b), (b, a)] {
                // A small region has to join someone, but nobody has to join a small region.
                let jump = if boundary.is_sharp(usual) { boundary.jump() } else { 0.0 };
                let is_small = rules.is_small(areas[own as usize], jump);
                let jump = jump - if is_small { SMALL } else { 0.0 };
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
        (boundaries, areas) = survey(raster, pixels, &mut forest, regions as usize);
    }
}

/// One more than the highest region.
fn count(pixels: &[Pixel]) -> Region {
    pixels.iter().map(|pixel| pixel.region.max(pixel.minor) + 1).max().unwrap_or(0)
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
    for pixel in pixels.iter().filter(|pixel| pixel.minor != pixel.region) {
        let (a, b) = (forest.root(pixel.region), forest.root(pixel.minor));
        if let Some(boundary) = boundaries.get_mut(&(a.min(b), a.max(b))) {
            boundary.mixed += 4.0 * pixel.part * (1.0 - pixel.part);
            boundary.blends += 1;
        }
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
