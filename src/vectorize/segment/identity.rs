//! Names regions so that a label follows what it named before.
//!
//! In: a region for each superpixel, and the label each superpixel had. Out: a label for each. Forbidden here: moving
//! boundaries.
//!
//! Only neighbours need different labels. Regions that do not touch may share one: what an occluder parts stays one
//! label, and when it leaves nothing has to be renamed. A renaming is a discontinuity in time, and costs vertices.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

use super::lab::{Lab, distance2};
use super::superpixels::Superpixels;
use crate::video::Label;

/// Regions whose mean colours differ by no more than this may share a label from the start (squared colour distance):
/// parts of one thing seen through gaps.
const ALIKE: f32 = 6.0 * 6.0;
/// A region takes an old label only if that covered at least one of this many of its pixels: strays do not name it.
const SHARE: u64 = 4;

struct Region {
    label: Option<Label>,
    area: u64,
    color: Lab,
    neighbors: BTreeSet<u32>,
}

/// Gives every superpixel the label of its region. Regions take the label that they share most pixels with, the largest
/// overlap first (of equals, the older label and then the first region), unless a neighbour has it. What is left, the
/// largest first, takes the label of a region of like colour, unless a neighbour has it, or else a new one, counted up
/// from `next`.
pub(super) fn name_regions(map: &mut Superpixels, groups: &[u32], next: &mut u32) {
    let mut regions = regions(map, groups);
    for ((label, group), pixels) in overlaps(map, groups) {
        if regions[&group].label.is_none() && pixels * SHARE >= regions[&group].area {
            give(&mut regions, group, label);
        }
    }
    let mut nameless: Vec<u32> = regions.keys().copied().filter(|group| regions[group].label.is_none()).collect();
    nameless.sort_by_key(|group| Reverse(regions[group].area));
    for group in nameless {
        let alike = labels_of_like_color(&regions, regions[&group].color);
        if !alike.into_iter().any(|label| give(&mut regions, group, label)) {
            give(&mut regions, group, Label(*next));
            *next += 1;
        }
    }
    for (cell, group) in map.cells.iter_mut().zip(groups) {
        cell.label = regions[group].label;
    }
}

/// Names a region, unless a neighbour has that name. Whether it did.
fn give(regions: &mut BTreeMap<u32, Region>, group: u32, label: Label) -> bool {
    let free = regions[&group].neighbors.iter().all(|neighbor| regions[neighbor].label != Some(label));
    if let Some(region) = regions.get_mut(&group).filter(|_| free) {
        region.label = Some(label);
    }
    free
}

/// Labels of regions of like colour, the nearest first.
fn labels_of_like_color(regions: &BTreeMap<u32, Region>, color: Lab) -> Vec<Label> {
    let named = regions.values().filter_map(|region| Some((distance2(region.color, color), region.label?)));
    let mut alike: Vec<(f32, Label)> = named.filter(|(distance, _)| *distance <= ALIKE).collect();
    alike.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    alike.into_iter().map(|(_, label)| label).collect()
}

/// Pixels that labels and regions share, the most first.
fn overlaps(map: &Superpixels, groups: &[u32]) -> Vec<((Label, u32), u64)> {
    let mut shared: BTreeMap<(Label, u32), u64> = BTreeMap::new();
    for (cell, &group) in map.cells.iter().zip(groups) {
        if let Some(label) = cell.label {
            *shared.entry((label, group)).or_default() += u64::from(cell.area);
        }
    }
    let mut ranked: Vec<((Label, u32), u64)> = shared.into_iter().collect();
    // Stable: of equal overlaps the older label comes first.
    ranked.sort_by_key(|&(_, pixels)| Reverse(pixels));
    ranked
}

fn regions(map: &Superpixels, groups: &[u32]) -> BTreeMap<u32, Region> {
    let mut regions: BTreeMap<u32, Region> = BTreeMap::new();
    for (cell, &group) in map.cells.iter().zip(groups) {
        let empty = Region { label: None, area: 0, color: [0.0; 3], neighbors: BTreeSet::new() };
        let region = regions.entry(group).or_insert(empty);
        region.area += u64::from(cell.area);
        let share = cell.area as f32 / region.area as f32;
        region.color = [0, 1, 2].map(|c| region.color[c] + share * (cell.color()[c] - region.color[c]));
    }
    for (a, b, _) in map.adjacent() {
        let (a, b) = (groups[a as usize], groups[b as usize]);
        if a != b {
            for (from, to) in [(a, b), (b, a)] {
                regions.entry(from).and_modify(|region| _ = region.neighbors.insert(to));
            }
        }
    }
    regions
}

#[cfg(test)]
mod tests {
    use super::name_regions;
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::Superpixels;
    use crate::video::Label;

    /// Superpixels of the given lengths, grey levels and labels, in one row.
    fn map(cells: &[(u32, f32, Option<u32>)]) -> Superpixels {
        let total = cells.iter().map(|(length, ..)| length).sum();
        let mut map = Superpixels::new(Raster::new(total, 1));
        map.plane.clear();
        let mut colors = Vec::new();
        for &(length, level, label) in cells {
            let place = map.add(label.map(Label), [0, 0]);
            map.plane.extend((0..length).map(|_| place));
            colors.extend((0..length).map(|_| [level, 0.0, 0.0]));
        }
        map.recount(&colors);
        map
    }

    fn named(cells: &[(u32, f32, Option<u32>)], groups: &[u32], mut next: u32) -> (Vec<u32>, u32) {
        let mut map = map(cells);
        name_regions(&mut map, groups, &mut next);
        (map.cells.iter().map(|cell| cell.label.map_or(u32::MAX, |label| label.0)).collect(), next)
    }

    #[test]
    fn the_larger_part_of_a_split_keeps_the_label() {
        let cells = [(3, 10.0, Some(5)), (9, 50.0, Some(5)), (4, 90.0, Some(6))];
        assert_eq!(named(&cells, &[0, 1, 2], 7), (vec![7, 5, 6], 8));
    }

    #[test]
    fn both_parts_keep_it_when_something_else_parts_them() {
        let cells = [(3, 10.0, Some(5)), (4, 90.0, Some(6)), (9, 50.0, Some(5))];
        assert_eq!(named(&cells, &[0, 1, 2], 7), (vec![5, 6, 5], 7));
    }

    #[test]
    fn a_merger_takes_the_larger_label() {
        let cells = [(3, 10.0, Some(1)), (9, 10.0, Some(2)), (4, 50.0, None), (2, 90.0, Some(1))];
        assert_eq!(named(&cells, &[0, 0, 2, 3], 3), (vec![2, 2, 3, 1], 4));
    }

    #[test]
    fn strays_do_not_name_a_region() {
        let cells = [(2, 10.0, Some(1)), (9, 10.0, None), (4, 50.0, Some(2))];
        assert_eq!(named(&cells, &[0, 0, 2], 3), (vec![3, 3, 2], 4));
    }

    #[test]
    fn new_regions_of_like_color_share_a_label_unless_they_touch() {
        assert_eq!(named(&[(3, 10.0, None), (4, 90.0, None), (5, 12.0, None)], &[0, 1, 2], 0), (vec![0, 1, 0], 2));
        assert_eq!(named(&[(3, 10.0, None), (4, 90.0, None), (5, 30.0, None)], &[0, 1, 2], 0), (vec![2, 1, 0], 3));
        assert_eq!(named(&[(3, 10.0, None), (5, 12.0, None)], &[0, 1], 0), (vec![1, 0], 2));
    }
}
