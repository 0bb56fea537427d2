//! Colour conversion: Y'CbCr of BT.601 and BT.709, limited range, and pictures from planes of bytes.

use glam::Vec3A;
use thiserror::Error;

use super::{Frame, FrameError, PixelFormat, YuvMatrix};

/// One plane of a picture to read.
#[derive(Debug, Clone, Copy)]
pub struct PlaneRef<'a> {
    /// The plane's bytes; row y starts at `y * stride`.
    pub data: &'a [u8],
    /// Bytes from one row to the next.
    pub stride: usize,
}

/// Why planes of bytes are not a picture.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ConvertError {
    /// The size is beyond the limits of [`Frame`].
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// The format has another number of planes.
    #[error("picture planes: expected {expected}, found {found}")]
    PlaneCount {
        /// Planes of the format.
        expected: usize,
        /// Planes handed in.
        found: usize,
    },
    /// A row does not fit the stride.
    #[error("picture plane {plane}: expected a stride of at least {expected} bytes, found {found}")]
    Stride {
        /// Number of the plane.
        plane: usize,
        /// Bytes of a row.
        expected: usize,
        /// The stride handed in.
        found: usize,
    },
    /// A plane is too short.
    #[error("picture plane {plane}: expected at least {expected} bytes, found {found}")]
    PlaneSize {
        /// Number of the plane.
        plane: usize,
        /// Bytes needed.
        expected: usize,
        /// Bytes handed in.
        found: usize,
    },
}

/// Digits after the point of the matrices' integer coefficients.
const BITS: u32 = 16;

impl YuvMatrix {
    /// Weights of red and blue in luma (ITU-R BT.601, BT.709).
    const fn luma_weights(self) -> (f64, f64) {
        match self {
            Self::Bt601 => (0.299, 0.114),
            Self::Bt709 => (0.2126, 0.0722),
        }
    }

    /// Rows Y, Cb, Cr over R, G, B; luma spans 219 levels, chroma 224.
    const fn forward(self) -> [[i64; 3]; 3] {
        let (kr, kb) = self.luma_weights();
        let kg = 1.0 - kr - kb;
        let (y, cb, cr) = (219.0 / 255.0, 112.0 / 255.0 / (1.0 - kb), 112.0 / 255.0 / (1.0 - kr));
        [
            [fixed(y * kr), fixed(y * kg), fixed(y * kb)],
            [fixed(-cb * kr), fixed(-cb * kg), fixed(cb * (1.0 - kb))],
            [fixed(cr * (1.0 - kr)), fixed(-cr * kg), fixed(-cr * kb)],
        ]
    }

    /// Y, Cb, Cr of a colour in RGB levels, not rounded.
    #[inline]
    pub(crate) fn of_levels(self, rgb: Vec3A) -> Vec3A {
        const COLUMNS: [[Vec3A; 3]; 2] = [columns(YuvMatrix::Bt601.forward()), columns(YuvMatrix::Bt709.forward())];
        const BLACK: Vec3A = Vec3A::new(OFFSETS[0] as f32, OFFSETS[1] as f32, OFFSETS[2] as f32);
        let [r, g, b] = COLUMNS[usize::from(self == Self::Bt709)];
        r * rgb.x + g * rgb.y + b * rgb.z + BLACK
    }

    /// RGB levels from Y, Cb, Cr: the inverse of [`Self::of_levels`], but for the rounding of its coefficients.
    pub(crate) fn to_levels(self, yuv: Vec3A) -> Vec3A {
        let [luma, r, gb, gr, b] = self.inverse().map(|coefficient| coefficient as f32 / (1 << BITS) as f32);
        let [y, cb, cr] = (yuv - Vec3A::from_array(OFFSETS.map(|offset| offset as f32))).to_array();
        Vec3A::new(y * luma + cr * r, y * luma + cb * gb + cr * gr, y * luma + cb * b)
    }

    /// What luma gives to all channels, then R from Cr, G from Cb, G from Cr, B from Cb.
    const fn inverse(self) -> [i64; 5] {
        let (kr, kb) = self.luma_weights();
        let kg = 1.0 - kr - kb;
        let (cb, cr) = (255.0 / 112.0 * (1.0 - kb), 255.0 / 112.0 * (1.0 - kr));
        [fixed(255.0 / 219.0), fixed(cr), fixed(-cb * kb / kg), fixed(-cr * kr / kg), fixed(cb)]
    }
}

const fn fixed(v: f64) -> i64 {
    let scaled = v * (1 << BITS) as f64;
    if scaled < 0.0 { (scaled - 0.5) as i64 } else { (scaled + 0.5) as i64 }
}

/// Y, Cb, Cr of a colour in RGB levels within [0, 255].
#[inline]
pub(crate) fn rgb_to_yuv(matrix: YuvMatrix, rgb: [i32; 3]) -> [u8; 3] {
    const MATRICES: [[[i32; 3]; 3]; 2] = [narrow(YuvMatrix::Bt601.forward()), narrow(YuvMatrix::Bt709.forward())];
    let rows = &MATRICES[usize::from(matrix == YuvMatrix::Bt709)];
    let row = |i: usize| rows[i][0] * rgb[0] + rows[i][1] * rgb[1] + rows[i][2] * rgb[2] + (1 << (BITS - 1));
    std::array::from_fn(|i| ((row(i) >> BITS) + OFFSETS[i]) as u8)
}

/// What Y, Cb and Cr of black are.
const OFFSETS: [i32; 3] = [16, 128, 128];

/// What each of R, G and B adds to Y, Cb and Cr.
const fn columns(rows: [[i64; 3]; 3]) -> [Vec3A; 3] {
    const ONE: f32 = (1 << BITS) as f32;
    let mut columns = [Vec3A::ZERO; 3];
    let mut i = 0;
    while i < 3 {
        columns[i] = Vec3A::new(rows[0][i] as f32 / ONE, rows[1][i] as f32 / ONE, rows[2][i] as f32 / ONE);
        i += 1;
    }
    columns
}

const fn narrow(rows: [[i64; 3]; 3]) -> [[i32; 3]; 3] {
    let mut narrow = [[0; 3]; 3];
    let mut i = 0;
    while i < 9 {
        narrow[i / 3][i % 3] = rows[i / 3][i % 3] as i32;
        i += 1;
    }
    narrow
}

/// R, G, B of a colour in Y'CbCr, chroma given in eighths of a level.
fn yuv_to_rgb(matrix: YuvMatrix, y: u8, cb8: i32, cr8: i32) -> [u8; 3] {
    const MATRICES: [[i64; 5]; 2] = [YuvMatrix::Bt601.inverse(), YuvMatrix::Bt709.inverse()];
    let [luma, r_cr, g_cb, g_cr, b_cb] = MATRICES[usize::from(matrix == YuvMatrix::Bt709)];
    let (cb, cr) = (i64::from(cb8) - 1024, i64::from(cr8) - 1024);
    let luma = luma * 8 * (i64::from(y) - 16);
    let round = |v: i64| ((v + (4 << BITS)) >> (BITS + 3)).clamp(0, 255) as u8;
    [round(luma + r_cr * cr), round(luma + g_cb * cb + g_cr * cr), round(luma + b_cb * cb)]
}

impl Frame {
    /// A picture from planes of bytes in any of the formats. Chroma is sited as MPEG-2 and its heirs do (at even
    /// columns, halfway between two rows) and interpolated linearly. Padding and unused bytes are not read.
    ///
    /// # Errors
    /// A size beyond the limits, or planes that do not hold the picture.
    pub fn try_from_planes(
        format: PixelFormat,
        matrix: YuvMatrix,
        (width, height): (u32, u32),
        planes: &[PlaneRef<'_>],
    ) -> Result<Self, ConvertError> {
        Self::check_size(width, height)?;
        check_planes(format, (width, height), planes)?;
        let width_px = width as usize;
        let mut pixels = Vec::with_capacity(width_px * height as usize);
        for y in 0..height as usize {
            let row = &planes[0].data[y * planes[0].stride..];
            match format {
                PixelFormat::Rgb => {
                    pixels.extend(row.as_chunks::<3>().0.iter().take(width_px).map(|p| [p[0], p[1], p[2]]))
                }
                PixelFormat::Rgbx => {
                    pixels.extend(row.as_chunks::<4>().0.iter().take(width_px).map(|p| [p[0], p[1], p[2]]))
                }
                PixelFormat::Bgrx => {
                    pixels.extend(row.as_chunks::<4>().0.iter().take(width_px).map(|p| [p[2], p[1], p[0]]))
                }
                PixelFormat::I420 | PixelFormat::Nv12 => {
                    let chroma = ChromaRow::new(format, (width, height), planes, y);
                    pixels.extend((0..width_px).map(|x| {
                        let [cb, cr] = chroma.at(x);
                        yuv_to_rgb(matrix, row[x], cb, cr)
                    }));
                }
            }
        }
        Ok(Self::try_new(width, height, pixels)?)
    }
}

fn check_planes(format: PixelFormat, (width, height): (u32, u32), planes: &[PlaneRef<'_>]) -> Result<(), ConvertError> {
    let sizes = format.plane_sizes(width, height);
    if sizes.len() != planes.len() {
        return Err(ConvertError::PlaneCount { expected: sizes.len(), found: planes.len() });
    }
    for (plane, (given, (row_bytes, rows))) in planes.iter().zip(sizes).enumerate() {
        if given.stride < row_bytes {
            return Err(ConvertError::Stride { plane, expected: row_bytes, found: given.stride });
        }
        let expected = given.stride.saturating_mul(rows - 1).saturating_add(row_bytes);
        if given.data.len() < expected {
            return Err(ConvertError::PlaneSize { plane, expected, found: given.data.len() });
        }
    }
    Ok(())
}

/// Chroma of one row of pixels: the two rows of samples around it, the nearer one weighted 3 to 1.
struct ChromaRow<'a> {
    /// (Cb, Cr) of the nearer row, then of the other.
    rows: [[&'a [u8]; 2]; 2],
    /// Bytes from a sample to the next.
    step: usize,
    samples: usize,
}

impl<'a> ChromaRow<'a> {
    fn new(format: PixelFormat, (width, height): (u32, u32), planes: &[PlaneRef<'a>], y: usize) -> Self {
        let last = (height as usize).div_ceil(2) - 1;
        let near = y / 2;
        let other = if y.is_multiple_of(2) { near.saturating_sub(1) } else { (near + 1).min(last) };
        let interleaved = format == PixelFormat::Nv12;
        let (cb, cr) = if interleaved { (planes[1], planes[1]) } else { (planes[1], planes[2]) };
        let row = |row: usize| [&cb.data[row * cb.stride..], &cr.data[row * cr.stride + usize::from(interleaved)..]];
        let step = if interleaved { 2 } else { 1 };
        Self { rows: [row(near), row(other)], step, samples: (width as usize).div_ceil(2) }
    }

    /// Cb and Cr at column x, in eighths of a level.
    fn at(&self, x: usize) -> [i32; 2] {
        let left = x / 2;
        let right = if x.is_multiple_of(2) { left } else { (left + 1).min(self.samples - 1) };
        [0, 1].map(|channel| {
            let both = |row: usize| {
                let samples = self.rows[row][channel];
                i32::from(samples[left * self.step]) + i32::from(samples[right * self.step])
            };
            3 * both(0) + both(1)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_colours() {
        // Black, white and the primaries, as ITU-R BT.601 and BT.709 give them.
        for (matrix, rgb, yuv) in [
            (YuvMatrix::Bt601, [0, 0, 0], [16, 128, 128]),
            (YuvMatrix::Bt601, [255, 255, 255], [235, 128, 128]),
            (YuvMatrix::Bt601, [255, 0, 0], [81, 90, 240]),
            (YuvMatrix::Bt601, [0, 0, 255], [41, 240, 110]),
            (YuvMatrix::Bt709, [0, 255, 0], [173, 42, 26]),
            (YuvMatrix::Bt709, [255, 0, 0], [63, 102, 240]),
        ] {
            assert_eq!(rgb_to_yuv(matrix, rgb), yuv, "{matrix:?} {rgb:?}");
            let exact = matrix.of_levels(Vec3A::from_array(rgb.map(|v| v as f32))).to_array();
            let near = exact.iter().zip(yuv).all(|(exact, yuv)| (exact - f32::from(yuv)).abs() <= 0.51);
            assert!(near, "{matrix:?} {rgb:?}: {exact:?}");
        }
    }

    #[test]
    fn there_and_back_within_two_levels() {
        for matrix in [YuvMatrix::Bt601, YuvMatrix::Bt709] {
            for i in 0..4096 {
                let rgb = [i % 16 * 17, i / 16 % 16 * 17, i / 256 * 17];
                let [y, cb, cr] = rgb_to_yuv(matrix, rgb);
                let back = yuv_to_rgb(matrix, y, 8 * i32::from(cb), 8 * i32::from(cr));
                let off = (0..3).map(|c| (i32::from(back[c]) - rgb[c]).abs()).max();
                assert!(off <= Some(2), "{matrix:?} {rgb:?} -> {back:?}");
            }
        }
    }

    #[test]
    fn planes_too_small_are_refused() {
        let data = [0u8; 64];
        let plane = |len: usize, stride| PlaneRef { data: &data[..len], stride };
        let convert = |format, planes: &[PlaneRef<'_>]| {
            Frame::try_from_planes(format, YuvMatrix::Bt601, (5, 3), planes).map(|_| ()).unwrap_err()
        };
        assert_eq!(
            convert(PixelFormat::Rgb, &[plane(64, 14)]),
            ConvertError::Stride { plane: 0, expected: 15, found: 14 }
        );
        assert_eq!(
            convert(PixelFormat::Rgb, &[plane(46, 16)]),
            ConvertError::PlaneSize { plane: 0, expected: 47, found: 46 }
        );
        assert_eq!(
            convert(PixelFormat::I420, &[plane(15, 5), plane(6, 3)]),
            ConvertError::PlaneCount { expected: 3, found: 2 }
        );
        assert_eq!(
            convert(PixelFormat::I420, &[plane(15, 5), plane(6, 3), plane(5, 3)]),
            ConvertError::PlaneSize { plane: 2, expected: 6, found: 5 }
        );
    }

    #[test]
    fn chroma_is_sited_left_and_interpolated() {
        let luma = [126u8; 16];
        let chroma = [0u8, 80, 160, 240];
        let row = ChromaRow::new(
            PixelFormat::I420,
            (4, 4),
            &[
                PlaneRef { data: &luma, stride: 4 },
                PlaneRef { data: &chroma, stride: 2 },
                PlaneRef { data: &chroma, stride: 2 },
            ],
            1,
        );
        // Row 1: three parts of the upper samples, one of the lower; odd columns halfway between samples.
        assert_eq!([0, 1, 2, 3].map(|x| row.at(x)[0]), [320, 640, 960, 960]);
    }
}
