//! Local moves: single border pixels change sides.
//!
//! In: a partition. Out: the same with a lower energy, every superpixel in one piece. Forbidden here: births, deaths.
//!
//! A pixel goes to the superpixel of a side neighbour if that lowers the objective and the pixel is a simple point of
//! its own: the local moves of Chang, Wei and Fisher (CVPR 2013), §4.1.

use super::model::{COLOR_STEPS, Model};
use super::partition::{NONE, Partition};
use crate::vectorize::segment::raster::{OUTSIDE, SimplePoints};

/// Moves that gain less than this are not made: rounding must not move anything.
const LEAST_GAIN: f32 = 0.01;

/// Sweeps over the pixels that may move, forwards and backwards in turn, until nothing moves or `sweeps` are done.
/// `frozen` pixels stay (empty: none).
pub(super) fn settle(map: &mut Partition, model: &Model, simple: &SimplePoints, frozen: &[bool], sweeps: usize) {
    let is_free = |p: usize| frozen.get(p) != Some(&true);
    let mut due: Vec<usize> = (0..map.raster.len()).filter(|&p| is_free(p) && is_on_border(map, p)).collect();
    let mut is_queued = vec![false; map.raster.len()];
    for sweep in 0..sweeps {
        if sweep % 2 == 1 {
            due.reverse();
        }
        let mut next = Vec::new();
        for p in due {
            is_queued[p] = false;
            let Some(to) = best_move(map, model, simple, p) else { continue };
            map.reassign(model, p, to);
            for q in map.raster.ring(p).into_iter().chain([p]).filter(|&q| q != OUTSIDE && is_free(q)) {
                if !std::mem::replace(&mut is_queued[q], true) {
                    next.push(q);
                }
            }
        }
        if next.is_empty() {
            break;
        }
        next.sort_unstable();
        due = next;
    }
}

fn is_on_border(map: &Partition, p: usize) -> bool {
    map.raster.sides(p).any(|q| map.plane[q] != map.plane[p])
}

/// The side neighbour's superpixel that pixel `p` had better join, if any.
fn best_move(map: &Partition, model: &Model, simple: &SimplePoints, p: usize) -> Option<u32> {
    let here = map.plane[p];
    let ring = map.raster.ring(p).map(|q| if q == OUTSIDE { NONE } else { map.plane[q] });
    let own = ring.iter().enumerate().fold(0, |mask, (i, &place)| mask | u8::from(place == here) << i);
    if ring.iter().step_by(2).all(|&place| place == here || place == NONE) || !simple.may_leave(own) {
        return None;
    }
    let (x, y) = map.raster.xy(p);
    let (place, color) = ([x as f32, y as f32], map.colors[p].map(|v| f32::from(v) / COLOR_STEPS));
    let carried = map.carried[p];
    // Prices of the outline and of loyalty: only those that differ between two superpixels.
    let bias = |to: u32| {
        let company = ring.iter().filter(|&&other| other == to).count() as f32;
        -(model.outline as f32 * company) - if carried == to { model.loyalty as f32 } else { 0.0 }
    };
    let own = map.get(here);
    let stay = own.gain_of_leaving(model, place, color) + bias(here);
    let (mut best, mut least) = (None, stay - LEAST_GAIN);
    for &to in ring.iter().step_by(2).filter(|&&to| to != here && to != NONE) {
        let other = map.get(to);
        let crowding = 2.0 * (other.moments.area - own.moments.area + 1) as f64 * model.area_weight / model.mean_area;
        let cost = other.cost_of_joining(model, place, color) + bias(to) + crowding as f32;
        if cost < least {
            (best, least) = (Some(to), cost);
        }
    }
    best
}
