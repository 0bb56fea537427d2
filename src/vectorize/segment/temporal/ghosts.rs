//! Superpixels that have died of late, should they come back.
//!
//! In: the dead of each frame. Out: where they would be now, and what they look like. Forbidden here: the living.
//!
//! In Chang, Wei and Fisher (CVPR 2013), §4.4, only the dead of the same frame come back; ours are remembered for
//! longer, and move on with what is near and alike, as the Gaussian process of the motion would have it.

use super::model::{Means, Model, Prior};
use super::partition::{Partition, Superpixel};

/// Frames that a dead superpixel is remembered: a third of a second.
const MEMORY_FRAMES: u32 = 10;
/// A dead superpixel moves with those whose colour is within about this of its own, in units of L*a*b*.
const ALIKE: f64 = 10.0;
/// Exponent of distance, by which weights fall, from which on they are nothing.
const FARTHEST: f64 = 6.0;

/// A superpixel that has died.
#[derive(Debug, Clone)]
pub(super) struct Ghost {
    id: u32,
    pub(super) means: Means,
    /// Frames since its death.
    pub(super) age: u32,
}

/// The dead, in order of death.
#[derive(Debug, Clone, Default)]
pub(super) struct Ghosts(Vec<Ghost>);

impl Ghosts {
    /// Remembers those among the dead that were there in the frame before, as they were then.
    pub(super) fn bury<'a>(&mut self, dead: impl IntoIterator<Item = &'a Superpixel>) {
        let known = dead.into_iter().filter_map(|superpixel| Some((superpixel.id, superpixel.prior?.means)));
        self.0.extend(known.map(|(id, means)| Ghost { id, means, age: 0 }));
    }

    /// The dead by name, with what is expected of them.
    pub(super) fn known(&self, expect: impl Fn(&Ghost) -> Prior) -> Vec<(u32, Prior)> {
        self.0.iter().map(|ghost| (ghost.id, expect(ghost))).collect()
    }

    /// Lets go of those who are back.
    pub(super) fn forget(&mut self, risen: &[u32]) {
        self.0.retain(|ghost| !risen.contains(&ghost.id));
    }

    /// Moves all to the next frame and forgets the oldest.
    pub(super) fn advance(&mut self, map: &Partition, model: &Model) {
        self.0.retain(|ghost| ghost.age < MEMORY_FRAMES);
        let alive: Vec<(Means, [f64; 2])> =
            map.superpixels.iter().map(|superpixel| (superpixel.means(model), superpixel.motion)).collect();
        for ghost in &mut self.0 {
            let motion = motion_around(&ghost.means, &alive, model.mean_area);
            ghost.means.place = [0, 1].map(|i| ghost.means.place[i] + motion[i]);
            ghost.age += 1;
        }
    }
}

/// Mean motion of what is near and alike.
fn motion_around(means: &Means, alive: &[(Means, [f64; 2])], mean_area: f64) -> [f64; 2] {
    let mut sum = ([0.0; 2], 1e-12);
    for (other, motion) in alive {
        let distance2 = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
        let far = distance2(&means.place, &other.place) / (8.0 * mean_area);
        if far > FARTHEST {
            continue;
        }
        let weight = (-far - distance2(&means.color, &other.color) / (2.0 * ALIKE * ALIKE)).exp();
        sum = ([0, 1].map(|i| sum.0[i] + weight * motion[i]), sum.1 + weight);
    }
    sum.0.map(|v| v / sum.1)
}
