//! Raw pictures to the core's RGB. In: a mapped picture of any opaque 8-bit format. Out: a copy that owns its memory.
//!
//! The core converts what it knows: its formats, with the matrices and the range it knows. GStreamer's converter does
//! the rest, with what the caps name, into 16 bits a channel: its way from Y'CbCr to 8 bits is 1 to 4 levels too dark.

use gst_video::VideoFormat;
use gst_video::prelude::*;
use tetvec::video::PlaneRef;
use tetvec::{Frame, PixelFormat, YuvMatrix};

use super::imp::CAT;
use crate::caps;

/// Formats that pictures may come in, the best first: nothing is lost of 8 bits without alpha.
pub(super) const FORMATS: [VideoFormat; 15] = [
    VideoFormat::Rgb,
    VideoFormat::Rgbx,
    VideoFormat::Bgrx,
    VideoFormat::I420,
    VideoFormat::Nv12,
    VideoFormat::Bgr,
    VideoFormat::Xrgb,
    VideoFormat::Xbgr,
    VideoFormat::Y444,
    VideoFormat::Y42b,
    VideoFormat::Yv12,
    VideoFormat::Nv21,
    VideoFormat::Yuy2,
    VideoFormat::Uyvy,
    VideoFormat::Gray8,
];

/// Copies pictures of one format and size.
#[derive(Debug)]
pub(super) struct Copier {
    input: gst_video::VideoInfo,
    way: Way,
}

/// Who converts.
#[derive(Debug)]
enum Way {
    Core(PixelFormat, YuvMatrix),
    Converter(gst_video::VideoConverter, gst_video::VideoInfo),
}

impl Copier {
    /// Copies pictures of `input`.
    pub(super) fn try_new(input: &gst_video::VideoInfo) -> Result<Self, gst::LoggableError> {
        let way = match caps::core_conversion(input) {
            Some((format, matrix)) => Way::Core(format, matrix),
            None => {
                let output = gst_video::VideoInfo::builder(VideoFormat::Argb64Le, input.width(), input.height())
                    .fps(input.fps())
                    .interlace_mode(input.interlace_mode())
                    .build()?;
                Way::Converter(gst_video::VideoConverter::new(input, &output, None)?, output)
            }
        };
        Ok(Self { input: input.clone(), way })
    }

    /// The picture in `buffer` as the core takes it.
    pub(super) fn copy(&self, buffer: &gst::BufferRef) -> Result<Frame, gst::LoggableError> {
        let picture = gst_video::VideoFrameRef::from_buffer_ref_readable(buffer, &self.input)
            .map_err(|_| gst::loggable_error!(CAT, "Cannot map the input buffer"))?;
        match &self.way {
            Way::Core(format, matrix) => read(&picture, *format, *matrix),
            Way::Converter(converter, output) => convert(&picture, converter, output),
        }
    }
}

/// The core's own way.
fn read(
    picture: &gst_video::VideoFrameRef<&gst::BufferRef>,
    format: PixelFormat,
    matrix: YuvMatrix,
) -> Result<Frame, gst::LoggableError> {
    let planes = (0..picture.n_planes())
        .map(|plane| Ok(PlaneRef { data: picture.plane_data(plane)?, stride: stride(picture.plane_stride(), plane)? }))
        .collect::<Result<Vec<_>, gst::LoggableError>>()?;
    Frame::try_from_planes(format, matrix, (picture.width(), picture.height()), &planes)
        .map_err(|error| gst::loggable_error!(CAT, "{error}"))
}

/// The way through 16 bits a channel. The converter widens 8 bits by writing them twice, which lifts limited range by
/// up to a level of 8 bits; dropping the lower byte takes that back.
fn convert(
    picture: &gst_video::VideoFrameRef<&gst::BufferRef>,
    converter: &gst_video::VideoConverter,
    output: &gst_video::VideoInfo,
) -> Result<Frame, gst::LoggableError> {
    let mut wide = gst::Buffer::with_size(output.size())?;
    let mut wide = gst_video::VideoFrameRef::from_buffer_ref_writable(wide.make_mut(), output)
        .map_err(|_| gst::loggable_error!(CAT, "Cannot map the copy"))?;
    converter.frame_ref(picture, &mut wide);
    let (width, height) = (output.width(), output.height());
    let rows = wide.plane_data(0)?.chunks(stride(wide.plane_stride(), 0)?).take(height as usize);
    let pixels = rows.flat_map(|row| {
        let (pixels, _) = row.as_chunks::<8>();
        pixels.iter().take(width as usize).map(|&[_, _, _, r, _, g, _, b]| [r, g, b])
    });
    Frame::try_new(width, height, pixels.collect()).map_err(|error| gst::loggable_error!(CAT, "{error}"))
}

/// Bytes from one row of a plane to the next.
fn stride(strides: &[i32], plane: u32) -> Result<usize, gst::LoggableError> {
    let stride = strides[plane as usize];
    usize::try_from(stride).map_err(|_| gst::loggable_error!(CAT, "Stride {stride}"))
}
