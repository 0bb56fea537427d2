//! The planes of time at which the frames lie.
//!
//! In: a model's box and the frames. Out: which frames a tet or a face meets, and at which times.

use glam::{DVec3, IVec3};

use super::model::Model;
use crate::video::Volume;

/// The slices at which the frames lie.
pub(super) struct Planes<'a> {
    pub(super) frames: &'a Volume,
    /// Fine units in a pixel or a frame.
    unit: f64,
    /// The plane of the slab's first frame, in frames: half a lattice unit, as the renderer clamps it.
    first: f64,
    /// The slab's end, in frames.
    end: f64,
}

impl<'a> Planes<'a> {
    pub(super) fn new(model: &Model, frames: &'a Volume) -> Self {
        let half_lattice_unit = 0.5 / f64::from(model.domain.unit());
        let end = f64::from(model.domain.duration);
        Self { frames, unit: f64::from(model.fine_unit), first: half_lattice_unit, end }
    }

    /// From fine units to pixels and frames.
    pub(super) fn to_px(&self, point: IVec3) -> DVec3 {
        point.as_dvec3() / self.unit
    }

    /// The frames whose planes meet what has these corners (pixels and frames).
    pub(super) fn range(&self, corners: &[DVec3]) -> std::ops::Range<u32> {
        let low = corners.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        if high < self.first {
            return 0..0;
        }
        let first = if low < self.first { 0.0 } else { low.ceil() };
        let last = high.floor().min(self.end);
        (first as u32).max(self.frames.first())..(last as u32 + 1).min(self.frames.end())
    }

    /// The time at which frame `k` is drawn.
    pub(super) fn time(&self, k: u32) -> f64 {
        f64::from(k).max(self.first)
    }
}
