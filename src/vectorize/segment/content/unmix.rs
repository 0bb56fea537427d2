//! Blended pixels: which region has most of each.
//!
//! In: a frame and its zones. Out: every pixel's region, and the region's colour there. A pixel at an edge is the mean of
//! what covers it; so the best blend of two regions nearby tells which of them has more of it. What no blend explains is a
//! stroke too thin to be pure anywhere, or texture: a region of its own.

use glam::Vec3;

use super::super::raster::Raster;
use super::forest::Forest;
use super::inks::Inks;
use super::zones::{IMPURE, Zones};
use super::{Pixel, Region};
use crate::video::Frame;

/// How far zones are looked for, in pixels.
const REACH: isize = 3;
/// How far the purest pixel of a stroke is looked for.
const STROKE_REACH: isize = 2;
/// Largest error of a blend, squared levels summed over the channels: 14 a channel.
const RESIDUE: f32 = 3.0 * 14.0 * 14.0;
/// Part of a pixel from which on a stroke has it: less than half, as thin strokes would tear where they pass between
/// pixels.
pub(super) const STROKE_PART: f32 = 0.4;

/// A region near a pixel, with its mean colour there.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidate {
    pub(super) region: Region,
    pub(super) color: Vec3,
}

/// An account of a pixel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Blend {
    pub(super) major: Candidate,
    minor: Candidate,
    /// Which part of the pixel the major one has.
    pub(super) part: f32,
    pub(super) error: f32,
}

impl Blend {
    /// One candidate alone.
    fn of_one(color: Vec3, candidate: Candidate) -> Self {
        let error = color.distance_squared(candidate.color);
        Self { major: candidate, minor: candidate, part: 1.0, error }
    }

    /// Two in the parts that come closest to `color`; from the part `majority` on the pixel is the first one's.
    pub(super) fn of_two(color: Vec3, first: Candidate, second: Candidate, majority: f32) -> Self {
        let along = first.color - second.color;
        let part = ((color - second.color).dot(along) / along.length_squared().max(1.0)).clamp(0.0, 1.0);
        let error = color.distance_squared(second.color.lerp(first.color, part));
        if part >= majority {
            Self { major: first, minor: second, part, error }
        } else {
            Self { major: second, minor: first, part: 1.0 - part, error }
        }
    }

    /// The better of two accounts, of equals the one that was there.
    fn or_better(before: Option<Self>, other: Self) -> Option<Self> {
        Some(before.filter(|before| before.error <= other.error).unwrap_or(other))
    }

    /// The pixel of this colour that it accounts for.
    fn pixel(&self, color: Vec3) -> Pixel {
        let alone = self.major.region == self.minor.region || self.part > WHOLE;
        if alone {
            return Pixel::pure(self.major.region, color);
        }
        Pixel { region: self.major.region, color: self.major.color, minor: self.minor.region, part: self.part }
    }
}

/// What zones lie around the pixels of a frame that are of none.
pub(super) struct Unmixing {
    raster: Raster,
    zones: Zones,
    colors: Vec<Vec3>,
    /// The colours of zones' pixels: an ink's where one claims them.
    pure: Vec<Vec3>,
    /// The zones around each pixel that is of none.
    near: Vec<Vec<Candidate>>,
    /// Its best blend of them.
    blends: Vec<Option<Blend>>,
}

impl Unmixing {
    pub(super) fn new(raster: Raster, frame: &Frame, zones: Zones) -> Self {
        let colors: Vec<Vec3> = frame.pixels().iter().map(|c| Vec3::from_array(c.map(f32::from))).collect();
        Self::of_zones(raster, zones, colors.clone(), colors)
    }

    fn of_zones(raster: Raster, zones: Zones, colors: Vec<Vec3>, pure: Vec<Vec3>) -> Self {
        let near: Vec<Vec<Candidate>> = (0..raster.len())
            .map(|p| if zones.of_pixel[p] == IMPURE { candidates(raster, &pure, &zones, p) } else { Vec::new() })
            .collect();
        let blends = (0..raster.len()).map(|p| best_blend(colors[p], &near[p])).collect();
        Self { raster, zones, colors, pure, near, blends }
    }

    /// The same of a drawing: strokes and small things may have colours that are pure elsewhere.
    pub(super) fn with_inks(self) -> Self {
        let Self { raster, mut zones, colors, mut pure, near, blends } = self;
        Inks::new(&zones, &colors).claim(raster, &mut zones, &mut pure, (&near, &blends));
        Self::of_zones(raster, zones, colors, pure)
    }

    /// Takes every pixel apart.
    pub(super) fn pixels(&self) -> Vec<Pixel> {
        let Self { raster, zones, colors, pure, near, blends } = self;
        let strokes = Strokes::new(*raster, zones, colors, blends);
        (0..raster.len())
            .map(|p| match zones.of_pixel[p] {
                IMPURE => strokes.account(*raster, colors, p, &near[p], blends[p]),
                zone => Pixel::pure(zone, pure[p]),
            })
            .collect()
    }
}

/// The zones around a pixel, nearer pixels counting more.
fn candidates(raster: Raster, colors: &[Vec3], zones: &Zones, p: usize) -> Vec<Candidate> {
    let mut found: Vec<(Region, Vec3, f32)> = Vec::new();
    around(raster, p, REACH, |q, distance2| {
        let region = zones.of_pixel[q];
        if region == IMPURE {
            return;
        }
        let weight = 1.0 / (distance2 * distance2) as f32;
        match found.iter_mut().find(|(known, ..)| *known == region) {
            Some((_, sum, total)) => (*sum, *total) = (*sum + colors[q] * weight, *total + weight),
            None => found.push((region, colors[q] * weight, weight)),
        }
    });
    found.into_iter().map(|(region, sum, total)| Candidate { region, color: sum / total }).collect()
}

/// The one or two candidates that a colour is the best blend of.
fn best_blend(color: Vec3, candidates: &[Candidate]) -> Option<Blend> {
    let mut best = None;
    for (n, &a) in candidates.iter().enumerate() {
        best = Blend::or_better(best, Blend::of_one(color, a));
        for &b in &candidates[n + 1..] {
            best = Blend::or_better(best, Blend::of_two(color, a, b, 0.5));
        }
    }
    best
}

/// Connected pixels that no blend explains.
struct Strokes {
    /// Region of each of these pixels, or [`IMPURE`].
    of_pixel: Vec<Region>,
    /// How far each is from any blend.
    strangeness: Vec<f32>,
}

impl Strokes {
    fn new(raster: Raster, zones: &Zones, colors: &[Vec3], blends: &[Option<Blend>]) -> Self {
        let error = |p: usize| match (zones.of_pixel[p], blends[p]) {
            (IMPURE, Some(blend)) => blend.error,
            (IMPURE, None) => f32::INFINITY,
            _ => 0.0,
        };
        let strangeness: Vec<f32> = (0..raster.len()).map(error).collect();
        let strange = || (0..raster.len()).filter(|&p| strangeness[p] > RESIDUE);
        let mut forest = Forest::new(raster.len());
        for p in strange() {
            around(raster, p, 1, |q, _| {
                if q < p && strangeness[q] > RESIDUE && is_alike(colors[p], colors[q]) {
                    forest.join(p as u32, q as u32);
                }
            });
        }
        let (of_pixel, _) = forest.number(strange().map(|p| p as u32), zones.count);
        Self { of_pixel, strangeness }
    }

    /// What pixel `p` is, strokes considered.
    fn account(&self, raster: Raster, colors: &[Vec3], p: usize, zones: &[Candidate], blend: Option<Blend>) -> Pixel {
        let mut strangest: Option<usize> = None;
        around(raster, p, STROKE_REACH, |q, _| {
            let is_stranger = |best: usize| self.strangeness[q] > self.strangeness[best];
            if self.of_pixel[q] != IMPURE && strangest.is_none_or(is_stranger) {
                strangest = Some(q);
            }
        });
        let (own, color) = (self.of_pixel[p], colors[p]);
        let is_purer = |q: &usize| own == IMPURE || (!zones.is_empty() && self.strangeness[*q] > self.strangeness[p]);
        // A pixel of a stroke is at worst the purest itself; any other without a stroke nearby has a blend.
        let Some(purest) = strangest.filter(is_purer).or((own != IMPURE).then_some(p)) else {
            return blend.map_or(Pixel::pure(0, color), |blend| blend.pixel(color));
        };
        let region = if own == IMPURE { self.of_pixel[purest] } else { own };
        let stroke = Candidate { region, color: colors[purest] };
        let explained = blend.filter(|blend| blend.error <= RESIDUE);
        let with_stroke = zones.iter().map(|&zone| Blend::of_two(color, stroke, zone, STROKE_PART));
        let best = with_stroke.fold(explained, Blend::or_better);
        best.unwrap_or(Blend::of_one(color, stroke)).pixel(color)
    }
}

/// Part of a pixel from which on it is taken for its region's alone.
const WHOLE: f32 = 0.97;

/// Whether two pixels may be of the same stroke or texture.
fn is_alike(a: Vec3, b: Vec3) -> bool {
    a.distance_squared(b) < 3.0 * 60.0 * 60.0
}

/// Calls `found(q, squared distance)` for the pixels within `reach` rows and columns of `p`.
pub(super) fn around(raster: Raster, p: usize, reach: isize, mut found: impl FnMut(usize, isize)) {
    let (x, y) = raster.xy(p);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let q = raster.index((x as isize + dx) as i64, (y as isize + dy) as i64);
            if let Some(q) = q.filter(|&q| q != p) {
                found(q, dx * dx + dy * dy);
            }
        }
    }
}
