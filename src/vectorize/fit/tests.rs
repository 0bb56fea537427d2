//! Fits of coarse lattices to frames whose best fit is known.

use std::sync::Arc;

use glam::{IVec3, Vec3};

use super::guard::Guard;
use super::*;
use crate::mesh::{Domain, Wedge, WedgeId, validate, volume6};
use crate::render::subdivide;
use crate::video::{Frame, Label};

const SIZE: (u32, u32, u32) = (48, 36, 12);

/// A Kuhn lattice of `cells`, inner vertices moved by up to `jitter` cells, each tet labelled by its centre (pixels).
fn lattice(cells: [u32; 3], jitter: f32, label: impl Fn(Vec3) -> u32) -> TetMesh {
    let domain = Domain { width: SIZE.0, height: SIZE.1, duration: SIZE.2, subpixel_bits: 3 };
    let mut mesh = TetMesh::empty(domain);
    let extent = domain.extent();
    let mut random = 88172645463325252u64;
    let mut shift = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random % 2001) as f32 / 1000.0 - 1.0
    };
    let index = |c: [u32; 3]| (c[2] * (cells[1] + 1) + c[1]) * (cells[0] + 1) + c[0];
    for t in 0..=cells[2] {
        for y in 0..=cells[1] {
            for x in 0..=cells[0] {
                let place = |i: u32, n: u32, extent: i32, shift: f32| {
                    let inside = if i == 0 || i == n { 0.0 } else { shift * jitter };
                    ((i as f32 + inside) * extent as f32 / n as f32).round() as i32
                };
                mesh.push_vertex(IVec3::new(
                    place(x, cells[0], extent.x, shift()),
                    place(y, cells[1], extent.y, shift()),
                    place(t, cells[2], extent.z, shift()),
                ));
            }
        }
    }
    let mut wedge_of = std::collections::BTreeMap::new();
    for cell in 0..cells[0] * cells[1] * cells[2] {
        let near = [cell % cells[0], cell / cells[0] % cells[1], cell / cells[0] / cells[1]];
        for axes in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut corner = near;
            let mut tet = vec![index(corner)];
            for axis in axes {
                corner[axis] += 1;
                tet.push(index(corner));
            }
            let p: Vec<IVec3> = tet.iter().map(|&v| mesh.positions[v as usize]).collect();
            if volume6(p[0], p[1], p[2], p[3]) < 0 {
                tet.swap(2, 3);
            }
            let label = Label(label(p.iter().sum::<IVec3>().as_vec3() / 32.0));
            let corners: Vec<WedgeId> = tet
                .iter()
                .map(|&v| {
                    let color = Vec3::splat(100.0);
                    let wedge = Wedge { vertex: crate::mesh::VertexId(v), label, color };
                    *wedge_of.entry((v, label)).or_insert_with(|| mesh.push_wedge(wedge))
                })
                .collect();
            mesh.tets.push([corners[0], corners[1], corners[2], corners[3]]);
        }
    }
    validate(&mesh).expect("the lattice tiles its box");
    mesh
}

fn one_label(_: Vec3) -> u32 {
    0
}

/// Frames of a field over (x, y, t) in pixels.
fn film(color: impl Fn(Vec3) -> Vec3) -> Volume {
    let mut volume = Volume::new(0);
    for k in 0..=SIZE.2 {
        // The slab's first frame is shown half a lattice unit late.
        let t = (k as f32).max(1.0 / 16.0);
        let pixel = |x: u32, y: u32| {
            let color = color(Vec3::new(x as f32 + 0.5, y as f32 + 0.5, t));
            color.to_array().map(|c| c.round().clamp(0.0, 255.0) as u8)
        };
        volume.push(Arc::new(Frame::from_fn(SIZE.0, SIZE.1, pixel).expect("a valid size")));
    }
    volume
}

fn linear(p: Vec3) -> Vec3 {
    Vec3::new(40.0 + 2.0 * p.x + p.y, 200.0 - 3.0 * p.y + p.t(), 10.0 + p.x + p.y + 4.0 * p.t())
}

/// A ridge that runs askew through the lattice and moves: no lattice plane follows it.
fn ridge(p: Vec3) -> Vec3 {
    let across = p.x * 0.9 + p.y * 0.35 - 22.3 - 0.4 * p.t();
    Vec3::new(220.0 - 8.0 * across.abs(), 60.0 + 5.0 * across.abs(), 128.0 + 2.0 * across)
}

trait Time {
    fn t(self) -> f32;
}

impl Time for Vec3 {
    fn t(self) -> f32 {
        self.z
    }
}

fn run(
    mesh: &mut TetMesh,
    frames: &Volume,
    params: &FitParams,
    step: impl Fn(&mut FitRequest<'_>) -> Result<FitReport, FitError>,
) -> FitReport {
    let free = vec![true; mesh.positions.len()];
    step(&mut FitRequest { mesh, free: &free, frames, labels: &[], params }).expect("a valid request")
}

fn at_level(subdivision_levels: u8) -> FitParams {
    FitParams { subdivision_levels, ..FitParams::default() }
}

fn sides(mesh: &TetMesh) -> Vec<u8> {
    mesh.positions.iter().map(|p| mesh.domain.sides(*p).0).collect()
}

/// Flat or inverted children of tets that touch a boundary between labels.
fn folded_children(mesh: &TetMesh, levels: u8) -> usize {
    let mut wedges = vec![0; mesh.positions.len()];
    mesh.wedges.iter().for_each(|w| wedges[w.vertex.index()] += 1);
    let refined = subdivide(mesh, levels);
    let at_boundary = |tet: usize| mesh.tet_vertices(tet >> (3 * levels)).iter().any(|v| wedges[v.index()] > 1);
    (0..refined.tets.len()).filter(|&tet| at_boundary(tet) && refined.volume6(tet) <= 0).count()
}

#[test]
fn every_pixel_counts_once() {
    let frames = film(linear);
    let pixels = u64::from(SIZE.0 * SIZE.1 * (SIZE.2 + 1));
    for level in [0, 1] {
        let mut mesh = lattice([6, 5, 3], 0.15, one_label);
        let report = run(&mut mesh, &frames, &at_level(level), fit_colors);
        assert_eq!(report.pixels, pixels, "level {level}");
    }
}

#[test]
fn colors_recover_a_field_that_the_mesh_can_represent() {
    let frames = film(linear);
    for level in [0, 1, 2] {
        let mut mesh = lattice([5, 4, 3], 0.2, one_label);
        let params = FitParams { color_iterations: 100, tolerance: 1e-6, ..at_level(level) };
        let report = run(&mut mesh, &frames, &params, fit_colors);
        // Pixels are rounded to whole levels, whose own error is 0.29.
        assert!(report.rms_after < 0.32, "level {level}: {report:?}");
        for wedge in &mesh.wedges {
            let expected = linear(mesh.positions[wedge.vertex.index()].as_vec3() / 8.0);
            assert!((wedge.color - expected).abs().max_element() < 3.0, "level {level}: {wedge:?}, not {expected}");
        }
    }
}

#[test]
fn colors_stay_within_their_range() {
    let frames = film(|p| if p.x < 24.0 { Vec3::ZERO } else { Vec3::splat(255.0) });
    let mut mesh = lattice([7, 2, 2], 0.0, one_label);
    run(&mut mesh, &frames, &at_level(0), fit_colors);
    for color in mesh.wedges.iter().flat_map(|w| w.color.to_array()) {
        assert!((COLOR_RANGE[0]..=COLOR_RANGE[1]).contains(&color));
    }
}

#[test]
fn positions_follow_what_colors_cannot() {
    let frames = film(ridge);
    // A second label takes a corner, so that there is a boundary to keep upright.
    let corner = |p: Vec3| u32::from(p.x > 30.0 && p.y > 20.0);
    for level in [0, 1] {
        let mut mesh = lattice([6, 5, 3], 0.1, corner);
        let before = sides(&mesh);
        let params = FitParams { position_iterations: 20, ..at_level(level) };
        let report = run(&mut mesh, &frames, &params, fit);
        assert!(report.rms_positions < 0.5 * report.rms_colors, "level {level}: {report:?}");
        assert!(report.rms_after < 0.6 * report.rms_colors, "level {level}: {report:?}");
        validate(&mesh).expect("still a tiling");
        assert_eq!(before, sides(&mesh));
        if level == 0 {
            assert!(!mesh.pinned.contains(&true), "nothing subdivides it");
        } else {
            assert_eq!((folded_children(&mesh, 1), folded_children(&mesh, 2)), (0, 0));
        }
    }
}

#[test]
fn what_is_not_free_stays() {
    let frames = film(ridge);
    let mut mesh = lattice([6, 5, 4], 0.1, one_label);
    let before = mesh.clone();
    let free: Vec<bool> = mesh.positions.iter().map(|p| p.z > 40).collect();
    let params = FitParams::default();
    let request = &mut FitRequest { mesh: &mut mesh, free: &free, frames: &frames, labels: &[], params: &params };
    let report = fit(request).expect("a valid request");
    assert!(report.position_steps > 0 && report.rms_after < report.rms_before);
    for (v, _) in free.iter().enumerate().filter(|(_, free)| !**free) {
        assert_eq!((mesh.positions[v], mesh.pinned[v]), (before.positions[v], before.pinned[v]));
    }
    for (now, was) in mesh.wedges.iter().zip(&before.wedges).filter(|(w, _)| !free[w.vertex.index()]) {
        assert_eq!(now, was);
    }
    assert_eq!((mesh.tets.clone(), mesh.wedges.len()), (before.tets, before.wedges.len()));
    validate(&mesh).expect("still a tiling");
}

#[test]
fn where_a_partial_mesh_ends_positions_stay() {
    let frames = film(ridge);
    let mut mesh = lattice([6, 5, 4], 0.1, one_label);
    let tets = mesh.tets.clone();
    let kept = |corners: &[WedgeId; 4]| corners.iter().all(|&w| mesh.position(w).z <= 60);
    let (kept, rest): (Vec<_>, Vec<_>) = tets.iter().partition(|&corners| kept(corners));
    let (before, size) = (mesh.positions.clone(), kept.len());
    mesh.tets = kept;
    let report = run(&mut mesh, &frames, &at_level(1), fit);
    assert!(report.position_steps > 0);
    assert!(mesh.positions.iter().zip(&before).any(|(now, was)| now != was && was.z <= 60));
    // What goes on at the far side of the rim still fits.
    assert_eq!(mesh.tets.len(), size);
    mesh.tets.extend(rest);
    validate(&mesh).expect("still a tiling");
}

/// Label planes of a region, sampled at pixel centres.
fn planes(inside: impl Fn(Vec3) -> bool) -> Vec<(u32, LabelPlane)> {
    let plane = |k: u32| {
        let label = |x: u32, y: u32| Label(u32::from(inside(Vec3::new(x as f32 + 0.5, y as f32 + 0.5, k as f32))));
        let labels = (0..SIZE.1).flat_map(|y| (0..SIZE.0).map(move |x| (x, y))).map(|(x, y)| label(x, y));
        (k, LabelPlane::new(SIZE.0, SIZE.1, labels.collect()))
    };
    (0..=SIZE.2).map(plane).collect()
}

#[test]
fn surfaces_move_onto_the_original_boundary() {
    let cylinder = |p: Vec3| (p.x - 24.0).hypot(p.y - 18.0) - 11.0;
    let frames = film(|p| Vec3::splat(if cylinder(p) < 0.0 { 200.0 } else { 50.0 }));
    for level in [0, 1] {
        let mut mesh = lattice([12, 9, 3], 0.05, |p| u32::from(cylinder(p) < 0.0));
        let free = vec![true; mesh.positions.len()];
        let before = sides(&mesh);
        let (params, labels) = (at_level(level), planes(|p| cylinder(p) < 0.0));
        let request =
            &mut FitRequest { mesh: &mut mesh, free: &free, frames: &frames, labels: &labels, params: &params };
        let report = fit_surfaces(request).expect("a valid request");
        assert!(report.distance_before > 0.5, "level {level}: {report:?}");
        assert!(report.distance_after < 0.5 * report.distance_before, "level {level}: {report:?}");
        validate(&mesh).expect("still a tiling");
        assert_eq!(before, sides(&mesh));
        // The report measures distance to points; the cylinder itself is nearer too.
        let refined = subdivide(&mesh, level);
        let mut shared: Vec<(u32, Label)> = refined.nodes.iter().map(|n| (n.point, n.label)).collect();
        shared.sort_unstable();
        let distances = shared.windows(2).filter(|pair| pair[0].0 == pair[1].0).map(|pair| {
            let unit = (8 << crate::render::FINE_BITS) as f32;
            cylinder(refined.points[pair[0].0 as usize].as_vec3() / unit).powi(2)
        });
        let distances: Vec<f32> = distances.collect();
        let rms = (distances.iter().sum::<f32>() / distances.len() as f32).sqrt();
        assert!(rms < 0.5 * report.distance_before as f32, "level {level}: {rms} px from the cylinder");
    }
}

#[test]
fn pins_leave_no_fold() {
    // As far from a lattice as positive tets allow: random steps of two thirds of a cell, where the guard lets them.
    let mut mesh = lattice([8, 7, 5], 0.0, |p| u32::from(p.x + p.y > 40.0));
    let guard = Guard::new(&mesh, 1.0);
    for round in 0..3 {
        let wish =
            |v: usize| Vec3::from([37, 71, 113].map(|prime| (((v + 9) * prime + round * 17) % 65) as f32 - 32.0));
        let steps: Vec<Vec3> = (0..mesh.positions.len()).map(wish).collect();
        assert!(guard.move_all(&mut mesh, &steps) > 0, "some steps should be refused");
        validate(&mesh).expect("still a tiling");
    }
    let folds = folded_children(&mesh, 1) + folded_children(&mesh, 2);
    assert!(folds > 0, "the lattice should fold for this test to say anything");
    let none = pin_folds(&mut mesh.clone(), &vec![false; mesh.positions.len()]);
    assert_eq!(none.pinned_vertices, 0);
    let free = vec![true; mesh.positions.len()];
    let report = pin_folds(&mut mesh, &free);
    assert!(report.folded_tets > 0 && report.pinned_vertices > 0 && report.left_folded == 0, "{report:?}");
    assert_eq!(report.pinned_vertices as usize, mesh.pinned.iter().filter(|&&p| p).count());
    assert!(mesh.pinned.iter().any(|&p| !p), "pinning everything is no art");
    assert_eq!((folded_children(&mesh, 1), folded_children(&mesh, 2)), (0, 0));
}

#[cfg(feature = "threads")]
#[test]
fn threads_do_not_show() {
    let frames = film(ridge);
    let fitted = |threads: usize| {
        let mut mesh = lattice([9, 7, 5], 0.2, |p| u32::from(p.x > 20.0));
        let params = FitParams { position_iterations: 3, ..at_level(1) };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        let report = pool.install(|| run(&mut mesh, &frames, &params, fit));
        (mesh, report)
    };
    let one = fitted(1);
    assert_eq!(one, fitted(2));
    assert_eq!(one, fitted(5));
}

#[test]
fn nothing_to_see_gives_nothing_odd() {
    let domain = Domain { width: SIZE.0, height: SIZE.1, duration: SIZE.2, subpixel_bits: 3 };
    let frames = film(linear);
    let mut empty = TetMesh::empty(domain);
    let report = run(&mut empty, &frames, &at_level(1), fit);
    assert_eq!((report.pixels, report.rms_after), (0, 0.0));

    let mut tet = TetMesh::empty(domain);
    let corners = [[80, 80, 17], [82, 80, 17], [80, 82, 17], [80, 80, 19]].map(|p| {
        let vertex = tet.push_vertex(IVec3::from_array(p));
        tet.push_wedge(Wedge { vertex, label: Label(3), color: Vec3::splat(9.0) })
    });
    tet.tets.push(corners);
    let lone = tet.clone();
    let report = run(&mut tet, &frames, &at_level(1), fit);
    assert_eq!(report.pixels, 0, "it lies between frames and pixel centres");
    assert_eq!(tet, lone);

    let mut mesh = lattice([4, 3, 2], 0.2, one_label);
    let unseen = mesh.clone();
    run(&mut mesh, &Volume::new(0), &at_level(1), fit_positions);
    assert_eq!(mesh, unseen);
    let mut dense = lattice([32, 24, 16], 0.1, one_label);
    run(&mut dense, &frames, &FitParams { position_iterations: 2, ..at_level(1) }, fit);
    assert!(dense.wedges.iter().all(|w| w.color.is_finite()));
    validate(&dense).expect("still a tiling");
}

#[test]
fn requests_that_do_not_fit_are_refused() {
    let frames = film(linear);
    let mut mesh = lattice([2, 2, 2], 0.0, one_label);
    let free = vec![true; mesh.positions.len()];
    let mut refused = |free: &[bool], frames: &Volume, params: &FitParams| {
        let labels = [];
        fit(&mut FitRequest { mesh: &mut mesh, free, frames, labels: &labels, params }).map_err(|e| match e {
            FitError::Field { field, .. } => field,
        })
    };
    let params = FitParams::default();
    assert_eq!(refused(&free[1..], &frames, &params), Err("free"));
    assert_eq!(
        refused(&free, &frames, &FitParams { subdivision_levels: 3, ..params.clone() }),
        Err("subdivision_levels")
    );
    assert_eq!(refused(&free, &frames, &FitParams { max_step_px: f32::NAN, ..params.clone() }), Err("max_step_px"));
    let mut odd = Volume::new(0);
    odd.push(Arc::new(Frame::from_fn(4, 4, |_, _| [0; 3]).expect("a valid size")));
    assert_eq!(refused(&free, &odd, &params), Err("frame size"));
}

/// A dark disc that moves over a bright ramp, with blended pixels at its border.
fn disc(p: Vec3) -> Vec3 {
    let ground = Vec3::new(180.0 + p.x, 200.0, 90.0 + 2.0 * p.y);
    let mut covered = 0.0;
    for n in 0..64 {
        let sub = Vec3::new((n % 8) as f32 - 3.5, (n / 8) as f32 - 3.5, 0.0) / 8.0;
        let centre = Vec3::new(16.0 + 1.1 * p.t(), 15.0 + 0.3 * p.t(), p.t());
        covered += f32::from((p + sub - centre).length() < 9.0) / 64.0;
    }
    ground.lerp(Vec3::new(20.0, 40.0, 30.0), covered)
}

fn in_disc(p: Vec3) -> u32 {
    u32::from((p - Vec3::new(16.0 + 1.1 * p.t(), 15.0 + 0.3 * p.t(), p.t())).length() < 9.0)
}

#[test]
fn the_error_answers_to_moves_as_the_equations_say() {
    let mesh = lattice([10, 8, 4], 0.2, in_disc);
    let frames = film(disc);
    for levels in [0, 1] {
        // The equations take gradients, and which pixels a boundary passes, for given when a vertex moves; a pixel that
        // one begins to pass loses its quarters.
        let params = FitParams { color_iterations: 60, gradient_weight: 0.0, quarter_weight: 0.0, ..at_level(levels) };
        let free = vec![true; mesh.positions.len()];
        let patch = Patch::around(&mesh, &free, RINGS);
        let model = Model::new(&patch.mesh, &patch.free, levels);
        let mut colors = Colors::new(patch.mesh.wedges.iter().map(|w| w.color).collect(), &patch.free_wedges());
        let gather = |mesh: &TetMesh, colors: &Colors| {
            let points = model.points(&mesh.positions);
            Evidence::default().gather(&model, (&points, &model.node_colors(&colors.now)), &frames, params.beside())
        };
        let evidence = gather(&patch.mesh, &colors);
        colors.optimize(&model, &evidence, params.color_iterations, &params);
        let (mut dot, mut norms) = (0.0, [0.0, 0.0]);
        let points = model.points(&patch.mesh.positions);
        let nodes = model.node_colors(&colors.now);
        let mask = vec![Vec3::ONE; colors.now.len() + patch.mesh.positions.len()];
        let damping = normal::PositionDamping { relative: vec![0.0; patch.mesh.positions.len()], absolute: 0.0 };
        let anchors = vec![0.0; colors.now.len()];
        let system = normal::NormalEquations::of_colors_and_positions(
            (&model, &evidence),
            (&points, &nodes),
            mask,
            anchors,
            &damping,
        );
        let descent = system.right_hand_side(&nodes, |_| Vec3::ZERO).split_off(colors.now.len());
        for vertex in (0..patch.mesh.positions.len()).filter(|&v| patch.boundary[v]) {
            for axis in (0..3).filter(|&axis| patch.movable_components(vertex)[axis] != 0.0) {
                let error = |step: i32| {
                    let mut moved = patch.mesh.clone();
                    moved.positions[vertex][axis] += step;
                    gather(&moved, &colors).squared_error(&model, &colors.now)
                };
                // One lattice unit either way: a quarter of a pixel.
                let found = (error(-1) - error(1)) / 0.25;
                let told = 2.0 * f64::from(descent[vertex][axis]);
                dot += found * told;
                norms[0] += found * found;
                norms[1] += told * told;
            }
        }
        let cosine = dot / (norms[0] * norms[1]).sqrt();
        assert!(cosine > 0.98, "level {levels}: {cosine}");
        let ratio = (norms[1] / norms[0]).sqrt();
        assert!((0.95..1.05).contains(&ratio), "level {levels}: {ratio}");
    }
}
