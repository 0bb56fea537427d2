//! The pixels of a band of rows on their way to a surface: four bytes each, in the channels of the surface.
//!
//! In: runs of pixels that a [`Run`](super::run::Run) fills in, single colours. Out: rows of pixels. Where the surface is
//! Y'CbCr so is the canvas: colours are converted at the corners of polygons, not at pixels. Channels lie side by side, as
//! most runs are a few pixels long: all that is written of one is in one place.

use glam::{Vec3A, Vec4};

use crate::video::{PixelFormat, YuvMatrix, rgb_to_yuv};

/// Pixels that are written at a time, at most. Rows have as much room beyond their end.
pub(super) const CHUNK: usize = PARTS * PART;

/// Parts of a chunk.
pub(super) const PARTS: usize = 2;

/// Pixels of a register of the smallest size.
pub(super) const PART: usize = 4;

/// The second channel, the first, the third, and a byte of no meaning: so both kinds of chroma have room for sums.
pub(super) type Pixel = [u8; 4];

/// A pixel of these channels.
#[inline]
pub(super) fn pixel([first, second, third]: [u8; 3]) -> Pixel {
    [second, first, third, 0]
}

/// The channels of a pixel.
#[inline]
pub(super) fn channels([second, first, third, _]: Pixel) -> [u8; 3] {
    [first, second, third]
}

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

    /// The channels of a colour given in RGB levels, in the order of a [`Pixel`].
    #[inline]
    pub(super) fn of_rgb(self, rgb: Vec3A) -> Vec4 {
        let [first, second, third] = match self {
            Self::Rgb => rgb.to_array(),
            Self::Yuv(matrix) => matrix.of_levels(rgb).to_array(),
        };
        Vec4::new(second, first, third, 0.0)
    }

    /// RGB levels of channels in the order of a [`Pixel`].
    pub(super) fn to_rgb(self, channels: Vec4) -> Vec3A {
        let channels = Vec3A::new(channels.y, channels.x, channels.z);
        match self {
            Self::Rgb => channels,
            Self::Yuv(matrix) => matrix.to_levels(channels),
        }
    }

    /// Whether a colour given in RGB levels may be painted chunk by chunk: within the range of a chunk and, where clamping
    /// and conversion could change places, in no need of clamping.
    pub(super) fn holds(self, rgb: Vec3A) -> bool {
        let (low, high) = match self {
            Self::Rgb => (-254.0, 509.0),
            Self::Yuv(_) => (0.0, 255.0),
        };
        rgb.cmpge(Vec3A::splat(low)).all() && rgb.cmple(Vec3A::splat(high)).all()
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

/// The rows of a canvas, as they lie in memory.
#[derive(Debug)]
pub(super) struct Rows<'a> {
    pub(super) pixels: &'a mut [Pixel],
    /// Pixels from a row to the next.
    pub(super) stride: u32,
}

impl Rows<'_> {
    /// The bytes of so many parts of a chunk from the pixel `start` on.
    #[inline(always)]
    pub(super) fn chunk_mut<const WIDTH: usize>(&mut self, start: u32) -> Option<&mut [[u8; 4 * PART]; WIDTH]> {
        let start = start as usize;
        let pixels = self.pixels.get_mut(start..start + WIDTH * PART)?;
        pixels.as_flattened_mut().as_chunks_mut().0.first_chunk_mut()
    }
}

/// The pixels of some rows.
#[derive(Debug)]
pub(super) struct Canvas {
    space: ColorSpace,
    width: usize,
    /// Row by row, each with [`CHUNK`] pixels more.
    pixels: Vec<Pixel>,
}

impl Canvas {
    /// A canvas without rows.
    pub(super) fn new() -> Self {
        Self { space: ColorSpace::Rgb, width: 0, pixels: Vec::new() }
    }

    /// Starts anew, all black.
    #[inline(always)]
    pub(super) fn start(&mut self, space: ColorSpace, width: usize, rows: usize) {
        (self.space, self.width) = (space, width);
        let black = match space {
            ColorSpace::Rgb => pixel([0; 3]),
            ColorSpace::Yuv(_) => pixel([16, 128, 128]),
        };
        self.pixels.resize((width + CHUNK) * rows, black);
        self.pixels.fill(black);
    }

    /// The pixels of a row, and [`CHUNK`] more.
    #[inline]
    pub(super) fn row_mut(&mut self, row: usize) -> &mut [Pixel] {
        let stride = self.width + CHUNK;
        &mut self.pixels[stride * row..][..stride]
    }

    /// All rows.
    #[inline]
    pub(super) fn rows_mut(&mut self) -> Rows<'_> {
        Rows { pixels: &mut self.pixels, stride: (self.width + CHUNK) as u32 }
    }

    /// The pixels of a row.
    #[inline]
    pub(super) fn row(&self, row: usize) -> &[Pixel] {
        &self.pixels[(self.width + CHUNK) * row..][..self.width]
    }

    /// Paints one pixel in a colour given in RGB levels.
    #[inline]
    pub(super) fn set(&mut self, column: usize, row: usize, color: Vec3A) {
        let packed = self.space.pack(color);
        self.row_mut(row)[column] = pixel(packed);
    }

    /// Makes one pixel stand out: halfway to white where it is dark, to black where it is light.
    pub(super) fn set_apart(&mut self, column: usize, row: usize) {
        let space = self.space;
        let place = &mut self.row_mut(row)[column];
        let before = channels(*place);
        // Green stands for how light a colour is, as luma mostly does.
        let other = match space {
            ColorSpace::Rgb if before[1] < 128 => [255; 3],
            ColorSpace::Rgb => [0; 3],
            ColorSpace::Yuv(_) if before[0] < 126 => [235, 128, 128],
            ColorSpace::Yuv(_) => [16, 128, 128],
        };
        *place = pixel(std::array::from_fn(|channel| before[channel].midpoint(other[channel])));
    }
}
