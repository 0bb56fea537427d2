//! Which pixel centres a triangle covers, exactly.
//!
//! In: corners on a fixed-point grid. Out: spans of pixels. A centre on an edge belongs to the triangle below or to
//! the right of it. The column at which an edge crosses a row is a function of the edge alone, always computed from its
//! upper end; so triangles that share an edge leave no hole along it and draw no pixel twice.

use std::ops::Range;

use glam::DVec2;

/// Binary digits of the grid after the point: 2^-20 px. Snapping may turn over a triangle thinner than that; it is then
/// skipped, and a pixel whose centre lies within so thin a strip is drawn by both neighbours.
pub(super) const GRID_BITS: u32 = 20;

const ONE: i64 = 1 << GRID_BITS;
const HALF: i64 = ONE / 2;
/// Below this, products of two differences and the carries on top of them fit 64 bits.
const NARROW: i64 = 1 << 31;

/// A position on a surface in multiples of 2^-[`GRID_BITS`] px, within +-2^60.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(super) struct GridPoint {
    pub(super) x: i64,
    pub(super) y: i64,
}

impl GridPoint {
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
pub(super) fn is_positive([a, b, c]: [GridPoint; 3]) -> bool {
    let [ux, uy, vx, vy] = [b.x - a.x, b.y - a.y, c.x - a.x, c.y - a.y];
    if [ux, uy, vx, vy].iter().all(|d| d.abs() < NARROW) {
        ux * vy - uy * vx > 0
    } else {
        let [ux, uy, vx, vy] = [ux, uy, vx, vy].map(i128::from);
        ux * vy - uy * vx > 0
    }
}

/// Rows and columns of centres within the triangle's bounds, cut to a surface of this size; `None` if there are none.
#[inline]
pub(super) fn bounds(corners: &[GridPoint; 3], columns: i32, rows: i32) -> Option<Range<i32>> {
    let cut = |values: [i64; 3], size: i32| {
        let first = first_center(values[0].min(values[1]).min(values[2])).max(0);
        let end = first_center(values[0].max(values[1]).max(values[2])).min(i64::from(size));
        (first < end).then_some(first as i32..end as i32)
    };
    cut(corners.map(|c| c.x), columns)?;
    cut(corners.map(|c| c.y), rows)
}

/// Columns (below `columns`) and rows (among `rows`) of pixels that the triangle's bounds touch; `None` if there are
/// none.
#[inline]
pub(super) fn touched(corners: &[GridPoint; 3], columns: i32, rows: Range<i32>) -> Option<(Range<i32>, Range<i32>)> {
    let cut = |values: [i64; 3], pixels: Range<i32>| {
        let first = (values[0].min(values[1]).min(values[2]) >> GRID_BITS).max(pixels.start.into());
        let end = (-(-values[0].max(values[1]).max(values[2]) >> GRID_BITS)).min(pixels.end.into());
        (first < end).then_some(first as i32..end as i32)
    };
    cut(corners.map(|c| c.x), 0..columns).zip(cut(corners.map(|c| c.y), rows))
}

/// Calls `span(row, columns)` for each of `rows` in which the triangle covers centres; columns are not cut to the
/// surface. Corners must be positive ([`is_positive`]).
#[inline]
pub(super) fn scan(corners: [GridPoint; 3], rows: Range<i32>, mut span: impl FnMut(i32, Range<i64>)) {
    if rows.is_empty() {
        return;
    }
    let [mut top, mut middle, mut bottom] = corners;
    let mut long_is_left = true;
    for _ in 0..2 {
        if middle.y < top.y {
            (top, middle) = (middle, top);
            long_is_left = !long_is_left;
        }
        if bottom.y < middle.y {
            (middle, bottom) = (bottom, middle);
            long_is_left = !long_is_left;
        }
    }
    let cut = |y: i64| first_center(y).clamp(i64::from(rows.start), i64::from(rows.end)) as i32;
    let (first, turn, end) = (cut(top.y), cut(middle.y), cut(bottom.y));
    if first == end {
        return;
    }
    let mut long = Edge::new(top, bottom, first);
    for (upper, lower, rows) in [(top, middle, first..turn), (middle, bottom, turn..end)] {
        if rows.is_empty() {
            continue;
        }
        let mut short = Edge::new(upper, lower, rows.start);
        for row in rows {
            let (long, short) = (long.next(), short.next());
            let columns = if long_is_left { long..short } else { short..long };
            if !columns.is_empty() {
                span(row, columns);
            }
        }
    }
}

/// The first column right of an edge, row after row.
enum Edge {
    /// Carries quotient and remainder from row to row: column = floor of an exact fraction with this denominator.
    Narrow { column: i64, rest: i64, step: i64, step_rest: i64, den: i64 },
    /// Divides in every row; for edges so long that the fraction does not fit 64 bits.
    Wide { upper: GridPoint, dx: i128, dy: i128, row: i32 },
}

impl Edge {
    /// An edge from its upper to its lower end (upper.y < lower.y), at a row between them.
    #[inline]
    fn new(upper: GridPoint, lower: GridPoint, row: i32) -> Self {
        let (dx, dy) = (lower.x - upper.x, lower.y - upper.y);
        if dx.abs() >= NARROW || dy >= NARROW {
            return Self::Wide { upper, dx: dx.into(), dy: dy.into(), row };
        }
        let (base, fraction) = ((upper.x - HALF) >> GRID_BITS, (upper.x - HALF) & (ONE - 1));
        let den = dy << GRID_BITS;
        let below = (i64::from(row) << GRID_BITS) + HALF - upper.y;
        let ceiling = fraction * dy + dx * below + (den - 1);
        Self::Narrow {
            column: base + ceiling.div_euclid(den),
            rest: ceiling.rem_euclid(den),
            step: dx.div_euclid(dy),
            step_rest: dx.rem_euclid(dy) << GRID_BITS,
            den,
        }
    }

    /// The column in the present row; moves on to the next row.
    #[inline]
    fn next(&mut self) -> i64 {
        match self {
            Self::Narrow { column, rest, step, step_rest, den } => {
                let here = *column;
                *rest += *step_rest;
                let carry = *rest >= *den;
                *rest -= if carry { *den } else { 0 };
                *column += *step + i64::from(carry);
                here
            }
            Self::Wide { upper, dx, dy, row } => {
                let below = i128::from((i64::from(*row) << GRID_BITS) + HALF - upper.y);
                *row += 1;
                let den = *dy << GRID_BITS;
                let numerator = i128::from(upper.x - HALF) * *dy + *dx * below;
                (numerator + (den - 1)).div_euclid(den) as i64
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cover(corners: [[i64; 2]; 3], size: i32, scale: i64) -> Vec<(i32, i32)> {
        let corners = corners.map(|[x, y]| GridPoint { x: x * scale, y: y * scale });
        assert!(is_positive(corners));
        let mut pixels = Vec::new();
        scan(corners, 0..size, |row, columns| {
            pixels.extend((columns.start.max(0)..columns.end.min(i64::from(size))).map(|x| (x as i32, row)));
        });
        pixels
    }

    #[test]
    fn halves_of_a_square_share_its_pixels() {
        let upper = cover([[0, 0], [8, 0], [8, 8]], 8, ONE);
        let lower = cover([[0, 0], [8, 8], [0, 8]], 8, ONE);
        assert_eq!(upper.len() + lower.len(), 64);
        assert_eq!(upper.len(), 36, "centres on the diagonal lie on the left edge of the upper right half");
        assert!(upper.iter().all(|pixel| !lower.contains(pixel)));
    }

    #[test]
    fn corner_on_a_centre_belongs_to_the_pixel_below_and_right() {
        // From centre (1, 1) to centre (3, 3): left and top included, right and bottom not.
        let half = ONE / 2;
        assert_eq!(cover([[3, 3], [7, 3], [7, 7]], 8, half), [(1, 1), (2, 1), (2, 2)]);
    }

    /// Long edges take the other arithmetic; a neighbour sees the same long edge, but the columns must also be right.
    #[test]
    fn wide_edges_agree_with_narrow_ones() {
        let narrow = cover([[1, 2], [900, 301], [17, 700]], 800, ONE);
        // The same triangle within a far larger one that has two of its edges on the same lines.
        let wide = Edge::new(GridPoint { x: ONE, y: 2 * ONE }, GridPoint { x: 8990 * ONE + ONE, y: 2992 * ONE }, 2);
        assert!(matches!(wide, Edge::Wide { .. }));
        let mut wide = wide;
        let mut near = Edge::new(GridPoint { x: ONE, y: 2 * ONE }, GridPoint { x: 900 * ONE, y: 301 * ONE }, 2);
        for row in 2..301 {
            assert_eq!(wide.next(), near.next(), "row {row}");
        }
        assert!(narrow.len() > 1000);
    }
}
