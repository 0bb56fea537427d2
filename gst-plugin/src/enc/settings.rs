//! The encoder's properties: names, ranges and defaults, all read from the core's configuration.
//!
//! The preset decides all that was not set by itself, whichever was set first.

use std::ops::RangeInclusive;

use gst::glib;
use gst::prelude::*;
use tetvec::EncoderConfig;

use super::choices::{ErrorMetric, Lattice, SpeedPreset, Topology};
use crate::MAX_THREADS;

/// What the properties are set to.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    preset: SpeedPreset,
    /// What presets leave alone: goals, keyframes, threads.
    goals: EncoderConfig,
    overrides: Overrides,
}

/// What was set by itself of that which the preset decides.
#[derive(Debug, Clone, Default)]
struct Overrides {
    window: Option<u32>,
    superpixels: Option<u32>,
    subdivision_levels: Option<u8>,
    error_metric: Option<ErrorMetric>,
    lattice: Option<Lattice>,
    lattice_density: Option<f64>,
    topology: Option<Topology>,
    position_steps: Option<u32>,
    refits: Option<u32>,
}

impl Default for Settings {
    fn default() -> Self {
        Self { preset: SpeedPreset::default(), goals: EncoderConfig::new(1, 1), overrides: Overrides::default() }
    }
}

impl Settings {
    /// Descriptions of all properties.
    pub(super) fn properties() -> Vec<glib::ParamSpec> {
        [Self::choices(), Self::doubles(), Self::integers()].concat()
    }

    fn choices() -> Vec<glib::ParamSpec> {
        let default = Self::default().config();
        vec![
            glib::ParamSpecEnum::builder_with_default("speed-preset", SpeedPreset::default())
                .nick("Speed preset")
                .blurb("Time spent against error reached; properties that are set by themselves override it")
                .mutable_ready()
                .build(),
            glib::ParamSpecEnum::builder_with_default("error-metric", ErrorMetric::from(default.error_metric))
                .nick("Error metric")
                .blurb("What the simplification measures")
                .mutable_ready()
                .build(),
            glib::ParamSpecEnum::builder_with_default("lattice", Lattice::from(default.lattice))
                .nick("Lattice")
                .blurb("What the mesh starts from")
                .mutable_ready()
                .build(),
            glib::ParamSpecEnum::builder_with_default("topology", Topology::from(default.topology))
                .nick("Topology")
                .blurb("How strictly the topology of regions with sharp borders is kept")
                .mutable_ready()
                .build(),
        ]
    }

    fn doubles() -> Vec<glib::ParamSpec> {
        let default = Self::default().config();
        vec![
            double(
                ("simplification-ratio", "Simplification ratio", "Vertices of the mesh over pixels of the source"),
                EncoderConfig::SIMPLIFICATION_RATIO,
                default.simplification_ratio,
            ),
            double(
                (
                    "target-error",
                    "Target error",
                    "Simplify as far as this mean error allows, in 8-bit levels (0 = off: the simplification ratio decides)",
                ),
                EncoderConfig::TARGET_ERROR,
                default.target_error,
            ),
            double(
                (
                    "lattice-density",
                    "Lattice density",
                    "Vertices that an adaptive lattice starts with for each that is to be left",
                ),
                EncoderConfig::LATTICE_DENSITY,
                default.lattice_density,
            ),
        ]
    }

    fn integers() -> Vec<glib::ParamSpec> {
        let default = Self::default().config();
        let levels = EncoderConfig::SUBDIVISION_LEVELS;
        vec![
            uint(
                (
                    "window",
                    "Window",
                    "Length of the sliding window in frames (from key-int-max on: all from keyframe to keyframe at once); delay and memory grow with it",
                ),
                EncoderConfig::WINDOW,
                default.window,
            ),
            uint(
                (
                    "bitrate",
                    "Bit rate",
                    "Kilobits a second, by a ratio for each slab (0 = off: the simplification ratio decides)",
                ),
                EncoderConfig::BITRATE,
                default.bitrate,
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
                u32::from(*levels.start())..=u32::from(*levels.end()),
                u32::from(default.subdivision_levels),
            ),
            uint(
                (
                    "position-steps",
                    "Position steps",
                    "Steps of the position optimisation (0 = vertices stay where edges collapsed to)",
                ),
                EncoderConfig::POSITION_STEPS,
                default.position_steps,
            ),
            uint(
                ("refits", "Refits", "Fits on the way to the goal, from which simplification starts anew"),
                EncoderConfig::REFITS,
                default.refits,
            ),
            uint(
                ("threads", "Threads", "Worker threads; the stream does not depend on it (0 = all cores)"),
                0..=MAX_THREADS,
                u32::try_from(default.threads).unwrap_or(0),
            ),
        ]
    }

    /// The configuration that the properties describe; size and rates in it are the stream's, and set when it begins.
    pub(super) fn config(&self) -> EncoderConfig {
        let preset = self.goals.clone().with_preset(self.preset.into());
        let own = &self.overrides;
        EncoderConfig {
            window: own.window.unwrap_or(preset.window),
            superpixels: own.superpixels.unwrap_or(preset.superpixels),
            subdivision_levels: own.subdivision_levels.unwrap_or(preset.subdivision_levels),
            error_metric: own.error_metric.map_or(preset.error_metric, Into::into),
            lattice: own.lattice.map_or(preset.lattice, Into::into),
            lattice_density: own.lattice_density.unwrap_or(preset.lattice_density),
            topology: own.topology.map_or(preset.topology, Into::into),
            position_steps: own.position_steps.unwrap_or(preset.position_steps),
            refits: own.refits.unwrap_or(preset.refits),
            ..preset
        }
    }

    /// Sets the property `name`. GObject has checked name, type and range.
    pub(super) fn set(&mut self, name: &str, value: &glib::Value) {
        let Self { preset, goals, overrides: own } = self;
        let uint = || value.get::<u32>().expect("an unsigned property");
        let double = || value.get::<f64>().expect("a property of double precision");
        match name {
            "speed-preset" => *preset = value.get().expect("a preset"),
            "simplification-ratio" => goals.simplification_ratio = double(),
            "target-error" => goals.target_error = double(),
            "bitrate" => goals.bitrate = uint(),
            "key-int-max" => goals.key_int_max = uint(),
            "threads" => goals.threads = usize::try_from(uint()).unwrap_or(0),
            "window" => own.window = Some(uint()),
            "superpixels" => own.superpixels = Some(uint()),
            "subdivision-levels" => own.subdivision_levels = Some(u8::try_from(uint()).unwrap_or(u8::MAX)),
            "error-metric" => own.error_metric = Some(value.get().expect("an error metric")),
            "lattice" => own.lattice = Some(value.get().expect("a lattice")),
            "lattice-density" => own.lattice_density = Some(double()),
            "topology" => own.topology = Some(value.get().expect("a topology")),
            "position-steps" => own.position_steps = Some(uint()),
            "refits" => own.refits = Some(uint()),
            _ => unreachable!("no property {name}"),
        }
    }

    /// The value of the property `name` that is in effect.
    pub(super) fn get(&self, name: &str) -> glib::Value {
        let config = self.config();
        match name {
            "speed-preset" => self.preset.to_value(),
            "simplification-ratio" => config.simplification_ratio.to_value(),
            "target-error" => config.target_error.to_value(),
            "bitrate" => config.bitrate.to_value(),
            "key-int-max" => config.key_int_max.to_value(),
            "threads" => u32::try_from(config.threads).unwrap_or(0).to_value(),
            "window" => config.window.to_value(),
            "superpixels" => config.superpixels.to_value(),
            "subdivision-levels" => u32::from(config.subdivision_levels).to_value(),
            "error-metric" => ErrorMetric::from(config.error_metric).to_value(),
            "lattice" => Lattice::from(config.lattice).to_value(),
            "lattice-density" => config.lattice_density.to_value(),
            "topology" => Topology::from(config.topology).to_value(),
            "position-steps" => config.position_steps.to_value(),
            "refits" => config.refits.to_value(),
            _ => unreachable!("no property {name}"),
        }
    }
}

fn double(
    (name, nick, blurb): (&'static str, &'static str, &'static str),
    range: RangeInclusive<f64>,
    default: f64,
) -> glib::ParamSpec {
    glib::ParamSpecDouble::builder(name)
        .nick(nick)
        .blurb(blurb)
        .minimum(*range.start())
        .maximum(*range.end())
        .default_value(default)
        .mutable_ready()
        .build()
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
