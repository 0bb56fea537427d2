//! Linear colour written into rows of pixels.
//!
//! In: an outline, colours at its corners; spans of rows. Out: pixels of a canvas. Forbidden here: which pixels a polygon
//! covers.

use std::ops::Range;

use glam::{Vec3A, Vec4};
use wide::{f64x2, i16x8, i32x4, i32x8, u8x16};

use super::canvas::{CHUNK, ColorSpace, Pixel, pixel};
use super::scan::{Outline, Span};
use super::shade::{Channels, FRACTION, gradient};

/// Binary digits after the point of the steps within a chunk: with 9 before the point and a sign they fill 16 bits, so
/// that two pixels go through a register of the smallest size. Each value is rounded twice, to 1/128 level.
const CHUNK_FRACTION: u32 = 6;

/// How a run's pixels become a canvas's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Way {
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
    base: [i32; 3],
    /// Change a column.
    right: [i32; 3],
    /// Change a row.
    down: [i32; 3],
    /// Column and row; sides of surfaces fit.
    origin: [u16; 2],
    way: Way,
}

impl Run {
    pub(super) const NOTHING: Self =
        Self { base: [0; 3], right: [0; 3], down: [0; 3], origin: [0; 2], way: Way::Chunks };

    /// The colour of a polygon, `extent` pixels large, on a canvas, from a pixel within its bounds on. `is_beyond` as of
    /// [`Polygon`](super::slice::Polygon).
    #[inline(always)]
    pub(super) fn new(
        outline: Outline,
        (colors, is_beyond): ([Vec4; 4], bool),
        space: ColorSpace,
        [column, row]: [i32; 2],
        extent: f64,
    ) -> Self {
        // Beyond this, rounding of the gradient shows: a sliver that is thinner than any pixel's digits has one colour.
        const STEEPEST: f64 = (1u64 << 30) as f64;
        let (way, colors) = if is_beyond { clamped(&colors, space) } else { (Way::Chunks, colors) };
        let [mut right, mut down] = gradient(outline, &colors);
        let extent = if extent > 1.0 { extent } else { 1.0 };
        if !right.times(extent).are_below(STEEPEST) || !down.times(extent).are_below(STEEPEST) {
            (right, down) = (Channels::ZERO, Channels::ZERO);
        }
        let (corner_x, corner_y) = (outline.x.to_array()[0], outline.y.to_array()[0]);
        let x = f64::from(column) + 0.5 - corner_x;
        let y = f64::from(row) + 0.5 - corner_y;
        let half = Channels { pair: f64x2::splat(0.5), third: 0.5 };
        let base = Channels::new(colors[0]).plus(right.times(x)).plus(down.times(y)).plus(half);
        let origin = [column as u16, row as u16];
        Self { base: base.fixed(), right: right.fixed(), down: down.fixed(), origin, way }
    }

    /// The row of the pixel that it starts from.
    #[inline]
    pub(super) fn row(&self) -> i32 {
        self.origin[1].into()
    }

    /// What paints spans of a canvas, row by row from `row` on.
    #[inline(always)]
    pub(super) fn brush(&self, space: ColorSpace, row: i32) -> Brush<'_> {
        let [second, first, third] = self.right;
        let right = i32x4::new([second, first, third, 0]);
        let twice = right + right;
        let lanes = [pack(to_chunk(i32x4::ZERO), to_chunk(right)), pack(to_chunk(twice), to_chunk(twice + right))];
        let mut value = self.base;
        let below = row - self.row();
        // Most pieces begin in the band that is painted.
        if below != 0 {
            value = std::array::from_fn(|i| value[i].wrapping_add(self.down[i].wrapping_mul(below)));
        }
        Brush { run: self, space, value, lanes, advance: twice + twice }
    }
}

/// How a polygon is painted whose colours are beyond the range of chunks, and these as far as digits go: in RGB.
#[cold]
fn clamped(colors: &[Vec4; 4], space: ColorSpace) -> (Way, [Vec4; 4]) {
    // Far beyond what is seen, but within the digits.
    const FARTHEST: Vec3A = Vec3A::splat(767.0);
    let way = if space == ColorSpace::Rgb { Way::Pixels } else { Way::Converted };
    (way, colors.map(|color| ColorSpace::Rgb.of_rgb(space.to_rgb(color).clamp(-FARTHEST, FARTHEST))))
}

/// A run at work.
#[derive(Debug)]
pub(super) struct Brush<'a> {
    run: &'a Run,
    space: ColorSpace,
    /// Channels in the column of the origin, in the next row.
    value: [i32; 3],
    /// The steps from a chunk's first pixel to each, two pixels to a register.
    lanes: [i16x8; 2],
    /// The step to the next chunk.
    advance: i32x4,
}

impl Brush<'_> {
    /// Paints what a span holds of the next row. Colours are clamped to [0, 255] pixel by pixel and rounded to the
    /// nearest level.
    #[inline(always)]
    pub(super) fn paint(&mut self, pixels: &mut [Pixel], span: Span) {
        let columns = span.columns();
        if !columns.is_empty() {
            self.paint_columns(pixels, columns);
        }
        let Run { down, .. } = self.run;
        self.value = [0, 1, 2].map(|i| self.value[i].wrapping_add(down[i]));
    }

    #[inline(always)]
    fn paint_columns(&self, pixels: &mut [Pixel], columns: Range<usize>) {
        let Run { right, origin, way, .. } = self.run;
        let x = (columns.start as i32).wrapping_sub(origin[0].into());
        let at = |i: usize| self.value[i].wrapping_add(right[i].wrapping_mul(x));
        let values = [at(0), at(1), at(2)];
        if *way != Way::Chunks {
            return self.paint_pixels(&mut pixels[columns], values);
        }
        let mut value = i32x4::new([values[0], values[1], values[2], 0]);
        let mut left = columns.len();
        for chunk in pixels[columns.start..].as_chunks_mut::<CHUNK>().0 {
            let start = to_chunk(value);
            let start = pack(start, start);
            // Saturates to [0, 255].
            let painted = u8x16::narrow_i16x8(
                (start + self.lanes[0]) >> CHUNK_FRACTION as i32,
                (start + self.lanes[1]) >> CHUNK_FRACTION as i32,
            );
            if left <= CHUNK {
                return write(chunk, painted, left);
            }
            write(chunk, painted, CHUNK);
            left -= CHUNK;
            value += self.advance;
        }
    }

    #[inline(never)]
    fn paint_pixels(&self, pixels: &mut [Pixel], mut values: [i32; 3]) {
        for place in pixels {
            let [g, r, b] = values.map(|v| (v >> FRACTION).clamp(0, 255));
            *place = pixel(match self.run.way {
                Way::Converted => self.space.of_levels([r, g, b]),
                Way::Chunks | Way::Pixels => [r, g, b].map(|v| v as u8),
            });
            values = std::array::from_fn(|i| values[i].wrapping_add(self.run.right[i]));
        }
    }
}

/// Writes the first `count` pixels of a chunk.
#[inline]
fn write(chunk: &mut [Pixel; CHUNK], painted: u8x16, count: usize) {
    let Some(bytes) = chunk.as_flattened_mut().first_chunk_mut::<{ 4 * CHUNK }>() else { return };
    let mask = u8x16::new(MASKS[count]);
    *bytes = ((painted & mask) | (u8x16::new(*bytes) & !mask)).to_array();
}

/// All bits of the bytes of the first so many pixels.
const MASKS: [[u8; 4 * CHUNK]; CHUNK + 1] = {
    let mut masks = [[0; 4 * CHUNK]; CHUNK + 1];
    let mut i = 0;
    while i < (CHUNK + 1) * 4 * CHUNK {
        let (count, byte) = (i / (4 * CHUNK), i % (4 * CHUNK));
        if byte < 4 * count {
            masks[count][byte] = 255;
        }
        i += 1;
    }
    masks
};

/// Rounds values to the digits of a chunk.
#[inline]
fn to_chunk(values: i32x4) -> i32x4 {
    const SHIFT: u32 = FRACTION - CHUNK_FRACTION;
    (values + i32x4::new([1 << (SHIFT - 1); 4])) >> SHIFT as i32
}

/// Two pixels side by side. Where a polygon is, values fit 16 bits.
#[inline]
fn pack(first: i32x4, second: i32x4) -> i16x8 {
    let ([a, b, c, d], [e, f, g, h]) = (first.to_array(), second.to_array());
    i16x8::from_i32x8_saturate(i32x8::new([a, b, c, d, e, f, g, h]))
}

#[cfg(test)]
mod tests {
    use super::super::canvas::channels;
    use super::super::grid::{GRID_BITS, GridPoint};
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
        let run = Run::new(outline, colors, ColorSpace::Rgb, [0, 0], size as f64);
        let mut row = vec![[1; 4]; count + CHUNK];
        run.brush(ColorSpace::Rgb, 0).paint(&mut row, Span::of(0..count));
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
            let run = Run::new(outline, corner_colors(colors, space), space, [0, 0], 90.0);
            run.brush(space, row).paint(&mut found, Span::of(columns.clone()));
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
