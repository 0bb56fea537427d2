//! Painted rows into a surface's pixel format.

use std::ops::Range;

use super::canvas::{Canvas, ColorSpace, Pixel, channels};
use super::cpu::{self, Kernel};
use crate::video::{PixelFormat, Surface};

/// Rows that are painted together: at 3840 pixels a row 490 kB, which stay in the second-level cache. Even,
/// so that rows that share chroma stay together.
pub(super) const BAND_ROWS: usize = 32;

/// A band of a surface's rows.
pub(super) struct Band<'a> {
    index: usize,
    rows: Range<i32>,
    width: usize,
    format: PixelFormat,
    space: ColorSpace,
    /// The band's bytes in each plane, and the plane's stride.
    planes: Vec<(&'a mut [u8], usize)>,
}

/// Cuts a surface into bands, top to bottom.
pub(super) fn bands<'a>(surface: &'a mut Surface<'_>) -> Vec<Band<'a>> {
    let (width, height) = (surface.width() as usize, surface.height() as usize);
    let format = surface.format();
    let space = ColorSpace::of(format, surface.matrix());
    let mut bands: Vec<Band<'a>> = (0..height.div_ceil(BAND_ROWS))
        .map(|index| {
            let rows = (index * BAND_ROWS) as i32..((index + 1) * BAND_ROWS).min(height) as i32;
            Band { index, rows, width, format, space, planes: Vec::new() }
        })
        .collect();
    for (number, plane) in surface.planes_mut().iter_mut().enumerate() {
        let rows = if number == 0 { BAND_ROWS } else { BAND_ROWS / 2 };
        for (band, bytes) in bands.iter_mut().zip(plane.data.chunks_mut(plane.stride.saturating_mul(rows))) {
            band.planes.push((bytes, plane.stride));
        }
    }
    bands
}

impl Band<'_> {
    /// The band's number, from the top.
    pub(super) fn index(&self) -> usize {
        self.index
    }

    /// What it is to be painted in.
    pub(super) fn space(&self) -> ColorSpace {
        self.space
    }

    /// Its rows on the surface.
    pub(super) fn rows(&self) -> Range<i32> {
        self.rows.clone()
    }

    /// Writes the band's rows. Unused bytes of 4-byte formats become 255. `chroma` is memory for a row of it.
    pub(super) fn pack(&mut self, canvas: &Canvas, chroma: &mut Vec<[u8; 2]>) {
        cpu::run(Packing { band: self, canvas, chroma });
    }

    /// Writes the first plane.
    #[inline(always)]
    fn pack_rows<const N: usize>(&mut self, canvas: &Canvas, layout: impl Fn(Pixel) -> [u8; N]) {
        let (bytes, stride) = &mut self.planes[0];
        for (row, bytes) in bytes.chunks_mut(*stride).enumerate() {
            let (places, _) = bytes[..N * self.width].as_chunks_mut::<N>();
            for (place, &pixel) in places.iter_mut().zip(canvas.row(row)) {
                *place = layout(pixel);
            }
        }
    }

    /// Writes U and V: at even columns, halfway between two rows, as MPEG-2 and its heirs site them. So a sample is
    /// the mean of two rows and of columns weighted 1, 2, 1.
    #[inline(always)]
    fn pack_chroma(&mut self, canvas: &Canvas, row: &mut Vec<[u8; 2]>) {
        let (rows, samples) = (self.rows.len(), self.width.div_ceil(2));
        // An odd last row stands for both.
        let pair = |pair: usize| [2 * pair, (2 * pair + 1).min(rows - 1)].map(|row| canvas.row(row));
        match &mut self.planes[1..] {
            [(both, stride)] => {
                for (number, bytes) in both.chunks_mut(*stride).enumerate() {
                    halve(pair(number), bytes[..2 * samples].as_chunks_mut().0);
                }
            }
            [(first, first_stride), (second, second_stride)] => {
                row.resize(samples, [0; 2]);
                let bytes = first.chunks_mut(*first_stride).zip(second.chunks_mut(*second_stride));
                for (number, (first, second)) in bytes.enumerate() {
                    halve(pair(number), row);
                    first.iter_mut().zip(&*row).for_each(|(place, &[u, _])| *place = u);
                    second.iter_mut().zip(&*row).for_each(|(place, &[_, v])| *place = v);
                }
            }
            _ => (),
        }
    }
}

/// See [`Band::pack`].
struct Packing<'a, 'b> {
    band: &'a mut Band<'b>,
    canvas: &'a Canvas,
    chroma: &'a mut Vec<[u8; 2]>,
}

impl Kernel for Packing<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { band, canvas, chroma } = self;
        match band.format {
            PixelFormat::Rgb => band.pack_rows(canvas, channels),
            PixelFormat::Rgbx => band.pack_rows(canvas, |[g, r, b, _]| [r, g, b, 255]),
            PixelFormat::Bgrx => band.pack_rows(canvas, |[g, r, b, _]| [b, g, r, 255]),
            PixelFormat::I420 | PixelFormat::Nv12 => {
                band.pack_rows(canvas, |pixel| [(u32::from_le_bytes(pixel) >> 8) as u8]);
                band.pack_chroma(canvas, chroma);
            }
        }
    }
}

/// Both kinds of chroma of a pixel, each in a half of its own with room for sums.
#[inline]
fn chroma(pixel: Pixel) -> u32 {
    u32::from_le_bytes(pixel) & 0x00ff_00ff
}

/// Makes one row of chroma of half the width from two rows of pixels, sample by sample.
#[inline(always)]
fn halve(rows: [&[Pixel]; 2], places: &mut [[u8; 2]]) {
    let width = rows[0].len();
    let mean = |sum: u32| {
        let [u, _, v, _] = ((sum + 0x0004_0004) >> 3).to_le_bytes();
        [u, v]
    };
    let sum = |before: Pixel, here: Pixel, after: Pixel| chroma(before) + 2 * chroma(here) + chroma(after);
    let [upper, lower] = rows.map(|row| pairs(row, 1).iter().zip(pairs(row, 2)));
    let inner = places.iter_mut().skip(1).zip(upper.zip(lower));
    inner.for_each(|(place, ((&[a, b], &[_, c]), (&[d, e], &[_, f])))| *place = mean(sum(a, b, c) + sum(d, e, f)));
    // Beyond the ends of a row its outermost columns stand in.
    let edge = |before: usize, here: usize, after: usize| {
        mean(rows.map(|row| sum(row[before], row[here], row[after])).iter().sum())
    };
    places[0] = edge(0, 0, 1.min(width - 1));
    if width % 2 == 1 && width > 1 {
        places[width / 2] = edge(width - 2, width - 1, width - 1);
    }
}

/// A row's pixels two by two, from a column on.
fn pairs(row: &[Pixel], from: usize) -> &[[Pixel; 2]] {
    row.get(from..).unwrap_or_default().as_chunks().0
}
