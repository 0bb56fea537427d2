//! How good a picture is and how sparse a mesh: the figures of the paper's Table I.
//!
//! In: pictures. Out: numbers. Forbidden here: meshes, coding.

use crate::video::Frame;

/// Differences between pictures, pooled over all of them.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Difference {
    absolute: u64,
    squared: u64,
    samples: u64,
}

impl Difference {
    /// Adds the difference of one pair of pictures.
    ///
    /// # Panics
    /// If they differ in size.
    pub fn add(&mut self, reference: &Frame, test: &Frame) {
        assert_eq!((reference.width(), reference.height()), (test.width(), test.height()), "pictures of one size");
        for (a, b) in reference.pixels().as_flattened().iter().zip(test.pixels().as_flattened()) {
            let difference = u64::from(a.abs_diff(*b));
            self.absolute += difference;
            self.squared += difference * difference;
        }
        self.samples += 3 * reference.pixels().len() as u64;
    }

    /// Reconstruction error: mean absolute difference per channel, in 8-bit levels. 0 without pictures.
    pub fn reconstruction_error(&self) -> f64 {
        self.absolute as f64 / self.samples.max(1) as f64
    }

    /// Peak signal-to-noise ratio over all channels, in dB; infinite where nothing differs.
    pub fn psnr(&self) -> f64 {
        10.0 * (255.0f64.powi(2) * self.samples as f64 / self.squared as f64).log10()
    }
}

/// Simplification ratio (§IV-A): vertices of the control mesh, a boundary vertex counted once, over source pixels.
pub fn simplification_ratio(vertices: u64, width: u32, height: u32, frames: u64) -> f64 {
    vertices as f64 / (f64::from(width) * f64::from(height) * frames as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_differences() {
        let black = Frame::from_fn(4, 2, |_, _| [0, 0, 0]).unwrap();
        let grey = Frame::from_fn(4, 2, |_, _| [3, 0, 3]).unwrap();
        let mut difference = Difference::default();
        difference.add(&black, &black);
        assert_eq!(difference.reconstruction_error(), 0.0);
        assert_eq!(difference.psnr(), f64::INFINITY);
        difference.add(&black, &grey);
        assert!((difference.reconstruction_error() - 1.0).abs() < 1e-12);
        assert!((difference.psnr() - 10.0 * (255.0f64.powi(2) / 3.0).log10()).abs() < 1e-9);
        assert!((simplification_ratio(8, 4, 2, 10) - 0.1).abs() < 1e-12);
    }
}
