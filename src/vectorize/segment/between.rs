//! What lies halfway between two frames: their labels, carried along by motion.
//!
//! In: two frames with labels. Out: a frame and its labels for the time halfway; and whether anything moves so far that it
//! pays. Forbidden here: the mesh.
//!
//! A stroke that moves by more than it is wide is not joined to itself by a lattice that knows frames alone. So each label
//! is matched to itself block by block, by where it is and is not, and goes half the way. Where two arrive, the smaller
//! label is in front: it is the larger one that goes on behind the other.

use std::cmp::Ordering;
use std::collections::BTreeMap;

use super::motion::{BLOCK, MotionField, Vector};
use super::pyramid::pyramid;
use super::raster::Raster;
use crate::video::{Frame, Label, LabelPlane};

/// A block's label is matched this far around the block, in pixels.
const MARGIN: i64 = 4;
/// Blocks around a block whose vectors are tried.
const NEAR: isize = 2;
/// Steps of the walk downhill from the best vector.
const STEPS: usize = 3;
/// What a pixel of displacement counts in pixels that do not match.
const LENGTH_PRICE: f32 = 0.1;
/// Part of the pixels of a frame that must have come from farther than the next pixel to be worth a plane between.
const LEAST_MOVING: f32 = 5e-4;

/// Whether labels move by more than a pixel from one plane to the next.
pub fn is_moving(before: &LabelPlane, after: &LabelPlane) -> bool {
    let raster = Raster::new(before.width(), before.height());
    let from_afar = |p: &usize| {
        let label = after.labels()[*p];
        before.labels()[*p] != label && raster.ring(*p).iter().all(|&q| before.labels().get(q) != Some(&label))
    };
    let count = (0..raster.len()).filter(from_afar).count();
    count as f32 > LEAST_MOVING * raster.len() as f32
}

/// A frame and its labels.
type Plane<'a> = (&'a Frame, &'a LabelPlane);

/// The frame and the labels halfway between two frames of one size.
///
/// # Panics
/// If sizes differ.
pub fn halfway(before: Plane<'_>, after: Plane<'_>) -> (Frame, LabelPlane) {
    let raster = Raster::new(before.0.width(), before.0.height());
    assert_eq!(raster, Raster::new(after.0.width(), after.0.height()), "frame size");
    let mut areas: BTreeMap<Label, u32> = BTreeMap::new();
    for &label in before.1.labels().iter().chain(after.1.labels()) {
        *areas.entry(label).or_default() += 1;
    }
    let mut arrivals = Arrivals { raster, areas: &areas, at: vec![None; raster.len()] };
    let levels = [before.0, after.0].map(pyramid);
    for (ends, levels) in [([before, after], [&levels[0], &levels[1]]), ([after, before], [&levels[1], &levels[0]])] {
        arrivals.carry(&Matches { raster, ends, motion: MotionField::estimate(levels[0], levels[1]) });
    }
    arrivals.picture([before, after])
}

/// Matches the labels of one frame to those of another.
struct Matches<'a> {
    raster: Raster,
    /// From and to.
    ends: [Plane<'a>; 2],
    motion: MotionField,
}

impl Matches<'_> {
    fn label(&self, end: usize, p: usize) -> Label {
        self.ends[end].1.labels()[p]
    }

    fn colors(&self, end: usize, p: usize) -> Colors {
        colors(self.ends[end], p)
    }

    /// Where each label of a block goes.
    fn of_block(&self, column: usize, row: usize) -> BTreeMap<Label, Vector> {
        let mut vectors = BTreeMap::new();
        for p in self.pixels(column, row, 0) {
            let label = self.label(0, p);
            vectors.entry(label).or_insert_with(|| self.best(column, row, label));
        }
        vectors
    }

    /// The pixels of a block and so many around it.
    fn pixels(&self, column: usize, row: usize, margin: i64) -> impl Iterator<Item = usize> + use<> {
        let raster = self.raster;
        let range = |n: usize, side: usize| {
            let start = (n * BLOCK) as i64;
            (start - margin).max(0)..(start + BLOCK as i64 + margin).min(side as i64)
        };
        let (xs, ys) = (range(column, raster.width), range(row, raster.height));
        ys.flat_map(move |y| xs.clone().map(move |x| y as usize * raster.width + x as usize))
    }

    /// The vector along which a label matches itself best around a block.
    fn best(&self, column: usize, row: usize, label: Label) -> Vector {
        let mut tried: Vec<(Vector, f32)> = Vec::new();
        let near = (-NEAR..=NEAR).flat_map(|dy| (-NEAR..=NEAR).map(move |dx| (dx, dy)));
        let vectors = near.map(|(dx, dy)| self.motion.clamped(column as isize + dx, row as isize + dy));
        for vector in std::iter::once([0, 0]).chain(vectors) {
            self.attempt(&mut tried, (column, row), label, vector);
        }
        let mut best = least(&tried);
        for _ in 0..STEPS {
            let [x, y] = best;
            for vector in [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]] {
                self.attempt(&mut tried, (column, row), label, vector);
            }
            if least(&tried) == best {
                break;
            }
            best = least(&tried);
        }
        best
    }

    fn attempt(&self, tried: &mut Vec<(Vector, f32)>, (column, row): (usize, usize), label: Label, [dx, dy]: Vector) {
        if tried.iter().any(|(known, _)| *known == [dx, dy]) {
            return;
        }
        let differs = |p: &usize| {
            let there = self.moved(*p, [dx, dy]).map(|q| self.label(1, q) == label);
            there.is_some_and(|there| there != (self.label(0, *p) == label))
        };
        let misses = self.pixels(column, row, MARGIN).filter(differs).count();
        tried.push(([dx, dy], misses as f32 + LENGTH_PRICE * (dx as f32).hypot(dy as f32)));
    }

    /// The pixel a vector leads to.
    fn moved(&self, p: usize, [dx, dy]: Vector) -> Option<usize> {
        let (x, y) = self.raster.xy(p);
        self.raster.index(x as i64 + i64::from(dx), y as i64 + i64::from(dy))
    }
}

/// The vector of the least price, of equals the first.
fn least(tried: &[(Vector, f32)]) -> Vector {
    tried.iter().min_by(|a, b| a.1.total_cmp(&b.1)).map_or([0, 0], |(vector, _)| *vector)
}

/// What has come to each pixel halfway.
struct Arrivals<'a> {
    raster: Raster,
    /// Pixels of each label in both frames.
    areas: &'a BTreeMap<Label, u32>,
    at: Vec<Option<Arrival>>,
}

/// A pixel on its way.
#[derive(Clone, Copy)]
struct Arrival {
    label: Label,
    /// Pixels of its label.
    area: u32,
    colors: Colors,
}

impl Arrivals<'_> {
    /// Carries each pixel that has its label at the other end of its way, too.
    fn carry(&mut self, matches: &Matches<'_>) {
        let columns = self.raster.width.div_ceil(BLOCK);
        for block in 0..columns * self.raster.height.div_ceil(BLOCK) {
            let (column, row) = (block % columns, block / columns);
            let vectors = matches.of_block(column, row);
            for p in matches.pixels(column, row, 0) {
                let label = matches.label(0, p);
                let vector = vectors[&label];
                let Some(q) = matches.moved(p, vector).filter(|&q| matches.label(1, q) == label) else { continue };
                // Rounded down from either end, an odd way has the same middle.
                let Some(middle) = matches.moved(p, vector.map(|component| component.div_euclid(2))) else { continue };
                let colors = mean(matches.colors(0, p), matches.colors(1, q));
                self.arrive(middle, Arrival { label, area: self.areas[&label], colors });
            }
        }
    }

    /// The smaller label is in front.
    fn arrive(&mut self, middle: usize, arrival: Arrival) {
        let before = &mut self.at[middle];
        if before.is_none_or(|before| (arrival.area, arrival.label) < (before.area, before.label)) {
            *before = Some(arrival);
        }
    }

    fn picture(&self, ends: [Plane<'_>; 2]) -> (Frame, LabelPlane) {
        let mut frame = ends[0].0.clone();
        let mut pure = frame.clone();
        let mut labels = Vec::with_capacity(self.at.len());
        for (p, arrival) in self.at.iter().enumerate() {
            let (label, colors) =
                arrival.map_or_else(|| self.behind(ends, p), |arrival| (arrival.label, arrival.colors));
            [frame.pixels_mut()[p], pure.pixels_mut()[p]] = colors;
            labels.push(label);
        }
        let plane = LabelPlane::new(frame.width(), frame.height(), labels);
        let is_known = ends.iter().all(|(_, plane)| plane.pure_colors().is_some());
        (frame, if is_known { plane.with_pure_colors(pure) } else { plane })
    }

    /// What is seen where nothing arrives: the larger of the labels before and after.
    fn behind(&self, ends: [Plane<'_>; 2], p: usize) -> (Label, Colors) {
        let [before, after] = ends.map(|(frame, plane)| (plane.labels()[p], colors((frame, plane), p)));
        match self.areas[&before.0].cmp(&self.areas[&after.0]) {
            Ordering::Less => after,
            Ordering::Greater => before,
            Ordering::Equal => (before.0.min(after.0), mean(before.1, after.1)),
        }
    }
}

/// What a pixel looks like, and what its label alone would look like there.
type Colors = [[u8; 3]; 2];

fn colors((frame, labels): Plane<'_>, p: usize) -> Colors {
    [frame, labels.pure_colors().map_or(frame, |pure| pure)].map(|frame| frame.pixels()[p])
}

fn mean(a: Colors, b: Colors) -> Colors {
    std::array::from_fn(|n| std::array::from_fn(|channel| a[n][channel].midpoint(b[n][channel])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stroke two pixels wide around a disc of another label, moved by `dx`, on a ground of a third.
    fn plane(dx: f32) -> (Frame, LabelPlane) {
        let label = |x: u32, y: u32| {
            let distance = (x as f32 - 24.0 - dx).hypot(y as f32 - 20.0);
            if distance < 9.0 { 1 } else { 2 * u32::from(distance < 11.0) }
        };
        let frame = Frame::from_fn(64, 40, |x, y| [[90, 160, 220], [250, 200, 20], [10; 3]][label(x, y) as usize]);
        let labels = (0..64 * 40).map(|n| Label(label(n % 64, n / 64))).collect();
        (frame.expect("a frame"), LabelPlane::new(64, 40, labels))
    }

    #[test]
    fn strokes_arrive_whole() {
        let [before, after, truth] = [0.0, 6.0, 3.0].map(plane);
        let (frame, labels) = halfway((&before.0, &before.1), (&after.0, &after.1));
        let wrong = labels.labels().iter().zip(truth.1.labels()).filter(|(a, b)| a != b).count();
        assert!(wrong <= 4, "{wrong} pixels");
        let differs = frame.pixels().iter().zip(truth.0.pixels()).filter(|(a, b)| a != b).count();
        assert!(differs <= 4, "{differs} pixels");
        assert!(is_moving(&before.1, &after.1) && !is_moving(&before.1, &before.1));
    }

    #[test]
    fn both_ways_through_time_agree() {
        let [before, after] = [0.0, 5.0].map(plane);
        let forth = halfway((&before.0, &before.1), (&after.0, &after.1)).1;
        let back = halfway((&after.0, &after.1), (&before.0, &before.1)).1;
        let wrong = forth.labels().iter().zip(back.labels()).filter(|(a, b)| a != b).count();
        assert!(wrong <= 4, "{wrong} pixels");
    }

    #[test]
    fn what_stands_still_stays() {
        let still = plane(0.0);
        assert_eq!(halfway((&still.0, &still.1), (&still.0, &still.1)), still);
    }
}
