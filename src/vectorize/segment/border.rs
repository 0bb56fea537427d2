//! Moves of single border pixels between superpixels.
//!
//! In: superpixels of a frame. Out: the same, with borders where the picture has its own. Forbidden here: births,
//! deaths, labels.
//!
//! A pixel goes to the superpixel of a side neighbour if that lowers the energy and leaves its own superpixel in one
//! piece: the local moves of Chang, Wei and Fisher (CVPR 2013), §4.1.

use super::lab::Lab;
use super::raster::{OUTSIDE, SimplePoints};
use super::superpixels::{Spread, Superpixels};

/// What a move must respect. Energies are squared colour distances.
#[derive(Debug)]
pub(super) struct BorderRules<'a> {
    pub(super) colors: &'a [Lab],
    pub(super) spread: Spread,
    /// Price of each of the eight neighbours that belongs to another superpixel: short borders.
    pub(super) outline: f32,
    /// The superpixel that motion brought to each pixel; empty where there is none yet.
    pub(super) carried: &'a [u32],
    /// Price of leaving the carried superpixel: still borders.
    pub(super) loyalty: f32,
    /// Pixels that stay as they are; empty: none.
    pub(super) frozen: &'a [bool],
}

/// Sweeps over the picture, forwards and backwards in turn, until nothing moves or `sweeps` are done.
pub(super) fn settle(map: &mut Superpixels, rules: &BorderRules<'_>, simple: &SimplePoints, sweeps: usize) {
    let n = map.raster.len();
    let mut due = vec![true; n];
    for sweep in 0..sweeps {
        let mut moved = false;
        for i in 0..n {
            let p = if sweep % 2 == 0 { i } else { n - 1 - i };
            if !std::mem::take(&mut due[p]) || rules.frozen.get(p) == Some(&true) {
                continue;
            }
            if let Some(to) = best_move(map, rules, simple, p) {
                map.reassign(p, to, rules.colors[p]);
                moved = true;
                for q in map.raster.ring(p).into_iter().filter(|&q| q != OUTSIDE) {
                    due[q] = true;
                }
            }
        }
        if !moved {
            break;
        }
    }
}

/// The side neighbour's superpixel that pixel `p` had better join, if any.
fn best_move(map: &Superpixels, rules: &BorderRules<'_>, simple: &SimplePoints, p: usize) -> Option<u32> {
    let here = map.plane[p];
    if map.raster.sides(p).all(|q| map.plane[q] == here) {
        return None;
    }
    let ring = map.raster.ring(p).map(|q| if q == OUTSIDE { None } else { Some(map.plane[q]) });
    let own = ring.iter().enumerate().filter(|(_, cell)| **cell == Some(here));
    if !simple.may_leave(own.fold(0, |mask, (i, _)| mask | 1 << i)) {
        return None;
    }
    let price = |cell: u32| {
        let others = ring.iter().flatten().filter(|&&other| other != cell).count() as f32;
        let leaves = rules.carried.get(p).is_some_and(|&carried| carried != cell);
        map.energy(cell, p, rules.colors[p], rules.spread)
            + rules.outline * others
            + if leaves { rules.loyalty } else { 0.0 }
    };
    let mut best = (price(here), here);
    for cell in ring.iter().step_by(2).flatten().copied().filter(|&cell| cell != here) {
        let offer = price(cell);
        if offer < best.0 {
            best = (offer, cell);
        }
    }
    (best.1 != here).then_some(best.1)
}

#[cfg(test)]
mod tests {
    use super::{BorderRules, settle};
    use crate::vectorize::segment::connect::pieces;
    use crate::vectorize::segment::lab::Lab;
    use crate::vectorize::segment::raster::{Raster, SimplePoints};
    use crate::vectorize::segment::seed::seed;
    use crate::vectorize::segment::superpixels::{Spread, Superpixels};

    /// Two superpixels on 40x30 pixels of one colour with a comb for a border.
    fn comb(colors: &[Lab]) -> Superpixels {
        let mut map = Superpixels::new(Raster::new(40, 30));
        (0..2).for_each(|_| _ = map.add(None, [0, 0]));
        map.plane = (0..1200).map(|p| u32::from(p % 40 >= 18 + p / 40 % 3 * 3)).collect();
        map.recount(colors);
        map
    }

    #[test]
    fn borders_get_shorter_and_regions_stay_in_one_piece() {
        // Faint noise: a multiplicative hash of the pixel's number.
        let noise = |p: u32| (p.wrapping_mul(2_654_435_761) >> 24) as f32 / 64.0;
        let colors: Vec<Lab> = (0..1200).map(|p| [noise(p), 0.0, 0.0]).collect();
        let mut map = comb(&colors);
        let spread = Spread::new(20.0);
        let rules = BorderRules { colors: &colors, spread, outline: 20.0, carried: &[], loyalty: 0.0, frozen: &[] };
        settle(&mut map, &rules, &SimplePoints::new(), 20);
        let [(0, 1, sides)] = map.adjacent()[..] else { panic!("two neighbours: {:?}", map.adjacent()) };
        assert!(sides < 40, "{sides} sides for 30 rows, of {:?} before", comb(&colors).adjacent());
        assert_eq!(pieces(map.raster, |_| true, |p, q| map.plane[p] == map.plane[q]).areas.len(), 2);
    }

    #[test]
    fn loyalty_holds_borders_that_little_speaks_against() {
        let colors: Vec<Lab> = (0..1200).map(|p| [if p % 40 < 20 { 50.0 } else { 53.0 }, 0.0, 0.0]).collect();
        let mut map = Superpixels::new(Raster::new(40, 30));
        (0..2).for_each(|_| _ = map.add(None, [0, 0]));
        map.plane = (0..1200).map(|p| u32::from(p % 40 >= 22)).collect();
        map.recount(&colors);
        let before = map.plane.clone();
        let spread = Spread { per_pixel2: 0.0 };
        for (loyalty, moved) in [(20.0, false), (0.0, true)] {
            let rules = BorderRules { colors: &colors, spread, outline: 0.0, carried: &before, loyalty, frozen: &[] };
            settle(&mut map, &rules, &SimplePoints::new(), 4);
            assert_eq!(map.plane != before, moved, "loyalty {loyalty}");
        }
    }

    #[test]
    fn frozen_pixels_stay() {
        let raster = Raster::new(16, 16);
        let colors: Vec<_> = (0..256).map(|p| [(p % 7 * 10) as f32, 0.0, 0.0]).collect();
        let mut map = seed(raster, &colors, 4, Spread::new(8.0));
        let before = map.plane.clone();
        let frozen = vec![true; 256];
        let spread = Spread::new(8.0);
        let rules = BorderRules { colors: &colors, spread, outline: 50.0, carried: &[], loyalty: 0.0, frozen: &frozen };
        settle(&mut map, &rules, &SimplePoints::new(), 4);
        assert_eq!(map.plane, before);
    }
}
