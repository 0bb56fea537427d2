//! From fine units of a slab to the pixel grid of a surface.

use std::ops::Range;

use thiserror::Error;

use super::complex::FINE_BITS;
use super::grid::{GRID_BITS, GridPoint, first_center};
use crate::mesh::Domain;

/// The part of the source picture to draw, in source pixels. It is stretched over the whole surface; what lies
/// outside of the picture is drawn black.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Viewport {
    /// Left edge.
    pub x: f64,
    /// Top edge.
    pub y: f64,
    /// Width, > 0.
    pub width: f64,
    /// Height, > 0.
    pub height: f64,
}

/// A viewport that cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("viewport: expected finite edges up to 2^20 px and sides of 2^-12 to 2^20 px, found {0:?}")]
pub struct ViewportError(pub Viewport);

impl Viewport {
    /// The whole picture of a slab.
    pub fn whole(domain: &Domain) -> Self {
        Self { x: 0.0, y: 0.0, width: f64::from(domain.width), height: f64::from(domain.height) }
    }

    /// Checks that positions stay within the arithmetic of the fill at any surface size. The smallest side, 2^-12 px,
    /// is finer than the positions themselves.
    ///
    /// # Errors
    /// Not a number, too far out, too small or too large.
    pub fn check(&self) -> Result<(), ViewportError> {
        const LARGEST: f64 = (1 << 20) as f64;
        const SMALLEST: f64 = 1.0 / (1 << 12) as f64;
        let edges = [self.x, self.y].iter().all(|edge| edge.abs() <= LARGEST);
        let sides = [self.width, self.height].iter().all(|side| (SMALLEST..=LARGEST).contains(side));
        if edges && sides { Ok(()) } else { Err(ViewportError(*self)) }
    }
}

/// The map from fine units to the pixels of a surface, and the surface's size.
#[derive(Debug, Clone)]
pub(super) struct View {
    scale: [f64; 2],
    offset: [f64; 2],
    /// Width of the surface in pixels.
    pub(super) columns: i32,
    /// Height of the surface in pixels.
    pub(super) rows: i32,
    /// Pixels whose centres show the source picture.
    pub(super) picture: Pixels,
}

/// A rectangle of pixels.
#[derive(Debug, Clone, Default)]
pub(super) struct Pixels {
    pub(super) columns: Range<i32>,
    pub(super) rows: Range<i32>,
}

impl View {
    /// `viewport` of a slab on `domain`, stretched over `width` x `height` pixels.
    pub(super) fn new(domain: &Domain, viewport: Viewport, (width, height): (u32, u32)) -> Self {
        let fine = f64::from(domain.unit()) * f64::from(1 << FINE_BITS);
        let per_pixel = [f64::from(width) / viewport.width, f64::from(height) / viewport.height];
        let mut view = Self {
            scale: per_pixel.map(|scale| scale / fine),
            offset: [viewport.x * per_pixel[0], viewport.y * per_pixel[1]],
            columns: width as i32,
            rows: height as i32,
            picture: Pixels::default(),
        };
        let far = domain.extent().truncate().as_dvec2() * f64::from(1 << FINE_BITS);
        let (first, end) = (view.grid(0.0, 0.0), view.grid(far.x, far.y));
        let shown = |first: i64, end: i64, size: i32| {
            let clamp = |v: i64| first_center(v).clamp(0, size.into()) as i32;
            clamp(first)..clamp(end)
        };
        view.picture = Pixels { columns: shown(first.x, end.x, view.columns), rows: shown(first.y, end.y, view.rows) };
        view
    }

    /// Where a point of the slice lies on the surface's grid.
    #[inline]
    pub(super) fn grid(&self, x: f64, y: f64) -> GridPoint {
        GridPoint::from_px(self.px(0, x), self.px(1, y))
    }

    /// The same of one coordinate (axis 0: x, 1: y), in pixels.
    #[inline(always)]
    pub(super) fn px(&self, axis: usize, v: f64) -> f64 {
        (v * self.scale[axis] - self.offset[axis] + SNAP) - SNAP
    }
}

/// Added to it, a number below 2^31 has [`GRID_BITS`] digits after the point left.
const SNAP: f64 = (3u64 << (51 - GRID_BITS)) as f64;

/// The plane at time `frame` (frames since the slab's first) in fine units: clamped to [half a lattice unit, the slab's
/// duration], so that it always cuts tets.
pub(super) fn plane(domain: &Domain, frame: f64) -> i32 {
    let fine = 1 << FINE_BITS;
    let (first, last) = (fine / 2, domain.extent().z * fine);
    let t = frame * f64::from(domain.unit()) * f64::from(fine);
    // NaN casts to 0.
    (t.round() as i32).clamp(first, last)
}
