//! Keeps regions in one piece.
//!
//! In: a plane of superpixels that may be torn or have gaps. Out: one where each superpixel is 4-connected and every
//! pixel has one. Forbidden here: motion, labels.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::lab::{Lab, distance2};
use super::raster::Raster;
use super::superpixels::{NONE, Superpixels};

/// 4-connected pieces of a plane.
#[derive(Debug)]
pub(super) struct Pieces {
    /// For every pixel the number of its piece, in order of first pixel.
    pub(super) of_pixel: Vec<u32>,
    /// Pixels of each piece.
    pub(super) areas: Vec<u32>,
}

/// Connected pieces of the pixels that `included` takes, across the sides that `linked` lets pass; other pixels have
/// piece [`NONE`].
pub(super) fn pieces(
    raster: Raster,
    included: impl Fn(usize) -> bool,
    linked: impl Fn(usize, usize) -> bool,
) -> Pieces {
    let mut found = Pieces { of_pixel: vec![NONE; raster.len()], areas: Vec::new() };
    let mut stack = Vec::new();
    for seed in 0..raster.len() {
        if found.of_pixel[seed] != NONE || !included(seed) {
            continue;
        }
        let piece = found.areas.len() as u32;
        let mut area = 0;
        found.of_pixel[seed] = piece;
        stack.push(seed);
        while let Some(p) = stack.pop() {
            area += 1;
            for q in raster.sides(p) {
                if found.of_pixel[q] == NONE && included(q) && linked(p, q) {
                    found.of_pixel[q] = piece;
                    stack.push(q);
                }
            }
        }
        found.areas.push(area);
    }
    found
}

/// Leaves each superpixel its largest piece (the first of equals). A further piece of at least `new_area` pixels
/// becomes a superpixel with its parent's label and motion; smaller ones lose their superpixel. Sums are recounted.
pub(super) fn keep_largest_pieces(map: &mut Superpixels, colors: &[Lab], new_area: u32) {
    let torn = pieces(map.raster, |p| map.plane[p] != NONE, |p, q| map.plane[p] == map.plane[q]);
    let mut owner = vec![NONE; torn.areas.len()];
    for (p, &piece) in torn.of_pixel.iter().enumerate().filter(|&(_, &piece)| piece != NONE) {
        owner[piece as usize] = map.plane[p];
    }
    let mut largest = vec![NONE; map.cells.len()];
    for (piece, &cell) in owner.iter().enumerate() {
        let best = &mut largest[cell as usize];
        if *best == NONE || torn.areas[piece] > torn.areas[*best as usize] {
            *best = piece as u32;
        }
    }
    for (piece, (cell, &area)) in owner.iter_mut().zip(&torn.areas).enumerate() {
        if largest[*cell as usize] == piece as u32 {
            continue;
        }
        let parent = &map.cells[*cell as usize];
        let (label, motion) = (parent.label, parent.motion);
        *cell = if area >= new_area { map.add(label, motion) } else { NONE };
    }
    for (entry, &piece) in map.plane.iter_mut().zip(&torn.of_pixel).filter(|(_, piece)| **piece != NONE) {
        *entry = owner[piece as usize];
    }
    map.recount(colors);
}

/// Gives every pixel without a superpixel that of a side neighbour, the nearest in colour first (of equals, the first
/// pixel and the lower place): seeded region growing, Adams and Bischof (PAMI 1994). Needs one pixel that has one. Means
/// of colour are those before; sums follow.
pub(super) fn fill_gaps(map: &mut Superpixels, colors: &[Lab]) {
    let raster = map.raster;
    let means: Vec<Lab> = map.cells.iter().map(|cell| cell.color()).collect();
    // Squared distances are not negative: their bits are in their order.
    let offer = |p: usize, cell: u32| Reverse((distance2(colors[p], means[cell as usize]).to_bits(), p, cell));
    let mut queue = BinaryHeap::new();
    for p in (0..raster.len()).filter(|&p| map.plane[p] == NONE) {
        queue.extend(raster.sides(p).map(|q| map.plane[q]).filter(|&cell| cell != NONE).map(|cell| offer(p, cell)));
    }
    while let Some(Reverse((_, p, cell))) = queue.pop() {
        if map.plane[p] != NONE {
            continue;
        }
        map.reassign(p, cell, colors[p]);
        queue.extend(raster.sides(p).filter(|&q| map.plane[q] == NONE).map(|q| offer(q, cell)));
    }
}

#[cfg(test)]
mod tests {
    use super::{Raster, Superpixels, fill_gaps, keep_largest_pieces, pieces};
    use crate::vectorize::segment::superpixels::NONE;

    fn map(width: u32, height: u32, plane: &[u32]) -> Superpixels {
        let mut map = Superpixels::new(Raster::new(width, height));
        for _ in 0..=plane.iter().copied().filter(|&cell| cell != NONE).max().unwrap_or(0) {
            map.add(None, [0, 0]);
        }
        map.plane = plane.to_vec();
        map.recount(&vec![[0.0; 3]; plane.len()]);
        map
    }

    #[test]
    fn pieces_do_not_join_across_corners() {
        let found = pieces(Raster::new(2, 2), |p| p != 1, |_, _| true);
        assert_eq!(found.of_pixel, [0, NONE, 0, 0]);
        let found = pieces(Raster::new(2, 2), |p| p == 0 || p == 3, |_, _| true);
        assert_eq!((found.of_pixel, found.areas), (vec![0, NONE, NONE, 1], vec![1, 1]));
    }

    #[test]
    fn small_rests_are_given_away_and_large_ones_become_superpixels() {
        let plane = [0, 0, 0, 1, 0, 1, 0, 0];
        let colors = vec![[0.0; 3]; 8];
        let mut small = map(8, 1, &plane);
        keep_largest_pieces(&mut small, &colors, 9);
        assert_eq!(small.plane, [0, 0, 0, 1, NONE, NONE, NONE, NONE]);
        fill_gaps(&mut small, &colors);
        assert_eq!(small.plane, [0, 0, 0, 1, 1, 1, 1, 1]);
        let mut large = map(8, 1, &plane);
        keep_largest_pieces(&mut large, &colors, 2);
        assert_eq!(large.plane, [0, 0, 0, 1, NONE, NONE, 2, 2]);
        assert_eq!(large.cells.iter().map(|cell| cell.area).collect::<Vec<_>>(), [3, 1, 2]);
    }

    #[test]
    fn gaps_go_to_the_nearer_color() {
        for (inner, expected) in [([10.0, 45.0], [0, 0, 1, 1]), ([40.0, 45.0], [0, 1, 1, 1]), ([20.0, 5.0], [0; 4])] {
            let mut gap = map(4, 1, &[0, NONE, NONE, 1]);
            let colors = [0.0, inner[0], inner[1], 50.0].map(|level| [level, 0.0, 0.0]);
            gap.recount(&colors);
            fill_gaps(&mut gap, &colors);
            assert_eq!(gap.plane[..3], expected[..3], "{inner:?}");
        }
    }
}
