//! Steps of colours: as coarse as the slab's own error allows.
//!
//! In: the error that fitted colours leave. Out: a step, and what it adds to the error. Forbidden here: pictures.
//!
//! The error meant is what most of the picture has, not what edges of a drawing have: in its flat parts nothing hides the
//! steps.

/// Colour step over the root mean square error within tets, which is about seven eighths of that over all pixels on natural
/// clips. Errors of rounding are independent, and a picture interpolates between the wedges of a tet, so a step s adds
/// s^2 / 30 to the squared error: 0.15 dB at this ratio. By rate and distortion it could be coarser on BUNNY360 and finer on
/// CUP (docs/benchmarks.md).
const STEP_OVER_RMS: f64 = 1.15;

/// Steps in sixteenths of a level: 2 to 8 levels.
const STEPS: std::ops::RangeInclusive<f64> = 32.0..=128.0;

/// The part of a squared step that rounding adds to the squared error: 1/12 at a wedge, 2/5 of it inside of a tet.
const NOISE: f64 = 1.0 / 30.0;

/// The step, in sixteenths of a level, for a slab whose tets have this root mean square error, in levels.
pub(super) fn color_step(rms: f64) -> u8 {
    // `max` gives the least step without an error to go by, too.
    (16.0 * STEP_OVER_RMS * rms).round().max(*STEPS.start()).min(*STEPS.end()) as u8
}

/// The error in levels after rounding to this step.
pub(super) fn rounded_rms(rms: f64, color_step: u8) -> f64 {
    let step = f64::from(color_step) / 16.0;
    (rms * rms + NOISE * step * step).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_follow_the_error_within_their_range() {
        assert_eq!([0.0, 1.2, 4.0, 6.6, 100.0, f64::NAN].map(color_step), [32, 32, 74, 121, 128, 32]);
        let loss = |rms: f64| 20.0 * (rounded_rms(rms, color_step(rms)) / rms).log10();
        assert!(loss(6.6) < 0.19);
    }
}
