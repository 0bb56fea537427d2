//! Carries superpixels from one frame to the next.
//!
//! In: the superpixels of a frame, both frames' brightness and the blocks' motion between them. Out: the superpixels
//! at their new places, every pixel with one. Forbidden here: births of new content, labels.

use super::connect::{fill_gaps, keep_largest_pieces};
use super::lab::{Lab, distance2};
use super::motion::{BLOCK, MotionField, Vector};
use super::pyramid::Gray;
use super::superpixels::{Members, NONE, Superpixels};

/// A pixel counts with no more than this, in levels: what is about to be covered must not pull the rest along.
const MOST_LEVELS: u8 = 32;
/// Steps of the walk downhill from the best candidate.
const STEPS: usize = 4;
/// A pixel whose match leaves the picture counts with this difference, in levels: worse than noise, better than a
/// wrong match.
const OUTSIDE_LEVELS: u32 = 12;
/// Standing still is assumed unless moving lowers the mean difference by this much, in 1/16 level: camera noise
/// alone changes it by less.
const STILLNESS_16: u32 = 12;

/// Gives each superpixel the vector that fits its pixels best, out of those of the blocks around it, its last one and
/// none.
pub(super) fn estimate_motion(map: &mut Superpixels, from: &Gray, to: &Gray, field: &MotionField) {
    let members = map.members();
    for place in 0..map.cells.len() {
        let [x, y] = map.cells[place].place();
        let (column, row) = (x as isize / BLOCK as isize, y as isize / BLOCK as isize);
        let around = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)];
        let mut candidates: Vec<Vector> = around.iter().map(|&(dx, dy)| field.clamped(column + dx, row + dy)).collect();
        candidates.push(map.cells[place].motion);
        candidates.sort_unstable();
        candidates.dedup();
        map.cells[place].motion = best_vector(map, members.of(place as u32), from, to, &candidates);
    }
}

fn best_vector(map: &Superpixels, pixels: &[u32], from: &Gray, to: &Gray, candidates: &[Vector]) -> Vector {
    let still = difference(map, pixels, from, to, [0, 0]).saturating_sub(STILLNESS_16 * pixels.len() as u32 / 16);
    let mut best = (still, 0, [0, 0]);
    for &v in candidates.iter().filter(|&&v| v != [0, 0]) {
        best = best.min((difference(map, pixels, from, to, v), v[0].abs() + v[1].abs(), v));
    }
    for _ in 0..STEPS {
        let [x, y] = best.2;
        if [x, y] == [0, 0] {
            break;
        }
        let around = [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]];
        let next = around.map(|v| (difference(map, pixels, from, to, v), v[0].abs() + v[1].abs(), v));
        let Some(next) = next.into_iter().min().filter(|next| next.0 < best.0) else { break };
        best = next;
    }
    best.2
}

/// Sum of absolute differences of the superpixel's pixels and those it would cover.
fn difference(map: &Superpixels, pixels: &[u32], from: &Gray, to: &Gray, v: Vector) -> u32 {
    let raster = map.raster;
    let shifted = |p: usize| {
        let (x, y) = raster.xy(p);
        let (x, y) = (x as i32 + v[0], y as i32 + v[1]);
        let inside = x >= 0 && y >= 0 && (x as usize) < raster.width && (y as usize) < raster.height;
        inside.then(|| y as usize * raster.width + x as usize)
    };
    let cost = |&p: &u32| match shifted(p as usize) {
        Some(q) => u32::from(from.pixels[p as usize].abs_diff(to.pixels[q]).min(MOST_LEVELS)),
        None => OUTSIDE_LEVELS,
    };
    pixels.iter().map(cost).sum()
}

/// Moves all superpixels by their vectors. Where two meet, the one of nearer colour wins (the lower place of equals);
/// what none covers goes to neighbours. A piece of at least `new_area` pixels that was cut off becomes a superpixel.
pub(super) fn carry(map: &mut Superpixels, colors: &[Lab], new_area: u32) {
    let members = map.members();
    map.plane = paint(map, &members, colors);
    if map.plane.iter().all(|&cell| cell == NONE) {
        // Everything left the picture: a superpixel each would have nowhere to stand, so all stay where they were.
        for place in 0..map.cells.len() {
            for &p in members.of(place as u32) {
                map.plane[p as usize] = place as u32;
            }
        }
    }
    keep_largest_pieces(map, colors, new_area);
    fill_gaps(map, colors);
}

fn paint(map: &Superpixels, members: &Members, colors: &[Lab]) -> Vec<u32> {
    let raster = map.raster;
    let mut best = vec![(f32::INFINITY, NONE); raster.len()];
    for (place, cell) in map.cells.iter().enumerate() {
        let color = cell.color();
        for &p in members.of(place as u32) {
            let (x, y) = raster.xy(p as usize);
            let (x, y) = (x as i32 + cell.motion[0], y as i32 + cell.motion[1]);
            if x < 0 || y < 0 || x as usize >= raster.width || y as usize >= raster.height {
                continue;
            }
            let q = y as usize * raster.width + x as usize;
            let distance = distance2(colors[q], color);
            if distance < best[q].0 {
                best[q] = (distance, place as u32);
            }
        }
    }
    best.into_iter().map(|(_, place)| place).collect()
}

#[cfg(test)]
mod tests {
    use super::{MotionField, carry, estimate_motion};
    use crate::vectorize::segment::lab::LabTables;
    use crate::vectorize::segment::pyramid::pyramid;
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::{NONE, Superpixels};
    use crate::video::Frame;

    /// A bright 20x20 square at (x, 30) before a dark picture of 100x80, with some texture of its own.
    fn square(left: u32) -> Frame {
        Frame::from_fn(100, 80, |x, y| {
            let inside = (left..left + 20).contains(&x) && (30..50).contains(&y);
            if inside { [(180 + (x - left) * 3) as u8, (150 + y) as u8, 90] } else { [20, 30, 40] }
        })
        .expect("size")
    }

    #[test]
    fn a_superpixel_rides_on_a_fast_square() {
        let raster = Raster::new(100, 80);
        let (before, after) = (square(10), square(37));
        let tables = LabTables::new();
        let mut map = Superpixels::new(raster);
        let (ground, figure) = (map.add(None, [0, 0]), map.add(None, [0, 0]));
        let on_square = |p: usize, left: usize| (left..left + 20).contains(&(p % 100)) && (30..50).contains(&(p / 100));
        map.plane = (0..raster.len()).map(|p| if on_square(p, 10) { figure } else { ground }).collect();
        map.recount(&tables.convert(&before));
        let (from, to) = (pyramid(&before), pyramid(&after));
        estimate_motion(&mut map, &from[0], &to[0], &MotionField::estimate(&from, &to));
        assert_eq!((map.cells[0].motion, map.cells[1].motion), ([0, 0], [27, 0]));
        carry(&mut map, &tables.convert(&after), 12);
        let expected: Vec<u32> = (0..raster.len()).map(|p| if on_square(p, 37) { figure } else { ground }).collect();
        assert_eq!(map.plane, expected);
    }

    #[test]
    fn nothing_is_lost_when_all_leave_the_picture() {
        let mut map = Superpixels::new(Raster::new(4, 4));
        map.add(None, [50, 0]);
        map.plane = vec![0; 16];
        map.recount(&[[0.0; 3]; 16]);
        carry(&mut map, &[[0.0; 3]; 16], 12);
        assert!(!map.plane.contains(&NONE));
        assert_eq!(map.cells[0].area, 16);
    }
}
