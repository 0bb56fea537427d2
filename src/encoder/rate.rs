//! Goals for a whole stream, bit rate or error: what the next slab is to aim at.
//!
//! In: what slabs so far came to. Out: the next one's simplification ratio or error. Forbidden here: pictures, meshes.
//!
//! Bytes a vertex differ little within a clip, so the last slab's tell how many vertices the next one can have. What a slab
//! took too much or too little is made good over the length of the next one.

use super::EncoderConfig;
use crate::bitstream::Limits;

/// Bytes a vertex before the first slab is written (docs/benchmarks.md): with labels by content, between one label's 4.4 and a
/// drawing's 5.8, with one label, and with superpixels.
const FIRST_BYTES_A_VERTEX: [f64; 3] = [5.0, 4.5, 8.5];

/// The frame rate assumed where there is no fixed one.
const FALLBACK_RATE: f64 = 25.0;

/// A slab's part of the rate, at least and at most, whatever the slabs before it took.
const SHARE: std::ops::RangeInclusive<f64> = 0.25..=4.0;

/// Keeps a bit rate from slab to slab.
#[derive(Debug, Clone)]
pub(super) struct RateControl {
    /// Bytes that a frame may take.
    bytes_a_frame: f64,
    pixels: f64,
    /// Frames over which a difference is made good.
    horizon: f64,
    bytes_a_vertex: f64,
    /// Bytes allowed and not taken so far; negative if too many were taken.
    saved: f64,
}

impl RateControl {
    /// Control for the bit rate of `config`; `None` if it has none.
    pub(super) fn new(config: &EncoderConfig) -> Option<Self> {
        if config.bitrate == 0 {
            return None;
        }
        let rate = config.frame_rate;
        let rate = f64::from(rate.numerator) / f64::from(rate.denominator.max(1));
        let rate = if rate > 0.0 { rate } else { FALLBACK_RATE };
        Some(Self {
            bytes_a_frame: f64::from(config.bitrate) * 1000.0 / 8.0 / rate,
            pixels: config.pixels(),
            horizon: f64::from(config.key_int_max),
            bytes_a_vertex: FIRST_BYTES_A_VERTEX[config.superpixels.min(2) as usize],
            saved: 0.0,
        })
    }

    /// The simplification ratio of the next slab.
    pub(super) fn simplification_ratio(&self) -> f64 {
        let share = 1.0 + self.saved / self.horizon / self.bytes_a_frame;
        let bytes = self.bytes_a_frame * share.clamp(*SHARE.start(), *SHARE.end());
        ratio_within_limits(bytes / self.bytes_a_vertex / self.pixels, self.pixels)
    }

    /// A slab of so many frames has so many vertices and took so many bytes.
    pub(super) fn end_slab(&mut self, frames: u32, vertices: u64, bytes: u64) {
        self.saved += self.bytes_a_frame * f64::from(frames) - bytes as f64;
        if vertices > 0 && bytes > 0 {
            self.bytes_a_vertex = bytes as f64 / vertices as f64;
        }
    }
}

/// The simplification ratio nearest to `wanted` that settings may have, and a slab of a few frames of so many pixels.
fn ratio_within_limits(wanted: f64, pixels: f64) -> f64 {
    let range = EncoderConfig::SIMPLIFICATION_RATIO;
    let most = range.end().min(f64::from(Limits::default().max_vertices) / 8.0 / pixels);
    wanted.clamp(*range.start(), most.max(*range.start()))
}

/// Vertices a pixel that the first slab may need where the error decides: more than streams are made of that anyone watches.
const FIRST_RATIO: f64 = 0.02;

/// Vertices that a slab may need over those that the last one had.
const HEADROOM: f64 = 1.3;

/// A slab's target, at least and at most, over the stream's, whatever the slabs before it reached.
const AIM: std::ops::RangeInclusive<f64> = 0.75..=1.25;

/// Keeps a mean error from slab to slab.
#[derive(Debug, Clone)]
pub(super) struct ErrorControl {
    target: f64,
    pixels: f64,
    /// Frames over which a difference is made good.
    horizon: f64,
    /// Sum over all frames so far of what the error was below the target.
    saved: f64,
    /// Vertices a pixel that the next slab may need.
    ratio: f64,
}

impl ErrorControl {
    /// Control for the target error of `config`; `None` if it has none.
    pub(super) fn new(config: &EncoderConfig) -> Option<Self> {
        let EncoderConfig { target_error: target, key_int_max, .. } = *config;
        let pixels = config.pixels();
        let ratio = ratio_within_limits(FIRST_RATIO, pixels);
        (target > 0.0).then(|| Self { target, pixels, horizon: key_int_max.into(), saved: 0.0, ratio })
    }

    /// The target error of the next slab.
    pub(super) fn target(&self) -> f64 {
        let aim = 1.0 + self.saved / self.horizon / self.target;
        self.target * aim.clamp(*AIM.start(), *AIM.end())
    }

    /// The simplification ratio that the next slab may need: it says how long the slab is, as decoders accept so many vertices, and
    /// how many it starts with.
    pub(super) fn simplification_ratio(&self) -> f64 {
        self.ratio
    }

    /// A slab of so many frames has so many vertices and this mean absolute error.
    pub(super) fn end_slab(&mut self, frames: u32, vertices: u64, error: f64) {
        self.saved += (self.target - error) * f64::from(frames);
        let ratio = vertices as f64 / (f64::from(frames.max(1)) * self.pixels);
        self.ratio = ratio_within_limits(HEADROOM * ratio, self.pixels);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes over those allowed after slabs of such lengths, each with such bytes a vertex.
    fn ratio_reached(slabs: &[(u32, f64)]) -> f64 {
        let config = EncoderConfig { bitrate: 800, ..EncoderConfig::new(640, 360) };
        let mut control = RateControl::new(&config).expect("a bit rate");
        let (mut taken, mut allowed) = (0.0, 0.0);
        for &(frames, bytes_a_vertex) in slabs {
            let pixels = f64::from(frames) * 640.0 * 360.0;
            let vertices = (control.simplification_ratio() * pixels).round();
            let bytes = (vertices * bytes_a_vertex).round();
            control.end_slab(frames, vertices as u64, bytes as u64);
            taken += bytes;
            allowed += f64::from(frames) * 4000.0;
        }
        taken / allowed
    }

    #[test]
    fn the_rate_is_kept_whatever_a_vertex_takes() {
        for bytes_a_vertex in [3.0, 4.5, 6.0, 10.0] {
            let slabs = [60, 60, 60, 60, 10].map(|frames| (frames, bytes_a_vertex));
            let reached = ratio_reached(&slabs);
            assert!((0.97..=1.03).contains(&reached), "{bytes_a_vertex}: {reached}");
        }
        let changing = ratio_reached(&[(60, 4.0), (60, 4.5), (60, 4.2), (60, 4.4), (10, 5.0)]);
        assert!((0.95..=1.05).contains(&changing), "{changing}");
    }

    #[test]
    fn an_error_is_made_good() {
        let config = EncoderConfig { target_error: 2.0, ..EncoderConfig::new(640, 360) };
        let mut control = ErrorControl::new(&config).expect("a target");
        assert_eq!(control.target(), 2.0);
        control.end_slab(60, 1000, 2.3);
        assert!((control.target() - 1.7).abs() < 1e-9);
        control.end_slab(60, 1000, 1.7);
        assert!((control.target() - 2.0).abs() < 1e-9);
        control.end_slab(60, 1000, 9.0);
        assert_eq!(control.target(), 1.5);
    }

    #[test]
    fn slabs_of_many_vertices_are_short() {
        let config = EncoderConfig { target_error: 1.0, ..EncoderConfig::new(3840, 2160) };
        let mut control = ErrorControl::new(&config).expect("a target");
        let mut frames = |vertices| {
            control.end_slab(10, vertices, 1.0);
            let simplification_ratio = control.simplification_ratio();
            EncoderConfig { simplification_ratio, ..config.clone() }.slab_frames()
        };
        assert_eq!(frames(10_000), 60);
        assert_eq!(frames(1_000_000), 8);
        assert!(frames(10_000_000) >= 1, "one frame is a slab");
    }

    #[test]
    fn without_a_goal_there_is_no_control() {
        assert!(RateControl::new(&EncoderConfig::new(640, 360)).is_none());
        assert!(ErrorControl::new(&EncoderConfig::new(640, 360)).is_none());
    }
}
