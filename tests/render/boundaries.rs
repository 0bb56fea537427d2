//! Anti-aliased boundaries: exact where they are, and nothing else changed.

use glam::{DVec2, DVec3, IVec3, Vec3};
use tetvec::mesh::{Domain, TetMesh};
use tetvec::render::{DrawParams, Viewport, cross_section};

use crate::drawing::{colored, picture, smooth, stairs};
use crate::meshes::Lattice;
use crate::subdivision::zoo;

/// A mesh of two or more columns of one cell each; column i has label i. Their borders lead from `tops` to `bottoms`,
/// in lattice units.
fn columns(size: [u32; 3], tops: &[i32], bottoms: &[i32]) -> TetMesh {
    let lattice = Lattice::new(size, [tops.len() as u32 + 1, 1, 1]);
    let extent = lattice.domain.extent();
    let mut positions = lattice.positions();
    let regular: Vec<i32> = positions.iter().take(tops.len() + 2).map(|p| p.x).collect();
    for position in &mut positions {
        let column = regular.iter().position(|&x| x == position.x).expect("a lattice");
        if (1..=tops.len()).contains(&column) {
            position.x = if position.y == 0 { tops[column - 1] } else { bottoms[column - 1] };
        }
    }
    let starts: Vec<[i32; 2]> =
        std::iter::once([0, 0]).chain(tops.iter().zip(bottoms).map(|(&a, &b)| [a, b])).collect();
    let label = |_, corner: IVec3| {
        let row = usize::from(corner.y == extent.y);
        starts.iter().position(|start| start[row] == corner.x).expect("a corner on a border") as u32
    };
    lattice.mesh(positions, label, |_, _| Vec3::ZERO)
}

const RED: Vec3 = Vec3::new(240.0, 20.0, 0.0);
const BLUE: Vec3 = Vec3::new(0.0, 60.0, 250.0);

fn assert_color(found: [u8; 3], expected: Vec3, what: impl std::fmt::Display) {
    let off = (Vec3::from_array(found.map(f32::from)) - expected).abs().max_element();
    assert!(off <= 0.51, "{what}: {found:?} against {expected}");
}

/// A slanted edge: each pixel has the colours of both sides by their areas.
#[test]
fn pixels_on_an_edge_are_blended_by_area() {
    let mesh = colored(&columns([16, 8, 4], &[45], &[77]), |_, label| if label == 0 { RED } else { BLUE });
    for levels in 0..=2 {
        for size in [(16u32, 8u32), (37, 19), (5, 3), (200, 150)] {
            let pixels = picture(&mesh, 1.7, smooth(levels), size);
            let (sx, sy) = (f64::from(size.0) / 128.0, f64::from(size.1) / 64.0);
            for (i, &pixel) in pixels.iter().enumerate() {
                let (column, row) = (f64::from(i as u32 % size.0), f64::from(i as u32 / size.0));
                // The part left of the edge, by slices so thin that their sum is exact to 2^-11.
                let slice = |n: i32| {
                    let y = (row + (f64::from(n) + 0.5) / 4096.0) / sy;
                    ((45.0 + (77.0 - 45.0) * y / 64.0) * sx - column).clamp(0.0, 1.0)
                };
                let left = ((0..4096).map(slice).sum::<f64>() / 4096.0) as f32;
                assert_color(pixel, BLUE + (RED - BLUE) * left, format!("level {levels}, {size:?}: {column}, {row}"));
            }
        }
    }
}

/// Three labels meet at (8.25, 7.5), halves and quarters of a pixel away from its sides.
#[test]
fn three_labels_share_a_pixel_by_area() {
    let lattice = Lattice::new([16, 16, 4], [2, 2, 1]);
    let mut positions = lattice.positions();
    positions.iter_mut().filter(|p| p.x == 64).for_each(|p| p.x = 66);
    positions.iter_mut().filter(|p| p.y == 64).for_each(|p| p.y = 60);
    let label = |_, corner: IVec3| if corner.y > 0 { 2 } else { u32::from(corner.x > 0) };
    let mesh = lattice.mesh(positions, label, |_, _| Vec3::ZERO);
    let colors = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| 240.0 * axis);
    let mesh = colored(&mesh, |_, label| colors[label as usize]);
    for levels in 0..=2 {
        let pixels = picture(&mesh, 2.0, smooth(levels), (16, 16));
        let shares = [0.5 * 0.25, 0.5 * 0.75, 0.5].map(|share| 240.0 * share);
        assert_color(pixels[7 * 16 + 8], Vec3::from_array(shares), "the pixel of all three");
        assert_color(pixels[3 * 16 + 8], 240.0 * Vec3::new(0.25, 0.75, 0.0), "a pixel above");
        assert_color(pixels[7 * 16 + 2], 240.0 * Vec3::new(0.5, 0.0, 0.5), "a pixel to the left");
        assert_color(pixels[6 * 16 + 8], 240.0 * Vec3::new(0.25, 0.75, 0.0), "the pixel above");
    }
}

/// A line of a quarter of a pixel that passes between all centres has its share, at every size.
#[test]
fn thin_lines_have_their_share() {
    let mesh = colored(&columns([16, 8, 4], &[41, 43], &[41, 43]), |_, label| Vec3::splat(255.0 * (label % 2) as f32));
    for levels in 0..=2 {
        for size in [(16u32, 8u32), (8, 8), (4, 3)] {
            let pixels = picture(&mesh, 1.0, smooth(levels), size);
            let width = size.0 as f32 / 64.0;
            for (i, &pixel) in pixels.iter().enumerate() {
                let lit = i as u32 % size.0 == 41 * size.0 / 128;
                assert_color(pixel, Vec3::splat(if lit { 255.0 * width } else { 0.0 }), format!("{size:?}, pixel {i}"));
            }
        }
        assert!(picture(&mesh, 1.0, stairs(levels), (16, 8)).iter().all(|pixel| *pixel == [0; 3]));
    }
}

/// What lies beyond the range is clamped on its own, as in the pixels around.
#[test]
fn overshooting_colours_are_clamped_before_they_are_blended() {
    let mesh = colored(&columns([16, 8, 4], &[60], &[60]), |_, label| Vec3::splat([500.0, -200.0][label as usize]));
    let pixels = picture(&mesh, 1.0, smooth(0), (16, 8));
    assert_eq!([6, 7, 8].map(|column| pixels[column][0]), [255, 128, 0]);
}

#[test]
fn without_boundaries_nothing_changes() {
    let plain = Lattice::new([40, 30, 6], [7, 6, 3]).plain(1);
    for levels in 0..=2 {
        let draw = |params| picture(&plain, 2.2, params, (131, 97));
        assert_eq!(draw(smooth(levels)), draw(stairs(levels)), "level {levels}");
    }
}

/// Every pixel of every mesh is either as without anti-aliasing, or the mean over its square; the mean where a
/// boundary crosses it. At sizes where tets are smaller than pixels, where they are larger, and in viewports.
#[test]
fn pictures_are_those_of_the_polygons() {
    let viewport = Some(Viewport { x: 3.3, y: -1.8, width: 9.0, height: 15.0 });
    for (name, mesh) in zoo() {
        for levels in 0..=2 {
            for (t, viewport, size) in [(1.0, None, (61, 43)), (2.3, None, (11, 9)), (0.7, viewport, (40, 77))] {
                let what = format!("{name}, level {levels}, {size:?} at {t}");
                let params = DrawParams { viewport, ..smooth(levels) };
                let found = picture(&mesh, t, params, size);
                let centers = picture(&mesh, t, DrawParams { viewport, ..stairs(levels) }, size);
                let slice = Slice::new(&mesh, t, &params, size);
                let (means, crossed) = (slice.means(), slice.crossed());
                for (i, &pixel) in found.iter().enumerate() {
                    if crossed[i] {
                        assert_color(pixel, means[i], format!("{what}: crossed pixel {i}"));
                    } else if pixel != centers[i] {
                        assert!(slice.shows_picture(i), "{what}: pixel {i} is outside");
                        assert_color(pixel, means[i], format!("{what}: pixel {i}"));
                    }
                }
                assert!(mesh.wedges.iter().any(|w| w.label.0 > 0) || found == centers, "{what}");
            }
        }
    }
}

/// A slice as polygons on the pixel grid.
struct Slice {
    /// Label, corners, colours.
    polygons: Vec<(u32, Vec<DVec2>, Vec<Vec3>)>,
    size: (u32, u32),
    /// The source picture on the pixel grid.
    picture: [DVec2; 2],
}

impl Slice {
    fn new(mesh: &TetMesh, t: f64, params: &DrawParams, size: (u32, u32)) -> Self {
        let Domain { width, height, .. } = mesh.domain;
        let viewport = params.viewport.unwrap_or(Viewport::whole(&mesh.domain));
        let scale = DVec2::new(f64::from(size.0) / viewport.width, f64::from(size.1) / viewport.height);
        let grid = |p: DVec2| (p - DVec2::new(viewport.x, viewport.y)) * scale;
        let section = cross_section(mesh, t, params.levels).into_iter();
        Self {
            polygons: section.map(|p| (p.label.0, p.corners.into_iter().map(grid).collect(), p.colors)).collect(),
            size,
            picture: [grid(DVec2::ZERO), grid(DVec2::new(width.into(), height.into()))],
        }
    }

    fn shows_picture(&self, pixel: usize) -> bool {
        let center = self.place(pixel) + 0.5;
        center.cmpgt(self.picture[0]).all() && center.cmplt(self.picture[1]).all()
    }

    fn place(&self, pixel: usize) -> DVec2 {
        DVec2::new(f64::from(pixel as u32 % self.size.0), f64::from(pixel as u32 / self.size.0))
    }

    /// For each pixel the mean over the parts of triangles that turn the right way.
    fn means(&self) -> Vec<Vec3> {
        let mut sums = vec![(0.0, DVec3::ZERO); (self.size.0 * self.size.1) as usize];
        for (_, corners, colors) in &self.polygons {
            for i in 2..corners.len() {
                let (corners, colors) = ([0, i - 1, i].map(|k| corners[k]), [0, i - 1, i].map(|k| colors[k]));
                if (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]) <= 1e-9 {
                    continue;
                }
                for pixel in self.touched(&corners) {
                    let (area, centroid) = common_part(&corners, self.place(pixel));
                    if area > 0.0 {
                        sums[pixel].0 += area;
                        sums[pixel].1 += area * color_at(corners, colors, centroid);
                    }
                }
            }
        }
        sums.into_iter().map(|(area, sum)| (sum / area).as_vec3()).collect()
    }

    /// The pixels that a triangle's or an edge's bounds touch.
    fn touched(&self, corners: &[DVec2]) -> impl Iterator<Item = usize> {
        let low = corners.iter().fold(DVec2::INFINITY, |low, &p| low.min(p)).floor().max(DVec2::ZERO);
        let high = corners.iter().fold(DVec2::NEG_INFINITY, |high, &p| high.max(p)).ceil();
        let (width, height) = self.size;
        let columns = low.x as u32..(high.x as u32).min(width);
        (low.y as u32..(high.y as u32).min(height))
            .flat_map(move |row| columns.clone().map(move |column| (row * width + column) as usize))
    }

    /// The pixels that an edge between triangles of different labels crosses for more than a trifle, in the picture.
    /// Edges of triangles that are turned over on both sides do not count.
    fn crossed(&self) -> Vec<bool> {
        let mut edges = std::collections::BTreeMap::<[[u64; 2]; 2], Vec<u32>>::new();
        for (label, corners, _) in &self.polygons {
            for i in 0..corners.len() {
                let [a, b, other] = [0, 1, 2].map(|k| corners[(i + k) % corners.len()]);
                let mut ends = [a, b].map(|p| [p.x.to_bits(), p.y.to_bits()]);
                ends.sort_unstable();
                let labels = edges.entry(ends).or_default();
                labels.push(*label);
                // Marks a side that is drawn.
                if (b - a).perp_dot(other - b) > 1e-6 {
                    labels.push(u32::MAX);
                }
            }
        }
        let mut crossed = vec![false; (self.size.0 * self.size.1) as usize];
        for (ends, mut labels) in edges {
            let drawn = labels.contains(&u32::MAX);
            labels.retain(|label| *label != u32::MAX);
            let ends = ends.map(|end| DVec2::from_array(end.map(f64::from_bits)));
            if labels.len() == 2 && labels[0] != labels[1] && drawn {
                for pixel in self.touched(&ends).filter(|&pixel| self.shows_picture(pixel)) {
                    crossed[pixel] |= is_crossed(ends, self.place(pixel) + 0.5);
                }
            }
        }
        crossed
    }
}

/// Whether more than a trifle of an edge lies inside of the pixel around `center`.
fn is_crossed(ends: [DVec2; 2], center: DVec2) -> bool {
    let points = (0..=200).map(|n| ends[0].lerp(ends[1], f64::from(n) / 200.0));
    points.into_iter().any(|point| (point - center).abs().max_element() < 0.4999)
}

/// The colour field of a triangle at a place, held within the corners' colours and clamped.
fn color_at([a, b, c]: [DVec2; 3], colors: [Vec3; 3], place: DVec2) -> DVec3 {
    let whole = (b - a).perp_dot(c - a);
    let (v, w) = ((place - a).perp_dot(c - a) / whole, (b - a).perp_dot(place - a) / whole);
    let [p, q, r] = colors.map(Vec3::as_dvec3);
    let color = p + (q - p) * v + (r - p) * w;
    color.max(p.min(q).min(r)).min(p.max(q).max(r)).clamp(DVec3::ZERO, DVec3::splat(255.0))
}

/// Area and centroid of what a triangle covers of the pixel whose corner is `pixel`.
fn common_part(corners: &[DVec2; 3], pixel: DVec2) -> (f64, DVec2) {
    let mut polygon: Vec<DVec2> = corners.iter().map(|&corner| corner - pixel).collect();
    for (normal, value) in [(DVec2::X, 0.0), (DVec2::NEG_X, 1.0), (DVec2::Y, 0.0), (DVec2::NEG_Y, 1.0)] {
        let height = |p: DVec2| normal.dot(p) + value;
        let mut kept = Vec::new();
        for i in 0..polygon.len() {
            let (from, to) = (polygon[i], polygon[(i + 1) % polygon.len()]);
            let (low, high) = (height(from), height(to));
            if low >= 0.0 {
                kept.push(from);
            }
            if (low >= 0.0) != (high >= 0.0) {
                kept.push(from + (to - from) * (low / (low - high)));
            }
        }
        polygon = kept;
    }
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    for i in 2..polygon.len() {
        let part = (polygon[i - 1] - polygon[0]).perp_dot(polygon[i] - polygon[0]) / 2.0;
        area += part;
        moment += (polygon[0] + polygon[i - 1] + polygon[i]) * (part / 3.0);
    }
    (area, pixel + moment / area)
}

/// Flat labels: each pixel is the mean of the sixteen that it is in a picture four times as large.
#[test]
fn means_do_not_depend_on_the_size() {
    for seed in 0..12 {
        let lattice = Lattice::new([40, 30, 6], [9, 7, 3]);
        let mesh = if seed % 2 == 0 { lattice.wild(seed, 2 + seed / 2) } else { lattice.disc(seed) };
        let flat = colored(&mesh, |_, label| Vec3::new(250.0, 90.0, 10.0) * [1.0, 0.1, 0.5, 0.7][label as usize % 4]);
        let size = (31 + seed as u32, 24);
        let small = picture(&flat, 1.3, smooth(0), size);
        let large = picture(&flat, 1.3, smooth(0), (4 * size.0, 4 * size.1));
        for (i, &pixel) in small.iter().enumerate() {
            let (x, y) = (4 * (i % size.0 as usize), 4 * (i / size.0 as usize));
            let parts = (0..16).map(|k| large[(y + k / 4) * 4 * size.0 as usize + x + k % 4]);
            let mean = parts.map(|p| Vec3::from_array(p.map(f32::from))).sum::<Vec3>() / 16.0;
            let off = (Vec3::from_array(pixel.map(f32::from)) - mean).abs().max_element();
            assert!(off <= 1.01, "seed {seed}, pixel {i}: {pixel:?} against {mean}");
        }
    }
}

/// In another order of tets sums are rounded otherwise, and that is all.
#[test]
fn order_of_tets_does_not_matter() {
    let mesh = Lattice::new([40, 30, 6], [7, 6, 3]).wild(6, 4);
    let mut reversed = mesh.clone();
    reversed.tets.reverse();
    let draw = |mesh| picture(mesh, 1.9, smooth(0), (90, 70));
    let off = draw(&mesh).iter().zip(draw(&reversed)).filter(|(a, b)| (0..3).any(|c| a[c].abs_diff(b[c]) > 1)).count();
    assert_eq!(off, 0);
}
