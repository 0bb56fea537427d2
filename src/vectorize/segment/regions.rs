//! Merges superpixels into regions where the colour does not jump between them.
//!
//! In: superpixels, the frame, the labels of the frame before. Out: a region for each superpixel. Forbidden here:
//! moving pixels between superpixels; naming the regions.
//!
//! Greedy region merging, weakest boundary first, in the line of Felzenszwalb and Huttenlocher, "Efficient graph-based
//! image segmentation" (IJCV 2004). Jumps are measured anew, between merged regions, as the threshold rises, so that a
//! sliver of blended pixels does not hide the jump across it.

use std::collections::BTreeMap;

use super::contours::{Contour, Contours, flatness};
use super::region_graph::{RegionGraph, Seam};
use super::superpixels::Superpixels;
use crate::video::Frame;

/// When a boundary stays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct MergeRules {
    /// Jump up to which boundaries go, in levels.
    pub(super) jump: f32,
    /// How much less is enough for a boundary that was there in the frame before, and how much more is needed for one
    /// within a label.
    pub(super) hysteresis: f32,
    /// What a region's boundary must be worth: the sum, over its pixel sides, of the levels beyond the threshold.
    pub(super) worth: f32,
}

/// Shares of the threshold at which jumps are measured anew.
const STAGES: [f32; 3] = [0.25, 0.5, 0.75];
/// At the full threshold jumps are measured anew after every region has merged with at most one other, this many times:
/// a strip of the middle colour between two regions must join one of them, not both.
const ROUNDS: usize = 6;
/// Between wholly flat sides this share of the jump is enough: there any step is seen, and no gradient or texture could
/// have made it.
const FLAT_SHARE: f32 = 0.5;
/// No jump of less than this is one, whatever the rules, in levels.
const LEAST_THRESHOLD: f32 = 1.0;
/// Most sweeps of [`Merger::straighten`].
const SWEEPS: usize = 4;

/// The region of each superpixel, as a number.
///
/// Labels of the frame before come together first, so that what is compared then are whole labels along all of their
/// common boundary: one faint spot on it must not let them run into each other.
pub(super) fn merge(map: &Superpixels, frame: &Frame, rules: MergeRules) -> Vec<u32> {
    let merger = Merger { map, contours: Contours::new(map, frame), flat: flatness(map, frame), rules };
    let mut groups: Vec<u32> = (0..map.cells.len() as u32).collect();
    let alone = merger.contours.between(&groups);
    if map.cells.iter().any(|cell| cell.label.is_some()) {
        merger.merge_in_stages(&mut groups, |contour| merger.is_within_label(contour));
    }
    merger.merge_in_stages(&mut groups, |_| true);
    merger.merge_in_rounds(&mut groups);
    merger.straighten(&mut groups, &alone);
    let mut graph = merger.graph(&groups, |_| true);
    graph.merge_seams_below(0.0);
    graph.merge_regions_worth_less(rules.worth);
    graph.name(&mut groups);
    groups
}

struct Merger<'a> {
    map: &'a Superpixels,
    contours: Contours<'a>,
    flat: Vec<f32>,
    rules: MergeRules,
}

impl Merger<'_> {
    /// Jump up to which a contour goes.
    fn threshold(&self, contour: &Contour) -> f32 {
        let flat = contour.cells.map(|cell| self.flat[cell as usize]);
        let flat_share = 1.0 - (1.0 - FLAT_SHARE) * flat[0].min(flat[1]);
        let base = match contour.cells.map(|cell| self.map.cells[cell as usize].label) {
            [Some(a), Some(b)] if a != b => self.rules.jump - self.rules.hysteresis,
            [Some(_), Some(_)] => self.rules.jump + self.rules.hysteresis,
            _ => self.rules.jump,
        };
        (base * flat_share).max(LEAST_THRESHOLD)
    }

    /// What a contour says for staying, from -1 (no jump) to 1 (twice the threshold) a pixel side. None says more for it
    /// than one without a jump says against: a boundary stays if it is seen along most of its length, however strong its
    /// strongest spot is.
    fn margin(&self, contour: &Contour) -> f32 {
        contour.length * (contour.jump / self.threshold(contour) - 1.0).min(1.0)
    }

    fn is_within_label(&self, contour: &Contour) -> bool {
        let [a, b] = contour.cells.map(|cell| self.map.cells[cell as usize].label);
        a.is_some() && a == b
    }

    /// The groups as regions, with the seams of those contours that `counts` takes.
    fn graph(&self, groups: &[u32], counts: impl Fn(&Contour) -> bool) -> RegionGraph {
        let mut graph = RegionGraph::new(groups.len());
        for contour in self.contours.between(groups).into_iter().filter(counts) {
            let [a, b] = contour.cells.map(|cell| groups[cell as usize]);
            let worth = contour.length * (contour.jump - self.threshold(&contour));
            graph.add(a, b, Seam { margin: self.margin(&contour), worth, length: contour.length });
        }
        graph
    }

    fn merge_in_stages(&self, groups: &mut [u32], counts: impl Fn(&Contour) -> bool) {
        for stage in STAGES {
            let mut graph = self.graph(groups, &counts);
            graph.merge_seams_below(stage - 1.0);
            graph.name(groups);
        }
    }

    fn merge_in_rounds(&self, groups: &mut [u32]) {
        for _ in 0..ROUNDS {
            let mut graph = self.graph(groups, |_| true);
            let merged = graph.merge_pairs_below(0.0);
            graph.name(groups);
            if !merged {
                break;
            }
        }
    }

    /// Moves single superpixels to the region that they are least set off from, by contours `alone` of all superpixels:
    /// greedy merging leaves boundaries where there is no jump once the rest of a long seam is strong.
    fn straighten(&self, groups: &mut [u32], alone: &[Contour]) {
        let mut bonds: Vec<Vec<(u32, f32)>> = vec![Vec::new(); groups.len()];
        for contour in alone {
            let [a, b] = contour.cells;
            bonds[a as usize].push((b, -self.margin(contour)));
            bonds[b as usize].push((a, -self.margin(contour)));
        }
        for _ in 0..SWEEPS {
            let mut moved = false;
            for (cell, bonds) in bonds.iter().enumerate() {
                let mut pull: BTreeMap<u32, f32> = BTreeMap::new();
                for &(neighbor, bond) in bonds {
                    *pull.entry(groups[neighbor as usize]).or_default() += bond;
                }
                // A superpixel that is a region by itself is not a matter of where a boundary runs.
                let Some(&here) = pull.get(&groups[cell]) else { continue };
                let best = pull.into_iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
                // Strictly better by more than rounding: no move can come back.
                if let Some((group, _)) = best.filter(|(group, pull)| *group != groups[cell] && *pull > here + 0.01) {
                    groups[cell] = group;
                    moved = true;
                }
            }
            if !moved {
                break;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{MergeRules, merge};
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::Superpixels;
    use crate::video::{Frame, Label};

    const RULES: MergeRules = MergeRules { jump: 60.0, hysteresis: 15.0, worth: 100.0 };

    fn stripe_map(width: u32, labels: &[Option<u32>], stripe: impl Fn(u32) -> u32) -> Superpixels {
        let mut map = Superpixels::new(Raster::new(width, 16));
        labels.iter().for_each(|label| _ = map.add(label.map(Label), [0, 0]));
        map.plane = (0..16 * width).map(|p| stripe(p % width)).collect();
        map.recount(&vec![[0.0; 3]; map.raster.len()]);
        map
    }

    /// Vertical stripes 8 pixels wide, one superpixel each, on 16 rows: of these grey levels, with a grain of `grain`.
    fn stripes(levels: &[u8], grain: u8, labels: &[Option<u32>]) -> (Superpixels, Frame) {
        let width = 8 * levels.len() as u32;
        let level = |x: u32, y: u32| levels[x as usize / 8] + grain * ((x + y) % 2) as u8;
        (stripe_map(width, labels, |x| x / 8), Frame::from_fn(width, 16, |x, y| [level(x, y); 3]).expect("size"))
    }

    #[test]
    fn boundaries_go_below_the_threshold_and_stay_above() {
        let (map, frame) = stripes(&[20, 70, 140, 150], 4, &[None; 4]);
        assert_eq!(merge(&map, &frame, RULES), [0, 0, 2, 2]);
    }

    #[test]
    fn flat_sides_need_less_of_a_jump() {
        for (grain, regions) in [(4, [0, 0]), (0, [0, 1])] {
            let (map, frame) = stripes(&[20, 65], grain, &[None; 2]);
            assert_eq!(merge(&map, &frame, RULES), regions, "grain {grain}");
        }
    }

    #[test]
    fn one_strong_spot_does_not_keep_a_long_faint_boundary() {
        let map = stripe_map(16, &[None; 2], |x| x / 8);
        for (rows, regions) in [(4, [0, 0]), (12, [0, 1])] {
            let level = |x: u32, y: u32| 20 + 4 * ((x + y) % 2) as u8 + if x >= 8 && y < rows { 220 } else { 0 };
            let frame = Frame::from_fn(16, 16, |x, y| [level(x, y); 3]).expect("size");
            assert_eq!(merge(&map, &frame, RULES), regions, "{rows} rows");
        }
    }

    #[test]
    fn history_decides_between_the_thresholds() {
        for (labels, regions) in [([None, None], [0, 0]), ([Some(3), Some(4)], [0, 1]), ([Some(3), Some(3)], [0, 0])] {
            let (map, frame) = stripes(&[20, 75], 4, &labels);
            assert_eq!(merge(&map, &frame, RULES), regions, "{labels:?}");
        }
        let (map, frame) = stripes(&[20, 90], 4, &[Some(3), Some(3)]);
        assert_eq!(merge(&map, &frame, RULES), [0, 0]);
        let (map, frame) = stripes(&[20, 110], 4, &[Some(3), Some(3)]);
        assert_eq!(merge(&map, &frame, RULES), [0, 1]);
    }

    #[test]
    fn a_sliver_of_blended_pixels_does_not_hide_the_jump() {
        let map = stripe_map(21, &[None; 3], |x| (x.cmp(&10) as i8 + 1) as u32);
        let frame = Frame::from_fn(21, 16, |x, y| {
            [[40, 95, 150][(x.cmp(&10) as i8 + 1) as usize] + 4 * ((x + y) % 2) as u8; 3]
        })
        .expect("size");
        let groups = merge(&map, &frame, RULES);
        assert_ne!(groups[0], groups[2], "{groups:?}");
        assert!(groups[1] == groups[0] || groups[1] == groups[2], "{groups:?}");
    }

    #[test]
    fn noise_has_no_boundaries() {
        let mut map = Superpixels::new(Raster::new(64, 64));
        (0..64).for_each(|_| _ = map.add(None, [0, 0]));
        map.plane = (0..map.raster.len()).map(|p| (p % 64 / 8 + p / 64 / 8 * 8) as u32).collect();
        map.recount(&vec![[0.0; 3]; map.raster.len()]);
        let hash =
            |x: u32, y: u32| ((x + 64 * y).wrapping_mul(2_654_435_761) ^ (y * 977)).wrapping_mul(0x9E37_79B1) >> 24;
        let frame = Frame::from_fn(64, 64, |x, y| [hash(x, y) as u8; 3]).expect("size");
        let groups = merge(&map, &frame, RULES);
        assert!(groups.iter().all(|&group| group == 0), "{groups:?}");
    }
}
