//! Blended pixels: which regions share each, and in which parts.
//!
//! In: a frame and its zones. Out: every pixel's region, and the region's colour there. A pixel at an edge is
//! the mean of what covers it; so the best blend of two regions nearby tells which of them has more of it. What no
//! blend explains is a stroke too thin to be pure anywhere, or texture: a region of its own.

use glam::Vec3;

use super::super::raster::Raster;
use super::zones::{IMPURE, Zones, join, root};
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
const STROKE_PART: f32 = 0.4;

/// A region near a pixel, with its mean colour there.
#[derive(Debug, Clone, Copy)]
struct Candidate {
    region: Region,
    color: Vec3,
    weight: f32,
}

/// The best account of a pixel.
#[derive(Debug, Clone, Copy)]
struct Blend {
    major: Candidate,
    minor: Candidate,
    part: f32,
    error: f32,
}

/// Takes every pixel apart.
pub(super) fn unmix(raster: Raster, frame: &Frame, zones: &Zones) -> Vec<Pixel> {
    let colors: Vec<Vec3> = frame.pixels().iter().map(|c| Vec3::from_array(c.map(f32::from))).collect();
    let near: Vec<Vec<Candidate>> = (0..raster.len())
        .map(|p| if zones.of_pixel[p] == IMPURE { candidates(raster, &colors, zones, p) } else { Vec::new() })
        .collect();
    let blends: Vec<Option<Blend>> = (0..raster.len()).map(|p| best_blend(colors[p], &near[p])).collect();
    let strokes = Strokes::new(raster, zones, &colors, &blends);
    (0..raster.len())
        .map(|p| {
            if zones.of_pixel[p] != IMPURE {
                let region = zones.of_pixel[p];
                return Pixel { region, color: colors[p] };
            }
            strokes.account(raster, &colors, p, &near[p], blends[p])
        })
        .collect()
}

/// The zones around a pixel, nearer pixels counting more.
fn candidates(raster: Raster, colors: &[Vec3], zones: &Zones, p: usize) -> Vec<Candidate> {
    let mut found: Vec<Candidate> = Vec::new();
    around(raster, p, REACH, |q, distance2| {
        let region = zones.of_pixel[q];
        if region == IMPURE {
            return;
        }
        let weight = 1.0 / (distance2 * distance2) as f32;
        match found.iter_mut().find(|candidate| candidate.region == region) {
            Some(candidate) => {
                candidate.color += colors[q] * weight;
                candidate.weight += weight;
            }
            None => found.push(Candidate { region, color: colors[q] * weight, weight }),
        }
    });
    found.iter_mut().for_each(|candidate| candidate.color /= candidate.weight);
    found
}

/// The one or two candidates that a colour is the best blend of.
fn best_blend(color: Vec3, candidates: &[Candidate]) -> Option<Blend> {
    let mut best: Option<Blend> = None;
    let mut offer = |major: Candidate, minor: Candidate, part: f32| {
        let error = color.distance_squared(minor.color.lerp(major.color, part));
        if best.is_none_or(|best| error < best.error) {
            best = Some(if part >= 0.5 {
                Blend { major, minor, part, error }
            } else {
                Blend { major: minor, minor: major, part: 1.0 - part, error }
            });
        }
    };
    for (n, &a) in candidates.iter().enumerate() {
        offer(a, a, 1.0);
        for &b in &candidates[n + 1..] {
            let along = a.color - b.color;
            let part = (color - b.color).dot(along) / along.length_squared().max(1.0);
            offer(a, b, part.clamp(0.0, 1.0));
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
        let mut forest: Vec<u32> = (0..raster.len() as u32).collect();
        for p in (0..raster.len()).filter(|&p| strangeness[p] > RESIDUE) {
            around(raster, p, 1, |q, _| {
                if q < p && strangeness[q] > RESIDUE && is_alike(colors[p], colors[q]) {
                    join(&mut forest, p as u32, q as u32);
                }
            });
        }
        let mut names = vec![IMPURE; raster.len()];
        let mut next = zones.count;
        let mut of_pixel = vec![IMPURE; raster.len()];
        for p in (0..raster.len()).filter(|&p| strangeness[p] > RESIDUE) {
            let root = root(&mut forest, p as u32) as usize;
            if names[root] == IMPURE {
                names[root] = next;
                next += 1;
            }
            of_pixel[p] = names[root];
        }
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
        let own = self.of_pixel[p];
        let stroke = match strangest {
            _ if own != IMPURE && zones.is_empty() => p,
            Some(q) if own == IMPURE || self.strangeness[q] > self.strangeness[p] => q,
            _ if own != IMPURE => p,
            Some(q) => q,
            None => return pixel_of(blend.unwrap_or_else(|| lone(colors[p])), colors[p]),
        };
        let region = if own == IMPURE { self.of_pixel[stroke] } else { own };
        let stroke = Candidate { region, color: colors[stroke], weight: 1.0 };
        let mut best = blend.filter(|blend| blend.error <= RESIDUE);
        let mut offer = |blend: Blend| {
            if best.is_none_or(|best| blend.error < best.error) {
                best = Some(blend);
            }
        };
        for &zone in zones {
            let along = stroke.color - zone.color;
            let part = ((colors[p] - zone.color).dot(along) / along.length_squared().max(1.0)).clamp(0.0, 1.0);
            let error = colors[p].distance_squared(zone.color.lerp(stroke.color, part));
            offer(if part >= STROKE_PART {
                Blend { major: stroke, minor: zone, part, error }
            } else {
                Blend { major: zone, minor: stroke, part: 1.0 - part, error }
            });
        }
        pixel_of(best.unwrap_or(Blend { major: stroke, minor: stroke, part: 1.0, error: 0.0 }), colors[p])
    }
}

/// A pixel that has nothing around it that it could be of.
fn lone(color: Vec3) -> Blend {
    let alone = Candidate { region: 0, color, weight: 1.0 };
    Blend { major: alone, minor: alone, part: 1.0, error: 0.0 }
}

fn pixel_of(Blend { major, minor, part, .. }: Blend, color: Vec3) -> Pixel {
    let alone = major.region == minor.region || part > WHOLE;
    Pixel { region: major.region, color: if alone { color } else { major.color } }
}

/// Part of a pixel from which on it is taken for its region's alone.
const WHOLE: f32 = 0.97;

/// Whether two pixels may be of the same stroke or texture.
fn is_alike(a: Vec3, b: Vec3) -> bool {
    a.distance_squared(b) < 3.0 * 60.0 * 60.0
}

/// Calls `found(q, squared distance)` for the pixels within `reach` rows and columns of `p`.
fn around(raster: Raster, p: usize, reach: isize, mut found: impl FnMut(usize, isize)) {
    let (x, y) = raster.xy(p);
    for dy in -reach..=reach {
        for dx in -reach..=reach {
            let (qx, qy) = (x as isize + dx, y as isize + dy);
            let is_inside = (0..raster.width as isize).contains(&qx) && (0..raster.height as isize).contains(&qy);
            if is_inside && (dx, dy) != (0, 0) {
                found(qy as usize * raster.width + qx as usize, dx * dx + dy * dy);
            }
        }
    }
}
