//! Spans of tall polygons in single precision, eight rows at a time, where that is sure to give the same columns.
//!
//! In: edges, seen from a pixel nearby. Out: spans as [`scan`](super::scan) has them, to the column. Where an edge crosses
//! a row so close to a pixel's centre that rounding could decide, nothing is said.

use super::lanes::least;
use super::scan::{Edge, Span};

/// Rows that are looked at together.
pub(super) const ROWS: usize = 8;

/// Polygons no larger than this, in pixels, may be looked at so.
pub(super) const LARGEST: f64 = 512.0;

/// What is closer to a centre, in pixels, than this is not sure. Four roundings of numbers up to [`LARGEST`] are half of
/// it.
const UNSURE: f32 = 1.0 / 4096.0;

/// The edges of a polygon on both sides, as seen from a pixel: one an edge or a corner, from the upper one on.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sides {
    /// The first row whose centre is at each corner or below it.
    corners: [f32; 4],
    /// Where the edge from that corner to the next crosses the first row that is at one of both.
    columns: [f32; 4],
    /// Columns to the right a row.
    slopes: [f32; 4],
}

impl Sides {
    pub(super) const NOTHING: Self = Self { corners: [0.0; 4], columns: [0.0; 4], slopes: [0.0; 4] };

    /// Of edges from an uppermost corner on, as seen from the pixel in this column and row.
    #[inline]
    pub(super) fn new(edges: [Edge; 4], [column, row]: [u32; 2]) -> Self {
        let mut sides = Self::NOTHING;
        for (i, edge) in edges.iter().enumerate() {
            let first = least(edge.first, edges[(i + 1) % 4].first);
            let crossed = (first + 0.5 - edge.y) * edge.slope + edge.x;
            sides.corners[i] = (edge.first - f64::from(row)) as f32;
            sides.columns[i] = (crossed - f64::from(column)) as f32;
            sides.slopes[i] = edge.slope as f32;
        }
        sides
    }

    /// Spans of the rows from `row` on, on a surface `width` pixels wide; `None` where one is not sure. `origin` is the
    /// column and row of the pixel that it is seen from.
    #[inline(always)]
    pub(super) fn spans(&self, origin: [u16; 2], row: i32, width: i32) -> Option<[Span; ROWS]> {
        let Self { corners, columns, slopes } = *self;
        let mut first = [0.0; 4];
        for (i, first) in first.iter_mut().enumerate() {
            let next = corners[(i + 1) % 4];
            *first = if next < corners[i] { next } else { corners[i] };
        }
        let later = |a: f32, b: f32| if a > b { a } else { b };
        let end = later(corners[1], later(corners[2], corners[3]));
        let (row, width) = ((row - i32::from(origin[1])) as f32, width as f32);
        let offset = f32::from(origin[0]);
        let mut spans = [Span::EMPTY; ROWS];
        let mut unsure = 0;
        for (i, span) in spans.iter_mut().enumerate() {
            let row = row + i as f32;
            let at = |edge: usize| (row - first[edge]) * slopes[edge] + columns[edge];
            let above = |corner: usize| row < corners[corner];
            let pick = |is_one: bool, one: f32, other: f32| if is_one { one } else { other };
            let (middle, lower) = (pick(above(2), at(1), at(2)), pick(above(2), at(2), at(1)));
            let right = pick(above(1), at(0), middle);
            let left = pick(above(3), at(3), lower);
            let is_within = (row >= corners[0]) & (row < end);
            let (left, right) = (Nearest::new(left), Nearest::new(right));
            unsure |= u32::from(is_within & (left.is_unsure() | right.is_unsure()));
            let cut = |column: f32| {
                let column = column + offset;
                let column = if column > 0.0 { column } else { 0.0 };
                if column < width { column } else { width }
            };
            let found = whole(cut(left.ceil())) | whole(cut(right.ceil())) << 16;
            *span = Span::number(if is_within { found } else { 0 });
        }
        (unsure == 0).then_some(spans)
    }
}

/// A number and the whole number next to it.
#[derive(Debug, Clone, Copy)]
struct Nearest {
    value: f32,
    whole: f32,
}

impl Nearest {
    /// Of a number below 2^22.
    #[inline(always)]
    fn new(value: f32) -> Self {
        const WHOLE: f32 = (3u32 << 22) as f32;
        Self { value, whole: (value + WHOLE) - WHOLE }
    }

    #[inline(always)]
    fn is_unsure(self) -> bool {
        (self.value - self.whole).abs() < UNSURE
    }

    #[inline(always)]
    fn ceil(self) -> f32 {
        self.whole + if self.whole < self.value { 1.0 } else { 0.0 }
    }
}

/// A whole number below 2^23 that is not negative.
#[inline(always)]
fn whole(v: f32) -> u32 {
    (v + (1u32 << 23) as f32).to_bits() & ((1 << 23) - 1)
}

#[cfg(test)]
mod tests {
    use super::super::grid::{GRID_BITS, GridPoint};
    use super::super::scan::{Outline, spans};
    use super::*;
    use crate::render::random;

    /// Where it says something it is what double precision says, and mostly it does.
    #[test]
    fn spans_are_the_exact_ones() {
        let mut random = random::below::<i64>(7);
        const ONE: i64 = 1 << GRID_BITS;
        let (mut seen, mut unsure, mut polygons) = (0, 0, 0);
        while polygons < 3000 {
            // On a coarse grid, too: corners on centres, level edges, corners on one line.
            let (size, unit) = [(90, ONE / 2), (500, ONE), (40 * ONE, 1)][polygons % 3];
            let (x, y) = (random(600 * ONE / unit) - 20 * ONE / unit, random(300 * ONE / unit) - 20 * ONE / unit);
            let mut corner = || GridPoint { x: (x + random(size)) * unit, y: (y + random(size)) * unit };
            let corners = [corner(), corner(), corner(), corner()];
            let outline = Outline::new(&corners[..3 + polygons % 2]);
            if !outline.is_convex() {
                continue;
            }
            polygons += 1;
            let Some((columns, rows)) = outline.hull().centers(500, 0..400) else { continue };
            let edges = Edge::all(&outline);
            let top = (0..4).min_by(|&a, &b| edges[a].first.total_cmp(&edges[b].first)).expect("four");
            let origin = [columns.start as u16, rows.start as u16];
            let sides = Sides::new([0, 1, 2, 3].map(|i| edges[(top + i) % 4]), origin.map(u32::from));
            for row in (rows.start.max(3) - 3..rows.end).step_by(ROWS) {
                let exact = spans::<ROWS>(&edges, row, 500);
                match sides.spans(origin, row, 500) {
                    Some(found) => {
                        let columns = |span: &Span| Some(span.columns()).filter(|columns| !columns.is_empty());
                        assert!(found.iter().map(columns).eq(exact.iter().map(columns)), "{corners:?}, row {row}");
                        seen += 1;
                    }
                    None => unsure += 1,
                }
            }
        }
        assert!(seen > 15_000 && unsure > 100 && unsure < seen / 2, "{seen} seen, {unsure} unsure");
    }
}
