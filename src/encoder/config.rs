//! The encoder's settings: names, defaults and ranges live here once; elements and tools read them.

use super::EncodeError;
use crate::bitstream::{Fraction, Limits, SequenceHeader};
use crate::vectorize::lattice::AdaptiveLattice;
use crate::video::Frame;

/// What the error quadrics of the simplification measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ErrorMetric {
    /// Squared colour error at a fixed (x, y, t).
    #[default]
    Color,
    /// The paper's: squared distance in (x, y, t, r, g, b), §IV-A.
    Paper,
}

/// What the window's mesh starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum LatticeKind {
    /// Bisected where colours or labels ask for it.
    #[default]
    Adaptive,
    /// One vertex a pixel and frame, as in the paper.
    Dense,
}

/// How strictly the simplification keeps the topology of labels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum TopologyRule {
    /// Changes have their price: thin strokes stay whole as long as little else is lost for it.
    #[default]
    Auto,
    /// Labels may merge and pinch from the start.
    Free,
    /// Strictly, whether the goal is reached or not (§IV-A3).
    Strict,
}

/// Points of time spent against error reached, measured in docs/benchmarks.md.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SpeedPreset {
    /// Colours alone are fitted, to a mesh from a coarse lattice, in short windows.
    Fast,
    /// Positions and colours are fitted.
    #[default]
    Medium,
    /// From a finer lattice.
    Slow,
    /// As the paper has it: dense lattice, labels, strict topology, its metric, windows of 10 frames, one level of
    /// subdivision, surfaces and colours fitted.
    Paper,
}

/// How an [`Encoder`](super::Encoder) works. `EncoderConfig::new` gives the defaults.
#[derive(Debug, Clone, PartialEq)]
pub struct EncoderConfig {
    /// Width of the pictures in pixels.
    pub width: u32,
    /// Height of the pictures in pixels.
    pub height: u32,
    /// Frames a second; 0/1 where there is no fixed rate.
    pub frame_rate: Fraction,
    /// Width of a pixel over its height.
    pub pixel_aspect_ratio: Fraction,
    /// Vertices of the control mesh over pixels of the source (§IV-A), [`Self::SIMPLIFICATION_RATIO`].
    pub simplification_ratio: f64,
    /// Mean absolute error per channel to simplify up to, in 8-bit levels; 0: off, the ratio decides.
    pub target_error: f64,
    /// Kilobits (1000 bits) a second of the stream, reached by a ratio of its own for each slab; 0: off, the ratio decides.
    /// At 25 frames a second where there is no fixed rate. Not together with `target_error`.
    pub bitrate: u32,
    /// Length T of the sliding window in frames (§VI), [`Self::WINDOW`]; from `key_int_max` on a slab is simplified as a
    /// whole, which reaches the lowest error.
    pub window: u32,
    /// Most frames from one keyframe to the next, [`Self::KEY_INT_MAX`].
    pub key_int_max: u32,
    /// Mean number of superpixels a frame; 0: discontinuities where the content has them, none in pictures of a camera; 1:
    /// none. Those of drawings keep them sharp at any magnification, and take 3 to 10 times as long.
    pub superpixels: u32,
    /// Levels of subdivision that the decoder is to draw with, and the fit fits for: 0 to 2. Level 0 reaches the lowest
    /// error and the sharpest edges, level 1 smoother pictures when enlarged.
    pub subdivision_levels: u8,
    /// What the quadrics measure.
    pub error_metric: ErrorMetric,
    /// What the mesh starts from.
    pub lattice: LatticeKind,
    /// Vertices that an adaptive lattice starts with for each that is to be left, [`Self::LATTICE_DENSITY`].
    pub lattice_density: f64,
    /// How strictly the topology of labels is kept.
    pub topology: TopologyRule,
    /// Steps of the position optimisation, [`Self::POSITION_STEPS`]; 0: positions stay where edges collapsed to.
    pub position_steps: u32,
    /// Fits on the way to the goal, [`Self::REFITS`]: each lets simplification start anew from a mesh that
    /// is closer to the frames. Where the window is shorter than a slab, there are none.
    pub refits: u32,
    /// Worker threads; 0: all cores. Bytes do not depend on it.
    pub threads: usize,
}

impl EncoderConfig {
    /// Range of `simplification_ratio`.
    pub const SIMPLIFICATION_RATIO: std::ops::RangeInclusive<f64> = 0.0005..=1.0;
    /// Range of `target_error`.
    pub const TARGET_ERROR: std::ops::RangeInclusive<f64> = 0.0..=255.0;
    /// Range of `bitrate`.
    pub const BITRATE: std::ops::RangeInclusive<u32> = 0..=10_000_000;
    /// Range of `window`.
    pub const WINDOW: std::ops::RangeInclusive<u32> = 4..=600;
    /// Range of `key_int_max`.
    pub const KEY_INT_MAX: std::ops::RangeInclusive<u32> = 1..=600;
    /// Range of `superpixels`.
    pub const SUPERPIXELS: std::ops::RangeInclusive<u32> = 0..=10_000;
    /// Range of `lattice_density`.
    pub const LATTICE_DENSITY: std::ops::RangeInclusive<f64> = 1.0..=1000.0;
    /// Range of `position_steps`.
    pub const POSITION_STEPS: std::ops::RangeInclusive<u32> = 0..=100;
    /// Range of `refits`.
    pub const REFITS: std::ops::RangeInclusive<u32> = 0..=8;
    /// Range of `subdivision_levels`.
    pub const SUBDIVISION_LEVELS: std::ops::RangeInclusive<u8> = 0..=2;

    /// Defaults for pictures of this size at 25 frames a second.
    pub fn new(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            frame_rate: Fraction { numerator: 25, denominator: 1 },
            pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
            simplification_ratio: 0.01,
            target_error: 0.0,
            bitrate: 0,
            window: 60,
            key_int_max: 60,
            superpixels: 0,
            subdivision_levels: 0,
            error_metric: ErrorMetric::Color,
            lattice: LatticeKind::Adaptive,
            lattice_density: 12.0,
            topology: TopologyRule::Auto,
            position_steps: 12,
            refits: 2,
            threads: 0,
        }
    }

    /// The same with what `preset` sets: everything but sizes, rates, goals, keyframes and threads.
    #[must_use]
    pub fn with_preset(self, preset: SpeedPreset) -> Self {
        let medium = Self::new(self.width, self.height);
        let base = Self {
            window: medium.window,
            superpixels: medium.superpixels,
            subdivision_levels: medium.subdivision_levels,
            error_metric: medium.error_metric,
            lattice: medium.lattice,
            lattice_density: medium.lattice_density,
            topology: medium.topology,
            position_steps: medium.position_steps,
            refits: medium.refits,
            ..self
        };
        match preset {
            SpeedPreset::Fast => {
                Self { window: 10, superpixels: 1, lattice_density: 3.0, position_steps: 0, refits: 0, ..base }
            }
            SpeedPreset::Medium => base,
            SpeedPreset::Slow => Self { lattice_density: 24.0, position_steps: 24, refits: 4, ..base },
            SpeedPreset::Paper => Self {
                window: 10,
                subdivision_levels: 1,
                error_metric: ErrorMetric::Paper,
                lattice: LatticeKind::Dense,
                topology: TopologyRule::Strict,
                position_steps: 0,
                refits: 0,
                ..base
            },
        }
    }

    /// Checks every field against its range.
    ///
    /// # Errors
    /// [`EncodeError::Setting`] names the first field out of range.
    pub fn validate(&self) -> Result<(), EncodeError> {
        if Frame::check_size(self.width, self.height).is_err() {
            let found = format!("{}x{}", self.width, self.height);
            return Err(setting("width x height", &(1..=crate::video::MAX_FRAME_SIDE), found));
        }
        let in_range = |field, value: u32, range: std::ops::RangeInclusive<u32>| {
            if range.contains(&value) { Ok(()) } else { Err(setting(field, &range, value)) }
        };
        if !Self::SIMPLIFICATION_RATIO.contains(&self.simplification_ratio) {
            return Err(setting("simplification_ratio", &Self::SIMPLIFICATION_RATIO, self.simplification_ratio));
        }
        if !Self::TARGET_ERROR.contains(&self.target_error) {
            return Err(setting("target_error", &Self::TARGET_ERROR, self.target_error));
        }
        let bitrates = if self.target_error > 0.0 { 0..=0 } else { Self::BITRATE };
        in_range("bitrate", self.bitrate, bitrates)?;
        if !Self::LATTICE_DENSITY.contains(&self.lattice_density) {
            return Err(setting("lattice_density", &Self::LATTICE_DENSITY, self.lattice_density));
        }
        in_range("position_steps", self.position_steps, Self::POSITION_STEPS)?;
        in_range("refits", self.refits, Self::REFITS)?;
        if self.frames_within_limits() == 0 {
            let found = format!("{} at {}x{}", self.simplification_ratio, self.width, self.height);
            return Err(setting("simplification_ratio x width x height", &(0..=Limits::default().max_vertices), found));
        }
        in_range("window", self.window, Self::WINDOW)?;
        in_range("key_int_max", self.key_int_max, Self::KEY_INT_MAX)?;
        in_range("superpixels", self.superpixels, Self::SUPERPIXELS)?;
        let levels = Self::SUBDIVISION_LEVELS;
        in_range(
            "subdivision_levels",
            self.subdivision_levels.into(),
            (*levels.start()).into()..=(*levels.end()).into(),
        )?;
        in_range("frame_rate.denominator", self.frame_rate.denominator, 1..=u32::MAX)?;
        in_range("pixel_aspect_ratio.numerator", self.pixel_aspect_ratio.numerator, 1..=u32::MAX)?;
        in_range("pixel_aspect_ratio.denominator", self.pixel_aspect_ratio.denominator, 1..=u32::MAX)
    }

    /// Most frames of a slab: `key_int_max`, or fewer where a slab's mesh would be more than decoders accept.
    pub fn slab_frames(&self) -> u32 {
        self.key_int_max.min(self.frames_within_limits())
    }

    /// Frame steps of a run of lattice: half a window, or equal parts of it that an adaptive lattice can have.
    pub(super) fn run_steps(&self) -> u32 {
        let half = self.window / 2;
        match self.lattice {
            LatticeKind::Dense => half,
            LatticeKind::Adaptive => {
                let half = half.max(AdaptiveLattice::MIN_CUT);
                half.div_ceil(half.div_ceil(AdaptiveLattice::MAX_STEPS))
            }
        }
    }

    /// Frames behind the window's leading plane that are kept after a step: with the next run they are the window. A window
    /// as long as a slab keeps all.
    pub(super) fn kept_frames(&self) -> u32 {
        if self.window >= self.slab_frames() { u32::MAX } else { self.window.saturating_sub(self.run_steps()).max(1) }
    }

    /// Vertices a pixel that an adaptive lattice starts with.
    pub(super) fn lattice_ratio(&self) -> f64 {
        // What a slab before needed says nothing of the next scene.
        let least = if self.target_error > 0.0 { LEAST_STEERED_RATIO } else { 0.0 };
        (self.simplification_ratio.max(least) * self.lattice_density).min(1.0)
    }

    /// Frames whose mesh decoders accept, with room for the plane that joins the next slab.
    fn frames_within_limits(&self) -> u32 {
        let a_frame = self.simplification_ratio * self.pixels();
        (self.most_vertices() / a_frame - 1.0) as u32
    }

    /// Whether the window holds a slab as a whole.
    pub(super) fn holds_slab(&self) -> bool {
        self.kept_frames() == u32::MAX
    }

    /// Pixels of a frame.
    pub(super) fn pixels(&self) -> f64 {
        f64::from(self.width) * f64::from(self.height)
    }

    /// Vertices of a slab that decoders accept.
    pub(super) fn most_vertices(&self) -> f64 {
        let limits = Limits::default();
        f64::from(limits.max_vertices).min(f64::from(limits.max_tets) / TETS_A_VERTEX)
    }

    /// The sequence header of streams made with these settings; slabs that begin with labels have finer positions.
    pub fn header(&self) -> SequenceHeader {
        SequenceHeader {
            width: self.width,
            height: self.height,
            frame_rate: self.frame_rate,
            pixel_aspect_ratio: self.pixel_aspect_ratio,
            subpixel_bits: SUBPIXEL_BITS,
            subdivision_levels: self.subdivision_levels,
        }
    }

    /// The same of a slab, given whether it begins with labels.
    pub(super) fn slab_header(&self, is_cut: bool) -> SequenceHeader {
        let subpixel_bits = if is_cut { CUT_SUBPIXEL_BITS } else { SUBPIXEL_BITS };
        SequenceHeader { subpixel_bits, ..self.header() }
    }
}

/// Tets a vertex of a simplified mesh, with a margin: 5 to 6.5 on natural clips.
const TETS_A_VERTEX: f64 = 7.0;
/// Vertices a pixel that a slab may come to need in any case where the error decides.
const LEAST_STEERED_RATIO: f64 = 0.01;
/// Positions are rounded to 1/8 px and 1/8 frame: costs 0.1 dB (docs/benchmarks.md).
const SUBPIXEL_BITS: u8 = 3;
/// The same in slabs that begin with labels, where places are what is to be seen: of drawings in motion one digit more is worth
/// 1.3 dB at 8x, and takes no more bytes, as colours need not make up for it.
const CUT_SUBPIXEL_BITS: u8 = 4;

fn setting<T: std::fmt::Debug>(
    field: &'static str,
    expected: &std::ops::RangeInclusive<T>,
    found: impl std::fmt::Display,
) -> EncodeError {
    let expected = format!("{:?} to {:?}", expected.start(), expected.end());
    EncodeError::Setting { field, expected, found: found.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_leave_goals_alone() {
        let mine =
            EncoderConfig { simplification_ratio: 0.05, key_int_max: 30, threads: 1, ..EncoderConfig::new(64, 48) };
        for preset in [SpeedPreset::Fast, SpeedPreset::Medium, SpeedPreset::Slow, SpeedPreset::Paper] {
            let set = mine.clone().with_preset(preset);
            assert_eq!(set.validate(), Ok(()));
            assert_eq!((set.simplification_ratio, set.key_int_max, set.threads), (0.05, 30, 1));
            assert_eq!(set.with_preset(SpeedPreset::Medium), mine, "each sets all that another does");
        }
    }

    #[test]
    fn slabs_start_dense_where_the_error_decides() {
        let sparse = EncoderConfig { simplification_ratio: 0.0005, ..EncoderConfig::new(64, 48) };
        assert!((sparse.lattice_ratio() - 0.006).abs() < 1e-9);
        let after_black = EncoderConfig { target_error: 1.0, ..sparse };
        assert!(after_black.lattice_ratio() > 0.1, "the next scene needs more than black did");
    }

    #[test]
    fn names_the_field_out_of_range() {
        let good = EncoderConfig::new(320, 240);
        assert_eq!(good.validate(), Ok(()));
        let field = |config: EncoderConfig| match config.validate() {
            Err(EncodeError::Setting { field, .. }) => field,
            other => panic!("expected a refusal, found {other:?}"),
        };
        assert_eq!(field(EncoderConfig::new(0, 240)), "width x height");
        assert_eq!(field(EncoderConfig { simplification_ratio: f64::NAN, ..good.clone() }), "simplification_ratio");
        assert_eq!(field(EncoderConfig { target_error: -1.0, ..good.clone() }), "target_error");
        assert_eq!(field(EncoderConfig { target_error: 1.0, bitrate: 100, ..good.clone() }), "bitrate");
        assert_eq!(field(EncoderConfig { lattice_density: 0.5, ..good.clone() }), "lattice_density");
        assert_eq!(field(EncoderConfig { position_steps: 101, ..good.clone() }), "position_steps");
        assert_eq!(field(EncoderConfig { refits: 9, ..good.clone() }), "refits");
        assert_eq!(field(EncoderConfig { window: 3, ..good.clone() }), "window");
        assert_eq!(field(EncoderConfig { key_int_max: 0, ..good.clone() }), "key_int_max");
        assert_eq!(field(EncoderConfig { subdivision_levels: 3, ..good }), "subdivision_levels");
    }
}
