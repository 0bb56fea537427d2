//! What of the picture is shown: the viewport and the mesh over it, as properties that may change with every picture.
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

    /// What to draw of a source; `None`: all.
    pub(super) fn viewport(&self, source: Source) -> Option<tetvec::Viewport> {
        if [self.x, self.y, self.width, self.height] == [0.0; 4] {
            return None;
        }
        let side = |set: f64, from: f64, whole: i32| {
            let side = if set > 0.0 { set } else { f64::from(whole) - from };
            side.clamp(SMALLEST, FARTHEST)
        };
        let (width, height) = (side(self.width, self.x, source.width), side(self.height, self.y, source.height));
        Some(tetvec::Viewport { x: self.x, y: self.y, width, height })
    }

    /// Where in the source a place of an output of this size lies.
    pub(super) fn to_source(self, [x, y]: [f64; 2], (width, height): (u32, u32), source: Source) -> [f64; 2] {
        let whole = tetvec::Viewport { x: 0.0, y: 0.0, width: source.width.into(), height: source.height.into() };
        let shown = self.viewport(source).unwrap_or(whole);
        [shown.x + x * shown.width / f64::from(width), shown.y + y * shown.height / f64::from(height)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SOURCE: Source =
        Source { width: 640, height: 360, par: gst::Fraction::new_raw(1, 1), framerate: gst::Fraction::new_raw(25, 1) };

    fn view(x: f64, y: f64, width: f64, height: f64) -> View {
        View { x, y, width, height, mesh: false }
    }

    #[test]
    fn sides_left_out_reach_to_the_source_s_edges() {
        assert_eq!(View::default().viewport(SOURCE), None);
        let shown = view(600.0, 10.0, 0.0, 20.0).viewport(SOURCE).expect("a part");
        assert_eq!((shown.width, shown.height), (40.0, 20.0));
        let beyond = view(700.0, 0.0, 0.0, 0.0).viewport(SOURCE).expect("a part");
        assert_eq!((beyond.width, beyond.height), (SMALLEST, 360.0));
    }

    #[test]
    fn places_are_seen_through_the_viewport() {
        assert_eq!(View::default().to_source([960.0, 540.0], (1920, 1080), SOURCE), [320.0, 180.0]);
        let zoomed = view(100.0, 50.0, 80.0, 45.0);
        assert_eq!(zoomed.to_source([960.0, 540.0], (1920, 1080), SOURCE), [140.0, 72.5]);
    }
}
