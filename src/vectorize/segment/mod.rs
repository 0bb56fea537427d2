//! Labels for every pixel, chosen so that colour is continuous inside a label and a label lasts.
//!
//! In: frames, in order. Out: a [`LabelPlane`] for each, and whether a frame starts a new scene. Forbidden here: the
//! mesh; any look at later frames; anything that depends on the order of a hash map or on threads.
//!
//! Where a number of labels is asked for, they are temporal superpixels as in §III-A (`temporal`, a room of its own).
//! Where labels are chosen by content (`content`, another), a discontinuity costs vertices, so there is one only where
//! the picture jumps. `cut` finds scene cuts, `motion` where things went between two frames,
//! `flatness` how much colours change within labels.

mod between;
mod connect;
mod content;
mod cut;
mod flatness;
mod lab;
mod metrics;
mod motion;
mod pyramid;
mod raster;
mod stillness;
mod temporal;
#[cfg(test)]
mod tests;

pub use between::{halfway, is_moving};
use content::Content;
use cut::SceneView;
pub use flatness::Flatness;
pub use metrics::{explained_variation, mean_duration};
use raster::Raster;
use temporal::TemporalSuperpixels;

use crate::video::{Frame, Label, LabelPlane};

/// What labels are wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SegmentParams {
    /// Mean number of superpixels a frame, which are then the labels; 1: a single label; 0: labels are chosen by
    /// content.
    pub superpixels: u32,
    /// Chosen by content: a boundary stays where the colour jumps by this, root mean square of the channels in 8-bit
    /// levels, whatever the noise; in clean pictures, where it jumps by less.
    pub jump_levels: f32,
    /// Regions of fewer pixels are given to a neighbour, unless they jump by so much more than `jump_levels` that as much
    /// squared error goes with them.
    pub min_area_px: u32,
    /// Chosen by content: most sides of pixels between labels over pixels of a frame. From a frame with more on the slab has
    /// one label.
    pub most_border: f32,
}

impl SegmentParams {
    /// Defaults for this number of superpixels.
    pub fn new(superpixels: u32) -> Self {
        Self { superpixels, jump_levels: 60.0, min_area_px: 12, most_border: f32::INFINITY }
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

/// Divides a video into labels, frame by frame.
#[derive(Debug, Clone)]
pub struct Segmenter {
    raster: Raster,
    /// The last frame pushed, of whatever slab.
    view: Option<SceneView>,
    labeler: Labeler,
}

/// Where labels come from.
#[derive(Debug, Clone)]
enum Labeler {
    Content(Box<Content>),
    /// What every frame's labels are.
    Uniform(LabelPlane),
    Temporal(Box<TemporalSuperpixels>),
}

impl Segmenter {
    /// A segmenter for frames of this size, at the start of a slab.
    pub fn new(width: u32, height: u32, params: SegmentParams) -> Self {
        let (width, height) = (width.max(1), height.max(1));
        let raster = Raster::new(width, height);
        let labeler = match params.superpixels {
            0 => Labeler::Content(Box::new(Content::new(raster, params))),
            1 => Labeler::Uniform(LabelPlane::uniform(width, height, Label(0))),
            count => Labeler::Temporal(Box::new(TemporalSuperpixels::new(raster, count, params.min_area_px))),
        };
        Self { raster, view: None, labeler }
    }

    /// Whether `frame` shows another scene than the last frame pushed. The first frame of all does not.
    pub fn is_scene_cut(&self, frame: &Frame) -> bool {
        self.view.as_ref().is_some_and(|view| SceneView::new(frame).is_cut_from(view))
    }

    /// Forgets the labels: the next frame starts afresh, from label 0.
    pub fn start_slab(&mut self) {
        match &mut self.labeler {
            Labeler::Content(content) => content.start_slab(),
            Labeler::Uniform(_) => {}
            Labeler::Temporal(temporal) => temporal.start_slab(),
        }
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
        match &mut self.labeler {
            Labeler::Content(content) => content.push(frame),
            Labeler::Uniform(plane) => plane.clone(),
            Labeler::Temporal(temporal) => temporal.push(frame),
        }
    }
}
