//! Subdivision: masks where their values are known by hand, and what must hold for any mesh.

use std::collections::BTreeMap;

use glam::{IVec3, Vec3};
use tetvec::mesh::{TetMesh, validate};
use tetvec::render::{FINE_BITS, Refined, color_masks, position_masks, subdivide};

use crate::meshes::Lattice;

/// Meshes of all kinds: one label, smooth regions, labels at random.
pub(crate) fn zoo() -> Vec<(&'static str, TetMesh)> {
    let small = Lattice::new([23, 17, 5], [4, 3, 2]);
    let wide = Lattice::new([40, 30, 6], [7, 6, 3]);
    let mut pinned = wide.disc(4);
    pinned.pinned.iter_mut().step_by(3).for_each(|pin| *pin = true);
    vec![
        ("plain", wide.plain(1)),
        ("disc", wide.disc(2)),
        ("wild", small.wild(3, 3)),
        ("two labels at random", wide.wild(5, 2)),
        ("pinned", pinned),
        ("one cell", Lattice::new([8, 8, 1], [1, 1, 1]).plain(6)),
    ]
}

#[test]
fn zoo_is_valid() {
    for (name, mesh) in zoo() {
        assert_eq!(validate(&mesh), Ok(()), "{name}");
    }
}

#[test]
fn level_zero_is_the_mesh() {
    for (_, mesh) in zoo() {
        let refined = subdivide(&mesh, 0);
        assert!(refined.points.iter().zip(&mesh.positions).all(|(fine, p)| *fine == *p << FINE_BITS as i32));
        assert!(refined.tets.iter().zip(&mesh.tets).all(|(fine, tet)| *fine == tet.map(|w| w.0)));
        assert_eq!((refined.points.len(), refined.tets.len()), (mesh.positions.len(), mesh.tets.len()));
    }
}

/// Faces meet in pairs or lie on the box, and signed volumes add up to it: no crack, and nothing left the box.
#[test]
fn every_level_covers_the_box_exactly_once() {
    for (name, mesh) in zoo() {
        let unit = i128::from(mesh.domain.volume6());
        for levels in 0..=2 {
            let refined = subdivide(&mesh, levels);
            assert_eq!(refined.tets.len(), mesh.tets.len() << (3 * levels));
            let total: i128 = (0..refined.tets.len()).map(|tet| refined.volume6(tet)).sum();
            assert_eq!(total, unit << (3 * FINE_BITS), "{name}, level {levels}");
            assert_faces_pair(&refined, mesh.domain.extent() << FINE_BITS as i32, name);
        }
    }
}

fn assert_faces_pair(refined: &Refined, extent: IVec3, name: &str) {
    let mut faces: BTreeMap<[u32; 3], i32> = BTreeMap::new();
    for tet in &refined.tets {
        let points = tet.map(|node| refined.nodes[node as usize].point);
        for [i, j, k] in [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]] {
            let mut face = [points[i], points[j], points[k]];
            face.sort_unstable();
            *faces.entry(face).or_default() += 1;
        }
    }
    for (face, count) in faces {
        let [a, b, c] = face.map(|p| refined.points[p as usize]);
        let on_side = (0..3).any(|i| a[i] == b[i] && b[i] == c[i] && (a[i] == 0 || a[i] == extent[i]));
        assert!(count == 2 || (count == 1 && on_side), "{name}: face {face:?} has {count} tets, side {on_side}");
    }
}

#[test]
fn nodes_of_one_tet_share_its_label_and_keep_their_parents() {
    for (name, mesh) in zoo() {
        for levels in 1..=2 {
            let refined = subdivide(&mesh, levels);
            for (i, tet) in refined.tets.iter().enumerate() {
                let parent = mesh.tet_label(i >> (3 * levels));
                assert!(tet.iter().all(|&node| refined.nodes[node as usize].label == parent), "{name}, tet {i}");
            }
        }
    }
}

#[test]
fn pinned_mesh_splits_linearly() {
    let mut mesh = Lattice::new([23, 17, 5], [4, 3, 2]).wild(9, 2);
    mesh.pinned.fill(true);
    for levels in 1..=2u32 {
        let refined = subdivide(&mesh, levels as u8);
        let coarse = subdivide(&mesh, 0);
        for tet in 0..refined.tets.len() {
            assert_eq!(refined.volume6(tet) << (3 * levels), coarse.volume6(tet >> (3 * levels)), "tet {tet}");
        }
    }
}

#[test]
fn position_masks_give_the_points() {
    for (name, mesh) in zoo() {
        for levels in 0..=2 {
            let refined = subdivide(&mesh, levels);
            let masks = position_masks(&mesh, levels);
            let control: Vec<Vec3> = mesh.positions.iter().map(|p| (*p << FINE_BITS as i32).as_vec3()).collect();
            let fine = masks.apply(&control);
            assert_eq!(fine.len(), refined.points.len());
            for (masked, point) in fine.iter().zip(&refined.points) {
                let off = (*masked - point.as_vec3()).abs().max_element();
                assert!(off <= 1.25, "{name}, level {levels}: {masked} against {point}");
            }
        }
    }
}

#[test]
fn color_masks_keep_constants_and_labels_apart() {
    for (name, mesh) in zoo() {
        let refined = subdivide(&mesh, 2);
        let masks = color_masks(&mesh, 2);
        assert_eq!(masks.rows(), refined.nodes.len());
        for (row, node) in refined.nodes.iter().enumerate() {
            let sum: f32 = masks.row(row).map(|(_, weight)| weight).sum();
            assert!((sum - 1.0).abs() < 1e-5, "{name}: weights of {row} add up to {sum}");
            let strange = masks.row(row).any(|(wedge, _)| mesh.wedges[wedge as usize].label != node.label);
            assert!(!strange, "{name}: a colour of another label reaches {row}");
        }
    }
}

#[test]
fn transpose_is_the_adjoint() {
    let mesh = Lattice::new([23, 17, 5], [4, 3, 2]).wild(3, 3);
    let masks = color_masks(&mesh, 2);
    let control: Vec<f32> = (0..masks.sources).map(|i| (i as f32 * 0.7).sin()).collect();
    let fine: Vec<f32> = (0..masks.rows()).map(|i| (i as f32 * 0.3).cos()).collect();
    let dot = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(x, y)| f64::from(*x) * f64::from(*y)).sum::<f64>();
    let (there, back) = (dot(&masks.apply(&control), &fine), dot(&control, &masks.apply_transpose(&fine)));
    assert!((there - back).abs() < 1e-3 * there.abs().max(1.0), "{there} against {back}");
}

/// A lattice of cubes with one vertex moved; what the masks make of the move is known by hand.
fn moved(label: impl FnMut(usize, IVec3) -> u32, vertex: u32, by: IVec3) -> (Refined, Refined) {
    let lattice = Lattice::new([16, 16, 16], [4, 4, 4]);
    let mesh = lattice.mesh(lattice.positions(), label, |_, _| Vec3::ZERO);
    let mut after = mesh.clone();
    after.positions[vertex as usize] += by;
    (subdivide(&mesh, 1), subdivide(&after, 1))
}

#[test]
fn interior_masks_have_the_papers_weights() {
    let (center, by) = (62, IVec3::new(4, 8, 12));
    let (before, after) = moved(|_, _| 0, center, by);
    let fine = by << FINE_BITS as i32;
    let shift = |point: usize| after.points[point] - before.points[point];
    assert_eq!(shift(center as usize), fine * 18 / 32, "vertex point");
    // The neighbour at +x has 14 neighbours too; the moved vertex is one of them.
    assert_eq!(shift(center as usize + 1), fine / 32, "neighbour's vertex point");
    // Edge (center, +x): 10/32 of an end's move.
    let point = edge_point(&before, [center, center + 1]);
    assert_eq!(shift(point), fine * 10 / 32, "edge point");
    // In the ring of edge (+x, +x+y), which has 4 tets or 6: 12 / 32k.
    let point = edge_point(&before, [center + 1, center + 1 + 5]);
    let k = ring_size(&before, center + 1, center + 6);
    let off = (shift(point) - fine * 12 / (32 * k)).abs().max_element();
    assert!(off <= 1, "edge point with the moved vertex in its ring: k = {k}, off by {off}");
}

#[test]
fn surface_masks_are_loops() {
    let (center, by) = (62, IVec3::new(0, 8, 16));
    let halves = |_, corner: IVec3| u32::from(corner.x >= 64);
    let (before, after) = moved(halves, center, by);
    let fine = by << FINE_BITS as i32;
    let shift = |point: usize| after.points[point] - before.points[point];
    assert_eq!(shift(center as usize), fine * 5 / 8, "vertex point");
    assert_eq!(shift(center as usize + 5), fine / 16, "neighbour on the surface, valence 6");
    let point = edge_point(&before, [center, center + 5]);
    assert_eq!(shift(point), fine * 3 / 8, "edge point");
    // Faces (center, +y, +y+t) and (+y, +y+t, 2y+t) meet in edge (+y, +y+t).
    let point = edge_point(&before, [center + 5, center + 30]);
    assert_eq!(shift(point), fine / 8, "edge point opposite the moved vertex");
    // The surface moves without the interior: its neighbour off the surface counts for nothing.
    let (_, off_surface) = moved(halves, center + 1, by);
    assert_eq!(off_surface.points[center as usize], before.points[center as usize]);
}

/// The fine point on a control edge, found by its place in the unmoved lattice.
fn edge_point(refined: &Refined, [a, b]: [u32; 2]) -> usize {
    let position = |v: u32| IVec3::new((v % 5) as i32, (v / 5 % 5) as i32, (v / 25) as i32) * (32 << FINE_BITS);
    let middle = (position(a) + position(b)) / 2;
    refined.points.iter().position(|p| *p == middle).expect("a point halfway")
}

fn ring_size(refined: &Refined, a: u32, b: u32) -> i32 {
    let middle = edge_point(refined, [a, b]) as u32;
    let touches = |tet: &&[u32; 4]| {
        let points = tet.map(|node| refined.nodes[node as usize].point);
        points.contains(&middle) && points.contains(&a)
    };
    refined.tets.iter().filter(touches).count() as i32
}

#[test]
fn parts_of_a_mesh_do_not_panic() {
    for (_, mut mesh) in zoo() {
        for keep in [mesh.tets.len() * 2 / 3, mesh.tets.len() / 3, 1, 0] {
            mesh.tets.truncate(keep);
            let refined = subdivide(&mesh, 2);
            assert_eq!(refined.tets.len(), 64 * keep);
        }
    }
}

/// What lies far from the rim of a part is refined as in the whole.
#[test]
fn parts_of_a_mesh_agree_with_the_whole_inside() {
    let mesh = Lattice::new([40, 30, 12], [7, 6, 6]).disc(8);
    let mut part = mesh.clone();
    part.tets.truncate(mesh.tets.len() * 2 / 3);
    let (whole, part) = (subdivide(&mesh, 2), subdivide(&part, 2));
    // Cells come in layers of t: two of them away from the rim all stars within two rings are complete.
    for tet in 0..64 * mesh.tets.len() / 3 {
        assert_eq!(whole.tet_positions(tet), part.tet_positions(tet), "tet {tet}");
    }
}
