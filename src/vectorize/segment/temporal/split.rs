//! Split moves: one superpixel becomes two.
//!
//! In: a partition. Out: more superpixels at a lower energy; births of what has appeared are among them, as the pixels
//! that a superpixel does not explain part from it. Forbidden here: single pixels between neighbours.
//!
//! A part that one of the dead explains takes its name, and is as cheap as an old superpixel.
//!
//! Halves are found by k-means for two (as in Chang, Wei and Fisher, CVPR 2013, §4.3), from the principal axis of the
//! pixels in place and colour, and made connected.

use std::collections::BTreeSet;

use super::model::{COLOR_STEPS, Model, Moments, Prior};
use super::partition::{Members, Partition};

/// Rounds of k-means: most pixels have their half after so many.
const ROUNDS: usize = 4;
/// Steps of the power iteration; the axis is only where k-means starts.
const POWER_STEPS: usize = 6;

/// A superpixel to be split.
#[derive(Debug, Clone)]
pub(super) struct Split {
    /// By how much the objective falls.
    pub(super) gain: f64,
    place: u32,
    /// The pixels that part, and whether they keep the name.
    part: Vec<u32>,
    takes_name: bool,
    /// Whose name the other side takes; none: a new one.
    dead: Option<(u32, Prior)>,
}

/// Splits worth more than nothing, the best first. Superpixels that sleep, and halves of fewer than `least_area` pixels,
/// are left alone. None of the dead is taken twice.
pub(super) fn find_splits(
    map: &Partition,
    model: &Model,
    is_awake: &[bool],
    dead: &[(u32, Prior)],
    least_area: i64,
) -> Vec<Split> {
    let members = map.members();
    let sides = vec![Side::Elsewhere; map.raster.len()];
    let mut halver = Halver { map, model, dead: Vec::new(), sides, stack: Vec::new() };
    let mut found = Vec::new();
    for (place, superpixel) in map.superpixels.iter().enumerate().filter(|&(place, _)| is_awake[place]) {
        halver.dead.clear();
        halver.dead.extend(dead.iter().filter(|(_, prior)| model.is_near(&superpixel.moments, prior)));
        // The most there is to gain, all misfit and all excess of area, against the least there is to pay.
        let price = |is_old: bool| if is_old { model.price } else { model.price * model.novelty };
        let most = superpixel.energy(model) - price(superpixel.prior.is_some());
        if superpixel.moments.area >= 2 * least_area.max(1) && most > price(!halver.dead.is_empty()) {
            found.extend(halver.split(place as u32, &members).filter(|split| {
                let part = split.part.len() as i64;
                split.gain > 0.0 && part.min(superpixel.moments.area - part) >= least_area
            }));
        }
    }
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut taken = BTreeSet::new();
    found.retain(|split| split.dead.is_none_or(|(id, _)| taken.insert(id)));
    found
}

/// Splits as found, up to `most` superpixels. Which of the dead are back.
pub(super) fn split(map: &mut Partition, model: &Model, splits: &[Split], most: usize) -> Vec<u32> {
    let room = most.saturating_sub(map.superpixels.len());
    let mut risen = Vec::new();
    for split in splits.iter().take(room) {
        let part = map.part_off(model, split.place, &split.part);
        if let Some((id, prior)) = split.dead {
            map.name(model, part, id, prior);
            risen.push(id);
        }
        if split.takes_name {
            map.swap_identities(model, split.place, part);
        }
    }
    risen
}

/// Where a pixel is while a superpixel is halved.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Elsewhere,
    First,
    Second,
    /// Seen by the search for connected pieces.
    Seen(bool),
}

struct Halver<'a> {
    map: &'a Partition,
    model: &'a Model,
    /// The dead near the superpixel that is halved.
    dead: Vec<(u32, Prior)>,
    sides: Vec<Side>,
    stack: Vec<u32>,
}

impl Halver<'_> {
    fn split(&mut self, place: u32, members: &Members) -> Option<Split> {
        let pixels = members.of(place);
        for (&p, second) in pixels.iter().zip(two_means(&self.features(pixels))) {
            self.sides[p as usize] = if second { Side::Second } else { Side::First };
        }
        let part = self.connected_part(pixels);
        let split = (!part.is_empty() && part.len() < pixels.len()).then(|| self.judge(place, part));
        pixels.iter().for_each(|&p| self.sides[p as usize] = Side::Elsewhere);
        split
    }

    /// Place and colour of pixels about their mean, scaled so that squared distances are energies.
    fn features(&self, pixels: &[u32]) -> Vec<[f32; 5]> {
        let scale = self.model.per_pixel2.sqrt() as f32;
        let feature = |&p: &u32| {
            let (x, y) = self.map.raster.xy(p as usize);
            let [l, a, b] = self.map.colors[p as usize].map(|v| f32::from(v) / COLOR_STEPS);
            [x as f32 * scale, y as f32 * scale, l, a, b]
        };
        let mut features: Vec<[f32; 5]> = pixels.iter().map(feature).collect();
        let mean = mean(&features);
        features.iter_mut().for_each(|feature| *feature = std::array::from_fn(|d| feature[d] - mean[d]));
        features
    }

    /// The largest piece of the second half, and all that is not in the largest piece of what it leaves.
    fn connected_part(&mut self, pixels: &[u32]) -> Vec<u32> {
        let Some(part) = self.pieces(pixels, Side::Second).into_iter().max_by_key(Vec::len) else {
            return Vec::new();
        };
        pixels.iter().for_each(|&p| self.sides[p as usize] = Side::First);
        part.iter().for_each(|&p| self.sides[p as usize] = Side::Second);
        let mut rest = self.pieces(pixels, Side::First);
        let largest = (0..rest.len()).max_by_key(|&i| rest[i].len()).unwrap_or(0);
        if !rest.is_empty() {
            rest.swap_remove(largest);
        }
        let part = [part, rest.concat()].concat();
        pixels.iter().for_each(|&p| self.sides[p as usize] = Side::First);
        part.iter().for_each(|&p| self.sides[p as usize] = Side::Second);
        part
    }

    /// 4-connected pieces of one side.
    fn pieces(&mut self, pixels: &[u32], side: Side) -> Vec<Vec<u32>> {
        let seen = Side::Seen(side == Side::Second);
        let mut pieces = Vec::new();
        for &seed in pixels {
            if self.sides[seed as usize] != side {
                continue;
            }
            let mut piece = Vec::new();
            self.sides[seed as usize] = seen;
            self.stack.push(seed);
            while let Some(p) = self.stack.pop() {
                piece.push(p);
                for q in self.map.raster.sides(p as usize) {
                    if self.sides[q] == side {
                        self.sides[q] = seen;
                        self.stack.push(q as u32);
                    }
                }
            }
            pieces.push(piece);
        }
        pieces
    }

    /// What a split is worth, with the name on the better side.
    fn judge(&self, place: u32, part: Vec<u32>) -> Split {
        let (map, model) = (self.map, self.model);
        let whole = map.get(place);
        let prior = whole.prior.as_ref();
        let moments = map.moments_of(&part);
        let rest = whole.moments.minus(moments);
        let (stays, goes) = (self.named_anew(&moments), self.named_anew(&rest));
        let energies = [model.energy(&rest, prior) + stays.0, model.energy(&moments, prior) + goes.0];
        let takes_name = energies[1] < energies[0];
        let dead = if takes_name { goes.1 } else { stays.1 };
        let pairs: usize = part.iter().map(|&p| self.pairs_across(p as usize)).sum();
        let gain = whole.energy(model) - energies[0].min(energies[1]) - model.outline * pairs as f64;
        Split { gain, place, part, takes_name, dead }
    }

    /// Energy of a superpixel that takes a new name or that of a dead one, whichever is better, and which.
    fn named_anew(&self, moments: &Moments) -> (f64, Option<(u32, Prior)>) {
        let offers = self.dead.iter().map(|dead| (self.model.energy(moments, Some(&dead.1)), Some(*dead)));
        let new = (self.model.energy(moments, None), None);
        offers.fold(new, |best, offer| if offer.0 < best.0 { offer } else { best })
    }

    /// How many of the eight neighbours of a pixel of the part stay behind.
    fn pairs_across(&self, p: usize) -> usize {
        self.map.raster.ring(p).into_iter().filter(|&q| self.sides.get(q) == Some(&Side::First)).count()
    }
}

fn mean(features: &[[f32; 5]]) -> [f32; 5] {
    let mut sums = [0.0; 5];
    features.iter().for_each(|feature| sums.iter_mut().zip(feature).for_each(|(sum, v)| *sum += v));
    sums.map(|sum| sum / features.len().max(1) as f32)
}

/// Which of the features, of mean zero, are in the second of two clusters.
fn two_means(features: &[[f32; 5]]) -> Vec<bool> {
    let axis = principal_axis(features);
    let mut second: Vec<bool> = features.iter().map(|feature| dot(feature, &axis) > 0.0).collect();
    for _ in 0..ROUNDS {
        let center = |wanted: bool| {
            let mut sums = ([0.0; 5], 0.0_f32);
            for (feature, _) in features.iter().zip(&second).filter(|(_, second)| **second == wanted) {
                sums = (std::array::from_fn(|d| sums.0[d] + feature[d]), sums.1 + 1.0);
            }
            sums.0.map(|sum| sum / sums.1.max(1.0))
        };
        let (a, b) = (center(false), center(true));
        // Nearer to b: beyond the plane halfway.
        let normal: [f32; 5] = std::array::from_fn(|d| b[d] - a[d]);
        let halfway = 0.5 * (dot(&b, &b) - dot(&a, &a));
        let next: Vec<bool> = features.iter().map(|feature| dot(feature, &normal) > halfway).collect();
        if std::mem::replace(&mut second, next) == second {
            break;
        }
    }
    second
}

fn dot(a: &[f32; 5], b: &[f32; 5]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Direction of the largest variance of features of mean zero, by power iteration from the axis that has most of it.
fn principal_axis(features: &[[f32; 5]]) -> [f32; 5] {
    let mut covariance = [[0.0; 5]; 5];
    for feature in features {
        for (row, v) in covariance.iter_mut().zip(feature) {
            row.iter_mut().zip(feature).for_each(|(entry, other)| *entry += v * other);
        }
    }
    let widest = (0..5).max_by(|&i, &j| covariance[i][i].total_cmp(&covariance[j][j])).unwrap_or(0);
    let mut axis: [f32; 5] = std::array::from_fn(|d| if d == widest { 1.0 } else { 0.0 });
    for _ in 0..POWER_STEPS {
        let next: [f32; 5] = std::array::from_fn(|d| dot(&covariance[d], &axis));
        let length = dot(&next, &next).sqrt();
        if length > 0.0 {
            axis = next.map(|v| v / length);
        }
    }
    axis
}
