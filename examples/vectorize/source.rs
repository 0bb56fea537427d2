//! Pictures to vectorise: a y4m file (or standard input), or a sequence of image files.
//!
//! In: paths. Out: frames with what a header says about them. Forbidden here: encoding.

use std::fmt;
use std::fs::File;
use std::io::{self, BufReader, Read};
use std::path::{Path, PathBuf};

use tetvec::Frame;
use tetvec::bitstream::Fraction;
use tetvec::video::{ConvertError, FrameError};
use thiserror::Error;

mod y4m;

/// Frames a second of image files, which do not say.
const PICTURE_RATE: Fraction = Fraction { numerator: 25, denominator: 1 };

/// Why pictures could not be read.
#[derive(Debug, Error)]
pub(crate) enum SourceError {
    /// The file system refused.
    #[error("{path}: {error}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Its answer.
        error: io::Error,
    },
    /// An image file could not be decoded.
    #[error("{path}: {error}", path = path.display())]
    Image {
        /// The file.
        path: PathBuf,
        /// The decoder's answer.
        error: image::ImageError,
    },
    /// A field of a y4m header is missing, malformed or not supported.
    #[error("y4m {field}: expected {expected}, found {found:?}")]
    Header {
        /// Name of the field.
        field: &'static str,
        /// What would be accepted.
        expected: &'static str,
        /// What was found.
        found: String,
    },
    /// A y4m file ends inside of a frame.
    #[error("y4m frame {frame}: expected {expected} bytes, found {found}")]
    Truncated {
        /// Number of the frame.
        frame: usize,
        /// Bytes of a frame.
        expected: usize,
        /// Bytes left.
        found: usize,
    },
    /// The pictures are too large, or of no size.
    #[error(transparent)]
    Size(#[from] FrameError),
    /// The bytes of a frame are no picture.
    #[error(transparent)]
    Convert(#[from] ConvertError),
    /// No file was named.
    #[error("input: expected a .y4m file or pictures, found none")]
    Empty,
}

/// A video to read.
pub(crate) struct Source {
    /// Width in pixels, of the first picture.
    pub width: u32,
    /// Height in pixels, of the first picture.
    pub height: u32,
    /// Frames a second; 0/1: unknown.
    pub frame_rate: Fraction,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: Fraction,
    /// Number of frames, where it is known beforehand.
    pub length: Option<usize>,
    /// The pictures. After an error there are no more.
    pub frames: Box<dyn Iterator<Item = Result<Frame, SourceError>>>,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (rate, aspect) = (self.frame_rate, self.pixel_aspect_ratio);
        write!(f, "{}x{}", self.width, self.height)?;
        if rate.numerator > 0 {
            write!(f, ", {:.3} frames a second", f64::from(rate.numerator) / f64::from(rate.denominator))?;
        }
        if aspect.numerator != aspect.denominator {
            write!(f, ", pixels of {}:{}", aspect.numerator, aspect.denominator)?;
        }
        self.length.map_or(Ok(()), |length| write!(f, ", {length} frames"))
    }
}

/// Opens a single y4m file (`-`: standard input), or image files in the order given.
///
/// # Errors
/// Whatever keeps the first picture's size from being known.
pub(crate) fn open(paths: &[PathBuf]) -> Result<Source, SourceError> {
    match paths {
        [path] if path == Path::new("-") => y4m::open(Box::new(io::stdin().lock()), path, None),
        [path] if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("y4m")) => {
            let file = File::open(path).map_err(|error| io_error(path, error))?;
            let bytes = file.metadata().map_err(|error| io_error(path, error))?.len();
            y4m::open(Box::new(BufReader::new(file)), path, Some(bytes))
        }
        paths => open_pictures(paths.to_vec()),
    }
}

fn open_pictures(paths: Vec<PathBuf>) -> Result<Source, SourceError> {
    let first = paths.first().ok_or(SourceError::Empty)?;
    let (width, height) = image::image_dimensions(first).map_err(|error| image_error(first, error))?;
    Frame::check_size(width, height)?;
    Ok(Source {
        width,
        height,
        frame_rate: PICTURE_RATE,
        pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
        length: Some(paths.len()),
        frames: Box::new(paths.into_iter().map(|path| read_picture(&path))),
    })
}

fn read_picture(path: &Path) -> Result<Frame, SourceError> {
    let picture = image::open(path).map_err(|error| image_error(path, error))?.into_rgb8();
    let (width, height) = picture.dimensions();
    Ok(Frame::try_new(width, height, picture.pixels().map(|pixel| pixel.0).collect())?)
}

fn image_error(path: &Path, error: image::ImageError) -> SourceError {
    SourceError::Image { path: path.to_path_buf(), error }
}

fn io_error(path: &Path, error: io::Error) -> SourceError {
    SourceError::Io { path: path.to_path_buf(), error }
}

/// Fills `buffer` as far as `reader` goes, and says how far that is.
fn read_up_to(reader: &mut impl Read, buffer: &mut [u8]) -> io::Result<usize> {
    let mut filled = 0;
    while filled < buffer.len() {
        match reader.read(&mut buffer[filled..]) {
            Ok(0) => break,
            Ok(bytes) => filled += bytes,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
    Ok(filled)
}
