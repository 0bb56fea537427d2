//! Painted rows into a surface's pixel format.

use std::ops::Range;

use super::canvas::{Canvas, ColorSpace};
use crate::video::{PixelFormat, Surface};

/// Rows that are painted together: at 3840 pixels a row 370 kB, which stay in the second-level cache. Even,
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

    /// Writes the band's rows. Unused bytes of 4-byte formats become 255.
    pub(super) fn pack(&mut self, canvas: &Canvas) {
        match self.format {
            PixelFormat::Rgb => self.pack_rows(canvas, |r, g, b| [r, g, b]),
            PixelFormat::Rgbx => self.pack_rows(canvas, |r, g, b| [r, g, b, 255]),
            PixelFormat::Bgrx => self.pack_rows(canvas, |r, g, b| [b, g, r, 255]),
            PixelFormat::I420 | PixelFormat::Nv12 => {
                let (luma, stride) = &mut self.planes[0];
                for (row, bytes) in luma.chunks_mut(*stride).enumerate() {
                    bytes[..self.width].copy_from_slice(canvas.row(row, 0));
                }
                self.pack_chroma(canvas);
            }
        }
    }

    /// Writes the only plane.
    fn pack_rows<const N: usize>(&mut self, canvas: &Canvas, layout: impl Fn(u8, u8, u8) -> [u8; N]) {
        let (bytes, stride) = &mut self.planes[0];
        for (row, bytes) in bytes.chunks_mut(*stride).enumerate() {
            let [r, g, b] = [0, 1, 2].map(|channel| canvas.row(row, channel));
            let (pixels, _) = bytes[..N * self.width].as_chunks_mut::<N>();
            for (((pixel, &r), &g), &b) in pixels.iter_mut().zip(r).zip(g).zip(b) {
                *pixel = layout(r, g, b);
            }
        }
    }

    /// Writes U and V: at even columns, halfway between two rows, as MPEG-2 and its heirs site them. So a sample is
    /// the mean of two rows and of columns weighted 1, 2, 1.
    fn pack_chroma(&mut self, canvas: &Canvas) {
        let (rows, samples) = (self.rows.len(), self.width.div_ceil(2));
        let interleaved = self.format == PixelFormat::Nv12;
        for channel in [1, 2] {
            let (bytes, stride) = &mut self.planes[if interleaved { 1 } else { channel }];
            for (pair, bytes) in bytes.chunks_mut(*stride).enumerate() {
                // An odd last row stands for both.
                let rows = [2 * pair, (2 * pair + 1).min(rows - 1)].map(|row| canvas.row(row, channel));
                if interleaved {
                    let (places, _) = bytes[..2 * samples].as_chunks_mut::<2>();
                    halve(rows, places, |place, sample| place[channel - 1] = sample);
                } else {
                    halve(rows, &mut bytes[..samples], |place, sample| *place = sample);
                }
            }
        }
    }
}

/// Makes one row of half the width from two, sample by sample.
#[inline]
fn halve<P>(rows: [&[u8]; 2], places: &mut [P], put: impl Fn(&mut P, u8)) {
    let width = rows[0].len();
    let sum = |before: u16, here: u16, after: u16| before + 2 * here + after;
    let mean = |sum: u16| ((sum + 4) >> 3) as u8;
    // Pairs of bytes as numbers of 16 bits are what vector units take apart fastest: the lower half is the first byte.
    let [[upper, lower], [upper_before, lower_before]] = [2, 1].map(|from| rows.map(|row| pairs(row, from)));
    let inner = places.iter_mut().skip(1).zip(upper.zip(lower)).zip(upper_before.zip(lower_before));
    inner.for_each(|((place, (upper, lower)), (upper_before, lower_before))| {
        let row = |before: u16, pair: u16| sum(before & 255, pair & 255, pair >> 8);
        put(place, mean(row(upper_before, upper) + row(lower_before, lower)));
    });
    // Beyond the ends of a row its outermost columns stand in.
    let edge = |before: usize, here: usize, after: usize| {
        mean(rows.map(|row| sum(row[before].into(), row[here].into(), row[after].into())).iter().sum())
    };
    put(&mut places[0], edge(0, 0, 1.min(width - 1)));
    if width % 2 == 1 && width > 1 {
        put(&mut places[width / 2], edge(width - 2, width - 1, width - 1));
    }
}

/// A row's columns two by two, from a column on.
fn pairs(row: &[u8], from: usize) -> impl Iterator<Item = u16> {
    row.get(from..).unwrap_or_default().as_chunks::<2>().0.iter().map(|&pair| u16::from_le_bytes(pair))
}
