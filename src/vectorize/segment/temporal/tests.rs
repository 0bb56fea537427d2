//! Every kind of move lowers the one objective, by what it says.

use super::ghosts::{Ghost, Ghosts};
use super::local::settle;
use super::merge::{Bounds, merge};
use super::model::{COLOR_STEPS, Color, Means, Model, Prior};
use super::partition::{NONE, Partition};
use super::propagate::propagate;
use super::split::{find_splits, split};
use super::switch::switch;
use crate::vectorize::segment::connect::pieces;
use crate::vectorize::segment::raster::{Raster, SimplePoints};

const SIDE: usize = 24;
const UNBOUNDED: Bounds = Bounds { least_area: 0, most: usize::MAX };

fn model() -> Model {
    Model {
        per_pixel2: 0.5,
        mean_area: 64.0,
        area_weight: 2.0,
        outline: 12.0,
        loyalty: 20.0,
        price: 300.0,
        novelty: 3.0,
    }
}

fn prior(place: [f64; 2], level: f64) -> Prior {
    Prior { means: Means { place, color: [level, 0.0, 0.0] }, place_weight: 64.0, color_weight: 16.0 }
}

/// Squares of 8x8 pixels on a picture of two grey levels that meet askew, with some noise; the first four are old.
fn squares() -> Partition {
    let level = |p: usize| {
        let (x, y) = (p % SIDE, p / SIDE);
        let noise = ((p as u32).wrapping_mul(2_654_435_761) >> 29) as f32;
        (if 2 * x + y < 30 { 30.0 } else { 60.0 }) + noise
    };
    let colors: Vec<Color> = (0..SIDE * SIDE).map(|p| [(level(p) * COLOR_STEPS) as i16, 0, 0]).collect();
    let mut map = Partition::new(Raster { width: SIDE, height: SIDE }, colors);
    (0..9).for_each(|_| _ = map.add([0.0; 2]));
    map.plane = (0..SIDE * SIDE).map(|p| (p / SIDE / 8 * 3 + p % SIDE / 8) as u32).collect();
    map.recount(&model());
    for place in 0..4 {
        let Means { place: at, color } = map.get(place).means(&model());
        map.set_prior(&model(), place, Some(prior(at, color[0])));
    }
    map.carried.clone_from(&map.plane);
    map
}

fn assert_connected(map: &Partition) {
    let found = pieces(map.raster, |_| true, |p, q| map.plane[p] == map.plane[q]);
    assert_eq!(found.areas.len(), map.superpixels.iter().filter(|superpixel| superpixel.moments.area > 0).count());
}

#[test]
fn local_moves_lower_the_objective_and_tear_nothing() {
    let mut map = squares();
    let simple = SimplePoints::new();
    let mut before = map.objective(&model());
    for sweep in 0..6 {
        settle(&mut map, &model(), &simple, &[], 1);
        let after = map.objective(&model());
        assert!(after < before || (sweep > 2 && after <= before), "sweep {sweep}: {before}, then {after}");
        before = after;
        assert_connected(&map);
    }
    let sums = map.superpixels.clone();
    map.recount(&model());
    assert_eq!(map.superpixels, sums, "sums follow");
}

#[test]
fn a_split_gains_what_it_says() {
    let mut map = squares();
    let before = map.objective(&model());
    let splits = find_splits(&map, &Model { price: 0.0, ..model() }, &[true; 9], &[], 4);
    let best = &splits[..1];
    split(&mut map, &Model { price: 0.0, ..model() }, best, 10);
    assert_eq!(map.superpixels.len(), 10);
    assert_connected(&map);
    let priced = model().price * model().novelty;
    let after = map.objective(&model());
    assert!((before - after - (best[0].gain - priced)).abs() < 1e-6, "{before}, then {after}: {}", best[0].gain);
}

#[test]
fn merges_lower_the_objective_and_keep_to_their_bounds() {
    let mut map = squares();
    let before = map.objective(&model());
    let dear = Model { price: 2000.0, ..model() };
    let at_that_price = map.objective(&dear);
    merge(&mut map, &dear, &[true; 9], UNBOUNDED);
    let dead = map.take_empty();
    assert!(!dead.is_empty() && map.objective(&dear) < at_that_price);
    assert!(map.superpixels.iter().filter(|superpixel| superpixel.id < 4).count() > 0, "old names stay");
    assert_connected(&map);
    let mut map = squares();
    merge(&mut map, &Model { price: 0.0, ..model() }, &[false; 9], Bounds { least_area: 0, most: 5 });
    map.take_empty();
    assert_eq!(map.superpixels.len(), 5);
    assert!(before > 0.0);
}

#[test]
fn names_are_given_up_taken_from_the_dead_and_swapped() {
    let expect = |ghost: &Ghost| prior(ghost.means.place, ghost.means.color[0]);
    let mut map = squares();
    // Superpixel 0 is where 8 is expected to be, and what 3 was has vanished.
    let Means { place, color } = map.get(8).means(&model());
    map.set_prior(&model(), 0, Some(prior(place, color[0])));
    map.set_prior(&model(), 3, Some(prior([4.0, 12.0], 99.0)));
    let before = map.objective(&model());
    let mut ghosts = Ghosts::default();
    switch(&mut map, &model(), &mut ghosts, expect);
    assert!(map.objective(&model()) < before);
    assert_eq!(map.get(8).id, 0, "the name goes where its superpixel is expected");
    assert!(map.get(3).prior.is_none() && map.get(3).id >= 9, "a name that no longer fits is given up");
    // In the next frame it is back.
    let level = map.get(3).means(&model()).color[0];
    map.colors.iter_mut().for_each(|color| color[0] += ((99.0 - level) as f32 * COLOR_STEPS) as i16);
    map.recount(&model());
    switch(&mut map, &model(), &mut ghosts, expect);
    assert_eq!(map.get(3).id, 3);
}

#[test]
fn fractions_of_a_pixel_add_up() {
    let mut map = squares();
    let column = |map: &Partition| (0..SIDE).find(|&x| map.plane[12 * SIDE + x] == 4);
    let mut found = Vec::new();
    for _ in 0..6 {
        let expected: Vec<Prior> = map
            .superpixels
            .iter()
            .map(|superpixel| {
                let Means { place, color } = superpixel.means(&model());
                prior([place[0] + 0.3, place[1]], color[0])
            })
            .collect();
        let colors = map.colors.clone();
        propagate(&mut map, &model(), colors, &expected, 12);
        found.push(column(&map).expect("in the picture"));
        assert!(!map.plane.contains(&NONE));
    }
    assert!(found.windows(2).all(|pair| pair[0] <= pair[1]) && (9..=10).contains(&found[5]), "{found:?}");
}
