//! Linear colour inside a polygon, as a function of places.
//!
//! In: an outline, colours at its corners. Out: the integral over a part of a pixel ([`Shade`]), and what runs of pixels are
//! made of ([`Channels`], [`gradient`]). Forbidden here: pixels.

use glam::{Vec3A, Vec4};
use wide::f64x2;

use super::canvas::ColorSpace;
use super::coverage::Part;
use super::grid::{GridPoint, center_distance};
use super::scan::Outline;

/// The linear colour of a polygon in RGB levels: its value at a corner and how it changes a pixel to the right and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shade {
    corner: GridPoint,
    color: Vec3A,
    right: Vec3A,
    down: Vec3A,
    low: Vec3A,
    high: Vec3A,
}

impl Shade {
    /// The field that takes these colours, given in the channels of a canvas, at the corners.
    pub(super) fn new(outline: &Outline, colors: &[Vec4; 4], space: ColorSpace) -> Self {
        let colors = colors.map(|color| space.to_rgb(color));
        let (low, high) = range(&colors);
        let [right, down] = gradient(*outline, &colors.map(|color| color.extend(0.0)));
        let (right, down) = (right.to_vec3a(), down.to_vec3a());
        let (x, y) = (outline.x.to_array()[0], outline.y.to_array()[0]);
        Self { corner: GridPoint::from_px(x, y), color: colors[0], right, down, low, high }
    }

    /// The integral over a part of a pixel. The mean is the colour at the part's centroid, held within that of the
    /// corners and [0, 255].
    #[inline]
    pub(super) fn integral(&self, [column, row]: [i32; 2], part: Part) -> Vec3A {
        let [x, y] = center_distance(self.corner, column.into(), row.into());
        let area = part.area as f32;
        let right = self.right * (x * area + part.moment.x as f32);
        let down = self.down * (y * area + part.moment.y as f32);
        let levels = |color: Vec3A| color.clamp(Vec3A::ZERO, Vec3A::splat(255.0)) * area;
        (self.color * area + right + down).max(levels(self.low)).min(levels(self.high))
    }
}

#[inline]
fn range([a, b, c, d]: &[Vec3A; 4]) -> (Vec3A, Vec3A) {
    (a.min(*b).min(c.min(*d)), a.max(*b).max(c.max(*d)))
}

/// Three channels: not four, as the last would hold something and, where that is next to nothing, take long.
#[derive(Debug, Clone, Copy)]
pub(super) struct Channels {
    pub(super) pair: f64x2,
    pub(super) third: f64,
}

impl Channels {
    pub(super) const ZERO: Self = Self { pair: f64x2::ZERO, third: 0.0 };

    #[inline(always)]
    pub(super) fn new(color: Vec4) -> Self {
        Self { pair: f64x2::new([color.x.into(), color.y.into()]), third: color.z.into() }
    }

    #[inline(always)]
    pub(super) fn times(self, factor: f64) -> Self {
        Self { pair: self.pair * f64x2::splat(factor), third: self.third * factor }
    }

    #[inline(always)]
    pub(super) fn plus(self, other: Self) -> Self {
        Self { pair: self.pair + other.pair, third: self.third + other.third }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self { pair: self.pair - other.pair, third: self.third - other.third }
    }

    /// Whether all are below `limit`, whatever their signs. What is no number is not.
    #[inline(always)]
    pub(super) fn are_below(self, limit: f64) -> bool {
        self.pair.abs().simd_lt(f64x2::splat(limit)).all() && self.third.abs() < limit
    }

    /// Rounds to [`FRACTION`] digits; what is beyond 32 bits of that is cut off above. Values are below 2^31.
    #[inline(always)]
    pub(super) fn fixed(self) -> [i32; 3] {
        // Added to 1.5 * 2^52, a number's last digits are those of the integer: cheaper than a checked cast.
        const ROUND: f64 = (3u64 << 51) as f64;
        const SCALE: f64 = (1 << FRACTION) as f64;
        let [first, second] = (self.pair * f64x2::splat(SCALE) + f64x2::splat(ROUND)).to_array();
        let third = self.third * SCALE + ROUND;
        [first.to_bits() as i32, second.to_bits() as i32, third.to_bits() as i32]
    }

    fn to_vec3a(self) -> Vec3A {
        let [first, second] = self.pair.to_array();
        Vec3A::new(first as f32, second as f32, self.third as f32)
    }
}

/// How the linear field that takes these colours at the corners changes a pixel to the right and down. It follows from the
/// diagonals; a triangle's second one is a side.
#[inline(always)]
pub(super) fn gradient(outline: Outline, [a, b, c, d]: &[Vec4; 4]) -> [Channels; 2] {
    let [[ux, uy], [vx, vy]] = outline.diagonals();
    let (along_u, along_v) = (Channels::new(*c - *a), Channels::new(*d - *b));
    let scale = 1.0 / outline.double_area();
    [
        along_u.times(vy * scale).minus(along_v.times(uy * scale)),
        along_v.times(ux * scale).minus(along_u.times(vx * scale)),
    ]
}

/// Binary digits after the point of [`Channels::fixed`]. With 10 before it and a sign they fit 32 bits, in which sums may
/// overflow: where the polygon is they are right again.
pub(super) const FRACTION: u32 = 20;
