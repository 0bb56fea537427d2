//! Anti-aliasing: the pixels of a band that a boundary between labels crosses, and the mean colour of each.
//!
//! In: first all polygons of the band, for their boundaries ([`Crossed::mark`]); then all of them again, for what
//! they cover ([`Crossed::add`]). Out: those pixels anew ([`Crossed::paint`]); no other pixel is touched.
//!
//! A pixel's colour is the integral over its square of all positive polygons, by the area that they cover. Areas add
//! up to 1 but for folds, where they add up to more. Each polygon's share is clamped to [0, 255] before it is
//! blended, as the pixels around are: what is mixed is what is seen on both sides, so the edge of an overshooting
//! region is as soft as any other and means do not change with the size of the picture.

use std::ops::Range;

use glam::{Vec3A, Vec4};

use super::canvas::{Canvas, ColorSpace};
use super::coverage::Coverage;
use super::grid::{GRID_BITS, GridPoint};
use super::pack::BAND_ROWS;
use super::scan::Outline;
use super::shade::Shade;
use super::view::View;

/// Less than this part of a pixel says nothing of its colour: it keeps that of its centre.
const LEAST_AREA: f32 = 1.0 / 1024.0;

/// Bit i: row i of the band.
type Rows = u32;
const _: () = assert!(BAND_ROWS == Rows::BITS as usize);

/// Columns that are passed over at once where none of their rows is wanted.
const TILE: usize = 16;

/// Crossed pixels of a band; reused from band to band.
#[derive(Debug, Default)]
pub(super) struct Crossed {
    rows: Range<i32>,
    /// The pixels of each column.
    columns: Vec<Rows>,
    /// The rows with pixels in each [`TILE`] columns.
    tiles: Vec<Rows>,
    /// One a column: how many pixels the columns before it have.
    before: Vec<u32>,
    /// One a pixel, by column and row: RGB times area, and area.
    sums: Vec<Vec4>,
}

impl Crossed {
    /// Starts a band: marks the pixels that edges between labels cross, given polygons, the number of their corners and
    /// which of their edges are such (bit i: from corner i to the next).
    pub(super) fn start<'a>(
        &mut self,
        view: &View,
        rows: Range<i32>,
        polygons: impl Iterator<Item = (&'a Outline, u8, u8)>,
    ) {
        self.rows = rows;
        self.columns.clear();
        self.columns.resize(view.columns as usize, 0);
        for (outline, count, boundary) in polygons.filter(|(_, _, boundary)| *boundary != 0) {
            let (corners, count) = (outline.corners(), usize::from(count));
            for i in (0..count).filter(|i| boundary >> i & 1 != 0) {
                self.mark(view, corners[i], corners[(i + 1) % count]);
            }
        }
        let union = |columns: &[Rows]| columns.iter().fold(0, |union, rows| union | rows);
        self.tiles.clear();
        self.tiles.extend(self.columns.chunks(TILE).map(union));
        self.before.clear();
        let mut count = 0;
        self.before.extend(self.columns.iter().map(|rows| {
            count += rows.count_ones();
            count - rows.count_ones()
        }));
        self.sums.clear();
        self.sums.resize(count as usize, Vec4::ZERO);
    }

    /// Marks the pixels that an edge crosses, if their centres show the picture: its outer border is no boundary. Where
    /// the edge grazes a corner of a pixel, rounding decides; the part beyond it is as small.
    fn mark(&mut self, view: &View, from: GridPoint, to: GridPoint) {
        let (top, bottom) = if from.y <= to.y { (from, to) } else { (to, from) };
        let shown = self.rows.start.max(view.picture.rows.start)..self.rows.end.min(view.picture.rows.end);
        let first = (top.y >> GRID_BITS).max(shown.start.into());
        let end = (-(-bottom.y >> GRID_BITS)).min(shown.end.into());
        if first >= end {
            return;
        }
        let slope = (bottom.x - top.x) as f64 / (bottom.y - top.y) as f64;
        let (low, high) = (top.x.min(bottom.x), top.x.max(bottom.x));
        // Casts saturate.
        let at = |y: i64| (top.x + (slope * (y - top.y) as f64) as i64).clamp(low, high);
        let mut upper = if top.y >= first << GRID_BITS { top.x } else { at(first << GRID_BITS) };
        for row in first..end {
            let y = (row + 1) << GRID_BITS;
            let lower = if bottom.y <= y { bottom.x } else { at(y) };
            let start = (upper.min(lower) >> GRID_BITS).max(view.picture.columns.start.into());
            let end = (-(-upper.max(lower) >> GRID_BITS)).min(view.picture.columns.end.into());
            let bit = 1 << (row - i64::from(self.rows.start));
            if start < end {
                self.columns[start as usize..end as usize].iter_mut().for_each(|rows| *rows |= bit);
            }
            upper = lower;
        }
    }

    /// Adds what a polygon of `count` corners, with these colours in the channels of the canvas, covers of the pixels.
    pub(super) fn add(&mut self, outline: &Outline, count: u8, colors: &[Vec4; 4], space: ColorSpace) {
        if self.sums.is_empty() {
            return;
        }
        let Some((columns, rows)) = outline.hull().touched(self.columns.len() as i32, self.rows.clone()) else {
            return;
        };
        let from_first = Rows::MAX << (rows.start - self.rows.start);
        let within = from_first & Rows::MAX >> (self.rows.start + Rows::BITS as i32 - rows.end);
        let tiles = columns.start as usize / TILE..=(columns.end as usize - 1) / TILE;
        let mut tiles = tiles.filter(|&tile| self.tiles[tile] & within != 0).peekable();
        if tiles.peek().is_none() {
            return;
        }
        let shade = Shade::new(outline, colors, space);
        let corners = outline.corners();
        let coverage = Coverage::new(&corners[..count.into()], [columns.start, rows.start]);
        for tile in tiles {
            let in_tile = (tile * TILE) as i32..((tile + 1) * TILE) as i32;
            for column in columns.start.max(in_tile.start)..columns.end.min(in_tile.end) {
                let marked = self.columns[column as usize];
                let mut left = marked & within;
                while left != 0 {
                    let row = left.trailing_zeros();
                    left &= left - 1;
                    let place = [column, self.rows.start + row as i32];
                    let part = coverage.of(place);
                    if part.area > 0.0 {
                        let pixel = self.before[column as usize] + (marked & ((1 << row) - 1)).count_ones();
                        self.sums[pixel as usize] += shade.integral(place, part).extend(part.area as f32);
                    }
                }
            }
        }
    }

    /// Paints the pixels into the band's rows.
    pub(super) fn paint(&self, canvas: &mut Canvas) {
        for ([column, row], sum) in self.places().zip(&self.sums) {
            if sum.w > LEAST_AREA {
                canvas.set(column, row, Vec3A::from_vec4(*sum) / sum.w);
            }
        }
    }

    /// Column and row within the band of each marked pixel, in the order of their sums.
    pub(super) fn places(&self) -> impl Iterator<Item = [usize; 2]> {
        self.columns.iter().enumerate().flat_map(|(column, &rows)| {
            let mut left = rows;
            std::iter::from_fn(move || {
                let row = left.trailing_zeros() as usize;
                (left != 0).then(|| {
                    left &= left - 1;
                    [column, row]
                })
            })
        })
    }
}
