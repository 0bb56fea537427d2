//! The encoder's properties: names, ranges and defaults, all read from the core's configuration.

use std::ops::RangeInclusive;

use gst::glib;
use gst::prelude::*;
use tetvec::EncoderConfig;

use crate::MAX_THREADS;

/// What the simplification measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, glib::Enum)]
#[enum_type(name = "GstTetvecEncErrorMetric")]
#[repr(i32)]
pub enum ErrorMetric {
    /// Squared colour error at a fixed (x, y, t).
    #[default]
    #[enum_value(name = "Squared colour error at a fixed place and time", nick = "colour")]
    Color = 0,
    /// Squared distance in (x, y, t, r, g, b).
    #[enum_value(name = "Squared distance in space, time and colour, as in the paper", nick = "paper")]
    Paper = 1,
}

impl From<ErrorMetric> for tetvec::ErrorMetric {
    fn from(metric: ErrorMetric) -> Self {
        match metric {
            ErrorMetric::Color => Self::Color,
            ErrorMetric::Paper => Self::Paper,
        }
    }
}

impl From<tetvec::ErrorMetric> for ErrorMetric {
    fn from(metric: tetvec::ErrorMetric) -> Self {
        match metric {
            tetvec::ErrorMetric::Color => Self::Color,
            tetvec::ErrorMetric::Paper => Self::Paper,
        }
    }
}

/// The configuration that the properties describe; size and rates in it are the stream's, and set when it begins.
#[derive(Debug, Clone)]
pub(super) struct Settings(pub(super) EncoderConfig);

impl Default for Settings {
    fn default() -> Self {
        Self(EncoderConfig::new(1, 1))
    }
}

impl Settings {
    /// Descriptions of all properties.
    pub(super) fn properties() -> Vec<glib::ParamSpec> {
        let Self(default) = Self::default();
        vec![
            glib::ParamSpecDouble::builder("simplification-ratio")
                .nick("Simplification ratio")
                .blurb("Vertices of the mesh over pixels of the source")
                .minimum(*EncoderConfig::SIMPLIFICATION_RATIO.start())
                .maximum(*EncoderConfig::SIMPLIFICATION_RATIO.end())
                .default_value(default.simplification_ratio)
                .mutable_ready()
                .build(),
            glib::ParamSpecDouble::builder("target-error")
                .nick("Target error")
                .blurb(
                    "Simplify as far as this mean error allows, in 8-bit levels (0 = off: the simplification ratio decides)",
                )
                .minimum(*EncoderConfig::TARGET_ERROR.start())
                .maximum(*EncoderConfig::TARGET_ERROR.end())
                .default_value(default.target_error)
                .mutable_ready()
                .build(),
            uint(
                ("window", "Window", "Length of the sliding window in frames: delay and memory grow with it"),
                EncoderConfig::WINDOW,
                default.window,
            ),
            uint(
                ("key-int-max", "Maximum keyframe interval", "Most frames from one keyframe to the next"),
                EncoderConfig::KEY_INT_MAX,
                default.key_int_max,
            ),
            uint(
                (
                    "superpixels",
                    "Superpixels",
                    "Mean number of regions with sharp borders a frame (0 = chosen by content, 1 = no sharp borders)",
                ),
                EncoderConfig::SUPERPIXELS,
                default.superpixels,
            ),
            uint(
                (
                    "subdivision-levels",
                    "Subdivision levels",
                    "Levels of subdivision that the decoder draws with and the fit is made for",
                ),
                u32::from(*EncoderConfig::SUBDIVISION_LEVELS.start())
                    ..=u32::from(*EncoderConfig::SUBDIVISION_LEVELS.end()),
                u32::from(default.subdivision_levels),
            ),
            glib::ParamSpecEnum::builder_with_default("error-metric", ErrorMetric::from(default.error_metric))
                .nick("Error metric")
                .blurb("What the simplification measures")
                .mutable_ready()
                .build(),
            uint(
                ("threads", "Threads", "Worker threads; the stream does not depend on it (0 = all cores)"),
                0..=MAX_THREADS,
                u32::try_from(default.threads).unwrap_or(0),
            ),
        ]
    }

    /// Sets the property `name`. GObject has checked name, type and range.
    pub(super) fn set(&mut self, name: &str, value: &glib::Value) {
        let Self(config) = self;
        let uint = || value.get::<u32>().expect("an unsigned property");
        let double = || value.get::<f64>().expect("a property of double precision");
        match name {
            "simplification-ratio" => config.simplification_ratio = double(),
            "target-error" => config.target_error = double(),
            "window" => config.window = uint(),
            "key-int-max" => config.key_int_max = uint(),
            "superpixels" => config.superpixels = uint(),
            "subdivision-levels" => config.subdivision_levels = u8::try_from(uint()).unwrap_or(u8::MAX),
            "error-metric" => config.error_metric = value.get::<ErrorMetric>().expect("an error metric").into(),
            "threads" => config.threads = usize::try_from(uint()).unwrap_or(0),
            _ => unreachable!("no property {name}"),
        }
    }

    /// The value of the property `name`.
    pub(super) fn get(&self, name: &str) -> glib::Value {
        let Self(config) = self;
        match name {
            "simplification-ratio" => config.simplification_ratio.to_value(),
            "target-error" => config.target_error.to_value(),
            "window" => config.window.to_value(),
            "key-int-max" => config.key_int_max.to_value(),
            "superpixels" => config.superpixels.to_value(),
            "subdivision-levels" => u32::from(config.subdivision_levels).to_value(),
            "error-metric" => ErrorMetric::from(config.error_metric).to_value(),
            "threads" => u32::try_from(config.threads).unwrap_or(0).to_value(),
            _ => unreachable!("no property {name}"),
        }
    }
}

fn uint(
    (name, nick, blurb): (&'static str, &'static str, &'static str),
    range: RangeInclusive<u32>,
    default: u32,
) -> glib::ParamSpec {
    glib::ParamSpecUInt::builder(name)
        .nick(nick)
        .blurb(blurb)
        .minimum(*range.start())
        .maximum(*range.end())
        .default_value(default)
        .mutable_ready()
        .build()
}
