//! Temporal superpixels: labels for a number of superpixels asked for, which follow what they cover.
//!
//! In: frames, in order. Out: a plane of labels for each, every label in one piece. Forbidden here: merging labels by
//! content; any look at later frames.
//!
//! The model of Chang, Wei and Fisher, "A video representation using temporal superpixels" (CVPR 2013). A superpixel is
//! a Gaussian in (x, y, L*, a*, b*) whose means drift from frame to frame, the place with its motion (`flow`). The
//! labels of a frame start from those of the last one, moved along (`propagate`), and then every move must lower one
//! objective (`model`): pixels on borders change sides (`local`), neighbours merge (`merge`), superpixels split
//! (`split`), names are given up, swapped or taken from the dead (`switch`, `ghosts`). A frame without predecessor
//! starts from a grid and is split until the number is reached. What a superpixel costs follows the number asked for.

mod flow;
mod ghosts;
mod local;
mod merge;
mod model;
mod partition;
mod propagate;
mod split;
mod switch;
#[cfg(test)]
mod tests;

use flow::estimate_motion;
use ghosts::{Ghost, Ghosts};
use local::settle;
use merge::{Bounds, merge};
use model::{COLOR_STEPS, Color, Means, Model, Prior};
use partition::Partition;
use propagate::propagate;
use split::{find_splits, split};
use switch::switch;

use super::lab::LabTables;
use super::motion::MotionField;
use super::pyramid::{Gray, pyramid};
use super::raster::{Raster, SimplePoints, grid};
use super::stillness::Stillness;
use crate::video::{Frame, Label, LabelPlane};

/// A distance of one spacing of superpixels weighs as much as this distance of colours (SLIC's compactness).
const COMPACTNESS: f64 = 8.0;
/// See [`Model`]; squared colour distances.
const AREA_WEIGHT: f64 = 2.0;
const OUTLINE: f64 = 12.0;
const LOYALTY: f64 = 20.0;
const NOVELTY: f64 = 3.0;
/// A superpixel costs no less than this times its area in pixels: flat pictures are not to be divided by their noise.
const LEAST_PRICE: f64 = 2.0;
/// Weight of what is known from the frame before, in mean areas: places hold on (their motion is known), colours drift.
const PLACE_MEMORY: f64 = 1.0;
const COLOR_MEMORY: f64 = 0.4;
/// The first frame starts from this share of the superpixels; the others are made by splits, where content wants them.
const SEEDS: f64 = 0.6;
/// Rounds of splits of the first frame, and sweeps of local moves between them.
const FIRST_ROUNDS: usize = 4;
const FIRST_SWEEPS: usize = 16;
/// Rounds of merges, splits and switches of the other frames, and sweeps between them.
const ROUNDS: usize = 2;
const SWEEPS: usize = 6;
/// How much the price may change from frame to frame.
const PRICE_STEP: f64 = 1.15;

/// Divides a video into temporal superpixels, frame by frame.
#[derive(Debug, Clone)]
pub(super) struct TemporalSuperpixels {
    raster: Raster,
    simple: SimplePoints,
    tables: LabTables,
    model: Model,
    /// Superpixels asked for.
    count: usize,
    /// Superpixels of fewer pixels are merged.
    least_area: u32,
    /// None before a slab's first frame.
    slab: Option<Slab>,
}

/// What is carried from frame to frame.
#[derive(Debug, Clone)]
struct Slab {
    frame: Frame,
    levels: Vec<Gray>,
    stillness: Stillness,
    map: Partition,
    ghosts: Ghosts,
}

impl TemporalSuperpixels {
    /// For about `count` superpixels a frame, none of fewer than `least_area` pixels unless nearly all are.
    pub(super) fn new(raster: Raster, count: u32, least_area: u32) -> Self {
        let pixels = raster.len() as f64;
        let count = f64::from(count).clamp(1.0, pixels);
        let mean_area = pixels / count;
        let model = Model {
            per_pixel2: COMPACTNESS * COMPACTNESS / mean_area,
            mean_area,
            area_weight: AREA_WEIGHT,
            outline: OUTLINE,
            loyalty: LOYALTY,
            price: 0.0,
            novelty: NOVELTY,
        };
        Self {
            raster,
            simple: SimplePoints::new(),
            tables: LabTables::new(),
            model,
            count: count as usize,
            least_area: least_area.min((mean_area / 4.0) as u32),
            slab: None,
        }
    }

    /// Forgets everything: the next frame starts afresh, from label 0.
    pub(super) fn start_slab(&mut self) {
        self.slab = None;
    }

    /// The labels of the next frame.
    pub(super) fn push(&mut self, frame: &Frame) -> LabelPlane {
        let slab = match self.slab.take() {
            None => self.first(frame),
            Some(slab) if slab.frame == *frame => slab,
            Some(slab) => self.next(slab, frame),
        };
        let Partition { plane, superpixels, .. } = &slab.map;
        let labels = plane.iter().map(|&place| Label(superpixels[place as usize].id)).collect();
        self.slab = Some(slab);
        LabelPlane::new(frame.width(), frame.height(), labels)
    }

    fn first(&mut self, frame: &Frame) -> Slab {
        let mut map = Partition::new(self.raster, self.colors(frame));
        let (columns, rows) = grid(self.raster, (SEEDS * self.count as f64).ceil() as u32);
        (0..columns * rows).for_each(|_| _ = map.add([0.0; 2]));
        for p in 0..self.raster.len() {
            let (x, y) = self.raster.xy(p);
            map.plane[p] = (y * rows / self.raster.height * columns + x * columns / self.raster.width) as u32;
        }
        map.recount(&self.model);
        self.divide(&mut map);
        Slab {
            frame: frame.clone(),
            levels: pyramid(frame),
            stillness: Stillness::new(frame),
            map,
            ghosts: Ghosts::default(),
        }
    }

    /// Splits the superpixels of a first frame, those that gain most first, until there are as many as asked for. The
    /// price is then what the last of them gained: had it been so from the start, there would be that many.
    fn divide(&mut self, map: &mut Partition) {
        self.model.price = 0.0;
        for round in (1..=FIRST_ROUNDS).rev() {
            settle(map, &self.model, &self.simple, &[], FIRST_SWEEPS);
            let missing = self.count.saturating_sub(map.superpixels.len()).div_ceil(round);
            let awake = vec![true; map.superpixels.len()];
            let splits = find_splits(map, &self.model, &awake, &[], i64::from(self.least_area));
            let taken = missing.min(splits.len());
            split(map, &self.model, &splits[..taken], self.count);
            if let Some(last) = splits.get(taken.saturating_sub(1)) {
                self.model.price = last.gain / NOVELTY;
            }
            if round > 1 {
                self.model.price = 0.0;
            }
        }
        self.model.price = self.model.price.max(LEAST_PRICE * self.model.mean_area);
        settle(map, &self.model, &self.simple, &[], FIRST_SWEEPS);
    }

    fn next(&mut self, slab: Slab, frame: &Frame) -> Slab {
        let Slab { levels: before, mut stillness, mut map, mut ghosts, .. } = slab;
        let levels = pyramid(frame);
        let mut frozen = stillness.update(frame);
        let is_still: Vec<bool> = awake(&map, &frozen).into_iter().map(|awake| !awake).collect();
        let field = MotionField::estimate(&before, &levels);
        estimate_motion(&mut map, &self.model, (&before[0], &levels[0]), &field, &is_still);
        ghosts.advance(&map, &self.model);
        let ids = |map: &Partition| map.plane.iter().map(|&place| map.get(place).id).collect::<Vec<_>>();
        let ids_before = ids(&map);
        let expected: Vec<Prior> = map.superpixels.iter().map(|superpixel| self.expect_moved(superpixel)).collect();
        propagate(&mut map, &self.model, self.colors(frame), &expected, self.least_area.max(1));
        ghosts.bury(&map.take_empty());
        for ((frozen, before), after) in frozen.iter_mut().zip(ids_before).zip(ids(&map)) {
            *frozen &= before == after;
        }
        self.improve(&mut map, &mut ghosts, &frozen);
        self.adjust_price(map.superpixels.len());
        Slab { frame: frame.clone(), levels, stillness, map, ghosts }
    }

    /// All moves in turn, on a frame that was started from the last one.
    fn improve(&self, map: &mut Partition, ghosts: &mut Ghosts, frozen: &[bool]) {
        let most = self.count + self.count.div_ceil(10);
        let bounds = Bounds { least_area: i64::from(self.least_area), most };
        settle(map, &self.model, &self.simple, frozen, SWEEPS);
        for _ in 0..ROUNDS {
            merge(map, &self.model, &awake(map, frozen), bounds);
            ghosts.bury(&map.take_empty());
            let expect = |ghost: &Ghost| self.expect(ghost.means, ghost.age + 1);
            let count = map.superpixels.len();
            let dead = ghosts.known(expect);
            let splits = find_splits(map, &self.model, &awake(map, frozen), &dead, bounds.least_area);
            ghosts.forget(&split(map, &self.model, &splits, most));
            let has_split = map.superpixels.len() > count;
            switch(map, &self.model, ghosts, expect);
            settle(map, &self.model, &self.simple, frozen, SWEEPS);
            if !has_split {
                break;
            }
        }
        if !bounds.hold(map) {
            merge(map, &self.model, &vec![false; map.superpixels.len()], bounds);
            ghosts.bury(&map.take_empty());
        }
    }

    /// The price that brings the number of superpixels nearer to what was asked for.
    fn adjust_price(&mut self, found: usize) {
        let ratio = found as f64 / self.count as f64;
        let price = self.model.price * ratio.clamp(1.0 / PRICE_STEP, PRICE_STEP);
        self.model.price = price.max(LEAST_PRICE * self.model.mean_area);
    }

    fn expect_moved(&self, superpixel: &partition::Superpixel) -> Prior {
        let Means { place, color } = superpixel.means(&self.model);
        self.expect(Means { place: [0, 1].map(|i| place[i] + superpixel.motion[i]), color }, 1)
    }

    /// What is known of a superpixel last seen so many frames ago: its means walk at random, their variances add up.
    fn expect(&self, means: Means, frames: u32) -> Prior {
        let area = self.model.mean_area / f64::from(frames);
        Prior { means, place_weight: PLACE_MEMORY * area, color_weight: COLOR_MEMORY * area }
    }

    fn colors(&self, frame: &Frame) -> Vec<Color> {
        self.tables.convert(frame).into_iter().map(|lab| lab.map(|v| (v * COLOR_STEPS).round() as i16)).collect()
    }
}

/// Which superpixels have a pixel that is not frozen.
fn awake(map: &Partition, frozen: &[bool]) -> Vec<bool> {
    let mut awake = vec![false; map.superpixels.len()];
    for (&place, _) in map.plane.iter().zip(frozen).filter(|(_, frozen)| !**frozen) {
        awake[place as usize] = true;
    }
    awake
}
