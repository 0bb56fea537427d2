//! Carries superpixels from one frame to the next.
//!
//! In: superpixels of a frame and their motion. Out: a partition of the next frame to start from, every superpixel in
//! one piece. Forbidden here: the objective.
//!
//! Chang, Wei and Fisher (CVPR 2013), §4: labels of a new frame start from those of the last one, moved by each
//! superpixel's mean flow. Where two meet, the one wins whose pixels look more like what is there now.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::model::{COLOR_STEPS, Color, Model, Prior};
use super::partition::{Members, NONE, Partition};
use crate::vectorize::segment::connect::pieces;

/// Moves all superpixels, `expected` telling where each will be, into the picture of the next frame. What is cut off and
/// has at least `new_area` pixels becomes a new superpixel.
pub(super) fn propagate(map: &mut Partition, model: &Model, next: Vec<Color>, expected: &[Prior], new_area: u32) {
    let members = map.members();
    let mut plane = paint(map, &members, &next, expected);
    if plane.iter().all(|&place| place == NONE) {
        // Everything left the picture, and would have nowhere to stand: all stay where they were.
        plane.clone_from(&map.plane);
    }
    map.plane = plane;
    map.colors = next;
    for (superpixel, prior) in map.superpixels.iter_mut().zip(expected) {
        superpixel.prior = Some(*prior);
    }
    keep_largest_pieces(map, new_area);
    map.carried.clone_from(&map.plane);
    fill_gaps(map, model);
    map.recount(model);
}

/// Every pixel's superpixel after the motion; what none covers has none. A superpixel is shifted by whole pixels to
/// where it is expected, so that fractions of a pixel add up over frames.
fn paint(map: &Partition, members: &Members, next: &[Color], expected: &[Prior]) -> Vec<u32> {
    let mut best = vec![(i32::MAX, NONE); map.raster.len()];
    for (place, (superpixel, prior)) in (0..).zip(map.superpixels.iter().zip(expected)) {
        let centroid = superpixel.moments.centroid();
        let shift = [0, 1].map(|i| (prior.means.place[i] - centroid[i]).round() as i64);
        for &p in members.of(place) {
            let (x, y) = map.raster.xy(p as usize);
            let Some(q) = map.raster.index(x as i64 + shift[0], y as i64 + shift[1]) else { continue };
            let difference = distance2(map.colors[p as usize], next[q]);
            if difference < best[q].0 {
                best[q] = (difference, place);
            }
        }
    }
    best.into_iter().map(|(_, place)| place).collect()
}

fn distance2(a: Color, b: Color) -> i32 {
    a.iter().zip(b).map(|(a, b)| (i32::from(*a) - i32::from(b)).pow(2)).sum()
}

/// Leaves each superpixel its largest piece (the first of equals); of the others, large ones become superpixels and
/// small ones lose theirs.
fn keep_largest_pieces(map: &mut Partition, new_area: u32) {
    let torn = pieces(map.raster, |p| map.plane[p] != NONE, |p, q| map.plane[p] == map.plane[q]);
    let mut owners = vec![NONE; torn.areas.len()];
    for (&piece, &place) in torn.of_pixel.iter().zip(&map.plane).filter(|(piece, _)| **piece != NONE) {
        owners[piece as usize] = place;
    }
    let mut largest = vec![NONE; map.superpixels.len()];
    for (piece, &place) in owners.iter().enumerate() {
        let best = &mut largest[place as usize];
        if *best == NONE || torn.areas[piece] > torn.areas[*best as usize] {
            *best = piece as u32;
        }
    }
    for (piece, (place, &area)) in owners.iter_mut().zip(&torn.areas).enumerate() {
        if largest[*place as usize] != piece as u32 {
            let motion = map.get(*place).motion;
            *place = if area >= new_area { map.add(motion) } else { NONE };
        }
    }
    for (entry, &piece) in map.plane.iter_mut().zip(&torn.of_pixel).filter(|(_, piece)| **piece != NONE) {
        *entry = owners[piece as usize];
    }
}

/// Gives every pixel without a superpixel that of a side neighbour, the nearest in colour first (of equals, the first
/// pixel and the lower place): seeded region growing, Adams and Bischof (PAMI 1994).
fn fill_gaps(map: &mut Partition, model: &Model) {
    map.recount(model);
    let colors: Vec<Color> = map
        .superpixels
        .iter()
        .map(|superpixel| superpixel.means(model).color.map(|v| (v * f64::from(COLOR_STEPS)).round() as i16))
        .collect();
    let Partition { raster, plane, colors: pixels, .. } = map;
    let offer = |p: usize, place: u32| Reverse((distance2(pixels[p], colors[place as usize]), p, place));
    let mut queue = BinaryHeap::new();
    for p in (0..raster.len()).filter(|&p| plane[p] == NONE) {
        queue.extend(raster.sides(p).map(|q| plane[q]).filter(|&place| place != NONE).map(|place| offer(p, place)));
    }
    while let Some(Reverse((_, p, place))) = queue.pop() {
        if plane[p] == NONE {
            plane[p] = place;
            queue.extend(raster.sides(p).filter(|&q| plane[q] == NONE).map(|q| offer(q, place)));
        }
    }
}
