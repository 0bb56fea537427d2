//! Which of the caps that downstream allows a stream is rendered to. In: caps and what the stream says of itself. Out:
//! fixed caps in the order in which to try them. Forbidden here: pads, queries, events.
//!
//! The first structure that can be fixed wins, as its order is the peer's preference: sinks put their window's size
//! there. Within it the stream's own values are kept where they are allowed. Where only one side is fixed, the other
//! follows the display aspect.

use crate::caps;

/// What the stream says of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Source {
    /// Width in pixels, > 0.
    pub(super) width: i32,
    /// Height in pixels, > 0.
    pub(super) height: i32,
    /// Width of a pixel over its height, > 0.
    pub(super) par: gst::Fraction,
    /// Frames a second; 0/1 where there is no fixed rate.
    pub(super) framerate: gst::Fraction,
}

/// Rate to aim for where the stream has none and downstream wants one.
const UNKNOWN_RATE: (i32, i32) = (25, 1);

impl Source {
    /// Reads caps of coded packets; `None` where they do not tell the size.
    pub(super) fn from_caps(caps: &gst::CapsRef) -> Option<Self> {
        let structure = caps.structure(0)?;
        let side = |name| structure.get::<i32>(name).ok().filter(|&side| side > 0);
        let ratio = |name| structure.get::<gst::Fraction>(name).ok();
        Some(Self {
            width: side("width")?,
            height: side("height")?,
            par: ratio("pixel-aspect-ratio")
                .filter(|par| par.numer() > 0 && par.denom() > 0)
                .unwrap_or(gst::Fraction::new(1, 1)),
            framerate: ratio("framerate")
                .filter(|rate| rate.numer() >= 0 && rate.denom() > 0)
                .unwrap_or(gst::Fraction::new(0, 1)),
        })
    }

    /// Reads a sequence header; `None` where its numbers are beyond those of caps.
    pub(super) fn from_header(header: &tetvec::SequenceHeader) -> Option<Self> {
        Some(Self {
            width: i32::try_from(header.width).ok().filter(|&side| side > 0)?,
            height: i32::try_from(header.height).ok().filter(|&side| side > 0)?,
            par: caps::from_core(header.pixel_aspect_ratio).filter(|par| par.numer() > 0)?,
            framerate: caps::from_core(header.frame_rate)?,
        })
    }

    /// Display aspect as numerator and denominator.
    fn display_aspect(&self) -> (i128, i128) {
        (i128::from(self.width) * i128::from(self.par.numer()), i128::from(self.height) * i128::from(self.par.denom()))
    }

    /// Height that shows `width` pixels of shape `par` in the display aspect.
    fn height_for(&self, width: i32, par: gst::Fraction) -> i32 {
        let (aspect_num, aspect_den) = self.display_aspect();
        round_div(i128::from(width) * i128::from(par.numer()) * aspect_den, i128::from(par.denom()) * aspect_num)
    }

    /// Width that shows `height` pixels of shape `par` in the display aspect.
    fn width_for(&self, height: i32, par: gst::Fraction) -> i32 {
        let (aspect_num, aspect_den) = self.display_aspect();
        round_div(i128::from(height) * i128::from(par.denom()) * aspect_num, i128::from(par.numer()) * aspect_den)
    }

    /// Pixel shape that shows `width` x `height` pixels in the display aspect.
    fn par_for(&self, width: i32, height: i32) -> Option<gst::Fraction> {
        let (aspect_num, aspect_den) = self.display_aspect();
        let (num, den) = (aspect_num * i128::from(height), aspect_den * i128::from(width));
        let common = greatest_common_divisor(num, den);
        match (i32::try_from(num / common), i32::try_from(den / common)) {
            (Ok(num), Ok(den)) => Some(gst::Fraction::new(num, den)),
            _ => gst::Fraction::approximate_f64(num as f64 / den as f64).filter(|par| par.numer() > 0),
        }
    }
}

/// Fixed caps within `allowed`, best first. `allowed` must lie within the element's template.
pub(super) fn candidates(allowed: &gst::Caps, source: Source) -> impl Iterator<Item = gst::Caps> {
    allowed.iter().filter_map(move |structure| fixate(structure, source)).map(|structure| {
        let mut caps = gst::Caps::new_empty();
        caps.make_mut().append_structure(structure);
        caps
    })
}

fn fixate(structure: &gst::StructureRef, source: Source) -> Option<gst::Structure> {
    let (width, height, par) = fixate_size(structure, source)?;
    let framerate = fixate_rate(structure, source.framerate)?;
    let mut fixed = structure.to_owned();
    fixed.set("width", width);
    fixed.set("height", height);
    fixed.set("pixel-aspect-ratio", par);
    fixed.set("framerate", framerate);
    fixed.remove_field("max-framerate");
    prefer(&mut fixed, "interlace-mode", "progressive");
    fixed.fixate_field("format");
    let format = fixed.get::<&str>("format").ok()?.parse::<gst_video::VideoFormat>().ok()?;
    let default = gst_video::VideoInfo::builder(format, width as u32, height as u32).build().ok()?;
    prefer(&mut fixed, "colorimetry", &default.colorimetry().to_string());
    fixed.fixate();
    (fixed.get::<&str>("interlace-mode").unwrap_or("progressive") == "progressive").then_some(fixed)
}

/// Fixes `field`, if there is one, to `value`, if that is allowed.
fn prefer(structure: &mut gst::Structure, field: &str, value: &str) {
    if structure.has_field(field) {
        structure.fixate_field_str(field, value);
    }
}

/// The stream's own rate where it is allowed, else the nearest.
fn fixate_rate(structure: &gst::StructureRef, stream: gst::Fraction) -> Option<gst::Fraction> {
    let nearest = nearest_fraction(structure, "framerate", stream)?;
    if stream.numer() == 0 && nearest.numer() != 0 {
        return nearest_fraction(structure, "framerate", gst::Fraction::from(UNKNOWN_RATE));
    }
    Some(nearest)
}

fn fixate_size(structure: &gst::StructureRef, source: Source) -> Option<(i32, i32, gst::Fraction)> {
    let par = nearest_fraction(structure, "pixel-aspect-ratio", source.par)?;
    let fixed = |field| structure.get::<i32>(field).ok();
    let (width, height) = match (fixed("width"), fixed("height")) {
        (Some(width), Some(height)) => (width, height),
        (Some(width), None) => (width, nearest_int(structure, "height", source.height_for(width, par))?),
        (None, Some(height)) => (nearest_int(structure, "width", source.width_for(height, par))?, height),
        (None, None) => fixate_both_sides(structure, source, par)?,
    };
    // Sides are whole numbers: an aspect that is right up to their rounding is right.
    let fits = height == source.height_for(width, par) || width == source.width_for(height, par);
    let par =
        if fits { par } else { nearest_fraction(structure, "pixel-aspect-ratio", source.par_for(width, height)?)? };
    Some((width, height, par))
}

/// The stream's own size; for pixels of another shape the side grows that keeps all lines or all columns; beyond the
/// limits the whole picture shrinks.
fn fixate_both_sides(structure: &gst::StructureRef, source: Source, par: gst::Fraction) -> Option<(i32, i32)> {
    let wished_width = source.width.max(source.width_for(source.height, par));
    let width = nearest_int(structure, "width", wished_width)?;
    let wished_height =
        if width == source.width && par == source.par { source.height } else { source.height_for(width, par) };
    let height = nearest_int(structure, "height", wished_height)?;
    if height == wished_height {
        return Some((width, height));
    }
    Some((nearest_int(structure, "width", source.width_for(height, par))?, height))
}

/// The value of `field` nearest to `target`; `target` where the field is absent.
fn nearest_int(structure: &gst::StructureRef, field: &str, target: i32) -> Option<i32> {
    if !structure.has_field(field) {
        return Some(target);
    }
    let mut structure = structure.to_owned();
    structure.fixate_field_nearest_int(field, target);
    structure.get(field).ok()
}

/// As [`nearest_int`], for fractions.
fn nearest_fraction(structure: &gst::StructureRef, field: &str, target: gst::Fraction) -> Option<gst::Fraction> {
    if !structure.has_field(field) {
        return Some(target);
    }
    let mut structure = structure.to_owned();
    structure.fixate_field_nearest_fraction(field, target);
    structure.get(field).ok()
}

/// num / den, halves up, at least 1.
fn round_div(num: i128, den: i128) -> i32 {
    i32::try_from((2 * num + den) / (2 * den)).unwrap_or(i32::MAX).max(1)
}

fn greatest_common_divisor(a: i128, b: i128) -> i128 {
    if b == 0 { a } else { greatest_common_divisor(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::{Source, candidates};

    /// A stream of 640x360 square pixels unless said otherwise.
    fn source(width: i32, height: i32, par: (i32, i32)) -> Source {
        gst::init().expect("GStreamer starts");
        Source { width, height, par: par.into(), framerate: gst::Fraction::new(24, 1) }
    }

    /// (width, height, par, rate) of the first candidate within the template.
    fn first(filter: &str, source: Source) -> Option<(i32, i32, gst::Fraction, gst::Fraction)> {
        let filter: gst::Caps = filter.parse().expect("caps parse");
        let allowed = filter.intersect_with_mode(&crate::caps::pictures(16384), gst::CapsIntersectMode::First);
        let caps = candidates(&allowed, source).next()?;
        assert!(caps.is_fixed(), "{caps}");
        let info = gst_video::VideoInfo::from_caps(&caps).expect("fixed caps are valid");
        Some((info.width() as i32, info.height() as i32, info.par(), info.fps()))
    }

    fn size(filter: &str, source: Source) -> (i32, i32, (i32, i32)) {
        let (width, height, par, _) = first(filter, source).expect("a candidate");
        (width, height, (par.numer(), par.denom()))
    }

    #[test]
    fn keeps_the_stream_as_it_is_where_nothing_is_asked() {
        assert_eq!(size("video/x-raw", source(640, 360, (1, 1))), (640, 360, (1, 1)));
        assert_eq!(size("video/x-raw", source(720, 576, (64, 45))), (720, 576, (64, 45)));
        assert_eq!(size("video/x-raw", source(321, 181, (1, 1))), (321, 181, (1, 1)));
    }

    #[test]
    fn the_other_side_follows_the_aspect() {
        let square = source(640, 360, (1, 1));
        assert_eq!(size("video/x-raw,width=1280", square), (1280, 720, (1, 1)));
        assert_eq!(size("video/x-raw,height=1080", square), (1920, 1080, (1, 1)));
        assert_eq!(size("video/x-raw,width=1000", square), (1000, 563, (1, 1)));
        let wide = source(720, 576, (64, 45));
        assert_eq!(size("video/x-raw,width=1440", wide), (1440, 1152, (64, 45)));
        assert_eq!(size("video/x-raw,height=576,pixel-aspect-ratio=1/1", wide), (1024, 576, (1, 1)));
        assert_eq!(size("video/x-raw,width=1024,pixel-aspect-ratio=1/1", wide), (1024, 576, (1, 1)));
    }

    #[test]
    fn pixels_of_another_shape_lose_no_line_and_no_column() {
        let wide = source(720, 576, (64, 45));
        assert_eq!(size("video/x-raw,pixel-aspect-ratio=1/1", wide), (1024, 576, (1, 1)));
        let narrow = source(720, 480, (8, 9));
        assert_eq!(size("video/x-raw,pixel-aspect-ratio=1/1", narrow), (720, 540, (1, 1)));
    }

    #[test]
    fn two_fixed_sides_bend_the_pixels() {
        let square = source(640, 360, (1, 1));
        assert_eq!(size("video/x-raw,width=1000,height=1000", square), (1000, 1000, (16, 9)));
        assert_eq!(size("video/x-raw,width=1000,height=1000,pixel-aspect-ratio=1/1", square), (1000, 1000, (1, 1)));
    }

    #[test]
    fn limits_shrink_the_whole_picture() {
        let square = source(640, 360, (1, 1));
        assert_eq!(size("video/x-raw,width=[1,320],height=[1,1000]", square), (320, 180, (1, 1)));
        assert_eq!(size("video/x-raw,width=[1,1000],height=[1,90]", square), (160, 90, (1, 1)));
        assert_eq!(size("video/x-raw,width=[1280,1300],height=[700,800]", square), (1280, 720, (1, 1)));
    }

    #[test]
    fn rate_is_the_streams_or_the_nearest() {
        let at = |filter, framerate: (i32, i32)| {
            let source = Source { framerate: framerate.into(), ..source(640, 360, (1, 1)) };
            let rate = first(filter, source).expect("a candidate").3;
            (rate.numer(), rate.denom())
        };
        assert_eq!(at("video/x-raw", (24, 1)), (24, 1));
        assert_eq!(at("video/x-raw,framerate=60/1", (24, 1)), (60, 1));
        assert_eq!(at("video/x-raw,framerate=[50/1,100/1]", (24, 1)), (50, 1));
        assert_eq!(at("video/x-raw", (0, 1)), (0, 1));
        assert_eq!(at("video/x-raw,framerate=[1/1,60/1]", (0, 1)), (25, 1));
    }

    #[test]
    fn the_peers_first_structure_wins() {
        let square = source(640, 360, (1, 1));
        let filter = "video/x-raw,format=I420,width=1234,height=694; video/x-raw,format=RGB";
        assert_eq!(size(filter, square).0, 1234);
        assert_eq!(size("video/x-raw,format=GRAY8; video/x-raw,format=RGB", square).0, 640);
        assert_eq!(first("video/x-raw,format=GRAY8", square), None);
        assert_eq!(first("video/x-raw,interlace-mode=interleaved", square), None);
    }

    #[test]
    fn aspects_at_the_ends_of_their_range_do_not_overflow() {
        let (width, height, _) = size("video/x-raw", source(i32::MAX, 1, (i32::MAX, 1)));
        assert!((1..=16384).contains(&width) && (1..=16384).contains(&height));
        let (width, height, _) = size("video/x-raw,width=1,height=16384", source(1, i32::MAX, (1, i32::MAX)));
        assert_eq!((width, height), (1, 16384));
    }
}
