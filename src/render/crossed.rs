//! Anti-aliasing: the pixels of a band that a boundary between labels crosses, and the mean colour of each.
//!
//! In: first all triangles of the band, for their boundaries ([`Crossed::mark`]); then all of them again, for what
//! they cover ([`Crossed::add`]). Out: those pixels anew ([`Crossed::paint`]); no other pixel is touched.
//!
//! A pixel's colour is the integral over its square of all positive triangles, by the area that they cover. Areas add
//! up to 1 but for folds, where they add up to more. Each triangle's share is clamped to [0, 255] before it is
//! blended, as the pixels around are: what is mixed is what is seen on both sides, so the edge of an overshooting
//! region is as soft as any other and means do not change with the size of the picture.

use std::ops::Range;

use glam::{Vec3A, Vec4};

use super::coverage::Coverage;
use super::draw::Triangle;
use super::pack::BAND_ROWS;
use super::scan::{GRID_BITS, GridPoint, touched};
use super::shade::{Rgb32, Shade, pack};
use super::view::View;

/// Less than this part of a pixel says nothing of its colour: it keeps that of its centre.
const LEAST_AREA: f32 = 1.0 / 1024.0;

/// Bit i: row i of the band.
type Rows = u32;
const _: () = assert!(BAND_ROWS == Rows::BITS as usize);

/// Crossed pixels of a band; reused from band to band.
#[derive(Debug, Default)]
pub(super) struct Crossed {
    rows: Range<i32>,
    /// The pixels of each column.
    columns: Vec<Rows>,
    /// One a column: how many pixels the columns before it have.
    before: Vec<u32>,
    /// One a pixel, by column and row: RGB times area, and area.
    sums: Vec<Vec4>,
}

impl Crossed {
    /// Starts a band: marks the pixels that edges between labels cross.
    pub(super) fn start<'a>(&mut self, view: &View, rows: Range<i32>, triangles: impl Iterator<Item = &'a Triangle>) {
        self.rows = rows;
        self.columns.clear();
        self.columns.resize(view.columns as usize, 0);
        for triangle in triangles.filter(|triangle| triangle.boundary != 0) {
            for i in (0..3).filter(|i| triangle.boundary >> i & 1 != 0) {
                self.mark(view, triangle.corners[i], triangle.corners[(i + 1) % 3]);
            }
        }
        self.before.clear();
        let mut count = 0;
        for rows in &self.columns {
            self.before.push(count);
            count += rows.count_ones();
        }
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
        let slope = (bottom.x - top.x) as f64 / (bottom.y - top.y) as f64;
        let (low, high) = (top.x.min(bottom.x) as f64, top.x.max(bottom.x) as f64);
        let at = |y: i64| (top.x as f64 + slope * (y - top.y) as f64).clamp(low, high);
        for row in first..end {
            let (upper, lower) = (row << GRID_BITS, (row + 1) << GRID_BITS);
            let upper = if top.y >= upper { top.x as f64 } else { at(upper) };
            let lower = if bottom.y <= lower { bottom.x as f64 } else { at(lower) };
            const PIXEL: f64 = 1.0 / (1u64 << GRID_BITS) as f64;
            // Casts saturate.
            let columns = (upper.min(lower) * PIXEL).floor() as i32..(upper.max(lower) * PIXEL).ceil() as i32;
            let columns = columns.start.max(view.picture.columns.start)..columns.end.min(view.picture.columns.end);
            for column in columns {
                self.columns[column as usize] |= 1 << (row - i64::from(self.rows.start));
            }
        }
    }

    /// Adds what a triangle, whose colours are `shade`, covers of the pixels.
    #[inline]
    pub(super) fn add(&mut self, triangle: &Triangle, shade: &Shade) {
        if self.sums.is_empty() {
            return;
        }
        let Some((columns, rows)) = touched(&triangle.corners, self.columns.len() as i32, self.rows.clone()) else {
            return;
        };
        let from_first = Rows::MAX << (rows.start - self.rows.start);
        let within = from_first & Rows::MAX >> (self.rows.start + Rows::BITS as i32 - rows.end);
        let mut coverage = None;
        for column in columns.clone() {
            let marked = self.columns[column as usize];
            let mut left = marked & within;
            while left != 0 {
                let row = left.trailing_zeros();
                left &= left - 1;
                let coverage =
                    coverage.get_or_insert_with(|| Coverage::new(triangle.corners, [columns.start, rows.start]));
                let place = self.rows.start + row as i32;
                if let Some(part) = coverage.of(column, place) {
                    let color = shade.mean(column, place, part.centroid);
                    let pixel = self.before[column as usize] + (marked & ((1 << row) - 1)).count_ones();
                    self.sums[pixel as usize] += color.extend(1.0) * part.area as f32;
                }
            }
        }
    }

    /// Paints the pixels into the band's rows.
    pub(super) fn paint(&self, pixels: &mut [Rgb32]) {
        let mut sums = self.sums.iter();
        for (column, rows) in self.columns.iter().enumerate() {
            let mut left = *rows;
            while left != 0 {
                let row = left.trailing_zeros() as usize;
                left &= left - 1;
                if let Some(sum) = sums.next().filter(|sum| sum.w > LEAST_AREA) {
                    pixels[row * self.columns.len() + column] = pack(Vec3A::from_vec4(*sum) / sum.w);
                }
            }
        }
    }
}
