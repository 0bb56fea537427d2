//! Which pixel centres a convex polygon covers, exactly.
//!
//! In: corners on a fixed-point grid. Out: spans of pixels. A centre on an edge belongs to the polygon below or to
//! the right of it. The column at which an edge crosses a row is a function of the edge alone, always computed from its
//! upper end; so polygons that share an edge leave no hole along it and draw no pixel twice.

use std::ops::Range;

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

/// Twice the area of a triangle in pixels, exact before it is rounded.
#[inline]
pub(super) fn double_area([a, b, c]: [GridPoint; 3]) -> f64 {
    const PIXELS: f64 = 1.0 / (1u64 << (2 * GRID_BITS)) as f64;
    match turn([a, b, c]) {
        i64::MIN | i64::MAX => wide_turn([b.x - a.x, b.y - a.y], [c.x - a.x, c.y - a.y]) as f64 * PIXELS,
        exact => exact as f64 * PIXELS,
    }
}

#[cold]
fn wide_turn(u: [i64; 2], v: [i64; 2]) -> i128 {
    let ([ux, uy], [vx, vy]) = (u.map(i128::from), v.map(i128::from));
    ux * vy - uy * vx
}

/// Rows and columns of centres within the polygon's bounds, cut to a surface of this size; `None` if there are none.
#[inline]
pub(super) fn bounds(corners: &[GridPoint], columns: i32, rows: i32) -> Option<(Range<i32>, Range<i32>)> {
    let (low, high) = hull(corners);
    let cut = |low: i64, high: i64, size: i32| {
        let first = first_center(low).max(0);
        let end = first_center(high).min(i64::from(size));
        (first < end).then_some(first as i32..end as i32)
    };
    cut(low.x, high.x, columns).zip(cut(low.y, high.y, rows))
}

/// Columns (below `columns`) and rows (among `rows`) of pixels that the polygon's bounds touch; `None` if there are
/// none.
#[inline]
pub(super) fn touched(corners: &[GridPoint], columns: i32, rows: Range<i32>) -> Option<(Range<i32>, Range<i32>)> {
    let (low, high) = hull(corners);
    let cut = |low: i64, high: i64, pixels: Range<i32>| {
        let first = (low >> GRID_BITS).max(pixels.start.into());
        let end = (-(-high >> GRID_BITS)).min(pixels.end.into());
        (first < end).then_some(first as i32..end as i32)
    };
    cut(low.x, high.x, 0..columns).zip(cut(low.y, high.y, rows))
}

/// The least and the greatest coordinates; `corners` are not empty.
#[inline]
pub(super) fn hull(corners: &[GridPoint]) -> (GridPoint, GridPoint) {
    let (mut low, mut high) = (corners[0], corners[0]);
    for corner in &corners[1..] {
        low = GridPoint { x: low.x.min(corner.x), y: low.y.min(corner.y) };
        high = GridPoint { x: high.x.max(corner.x), y: high.y.max(corner.y) };
    }
    (low, high)
}

/// Calls `span(row, columns)` for each of `rows` in which the polygon covers centres; columns are not cut to the
/// surface. It must be convex and turn from +x to +y ([`turn`]).
#[inline]
pub(super) fn scan(corners: &[GridPoint], rows: Range<i32>, mut span: impl FnMut(i32, Range<i64>)) {
    if rows.is_empty() {
        return;
    }
    let top = (1..corners.len()).fold(0, |top, i| if corners[i].y < corners[top].y { i } else { top });
    let bottom = hull(corners).1.y;
    let cut = |y: i64| first_center(y).clamp(i64::from(rows.start), i64::from(rows.end)) as i32;
    let (mut row, end) = (cut(corners[top].y), cut(bottom));
    let mut left = Side { at: top, step: corners.len() - 1, end: row, edge: Edge::default() };
    let mut right = Side { step: 1, ..left };
    while row < end {
        left.reach(corners, row);
        right.reach(corners, row);
        let stop = left.end.min(right.end).min(end);
        if stop <= row {
            return;
        }
        if left.edge.is_wide || right.edge.is_wide {
            for row in row..stop {
                let columns = left.edge.wide_column(row)..right.edge.wide_column(row);
                if !columns.is_empty() {
                    span(row, columns);
                }
            }
        } else {
            let mut at = [left.edge.at(row), right.edge.at(row)];
            for row in row..stop {
                let columns = at[0] >> EDGE_BITS..at[1] >> EDGE_BITS;
                if !columns.is_empty() {
                    span(row, columns);
                }
                at = [at[0].wrapping_add(left.edge.step), at[1].wrapping_add(right.edge.step)];
            }
        }
        row = stop;
    }
}

/// One side of a convex polygon on the way down.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// The corner that the present edge leads to.
    at: usize,
    /// What leads from a corner to the next one down, modulo the number of corners.
    step: usize,
    /// The first row beyond the present edge.
    end: i32,
    edge: Edge,
}

impl Side {
    /// Goes on to the edge that crosses `row`, if the present one does not.
    #[inline]
    fn reach(&mut self, corners: &[GridPoint], row: i32) {
        // No side has more edges than there are corners.
        for _ in 0..corners.len() {
            if self.end > row {
                return;
            }
            let upper = corners[self.at];
            self.at += self.step;
            if self.at >= corners.len() {
                self.at -= corners.len();
            }
            let lower = corners[self.at];
            // Saturates: the surface's rows are far within 32 bits.
            self.end = first_center(lower.y).clamp(i32::MIN.into(), i32::MAX.into()) as i32;
            if self.end > row {
                self.edge = Edge::new(upper, lower);
            }
        }
    }
}

/// Binary digits after the point of an edge's columns.
const EDGE_BITS: u32 = 28;

/// The first column whose centre is right of an edge or on it, row by row. A function of the edge's ends and the row
/// alone: rounding may move the line by less than 2^-13 px, but for all that share it.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    upper: GridPoint,
    /// Pixels to the right a row.
    slope: f64,
    /// The first row whose centre the edge reaches.
    first: i64,
    /// There, with [`EDGE_BITS`] digits, such that cutting them off gives the column.
    column: i64,
    /// To the next row.
    step: i64,
    /// Too long for these digits.
    is_wide: bool,
}

impl Edge {
    /// An edge from its upper to its lower end (upper.y < lower.y).
    #[inline]
    fn new(upper: GridPoint, lower: GridPoint) -> Self {
        const WIDEST: i64 = 1 << 50;
        const SHIFT: u32 = EDGE_BITS - GRID_BITS;
        let (dx, dy) = (lower.x - upper.x, lower.y - upper.y);
        let slope = dx as f64 / dy as f64;
        let first = first_center(upper.y);
        let below = ((first << GRID_BITS) + HALF - upper.y) as f64;
        // An edge that is steep this way has one row at most, and casts saturate.
        let moved = (slope * below * f64::from(1 << SHIFT)) as i64;
        let start = (upper.x << SHIFT).wrapping_add((HALF << SHIFT) - 1);
        Self {
            upper,
            slope,
            first,
            column: start.wrapping_add(moved),
            step: (slope * f64::from(1 << EDGE_BITS)) as i64,
            is_wide: dx.abs() >= WIDEST || upper.x.abs() >= WIDEST,
        }
    }

    /// Where it crosses a row, with [`EDGE_BITS`] digits.
    #[inline]
    fn at(&self, row: i32) -> i64 {
        self.column.wrapping_add(self.step.wrapping_mul(i64::from(row) - self.first))
    }

    /// The column in a row, of a wide edge.
    fn wide_column(&self, row: i32) -> i64 {
        let below = ((i64::from(row) << GRID_BITS) + HALF - self.upper.y) as f64;
        let x = self.upper.x.saturating_add((self.slope * below) as i64);
        first_center(x.clamp(-(1 << 60), 1 << 60))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cover(corners: [[i64; 2]; 3], size: i32, scale: i64) -> Vec<(i32, i32)> {
        let corners = corners.map(|[x, y]| GridPoint { x: x * scale, y: y * scale });
        assert!(is_positive(corners));
        let mut pixels = Vec::new();
        scan(&corners, 0..size, |row, columns| {
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
        let wide = Edge::new(
            GridPoint { x: -(1 << 51), y: -(1 << 51) + ONE / 3 },
            GridPoint { x: (1 << 51) + ONE / 7, y: (1 << 51) - ONE },
        );
        assert!(wide.is_wide);
        let line = |row: i64| {
            let y = (row << GRID_BITS) + HALF;
            let below = i128::from(y + (1 << 51) - ONE / 3);
            (-(1i128 << 51)
                + ((1i128 << 52) + i128::from(ONE / 7)) * below / ((1i128 << 52) - i128::from(ONE + ONE / 3)))
                as i64
        };
        for row in [-5, 0, 1, 77, 1000] {
            assert_eq!(wide.wide_column(row), first_center(line(row.into())), "row {row}");
        }
    }

    /// A row's column does not depend on the row at which an edge was entered.
    #[test]
    fn bands_of_rows_add_up() {
        let corners = [[3, 1], [97, 40], [60, 89], [11, 77]].map(|[x, y]| GridPoint { x: x * ONE / 3, y: y * ONE / 3 });
        let mut whole = Vec::new();
        scan(&corners, 0..40, |row, columns| whole.push((row, columns)));
        let mut parts = Vec::new();
        for row in 0..40 {
            scan(&corners, row..row + 1, |row, columns| parts.push((row, columns)));
        }
        assert_eq!(whole, parts);
        assert!(whole.len() > 25);
    }
}
