//! What of the picture is shown: the viewport and the mesh over it, as properties that may change with every picture.
//!
//! The whole picture keeps its display aspect: where caps cannot say that pixels are not square, black bars fill up the
//! output, as videoscale adds them.
//!
//! A viewport is given in source pixels and stretched over the whole output, whose size it does not change. A width or a
//! height of 0 is what is left of the source to the right or below; so all zeros is the whole picture. What lies outside
//! of the source is black. Places that applications send upstream in navigation events are in pixels of the output; they
//! arrive upstream in pixels of the source, seen through the viewport.

use gst::glib;
use gst::prelude::*;

use super::negotiate::Source;

/// Farthest edge of a viewport, in source pixels.
const FARTHEST: f64 = 1_048_576.0;
/// Smallest side of a viewport that is not 0, in source pixels.
const SMALLEST: f64 = 1.0 / 4096.0;

/// What is shown, as set by the application.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct View {
    x: f64,
    y: f64,
    width: f64,
    height: f64,
    /// Whether the control mesh is drawn over the picture.
    pub(super) mesh: bool,
}

impl View {
    /// The properties of the element that make it up.
    pub(super) fn properties() -> Vec<glib::ParamSpec> {
        let side = |name: &str, nick: &str, blurb: &str, least: f64| {
            glib::ParamSpecDouble::builder(name)
                .nick(nick)
                .blurb(blurb)
                .minimum(least)
                .maximum(FARTHEST)
                .default_value(0.0)
                .controllable()
                .mutable_playing()
                .build()
        };
        vec![
            side("viewport-x", "Viewport's left edge", "Left edge of what is shown, in source pixels", -FARTHEST),
            side("viewport-y", "Viewport's top edge", "Top edge of what is shown, in source pixels", -FARTHEST),
            side(
                "viewport-width",
                "Viewport's width",
                "Width of what is shown, in source pixels (0 = up to the source's right edge)",
                0.0,
            ),
            side(
                "viewport-height",
                "Viewport's height",
                "Height of what is shown, in source pixels (0 = down to the source's bottom edge)",
                0.0,
            ),
            glib::ParamSpecBoolean::builder("draw-mesh")
                .nick("Draw the mesh")
                .blurb("Draw the control mesh's cross-section over the picture")
                .default_value(false)
                .controllable()
                .mutable_playing()
                .build(),
        ]
    }

    /// Sets a property; false if it is none of these.
    pub(super) fn set(&mut self, name: &str, value: &glib::Value) -> bool {
        let number = || value.get::<f64>().ok().filter(|number| number.is_finite()).unwrap_or(0.0);
        match name {
            "viewport-x" => self.x = number(),
            "viewport-y" => self.y = number(),
            "viewport-width" => self.width = number(),
            "viewport-height" => self.height = number(),
            "draw-mesh" => self.mesh = value.get().unwrap_or(false),
            _ => return false,
        }
        true
    }

    /// A property's value; `None` if it is none of these.
    pub(super) fn get(&self, name: &str) -> Option<glib::Value> {
        Some(match name {
            "viewport-x" => self.x.to_value(),
            "viewport-y" => self.y.to_value(),
            "viewport-width" => self.width.to_value(),
            "viewport-height" => self.height.to_value(),
            "draw-mesh" => self.mesh.to_value(),
            _ => return None,
        })
    }

    /// What of a source to stretch over an output; `None`: all.
    pub(super) fn viewport(&self, source: Source, output: Shape) -> Option<tetvec::Viewport> {
        if [self.x, self.y, self.width, self.height] == [0.0; 4] {
            return with_bars(source, output);
        }
        let side = |set: f64, from: f64, whole: i32| {
            let side = if set > 0.0 { set } else { f64::from(whole) - from };
            side.clamp(SMALLEST, FARTHEST)
        };
        let (width, height) = (side(self.width, self.x, source.width), side(self.height, self.y, source.height));
        Some(tetvec::Viewport { x: self.x, y: self.y, width, height })
    }

    /// Where in the source a place of an output lies.
    pub(super) fn to_source(self, [x, y]: [f64; 2], output: Shape, source: Source) -> [f64; 2] {
        let whole = tetvec::Viewport { x: 0.0, y: 0.0, width: source.width.into(), height: source.height.into() };
        let shown = self.viewport(source, output).unwrap_or(whole);
        [shown.x + x * shown.width / f64::from(output.width), shown.y + y * shown.height / f64::from(output.height)]
    }
}

/// Size of the output and shape of its pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Pixels, > 0.
    pub(super) width: u32,
    /// Pixels, > 0.
    pub(super) height: u32,
    /// Width of a pixel over its height, > 0.
    pub(super) par: gst::Fraction,
}

impl Shape {
    pub(super) fn of(info: &gst_video::VideoInfo) -> Self {
        Self { width: info.width(), height: info.height(), par: info.par() }
    }
}

/// The whole source in the middle, with what is missing to the output's display aspect around it; `None` where that is
/// less than a pixel.
fn with_bars(source: Source, output: Shape) -> Option<tetvec::Viewport> {
    let ratio = |par: gst::Fraction| f64::from(par.numer()) / f64::from(par.denom());
    let (width, height) = (f64::from(source.width), f64::from(source.height));
    let (columns, rows) = (f64::from(output.width), f64::from(output.height));
    // How much wider the output is than the source, both as they are displayed.
    let wider = columns * ratio(output.par) * height / (rows * ratio(source.par) * width);
    if !wider.is_finite() || wider <= 0.0 {
        return None;
    }
    if columns - columns / wider >= 1.0 {
        let around = (width * wider).min(FARTHEST);
        return Some(tetvec::Viewport { x: (width - around) / 2.0, y: 0.0, width: around, height });
    }
    if rows - rows * wider >= 1.0 {
        let around = (height / wider).min(FARTHEST);
        return Some(tetvec::Viewport { x: 0.0, y: (height - around) / 2.0, width, height: around });
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: Source =
        Source { width: 640, height: 360, par: gst::Fraction::new_raw(1, 1), framerate: gst::Fraction::new_raw(25, 1) };

    fn output(width: u32, height: u32) -> Shape {
        Shape { width, height, par: gst::Fraction::new(1, 1) }
    }

    #[test]
    fn bars_keep_the_aspect() {
        for (width, height) in [(640, 360), (1000, 562), (1000, 563), (1, 1), (3840, 2160)] {
            assert_eq!(View::default().viewport(SOURCE, output(width, height)), None, "{width}x{height}");
        }
        let tall = View::default().viewport(SOURCE, output(320, 360)).expect("bars");
        assert_eq!((tall.x, tall.y, tall.width, tall.height), (0.0, -180.0, 640.0, 720.0));
        let broad = View::default().viewport(SOURCE, output(1280, 360)).expect("bars");
        assert_eq!((broad.x, broad.y, broad.width, broad.height), (-320.0, 0.0, 1280.0, 360.0));
        let squeezed = Shape { width: 320, height: 360, par: gst::Fraction::new(2, 1) };
        assert_eq!(View::default().viewport(SOURCE, squeezed), None);
    }

    fn view(x: f64, y: f64, width: f64, height: f64) -> View {
        View { x, y, width, height, mesh: false }
    }

    #[test]
    fn sides_left_out_reach_to_the_source_s_edges() {
        assert_eq!(View::default().viewport(SOURCE, output(64, 36)), None);
        let shown = view(600.0, 10.0, 0.0, 20.0).viewport(SOURCE, output(64, 36)).expect("a part");
        assert_eq!((shown.width, shown.height), (40.0, 20.0));
        let beyond = view(700.0, 0.0, 0.0, 0.0).viewport(SOURCE, output(64, 36)).expect("a part");
        assert_eq!((beyond.width, beyond.height), (SMALLEST, 360.0));
    }

    #[test]
    fn places_are_seen_through_the_viewport() {
        assert_eq!(View::default().to_source([960.0, 540.0], output(1920, 1080), SOURCE), [320.0, 180.0]);
        let zoomed = view(100.0, 50.0, 80.0, 45.0);
        assert_eq!(zoomed.to_source([960.0, 540.0], output(1920, 1080), SOURCE), [140.0, 72.5]);
    }
}
