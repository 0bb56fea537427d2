//! How flat labels are: how much colours change within them.
//!
//! In: frames and their labels. Out: a factor on what is asked of colours within labels. Forbidden here: the mesh.
//!
//! Where labels have one colour throughout, as in drawings, next to nothing but their means is to be fitted, and what pixels
//! at edges say of a thin label's colours is mostly about where its edges are; so the fit prices gradients more. And what
//! lies inside of them is there for the surfaces' sake alone, so that simplification has to keep it in proportion to them.
//! One factor for all: labels' own, thin ones of which have no inside, gave 0.1 to 1 dB less.

use crate::video::{Frame, LabelPlane};

/// Part of the steps within labels, the smallest, that count: what is left are edges that labels do not follow.
const PART: f64 = 0.75;
/// Squared gradient at which the factor is 1: that of camera pictures, in squared levels a channel.
const USUAL: f64 = 1.0;
/// Greatest factor.
const MOST: f64 = 200.0;

/// What was seen of steps within labels.
#[derive(Debug, Clone)]
pub struct Flatness {
    /// Steps by size, that of the largest channel.
    histogram: [u64; 256],
}

impl Default for Flatness {
    fn default() -> Self {
        Self { histogram: [0; 256] }
    }
}

impl Flatness {
    /// Takes in a frame and its labels, which are of one size.
    pub fn look(&mut self, frame: &Frame, labels: &LabelPlane) {
        steps_inside(frame, labels, |step| self.histogram[step] += 1);
    }

    /// The usual squared gradient over that within these labels: 1 for camera pictures, 200 where labels have one colour each.
    pub fn factor(&self) -> f32 {
        let wanted = PART * self.histogram.iter().sum::<u64>() as f64;
        let (mut taken, mut squares) = (0.0, 0.0);
        for (step, &count) in self.histogram.iter().enumerate() {
            let count = (count as f64).min(wanted - taken);
            taken += count;
            squares += count * (step * step) as f64;
        }
        let squared_gradient = squares / taken.max(1.0);
        (USUAL / squared_gradient.max(USUAL / MOST)).max(1.0) as f32
    }
}

/// Calls `found` with the step from each pixel to the one at its right where both lie inside a label: others are blends.
fn steps_inside(frame: &Frame, plane: &LabelPlane, mut found: impl FnMut(usize)) {
    let (width, labels) = (frame.width() as usize, plane.labels());
    for y in 1..(frame.height() as usize).saturating_sub(1) {
        let row = frame.row(y as u32);
        let start = y * width;
        let is_inside = |x: usize| {
            let p = start + x;
            [p - 1, p + 1, p - width, p + width].iter().all(|&q| labels[q] == labels[p])
        };
        let mut before = false;
        for x in 1..width.saturating_sub(1) {
            let inside = is_inside(x);
            if before && inside {
                let step = (0..3).map(|c| row[x - 1][c].abs_diff(row[x][c])).max().unwrap_or(0);
                found(step.into());
            }
            before = inside;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::video::Label;

    fn factor(color: impl Fn(u32, u32) -> u8) -> f32 {
        let frame = Frame::from_fn(64, 16, |x, y| [color(x, y); 3]).expect("a frame");
        let labels = (0..64 * 16).map(|n| Label(u32::from(n % 64 > 30))).collect();
        let mut flatness = Flatness::default();
        flatness.look(&frame, &LabelPlane::new(64, 16, labels));
        flatness.factor()
    }

    #[test]
    fn labels_of_one_colour_are_flat_and_textured_ones_are_not() {
        assert_eq!(factor(|x, _| if x > 30 { 200 } else { 10 }), MOST as f32);
        // A blend at the edge is not inside.
        assert_eq!(factor(|x, _| [10, 90, 200][usize::from(x > 29) + usize::from(x > 30)]), MOST as f32);
        assert_eq!(factor(|x, y| (x * 7 + y * 13) as u8 % 64), 1.0);
        let faint = factor(|x, _| if x > 30 { 200 } else { x as u8 });
        assert!(faint > 1.0 && faint < MOST as f32, "{faint}");
    }
}
