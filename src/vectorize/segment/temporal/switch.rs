//! Switch moves: superpixels change names so that labels last.
//!
//! In: a partition, the dead. Out: the same regions, with the names that explain them best. Forbidden here: moving
//! pixels.
//!
//! Chang, Wei and Fisher (CVPR 2013), §4.4: a new superpixel takes the name of an old one, dead or alive, where the
//! objective falls by it. And an old one becomes a new one where what it was says nothing of what it is.

use super::ghosts::{Ghost, Ghosts};
use super::model::{Model, Prior};
use super::partition::{Partition, Superpixel};

/// A renaming and what it does to the objective.
struct Offer {
    change: f64,
    /// A new superpixel.
    place: u32,
    name: Name,
}

enum Name {
    /// That of a dead one.
    Dead(u32, Prior),
    /// That of the superpixel at this place, which takes the new one's.
    Living(u32),
}

/// Renames superpixels, the best offer first, while that lowers the objective. `expect` makes a prior of what is known
/// of the dead.
pub(super) fn switch(map: &mut Partition, model: &Model, ghosts: &mut Ghosts, expect: impl Fn(&Ghost) -> Prior) {
    renounce(map, model, ghosts);
    let mut offers = from_the_dead(map, model, &ghosts.known(expect));
    offers.extend(from_the_living(map, model));
    offers.sort_by(|a, b| a.change.total_cmp(&b.change));
    let (mut is_named, mut risen) = (vec![false; map.superpixels.len()], Vec::new());
    for Offer { place, name, .. } in offers {
        let here = place as usize;
        match name {
            Name::Dead(id, prior) if !is_named[here] && !risen.contains(&id) => {
                map.name(model, place, id, prior);
                is_named[here] = true;
                risen.push(id);
            }
            Name::Living(other) if !is_named[here] && !is_named[other as usize] => {
                map.swap_identities(model, place, other);
                (is_named[here], is_named[other as usize]) = (true, true);
            }
            _ => {}
        }
    }
    ghosts.forget(&risen);
}

/// What a prior does to the energy of a superpixel of none; negative where it lowers it.
fn change(superpixel: &Superpixel, model: &Model, prior: &Prior) -> f64 {
    model.energy(&superpixel.moments, Some(prior)) - model.energy(&superpixel.moments, None)
}

/// Old superpixels that are better off as new ones give their names up, and these are among the dead.
fn renounce(map: &mut Partition, model: &Model, ghosts: &mut Ghosts) {
    for place in 0..map.superpixels.len() as u32 {
        let superpixel = map.get(place);
        if superpixel.prior.as_ref().is_some_and(|prior| change(superpixel, model, prior) > 0.0) {
            ghosts.bury([superpixel]);
            map.rename(model, place);
        }
    }
}

fn from_the_dead(map: &Partition, model: &Model, dead: &[(u32, Prior)]) -> Vec<Offer> {
    let mut offers = Vec::new();
    for (place, superpixel) in new_ones(map) {
        let near = dead.iter().filter(|(_, prior)| model.is_near(&superpixel.moments, prior));
        let all = near.map(|&(id, prior)| (change(superpixel, model, &prior), Name::Dead(id, prior)));
        offers.extend(all.filter(|(change, _)| *change < 0.0).map(|(change, name)| Offer { change, place, name }));
    }
    offers
}

fn from_the_living(map: &Partition, model: &Model) -> Vec<Offer> {
    let mut offers = Vec::new();
    for (place, superpixel) in new_ones(map) {
        for (other, old) in (0..).zip(&map.superpixels) {
            let Some(prior) = old.prior.as_ref().filter(|prior| model.is_near(&superpixel.moments, prior)) else {
                continue;
            };
            let gain = change(superpixel, model, prior);
            if gain < 0.0 {
                let change = gain - change(old, model, prior);
                if change < 0.0 {
                    offers.push(Offer { change, place, name: Name::Living(other) });
                }
            }
        }
    }
    offers
}

fn new_ones(map: &Partition) -> impl Iterator<Item = (u32, &Superpixel)> {
    (0..).zip(&map.superpixels).filter(|(_, superpixel)| superpixel.prior.is_none())
}
