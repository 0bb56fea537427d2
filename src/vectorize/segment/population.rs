//! Births, splits and deaths of superpixels.
//!
//! In: superpixels and the picture they should explain. Out: new ones where content is not explained or too much for
//! one, none that are too small or too many. Forbidden here: moving borders.

use super::connect::{Pieces, fill_gaps, keep_largest_pieces, pieces};
use super::lab::{Lab, distance2};
use super::superpixels::{NONE, Superpixels};

/// How many and how large superpixels may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Population {
    /// Fewer pixels than this make no superpixel.
    pub(super) min_area: u32,
    /// Superpixels of more pixels are split.
    pub(super) max_area: u32,
    /// Beyond this number the least distinct ones die.
    pub(super) max_count: usize,
    /// Beyond this number none is born: room for new content until others die.
    pub(super) birth_limit: usize,
}

/// A pixel this far from its superpixel's colour is not explained (squared colour distance): well beyond the spread
/// inside a superpixel of natural texture (about 5 to 10).
const UNEXPLAINED: f32 = 18.0 * 18.0;
/// Pixels of one flat piece are this near to each other; a blend of two colours along an edge is not.
const FLAT: f32 = 9.0 * 9.0;

/// Makes superpixels of connected flat pieces that theirs do not explain. Pixels in `still` were judged before and are
/// not by themselves a reason.
pub(super) fn give_birth(map: &mut Superpixels, colors: &[Lab], still: &[bool], population: Population) {
    let means: Vec<Lab> = map.cells.iter().map(|cell| cell.color()).collect();
    let unexplained: Vec<bool> =
        colors.iter().zip(&map.plane).map(|(&c, &cell)| distance2(c, means[cell as usize]) > UNEXPLAINED).collect();
    let flat = in_flat_squares(map, colors, &unexplained);
    let found = pieces(map.raster, |p| flat[p], |p, q| distance2(colors[p], colors[q]) <= FLAT);
    let mut awake = vec![still.is_empty(); found.areas.len()];
    for (&piece, _) in found.of_pixel.iter().zip(still).filter(|(piece, still)| **piece != NONE && !**still) {
        awake[piece as usize] = true;
    }
    let born = |piece: usize| awake[piece] && found.areas[piece] >= population.min_area;
    if adopt(map, &found, born, population.birth_limit) {
        keep_largest_pieces(map, colors, population.min_area);
        fill_gaps(map, colors);
        map.drop_empty();
    }
}

/// Turns pieces into superpixels, in their order, up to `limit`. Whether there was one.
fn adopt(map: &mut Superpixels, found: &Pieces, born: impl Fn(usize) -> bool, limit: usize) -> bool {
    let mut places = vec![NONE; found.areas.len()];
    let mut any = false;
    for p in 0..map.plane.len() {
        let piece = found.of_pixel[p] as usize;
        if found.of_pixel[p] == NONE || !born(piece) {
            continue;
        }
        if places[piece] == NONE && map.cells.len() < limit {
            let motion = map.cells[map.plane[p] as usize].motion;
            places[piece] = map.add(None, motion);
        }
        if places[piece] != NONE {
            map.plane[p] = places[piece];
            any = true;
        }
    }
    any
}

/// Candidates that lie in a 2x2 square of candidates of nearly one colour.
fn in_flat_squares(map: &Superpixels, colors: &[Lab], candidates: &[bool]) -> Vec<bool> {
    let (w, h) = (map.raster.width, map.raster.height);
    let mut flat = vec![false; candidates.len()];
    for y in 1..h {
        for x in 1..w {
            let p = y * w + x;
            let square = [p - w - 1, p - w, p - 1, p];
            let near = |q: &usize| distance2(colors[*q], colors[p]) <= FLAT;
            if square.iter().all(|&q| candidates[q]) && square[..3].iter().all(near) {
                square.iter().for_each(|&q| flat[q] = true);
            }
        }
    }
    flat
}

/// Splits superpixels that have grown too large, across their longer axis.
pub(super) fn split_large(map: &mut Superpixels, colors: &[Lab], population: Population) {
    let members = map.members();
    let before = map.cells.len();
    for place in 0..before {
        if map.cells[place].area <= population.max_area || map.cells.len() >= population.birth_limit {
            continue;
        }
        let ([cx, cy], pixels) = (map.cells[place].place(), members.of(place as u32));
        let offset = |p: u32| {
            let (x, y) = map.raster.xy(p as usize);
            (x as f32 - cx, y as f32 - cy)
        };
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for (dx, dy) in pixels.iter().map(|&p| offset(p)) {
            (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
        }
        // Axis of the larger eigenvalue of the second moments.
        let (sin, cos) = (0.5 * (2.0 * xy).atan2(xx - yy)).sin_cos();
        let beyond: Vec<u32> =
            pixels.iter().copied().filter(|&p| offset(p).0 * cos + offset(p).1 * sin > 0.0).collect();
        let (label, motion) = (map.cells[place].label, map.cells[place].motion);
        let half = map.add(label, motion);
        beyond.iter().for_each(|&p| map.plane[p as usize] = half);
    }
    if map.cells.len() > before {
        keep_largest_pieces(map, colors, population.min_area);
        fill_gaps(map, colors);
        map.drop_empty();
    }
}

/// Merges superpixels that are too small, then the least distinct ones of too many, into the side neighbour of nearest
/// colour, one of the same label if there is any. Only those with such a neighbour die for number.
pub(super) fn thin_out(map: &mut Superpixels, colors: &[Lab], population: Population) {
    let excess = |map: &Superpixels| {
        map.cells.len() > population.max_count || map.cells.iter().any(|cell| cell.area < population.min_area)
    };
    while excess(map) {
        let before = map.cells.len();
        thin_out_once(map, population);
        map.recount(colors);
        map.drop_empty();
        if map.cells.len() == before {
            break;
        }
    }
}

/// Neighbours that chose each other, or in a circle, become one: a round at most halves their number.
fn thin_out_once(map: &mut Superpixels, population: Population) {
    let nearest = nearest_neighbors(map);
    let mut order: Vec<(f32, u32, u32)> = (0..map.cells.len())
        .filter_map(|place| {
            let (cell, (foreign, distance, target)) = (&map.cells[place], nearest[place]?);
            let dies = cell.area < population.min_area;
            (dies || !foreign).then_some((if dies { -1.0 } else { distance * cell.area as f32 }, place as u32, target))
        })
        .collect();
    order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut parents: Vec<u32> = (0..map.cells.len() as u32).collect();
    let mut count = map.cells.len();
    for (cost, place, target) in order {
        if cost >= 0.0 && count <= population.max_count {
            break;
        }
        let to = root(&parents, target);
        if to != place {
            parents[place as usize] = to;
            count -= 1;
        }
    }
    for entry in &mut map.plane {
        *entry = root(&parents, *entry);
    }
}

fn root(parents: &[u32], mut place: u32) -> u32 {
    while parents[place as usize] != place {
        place = parents[place as usize];
    }
    place
}

/// For each superpixel the best neighbour to merge with: (of another label, squared colour distance, place).
fn nearest_neighbors(map: &Superpixels) -> Vec<Option<(bool, f32, u32)>> {
    let mut nearest: Vec<Option<(bool, f32, u32)>> = vec![None; map.cells.len()];
    for (a, b, _) in map.adjacent() {
        let (one, other) = (&map.cells[a as usize], &map.cells[b as usize]);
        let distance = distance2(one.color(), other.color());
        for (from, to) in [(a, b), (b, a)] {
            let offer = (one.label != other.label, distance, to);
            let best = &mut nearest[from as usize];
            let better = |(foreign, distance, _): (bool, f32, u32)| (offer.0, offer.1) < (foreign, distance);
            if best.is_none_or(better) {
                *best = Some(offer);
            }
        }
    }
    nearest
}

#[cfg(test)]
mod tests {
    use super::{Population, give_birth, split_large, thin_out};
    use crate::vectorize::segment::connect::pieces;
    use crate::vectorize::segment::lab::Lab;
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::Superpixels;

    const POPULATION: Population = Population { min_area: 12, max_area: 1000, max_count: 100, birth_limit: 100 };

    fn ground(raster: Raster, colors: &[Lab]) -> Superpixels {
        let mut map = Superpixels::new(raster);
        map.add(None, [0, 0]);
        map.plane.fill(0);
        map.recount(colors);
        map
    }

    fn disc(raster: Raster, radius: f32) -> Vec<Lab> {
        let inside = |p: usize| {
            let (x, y) = raster.xy(p);
            (x as f32 - 14.0).hypot(y as f32 - 12.0) < radius
        };
        (0..raster.len()).map(|p| if inside(p) { [90.0, 0.0, 0.0] } else { [20.0, 0.0, 0.0] }).collect()
    }

    #[test]
    fn a_disc_is_born_unless_it_is_tiny_or_known() {
        let raster = Raster::new(40, 30);
        for (radius, still, count) in [(5.0, false, 2), (1.5, false, 1), (5.0, true, 1)] {
            let colors = disc(raster, radius);
            let mut map = ground(raster, &colors);
            give_birth(&mut map, &colors, &vec![still; raster.len()], POPULATION);
            assert_eq!(map.cells.len(), count, "radius {radius}, still {still}");
        }
        let colors = disc(raster, 5.0);
        let mut map = ground(raster, &colors);
        give_birth(&mut map, &colors, &[], POPULATION);
        assert!((0..raster.len()).all(|p| (colors[p][0] > 50.0) == (map.plane[p] == 1)));
    }

    #[test]
    fn long_superpixels_are_split_across() {
        let raster = Raster::new(60, 20);
        let colors = vec![[50.0, 0.0, 0.0]; raster.len()];
        let mut map = ground(raster, &colors);
        split_large(&mut map, &colors, POPULATION);
        assert_eq!(map.cells.iter().map(|cell| cell.area).collect::<Vec<_>>(), [600, 600]);
        assert_eq!(map.adjacent(), [(0, 1, 20)]);
    }

    #[test]
    fn small_ones_die_into_the_nearest_color_and_surplus_goes() {
        let raster = Raster::new(30, 2);
        let levels = [10.0, 50.0, 55.0];
        let colors: Vec<Lab> = (0..60).map(|p| [levels[p % 30 / 10], 0.0, 0.0]).collect();
        let stripes = |widths: [usize; 3]| {
            let mut map = Superpixels::new(raster);
            (0..3).for_each(|_| _ = map.add(None, [0, 0]));
            let column = |x: usize| if x < widths[0] { 0 } else { 1 + u32::from(x >= widths[0] + widths[1]) };
            map.plane = (0..60).map(|p| column(p % 30)).collect();
            map.recount(&colors);
            map
        };
        let mut map = stripes([10, 5, 15]);
        thin_out(&mut map, &colors, POPULATION);
        assert_eq!(map.cells.iter().map(|cell| (cell.id, cell.area)).collect::<Vec<_>>(), [(0, 20), (2, 40)]);
        let mut map = stripes([10, 10, 10]);
        thin_out(&mut map, &colors, Population { max_count: 2, ..POPULATION });
        assert_eq!(map.cells.len(), 2);
        assert_eq!(pieces(raster, |_| true, |p, q| map.plane[p] == map.plane[q]).areas, [20, 40]);
    }
}
