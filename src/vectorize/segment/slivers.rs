//! Takes superpixels made of blended edge pixels apart.
//!
//! In: superpixels. Out: the same without thin ones whose colour lies between two neighbours'; each of their pixels
//! goes to the nearer colour. Forbidden here: labels.
//!
//! Along an edge between two areas, anti-aliasing, scaling and defocus leave a band of blends. Left to itself it would
//! become a label of its own with two boundaries where the picture has one.

use super::connect::fill_gaps;
use super::lab::{Lab, distance2};
use super::raster::Raster;
use super::superpixels::{NONE, Superpixels};

/// How far from a true blend a mean colour may be (squared colour distance): Lab is not linear in light, so blends of
/// distant colours stray by up to about this much.
const BLEND: f32 = 12.0 * 12.0;

/// Slivers are no more than this wide, in pixels: a blend of anti-aliasing takes up to two, one of defocus more.
const SLIVER_PX: usize = 4;

/// Takes the slivers apart.
pub(super) fn dissolve_slivers(map: &mut Superpixels, colors: &[Lab]) {
    let thick = thick_cells(map);
    let neighbors = map.neighbors();
    let is_sliver: Vec<bool> =
        (0..map.cells.len()).map(|place| !thick[place] && is_blend(map, place, &neighbors[place], &thick)).collect();
    if !is_sliver.contains(&true) {
        return;
    }
    for (p, &color) in colors.iter().enumerate() {
        if is_sliver[map.plane[p] as usize] {
            map.reassign(p, NONE, color);
        }
    }
    fill_gaps(map, colors);
    map.drop_empty();
}

/// Whether the mean colour is a blend of those of two thick neighbours, or nearly that of one.
fn is_blend(map: &Superpixels, place: usize, neighbors: &[(u32, u32)], thick: &[bool]) -> bool {
    let color = map.cells[place].color();
    let sides: Vec<Lab> =
        neighbors.iter().filter(|(n, _)| thick[*n as usize]).map(|(n, _)| map.cells[*n as usize].color()).collect();
    let pairs = (0..sides.len()).flat_map(|i| (i..sides.len()).map(move |j| (i, j)));
    pairs.map(|(i, j)| distance2_to_segment(color, sides[i], sides[j])).any(|distance| distance <= BLEND)
}

fn distance2_to_segment(color: Lab, a: Lab, b: Lab) -> f32 {
    let length2 = distance2(a, b);
    let along: f32 = (0..3).map(|c| (color[c] - a[c]) * (b[c] - a[c])).sum();
    let share = if length2 > 0.0 { (along / length2).clamp(0.0, 1.0) } else { 0.0 };
    distance2(color, [0, 1, 2].map(|c| a[c] + share * (b[c] - a[c])))
}

/// Superpixels that somewhere hold a square of 5x5 pixels (or reach across the picture where it is narrower).
fn thick_cells(map: &Superpixels) -> Vec<bool> {
    let Raster { width, height } = map.raster;
    // The side of the largest square inside the superpixel whose lower right corner is the pixel, up to `enough`.
    let mut squares = vec![0u8; map.raster.len()];
    let mut thick = vec![false; map.cells.len()];
    let enough = (SLIVER_PX + 1).min(width).min(height) as u8;
    for y in 0..height {
        for x in 0..width {
            let p = y * width + x;
            let cell = map.plane[p];
            let side = |q: usize| if map.plane[q] == cell { squares[q] } else { 0 };
            squares[p] = if x > 0 && y > 0 {
                (1 + side(p - 1).min(side(p - width)).min(side(p - width - 1))).min(enough)
            } else {
                1
            };
            thick[cell as usize] |= squares[p] >= enough;
        }
    }
    thick
}

#[cfg(test)]
mod tests {
    use super::{Lab, Raster, Superpixels, dissolve_slivers};

    /// Columns of the given widths and grey levels on 12 rows, a superpixel each; the superpixel of each column after.
    fn dissolved(columns: &[(usize, f32)]) -> Vec<u32> {
        let of_column: Vec<usize> = columns.iter().enumerate().flat_map(|(i, &(width, _))| vec![i; width]).collect();
        let width = of_column.len();
        let mut map = Superpixels::new(Raster::new(width as u32, 12));
        columns.iter().for_each(|_| _ = map.add(None, [0, 0]));
        map.plane = (0..12 * width).map(|p| of_column[p % width] as u32).collect();
        let colors: Vec<Lab> = (0..12 * width).map(|p| [columns[of_column[p % width]].1, 0.0, 0.0]).collect();
        map.recount(&colors);
        dissolve_slivers(&mut map, &colors);
        assert!(map.plane.chunks_exact(width).all(|row| *row == map.plane[..width]));
        map.plane[..width].iter().map(|&cell| map.cells[cell as usize].id).collect()
    }

    #[test]
    fn a_blend_goes_to_the_nearer_side() {
        assert_eq!(dissolved(&[(6, 20.0), (2, 40.0), (6, 80.0)]), [[0; 8].as_slice(), &[2; 6]].concat());
        assert_eq!(dissolved(&[(6, 20.0), (2, 60.0), (6, 80.0)]), [[0; 6].as_slice(), &[2; 8]].concat());
    }

    #[test]
    fn strokes_and_broad_bands_stay() {
        let kept = |columns: &[(usize, f32)]| {
            columns.iter().enumerate().flat_map(|(i, &(width, _))| vec![i as u32; width]).collect::<Vec<_>>()
        };
        for columns in [[(6, 60.0), (2, 10.0), (6, 80.0)], [(6, 20.0), (5, 50.0), (6, 80.0)]] {
            assert_eq!(dissolved(&columns), kept(&columns));
        }
    }

    #[test]
    fn a_picture_of_slivers_only_is_left_alone() {
        assert_eq!(dissolved(&[(2, 20.0), (2, 40.0), (2, 80.0)]), [0, 0, 1, 1, 2, 2]);
    }
}
