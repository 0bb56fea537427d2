//! The pixels of a band of rows on their way to a surface: three planes of bytes, in the channels of the surface.
//!
//! In: runs of pixels that a [`Run`](super::shade::Run) fills in, single colours. Out: rows of each channel. Where the
//! surface is Y'CbCr so is the canvas: colours are converted at the corners of polygons, not at pixels.

use glam::Vec3A;

use crate::video::{PixelFormat, YuvMatrix, rgb_to_yuv};

/// Pixels that are written at a time. Rows have as much room beyond their end.
pub(super) const CHUNK: usize = 16;

/// What a canvas's three channels are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColorSpace {
    /// R, G, B.
    Rgb,
    /// Y, Cb, Cr.
    Yuv(YuvMatrix),
}

impl ColorSpace {
    /// The channels that a surface is painted in.
    pub(super) fn of(format: PixelFormat, matrix: YuvMatrix) -> Self {
        match format {
            PixelFormat::Rgb | PixelFormat::Rgbx | PixelFormat::Bgrx => Self::Rgb,
            PixelFormat::I420 | PixelFormat::Nv12 => Self::Yuv(matrix),
        }
    }

    /// Rounds and clamps a colour given in RGB levels.
    #[inline]
    pub(super) fn pack(self, color: Vec3A) -> [u8; 3] {
        let rgb = (color + 0.5).clamp(Vec3A::ZERO, Vec3A::splat(255.0)).to_array().map(|v| v as i32);
        self.of_levels(rgb)
    }

    /// The channels of RGB levels in [0, 255].
    #[inline]
    pub(super) fn of_levels(self, rgb: [i32; 3]) -> [u8; 3] {
        match self {
            Self::Rgb => rgb.map(|v| v as u8),
            Self::Yuv(matrix) => rgb_to_yuv(matrix, rgb),
        }
    }
}

/// The pixels of some rows.
#[derive(Debug)]
pub(super) struct Canvas {
    space: ColorSpace,
    width: usize,
    /// Bytes of a channel's row.
    stride: usize,
    /// Row by row, the three channels of each one after the other.
    bytes: Vec<u8>,
}

impl Canvas {
    /// A canvas without rows.
    pub(super) fn new() -> Self {
        Self { space: ColorSpace::Rgb, width: 0, stride: 0, bytes: Vec::new() }
    }

    /// Starts anew, all black.
    pub(super) fn start(&mut self, space: ColorSpace, width: usize, rows: usize) {
        (self.space, self.width, self.stride) = (space, width, width + CHUNK);
        self.bytes.clear();
        match space {
            ColorSpace::Rgb => self.bytes.resize(3 * self.stride * rows, 0),
            ColorSpace::Yuv(_) => {
                self.bytes.resize(3 * self.stride * rows, 128);
                for row in self.bytes.chunks_exact_mut(3 * self.stride) {
                    row[..self.stride].fill(16);
                }
            }
        }
    }

    /// Channels of a row; [`CHUNK`] bytes more than the row is long.
    #[inline]
    pub(super) fn row_mut(&mut self, row: usize) -> [&mut [u8]; 3] {
        let channels = &mut self.bytes[3 * self.stride * row..][..3 * self.stride];
        let (first, others) = channels.split_at_mut(self.stride);
        let (second, third) = others.split_at_mut(self.stride);
        [first, second, third]
    }

    /// A channel of a row.
    #[inline]
    pub(super) fn row(&self, row: usize, channel: usize) -> &[u8] {
        &self.bytes[self.stride * (3 * row + channel)..][..self.width]
    }

    /// Paints one pixel in a colour given in RGB levels.
    #[inline]
    pub(super) fn set(&mut self, column: usize, row: usize, color: Vec3A) {
        let packed = self.space.pack(color);
        for (channel, value) in self.row_mut(row).into_iter().zip(packed) {
            channel[column] = value;
        }
    }

    /// Makes one pixel stand out: halfway to white where it is dark, to black where it is light.
    pub(super) fn set_apart(&mut self, column: usize, row: usize) {
        let space = self.space;
        let [first, second, third] = self.row_mut(row);
        // Green stands for how light a colour is, as luma mostly does.
        let other = match space {
            ColorSpace::Rgb if second[column] < 128 => [255; 3],
            ColorSpace::Rgb => [0; 3],
            ColorSpace::Yuv(_) if first[column] < 126 => [235, 128, 128],
            ColorSpace::Yuv(_) => [16, 128, 128],
        };
        for (channel, other) in [first, second, third].into_iter().zip(other) {
            channel[column] = channel[column].midpoint(other);
        }
    }
}
