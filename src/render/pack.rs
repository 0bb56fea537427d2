//! Painted rows into a surface's pixel format.

use std::ops::Range;

use super::shade::Rgb32;
use crate::video::{PixelFormat, Surface, YuvMatrix, rgb_to_yuv};

/// Rows that are painted together: at 3840 pixels a row half a megabyte, which stays in the second-level cache. Even,
/// so that rows that share chroma stay together.
pub(super) const BAND_ROWS: usize = 32;

/// A band of a surface's rows.
pub(super) struct Band<'a> {
    index: usize,
    rows: Range<i32>,
    width: usize,
    format: PixelFormat,
    matrix: YuvMatrix,
    /// The band's bytes in each plane, and the plane's stride.
    planes: Vec<(&'a mut [u8], usize)>,
}

/// Cuts a surface into bands, top to bottom.
pub(super) fn bands<'a>(surface: &'a mut Surface<'_>) -> Vec<Band<'a>> {
    let (width, height) = (surface.width() as usize, surface.height() as usize);
    let (format, matrix) = (surface.format(), surface.matrix());
    let mut bands: Vec<Band<'a>> = (0..height.div_ceil(BAND_ROWS))
        .map(|index| {
            let rows = (index * BAND_ROWS) as i32..((index + 1) * BAND_ROWS).min(height) as i32;
            Band { index, rows, width, format, matrix, planes: Vec::new() }
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

    /// Its rows on the surface.
    pub(super) fn rows(&self) -> Range<i32> {
        self.rows.clone()
    }

    /// Writes `pixels`, the band's rows without padding. Unused bytes of 4-byte formats become 255.
    pub(super) fn pack(&mut self, pixels: &[Rgb32]) {
        match self.format {
            PixelFormat::Rgb => self.pack_rows(pixels, |[r, g, b]| [r, g, b]),
            PixelFormat::Rgbx => self.pack_rows(pixels, |[r, g, b]| [r, g, b, 255]),
            PixelFormat::Bgrx => self.pack_rows(pixels, |[r, g, b]| [b, g, r, 255]),
            PixelFormat::I420 | PixelFormat::Nv12 => {
                let matrix = self.matrix;
                self.pack_rows(pixels, |rgb| [rgb_to_yuv(matrix, rgb.map(i32::from), 1)[0]]);
                self.pack_chroma(pixels);
            }
        }
    }

    /// Writes the first plane.
    fn pack_rows<const N: usize>(&mut self, pixels: &[Rgb32], layout: impl Fn([u8; 3]) -> [u8; N]) {
        let (bytes, stride) = &mut self.planes[0];
        for (row, pixels) in bytes.chunks_mut(*stride).zip(pixels.chunks_exact(self.width)) {
            for (bytes, &pixel) in row.chunks_exact_mut(N).zip(pixels) {
                bytes.copy_from_slice(&layout(channels(pixel)));
            }
        }
    }

    /// Writes U and V: at even columns, halfway between two rows, as MPEG-2 and its heirs site them. So a sample is
    /// the mean of two rows and of columns weighted 1, 2, 1.
    fn pack_chroma(&mut self, pixels: &[Rgb32]) {
        let (width, matrix, interleaved) = (self.width, self.matrix, self.format == PixelFormat::Nv12);
        let (_, chroma) = self.planes.split_at_mut(1);
        let stride = chroma[0].1;
        for (pair, rows) in pixels.chunks(2 * width).enumerate() {
            // An odd last row stands for both.
            let (upper, lower) = (&rows[..width], &rows[rows.len() - width..]);
            for i in 0..width.div_ceil(2) {
                let columns = [(2 * i).saturating_sub(1), 2 * i, 2 * i, (2 * i + 1).min(width - 1)];
                let mut sum = [0; 3];
                for pixel in columns.into_iter().flat_map(|x| [upper[x], lower[x]]) {
                    sum.iter_mut().zip(channels(pixel)).for_each(|(sum, v)| *sum += i32::from(v));
                }
                let [_, u, v] = rgb_to_yuv(matrix, sum, 8);
                if interleaved {
                    chroma[0].0[pair * stride + 2 * i] = u;
                    chroma[0].0[pair * stride + 2 * i + 1] = v;
                } else {
                    chroma[0].0[pair * stride + i] = u;
                    let stride = chroma[1].1;
                    chroma[1].0[pair * stride + i] = v;
                }
            }
        }
    }
}

fn channels(pixel: Rgb32) -> [u8; 3] {
    let [r, g, b, _] = pixel.to_le_bytes();
    [r, g, b]
}
