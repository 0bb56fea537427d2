//! Labels by content: a discontinuity only where the picture jumps.
//!
//! In: frames of a slab, in order. Out: a label for every pixel. `zones` are what has one colour or changes it slowly;
//! `unmix` takes every other pixel for a blend of what lies around it, or for a stroke too thin to have a pixel of its
//! own; `merge` gives up boundaries that are weak, and `naming` gives labels to regions such that they last.

mod forest;
mod inks;
mod merge;
mod naming;
mod unmix;
mod zones;

use merge::{MergeRules, Mixed, Regions, merge};
use naming::{Before, Palette};
use unmix::Unmixing;
use zones::find_zones;

use super::SegmentParams;
use super::flatness::Flatness;
use super::motion::MotionField;
use super::pyramid::{Gray, pyramid};
use super::raster::Raster;
use crate::video::{Frame, Label, LabelPlane};

/// A region's number within a frame.
pub(super) type Region = u32;

/// What a pixel is taken for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pixel {
    /// The region that it belongs to.
    pub(super) region: Region,
    /// Its region's colour there, in 8-bit levels.
    pub(super) color: glam::Vec3,
    /// The other region that it has a part of.
    pub(super) minor: Region,
    /// Which part of the pixel its own region has.
    pub(super) part: f32,
}

impl Pixel {
    /// A pixel of one region alone.
    pub(super) fn pure(region: Region, color: glam::Vec3) -> Self {
        Self { region, color, minor: region, part: 1.0 }
    }
}

/// Where colours vary inside zones, by noise or texture, a jump must be this many times more to be seen.
const NOISE_JUMP: f32 = 12.0;
/// Jumps below this are not worth a boundary in the cleanest picture.
const LEAST_JUMP: f32 = 16.0;

/// A slab's labels by content, frame by frame.
#[derive(Debug, Clone)]
pub(super) struct Content {
    raster: Raster,
    params: SegmentParams,
    before: Option<(Frame, Vec<Gray>, LabelPlane)>,
    palette: Palette,
    usual: Mixed,
    /// Whether the slab had a frame with too much border, or is not flat.
    is_texture: bool,
    flatness: Flatness,
}

/// Least [`Flatness::factor`] of what has more than one label. Where a camera's pictures are sharp, or sharpened, their edges
/// jump like those of drawings, but labels cost more than they give: what lies between edges takes the vertices.
const LEAST_FLATNESS: f32 = 2.0;

impl Content {
    /// For frames of this size, at the start of a slab.
    pub(super) fn new(raster: Raster, params: SegmentParams) -> Self {
        Self {
            raster,
            params,
            before: None,
            palette: Palette::default(),
            usual: Mixed::default(),
            is_texture: false,
            flatness: Flatness::default(),
        }
    }

    /// Forgets everything: the next frame starts afresh, from label 0.
    pub(super) fn start_slab(&mut self) {
        self.before = None;
        self.palette = Palette::default();
        self.usual = Mixed::default();
        self.is_texture = false;
        self.flatness = Flatness::default();
    }

    /// The labels of the next frame.
    pub(super) fn push(&mut self, frame: &Frame) -> LabelPlane {
        // Of texture nothing more is asked: its labels are one.
        if let Some((before, _, labels)) = &self.before
            && (self.is_texture || before == frame)
        {
            return labels.clone();
        }
        let zones = find_zones(self.raster, frame);
        let jump = (NOISE_JUMP * zones.roughness(self.raster, frame)).clamp(LEAST_JUMP, self.params.jump_levels);
        let (pixels, regions) = self.divide(frame, Unmixing::new(self.raster, frame, zones), jump);
        let levels = pyramid(frame);
        let plane = match &self.before {
            // Whatever moved, there is nothing that a name would tell apart.
            Some((_, _, labels)) if regions.areas.len() == 1 && labels.is_uniform() => labels.clone(),
            before => {
                let before = before.as_ref().map(|(before, before_levels, labels)| Before {
                    frame: before,
                    labels,
                    motion: MotionField::estimate(&levels, before_levels),
                });
                let names = self.palette.name(self.raster, frame, &pixels, &regions, before);
                let labels = pixels.iter().map(|pixel| Label(names[pixel.region as usize])).collect();
                let plane = LabelPlane::new(frame.width(), frame.height(), labels);
                if regions.areas.len() > 1 { plane.with_pure_colors(pure_colors(frame, &pixels)) } else { plane }
            }
        };
        self.before = Some((frame.clone(), levels, plane.clone()));
        plane
    }

    /// The regions of a frame, boundaries being there from this jump on.
    fn divide(&mut self, frame: &Frame, unmixing: Unmixing, jump: f32) -> (Vec<Pixel>, Regions) {
        let rules = MergeRules { jump, min_area: self.params.min_area_px, worth: self.params.jump_levels };
        let mut pixels = unmixing.pixels();
        self.usual.learn(self.raster, &pixels, jump);
        let mut regions = merge(self.raster, &mut pixels, rules, self.usual);
        // What comes to one region is no drawing.
        if regions.areas.len() > 1 {
            pixels = unmixing.with_inks().pixels();
            regions = merge(self.raster, &mut pixels, rules, self.usual);
        }
        if regions.areas.len() > 1 {
            self.is_texture |= self.border(&pixels) > self.params.most_border || !self.is_flat(frame, &pixels);
        }
        if self.is_texture {
            // Fewer boundaries are worse than none: the strokes among them go first.
            let rules = MergeRules { jump: f32::INFINITY, ..rules };
            regions = merge(self.raster, &mut pixels, rules, self.usual);
        }
        (pixels, regions)
    }

    /// Whether regions are flat, in the slab so far.
    fn is_flat(&mut self, frame: &Frame, pixels: &[Pixel]) -> bool {
        let regions = pixels.iter().map(|pixel| Label(pixel.region)).collect();
        self.flatness.look(frame, &LabelPlane::new(frame.width(), frame.height(), regions));
        self.flatness.factor() >= LEAST_FLATNESS
    }

    /// Sides of pixels between regions, over pixels.
    fn border(&self, pixels: &[Pixel]) -> f32 {
        let sides = self.raster.side_pairs().filter(|&(p, q)| pixels[p].region != pixels[q].region).count();
        sides as f32 / self.raster.len() as f32
    }
}

/// What each pixel's region looks like there.
fn pure_colors(frame: &Frame, pixels: &[Pixel]) -> Frame {
    let mut pure = frame.clone();
    for (color, pixel) in pure.pixels_mut().iter_mut().zip(pixels) {
        *color = pixel.color.to_array().map(|channel| (channel + 0.5) as u8);
    }
    pure
}
