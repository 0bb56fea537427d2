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
    /// That of a dead one, by its number among them.
    Dead(usize),
    /// That of the superpixel at this place, which takes the new one's.
    Living(u32),
}

/// Renames superpixels, the best offer first, while that lowers the objective. `expect` makes a prior of what is known
/// of the dead.
pub(super) fn switch(map: &mut Partition, model: &Model, ghosts: &mut Ghosts, expect: impl Fn(&Ghost) -> Prior) {
    renounce(map, model, ghosts);
    let mut offers = from_the_dead(map, model, ghosts, &expect);
    offers.extend(from_the_living(map, model));
    offers.sort_by(|a, b| a.change.total_cmp(&b.change));
    let (mut is_named, mut has_risen) = (vec![false; map.superpixels.len()], vec![false; ghosts.0.len()]);
    for Offer { place, name, .. } in offers {
        let here = place as usize;
        match name {
            Name::Dead(number) if !is_named[here] && !has_risen[number] => {
                map.superpixels[here].id = ghosts.0[number].id;
                map.set_prior(model, place, Some(expect(&ghosts.0[number])));
                (is_named[here], has_risen[number]) = (true, true);
            }
            Name::Living(other) if !is_named[here] && !is_named[other as usize] => {
                map.swap_identities(model, place, other);
                (is_named[here], is_named[other as usize]) = (true, true);
            }
            _ => {}
        }
    }
    let mut has_risen = has_risen.into_iter();
    ghosts.0.retain(|_| has_risen.next() != Some(true));
}

/// Names are taken from no farther than this, in spacings of superpixels.
const REACH: f64 = 3.0;

/// What a prior does to the energy of a superpixel of none; negative where it lowers it.
fn change(superpixel: &Superpixel, model: &Model, prior: &Prior) -> f64 {
    model.energy(&superpixel.moments, Some(prior)) - model.energy(&superpixel.moments, None)
}

fn is_near(superpixel: &Superpixel, model: &Model, prior: &Prior) -> bool {
    let (a, b) = (superpixel.moments.centroid(), prior.means.place);
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) < REACH * REACH * model.mean_area
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

fn from_the_dead(map: &Partition, model: &Model, ghosts: &Ghosts, expect: impl Fn(&Ghost) -> Prior) -> Vec<Offer> {
    let priors: Vec<Prior> = ghosts.0.iter().map(expect).collect();
    let mut offers = Vec::new();
    for (place, superpixel) in new_ones(map) {
        let near = priors.iter().enumerate().filter(|(_, prior)| is_near(superpixel, model, prior));
        let all = near.map(|(number, prior)| (number, change(superpixel, model, prior)));
        let better = all.filter(|(_, change)| *change < 0.0);
        offers.extend(better.map(|(number, change)| Offer { change, place, name: Name::Dead(number) }));
    }
    offers
}

fn from_the_living(map: &Partition, model: &Model) -> Vec<Offer> {
    let mut offers = Vec::new();
    for (place, superpixel) in new_ones(map) {
        for (other, old) in (0..).zip(&map.superpixels) {
            let Some(prior) = old.prior.as_ref().filter(|prior| is_near(superpixel, model, prior)) else { continue };
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
