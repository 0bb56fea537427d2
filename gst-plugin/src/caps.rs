//! Media types, and GStreamer's words for formats, matrices and ratios beside the core's.

use tetvec::bitstream::{Fraction, Limits};
use tetvec::{PixelFormat, SequenceHeader, YuvMatrix};

/// Name of the coded stream's caps.
pub(crate) const MEDIA_TYPE: &str = "video/x-tetvec";

const RGB_FORMATS: [(gst_video::VideoFormat, PixelFormat); 3] = [
    (gst_video::VideoFormat::Rgb, PixelFormat::Rgb),
    (gst_video::VideoFormat::Rgbx, PixelFormat::Rgbx),
    (gst_video::VideoFormat::Bgrx, PixelFormat::Bgrx),
];

const YUV_FORMATS: [(gst_video::VideoFormat, PixelFormat); 2] =
    [(gst_video::VideoFormat::I420, PixelFormat::I420), (gst_video::VideoFormat::Nv12, PixelFormat::Nv12)];

/// Matrices, ranges and so on that the core converts Y'CbCr with.
const YUV_COLORIMETRIES: [&str; 2] = ["bt601", "bt709"];

/// Caps of a stream cut into packets, as the encoder and the parser put out and the decoder takes.
pub(crate) fn packets() -> gst::caps::Builder<gst::caps::NoFeature> {
    gst::Caps::builder(MEDIA_TYPE).field("parsed", true).field("alignment", "frame")
}

/// Raw pictures with sides up to `max_side`. Y'CbCr comes with the matrices that the core knows, so that anything else
/// is converted by an element that can.
pub(crate) fn pictures(max_side: u32) -> gst::Caps {
    let side = gst::IntRange::new(1, i32::try_from(max_side).unwrap_or(i32::MAX));
    let structure = |formats: &[(gst_video::VideoFormat, PixelFormat)]| {
        gst::Structure::builder("video/x-raw")
            .field("format", gst::List::new(formats.iter().map(|(format, _)| format.to_str())))
            .field("width", side)
            .field("height", side)
            .field("framerate", gst::FractionRange::new((0, 1), (i32::MAX, 1)))
    };
    let colorimetry = gst::List::new(YUV_COLORIMETRIES);
    [structure(&RGB_FORMATS).build(), structure(&YUV_FORMATS).field("colorimetry", colorimetry).build()]
        .into_iter()
        .collect()
}

/// The core's name of a format of [`pictures`].
pub(crate) fn pixel_format(format: gst_video::VideoFormat) -> Option<PixelFormat> {
    RGB_FORMATS.iter().chain(&YUV_FORMATS).find(|(theirs, _)| *theirs == format).map(|&(_, ours)| ours)
}

/// The matrix of Y'CbCr pictures; without meaning for RGB ones.
pub(crate) fn yuv_matrix(info: &gst_video::VideoInfo) -> YuvMatrix {
    match info.colorimetry().matrix() {
        gst_video::VideoColorMatrix::Bt709 => YuvMatrix::Bt709,
        _ => YuvMatrix::Bt601,
    }
}

/// How the core reads pictures of `info`; `None` where it does not know the format, the matrix or the range.
pub(crate) fn core_conversion(info: &gst_video::VideoInfo) -> Option<(PixelFormat, YuvMatrix)> {
    let format = pixel_format(info.format())?;
    let colorimetry = info.colorimetry();
    let known = colorimetry.range() == gst_video::VideoColorRange::Range16_235
        && matches!(colorimetry.matrix(), gst_video::VideoColorMatrix::Bt601 | gst_video::VideoColorMatrix::Bt709);
    (info.is_rgb() || known).then(|| (format, yuv_matrix(info)))
}

/// A ratio as the core writes it; `default` where it is negative.
pub(crate) fn to_core(fraction: gst::Fraction, default: Fraction) -> Fraction {
    match (u32::try_from(fraction.numer()), u32::try_from(fraction.denom())) {
        (Ok(numerator), Ok(denominator)) if denominator > 0 => Fraction { numerator, denominator },
        _ => default,
    }
}

/// A ratio as GStreamer writes it; `None` where its numbers are beyond those of caps.
pub(crate) fn from_core(fraction: Fraction) -> Option<gst::Fraction> {
    let numerator = i32::try_from(fraction.numerator).ok()?;
    let denominator = i32::try_from(fraction.denominator).ok().filter(|&denominator| denominator > 0)?;
    Some(gst::Fraction::new(numerator, denominator))
}

/// Caps of the packets of a stream with this header.
pub(crate) fn of_stream(header: &SequenceHeader) -> gst::Caps {
    let mut caps = packets().field("codec_data", gst::Buffer::from_mut_slice(header.to_bytes()));
    for (name, side) in [("width", header.width), ("height", header.height)] {
        if let Ok(side) = i32::try_from(side) {
            caps = caps.field(name, side);
        }
    }
    for (name, ratio) in [("framerate", header.frame_rate), ("pixel-aspect-ratio", header.pixel_aspect_ratio)] {
        if let Some(ratio) = from_core(ratio) {
            caps = caps.field(name, ratio);
        }
    }
    caps.build()
}

/// The sequence header in the `codec_data` of caps; `None` where there is none or it does not hold.
pub(crate) fn header_of(caps: &gst::CapsRef) -> Option<SequenceHeader> {
    let data = caps.structure(0)?.get::<gst::Buffer>("codec_data").ok()?;
    let map = data.map_readable().ok()?;
    SequenceHeader::from_bytes(&map, &Limits::default()).ok()
}
