//! The superpixels of a slab's first frame.
//!
//! In: a picture's colours and how many superpixels are wanted. Out: about that many, 4-connected. Forbidden here:
//! anything about time.
//!
//! Seeds on a grid, then local k-means in place and colour: Achanta et al., "SLIC superpixels" (PAMI 2012), §3.

use super::connect::{fill_gaps, keep_largest_pieces};
use super::lab::{Lab, distance2};
use super::raster::Raster;
use super::superpixels::{NONE, Spread, Superpixels};

/// Rounds of k-means; SLIC's authors find 10 enough from scratch, and border moves finish the work here.
const ROUNDS: usize = 5;

/// Columns and rows of a grid of about `count` cells on the picture, at most one cell a pixel.
pub(super) fn grid(raster: Raster, count: u32) -> (usize, usize) {
    let aspect = raster.width as f64 / raster.height as f64;
    let columns = (f64::from(count) * aspect).sqrt().round().clamp(1.0, raster.width as f64);
    let rows = (f64::from(count) / columns).round().clamp(1.0, raster.height as f64);
    (columns as usize, rows as usize)
}

/// Seeds about `count` superpixels.
pub(super) fn seed(raster: Raster, colors: &[Lab], count: u32, spread: Spread) -> Superpixels {
    let mut map = Superpixels::new(raster);
    let (columns, rows) = grid(raster, count);
    for _ in 0..columns * rows {
        map.add(None, [0, 0]);
    }
    for p in 0..raster.len() {
        let (x, y) = raster.xy(p);
        map.plane[p] = (y * rows / raster.height * columns + x * columns / raster.width) as u32;
    }
    map.recount(colors);
    let reach = [raster.width.div_ceil(columns), raster.height.div_ceil(rows)];
    for _ in 0..ROUNDS {
        assign(&mut map, colors, reach, spread);
    }
    keep_largest_pieces(&mut map, colors, u32::MAX);
    fill_gaps(&mut map, colors);
    map.drop_empty();
    map
}

/// Gives every pixel to the best superpixel whose mean lies within `reach` of it (the lower place of equals).
fn assign(map: &mut Superpixels, colors: &[Lab], reach: [usize; 2], spread: Spread) {
    let raster = map.raster;
    let mut best = vec![(f32::INFINITY, NONE); raster.len()];
    for (place, cell) in map.cells.iter().enumerate().filter(|(_, cell)| cell.area > 0) {
        let ([cx, cy], color) = (cell.place(), cell.color());
        let span = |centre: f32, reach: usize, side: usize| {
            (centre as usize).saturating_sub(reach)..(centre as usize + reach + 1).min(side)
        };
        for y in span(cy, reach[1], raster.height) {
            let dy = y as f32 - cy;
            for x in span(cx, reach[0], raster.width) {
                let dx = x as f32 - cx;
                let p = y * raster.width + x;
                let energy = distance2(colors[p], color) + spread.per_pixel2 * (dx * dx + dy * dy);
                if energy < best[p].0 {
                    best[p] = (energy, place as u32);
                }
            }
        }
    }
    for (entry, (_, place)) in map.plane.iter_mut().zip(best).filter(|(_, (_, place))| *place != NONE) {
        *entry = place;
    }
    map.recount(colors);
}

#[cfg(test)]
mod tests {
    use super::{Raster, Spread, grid, seed};

    #[test]
    fn grids_have_about_the_asked_number_of_cells() {
        assert_eq!(grid(Raster::new(640, 360), 3600), (80, 45));
        assert_eq!(grid(Raster::new(1, 1), 100), (1, 1));
        assert_eq!(grid(Raster::new(3, 1), 2), (2, 1));
        assert_eq!(grid(Raster::new(100, 100), 1), (1, 1));
    }

    #[test]
    fn borders_settle_on_an_edge_of_the_picture() {
        let raster = Raster::new(32, 32);
        let colors: Vec<_> = (0..raster.len()).map(|p| [if p % 32 < 13 { 20.0 } else { 80.0 }, 0.0, 0.0]).collect();
        let map = seed(raster, &colors, 16, Spread::new(8.0));
        for (left, right) in (0..32).map(|y| (map.plane[y * 32 + 12], map.plane[y * 32 + 13])) {
            assert_ne!(left, right);
        }
        assert!(map.cells.iter().all(|cell| cell.color()[0] == 20.0 || cell.color()[0] == 80.0));
    }
}
