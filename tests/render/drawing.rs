//! Slices and pictures: covered once, exact where they can be, the same from every side.

use glam::Vec3;
use tetvec::mesh::{Domain, TetMesh, VertexId, Wedge, WedgeId};
use tetvec::render::{
    DrawParams, FINE_BITS, PixelSamples, Refined, Scene, Viewport, color_masks, cross_section, draw, sample, subdivide,
};
use tetvec::video::{PixelFormat, Plane, Surface, YuvMatrix};

use crate::meshes::{Lattice, Random};
use crate::subdivision::zoo;

/// An RGB picture of `mesh`.
pub(crate) fn picture(mesh: &TetMesh, frame: f64, params: DrawParams, size: (u32, u32)) -> Vec<[u8; 3]> {
    with_surface(size, |surface| draw(mesh, frame, &params, surface).expect("a viewport that can be drawn"))
}

/// The whole picture with anti-aliased boundaries.
pub(crate) fn smooth(levels: u8) -> DrawParams {
    DrawParams { levels, antialias: true, viewport: None, mesh: false }
}

/// The whole picture with each pixel as at its centre.
pub(crate) fn stairs(levels: u8) -> DrawParams {
    DrawParams { levels, antialias: false, viewport: None, mesh: false }
}

/// The RGB picture that `work` draws.
pub(crate) fn with_surface((width, height): (u32, u32), work: impl FnOnce(&mut Surface<'_>)) -> Vec<[u8; 3]> {
    let mut data = vec![0; 3 * width as usize * height as usize];
    let planes = vec![Plane { data: &mut data, stride: 3 * width as usize }];
    let surface = Surface::try_new(PixelFormat::Rgb, YuvMatrix::Bt601, (width, height), planes);
    work(&mut surface.expect("a surface"));
    data.as_chunks().0.to_vec()
}

/// `mesh` with every wedge in one colour.
pub(crate) fn colored(mesh: &TetMesh, mut color: impl FnMut(Vec3, u32) -> Vec3) -> TetMesh {
    let unit = mesh.domain.unit() as f32;
    let mut mesh = mesh.clone();
    for wedge in &mut mesh.wedges {
        wedge.color = color(mesh.positions[wedge.vertex.index()].as_vec3() / unit, wedge.label.0);
    }
    mesh
}

const TIMES: [f64; 6] = [0.0, 1.0, 1.3, 2.5, 4.997, 1e9];

/// White everywhere on black: a hole would be black.
#[test]
fn no_hole_at_any_level_and_size() {
    for (name, mesh) in zoo() {
        let white = colored(&mesh, |_, _| Vec3::splat(255.0));
        for levels in 0..=2 {
            for size in [(1, 1), (7, 5), (23, 17), (61, 43), (101, 200)] {
                for t in TIMES {
                    let pixels = picture(&white, t, smooth(levels), size);
                    let holes = pixels.iter().filter(|p| **p != [255; 3]).count();
                    assert_eq!(holes, 0, "{name}, level {levels}, {size:?} at {t}");
                }
            }
        }
    }
}

/// Areas of a slice's polygons, counted with sign, add up to the picture.
#[test]
fn slices_have_the_area_of_the_picture() {
    for (name, mesh) in zoo() {
        for levels in 0..=2 {
            for t in [0.5, 1.0, 2.3] {
                let section = cross_section(&mesh, t, levels);
                let area: f64 = section.iter().map(|polygon| signed_area(&polygon.corners)).sum();
                let whole = f64::from(mesh.domain.width) * f64::from(mesh.domain.height);
                assert!((area - whole).abs() < 1e-6 * whole, "{name}, level {levels} at {t}: {area} of {whole} px");
            }
        }
    }
}

fn signed_area(corners: &[glam::DVec2]) -> f64 {
    (0..corners.len()).map(|i| corners[i].perp_dot(corners[(i + 1) % corners.len()])).sum::<f64>() / 2.0
}

/// Where no child is turned over, each pixel is drawn by just one tet, at any size: areas alone would not see an
/// overlap beside a gap.
#[test]
fn each_pixel_is_drawn_once_without_folds() {
    let mut unfolded = [0; 3];
    for (name, mesh) in zoo() {
        for levels in 0..=2 {
            let refined = subdivide(&mesh, levels);
            if (0..refined.tets.len()).any(|tet| refined.volume6(tet) <= 0) {
                continue;
            }
            unfolded[levels as usize] += 1;
            let fine = as_control_mesh(&refined, &mesh);
            for (size, t) in [((23, 17), 1.0), ((61, 43), 2.3), ((101, 37), 0.25)] {
                let counts = count_fills(&fine, f64::min(t, mesh.domain.duration.into()), size);
                assert!(counts.iter().all(|&count| count == 1), "{name}, level {levels}, {size:?} at {t}");
            }
        }
    }
    assert!(unfolded[0] == 6 && unfolded[1] >= 3 && unfolded[2] >= 2, "too few meshes without folds: {unfolded:?}");
}

/// A refined mesh as a mesh of its own on the finer lattice; white.
fn as_control_mesh(refined: &Refined, mesh: &TetMesh) -> TetMesh {
    let subpixel_bits = mesh.domain.subpixel_bits + FINE_BITS as u8;
    let mut fine = TetMesh::empty(Domain { subpixel_bits, ..mesh.domain });
    for &point in &refined.points {
        fine.push_vertex(point);
    }
    for node in &refined.nodes {
        fine.push_wedge(Wedge { vertex: VertexId(node.point), label: node.label, color: Vec3::splat(255.0) });
    }
    fine.tets = refined.tets.iter().map(|tet| tet.map(WedgeId)).collect();
    fine
}

/// How often each pixel is drawn: every tet is drawn alone.
fn count_fills(mesh: &TetMesh, t: f64, size: (u32, u32)) -> Vec<u32> {
    let mut counts = vec![0; (size.0 * size.1) as usize];
    let mut alone = TetMesh::empty(mesh.domain);
    alone.wedges = vec![mesh.wedges[0]; 4];
    alone.pinned = vec![false; 4];
    alone.tets = vec![[0, 1, 2, 3].map(WedgeId)];
    (0..4).for_each(|i| alone.wedges[i].vertex = VertexId(i as u32));
    let plane = (t * f64::from(mesh.domain.unit())) as i32;
    for tet in 0..mesh.tets.len() {
        let corners = mesh.tet_positions(tet);
        if corners.iter().all(|c| c.z < plane - 1) || corners.iter().all(|c| c.z > plane + 1) {
            continue;
        }
        alone.positions = corners.to_vec();
        for (count, pixel) in counts.iter_mut().zip(picture(&alone, t, stairs(0), size)) {
            *count += u32::from(pixel == [255; 3]);
        }
    }
    counts
}

#[test]
fn constant_colour_is_exact_at_all_levels() {
    let color = Vec3::new(13.0, 200.0, 91.0);
    for (name, mesh) in zoo() {
        let flat = colored(&mesh, |_, _| color);
        for levels in 0..=2 {
            let pixels = picture(&flat, 1.7, smooth(levels), (67, 51));
            assert!(pixels.iter().all(|p| *p == [13, 200, 91]), "{name}, level {levels}");
        }
    }
}

#[test]
fn linear_colour_is_reproduced_at_any_size() {
    for (name, mesh) in zoo() {
        let (w, h) = (mesh.domain.width as f32, mesh.domain.height as f32);
        let field = |p: Vec3| Vec3::new(250.0 * p.x / w, 20.0 + 200.0 * p.y / h, 40.0 * p.z + 60.0 * p.x / w);
        let linear = colored(&mesh, |p, _| field(p));
        for (size, t) in [((23u32, 17u32), 1.0f32), ((640, 360), 0.6), ((9, 301), 2.0)] {
            // The slab of one frame ends at t = 1.
            let t = t.min(mesh.domain.duration as f32);
            let pixels = picture(&linear, f64::from(t), smooth(0), size);
            for (i, pixel) in pixels.iter().enumerate() {
                let (x, y) = (i as u32 % size.0, i as u32 / size.0);
                let at = Vec3::new((x as f32 + 0.5) * w / size.0 as f32, (y as f32 + 0.5) * h / size.1 as f32, t);
                let expected = field(at).clamp(Vec3::ZERO, Vec3::splat(255.0)).to_array();
                for (found, expected) in pixel.iter().zip(expected) {
                    assert!((f32::from(*found) - expected).abs() <= 0.6, "{name} {size:?} ({x}, {y}) at {t}");
                }
            }
        }
    }
}

/// The picture is what the masks and the samples say: geometry, colours and fill agree with what a fit sees.
#[test]
fn pictures_agree_with_masks_and_samples() {
    for (name, mesh) in zoo() {
        for levels in 0..=2 {
            let refined = subdivide(&mesh, levels);
            let control: Vec<Vec3> = mesh.wedges.iter().map(|wedge| wedge.color).collect();
            let colors = color_masks(&mesh, levels).apply(&control);
            for t in [0.0, 1.0, 3.4] {
                let samples = sample(&refined, &mesh.domain, t, 0..mesh.domain.height);
                let pixels = picture(&mesh, t, stairs(levels), (mesh.domain.width, mesh.domain.height));
                for (i, pixel) in pixels.iter().enumerate() {
                    let tet = refined.tets[samples.tet[i] as usize];
                    let weights = samples.weights[i];
                    assert!((weights.iter().sum::<f32>() - 1.0).abs() < 1e-5);
                    let color: Vec3 = (0..4).map(|k| colors[tet[k] as usize] * weights[k]).sum();
                    for (found, expected) in pixel.iter().zip(color.to_array()) {
                        assert!((f32::from(*found) - expected).abs() <= 0.55, "{name}, level {levels} at {t}: {i}");
                    }
                }
            }
        }
    }
}

#[test]
fn samples_of_rows_are_rows_of_samples() {
    let mesh = Lattice::new([40, 30, 6], [7, 6, 3]).disc(2);
    let refined = subdivide(&mesh, 1);
    let whole = sample(&refined, &mesh.domain, 1.0, 0..30);
    let rows = sample(&refined, &mesh.domain, 1.0, 11..17);
    assert_eq!(rows.tet, whole.tet[11 * 40..17 * 40]);
    assert_eq!(rows.weights, whole.weights[11 * 40..17 * 40]);
    assert!(sample(&refined, &mesh.domain, 1.0, 30..99).tet.is_empty());
}

#[test]
fn a_partial_mesh_says_what_it_does_not_cover() {
    let mut mesh = Lattice::new([40, 30, 6], [7, 6, 3]).plain(2);
    mesh.tets.truncate(6 * 7 * 3);
    let samples = sample(&subdivide(&mesh, 0), &mesh.domain, 0.5, 0..30);
    let covered = samples.tet.iter().filter(|tet| **tet != PixelSamples::UNCOVERED).count();
    assert!((400..=800).contains(&covered), "{covered} of 1200");
    assert_eq!(*samples.tet.last().unwrap(), PixelSamples::UNCOVERED);
    assert_eq!(samples.weights.last(), Some(&[0.0; 4]));
}

/// Polygons of different labels have the same corners, bit for bit, where they meet.
#[test]
fn labels_share_their_boundary() {
    let mesh = Lattice::new([40, 30, 6], [7, 6, 3]).disc(2);
    for levels in 0..=2 {
        let section = cross_section(&mesh, 2.2, levels);
        let mut edges = std::collections::BTreeMap::<[[u64; 2]; 2], i32>::new();
        let bits = |p: glam::DVec2| [p.x.to_bits(), p.y.to_bits()];
        for polygon in &section {
            for i in 0..polygon.corners.len() {
                let mut ends = [i, (i + 1) % polygon.corners.len()].map(|k| bits(polygon.corners[k]));
                ends.sort_unstable();
                *edges.entry(ends).or_default() += 1;
            }
        }
        let on_border = |end: [u64; 2]| {
            let [x, y] = end.map(f64::from_bits);
            x == 0.0 || y == 0.0 || x == 40.0 || y == 30.0
        };
        for (ends, count) in edges {
            let point = ends[0] == ends[1];
            assert!(point || count == 2 || (count == 1 && ends.into_iter().all(on_border)), "level {levels}");
        }
    }
}

/// A viewport shows what the same part of a larger picture shows.
#[test]
fn zoom_equals_a_crop_of_a_larger_picture() {
    let mesh = Lattice::new([40, 30, 6], [7, 6, 3]).disc(2);
    for levels in 0..=2 {
        let large = picture(&mesh, 1.5, smooth(levels), (400, 300));
        let viewport = Some(Viewport { x: 12.0, y: 7.0, width: 10.0, height: 8.0 });
        let zoom = picture(&mesh, 1.5, DrawParams { viewport, ..smooth(levels) }, (100, 80));
        let mut off = 0;
        for y in 0..80 {
            for x in 0..100 {
                let (a, b) = (zoom[y * 100 + x], large[(y + 70) * 400 + x + 120]);
                off = off.max((0..3).map(|c| a[c].abs_diff(b[c])).max().unwrap());
            }
        }
        assert!(off <= 1, "level {levels}: off by {off}");
    }
}

#[test]
fn far_zooms_and_strange_viewports_draw_or_refuse() {
    let mesh = colored(&Lattice::new([40, 30, 6], [7, 6, 3]).disc(2), |_, _| Vec3::splat(255.0));
    for (side, x) in [(0.001, 39.9), (0.5, 0.0), (1e6, 0.0), (0.001, 1000.0)] {
        let viewport = Viewport { x, y: 3.0, width: side, height: side };
        let pixels = picture(&mesh, 1.0, DrawParams { viewport: Some(viewport), ..smooth(1) }, (64, 48));
        assert_eq!(pixels[0] == [255; 3], x < 40.0 && side < 1e3, "{viewport:?}");
    }
    let mut scene = Scene::new(mesh.domain);
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9] {
        let viewport = Viewport { x: 0.0, y: 0.0, width, height: 1.0 };
        let params = DrawParams { viewport: Some(viewport), ..smooth(0) };
        with_surface((4, 4), |surface| assert!(scene.draw(0.0, &params, surface).is_err(), "{width}"));
    }
}

#[test]
fn nothing_is_black() {
    let mut scene = Scene::new(Lattice::new([40, 30, 6], [1, 1, 1]).domain);
    for t in [f64::NAN, f64::NEG_INFINITY, 0.0] {
        for levels in 0..=2 {
            let pixels = with_surface((5, 4), |surface| scene.draw(t, &smooth(levels), surface).unwrap());
            assert!(pixels.iter().all(|p| *p == [0; 3]));
        }
    }
}

/// A scene that grew draws what a scene made at once draws; and what was drawn before does not matter.
#[test]
fn growing_scenes_draw_the_same() {
    let mesh = Lattice::new([40, 30, 12], [7, 6, 6]).disc(8);
    for levels in 0..=2 {
        let mut grown = Scene::new(mesh.domain);
        let mut part = TetMesh::empty(mesh.domain);
        (part.positions, part.pinned) = (mesh.positions.clone(), mesh.pinned.clone());
        part.wedges = mesh.wedges.clone();
        for end in [mesh.tets.len() / 4, mesh.tets.len() * 2 / 3 + 5, mesh.tets.len()] {
            part.tets = mesh.tets[..end].to_vec();
            grown.extend(&part);
            for t in [1.0, 4.0, 11.0] {
                with_surface((50, 40), |surface| grown.draw(t, &smooth(levels), surface).unwrap());
            }
        }
        for t in [0.0, 3.3, 6.0, 12.0] {
            let found = with_surface((90, 70), |surface| grown.draw(t, &smooth(levels), surface).unwrap());
            assert_eq!(found, picture(&mesh, t, smooth(levels), (90, 70)), "level {levels} at {t}");
        }
    }
}

#[cfg(feature = "threads")]
#[test]
fn pixels_do_not_depend_on_threads() {
    let mesh = Lattice::new([160, 120, 12], [20, 15, 6]).wild(8, 5);
    for levels in 0..=2 {
        let draw = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a thread pool");
            pool.install(|| picture(&mesh, 5.5, smooth(levels), (333, 222)))
        };
        let one = draw(1);
        assert!([2, 3, 8].into_iter().all(|threads| draw(threads) == one), "level {levels}");
    }
}

/// Colours out of range, and tets in any number at a place: no panic, and clamped.
#[test]
fn wild_colours_are_clamped() {
    let mut random = Random(5);
    let mesh = Lattice::new([40, 30, 6], [7, 6, 3]).disc(2);
    let mesh = colored(&mesh, |_, _| {
        let huge = [f32::MAX, -f32::MAX, 1e9, -5.0, 260.0, f32::INFINITY, f32::NAN];
        Vec3::from_array([(); 3].map(|()| huge[random.range(0, 6) as usize]))
    });
    for levels in 0..=2 {
        assert_eq!(picture(&mesh, 1.0, smooth(levels), (50, 40)).len(), 2000);
    }
}
