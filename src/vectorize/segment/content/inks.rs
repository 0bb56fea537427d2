//! Inks: the few colours that a drawing is made of, where they have no pixel of their own.
//!
//! In: a frame's zones. Out: zones for pixels too, of strokes and small things, that are blends with a colour which is pure
//! elsewhere in the frame. What lies around them cannot explain them, and by themselves they do not say how much of
//! them is what.

use std::collections::VecDeque;

use glam::Vec3;

use super::super::raster::Raster;
use super::forest::Forest;
use super::unmix::{Blend, Candidate, STROKE_PART, around};
use super::zones::{IMPURE, Zones};

/// Most inks, those of most pixels.
const MOST_INKS: usize = 32;
/// Part of the picture that an ink must be pure on, and fewest pixels.
const LEAST_SHARE: f32 = 2e-4;
const LEAST_PIXELS: usize = 12;
/// Squared distance, summed over the channels, of colours that are one ink: 8 levels a channel.
const ONE_INK: f32 = 3.0 * 8.0 * 8.0;
/// Largest error of a blend with an ink, squared levels summed over the channels: 6 a channel.
const RESIDUE: f32 = 3.0 * 6.0 * 6.0;
/// Least part that a stroke can be followed along.
const LEAST_PART: f32 = 0.2;
/// How much more of the ink than on one of its sides a pixel has there.
const RIDGE: f32 = 0.1;
/// A blend with an ink must have this many times less error than what is around explains, beyond what rounding to levels
/// makes of the best blend.
const BETTER: f32 = 4.0;
const ROUNDING: f32 = 1.0;

/// A colour of the drawing.
#[derive(Debug, Clone, Copy)]
struct Ink {
    color: Vec3,
    pixels: usize,
}

/// The inks of a frame.
pub(super) struct Inks {
    inks: Vec<Ink>,
    /// The ink of each zone, if it has one.
    of_zone: Vec<Option<usize>>,
    /// Fewest pixels of an ink that is looked for elsewhere.
    least: usize,
}

impl Inks {
    /// The colours of zones, large ones first.
    pub(super) fn new(zones: &Zones, colors: &[Vec3]) -> Self {
        let mut sums = vec![(Vec3::ZERO, 0usize); zones.count as usize];
        for (p, &zone) in zones.of_pixel.iter().enumerate().filter(|(_, zone)| **zone != IMPURE) {
            let (sum, pixels) = &mut sums[zone as usize];
            *sum += colors[p];
            *pixels += 1;
        }
        let mut order: Vec<usize> = (0..sums.len()).collect();
        order.sort_by_key(|&zone| std::cmp::Reverse(sums[zone].1));
        let mut inks: Vec<Ink> = Vec::new();
        let mut of_zone = vec![None; sums.len()];
        for zone in order {
            let (sum, pixels) = sums[zone];
            let color = sum / pixels.max(1) as f32;
            of_zone[zone] = inks.iter().position(|ink| ink.color.distance_squared(color) < ONE_INK);
            match of_zone[zone] {
                Some(ink) => inks[ink].pixels += pixels,
                None if inks.len() < MOST_INKS => {
                    of_zone[zone] = Some(inks.len());
                    inks.push(Ink { color, pixels });
                }
                None => {}
            }
        }
        let least = LEAST_PIXELS.max((LEAST_SHARE * colors.len() as f32) as usize);
        Self { inks, of_zone, least }
    }

    /// The inks that are pure on enough pixels to be looked for elsewhere.
    fn common(&self) -> Vec<usize> {
        (0..self.inks.len()).filter(|&n| self.inks[n].pixels >= self.least).collect()
    }

    /// Gives zones to pixels that are mostly an ink, which zones around (`near`, by pixel) do not explain as well
    /// (`blends`), and makes `colors` there the ink's.
    pub(super) fn claim(
        &self,
        raster: Raster,
        zones: &mut Zones,
        colors: &mut [Vec3],
        (near, blends): (&[Vec<Candidate>], &[Option<Blend>]),
    ) {
        let common = self.common();
        let possible: Vec<Vec<Trace>> = (0..raster.len())
            .map(|p| match zones.of_pixel[p] {
                IMPURE => self.possible(&common, colors[p], &near[p], blends[p]),
                _ => Vec::new(),
            })
            .collect();
        let traces = agree(raster, &possible);
        let mut of_pixel = follow(raster, &traces);
        bridge(raster, &traces, &mut of_pixel, |p| zones.of_pixel[p] == IMPURE);
        let claimed: Vec<usize> = (0..raster.len()).filter(|&p| of_pixel[p].is_some()).collect();
        let mut forest = Forest::new(raster.len());
        for &p in &claimed {
            around(raster, p, 1, |q, _| {
                let zone = zones.of_pixel[q];
                let ink = if zone == IMPURE { of_pixel[q] } else { self.of_zone[zone as usize] };
                if ink == of_pixel[p] {
                    forest.join(p as u32, q as u32);
                }
            });
        }
        // A zone that it hangs together with, the first one, or a new one.
        let mut zone_of_root = vec![IMPURE; raster.len()];
        for p in (0..raster.len()).filter(|&p| zones.of_pixel[p] != IMPURE) {
            let zone = &mut zone_of_root[forest.root(p as u32) as usize];
            *zone = (*zone).min(zones.of_pixel[p]);
        }
        for &p in &claimed {
            let zone = &mut zone_of_root[forest.root(p as u32) as usize];
            if *zone == IMPURE {
                *zone = zones.count;
                zones.count += 1;
            }
            zones.of_pixel[p] = *zone;
            colors[p] = of_pixel[p].map_or(colors[p], |ink| self.inks[ink].color);
        }
    }

    /// Which of the common inks a pixel may have a part of, if they explain it better than what is around, the best first.
    fn possible(&self, common: &[usize], color: Vec3, near: &[Candidate], blend: Option<Blend>) -> Vec<Trace> {
        let most = RESIDUE.min(blend.map_or(f32::INFINITY, |blend| (blend.error - ROUNDING) / BETTER));
        let candidate = |n: usize| Candidate { region: IMPURE, color: self.inks[n].color };
        let mut best: Vec<Option<(f32, f32)>> = vec![None; self.inks.len()];
        let take = |best: &mut Vec<Option<(f32, f32)>>, error: f32, ink: usize, part: f32| {
            if error <= most && part >= LEAST_PART && best[ink].is_none_or(|(least, _)| error < least) {
                best[ink] = Some((error, part));
            }
        };
        for &n in common {
            for other in near {
                let blend = Blend::of_two(color, candidate(n), *other, 0.0);
                take(&mut best, blend.error, n, blend.part);
            }
        }
        if best.iter().all(Option::is_none) {
            // Two strokes side by side.
            for (place, &n) in common.iter().enumerate() {
                for &other in &common[place + 1..] {
                    let blend = Blend::of_two(color, candidate(n), candidate(other), 0.5);
                    let ink = if blend.major.color == self.inks[n].color { n } else { other };
                    take(&mut best, blend.error, ink, blend.part);
                }
            }
        }
        let mut found: Vec<(f32, Trace)> =
            (0..).zip(best).filter_map(|(ink, best)| best.map(|(error, part)| (error, Trace { ink, part }))).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found.into_iter().map(|(_, trace)| trace).collect()
    }
}

/// One ink for each pixel: where several could be, the one that those beside it have. (Greys lie between white and black.)
fn agree(raster: Raster, possible: &[Vec<Trace>]) -> Vec<Option<Trace>> {
    let mut traces: Vec<Option<Trace>> =
        possible.iter().map(|found| if let [only] = found[..] { Some(only) } else { None }).collect();
    let mut waiting: VecDeque<usize> =
        (0..raster.len()).filter(|&p| traces[p].is_some_and(|trace| trace.part >= STROKE_PART)).collect();
    while let Some(p) = waiting.pop_front() {
        let Some(own) = traces[p] else { continue };
        around(raster, p, 2, |q, _| {
            if traces[q].is_none()
                && let Some(&same) = possible[q].iter().find(|trace| trace.ink == own.ink)
            {
                traces[q] = Some(same);
                waiting.push_back(q);
            }
        });
    }
    for (trace, found) in traces.iter_mut().zip(possible) {
        *trace = trace.or(found.first().copied());
    }
    traces
}

/// What a pixel has of an ink.
#[derive(Debug, Clone, Copy)]
struct Trace {
    ink: usize,
    part: f32,
}

/// The pixels that an ink has: those that have enough of it, and from these on those along which a thin stroke goes
/// on between rows of pixels, having more of it than what is on either side (as edges are followed by Canny 1986).
fn follow(raster: Raster, traces: &[Option<Trace>]) -> Vec<Option<usize>> {
    let part = |x: i64, y: i64, ink: usize| {
        let trace = raster.index(x, y).and_then(|q| traces[q]).filter(|trace| trace.ink == ink);
        trace.map_or(0.0, |trace| trace.part)
    };
    let is_ridge = |p: usize, trace: Trace| {
        let (x, y) = raster.xy(p);
        let (x, y) = (x as i64, y as i64);
        [[1, 0], [0, 1]].into_iter().any(|[dx, dy]| {
            let [before, after] = [part(x - dx, y - dy, trace.ink), part(x + dx, y + dy, trace.ink)];
            trace.part >= before && trace.part > after && trace.part > before.min(after) + RIDGE
        })
    };
    let mut of_pixel: Vec<Option<usize>> =
        traces.iter().map(|trace| trace.filter(|trace| trace.part >= STROKE_PART).map(|trace| trace.ink)).collect();
    let mut waiting: Vec<usize> = (0..raster.len()).filter(|&p| of_pixel[p].is_some()).collect();
    while let Some(p) = waiting.pop() {
        around(raster, p, 1, |q, _| {
            if let (None, Some(trace)) = (of_pixel[q], traces[q])
                && Some(trace.ink) == of_pixel[p]
                && is_ridge(q, trace)
            {
                of_pixel[q] = Some(trace.ink);
                waiting.push(q);
            }
        });
    }
    of_pixel
}

/// Joins pixels of an ink that have but a corner in common by the pixel beside both that has more of it.
fn bridge(raster: Raster, traces: &[Option<Trace>], of_pixel: &mut [Option<usize>], is_free: impl Fn(usize) -> bool) {
    for p in 0..raster.len() {
        let Some(ink) = of_pixel[p] else { continue };
        let (x, y) = raster.xy(p);
        for dx in [-1i64, 1] {
            let at = |dx: i64, dy: i64| raster.index(x as i64 + dx, y as i64 + dy);
            let (Some(corner), Some(beside), Some(below)) = (at(dx, 1), at(dx, 0), at(0, 1)) else { continue };
            let sides = [beside, below];
            if of_pixel[corner] != Some(ink) || sides.iter().any(|&q| of_pixel[q] == Some(ink)) {
                continue;
            }
            let part = |q: usize| traces[q].filter(|trace| trace.ink == ink).map_or(0.0, |trace| trace.part);
            let free = sides.into_iter().filter(|&q| of_pixel[q].is_none() && is_free(q));
            if let Some(q) = free.max_by(|&a, &b| part(a).total_cmp(&part(b))) {
                of_pixel[q] = Some(ink);
            }
        }
    }
}
