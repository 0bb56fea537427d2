//! Labels: which region (temporal superpixel, or a merger of several) a pixel or a tet belongs to.

use std::sync::Arc;

use super::Frame;

/// A region of the video that persists through time within a slab. Colour may jump only between labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Default)]
pub struct Label(pub u32);

/// A label for every pixel of one frame, row-major. Clones share their labels.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelPlane {
    width: u32,
    height: u32,
    labels: Arc<[Label]>,
    pure: Option<Arc<Frame>>,
}

impl LabelPlane {
    /// Wraps `labels`, row-major; panics unless there are `width * height` of them.
    pub fn new(width: u32, height: u32, labels: Vec<Label>) -> Self {
        assert_eq!(labels.len(), width as usize * height as usize, "one label a pixel");
        Self { width, height, labels: labels.into(), pure: None }
    }

    /// A plane of one label.
    pub fn uniform(width: u32, height: u32, label: Label) -> Self {
        Self::new(width, height, vec![label; width as usize * height as usize])
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Whether all pixels have one label.
    pub fn is_uniform(&self) -> bool {
        self.labels.iter().all(|label| *label == self.labels[0])
    }

    /// The same with the colour that each pixel's label has there where no other shows through; panics if the frame has
    /// another size.
    #[must_use]
    pub fn with_pure_colors(mut self, pure: Frame) -> Self {
        assert_eq!((pure.width(), pure.height()), (self.width, self.height), "one colour a pixel");
        self.pure = Some(Arc::new(pure));
        self
    }

    /// The colour that each pixel's label has there where no other shows through, if that is known.
    pub fn pure_colors(&self) -> Option<&Arc<Frame>> {
        self.pure.as_ref()
    }

    /// All labels, row-major.
    pub fn labels(&self) -> &[Label] {
        &self.labels
    }

    /// The label of pixel (x, y).
    pub fn label(&self, x: u32, y: u32) -> Label {
        self.labels[y as usize * self.width as usize + x as usize]
    }
}
