//! A window of consecutive frames.

use std::collections::VecDeque;
use std::sync::Arc;

use super::Frame;

/// Consecutive frames of one slab; frame `first()` is the oldest one held. Frames are shared, not copied.
#[derive(Debug, Clone, Default)]
pub struct Volume {
    first: u32,
    frames: VecDeque<Arc<Frame>>,
}

impl Volume {
    /// An empty window whose next frame will be number `first` (frames since the slab's start).
    pub fn new(first: u32) -> Self {
        Self { first, frames: VecDeque::new() }
    }

    /// Number of the oldest frame held, in frames since the slab's start.
    pub fn first(&self) -> u32 {
        self.first
    }

    /// One past the number of the newest frame held.
    pub fn end(&self) -> u32 {
        self.first + self.frames.len() as u32
    }

    /// Appends the next frame.
    pub fn push(&mut self, frame: Arc<Frame>) {
        self.frames.push_back(frame);
    }

    /// Lets go of every frame before number `first`.
    pub fn drop_before(&mut self, first: u32) {
        while self.first < first && self.frames.pop_front().is_some() {
            self.first += 1;
        }
    }

    /// Frame number `index` (since the slab's start), if held.
    pub fn frame(&self, index: u32) -> Option<&Arc<Frame>> {
        self.frames.get(index.checked_sub(self.first)? as usize)
    }

    /// The frames held, oldest first, with their numbers.
    pub fn frames(&self) -> impl Iterator<Item = (u32, &Arc<Frame>)> {
        (self.first..).zip(self.frames.iter())
    }
}
