//! Labels for every pixel, chosen so that colour is continuous inside a label and a label lasts.
//!
//! In: frames, in order. Out: a [`LabelPlane`] for each, and whether a frame starts a new scene. Forbidden here: the
//! mesh; any look at later frames; anything that depends on the order of a hash map or on threads.
//!
//! A frame passes through: `carry` (superpixels of the frame before follow their motion) or, at a slab's start,
//! `seed`; `border` (border pixels move to where the picture has its edges); `population` (births, splits,
//! deaths). These are temporal superpixels in the sense of §III-A and of Chang, Wei and Fisher, "A video representation
//! using temporal superpixels" (CVPR 2013). Where the labels are chosen by content, superpixels are then merged across
//! weak boundaries (`regions`), named after the frame before (`identity`), and their boundaries smoothed
//! (`polish`, `islands`): a discontinuity costs vertices, so there is one only where it pays.

mod border;
mod carry;
mod connect;
mod contours;
mod cut;
mod identity;
mod islands;
mod lab;
mod metrics;
mod motion;
mod polish;
mod population;
mod pyramid;
mod raster;
mod region_graph;
mod regions;
mod seed;
mod slivers;
mod stillness;
mod superpixels;
#[cfg(test)]
mod tests;

use border::{BorderRules, settle};
use carry::{carry, estimate_motion};
use cut::SceneView;
use identity::name_regions;
use islands::dissolve_islands;
use lab::{Lab, LabTables};
pub use metrics::{explained_variation, mean_duration};
use motion::MotionField;
use polish::{PolishRules, polish};
use population::{Population, give_birth, split_large, thin_out};
use pyramid::{Gray, pyramid};
use raster::{Raster, SimplePoints};
use regions::{MergeRules, merge};
use slivers::dissolve_slivers;
use stillness::Stillness;
use superpixels::{Spread, Superpixels};

use crate::video::{Frame, Label, LabelPlane};

/// What labels are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentParams {
    /// Mean number of superpixels a frame, which are then the labels; 1: a single label; 0: labels are chosen by
    /// content, superpixels merged up to the jumps below.
    pub superpixels: u32,
    /// Chosen by content: a boundary stays where the colour jumps by more than this, root mean square of the channels
    /// in 8-bit levels.
    pub jump_levels: f32,
    /// Chosen by content: how far `jump_levels` is lowered for boundaries that were there in the frame before, and
    /// raised for new ones inside a label.
    pub hysteresis_levels: f32,
    /// Chosen by content: what a region's boundary must be worth, in levels beyond `jump_levels` summed over its pixel
    /// sides.
    pub worth_levels: f32,
    /// Connected pieces of a label of fewer pixels are given to a neighbour.
    pub min_area_px: u32,
}

impl SegmentParams {
    /// Defaults for this number of superpixels.
    pub fn new(superpixels: u32) -> Self {
        Self { superpixels, jump_levels: 40.0, hysteresis_levels: 25.0, worth_levels: 800.0, min_area_px: 12 }
    }
}

/// A frame's labels and its place in the video.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SegmentedFrame {
    /// A label for every pixel.
    pub labels: LabelPlane,
    /// This frame does not continue the one before: its labels have nothing to do with earlier ones.
    pub scene_cut: bool,
}

/// Superpixels that the content is first divided into where labels are chosen by content, for a mid-sized picture.
const FINE_COUNT: f32 = 3600.0;
/// Their spacing stays in these bounds, in pixels: below, a superpixel holds too little to be told from noise; above,
/// details get lost.
const FINE_SPACING_PX: std::ops::RangeInclusive<f32> = 6.0..=16.0;
/// Price of a border between superpixels, a neighbour: about the squared colour difference of visible noise.
const OUTLINE: f32 = 12.0;
/// Price of leaving the superpixel that motion brought.
const LOYALTY: f32 = 20.0;
/// Most sweeps of border moves over a frame.
const SWEEPS: usize = 6;

/// Divides a video into labels, frame by frame.
#[derive(Debug, Clone)]
pub struct Segmenter {
    raster: Raster,
    params: SegmentParams,
    budget: Budget,
    tables: LabTables,
    simple: SimplePoints,
    /// The last frame pushed, of whatever slab.
    view: Option<SceneView>,
    /// What every frame's labels are, where there is a single one.
    uniform: Option<LabelPlane>,
    /// The slab so far; none before its first frame.
    slab: Option<Slab>,
}

/// Sizes and numbers of superpixels.
#[derive(Debug, Clone, Copy)]
struct Budget {
    count: u32,
    spread: Spread,
    population: Population,
}

/// What is carried from frame to frame.
#[derive(Debug, Clone)]
struct Slab {
    frame: Frame,
    levels: Vec<Gray>,
    stillness: Stillness,
    map: Superpixels,
    labels: LabelPlane,
    next_label: u32,
}

impl Segmenter {
    /// A segmenter for frames of this size, at the start of a slab.
    pub fn new(width: u32, height: u32, params: SegmentParams) -> Self {
        let raster = Raster::new(width.max(1), height.max(1));
        Self {
            raster,
            params,
            budget: Budget::new(raster, params),
            tables: LabTables::new(),
            simple: SimplePoints::new(),
            view: None,
            uniform: (params.superpixels == 1).then(|| LabelPlane::uniform(width.max(1), height.max(1), Label(0))),
            slab: None,
        }
    }

    /// Whether `frame` shows another scene than the last frame pushed. The first frame of all does not.
    pub fn is_scene_cut(&self, frame: &Frame) -> bool {
        self.view.as_ref().is_some_and(|view| SceneView::new(frame).is_cut_from(view))
    }

    /// Forgets the labels: the next frame starts afresh, from label 0.
    pub fn start_slab(&mut self) {
        self.slab = None;
    }

    /// The labels of the next frame, a new slab started where it shows another scene.
    ///
    /// # Panics
    /// If the frame is of another size than the segmenter was made for.
    pub fn segment(&mut self, frame: &Frame) -> SegmentedFrame {
        let scene_cut = self.is_scene_cut(frame);
        if scene_cut {
            self.start_slab();
        }
        SegmentedFrame { labels: self.push(frame), scene_cut }
    }

    /// The labels of the next frame, consistent with those of the slab's earlier frames.
    ///
    /// # Panics
    /// If the frame is of another size than the segmenter was made for.
    pub fn push(&mut self, frame: &Frame) -> LabelPlane {
        assert_eq!(Raster::new(frame.width(), frame.height()), self.raster, "frame size");
        self.view = Some(SceneView::new(frame));
        if let Some(uniform) = &self.uniform {
            return uniform.clone();
        }
        let slab = match self.slab.take() {
            None => self.first(frame),
            Some(slab) if slab.frame == *frame => slab,
            Some(slab) => self.next(slab, frame),
        };
        let labels = slab.labels.clone();
        self.slab = Some(slab);
        labels
    }

    fn first(&self, frame: &Frame) -> Slab {
        let colors = self.tables.convert(frame);
        let mut map = seed::seed(self.raster, &colors, self.budget.count, self.budget.spread);
        self.refine(&mut map, &colors, &[], &[]);
        let mut next_label = 0;
        let carried = vec![None; self.raster.len()];
        let labels = self.label(&mut map, frame, (&colors, &carried, &[]), &mut next_label);
        Slab { frame: frame.clone(), levels: pyramid(frame), stillness: Stillness::new(frame), map, labels, next_label }
    }

    fn next(&self, slab: Slab, frame: &Frame) -> Slab {
        let Slab { levels: before, mut stillness, mut map, mut next_label, .. } = slab;
        let colors = self.tables.convert(frame);
        let levels = pyramid(frame);
        let field = MotionField::estimate(&before, &levels);
        estimate_motion(&mut map, &before[0], &levels[0], &field);
        let ids = |map: &Superpixels| map.plane.iter().map(|&cell| map.cells[cell as usize].id).collect::<Vec<_>>();
        let ids_before = ids(&map);
        carry(&mut map, &colors, self.budget.population.min_area);
        let mut frozen = stillness.update(frame);
        for ((frozen, before), after) in frozen.iter_mut().zip(ids_before).zip(ids(&map)) {
            *frozen &= before == after;
        }
        let carried: Vec<_> = map.plane.iter().map(|&cell| map.cells[cell as usize].label).collect();
        let carried_cells = map.plane.clone();
        self.refine(&mut map, &colors, &carried_cells, &frozen);
        let labels = self.label(&mut map, frame, (&colors, &carried, &frozen), &mut next_label);
        Slab { frame: frame.clone(), levels, stillness, map, labels, next_label }
    }

    /// Settles borders, then lets superpixels be born, split and die, and settles again.
    fn refine(&self, map: &mut Superpixels, colors: &[Lab], carried: &[u32], frozen: &[bool]) {
        let Budget { spread, population, .. } = self.budget;
        let rules = BorderRules { colors, spread, outline: OUTLINE, carried, loyalty: LOYALTY, frozen };
        settle(map, &rules, &self.simple, SWEEPS);
        give_birth(map, colors, frozen, population);
        if self.params.superpixels == 0 {
            dissolve_slivers(map, colors);
        }
        split_large(map, colors, population);
        // Places have changed: what motion brought no longer means anything.
        settle(map, &BorderRules { carried: &[], loyalty: 0.0, ..rules }, &self.simple, SWEEPS);
        thin_out(map, colors, population);
    }

    /// Labels of the superpixels, by content if so wanted.
    fn label(
        &self,
        map: &mut Superpixels,
        frame: &Frame,
        (colors, carried, frozen): (&[Lab], &[Option<Label>], &[bool]),
        next_label: &mut u32,
    ) -> LabelPlane {
        let SegmentParams { superpixels, jump_levels: jump, hysteresis_levels: hysteresis, .. } = self.params;
        if superpixels == 0 {
            let rules = MergeRules { jump, hysteresis, worth: self.params.worth_levels };
            let groups = merge(map, frame, rules);
            name_regions(map, &groups, next_label);
            polish(map, &PolishRules { colors, carried, frozen }, &self.simple);
            dissolve_islands(map, self.params.min_area_px);
        }
        let label_of = |cell: &superpixels::Superpixel| cell.label.unwrap_or(Label(cell.id));
        let labels = map.plane.iter().map(|&cell| label_of(&map.cells[cell as usize])).collect();
        LabelPlane::new(frame.width(), frame.height(), labels)
    }
}

impl Budget {
    fn new(raster: Raster, params: SegmentParams) -> Self {
        let pixels = raster.len() as f32;
        // By content, detail may double the number; where a number is asked for, a tenth more spares the least distinct
        // of the old ones while new content moves in.
        let (spacing, detail) = if params.superpixels == 0 {
            ((pixels / FINE_COUNT).sqrt().clamp(*FINE_SPACING_PX.start(), *FINE_SPACING_PX.end()), 2.0)
        } else {
            ((pixels / params.superpixels as f32).sqrt().max(1.0), 1.1)
        };
        let area = spacing * spacing;
        let count = (pixels / area).round().max(1.0);
        let max_count = (detail * count) as usize;
        let population = Population {
            // Births and deaths below this are noise; where superpixels are meant to be tiny, a quarter of their size.
            min_area: params.min_area_px.min((area / 4.0) as u32),
            max_area: (3.0 * area) as u32,
            max_count,
            birth_limit: max_count + max_count.div_ceil(5),
        };
        Self { count: count as u32, spread: Spread::new(spacing), population }
    }
}
