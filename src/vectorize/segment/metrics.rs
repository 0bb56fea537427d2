//! How good a segmentation is, without ground truth.
//!
//! In: frames and their label planes. Out: explained variation and mean duration. Forbidden here: judging by taste.
//!
//! Definitions: Xu and Corso, "Evaluation of super-voxel methods for early video processing" (CVPR 2012), §3.

use std::collections::BTreeMap;

use crate::video::{Frame, Label, LabelPlane};

/// Share of the colour variance that the labels' mean colours explain, 0 to 1 (1 where there is none to explain).
/// Frames and planes are of one size and as many; further ones on either side are ignored.
pub fn explained_variation(frames: &[Frame], planes: &[LabelPlane]) -> f64 {
    let mut regions: BTreeMap<Label, Moments> = BTreeMap::new();
    for (frame, plane) in frames.iter().zip(planes) {
        let mut colors = frame.pixels().iter().zip(plane.labels()).peekable();
        while let Some((&color, &label)) = colors.next() {
            // One look-up a run: neighbours mostly share their label.
            let region = regions.entry(label).or_default();
            region.add(color);
            while let Some((&color, _)) = colors.next_if(|(_, next)| **next == label) {
                region.add(color);
            }
        }
    }
    let mut all = Moments::default();
    regions.values().for_each(|region| all.merge(region));
    let within: f64 = regions.values().map(Moments::scatter).sum();
    let total = all.scatter();
    if total > 0.0 { 1.0 - within / total } else { 1.0 }
}

/// Mean number of frames in which a label appears; 0 without labels.
pub fn mean_duration(planes: &[LabelPlane]) -> f64 {
    let mut durations: BTreeMap<Label, u64> = BTreeMap::new();
    for plane in planes {
        let mut present = plane.labels().to_vec();
        present.sort_unstable();
        present.dedup();
        for label in present {
            *durations.entry(label).or_default() += 1;
        }
    }
    if durations.is_empty() { 0.0 } else { durations.values().sum::<u64>() as f64 / durations.len() as f64 }
}

/// Sums of a set of colours; exact for up to 2^32 pixels.
#[derive(Default)]
struct Moments {
    count: u64,
    sums: [u64; 3],
    squares: u64,
}

impl Moments {
    fn add(&mut self, color: [u8; 3]) {
        self.count += 1;
        for (sum, level) in self.sums.iter_mut().zip(color.map(u64::from)) {
            *sum += level;
            self.squares += level * level;
        }
    }

    fn merge(&mut self, other: &Self) {
        self.count += other.count;
        self.squares += other.squares;
        for (sum, level) in self.sums.iter_mut().zip(other.sums) {
            *sum += level;
        }
    }

    /// Summed squared distance to the mean.
    fn scatter(&self) -> f64 {
        let mean_part: f64 =
            self.sums.iter().map(|&sum| sum as f64 * sum as f64).sum::<f64>() / self.count.max(1) as f64;
        (self.squares as f64 - mean_part).max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::{explained_variation, mean_duration};
    use crate::video::{Frame, Label, LabelPlane};

    fn plane(labels: [u32; 4]) -> LabelPlane {
        LabelPlane::new(4, 1, labels.map(Label).to_vec())
    }

    fn frame(levels: [u8; 4]) -> Frame {
        Frame::try_new(4, 1, levels.map(|level| [level; 3]).to_vec()).expect("size")
    }

    #[test]
    fn explained_variation_of_known_labellings() {
        let frames = [frame([10, 10, 90, 90])];
        assert_eq!(explained_variation(&frames, &[plane([0, 0, 1, 1])]), 1.0);
        assert_eq!(explained_variation(&frames, &[plane([0, 0, 0, 0])]), 0.0);
        // Labels 0 and 1 have scatter 0 and 3 * (2/3 of 80^2) of a total of 3 * 4 * 40^2.
        let found = explained_variation(&frames, &[plane([0, 1, 1, 1])]);
        assert!((found - (1.0 - 2.0 / 3.0 * 6400.0 / 6400.0)).abs() < 1e-12, "{found}");
        assert_eq!(explained_variation(&[frame([7; 4])], &[plane([0; 4])]), 1.0);
    }

    #[test]
    fn duration_counts_frames_not_pixels() {
        assert_eq!(mean_duration(&[]), 0.0);
        assert_eq!(mean_duration(&[plane([0, 0, 0, 1]), plane([0, 0, 0, 0]), plane([0, 2, 2, 0])]), 5.0 / 3.0);
    }
}
