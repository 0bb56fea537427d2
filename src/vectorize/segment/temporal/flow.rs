//! The motion of superpixels from one frame to the next.
//!
//! In: a partition of the first frame, both frames' brightness, the blocks' motion between them (which is found from
//! coarse to fine, so that large displacements survive). Out: a displacement for each superpixel. Forbidden here:
//! moving pixels.
//!
//! Chang, Wei and Fisher (CVPR 2013), §3.2 and §4.2: motion is a Gaussian process over place and colour, whose mean is
//! the motion of the frame before, observed as each superpixel's optical flow. Here it is a Gaussian Markov random
//! field on the graph of neighbours, the sparse counterpart of such a process (Lindgren, Rue and Lindström, JRSS B
//! 2011), so that a frame takes time in proportion to its superpixels. What is observed are whole vectors first, each
//! superpixel choosing with an eye to its neighbours (iterated conditional modes), then a fraction with a certainty
//! along each axis: flat superpixels have none and go with those that are near and alike.

use super::model::Model;
use super::partition::Partition;
use crate::vectorize::segment::motion::{BLOCK, MotionField, Vector};
use crate::vectorize::segment::pyramid::Gray;

/// A pixel counts with no more than this, in levels: what is about to be covered must not pull the rest along.
const MOST_LEVELS: u8 = 32;
/// A pixel whose match leaves the picture counts with this difference, in levels: worse than noise, better than a
/// wrong match.
const OUTSIDE_LEVELS: u32 = 12;
/// Standing still is assumed unless moving lowers the mean difference by this much, in levels: camera noise alone
/// changes it by less.
const STILLNESS: f32 = 0.75;
/// Price of differing from all neighbours of like colour, in levels a pixel of difference, and up to how many pixels.
const BEND: f32 = 0.3;
const MOST_BEND: i32 = 8;
/// Neighbours whose colours differ by this many units of L*a*b* are coupled at e^-1/2 of the full strength.
const ALIKE: f64 = 10.0;
/// Rounds of choosing vectors with an eye to the neighbours.
const CHOICES: usize = 3;
/// Steps of the walk downhill from the best candidate.
const STEPS: usize = 4;
/// Strength of the coupling to neighbours, to all together, and to the motion before, as levels of certainty.
const COUPLING: f64 = 1.0;
const INERTIA: f64 = 0.05;
/// Rounds of Gauss and Seidel; certainties fade over a few neighbours, not over the picture.
const ROUNDS: usize = 12;

/// Sets the motion of every superpixel. Those in `is_still` are known to stand still.
pub(super) fn estimate_motion(
    map: &mut Partition,
    model: &Model,
    (from, to): (&Gray, &Gray),
    field: &MotionField,
    is_still: &[bool],
) {
    let members = map.members();
    let links = links(map, model);
    let mut matches: Vec<Match> = (0..map.superpixels.len() as u32)
        .map(|place| Match { map, from, to, pixels: members.of(place), known: Vec::new(), chosen: [0, 0] })
        .collect();
    for (place, matching) in matches.iter_mut().enumerate().filter(|(place, _)| !is_still[*place]) {
        matching.try_all(&candidates(map, model, field, place));
    }
    for _ in 0..CHOICES {
        for place in (0..matches.len()).filter(|&place| !is_still[place]) {
            let around: Vec<(Vector, f32)> =
                links[place].iter().map(|&(other, weight)| (matches[other as usize].chosen, weight as f32)).collect();
            matches[place].choose(&around);
        }
    }
    let observed: Vec<Observation> = matches
        .iter_mut()
        .zip(is_still)
        .map(|(matching, &still)| if still { Observation::STILL } else { matching.observe() })
        .collect();
    let motions = smooth(map, &links, &observed);
    map.superpixels.iter_mut().zip(motions).for_each(|(superpixel, motion)| superpixel.motion = motion);
}

/// For each superpixel its neighbours and how much they are alike, in all 1.
fn links(map: &Partition, model: &Model) -> Vec<Vec<(u32, f64)>> {
    let colors: Vec<[f64; 3]> = map.superpixels.iter().map(|superpixel| superpixel.means(model).color).collect();
    let contacts = map.contacts().into_iter().enumerate();
    contacts
        .map(|(place, contacts)| {
            let weight = |other: u32| {
                let far2: f64 = colors[place].iter().zip(&colors[other as usize]).map(|(a, b)| (a - b) * (a - b)).sum();
                // Unlike ones keep a little: what little they know is better than nothing.
                (-far2 / (2.0 * ALIKE * ALIKE)).exp() + 1e-3
            };
            let weights: Vec<(u32, f64)> = contacts
                .iter()
                .map(|contact| (contact.with, f64::from(contact.sides) * weight(contact.with)))
                .collect();
            let total: f64 = weights.iter().map(|(_, weight)| weight).sum();
            weights.into_iter().map(|(other, weight)| (other, weight / total)).collect()
        })
        .collect()
}

/// Vectors of the blocks around, of the frame before, and none.
fn candidates(map: &Partition, model: &Model, field: &MotionField, place: usize) -> Vec<Vector> {
    let superpixel = &map.superpixels[place];
    let [x, y] = superpixel.means(model).place;
    let (column, row) = (x as isize / BLOCK as isize, y as isize / BLOCK as isize);
    let around = [(0, 0), (-1, 0), (1, 0), (0, -1), (0, 1)];
    let mut candidates: Vec<Vector> = around.iter().map(|&(dx, dy)| field.clamped(column + dx, row + dy)).collect();
    candidates.extend([superpixel.motion.map(|v| v.round() as i32), [0, 0]]);
    candidates.sort_unstable();
    candidates.dedup();
    candidates
}

/// What is known of a superpixel's motion.
#[derive(Debug, Clone, Copy)]
struct Observation {
    motion: [f64; 2],
    /// Along each axis: by how many levels a step to either side is worse.
    certainty: [f64; 2],
}

impl Observation {
    const STILL: Self = Self { motion: [0.0; 2], certainty: [1e6; 2] };
}

/// One superpixel's search for its match.
struct Match<'a> {
    map: &'a Partition,
    from: &'a Gray,
    to: &'a Gray,
    pixels: &'a [u32],
    /// Vectors tried, with the mean difference in levels.
    known: Vec<(Vector, f32)>,
    chosen: Vector,
}

impl Match<'_> {
    fn try_all(&mut self, candidates: &[Vector]) {
        candidates.iter().for_each(|&v| _ = self.difference(v));
        self.choose(&[]);
    }

    /// Takes the best of the vectors tried and those `around`, then walks downhill.
    fn choose(&mut self, around: &[(Vector, f32)]) {
        around.iter().for_each(|&(v, _)| _ = self.difference(v));
        let tried: Vec<Vector> = self.known.iter().map(|&(v, _)| v).collect();
        let mut best = tried.into_iter().map(|v| self.rank(v, around)).min_by(better).unwrap_or((0.0, 0, [0, 0]));
        for _ in 0..STEPS {
            let [x, y] = best.2;
            let steps = [[x - 1, y], [x + 1, y], [x, y - 1], [x, y + 1]].map(|v| self.rank(v, around));
            let Some(next) = steps.into_iter().min_by(better).filter(|next| next.0 < best.0) else { break };
            best = next;
        }
        self.chosen = best.2;
    }

    /// Cost, length (the shorter of equals wins) and the vector itself.
    fn rank(&mut self, v: Vector, around: &[(Vector, f32)]) -> (f32, i32, Vector) {
        let bend = |u: Vector| ((v[0] - u[0]).abs() + (v[1] - u[1]).abs()).min(MOST_BEND) as f32;
        let bends: f32 = around.iter().map(|&(u, weight)| weight * bend(u)).sum();
        let restless = if v == [0, 0] { 0.0 } else { STILLNESS };
        (self.difference(v) + restless + BEND * bends, v[0].abs() + v[1].abs(), v)
    }

    /// Mean absolute difference of the pixels and those they would cover.
    fn difference(&mut self, v: Vector) -> f32 {
        if let Some(&(_, known)) = self.known.iter().find(|(u, _)| *u == v) {
            return known;
        }
        let raster = self.map.raster;
        let cost = |&p: &u32| {
            let (x, y) = raster.xy(p as usize);
            match raster.index(x as i64 + i64::from(v[0]), y as i64 + i64::from(v[1])) {
                Some(q) => u32::from(self.from.pixels[p as usize].abs_diff(self.to.pixels[q]).min(MOST_LEVELS)),
                None => OUTSIDE_LEVELS,
            }
        };
        let mean = self.pixels.iter().map(cost).sum::<u32>() as f32 / self.pixels.len().max(1) as f32;
        self.known.push((v, mean));
        mean
    }

    /// The chosen vector with its fraction, from parabolas through the neighbours.
    fn observe(&mut self) -> Observation {
        let [x, y] = self.chosen;
        let here = self.difference([x, y]);
        let axes = [[[x - 1, y], [x + 1, y]], [[x, y - 1], [x, y + 1]]];
        let fits = axes.map(|sides| {
            let [before, after] = sides.map(|v| self.difference(v));
            let bend = before + after - 2.0 * here;
            let offset = if bend > 0.0 { (0.5 * (before - after) / bend).clamp(-0.5, 0.5) } else { 0.0 };
            (f64::from(offset), f64::from(bend.max(0.0)))
        });
        Observation {
            motion: [f64::from(x) + fits[0].0, f64::from(y) + fits[1].0],
            certainty: fits.map(|(_, bend)| bend),
        }
    }
}

fn better(a: &(f32, i32, Vector), b: &(f32, i32, Vector)) -> std::cmp::Ordering {
    a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2))
}

/// The most likely motions, see the head of this file.
fn smooth(map: &Partition, links: &[Vec<(u32, f64)>], observed: &[Observation]) -> Vec<[f64; 2]> {
    let mut motions: Vec<[f64; 2]> = observed.iter().map(|observation| observation.motion).collect();
    for _ in 0..ROUNDS {
        for (place, Observation { motion, certainty }) in observed.iter().enumerate() {
            let before = &map.superpixels[place];
            // A new one has no motion of its own to go on with.
            let inertia = if before.prior.is_some() { INERTIA } else { 0.0 };
            motions[place] = [0, 1].map(|axis| {
                let mut sum = certainty[axis] * motion[axis] + inertia * before.motion[axis];
                let mut total = certainty[axis] + inertia;
                for &(other, weight) in &links[place] {
                    sum += COUPLING * weight * motions[other as usize][axis];
                    total += COUPLING * weight;
                }
                if total > 0.0 { sum / total } else { motion[axis] }
            });
        }
    }
    motions
}
