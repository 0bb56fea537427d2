//! Merge moves: two neighbours become one.
//!
//! In: a partition. Out: fewer superpixels at a lower energy, none too small, not too many. Forbidden here: single
//! pixels.

use super::model::{Model, Prior};
use super::partition::{NONE, Partition};

/// What merging must bring about, at whatever price.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Bounds {
    /// Superpixels of fewer pixels are merged.
    pub(super) least_area: i64,
    /// Beyond this number superpixels are merged.
    pub(super) most: usize,
}

impl Bounds {
    /// Whether a partition keeps to them.
    pub(super) fn hold(&self, map: &Partition) -> bool {
        let mut areas = map.superpixels.iter().map(|superpixel| superpixel.moments.area).filter(|&area| area > 0);
        areas.clone().count() <= self.most && areas.all(|area| area >= self.least_area)
    }
}

/// Two neighbours and what their becoming one does to the objective.
struct Offer {
    change: f64,
    /// The place whose identity goes on.
    stays: u32,
    goes: u32,
}

/// Merges neighbours, the best offer first, while that lowers the objective or the bounds demand it. A pair that is
/// asleep on both sides is only merged if it must be.
pub(super) fn merge(map: &mut Partition, model: &Model, is_awake: &[bool], bounds: Bounds) {
    let mut is_awake = is_awake.to_vec();
    loop {
        let offers = offers(map, model);
        let mut heirs: Vec<u32> = (0..map.superpixels.len() as u32).collect();
        let mut is_taken = vec![false; heirs.len()];
        let mut count = map.superpixels.iter().filter(|superpixel| superpixel.moments.area > 0).count();
        let before = count;
        for Offer { change, stays, goes } in offers {
            let pair = [stays as usize, goes as usize];
            let is_small = pair.iter().any(|&place| map.superpixels[place].moments.area < bounds.least_area);
            let is_wanted = change < 0.0 && pair.iter().any(|&place| is_awake[place]);
            // A superpixel merges once a round: what an offer is worth changes with its sides.
            if pair.iter().all(|&place| !is_taken[place]) && (is_wanted || is_small || count > bounds.most) {
                pair.iter().for_each(|&place| (is_taken[place], is_awake[place]) = (true, true));
                heirs[goes as usize] = stays;
                count -= 1;
            }
        }
        if count == before {
            return;
        }
        map.pass_on(model, &heirs);
        // What could merge further has its turn in the next frame.
        if bounds.hold(map) {
            return;
        }
    }
}

/// All pairs of neighbours, the best first (of equals, the lower places).
fn offers(map: &Partition, model: &Model) -> Vec<Offer> {
    let energies: Vec<f64> = map.superpixels.iter().map(|superpixel| superpixel.energy(model)).collect();
    let mut offers = Vec::new();
    for (a, contacts) in map.contacts().into_iter().enumerate() {
        for contact in contacts.into_iter().filter(|contact| contact.with > a as u32 && contact.with != NONE) {
            let b = contact.with as usize;
            let apart = energies[a] + energies[b] + model.outline * f64::from(contact.pairs);
            let (together, stays, goes) = union(map, model, a as u32, contact.with);
            offers.push(Offer { change: together - apart, stays, goes });
        }
    }
    offers.sort_unstable_by(|a, b| a.change.total_cmp(&b.change).then(a.stays.cmp(&b.stays)).then(a.goes.cmp(&b.goes)));
    offers
}

/// Energy of two as one, and which identity makes it lower: an old one before a new one, of equals the first.
fn union(map: &Partition, model: &Model, a: u32, b: u32) -> (f64, u32, u32) {
    let (one, other) = (map.get(a), map.get(b));
    let moments = one.moments.plus(other.moments);
    let energy = |prior: Option<&Prior>| model.energy(&moments, prior);
    match (&one.prior, &other.prior) {
        (None, Some(prior)) => (energy(Some(prior)), b, a),
        (Some(_), Some(second)) => {
            let (first, second) = (energy(one.prior.as_ref()), energy(Some(second)));
            if second < first { (second, b, a) } else { (first, a, b) }
        }
        (prior, None) => (energy(prior.as_ref()), a, b),
    }
}
