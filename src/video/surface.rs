//! Pictures to draw into, in the formats that players use.

use thiserror::Error;

use super::Frame;

/// Memory layout of a picture. Names are GStreamer's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum PixelFormat {
    /// 3 bytes a pixel: R, G, B.
    Rgb,
    /// 4 bytes a pixel: R, G, B, unused.
    Rgbx,
    /// 4 bytes a pixel: B, G, R, unused.
    Bgrx,
    /// Planar Y, U, V, chroma halved both ways (odd sides rounded up).
    I420,
    /// Planar Y, then U and V interleaved, chroma halved both ways (odd sides rounded up).
    Nv12,
}

/// Matrix and range of Y'CbCr formats.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub enum YuvMatrix {
    /// BT.601, limited range.
    #[default]
    Bt601,
    /// BT.709, limited range.
    Bt709,
}

/// One plane of a [`Surface`].
#[derive(Debug)]
pub struct Plane<'a> {
    /// The plane's bytes; row y starts at `y * stride`.
    pub data: &'a mut [u8],
    /// Bytes from one row to the next.
    pub stride: usize,
}

/// A picture to draw into; memory is the caller's.
#[derive(Debug)]
pub struct Surface<'a> {
    format: PixelFormat,
    matrix: YuvMatrix,
    width: u32,
    height: u32,
    planes: Vec<Plane<'a>>,
}

/// Why a [`Surface`] could not be made.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum SurfaceError {
    /// Width or height is zero or beyond [`MAX_SURFACE_SIDE`].
    #[error("surface size: expected sides of 1 to {MAX_SURFACE_SIDE} pixels, found {width}x{height}")]
    Size {
        /// Width found, in pixels.
        width: u32,
        /// Height found, in pixels.
        height: u32,
    },
    /// The format has another number of planes.
    #[error("surface planes: expected {expected}, found {found}")]
    PlaneCount {
        /// Planes of the format.
        expected: usize,
        /// Planes handed in.
        found: usize,
    },
    /// A plane's stride or length is too small for the size.
    #[error("surface plane {plane}: expected at least {expected} bytes, found {found}")]
    PlaneSize {
        /// Number of the plane.
        plane: usize,
        /// Bytes needed.
        expected: usize,
        /// Bytes handed in.
        found: usize,
    },
}

/// Largest width or height that can be drawn, in pixels.
pub const MAX_SURFACE_SIDE: u32 = 16384;

impl PixelFormat {
    /// (bytes a row, rows) of each plane of a `width` x `height` picture without padding.
    pub fn plane_sizes(self, width: u32, height: u32) -> Vec<(usize, usize)> {
        let (w, h) = (width as usize, height as usize);
        let (cw, ch) = (w.div_ceil(2), h.div_ceil(2));
        match self {
            Self::Rgb => vec![(3 * w, h)],
            Self::Rgbx | Self::Bgrx => vec![(4 * w, h)],
            Self::I420 => vec![(w, h), (cw, ch), (cw, ch)],
            Self::Nv12 => vec![(w, h), (2 * cw, ch)],
        }
    }
}

impl<'a> Surface<'a> {
    /// Wraps `planes`.
    ///
    /// # Errors
    /// A size beyond the limits, or planes that do not hold the picture.
    pub fn try_new(
        format: PixelFormat,
        matrix: YuvMatrix,
        (width, height): (u32, u32),
        planes: Vec<Plane<'a>>,
    ) -> Result<Self, SurfaceError> {
        let fits = |side| (1..=MAX_SURFACE_SIDE).contains(&side);
        if !fits(width) || !fits(height) {
            return Err(SurfaceError::Size { width, height });
        }
        let sizes = format.plane_sizes(width, height);
        if sizes.len() != planes.len() {
            return Err(SurfaceError::PlaneCount { expected: sizes.len(), found: planes.len() });
        }
        for (plane, (given, &(row_bytes, rows))) in planes.iter().zip(&sizes).enumerate() {
            let expected = given.stride.max(row_bytes).saturating_mul(rows - 1).saturating_add(row_bytes);
            let found = if given.stride < row_bytes { given.stride } else { given.data.len() };
            if found < expected.min(row_bytes) || (given.stride >= row_bytes && found < expected) {
                return Err(SurfaceError::PlaneSize { plane, expected, found });
            }
        }
        Ok(Self { format, matrix, width, height, planes })
    }

    /// The pixels of `frame`, to draw over.
    pub fn of_frame(frame: &'a mut Frame) -> Self {
        let (width, height) = (frame.width(), frame.height());
        let planes = vec![Plane { data: frame.pixels_mut().as_flattened_mut(), stride: 3 * width as usize }];
        Self { format: PixelFormat::Rgb, matrix: YuvMatrix::default(), width, height, planes }
    }

    /// Layout.
    pub fn format(&self) -> PixelFormat {
        self.format
    }

    /// Matrix of Y'CbCr formats; without meaning for RGB ones.
    pub fn matrix(&self) -> YuvMatrix {
        self.matrix
    }

    /// Width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// The planes, to write to.
    pub fn planes_mut(&mut self) -> &mut [Plane<'a>] {
        &mut self.planes
    }
}
