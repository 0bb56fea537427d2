//! Linear colour inside a polygon: as a function ([`Shade`]), and written into rows of pixels ([`Run`]).

use std::ops::Range;

use glam::{DVec3, Vec3, Vec3A};
use wide::{i16x8, u8x16};

use super::canvas::{CHUNK, ColorSpace};
use super::coverage::Part;
use super::draw::Patch;
use super::scan::{GRID_BITS, GridPoint, center_distance, double_area, hull};

/// The linear colour of a polygon in RGB levels: its value at a corner and how it changes a pixel to the right and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shade {
    corner: GridPoint,
    color: Vec3A,
    right: Vec3A,
    down: Vec3A,
    low: Vec3A,
    high: Vec3A,
}

impl Shade {
    /// The field that the colours at the first three corners give.
    pub(super) fn new(corners: &[GridPoint], colors: &[Vec3; 4]) -> Self {
        let colors = colors.map(Vec3A::from);
        let (low, high) = range(&colors[..corners.len()]);
        let [right, down] = gradient([corners[0], corners[1], corners[2]], &colors);
        let (right, down) = (right.as_vec3a(), down.as_vec3a());
        Self { corner: corners[0], color: colors[0], right, down, low, high }
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
}

fn range(colors: &[Vec3A]) -> (Vec3A, Vec3A) {
    colors[1..].iter().fold((colors[0], colors[0]), |(low, high), color| (low.min(*color), high.max(*color)))
}

const PIXEL: f64 = 1.0 / (1i64 << GRID_BITS) as f64;

/// How the linear field that takes the colours at the first three corners changes a pixel to the right and down.
#[inline]
fn gradient(corners: [GridPoint; 3], colors: &[Vec3A; 4]) -> [DVec3; 2] {
    let [along_u, along_v] = [colors[1], colors[2]].map(|color| (color - colors[0]).as_dvec3());
    let side = |to: GridPoint| [(to.x - corners[0].x) as f64 * PIXEL, (to.y - corners[0].y) as f64 * PIXEL];
    let scale = 1.0 / double_area(corners);
    let ([ux, uy], [vx, vy]) = (side(corners[1]), side(corners[2]));
    [along_u * (vy * scale) - along_v * (uy * scale), along_v * (ux * scale) - along_u * (vx * scale)]
}

/// Binary digits after the point of a run's values. With 10 before it and a sign they fit 32 bits, in which sums may
/// overflow: where the polygon is they are right again.
const FRACTION: u32 = 20;
/// Binary digits after the point of the steps within a chunk: with 9 before the point and a sign they fill 16 bits, so
/// that eight pixels go through a register of the smallest size. Each value is rounded twice, to 1/128 level.
const CHUNK_FRACTION: u32 = 6;
/// Spans up to this long are painted pixel by pixel.
const SHORT: usize = 3;

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
    /// Channels at the centre of the pixel `origin`, and half a level, so that cutting off rounds.
    base: [i32; 3],
    /// Change a column.
    right: [i32; 3],
    /// Change a row.
    down: [i32; 3],
    /// Column and row.
    origin: [i32; 2],
    /// Columns of the polygon from there on.
    columns: u32,
    way: Way,
}

impl Run {
    pub(super) const NOTHING: Self =
        Self { base: [0; 3], right: [0; 3], down: [0; 3], origin: [0; 2], columns: 0, way: Way::Chunks };

    /// The colour of a patch on a canvas: of at most so many columns from a pixel on.
    #[inline]
    pub(super) fn new(patch: &Patch, space: ColorSpace, origin: [i32; 2], columns: u32) -> Self {
        // Far beyond what is seen, but within the digits.
        const FARTHEST: f32 = 767.0;
        // Beyond this, rounding of the gradient shows: a sliver that is thinner than any pixel's digits has one colour.
        const STEEPEST: f64 = (1u64 << 30) as f64;
        let corners = patch.corners();
        let mut colors = patch.colors.map(Vec3A::from);
        let (darkest, brightest) = range(&colors[..corners.len()]);
        let (lowest, highest) = (darkest.min_element(), brightest.max_element());
        let way = match space {
            ColorSpace::Yuv(matrix) if lowest >= 0.0 && highest <= 255.0 => {
                colors = colors.map(|color| matrix.of_levels(color));
                Way::Chunks
            }
            ColorSpace::Rgb if lowest >= -254.0 && highest <= 509.0 => Way::Chunks,
            _ => {
                colors = colors.map(|color| color.clamp(Vec3A::splat(-FARTHEST), Vec3A::splat(FARTHEST)));
                if space == ColorSpace::Rgb { Way::Pixels } else { Way::Converted }
            }
        };
        let (low, high) = hull(corners);
        let extent = ((high.x - low.x).max(high.y - low.y)) as f64 * PIXEL;
        let [mut right, mut down] = gradient([corners[0], corners[1], corners[2]], &colors);
        let steepest = right.abs().max_element().max(down.abs().max_element());
        // What is no number does not hold either.
        let holds = steepest * extent.max(1.0) < STEEPEST;
        if !holds {
            (right, down) = (DVec3::ZERO, DVec3::ZERO);
        }
        let offset = |from: i64, pixel: i32| ((i64::from(pixel) << GRID_BITS) + (1 << (GRID_BITS - 1)) - from) as f64;
        let (x, y) = (offset(corners[0].x, origin[0]) * PIXEL, offset(corners[0].y, origin[1]) * PIXEL);
        let base = colors[0].as_dvec3() + right * x + down * y + DVec3::splat(0.5);
        Self { base: fixed(base), right: fixed(right), down: fixed(down), origin, columns, way }
    }

    /// What paints spans of a canvas.
    #[inline]
    pub(super) fn brush(&self, space: ColorSpace) -> Brush<'_> {
        let wide = self.columns as usize > SHORT && self.way == Way::Chunks;
        Brush { run: self, space, lanes: if wide { self.right.map(lanes) } else { [[i16x8::ZERO; 2]; 3] } }
    }
}

/// A run at work.
#[derive(Debug)]
pub(super) struct Brush<'a> {
    run: &'a Run,
    space: ColorSpace,
    /// The steps from a chunk's first pixel to each, where there are chunks.
    lanes: [Lanes; 3],
}

impl Brush<'_> {
    /// Paints `columns` (not empty, within the canvas) of a row. Colours are clamped to [0, 255] pixel by pixel and
    /// rounded to the nearest level.
    #[inline]
    pub(super) fn paint(&self, channels: [&mut [u8]; 3], row: i32, columns: Range<usize>) {
        let run = self.run;
        let (x, y) = ((columns.start as i32).wrapping_sub(run.origin[0]), row.wrapping_sub(run.origin[1]));
        let values: [i32; 3] = std::array::from_fn(|i| {
            let moved = run.right[i].wrapping_mul(x).wrapping_add(run.down[i].wrapping_mul(y));
            run.base[i].wrapping_add(moved)
        });
        if columns.len() <= SHORT {
            if run.way != Way::Converted {
                return self.paint_pixels(channels, values, columns);
            }
        } else if run.way == Way::Chunks {
            let [first, second, third] = channels.map(|bytes| &mut bytes[columns.start..]);
            let advance = run.right.map(|right| right.wrapping_mul(CHUNK as i32));
            paint_chunks(first, values[0], advance[0], &self.lanes[0], columns.len());
            paint_chunks(second, values[1], advance[1], &self.lanes[1], columns.len());
            return paint_chunks(third, values[2], advance[2], &self.lanes[2], columns.len());
        }
        self.paint_others(channels, values, columns);
    }

    #[inline]
    fn paint_pixels(&self, channels: [&mut [u8]; 3], values: [i32; 3], columns: Range<usize>) {
        for (channel, bytes) in channels.into_iter().enumerate() {
            let mut value = values[channel];
            for byte in &mut bytes[columns.clone()] {
                *byte = (value >> FRACTION).clamp(0, 255) as u8;
                value = value.wrapping_add(self.run.right[channel]);
            }
        }
    }

    #[inline(never)]
    fn paint_others(&self, channels: [&mut [u8]; 3], mut values: [i32; 3], columns: Range<usize>) {
        if self.run.way != Way::Converted {
            return self.paint_pixels(channels, values, columns);
        }
        let [first, second, third] = channels;
        for column in columns {
            let pixel = self.space.of_levels(values.map(|v| (v >> FRACTION).clamp(0, 255)));
            [first[column], second[column], third[column]] = pixel;
            values = std::array::from_fn(|i| values[i].wrapping_add(self.run.right[i]));
        }
    }
}

/// Rounds to [`FRACTION`] digits; what is beyond 32 bits of that is cut off above. Values are below 2^31.
#[inline]
fn fixed(values: DVec3) -> [i32; 3] {
    // Added to 1.5 * 2^52, a number's last digits are those of the integer: cheaper than a checked cast.
    const ROUND: f64 = (3u64 << 51) as f64;
    values.to_array().map(|v| (v * f64::from(1 << FRACTION) + ROUND).to_bits() as i32)
}

/// Paints `count` bytes, chunk by chunk; there must be room for a whole last one.
#[inline]
fn paint_chunks(mut bytes: &mut [u8], mut value: i32, advance: i32, lanes: &Lanes, count: usize) {
    let mut left = count;
    while let Some((chunk, others)) = bytes.split_first_chunk_mut() {
        paint_chunk(chunk, to_chunk(value), lanes, left);
        if left <= CHUNK {
            return;
        }
        left -= CHUNK;
        bytes = others;
        value = value.wrapping_add(advance);
    }
}

/// The steps from a chunk's first pixel to each.
type Lanes = [i16x8; 2];

/// The steps of a chunk, given that from one pixel to the next.
#[inline]
fn lanes(right: i32) -> Lanes {
    const SHIFT: u32 = FRACTION - CHUNK_FRACTION;
    let lane = |i: i32| (right.wrapping_mul(i).wrapping_add(1 << (SHIFT - 1)) >> SHIFT) as i16;
    [0, 8].map(|from| i16x8::new(std::array::from_fn(|i| lane(from + i as i32))))
}

/// A value as the start of a chunk.
#[inline]
fn to_chunk(value: i32) -> i16 {
    const SHIFT: u32 = FRACTION - CHUNK_FRACTION;
    (value.wrapping_add(1 << (SHIFT - 1)) >> SHIFT) as i16
}

/// Paints the first `count` pixels of a chunk, all if there are more.
#[inline]
fn paint_chunk(bytes: &mut [u8; CHUNK], start: i16, lanes: &Lanes, count: usize) {
    let start = i16x8::splat(start);
    // Saturates to [0, 255].
    let painted =
        u8x16::narrow_i16x8((start + lanes[0]) >> CHUNK_FRACTION as i32, (start + lanes[1]) >> CHUNK_FRACTION as i32);
    if count >= CHUNK {
        *bytes = painted.to_array();
        return;
    }
    let mask = u8x16::new(MASKS[count]);
    *bytes = ((painted & mask) | (u8x16::new(*bytes) & !mask)).to_array();
}

/// All bits of the first so many bytes.
const MASKS: [[u8; CHUNK]; CHUNK] = {
    let mut masks = [[0; CHUNK]; CHUNK];
    let mut i = 0;
    while i < CHUNK * CHUNK {
        if i % CHUNK < i / CHUNK {
            masks[i / CHUNK][i % CHUNK] = 255;
        }
        i += 1;
    }
    masks
};

#[cfg(test)]
mod tests {
    use super::*;

    /// The first row of a polygon in RGB.
    fn painted(size: i64, colors: [[f32; 3]; 3], count: usize) -> Vec<[u8; 3]> {
        let at = |x, y| GridPoint { x: x << GRID_BITS, y: y << GRID_BITS };
        let colors = colors.map(Vec3::from_array);
        let patch = Patch::triangle([at(0, 0), at(size, 0), at(0, size)], colors, 0);
        let run = Run::new(&patch, ColorSpace::Rgb, [0, -1], size as u32);
        let mut rows = [(); 3].map(|()| vec![1; count + CHUNK]);
        run.brush(ColorSpace::Rgb).paint(rows.each_mut().map(Vec::as_mut_slice), 0, 0..count);
        assert!(rows.iter().all(|row| row[count..] == [1; CHUNK]), "pixels beyond the span are left alone");
        (0..count).map(|x| [rows[0][x], rows[1][x], rows[2][x]]).collect()
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
        let at = |x: i64, y: i64| GridPoint { x: x << GRID_BITS, y: y << GRID_BITS };
        let corners = [at(0, 0), at(90, 0), at(0, 70)];
        let paint = |patch: &Patch, space, row, columns: Range<usize>| {
            let mut found = [[0; 110]; 3];
            let channels = found.each_mut().map(|row| row.as_mut_slice());
            Run::new(patch, space, [0, 0], 90).brush(space).paint(channels, row, columns.clone());
            columns.map(|x| [found[0][x], found[1][x], found[2][x]]).collect::<Vec<_>>()
        };
        for matrix in [crate::video::YuvMatrix::Bt601, crate::video::YuvMatrix::Bt709] {
            for excess in [0.0, 40.0] {
                let colors = [[0.0 - excess, 20.0, 255.0], [255.0, 128.0, 3.0], [90.0, 255.0 + excess, 0.0]];
                let patch = Patch::triangle(corners, colors.map(Vec3::from_array), 0);
                for row in [0, 20, 60] {
                    let columns = 0..(90 - 90 * (row as usize + 1) / 70);
                    let found = paint(&patch, ColorSpace::Yuv(matrix), row, columns.clone());
                    for (found, rgb) in found.into_iter().zip(paint(&patch, ColorSpace::Rgb, row, columns)) {
                        let expected = ColorSpace::Yuv(matrix).of_levels(rgb.map(i32::from));
                        let near = found.iter().zip(&expected).all(|(a, b)| a.abs_diff(*b) <= 1);
                        assert!(near, "{matrix:?}, row {row}: {found:?} against {expected:?}");
                    }
                }
            }
        }
    }
}
