//! YUV4MPEG2: a line of text, then frames, each a line and raw planes.
//!
//! In: bytes of 8-bit 4:2:0 or monochrome video of limited range. Out: frames. The format does not say which matrix
//! its colours were made with: BT.601 is assumed up to 576 lines and BT.709 above, as GStreamer does.

use std::io::{self, BufRead, Read};
use std::path::{Path, PathBuf};

use tetvec::bitstream::Fraction;
use tetvec::video::PlaneRef;
use tetvec::{Frame, PixelFormat, YuvMatrix};

use super::{Source, SourceError, io_error, read_up_to};

const MAGIC: &str = "YUV4MPEG2";
const FRAME_MAGIC: &str = "FRAME";
/// Longest line of text; real ones have less than 200 bytes.
const MAX_LINE_BYTES: u64 = 4096;
/// Most lines of standard definition, whose matrix is BT.601.
const MAX_BT601_HEIGHT: u32 = 576;
/// Chroma of a picture without colour.
const NEUTRAL: u8 = 128;

/// Which planes follow a frame's line.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Chroma {
    /// Halved both ways.
    Halved,
    /// None: the picture is grey.
    None,
}

struct Header {
    width: u32,
    height: u32,
    frame_rate: Fraction,
    pixel_aspect_ratio: Fraction,
    chroma: Chroma,
}

impl Header {
    fn planes(&self) -> Vec<(usize, usize)> {
        PixelFormat::I420.plane_sizes(self.width, self.height)
    }

    /// Bytes of a frame, without its line.
    fn frame_bytes(&self) -> usize {
        let planes = if self.chroma == Chroma::None { 1 } else { 3 };
        self.planes().iter().take(planes).map(|(row_bytes, rows)| row_bytes * rows).sum()
    }
}

/// Starts to read; with the number of `bytes` of the whole file its number of frames is known too.
pub(super) fn open(mut reader: Box<dyn BufRead>, path: &Path, bytes: Option<u64>) -> Result<Source, SourceError> {
    let line = read_line(&mut reader).map_err(|error| io_error(path, error))?;
    let header = parse_header(&line)?;
    let frame_bytes = (FRAME_MAGIC.len() + 1 + header.frame_bytes()) as u64;
    let length = bytes.map(|bytes| (bytes.saturating_sub(line.len() as u64 + 1) / frame_bytes) as usize);
    Ok(Source {
        width: header.width,
        height: header.height,
        frame_rate: header.frame_rate,
        pixel_aspect_ratio: header.pixel_aspect_ratio,
        length,
        frames: Box::new(Frames { reader, path: path.to_path_buf(), header, number: 0, ended: false }),
    })
}

/// A line without its end.
fn read_line(reader: &mut impl BufRead) -> io::Result<String> {
    let mut line = Vec::new();
    reader.take(MAX_LINE_BYTES).read_until(b'\n', &mut line)?;
    if line.last() == Some(&b'\n') {
        line.pop();
    }
    Ok(String::from_utf8_lossy(&line).into_owned())
}

fn parse_header(line: &str) -> Result<Header, SourceError> {
    let mut words = line.split(' ');
    if words.next() != Some(MAGIC) {
        return Err(unusable("magic", MAGIC, &line.chars().take(16).collect::<String>()));
    }
    let mut header = Header {
        width: 0,
        height: 0,
        frame_rate: Fraction { numerator: 0, denominator: 1 },
        pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
        chroma: Chroma::Halved,
    };
    for word in words.filter(|word| !word.is_empty()) {
        let mut rest = word.chars();
        let tag = rest.next();
        let value = rest.as_str();
        match tag {
            Some('W') => header.width = parse_side("width", value)?,
            Some('H') => header.height = parse_side("height", value)?,
            Some('F') => header.frame_rate = parse_fraction("frame rate", value)?.unwrap_or(header.frame_rate),
            Some('A') => {
                let aspect = parse_fraction("pixel aspect ratio", value)?;
                header.pixel_aspect_ratio = aspect.unwrap_or(header.pixel_aspect_ratio);
            }
            Some('C') => header.chroma = parse_chroma(value)?,
            Some('X') if value == "COLORRANGE=FULL" => return Err(unusable("color range", "LIMITED", value)),
            // Interlacing and comments change no sample.
            _ => {}
        }
    }
    Frame::check_size(header.width, header.height)?;
    Ok(header)
}

fn parse_side(field: &'static str, value: &str) -> Result<u32, SourceError> {
    value.parse().map_err(|_| unusable(field, "a number of pixels", value))
}

/// `None` for 0:0, which stands for unknown.
fn parse_fraction(field: &'static str, value: &str) -> Result<Option<Fraction>, SourceError> {
    let parsed = value.split_once(':').and_then(|(above, below)| Some((above.parse().ok()?, below.parse().ok()?)));
    match parsed {
        Some((0, 0)) => Ok(None),
        Some((numerator, denominator)) if numerator > 0 && denominator > 0 => {
            Ok(Some(Fraction { numerator, denominator }))
        }
        _ => Err(unusable(field, "a ratio as 25:1", value)),
    }
}

/// The sitings of 4:2:0 differ by a quarter of a pixel in the chroma alone and are read as one.
fn parse_chroma(value: &str) -> Result<Chroma, SourceError> {
    match value {
        "420" | "420jpeg" | "420mpeg2" | "420paldv" => Ok(Chroma::Halved),
        "mono" => Ok(Chroma::None),
        _ => Err(unusable("color space", "420 or mono, as ffmpeg -pix_fmt yuv420p writes", value)),
    }
}

fn unusable(field: &'static str, expected: &'static str, found: &str) -> SourceError {
    SourceError::Header { field, expected, found: found.to_owned() }
}

struct Frames {
    reader: Box<dyn BufRead>,
    path: PathBuf,
    header: Header,
    /// Number of the next frame.
    number: usize,
    ended: bool,
}

impl Frames {
    /// The next frame, or `None` at the end of the file.
    fn read(&mut self) -> Result<Option<Frame>, SourceError> {
        let line = read_line(&mut self.reader).map_err(|error| io_error(&self.path, error))?;
        if line.is_empty() {
            return Ok(None);
        }
        if line.split(' ').next() != Some(FRAME_MAGIC) {
            return Err(unusable("frame", FRAME_MAGIC, &line.chars().take(16).collect::<String>()));
        }
        let expected = self.header.frame_bytes();
        let sizes = self.header.planes();
        let mut data = vec![NEUTRAL; sizes.iter().map(|(row_bytes, rows)| row_bytes * rows).sum()];
        let found = read_up_to(&mut self.reader, &mut data[..expected]).map_err(|error| io_error(&self.path, error))?;
        if found < expected {
            return Err(SourceError::Truncated { frame: self.number, expected, found });
        }
        self.number += 1;
        let mut rest = &data[..];
        let planes = sizes.iter().map(|&(stride, rows)| {
            let (plane, after) = rest.split_at(stride * rows);
            rest = after;
            PlaneRef { data: plane, stride }
        });
        let planes: Vec<PlaneRef<'_>> = planes.collect();
        let matrix = if self.header.height > MAX_BT601_HEIGHT { YuvMatrix::Bt709 } else { YuvMatrix::Bt601 };
        let size = (self.header.width, self.header.height);
        Ok(Some(Frame::try_from_planes(PixelFormat::I420, matrix, size, &planes)?))
    }
}

impl Iterator for Frames {
    type Item = Result<Frame, SourceError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.ended {
            return None;
        }
        let frame = self.read();
        self.ended = !matches!(frame, Ok(Some(_)));
        frame.transpose()
    }
}
