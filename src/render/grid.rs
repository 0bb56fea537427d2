//! Places on a surface as integers, exact: for areas, and for turns of polygons too large for floating point.
//!
//! In: places in pixels. Out: multiples of 2^-[`GRID_BITS`] px. Forbidden here: which pixels a polygon covers.

use glam::DVec2;

/// Binary digits of the grid after the point: 2^-20 px. Snapping may turn over a triangle thinner than that; it is then
/// skipped, and a pixel whose centre lies within so thin a strip is drawn by both neighbours.
pub(super) const GRID_BITS: u32 = 20;

const ONE: i64 = 1 << GRID_BITS;
const HALF: i64 = ONE / 2;
/// Below this, the difference of two products fits 64 bits.
const NARROW: i64 = 1 << 31;

/// A position on a surface in multiples of 2^-[`GRID_BITS`] px, within +-2^60.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct GridPoint {
    pub(super) x: i64,
    pub(super) y: i64,
}

impl GridPoint {
    /// Of a place in pixels that is on the grid. Beyond 2^40 px it is cut off, far from where a sum could overflow.
    #[inline]
    pub(super) fn from_px(x: f64, y: f64) -> Self {
        const LIMIT: f64 = (1u64 << 40) as f64;
        let snap = |v: f64| (v.clamp(-LIMIT, LIMIT) * ONE as f64) as i64;
        Self { x: snap(x), y: snap(y) }
    }

    /// In pixels.
    pub(super) fn to_px(self) -> [f64; 2] {
        [self.x as f64 / ONE as f64, self.y as f64 / ONE as f64]
    }
}

/// The first row or column whose centre is at `v` or beyond.
#[inline]
pub(super) fn first_center(v: i64) -> i64 {
    (v + (HALF - 1)) >> GRID_BITS
}

/// How far a pixel's centre lies to the right of `from` and below it, in pixels. The difference is exact before it is
/// rounded, so that it is small where the gradient of a sliver is large.
#[inline]
pub(super) fn center_distance(from: GridPoint, column: i64, row: i64) -> [f32; 2] {
    const PIXEL: f32 = 1.0 / ONE as f32;
    let distance = |center: i64, from: i64| ((center << GRID_BITS) + HALF - from) as f32 * PIXEL;
    [distance(column, from.x), distance(row, from.y)]
}

/// Where a point lies from a pixel's centre (column, row), in pixels.
#[inline]
pub(super) fn center_offset(point: GridPoint, [column, row]: [i32; 2]) -> DVec2 {
    let offset = |v: i64, pixel: i32| (v - ((i64::from(pixel) << GRID_BITS) + HALF)) as f64;
    DVec2::new(offset(point.x, column), offset(point.y, row)) / ONE as f64
}

/// Whether the corners turn from +x to +y, as slices of positive tets do; false if they are in line.
#[inline]
pub(super) fn is_positive(corners: [GridPoint; 3]) -> bool {
    turn(corners) > 0
}

/// Twice the area of a triangle in units of the grid, positive if it turns from +x to +y; saturated at the ends of 64
/// bits.
#[inline]
pub(super) fn turn([a, b, c]: [GridPoint; 3]) -> i64 {
    let [ux, uy, vx, vy] = [b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y];
    if [ux, uy, vx, vy].iter().all(|d| d.abs() < NARROW) {
        ux * vy - uy * vx
    } else {
        wide_turn([ux, uy], [vx, vy]).clamp(i64::MIN.into(), i64::MAX.into()) as i64
    }
}

#[cold]
fn wide_turn(u: [i64; 2], v: [i64; 2]) -> i128 {
    let ([ux, uy], [vx, vy]) = (u.map(i128::from), v.map(i128::from));
    ux * vy - uy * vx
}
