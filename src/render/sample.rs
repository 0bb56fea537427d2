//! Which fine tet a source pixel's centre lies in, and where: the rows of a fit's matrix.

use std::ops::Range;

use glam::IVec3;

use super::grid::{GridPoint, is_positive};
use super::scan::{Outline, scan};
use super::slice::{SLICES, above, cross};
use super::subdivide::Refined;
use super::view::{View, Viewport, plane};
use crate::mesh::Domain;

/// Pixel centres of some rows of a source frame in a refined mesh, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct PixelSamples {
    /// The fine tet that is shown at the pixel, or [`PixelSamples::UNCOVERED`].
    pub tet: Vec<u32>,
    /// Barycentric weights of the tet's corners at the centre: within [0, 1], adding up to 1. Zero where uncovered.
    pub weights: Vec<[f32; 4]>,
}

impl PixelSamples {
    /// Stands for a tet where a partial mesh has none.
    pub const UNCOVERED: u32 = u32::MAX;
}

/// Samples the plane at time `frame` (frames since the slab's first) at the centres of the source's pixels in `rows`
/// (cut to the picture's height). At each pixel it is the tet that [`super::Scene::draw`] would show at the size of
/// the source, without anti-aliasing.
pub fn sample(refined: &Refined, domain: &Domain, frame: f64, rows: Range<u32>) -> PixelSamples {
    let view = View::new(domain, Viewport::whole(domain), (domain.width, domain.height));
    let t = plane(domain, frame);
    let rows = rows.start.min(domain.height) as i32..rows.end.min(domain.height) as i32;
    let count = rows.len() * domain.width as usize;
    let mut samples = PixelSamples { tet: vec![PixelSamples::UNCOVERED; count], weights: vec![[0.0; 4]; count] };
    for tet in 0..refined.tets.len() {
        let corners = refined.tet_positions(tet);
        sample_tet(corners, t, &view, rows.clone(), |row, column, weights| {
            let pixel = (row - rows.start) as usize * domain.width as usize + column;
            samples.tet[pixel] = tet as u32;
            samples.weights[pixel] = weights;
        });
    }
    samples
}

/// Calls `pixel(row, column, weights)` for each centre in a tet's slice. A quad is cut into two triangles, which
/// together cover what it covers.
fn sample_tet(tet: [IVec3; 4], t: i32, view: &View, rows: Range<i32>, mut pixel: impl FnMut(i32, usize, [f32; 4])) {
    let ends = SLICES[above(tet, t)];
    let mut grid = [GridPoint::default(); 4];
    let mut parts = [0.0; 4];
    for (i, &[below, above]) in ends.iter().enumerate() {
        let (part, place) = cross(tet[below as usize], tet[above as usize], t);
        parts[i] = part;
        grid[i] = view.grid(place.x, place.y);
    }
    for last in 2..ends.len() {
        let picked = [0, last - 1, last];
        let triangle = picked.map(|corner| grid[corner]);
        let outline = Outline::new(&triangle);
        let seen = outline.hull().centers(view.columns, rows.clone());
        let Some((_, rows)) = seen.filter(|_| is_positive(triangle)) else { continue };
        scan(&outline, view.columns, rows, |row, columns| {
            for column in columns {
                let share = planar_weights(triangle, [column as f64 + 0.5, f64::from(row) + 0.5]);
                let mut weights = [0.0f64; 4];
                for (share, &corner) in share.into_iter().zip(&picked) {
                    let [below, above] = ends[corner];
                    weights[below as usize] += share * (1.0 - parts[corner]);
                    weights[above as usize] += share * parts[corner];
                }
                pixel(row, column, weights.map(|w| w as f32));
            }
        });
    }
}

/// Barycentric weights of a place (pixels) in a positive triangle; rounding is not let out of [0, 1].
fn planar_weights(corners: [GridPoint; 3], [x, y]: [f64; 2]) -> [f64; 3] {
    let corners = corners.map(GridPoint::to_px);
    let area = |i: usize, j: usize| {
        let [[ax, ay], [bx, by]] = [corners[i], corners[j]];
        ((ax - x) * (by - y) - (ay - y) * (bx - x)).max(0.0)
    };
    let areas = [area(1, 2), area(2, 0), area(0, 1)];
    let sum: f64 = areas.iter().sum();
    if sum > 0.0 { areas.map(|a| a / sum) } else { [1.0 / 3.0; 3] }
}
