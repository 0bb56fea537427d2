//! Which pixel centres a convex polygon covers, exactly.
//!
//! In: corners on the grid. Out: spans of pixels, four rows at a time. A centre on an edge belongs to the polygon below
//! or to the right of it. The column at which an edge crosses a row is a function of the edge and the row alone, always
//! computed from its upper end; so polygons that share an edge leave no hole along it and draw no pixel twice.
//!
//! Most polygons cover a few pixels in a few rows, so nothing here branches: the corners of a polygon, or its rows, lie
//! side by side in a register.

use std::ops::Range;

use wide::{f64x2, f64x4};

use super::grid::{GridPoint, turn};

/// Rows that are looked at together.
pub(super) const ROWS: usize = 4;

const ZERO: f64x4 = f64x4::ZERO;
const ONE: f64x4 = f64x4::new([1.0; 4]);
const HALF: f64x4 = f64x4::new([0.5; 4]);
/// What [`ROWS`] rows are from their first on.
const STEPS: f64x4 = f64x4::new([0.0, 1.0, 2.0, 3.0]);

/// Rounds up. Values are below 2^51, or what comes out is as large.
#[inline(always)]
fn ceil(v: f64x4) -> f64x4 {
    // Added to it, a number has no digits after the point left.
    const WHOLE: f64x4 = f64x4::new([(3u64 << 51) as f64; 4]);
    let near = (v + WHOLE) - WHOLE;
    near + (near.simd_lt(v) & ONE)
}

/// The values of the corners that follow.
#[inline(always)]
fn next(v: f64x4) -> f64x4 {
    let [a, b, c, d] = v.to_array();
    f64x4::new([b, c, d, a])
}

/// Corners of a polygon in pixels, multiples of 2^-[`super::grid::GRID_BITS`]. A triangle's last corner stands twice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outline {
    pub(super) x: f64x4,
    pub(super) y: f64x4,
}

/// The least and the greatest coordinates of an outline, (x, y) each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hull {
    low: f64x2,
    high: f64x2,
}

/// Where on a surface a polygon is seen. Neither rows nor columns are empty.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    /// The first column.
    pub(super) column: i32,
    pub(super) rows: Range<i32>,
}

impl Hull {
    /// Of corners (x, y).
    #[inline(always)]
    pub(super) fn new([a, b, c, d]: [f64x2; 4]) -> Self {
        // Nothing here is no number, so there is no need to ask.
        Self { low: a.fast_min(b).fast_min(c.fast_min(d)), high: a.fast_max(b).fast_max(c.fast_max(d)) }
    }

    /// The larger side, in pixels.
    #[inline(always)]
    pub(super) fn extent(&self) -> f64 {
        let [width, height] = (self.high - self.low).to_array();
        if width > height { width } else { height }
    }

    /// Where there are centres within, cut to a surface of this size; `None` if there are none.
    #[inline(always)]
    pub(super) fn centers(&self, size: [i32; 2]) -> Option<Seen> {
        let half = f64x2::splat(0.5);
        Self::cut(self.low - half, self.high - half, size)
    }

    /// Where it touches pixels, cut to a surface of this size; `None` if it touches none.
    #[inline(always)]
    pub(super) fn pixels(&self, size: [i32; 2]) -> Option<Seen> {
        // The first pixel is the last whose upper left corner is at or before it.
        let first = -ceil(join(-self.low, self.high));
        let [column, row, ..] = first.to_array();
        Self::cut(f64x2::new([column, row]), self.high, size)
    }

    /// Columns (below `columns`) and rows (among `rows`) of the pixels that it touches; `None` if there are none.
    #[inline]
    pub(super) fn touched(&self, columns: i32, rows: &Range<i32>) -> Option<(Range<i32>, Range<i32>)> {
        let [left, top, right, bottom] = ceil(join(-self.low, self.high)).to_array();
        let (left, right) = ((-left).max(0.0), right.min(columns.into()));
        let (top, bottom) = ((-top).max(rows.start.into()), bottom.min(rows.end.into()));
        let is_seen = left < right && top < bottom;
        is_seen.then(|| (whole(left)..whole(right), whole(top)..whole(bottom)))
    }

    /// What of columns and rows, rounded up, lies on the surface.
    #[inline(always)]
    fn cut(first: f64x2, end: f64x2, [columns, rows]: [i32; 2]) -> Option<Seen> {
        let size = f64x2::new([columns.into(), rows.into()]);
        let cut = ceil(join(first, end)).fast_max(ZERO).fast_min(join(size, size));
        let [column, row, end_column, end_row] = cut.to_array();
        if column < end_column && row < end_row {
            return Some(Seen { column: whole(column), rows: whole(row)..whole(end_row) });
        }
        None
    }
}

#[inline(always)]
fn join(low: f64x2, high: f64x2) -> f64x4 {
    let ([a, b], [c, d]) = (low.to_array(), high.to_array());
    f64x4::new([a, b, c, d])
}

/// A whole number below 2^31 that is not negative.
#[inline(always)]
fn whole(v: f64) -> i32 {
    // Added to 2^52, a number's last digits are those of the integer.
    (v + (1u64 << 52) as f64).to_bits() as i32
}

impl Outline {
    pub(super) const NOTHING: Self = Self { x: ZERO, y: ZERO };

    /// Below this, in pixels, products of differences are exact.
    const SMALL: f64 = 64.0;

    /// Of corners (x, y).
    #[inline(always)]
    pub(super) fn of_places([a, b, c, d]: [f64x2; 4]) -> Self {
        let ([ab_x, ab_y], [cd_x, cd_y]) = (f64x2::transpose([a, b]), f64x2::transpose([c, d]));
        Self { x: join(ab_x, cd_x), y: join(ab_y, cd_y) }
    }

    /// Of three or four corners.
    pub(super) fn new(corners: &[GridPoint]) -> Self {
        let [x, y]: [[f64; 4]; 2] =
            std::array::from_fn(|axis| std::array::from_fn(|i| corners[i.min(corners.len() - 1)].to_px()[axis]));
        Self { x: f64x4::new(x), y: f64x4::new(y) }
    }

    /// The corners in order.
    #[inline]
    pub(super) fn corners(&self) -> [GridPoint; 4] {
        let (x, y) = (self.x.to_array(), self.y.to_array());
        std::array::from_fn(|i| GridPoint::from_px(x[i], y[i]))
    }

    /// What it extends over.
    pub(super) fn hull(&self) -> Hull {
        let (x, y) = (self.x.to_array(), self.y.to_array());
        Hull::new(std::array::from_fn(|i| f64x2::new([x[i], y[i]])))
    }

    /// From the first corner to the third, and from the second to the fourth: (x, y) each.
    #[inline(always)]
    pub(super) fn diagonals(self) -> [[f64; 2]; 2] {
        let ([ax, bx, cx, dx], [ay, by, cy, dy]) = (self.x.to_array(), self.y.to_array());
        [[cx - ax, cy - ay], [dx - bx, dy - by]]
    }

    /// Twice the area, positive if it turns from +x to +y; its sign is exact where [`Self::SMALL`] says so.
    #[inline(always)]
    pub(super) fn double_area(self) -> f64 {
        let [u, v] = self.diagonals();
        u[0] * v[1] - u[1] * v[0]
    }

    /// Whether it has an area, turns from +x to +y and is convex, exactly.
    #[inline(always)]
    pub(super) fn is_convex(self, extent: f64) -> bool {
        if extent >= Self::SMALL {
            return self.is_convex_and_large();
        }
        let (ex, ey) = (next(self.x) - self.x, next(self.y) - self.y);
        let turns = ex * next(ey) - ey * next(ex);
        !turns.simd_lt(ZERO).any() && self.double_area() > 0.0
    }

    #[cold]
    fn is_convex_and_large(self) -> bool {
        let [a, b, c, d] = self.corners();
        let halves = [turn([a, b, c]), turn([a, c, d])];
        halves[0] >= 0 && halves[1] >= 0 && halves != [0, 0] && turn([b, c, d]) >= 0 && turn([d, a, b]) >= 0
    }
}

/// The edges of a convex polygon that turns from +x to +y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edges {
    /// Upper ends, half a pixel to the left: columns count from centres.
    x: [f64; 4],
    y: [f64; 4],
    /// Pixels to the right a row; of no meaning where an edge reaches no centre.
    slope: [f64; 4],
    /// The first row whose centre is at a corner or below it.
    first: [f64; 4],
}

impl Edges {
    #[inline]
    pub(super) fn new(Outline { x, y }: Outline) -> Self {
        let (next_x, next_y) = (next(x), next(y));
        let upper_x = next_y.simd_lt(y).bitselect(next_x, x);
        Self {
            x: (upper_x - HALF).to_array(),
            y: next_y.fast_min(y).to_array(),
            slope: ((next_x - x) / (next_y - y)).to_array(),
            first: ceil(y - HALF).to_array(),
        }
    }

    /// What lies between the edges in the rows from `row` on, on a surface `width` pixels wide.
    #[inline]
    pub(super) fn spans(&self, row: i32, width: i32) -> [Span; ROWS] {
        let rows = f64x4::splat(row.into()) + STEPS;
        let centers = rows + HALF;
        let below = |corner: usize| rows.simd_ge(f64x4::splat(self.first[corner]));
        let below = [below(0), below(1), below(2), below(3)];
        let (mut left, mut right) = (ZERO, ZERO);
        for i in 0..4 {
            let at = (centers - f64x4::splat(self.y[i])) * f64x4::splat(self.slope[i]) + f64x4::splat(self.x[i]);
            // Rows that an edge crosses are below one end of it alone; edges on the right go down.
            let (from, to) = (below[i], below[(i + 1) % 4]);
            right |= at & (from & !to);
            left |= at & (to & !from);
        }
        let cut = |v: f64x4| ceil(v).fast_max(ZERO).fast_min(f64x4::splat(width.into()));
        Span::pack(cut(left), cut(right))
    }
}

/// Columns of a row: the first in the lower half, the end in the upper one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span(u32);

impl Span {
    pub(super) const EMPTY: Self = Self(0);

    /// Of whole numbers below 2^16.
    #[inline]
    fn pack(first: f64x4, end: f64x4) -> [Self; ROWS] {
        const UPPER: f64x4 = f64x4::new([65536.0; 4]);
        // Added to 2^52, a number's last digits are those of the integer.
        const WHOLE: f64x4 = f64x4::new([(1u64 << 52) as f64; 4]);
        let [a, b, c, d] = (first + end * UPPER + WHOLE).to_array();
        let span = |v: f64| Self(v.to_bits() as u32);
        [span(a), span(b), span(c), span(d)]
    }

    /// Of these columns, below 2^16.
    #[cfg(test)]
    pub(super) fn of(columns: Range<usize>) -> Self {
        Self((columns.start | columns.end << 16) as u32)
    }

    /// Whether none of these has a column.
    #[inline(always)]
    pub(super) fn are_empty(spans: &[Self; ROWS]) -> bool {
        let has = |span: Self| span.0 >> 16 > span.0 & 0xffff;
        !(has(spans[0]) | has(spans[1]) | has(spans[2]) | has(spans[3]))
    }

    /// Any number, in the place of columns.
    #[inline]
    pub(super) fn number(number: u32) -> Self {
        Self(number)
    }

    /// What [`Self::number`] was given.
    #[inline]
    pub(super) fn to_number(self) -> u32 {
        self.0
    }

    /// The columns; none if the end is not beyond the first.
    #[inline]
    pub(super) fn columns(self) -> Range<usize> {
        (self.0 & 0xffff) as usize..(self.0 >> 16) as usize
    }
}

/// Calls `span(row, columns)` for each of `rows` in which a convex polygon that turns from +x to +y covers centres of a
/// surface `width` pixels wide.
#[inline]
pub(super) fn scan(outline: &Outline, width: i32, rows: Range<i32>, mut span: impl FnMut(i32, Range<usize>)) {
    let edges = Edges::new(*outline);
    for first in rows.clone().step_by(ROWS) {
        for (row, found) in (first..rows.end).zip(edges.spans(first, width)) {
            let columns = found.columns();
            if !columns.is_empty() {
                span(row, columns);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::{GRID_BITS, is_positive};
    use super::*;

    const ONE: i64 = 1 << GRID_BITS;

    fn cover(corners: [[i64; 2]; 3], size: i32, scale: i64) -> Vec<(i32, i32)> {
        let corners = corners.map(|[x, y]| GridPoint { x: x * scale, y: y * scale });
        assert!(is_positive(corners));
        let mut pixels = Vec::new();
        scan(&Outline::new(&corners), size, 0..size, |row, columns| {
            pixels.extend(columns.map(|x| (x as i32, row)));
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

    /// Columns are those of the line, as exactly as its slope allows, also of edges far longer than a surface.
    #[test]
    fn columns_are_those_of_the_line() {
        for shift in [0, 10, 20, 28] {
            let [dx, dy] = [(7 * ONE + 3) << shift, (5 * ONE + 1) << shift];
            let upper = GridPoint { x: 40 * ONE + 11 - dx / 2, y: 30 * ONE + 7 - dy / 2 };
            let lower = GridPoint { x: upper.x + dx, y: upper.y + dy };
            let outline = Outline::new(&[upper, GridPoint { x: 2 * lower.x - upper.x, y: upper.y }, lower]);
            let first = if shift == 0 { 28 } else { 0 };
            for row in (first..32).step_by(ROWS) {
                for (row, span) in (row..).zip(Edges::new(outline).spans(row, 1000)) {
                    let below = i128::from((i64::from(row) << GRID_BITS) + ONE / 2 - upper.y);
                    let line = upper.x + (i128::from(dx) * below / i128::from(dy)) as i64;
                    if (line - ONE / 2 + 2) & (ONE - 1) < 4 {
                        // Too close to a centre for the rounding of this line.
                        continue;
                    }
                    let expected = ((line + ONE / 2 - 1) >> GRID_BITS).max(0);
                    assert_eq!(span.columns().start as i64, expected, "shift {shift}, row {row}");
                }
            }
        }
    }

    /// A row's columns do not depend on the rows that they are looked up with.
    #[test]
    fn bands_of_rows_add_up() {
        let corners = [[3, 1], [97, 40], [60, 89], [11, 77]].map(|[x, y]| GridPoint { x: x * ONE / 3, y: y * ONE / 3 });
        let outline = Outline::new(&corners);
        let mut whole = Vec::new();
        scan(&outline, 40, 0..40, |row, columns| whole.push((row, columns)));
        let mut parts = Vec::new();
        for row in 0..40 {
            scan(&outline, 40, row..row + 1, |row, columns| parts.push((row, columns)));
        }
        assert_eq!(whole, parts);
        assert!(whole.len() > 25);
    }

    /// In floating point where polygons are small, in integers where they are not: the same answer.
    #[test]
    fn convex_is_exact_at_every_size() {
        let mut seed = 5u64;
        let mut random = |end: i64| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as i64 % end
        };
        let mut seen = [0; 2];
        for n in 0..4000 {
            // Close to a line, so that turns are as often 0 or barely something else.
            let along = [1, 1 << 10, ONE][n % 3];
            let mut corner = || GridPoint { x: along * random(40) + random(2), y: along * random(40) / 7 + random(2) };
            let corners = [corner(), corner(), corner(), corner()];
            let outline = Outline::new(&corners);
            let found = outline.is_convex(outline.hull().extent());
            assert_eq!(found, outline.is_convex_and_large(), "{corners:?}");
            seen[usize::from(found)] += 1;
        }
        assert!(seen[1] > 100 && seen[0] > 100, "{seen:?}");
    }
}
