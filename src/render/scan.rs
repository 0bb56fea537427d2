//! Which pixel centres a convex polygon covers, exactly.
//!
//! In: corners on the grid. Out: spans of pixels. A centre on an edge belongs to the polygon below or to the right of it.
//! The column at which an edge crosses a row is a function of the edge and the row alone, always computed from its upper
//! end; so polygons that share an edge leave no hole along it and draw no pixel twice.
//!
//! What is computed of edges and rows does not branch, so that many of one or of the other go side by side.

use std::ops::Range;

use super::grid::{GridPoint, turn};
use super::lanes::{ceil, least, most, whole};

/// Rows that are looked at together.
pub(super) const ROWS: usize = 4;

/// Corners of a polygon in pixels, multiples of 2^-[`super::grid::GRID_BITS`]. A triangle's last corner stands twice.
#[derive(Debug, Clone, Copy)]
pub(super) struct Outline {
    pub(super) x: [f64; 4],
    pub(super) y: [f64; 4],
}

/// The least and the greatest coordinates of an outline, (x, y) each.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hull {
    low: [f64; 2],
    high: [f64; 2],
}

/// Columns and rows of a surface.
pub(super) type Area = (Range<i32>, Range<i32>);

impl Hull {
    /// Where there are centres within, of a surface of so many columns and rows; `None` if there are none.
    #[inline]
    pub(super) fn centers(&self, columns: i32, rows: Range<i32>) -> Option<Area> {
        let first = |low: f64| ceil(low - 0.5);
        cut(self.low.map(first), self.high.map(first), columns, rows)
    }

    /// Columns (below `columns`) and rows (among `rows`) of the pixels that it touches; `None` if there are none.
    #[inline]
    pub(super) fn touched(&self, columns: i32, rows: Range<i32>) -> Option<Area> {
        cut(self.low.map(|low| -ceil(-low)), self.high.map(ceil), columns, rows)
    }
}

/// What of columns and rows, (first, end) of each, lies on a surface.
#[inline]
fn cut(first: [f64; 2], end: [f64; 2], columns: i32, rows: Range<i32>) -> Option<Area> {
    let (left, right) = (most(first[0], 0.0), least(end[0], columns.into()));
    let (top, bottom) = (most(first[1], rows.start.into()), least(end[1], rows.end.into()));
    let is_seen = left < right && top < bottom;
    is_seen.then(|| (whole(left) as i32..whole(right) as i32, whole(top) as i32..whole(bottom) as i32))
}

impl Outline {
    pub(super) const NOTHING: Self = Self { x: [0.0; 4], y: [0.0; 4] };

    /// Of three or four corners.
    pub(super) fn new(corners: &[GridPoint]) -> Self {
        let [x, y]: [[f64; 4]; 2] =
            std::array::from_fn(|axis| std::array::from_fn(|i| corners[i.min(corners.len() - 1)].to_px()[axis]));
        Self { x, y }
    }

    /// The corners in order.
    #[inline]
    pub(super) fn corners(&self) -> [GridPoint; 4] {
        std::array::from_fn(|i| GridPoint::from_px(self.x[i], self.y[i]))
    }

    /// What it extends over.
    #[inline]
    pub(super) fn hull(&self) -> Hull {
        let low = |[a, b, c, d]: [f64; 4]| least(least(a, b), least(c, d));
        let high = |[a, b, c, d]: [f64; 4]| most(most(a, b), most(c, d));
        Hull { low: [low(self.x), low(self.y)], high: [high(self.x), high(self.y)] }
    }

    /// Whether it has an area, turns from +x to +y and is convex, exactly, however large it is.
    #[cold]
    pub(super) fn is_convex(&self) -> bool {
        let [a, b, c, d] = self.corners();
        let halves = [turn([a, b, c]), turn([a, c, d])];
        halves[0] >= 0 && halves[1] >= 0 && halves != [0, 0] && turn([b, c, d]) >= 0 && turn([d, a, b]) >= 0
    }
}

/// How a polygon turns.
#[derive(Debug, Clone, Copy)]
pub(super) struct Turning {
    /// From the first corner to the third, and from the second to the fourth: (x, y) each.
    pub(super) diagonals: [[f64; 2]; 2],
    /// Twice the area, positive if it turns from +x to +y.
    pub(super) double_area: f64,
    /// Whether it has an area, turns from +x to +y and is convex: exactly, if its sides are shorter than
    /// [`Self::SMALL`].
    pub(super) is_convex: bool,
}

impl Turning {
    /// Below this, in pixels, products of differences are exact.
    pub(super) const SMALL: f64 = 64.0;

    /// Of a polygon with these corners.
    #[inline(always)]
    pub(super) fn new(x: [f64; 4], y: [f64; 4]) -> Self {
        let ([ux, uy], [vx, vy]) = ([x[2] - x[0], y[2] - y[0]], [x[3] - x[1], y[3] - y[1]]);
        let double_area = ux * vy - uy * vx;
        let side = |i: usize| [x[(i + 1) % 4] - x[i], y[(i + 1) % 4] - y[i]];
        let sides = [side(0), side(1), side(2), side(3)];
        let turn = |i: usize| sides[i][0] * sides[(i + 1) % 4][1] - sides[i][1] * sides[(i + 1) % 4][0];
        let sharpest = least(least(turn(0), turn(1)), least(turn(2), turn(3)));
        let is_convex = (sharpest >= 0.0) & (double_area > 0.0);
        Self { diagonals: [[ux, uy], [vx, vy]], double_area, is_convex }
    }
}

/// An edge of a convex polygon that turns from +x to +y.
#[derive(Debug, Clone, Copy)]
pub(super) struct Edge {
    /// The upper end, half a pixel to the left: columns count from centres.
    pub(super) x: f64,
    pub(super) y: f64,
    /// Pixels to the right a row; of no meaning where the edge reaches no centre.
    pub(super) slope: f64,
    /// The first row whose centre is at its first corner or below it.
    pub(super) first: f64,
}

impl Edge {
    /// From one corner to the next.
    #[inline(always)]
    pub(super) fn new([x, y]: [f64; 2], [next_x, next_y]: [f64; 2]) -> Self {
        Self {
            x: if next_y < y { next_x } else { x } - 0.5,
            y: least(next_y, y),
            slope: (next_x - x) / (next_y - y),
            first: ceil(y - 0.5),
        }
    }

    /// All of a polygon.
    #[inline(always)]
    pub(super) fn all(Outline { x, y }: &Outline) -> [Self; 4] {
        let edge = |i: usize| Self::new([x[i], y[i]], [x[(i + 1) % 4], y[(i + 1) % 4]]);
        [edge(0), edge(1), edge(2), edge(3)]
    }
}

/// What lies between the edges of a polygon in a row, on a surface `width` pixels wide.
#[inline(always)]
pub(super) fn span(edges: &[Edge; 4], row: f64, width: f64) -> Span {
    let center = row + 0.5;
    let below = [0, 1, 2, 3].map(|corner| row >= edges[corner].first);
    let (mut left, mut right) = (0.0, 0.0);
    for (i, edge) in edges.iter().enumerate() {
        let at = (center - edge.y) * edge.slope + edge.x;
        // Rows that an edge crosses are below one end of it alone; edges on the right go down.
        let (from, to) = (below[i], below[(i + 1) % 4]);
        right = if from & !to { at } else { right };
        left = if to & !from { at } else { left };
    }
    let cut = |v: f64| least(most(ceil(v), 0.0), width);
    Span(whole(cut(left) + cut(right) * 65536.0))
}

/// [`span`] of the rows from `row` on.
#[inline(always)]
pub(super) fn spans<const COUNT: usize>(edges: &[Edge; 4], row: i32, width: i32) -> [Span; COUNT] {
    let (row, width) = (f64::from(row), f64::from(width));
    let mut spans = [Span::EMPTY; COUNT];
    for (i, place) in spans.iter_mut().enumerate() {
        *place = span(edges, row + i as f64, width);
    }
    spans
}

/// Columns of a row, below 2^16: the first in the lower half, the end in the upper one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span(u32);

impl Span {
    pub(super) const EMPTY: Self = Self(0);

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

    /// The first column, and the one beyond the last; none if it is not beyond the first.
    #[inline(always)]
    pub(super) fn ends(self) -> (u32, u32) {
        (self.0 & 0xffff, self.0 >> 16)
    }

    /// The columns; none if the end is not beyond the first.
    #[inline]
    pub(super) fn columns(self) -> Range<usize> {
        (self.0 & 0xffff) as usize..(self.0 >> 16) as usize
    }
}

/// Calls `take(row, columns)` for each of `rows` in which a convex polygon that turns from +x to +y covers centres of a
/// surface `width` pixels wide.
#[inline]
pub(super) fn scan(outline: &Outline, width: i32, rows: Range<i32>, mut take: impl FnMut(i32, Range<usize>)) {
    let edges = Edge::all(outline);
    for first in rows.clone().step_by(ROWS) {
        for (row, found) in (first..rows.end).zip(spans::<ROWS>(&edges, first, width)) {
            let columns = found.columns();
            if !columns.is_empty() {
                take(row, columns);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::grid::{GRID_BITS, is_positive};
    use super::*;
    use crate::render::random;

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
                for (row, span) in (row..).zip(spans::<ROWS>(&Edge::all(&outline), row, 1000)) {
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
        let mut random = random::below::<i64>(5);
        let mut seen = [0; 2];
        for n in 0..4000 {
            // Close to a line, so that turns are as often 0 or barely something else.
            let along = [1, 1 << 10, ONE][n % 3];
            let mut corner = || GridPoint { x: along * random(40) + random(2), y: along * random(40) / 7 + random(2) };
            let corners = [corner(), corner(), corner(), corner()];
            let outline = Outline::new(&corners);
            let found = outline.is_convex();
            let Hull { low, high } = outline.hull();
            if high[0] - low[0] < Turning::SMALL && high[1] - low[1] < Turning::SMALL {
                assert_eq!(Turning::new(outline.x, outline.y).is_convex, found, "{corners:?}");
            }
            seen[usize::from(found)] += 1;
        }
        assert!(seen[1] > 100 && seen[0] > 100, "{seen:?}");
    }
}
