//! Colours as CIE L*a*b*, in which equal steps look about equal.
//!
//! In: a frame (sRGB). Out: its pixels as (L*, a*, b*), L* from 0 to 100. Forbidden here: anything but colour.

use crate::video::Frame;

/// (L*, a*, b*), CIE 1976, white D65.
pub(super) type Lab = [f32; 3];

/// Steps of the table of the cube root; interpolation between them is off by less than 0.05 L* in the darkest tones.
const ROOT_STEPS: usize = 4096;

/// Rows of the sRGB to XYZ matrix (IEC 61966-2-1), divided by the white point, so that white maps to (1, 1, 1).
const TO_XYZ: [[f32; 3]; 3] =
    [[0.433_953, 0.376_219, 0.189_828], [0.212_671, 0.715_160, 0.072_169], [0.017_758, 0.109_477, 0.872_765]];

/// Tables for the conversion.
#[derive(Debug, Clone)]
pub(super) struct LabTables {
    linear: Vec<f32>,
    root: Vec<f32>,
}

impl LabTables {
    pub(super) fn new() -> Self {
        let linear = (0..256)
            .map(|level| {
                let v = f64::from(level) / 255.0;
                (if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }) as f32
            })
            .collect();
        let root = (0..=ROOT_STEPS + 1)
            .map(|step| {
                let v = step as f64 / ROOT_STEPS as f64;
                (if v > 216.0 / 24_389.0 { v.cbrt() } else { (24_389.0 / 27.0 * v + 16.0) / 116.0 }) as f32
            })
            .collect();
        Self { linear, root }
    }

    /// The picture's pixels, row by row.
    pub(super) fn convert(&self, frame: &Frame) -> Vec<Lab> {
        frame.pixels().iter().map(|&rgb| self.color(rgb)).collect()
    }

    fn color(&self, rgb: [u8; 3]) -> Lab {
        let linear = rgb.map(|level| self.linear[level as usize]);
        let [fx, fy, fz] =
            TO_XYZ.map(|row| self.cube_root(row[0] * linear[0] + row[1] * linear[1] + row[2] * linear[2]));
        [116.0 * fy - 16.0, 500.0 * (fx - fy), 200.0 * (fy - fz)]
    }

    fn cube_root(&self, v: f32) -> f32 {
        let position = v.clamp(0.0, 1.0) * ROOT_STEPS as f32;
        let step = position as usize;
        self.root[step] + (position - step as f32) * (self.root[step + 1] - self.root[step])
    }
}

#[cfg(test)]
mod tests {
    use super::LabTables;

    #[test]
    fn known_colors() {
        let tables = LabTables::new();
        // Reference values: the CIE formulas evaluated in double precision.
        let known = [
            ([255, 255, 255], [100.0, 0.0, 0.0]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
            ([255, 0, 0], [53.24, 80.09, 67.20]),
            ([0, 0, 255], [32.30, 79.19, -107.86]),
            ([10, 10, 10], [2.74, 0.0, 0.0]),
        ];
        for (rgb, lab) in known {
            let found = tables.color(rgb);
            for channel in 0..3 {
                assert!((found[channel] - lab[channel]).abs() < 0.15, "{rgb:?}: {found:?}, expected {lab:?}");
            }
        }
    }
}
