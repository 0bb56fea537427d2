//! Linear colour written into rows of pixels.
//!
//! In: an outline, colours at its corners; spans of rows. Out: pixels of a canvas. Forbidden here: which pixels a polygon
//! covers.

use glam::{Vec3A, Vec4};
use wide::{i16x8, i32x4, i32x8};

use super::canvas::{CHUNK, ColorSpace, PART, PARTS, Pixel, Rows, pixel};
use super::cpu::{self, Kernel};
use super::scan::Span;

/// Binary digits after the point of a [`Run`]. With 10 before it and a sign they fit 32 bits, in which sums may overflow:
/// where the polygon is they are right again.
pub(super) const FRACTION: u32 = 20;

/// Binary digits after the point of the steps within a chunk: with 9 before the point and a sign they fill 16 bits, so
/// that two pixels go through a register of the smallest size. Each value is rounded twice, to 1/128 level.
const CHUNK_FRACTION: u32 = 6;

/// How a run's pixels become a canvas's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// Clamped to [0, 255], chunk by chunk.
    Chunks,
    /// Clamped to [0, 255], pixel by pixel: beyond the range of a chunk.
    Pixels,
    /// Clamped to [0, 255] and converted from RGB, pixel by pixel.
    Converted,
}

/// A polygon's colour in fixed point, for painting spans.
#[derive(Debug, Clone, Copy)]
pub(super) struct Run {
    /// Channels at the centre of the pixel `origin`, and half a level, so that cutting off rounds; in the order of a
    /// [`Pixel`], as all here.
    pub(super) base: [i32; 3],
    /// Change a column.
    pub(super) right: [i32; 3],
    /// Change a row.
    pub(super) down: [i32; 3],
    /// Column and row; sides of surfaces fit.
    pub(super) origin: [u16; 2],
    pub(super) way: Way,
}

impl Run {
    pub(super) const NOTHING: Self =
        Self { base: [0; 3], right: [0; 3], down: [0; 3], origin: [0; 2], way: Way::Chunks };

    /// The row of the pixel that it starts from.
    #[inline]
    pub(super) fn row(&self) -> i32 {
        self.origin[1].into()
    }

    /// What paints spans of a canvas, in chunks of so many registers of [`PART`] pixels.
    #[inline(always)]
    pub(super) fn brush<const WIDTH: usize>(&self, space: ColorSpace) -> Brush<'_, WIDTH> {
        let right = four(self.right);
        let pair = |first: i32x4| pack(to_chunk(first + HALF), to_chunk(first + right + HALF));
        let mut first = i32x4::ZERO;
        let lanes = [(); WIDTH].map(|()| {
            let [low, high] = [pair(first), pair(first + right + right)].map(i16x8::to_array);
            first += right << 2;
            std::array::from_fn(|i| if i < 8 { low[i] } else { high[i - 8] })
        });
        Brush { run: self, space, right, lanes }
    }
}

/// How a polygon is painted whose colours are beyond the range of chunks, and these as far as digits go: in RGB.
#[cold]
pub(super) fn clamped(colors: &[Vec4; 4], space: ColorSpace) -> (Way, [Vec4; 4]) {
    // Far beyond what is seen, but within the digits.
    const FARTHEST: Vec3A = Vec3A::splat(767.0);
    let way = if space == ColorSpace::Rgb { Way::Pixels } else { Way::Converted };
    (way, colors.map(|color| ColorSpace::Rgb.of_rgb(space.to_rgb(color).clamp(-FARTHEST, FARTHEST))))
}

/// A run at work.
#[derive(Debug)]
pub(super) struct Brush<'a, const WIDTH: usize> {
    run: &'a Run,
    space: ColorSpace,
    /// The step to the next pixel.
    right: i32x4,
    /// The steps from a chunk's first pixel to each.
    lanes: [[i16; 4 * PART]; WIDTH],
}

impl<const WIDTH: usize> Brush<'_, WIDTH> {
    /// Paints spans of the rows from `row` on; `at` is where the first of them begins. Colours are clamped to [0, 255]
    /// pixel by pixel and rounded to the nearest level.
    #[inline(always)]
    pub(super) fn paint(&self, rows: &mut Rows<'_>, mut at: u32, row: i32, spans: &[Span]) {
        let Run { base, down, origin, way, .. } = self.run;
        if *way != Way::Chunks {
            return self.paint_pixels(rows, at, row, spans);
        }
        let down = four(*down);
        // In the first column, wherever that is: sums may overflow.
        let mut value = four(*base) + down * i32x4::splat(row - i32::from(origin[1])) + HALF
            - self.right * i32x4::splat(origin[0].into());
        for span in spans {
            let (start, end) = span.ends();
            if start < end {
                let first = value + self.right * i32x4::splat(start as i32);
                self.paint_chunks(rows, at + start, end - start, first);
            }
            value += down;
            at += rows.stride;
        }
    }

    #[inline(always)]
    fn paint_chunks(&self, rows: &mut Rows<'_>, mut start: u32, mut left: u32, mut value: i32x4) {
        let width = (WIDTH * PART) as u32;
        while left > width {
            let Some(chunk) = rows.chunk_mut::<WIDTH>(start) else { return };
            chunk.iter_mut().zip(self.painted(value)).for_each(|(bytes, painted)| *bytes = painted);
            value += self.right * i32x4::splat(width as i32);
            start += width;
            left -= width;
        }
        let Some(chunk) = rows.chunk_mut::<WIDTH>(start) else { return };
        for ((bytes, painted), mask) in chunk.iter_mut().zip(self.painted(value)).zip(MASKS[left as usize & MOST]) {
            for ((byte, painted), mask) in bytes.iter_mut().zip(painted).zip(mask) {
                *byte = painted & mask | *byte & !mask;
            }
        }
    }

    /// The pixels of a chunk, given the value at the first.
    #[inline(always)]
    fn painted(&self, value: i32x4) -> [[u8; 4 * PART]; WIDTH] {
        let start = to_chunk(value);
        // Plain lists: they become registers as wide as there are, which types of a fixed width do not.
        let [a, b, c, d, ..] = pack(start, start).to_array();
        let start = [a, b, c, d, a, b, c, d, a, b, c, d, a, b, c, d];
        let mut painted = [[0; 4 * PART]; WIDTH];
        for (painted, lanes) in painted.iter_mut().zip(&self.lanes) {
            for ((byte, start), step) in painted.iter_mut().zip(start).zip(lanes) {
                *byte = (start.wrapping_add(*step) >> CHUNK_FRACTION).clamp(0, 255) as u8;
            }
        }
        painted
    }

    #[inline(never)]
    fn paint_pixels(&self, rows: &mut Rows<'_>, mut at: u32, row: i32, spans: &[Span]) {
        let Run { base, right, down, origin, .. } = self.run;
        for (row, span) in (row..).zip(spans) {
            let columns = span.columns();
            let (across, below) = (columns.start as i32 - i32::from(origin[0]), row - i32::from(origin[1]));
            let values = [0, 1, 2].map(|i: usize| {
                base[i].wrapping_add(right[i].wrapping_mul(across)).wrapping_add(down[i].wrapping_mul(below))
            });
            let pixels = at as usize + columns.start..at as usize + columns.end;
            if let Some(pixels) = rows.pixels.get_mut(pixels) {
                cpu::run(Pixelwise { run: self.run, space: self.space, pixels, values });
            }
            at += rows.stride;
        }
    }
}

/// Pixels side by side that are clamped, and converted if need be, one by one.
struct Pixelwise<'a> {
    run: &'a Run,
    space: ColorSpace,
    pixels: &'a mut [Pixel],
    /// Channels at the first of them.
    values: [i32; 3],
}

impl Kernel for Pixelwise<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { run: Run { right, way, .. }, space, pixels, mut values } = self;
        for chunk in pixels.chunks_mut(CHUNK) {
            let mut levels = [[0; CHUNK]; 3];
            for ((levels, value), right) in levels.iter_mut().zip(&mut values).zip(right) {
                for (i, level) in levels.iter_mut().enumerate() {
                    *level = (value.wrapping_add(right.wrapping_mul(i as i32)) >> FRACTION).clamp(0, 255);
                }
                *value = value.wrapping_add(right.wrapping_mul(CHUNK as i32));
            }
            let mut painted = [[0; 4]; CHUNK];
            for (i, place) in painted.iter_mut().enumerate() {
                let rgb = [levels[1][i], levels[0][i], levels[2][i]];
                *place = pixel(if *way == Way::Converted { space.of_levels(rgb) } else { rgb.map(|v| v as u8) });
            }
            match chunk.first_chunk_mut::<CHUNK>() {
                Some(chunk) => *chunk = painted,
                None => chunk.iter_mut().zip(painted).for_each(|(place, painted)| *place = painted),
            }
        }
    }
}

/// Half a digit of a chunk, so that cutting off rounds.
const HALF: i32x4 = i32x4::new([1 << (FRACTION - CHUNK_FRACTION - 1); 4]);

#[inline(always)]
fn four([a, b, c]: [i32; 3]) -> i32x4 {
    i32x4::new([a, b, c, 0])
}

/// The last of [`MASKS`]: all bits of a number below its length.
const MOST: usize = 15;

/// All bits of the bytes of the first so many pixels of a chunk.
const MASKS: [[[u8; 16]; PARTS]; MOST + 1] = {
    let mut masks = [[[0; 16]; PARTS]; MOST + 1];
    let mut i = 0;
    while i < (MOST + 1) * 4 * CHUNK {
        let (count, byte) = (i / (4 * CHUNK), i % (4 * CHUNK));
        if byte < 4 * count {
            masks[count][byte / 16][byte % 16] = 255;
        }
        i += 1;
    }
    masks
};

/// Cuts values off to the digits of a chunk.
#[inline(always)]
fn to_chunk(values: i32x4) -> i32x4 {
    values >> (FRACTION - CHUNK_FRACTION) as i32
}

/// Two pixels side by side. Where a polygon is, values fit 16 bits.
#[inline(always)]
fn pack(first: i32x4, second: i32x4) -> i16x8 {
    let ([a, b, c, d], [e, f, g, h]) = (first.to_array(), second.to_array());
    i16x8::from_i32x8_saturate(i32x8::new([a, b, c, d, e, f, g, h]))
}

#[cfg(test)]
mod tests {
    use super::super::canvas::channels;
    use std::ops::Range;

    use super::super::grid::{GRID_BITS, GridPoint};
    use super::super::scan::Outline;
    use super::super::setup::tests::run_of;
    use super::*;

    /// A triangle of whole pixels, turning from +x to +y.
    fn triangle(corners: [[i64; 2]; 3]) -> Outline {
        Outline::new(&corners.map(|[x, y]| GridPoint { x: x << GRID_BITS, y: y << GRID_BITS }))
    }

    /// Colours of a triangle on a canvas.
    fn corner_colors(colors: [[f32; 3]; 3], space: ColorSpace) -> ([Vec4; 4], bool) {
        let rgb = colors.map(Vec3A::from_array);
        ([0, 1, 2, 2].map(|i| space.of_rgb(rgb[i])), !rgb.into_iter().all(|rgb| space.holds(rgb)))
    }

    /// The first row of a polygon in RGB.
    fn painted(size: i64, colors: [[f32; 3]; 3], count: usize) -> Vec<[u8; 3]> {
        let outline = triangle([[0, 0], [size, 0], [0, size]]);
        let colors = corner_colors(colors, ColorSpace::Rgb);
        let run = run_of(&outline, colors, ColorSpace::Rgb);
        let mut row = vec![[1; 4]; count + CHUNK];
        run.brush::<PARTS>(ColorSpace::Rgb).paint(
            &mut Rows { pixels: &mut row, stride: 0 },
            0,
            0,
            &[Span::of(0..count)],
        );
        assert!(row[count..] == [[1; 4]; CHUNK], "pixels beyond the span are left alone");
        row[..count].iter().map(|&pixel| channels(pixel)).collect()
    }

    #[test]
    fn runs_follow_the_linear_field() {
        let colors = [[0.0, 255.0, 100.0], [255.0, 0.0, 100.0], [0.0, 255.0, 100.0]];
        for size in [2, 3, 5, 16, 17, 40, 3000] {
            for (x, pixel) in painted(size as i64, colors, size).into_iter().enumerate() {
                let part = (x as f64 + 0.5) / size as f64;
                let expected = [255.0 * part, 255.0 - 255.0 * part, 100.0];
                for (found, expected) in pixel.into_iter().zip(expected) {
                    assert!((f64::from(found) - expected).abs() <= 0.52, "column {x}: {found} against {expected}");
                }
            }
        }
    }

    #[test]
    fn colours_beyond_the_range_are_clamped_where_they_are() {
        for (x, pixel) in painted(101, [[-100.0; 3], [300.0; 3], [-100.0; 3]], 101).into_iter().enumerate() {
            let expected = (-100.0 + 400.0 * (x as f32 + 0.5) / 101.0).clamp(0.0, 255.0);
            assert!((f32::from(pixel[0]) - expected).abs() <= 0.52, "column {x}");
        }
    }

    /// Beyond a chunk's range, too.
    #[test]
    fn colours_far_beyond_the_range_are_clamped() {
        for (x, pixel) in painted(101, [[-700.0; 3], [700.0; 3], [-700.0; 3]], 101).into_iter().enumerate() {
            let expected = (-700.0 + 1400.0 * (x as f32 + 0.5) / 101.0).clamp(0.0, 255.0);
            assert!((f32::from(pixel[0]) - expected).abs() <= 0.51, "column {x}");
        }
    }

    #[test]
    fn constants_are_exact() {
        for level in [0.0, 0.4, 7.0, 127.0, 254.6, 255.0] {
            let expected = (level + 0.5) as u8;
            assert!(painted(701, [[level; 3]; 3], 700).iter().all(|&p| p == [expected; 3]), "{level}");
        }
    }

    /// Converted at corners or at pixels: the same colours.
    #[test]
    fn spaces_agree() {
        let outline = triangle([[0, 0], [90, 0], [0, 70]]);
        let paint = |colors, space, row, columns: Range<usize>| {
            let mut found = [[0; 4]; 110];
            let run = run_of(&outline, corner_colors(colors, space), space);
            let mut rows = Rows { pixels: &mut found, stride: 0 };
            run.brush::<PARTS>(space).paint(&mut rows, 0, row, &[Span::of(columns.clone())]);
            columns.map(|x| channels(found[x])).collect::<Vec<_>>()
        };
        for matrix in [crate::video::YuvMatrix::Bt601, crate::video::YuvMatrix::Bt709] {
            for excess in [0.0, 40.0] {
                let colors = [[0.0 - excess, 20.0, 255.0], [255.0, 128.0, 3.0], [90.0, 255.0 + excess, 0.0]];
                for row in [0, 20, 60] {
                    let columns = 0..(90 - 90 * (row as usize + 1) / 70);
                    let found = paint(colors, ColorSpace::Yuv(matrix), row, columns.clone());
                    for (found, rgb) in found.into_iter().zip(paint(colors, ColorSpace::Rgb, row, columns)) {
                        let expected = ColorSpace::Yuv(matrix).of_levels(rgb.map(i32::from));
                        let near = found.iter().zip(&expected).all(|(a, b)| a.abs_diff(*b) <= 1);
                        assert!(near, "{matrix:?}, row {row}: {found:?} against {expected:?}");
                    }
                }
            }
        }
    }
}
