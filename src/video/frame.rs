//! One 8-bit RGB picture.

use thiserror::Error;

/// Largest width or height of a picture, in pixels.
pub const MAX_FRAME_SIDE: u32 = 8192;

/// Why a [`Frame`] could not be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum FrameError {
    /// Width or height is zero or beyond [`MAX_FRAME_SIDE`].
    #[error("frame size: expected sides of 1 to {MAX_FRAME_SIDE} pixels, found {width}x{height}")]
    Size {
        /// Width found, in pixels.
        width: u32,
        /// Height found, in pixels.
        height: u32,
    },
    /// The number of pixels does not match the size.
    #[error("frame data: expected {expected} pixels, found {found}")]
    PixelCount {
        /// width * height.
        expected: usize,
        /// Length of the data handed in.
        found: usize,
    },
}

/// An RGB picture, 8 bits a channel, rows top to bottom without padding.
///
/// Pixel (i, j) covers [i, i+1) x [j, j+1); its sample sits at the centre.
#[derive(Clone, PartialEq, Eq)]
pub struct Frame {
    width: u32,
    height: u32,
    pixels: Vec<[u8; 3]>,
}

impl std::fmt::Debug for Frame {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Frame({}x{})", self.width, self.height)
    }
}

impl Frame {
    /// Wraps `pixels` (row-major, `width * height` of them).
    pub fn try_new(width: u32, height: u32, pixels: Vec<[u8; 3]>) -> Result<Self, FrameError> {
        Self::check_size(width, height)?;
        let expected = width as usize * height as usize;
        if pixels.len() != expected {
            return Err(FrameError::PixelCount { expected, found: pixels.len() });
        }
        Ok(Self { width, height, pixels })
    }

    /// Builds a picture by asking `color(x, y)` for every pixel.
    pub fn from_fn(width: u32, height: u32, color: impl Fn(u32, u32) -> [u8; 3]) -> Result<Self, FrameError> {
        Self::check_size(width, height)?;
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| color(x, y)).collect();
        Ok(Self { width, height, pixels })
    }

    /// Checks a picture's size before anything is allocated for it.
    pub fn check_size(width: u32, height: u32) -> Result<(), FrameError> {
        let fits = |side| (1..=MAX_FRAME_SIDE).contains(&side);
        if fits(width) && fits(height) { Ok(()) } else { Err(FrameError::Size { width, height }) }
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All pixels, row-major.
    pub fn pixels(&self) -> &[[u8; 3]] {
        &self.pixels
    }

    /// All pixels, row-major, to write to.
    pub fn pixels_mut(&mut self) -> &mut [[u8; 3]] {
        &mut self.pixels
    }

    /// One row of pixels.
    pub fn row(&self, y: u32) -> &[[u8; 3]] {
        let start = y as usize * self.width as usize;
        &self.pixels[start..start + self.width as usize]
    }

    /// The colour of pixel (x, y).
    pub fn pixel(&self, x: u32, y: u32) -> [u8; 3] {
        self.row(y)[x as usize]
    }
}
