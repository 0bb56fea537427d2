//! Linear colour inside a triangle, written into rows of pixels.

use std::ops::Range;

use glam::{Vec3, Vec3A};

use super::coverage::Part;
use super::scan::{GridPoint, center_distance};

/// A pixel as it is painted: R in the lowest byte, then G, B.
pub(super) type Rgb32 = u32;

/// Pixels painted from one set of fixed-point values. Short enough that the rounding of the step, 2^-14 of a level a
/// pixel, stays below 1/64 of a level.
const RUN: usize = 256;
/// Binary digits after the point of a channel in a run.
const FRACTION: u32 = 13;
/// Bits of a channel in a run: 8 before the point; three of them fit 64 bits.
const CHANNEL: u32 = 8 + FRACTION;

/// The linear colour of a triangle: its value at a corner and how it changes a pixel to the right and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shade {
    corner: GridPoint,
    color: Vec3A,
    right: Vec3A,
    down: Vec3A,
    low: Vec3A,
    high: Vec3A,
    /// `right` for a run; `None` where colours leave [0, 255] and are clamped pixel by pixel.
    step: Option<u64>,
}

impl Shade {
    /// The field that takes `colors` at `corners` (a positive triangle).
    pub(super) fn new(corners: [GridPoint; 3], colors: [Vec3; 3]) -> Self {
        let [a, b, c] = corners.map(GridPoint::to_px);
        let (ux, uy, vx, vy) = (b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]);
        let scale = 1.0 / (ux * vy - uy * vx);
        let colors = colors.map(Vec3A::from);
        let (along_u, along_v) = (colors[1] - colors[0], colors[2] - colors[0]);
        let gradient = |u: f64, v: f64| along_u * (u * scale) as f32 + along_v * (v * scale) as f32;
        let low = colors[0].min(colors[1]).min(colors[2]);
        let high = colors[0].max(colors[1]).max(colors[2]);
        let right = gradient(vy, -uy);
        let in_range = low.min_element() >= 0.0 && high.max_element() <= 255.0;
        Self {
            corner: corners[0],
            color: colors[0],
            right,
            down: gradient(-vx, ux),
            low,
            high,
            step: in_range.then(|| pack_step(right * SCALE)),
        }
    }

    /// The colour at a pixel's centre, held within that of the corners: in slivers the gradient amplifies rounding.
    #[inline]
    fn at(&self, column: usize, row: i32) -> Vec3A {
        let [x, y] = center_distance(self.corner, column as i64, i64::from(row));
        (self.color + self.right * x + self.down * y).max(self.low).min(self.high)
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

    /// Paints `columns` (not empty, within `pixels`) of a row. Colours are clamped to [0, 255] pixel by pixel and
    /// rounded to the nearest level.
    #[inline]
    pub(super) fn paint(&self, pixels: &mut [Rgb32], row: i32, columns: Range<usize>) {
        if columns.len() == 1 {
            pixels[columns.start] = pack(self.at(columns.start, row));
            return;
        }
        let mut column = columns.start;
        for pixels in pixels[columns].chunks_mut(RUN) {
            let first = self.at(column, row);
            column += pixels.len();
            if let Some(step) = self.step {
                paint_run(pixels, first, step);
            } else {
                for (i, pixel) in pixels.iter_mut().enumerate() {
                    *pixel = pack(first + self.right * i as f32);
                }
            }
        }
    }
}

/// One level in a run.
const SCALE: f32 = (1 << FRACTION) as f32;

/// Paints up to [`RUN`] pixels of a triangle whose corners' colours lie in [0, 255].
///
/// The three channels ride in one integer, r + g * 2^21 + b * 2^42: one addition steps them all, and as no channel
/// leaves [0, 2^21) no carry is ever wrong. The half level that rounds is what keeps them inside: where a run has two
/// pixels, the triangle is a pixel wide there, so its gradient is exact to far less than that.
#[inline]
fn paint_run(pixels: &mut [Rgb32], first: Vec3A, step: u64) {
    // Added to 2^23, a float's last digits are those of the integer: cheaper than a checked cast, span after span.
    const ROUND: f32 = (1 << 23) as f32;
    let rounded = (first * SCALE + Vec3A::splat(SCALE / 2.0 + ROUND)).to_array();
    let channel = |v: f32| u64::from(v.to_bits().wrapping_sub(ROUND.to_bits()));
    let mut color = channel(rounded[0]) | channel(rounded[1]) << CHANNEL | channel(rounded[2]) << (2 * CHANNEL);
    for pixel in pixels {
        let channel = |i: u32| (color >> (i * CHANNEL + FRACTION)) as u32 & 255;
        *pixel = channel(0) | channel(1) << 8 | channel(2) << 16;
        color = color.wrapping_add(step);
    }
}

/// A run's step: three channels in one integer, negative ones borrowing from those above.
fn pack_step(channels: Vec3A) -> u64 {
    let v = channels.to_array().map(|v| (v + if v < 0.0 { -0.5 } else { 0.5 }) as i32 as i64);
    (v[0] + (v[1] << CHANNEL)).wrapping_add(v[2] << (2 * CHANNEL)) as u64
}

/// Rounds and clamps one colour.
#[inline]
pub(super) fn pack(color: Vec3A) -> Rgb32 {
    let [r, g, b] = (color + 0.5).clamp(Vec3A::ZERO, Vec3A::splat(255.0)).to_array().map(|v| v as i32 as u32);
    r | g << 8 | b << 16
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scan::GRID_BITS;

    fn unpack(pixel: Rgb32) -> [i32; 3] {
        [0, 8, 16].map(|shift| (pixel >> shift & 255) as i32)
    }

    fn shade(size: i64, colors: [[f32; 3]; 3]) -> Shade {
        let at = |x, y| GridPoint { x: x << GRID_BITS, y: y << GRID_BITS };
        Shade::new([at(0, 0), at(size, 0), at(0, size)], colors.map(Vec3::from_array))
    }

    #[test]
    fn runs_follow_the_linear_field() {
        let (size, colors) = (3000, [[0.0, 255.0, 100.0], [255.0, 0.0, 100.0], [0.0, 255.0, 100.0]]);
        let mut pixels = vec![0; size];
        shade(size as i64, colors).paint(&mut pixels, 0, 0..size);
        for (x, &pixel) in pixels.iter().enumerate() {
            let part = (x as f64 + 0.5) / size as f64;
            let expected = [255.0 * part, 255.0 - 255.0 * part, 100.0];
            for (found, expected) in unpack(pixel).into_iter().zip(expected) {
                assert!((f64::from(found) - expected).abs() <= 0.52, "column {x}: {found} against {expected}");
            }
        }
    }

    #[test]
    fn colours_beyond_the_range_are_clamped_where_they_are() {
        let size = 101;
        let mut pixels = vec![0; size];
        shade(101, [[-100.0; 3], [300.0; 3], [-100.0; 3]]).paint(&mut pixels, 0, 0..size);
        for (x, &pixel) in pixels.iter().enumerate() {
            let expected = (-100.0 + 400.0 * (x as f32 + 0.5) / 101.0).clamp(0.0, 255.0);
            assert!((unpack(pixel)[0] as f32 - expected).abs() <= 0.51, "column {x}");
        }
    }

    #[test]
    fn constants_are_exact() {
        for level in [0.0, 0.4, 7.0, 127.0, 254.6, 255.0] {
            let mut pixels = vec![1; 700];
            shade(701, [[level; 3]; 3]).paint(&mut pixels, 0, 0..700);
            let expected = (level + 0.5) as i32;
            assert!(pixels.iter().all(|&p| unpack(p) == [expected; 3]), "{level}");
        }
    }
}
