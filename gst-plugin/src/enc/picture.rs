//! Raw pictures to the core's RGB. In: a mapped picture of any opaque 8-bit format. Out: a copy that owns its memory.
//!
//! GStreamer's own converter does it, with the matrix, range and chroma sites that the caps name.

use gst_video::VideoFormat;
use gst_video::prelude::*;
use tetvec::Frame;

use super::imp::CAT;

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
    output: gst_video::VideoInfo,
    converter: gst_video::VideoConverter,
}

impl Copier {
    /// Copies pictures of `input`.
    pub(super) fn try_new(input: &gst_video::VideoInfo) -> Result<Self, gst::LoggableError> {
        let output = gst_video::VideoInfo::builder(VideoFormat::Rgb, input.width(), input.height())
            .fps(input.fps())
            .interlace_mode(input.interlace_mode())
            .build()?;
        let converter = gst_video::VideoConverter::new(input, &output, None)?;
        Ok(Self { input: input.clone(), output, converter })
    }

    /// The picture in `buffer` as the core takes it.
    pub(super) fn copy(&self, buffer: &gst::BufferRef) -> Result<Frame, gst::LoggableError> {
        let picture = gst_video::VideoFrameRef::from_buffer_ref_readable(buffer, &self.input)
            .map_err(|_| gst::loggable_error!(CAT, "Cannot map the input buffer"))?;
        let mut rgb = gst::Buffer::with_size(self.output.size())?;
        let mut rgb = gst_video::VideoFrameRef::from_buffer_ref_writable(rgb.make_mut(), &self.output)
            .map_err(|_| gst::loggable_error!(CAT, "Cannot map the copy"))?;
        self.converter.frame_ref(&picture, &mut rgb);
        let (width, height) = (self.output.width(), self.output.height());
        let stride = usize::try_from(rgb.plane_stride()[0])
            .map_err(|_| gst::loggable_error!(CAT, "Stride {}", rgb.plane_stride()[0]))?;
        let pixels = rgb.plane_data(0)?.chunks(stride).take(height as usize).flat_map(|row| {
            let (pixels, _) = row.as_chunks::<3>();
            pixels.iter().take(width as usize).copied()
        });
        Frame::try_new(width, height, pixels.collect()).map_err(|error| gst::loggable_error!(CAT, "{error}"))
    }
}
