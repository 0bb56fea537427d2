//! Smooths the boundaries between labels, in space and through time.
//!
//! In: named superpixels, the picture, the labels that motion brought. Out: the same superpixels with a few pixels
//! moved between labels. Forbidden here: merging or naming regions.
//!
//! A pixel near a boundary is a blend f of both sides' colours, measured close by. It stands on the side that it is
//! made of more, unless neighbours or the frame before say otherwise. All prices are in units of the whole jump, so
//! strong and weak boundaries are treated alike.

use super::lab::{Lab, distance2};
use super::raster::{OUTSIDE, SimplePoints};
use super::superpixels::Superpixels;
use crate::video::Label;

/// Price of one of the eight neighbours being of another label. A pixel on a straight boundary has two more of them on
/// the wrong side, and so goes there only if it is made of it by more than 60 %.
const OUTLINE: f32 = 0.1;
/// Price of another label than motion brought: with [`OUTLINE`], only a blend beyond 70 % moves a straight boundary.
const LOYALTY: f32 = 0.2;
/// Squared colour distance below which a jump is not taken for more than this: no data, no say.
const FAINT: f32 = 10.0 * 10.0;
/// The sides' colours are measured this far around a pixel.
const REACH: isize = 3;
/// Most sweeps over the picture.
const SWEEPS: usize = 4;

/// What a pass works with.
#[derive(Debug)]
pub(super) struct PolishRules<'a> {
    pub(super) colors: &'a [Lab],
    /// The label that motion brought to each pixel; none where there was none.
    pub(super) carried: &'a [Option<Label>],
    /// Pixels that stay as they are; empty: none.
    pub(super) frozen: &'a [bool],
}

/// Moves pixels on label boundaries while that lowers the energy; superpixels stay in one piece.
pub(super) fn polish(map: &mut Superpixels, rules: &PolishRules<'_>, simple: &SimplePoints) {
    let mut due: Vec<usize> = (0..map.raster.len()).filter(|&p| on_boundary(map, p)).collect();
    for sweep in 0..SWEEPS {
        let mut next = Vec::new();
        if sweep % 2 == 1 {
            due.reverse();
        }
        for &p in due.iter().filter(|&&p| rules.frozen.get(p) != Some(&true)) {
            if let Some(to) = best_move(map, rules, simple, p) {
                map.reassign(p, to, rules.colors[p]);
                next.push(p);
                next.extend(map.raster.ring(p).into_iter().filter(|&q| q != OUTSIDE));
            }
        }
        next.sort_unstable();
        next.dedup();
        due = next;
        if due.is_empty() {
            break;
        }
    }
}

fn label_at(map: &Superpixels, p: usize) -> Option<Label> {
    map.cells[map.plane[p] as usize].label
}

fn on_boundary(map: &Superpixels, p: usize) -> bool {
    let cell = map.plane[p];
    map.raster.sides(p).any(|q| map.plane[q] != cell && label_at(map, q) != label_at(map, p))
}

fn best_move(map: &Superpixels, rules: &PolishRules<'_>, simple: &SimplePoints, p: usize) -> Option<u32> {
    let (cell, label) = (map.plane[p], label_at(map, p));
    let ring = map.raster.ring(p);
    let own = ring.iter().enumerate().filter(|&(_, &q)| q != OUTSIDE && map.plane[q] == cell);
    if !on_boundary(map, p) || !simple.may_leave(own.fold(0, |mask, (i, _)| mask | 1 << i)) {
        return None;
    }
    let here = side_color(map, rules.colors, p, label);
    let mut best = (0.0, cell);
    for q in ring.into_iter().step_by(2).filter(|&q| q != OUTSIDE && label_at(map, q) != label) {
        let other = label_at(map, q);
        let there = side_color(map, rules.colors, p, other);
        // 1 for a pixel wholly of the other side, -1 for one wholly of this.
        let jump2 = distance2(here, there).max(FAINT);
        let data = ((distance2(rules.colors[p], here) - distance2(rules.colors[p], there)) / jump2).clamp(-1.0, 1.0);
        let around = |label| ring.iter().filter(|&&q| q != OUTSIDE && label_at(map, q) == label).count() as f32;
        let carried = |label| if rules.carried[p] == label { 1.0 } else { 0.0 };
        let gain = data + OUTLINE * (around(other) - around(label)) + LOYALTY * (carried(other) - carried(label));
        if gain > best.0 {
            best = (gain, map.plane[q]);
        }
    }
    (best.1 != cell).then_some(best.1)
}

/// Mean colour of `label` around `p`, of pixels inside it where there are any (those on its boundary may be blends).
fn side_color(map: &Superpixels, colors: &[Lab], p: usize, label: Option<Label>) -> Lab {
    let (x, y) = map.raster.xy(p);
    let span =
        |centre: usize, side: usize| centre.saturating_sub(REACH as usize)..(centre + REACH as usize + 1).min(side);
    let (mut inner, mut any) = (([0.0; 3], 0.0), ([0.0; 3], 0.0));
    let add = |sum: &mut (Lab, f32), color: Lab| {
        *sum = ([0, 1, 2].map(|c| sum.0[c] + color[c]), sum.1 + 1.0);
    };
    for row in span(y, map.raster.height) {
        for column in span(x, map.raster.width) {
            let q = row * map.raster.width + column;
            if q == p || label_at(map, q) != label {
                continue;
            }
            add(&mut any, colors[q]);
            if !on_boundary(map, q) {
                add(&mut inner, colors[q]);
            }
        }
    }
    let (sum, count) = if inner.1 > 0.0 { inner } else { any };
    if count > 0.0 { sum.map(|s| s / count) } else { colors[p] }
}

#[cfg(test)]
mod tests {
    use super::{PolishRules, polish};
    use crate::vectorize::segment::lab::Lab;
    use crate::vectorize::segment::raster::{Raster, SimplePoints};
    use crate::vectorize::segment::superpixels::Superpixels;
    use crate::video::Label;

    /// Two labels side by side on 20x12 pixels, the boundary of row y before column `edge(y)`.
    fn halves(colors: &[Lab], edge: impl Fn(usize) -> usize) -> Superpixels {
        let raster = Raster::new(20, 12);
        let mut map = Superpixels::new(raster);
        (0..2).for_each(|label| _ = map.add(Some(Label(label)), [0, 0]));
        map.plane = (0..raster.len()).map(|p| u32::from(p % 20 >= edge(p / 20))).collect();
        map.recount(colors);
        map
    }

    /// Dark, then bright from column 10; column 9 is bright by the given share.
    fn blend(share: f32) -> Vec<Lab> {
        let level = |x: usize| [20.0, 20.0 + 60.0 * share, 80.0][(x.cmp(&9) as i8 + 1) as usize];
        (0..240).map(|p| [level(p % 20), 0.0, 0.0]).collect()
    }

    #[test]
    fn a_blended_column_goes_to_the_nearer_color_unless_it_just_did_not() {
        let simple = SimplePoints::new();
        for (share, before, after) in [(0.3, 9, 10), (0.9, 10, 9), (0.55, 9, 9), (0.55, 10, 10)] {
            let colors = blend(share);
            let mut map = halves(&colors, |_| before);
            let carried: Vec<_> = map.plane.iter().map(|&cell| Some(Label(cell))).collect();
            polish(&mut map, &PolishRules { colors: &colors, carried: &carried, frozen: &[] }, &simple);
            assert_eq!(map.plane, halves(&colors, |_| after).plane, "share {share}, from {before}");
        }
    }

    #[test]
    fn spikes_are_smoothed_away_where_the_picture_has_none() {
        let colors = vec![[50.0, 0.0, 0.0]; 240];
        let mut map = halves(&colors, |y| if y == 5 { 14 } else { 10 });
        let carried = vec![None; 240];
        polish(&mut map, &PolishRules { colors: &colors, carried: &carried, frozen: &[] }, &SimplePoints::new());
        for (y, row) in map.plane.chunks_exact(20).enumerate() {
            let edge = row.iter().filter(|&&cell| cell == 0).count();
            assert!((10..=11).contains(&edge), "row {y}: boundary at {edge}");
        }
    }
}
