//! Cleaving of random label volumes: a tiling of the box, one label a tet, colours from the right pixels, runs of
//! frames that fit each other.
#![cfg(feature = "encode")]

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use glam::{IVec3, Vec3};
use proptest::prelude::*;
use tetvec::Frame;
use tetvec::mesh::{Domain, FACES, TetMesh, VertexId, Wedge, WedgeId, validate, volume6};
use tetvec::vectorize::cleave::cleave;
use tetvec::vectorize::lattice::Lattice;
use tetvec::video::{Label, LabelPlane};

/// A slab in which every pixel has a colour of its own: its coordinates.
#[derive(Debug, Clone)]
struct Clip {
    domain: Domain,
    frames: Vec<Arc<Frame>>,
    labels: Vec<LabelPlane>,
}

impl Clip {
    fn new([width, height, planes]: [u32; 3], subpixel_bits: u8, labels: &[u32]) -> Self {
        let frame = |t: u32| Arc::new(Frame::from_fn(width, height, |x, y| [x as u8, y as u8, t as u8]).unwrap());
        let plane = |labels: &[u32]| LabelPlane::new(width, height, labels.iter().map(|&l| Label(l)).collect());
        Self {
            domain: Domain { width, height, duration: planes - 1, subpixel_bits },
            frames: (0..planes).map(frame).collect(),
            labels: labels.chunks((width * height) as usize).map(plane).collect(),
        }
    }

    /// A slab whose labels come from hashing the coordinates; more than half of the pixels have the last one.
    fn scattered(size: [u32; 3], label_count: u32) -> Self {
        let hash = |n: u32| (n.wrapping_mul(0x9E37_79B9) >> 13).wrapping_mul(0x85EB_CA6B) >> 16;
        let labels: Vec<u32> =
            (0..size.iter().product()).map(|n| (hash(n) % (2 * label_count)).min(label_count - 1)).collect();
        Self::new(size, 3, &labels)
    }

    fn cleave(&self, first: usize, last: usize) -> TetMesh {
        let (frames, labels) = (&self.frames[first..=last], &self.labels[first..=last]);
        cleave(&Lattice::try_new(self.domain, first as u32, frames, labels).unwrap()).unwrap()
    }

    fn cleave_all(&self) -> TetMesh {
        self.cleave(0, self.labels.len() - 1)
    }

    /// Lattice tets, found without the code under test: positions and labels of the corners.
    fn lattice_tets(&self) -> Vec<[(IVec3, Label); 4]> {
        let steps = [IVec3::X, IVec3::Y, IVec3::Z];
        let orders = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
        let end =
            IVec3::new(self.domain.width.max(2) as i32, self.domain.height.max(2) as i32, self.labels.len() as i32);
        let mut tets = Vec::new();
        for (x, y, t) in box_cells(end - 1) {
            for order in orders {
                let mut at = IVec3::new(x, y, t);
                let mut corner = |step: IVec3| {
                    at += step;
                    self.lattice_vertex(at, end)
                };
                tets.push([IVec3::ZERO, steps[order[0]], steps[order[1]], steps[order[2]]].map(&mut corner));
            }
        }
        tets
    }

    fn lattice_vertex(&self, at: IVec3, end: IVec3) -> (IVec3, Label) {
        let (unit, extent) = (self.domain.unit(), self.domain.extent());
        let place = |at: i32, end: i32, extent: i32| match at {
            0 => 0,
            _ if at == end - 1 => extent,
            _ => at * unit + unit / 2,
        };
        let position = IVec3::new(place(at.x, end.x, extent.x), place(at.y, end.y, extent.y), at.z * unit);
        let (x, y) = ((at.x as u32).min(self.domain.width - 1), (at.y as u32).min(self.domain.height - 1));
        (position, self.labels[at.z as usize].label(x, y))
    }
}

fn box_cells(end: IVec3) -> impl Iterator<Item = (i32, i32, i32)> {
    (0..end.z).flat_map(move |t| (0..end.y).flat_map(move |y| (0..end.x).map(move |x| (x, y, t))))
}

fn clips(planes: std::ops::RangeInclusive<u32>) -> impl Strategy<Value = Clip> {
    let size = [1..=5, 1..=5, planes];
    (size, 2..=6u8, 1..=6u32).prop_flat_map(|(size, bits, label_count)| {
        let labels = prop::collection::vec(0..label_count, size.iter().product::<u32>() as usize);
        labels.prop_map(move |labels| Clip::new(size, bits, &labels))
    })
}

/// How often each label occurs among four corners.
fn corners_by_label(tet: &[(IVec3, Label); 4]) -> BTreeMap<Label, i64> {
    let mut counts = BTreeMap::new();
    for (_, label) in tet {
        *counts.entry(*label).or_insert(0) += 1;
    }
    counts
}

/// Position of a vertex as a key.
fn key(position: IVec3) -> [i32; 3] {
    position.into()
}

/// Faces by the positions of their corners, with the tets there and on which side of the face they lie.
fn faces(mesh: &TetMesh) -> BTreeMap<[[i32; 3]; 3], Vec<(usize, bool)>> {
    let mut faces: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for tet in 0..mesh.tets.len() {
        let corners = mesh.tet_positions(tet);
        for (opposite, face) in FACES.iter().enumerate() {
            let mut face = face.map(|corner| key(corners[corner]));
            face.sort_unstable();
            let [a, b, c] = face.map(IVec3::from_array);
            faces.entry(face).or_default().push((tet, volume6(a, b, c, corners[opposite]) > 0));
        }
    }
    faces
}

/// Every face has one tet on each side of it, or lies on the box and has one; the whole is a ball.
fn check_conformity(mesh: &TetMesh) -> Result<(), TestCaseError> {
    let positions: BTreeSet<_> = mesh.positions.iter().map(|&p| key(p)).collect();
    prop_assert_eq!(positions.len(), mesh.positions.len(), "one vertex a position");
    let extent = mesh.domain.extent();
    let faces = faces(mesh);
    let mut edges = BTreeSet::new();
    for (face, tets) in &faces {
        let outer = (0..3).any(|axis| [0, extent[axis]].iter().any(|&side| face.iter().all(|p| p[axis] == side)));
        match tets[..] {
            [_] => prop_assert!(outer, "{:?} is open", face),
            [(_, left), (_, right)] => prop_assert!(!outer && left != right, "{:?} is folded", face),
            _ => prop_assert!(false, "{:?} has {} tets", face, tets.len()),
        }
        edges.extend([[face[0], face[1]], [face[0], face[2]], [face[1], face[2]]]);
    }
    let euler = positions.len() + faces.len() - edges.len() - mesh.tets.len();
    prop_assert_eq!(euler, 1, "Euler characteristic of a ball");
    Ok(())
}

/// The surface around each label has no rim: every edge has an even number of its faces.
fn check_labels_closed(mesh: &TetMesh) -> Result<(), TestCaseError> {
    let mut edges: BTreeMap<_, u32> = BTreeMap::new();
    for (face, tets) in faces(mesh) {
        for &(tet, _) in &tets {
            let label = mesh.tet_label(tet);
            if tets.iter().any(|&(other, _)| other != tet && mesh.tet_label(other) == label) {
                continue;
            }
            for edge in [[face[0], face[1]], [face[0], face[2]], [face[1], face[2]]] {
                *edges.entry((label, edge)).or_default() += 1;
            }
        }
    }
    for (edge, count) in edges {
        prop_assert!(count.is_multiple_of(2), "{:?} has {} faces", edge, count);
    }
    Ok(())
}

/// A label has 1/8 of the lattice tet at a lone corner and half of it at two of four; with three labels or more, where
/// points are rounded, at least an eighth a corner.
fn check_volumes(clip: &Clip, mesh: &TetMesh) -> Result<(), TestCaseError> {
    let mut bounds: BTreeMap<Label, (i64, i64)> = BTreeMap::new();
    for tet in clip.lattice_tets() {
        let [a, b, c, d] = tet.map(|(position, _)| position);
        let volume = volume6(a, b, c, d).abs();
        let labels = corners_by_label(&tet);
        for (&label, &corners) in &labels {
            let eighths = match (labels.len(), corners) {
                (1, _) => (8, 8),
                (2, 1) => (1, 1),
                (2, 2) => (4, 4),
                (2, _) => (7, 7),
                _ => (corners, 4 + corners),
            };
            let bound = bounds.entry(label).or_default();
            *bound = (bound.0 + volume * eighths.0, bound.1 + volume * eighths.1);
        }
    }
    let mut found: BTreeMap<Label, i64> = BTreeMap::new();
    for tet in 0..mesh.tets.len() {
        let [a, b, c, d] = mesh.tet_positions(tet);
        *found.entry(mesh.tet_label(tet)).or_default() += volume6(a, b, c, d);
    }
    prop_assert!(found.keys().eq(bounds.keys()));
    for (label, volume) in found {
        let (low, high) = bounds[&label];
        prop_assert!((low..=high).contains(&(8 * volume)), "{:?}: {} not in {}..={}", label, 8 * volume, low, high);
    }
    Ok(())
}

/// Wedges are all used, differ in label at a vertex, and have the label and colour of a pixel less than a cell away.
fn check_wedges(clip: &Clip, mesh: &TetMesh) -> Result<(), TestCaseError> {
    let used: BTreeSet<_> = mesh.tets.iter().flatten().collect();
    prop_assert_eq!(used.len(), mesh.wedges.len());
    let mut by_vertex: BTreeMap<VertexId, Vec<&Wedge>> = BTreeMap::new();
    for wedge in &mesh.wedges {
        by_vertex.entry(wedge.vertex).or_default().push(wedge);
    }
    prop_assert_eq!(by_vertex.len(), mesh.positions.len());
    let unit = clip.domain.unit();
    for (vertex, wedges) in by_vertex {
        let labels: BTreeSet<Label> = wedges.iter().map(|wedge| wedge.label).collect();
        prop_assert_eq!(labels.len(), wedges.len());
        let position = mesh.positions[vertex.index()];
        for wedge in &wedges {
            let [x, y, t] = wedge.color.to_array().map(|level| level as u32);
            prop_assert_eq!(clip.labels[t as usize].label(x, y), wedge.label);
            // The farthest sample that a point inside a cell can have: a border cell is a unit and a half wide.
            let sample = (wedge.color + Vec3::new(0.5, 0.5, 0.0)) * unit as f32;
            let distance = (sample - position.as_vec3()).abs().max_element();
            prop_assert!(distance < 1.5 * unit as f32, "{:?} at {}", wedge, position);
        }
        if wedges.len() == 1 {
            let pixel =
                (position / unit).min(IVec3::new(clip.domain.width as i32 - 1, clip.domain.height as i32 - 1, 255));
            prop_assert_eq!(pixel.as_vec3(), wedges[0].color);
        }
    }
    Ok(())
}

/// Joins meshes of consecutive runs of frames by the positions on their common plane.
fn glue(low: &TetMesh, high: &TetMesh, plane: i32) -> Result<TetMesh, TestCaseError> {
    let t = plane * low.domain.unit();
    let mut mesh = low.clone();
    let mut shared = BTreeMap::new();
    for wedge in (0..low.wedges.len()).filter(|&wedge| low.positions[low.wedges[wedge].vertex.index()].z == t) {
        let Wedge { vertex, label, .. } = low.wedges[wedge];
        shared.insert((key(low.positions[vertex.index()]), label), (wedge, vertex));
    }
    let mut vertices: BTreeMap<VertexId, VertexId> = BTreeMap::new();
    let mut renumbered = Vec::new();
    for wedge in &high.wedges {
        let position = high.positions[wedge.vertex.index()];
        if position.z == t {
            let found = shared.remove(&(key(position), wedge.label));
            prop_assert!(found.is_some(), "{:?} is only above the plane", wedge);
            let (id, vertex) = found.unwrap();
            prop_assert_eq!(mesh.wedges[id].color, wedge.color);
            vertices.insert(wedge.vertex, vertex);
            renumbered.push(WedgeId(id as u32));
        } else {
            let vertex = *vertices.entry(wedge.vertex).or_insert_with(|| mesh.push_vertex(position));
            renumbered.push(mesh.push_wedge(Wedge { vertex, ..*wedge }));
        }
    }
    prop_assert!(shared.is_empty(), "only below the plane: {:?}", shared);
    mesh.tets.extend(high.tets.iter().map(|tet| tet.map(|wedge| renumbered[wedge.index()])));
    Ok(mesh)
}

/// Tets by position and label, for comparison up to numbering.
fn geometry(mesh: &TetMesh) -> BTreeSet<([[i32; 3]; 4], Label)> {
    let tet = |tet: usize| {
        let mut corners = mesh.tet_positions(tet).map(key);
        corners.sort_unstable();
        (corners, mesh.tet_label(tet))
    };
    (0..mesh.tets.len()).map(tet).collect()
}

proptest! {
    #[test]
    fn labels_tile_the_box(clip in clips(2..=5)) {
        let mesh = clip.cleave_all();
        prop_assert_eq!(validate(&mesh), Ok(()));
        check_conformity(&mesh)?;
        check_labels_closed(&mesh)?;
        check_volumes(&clip, &mesh)?;
        check_wedges(&clip, &mesh)?;
    }

    #[test]
    fn runs_of_frames_fit_each_other(clip in clips(3..=5), pick: prop::sample::Index) {
        let last = clip.labels.len() - 1;
        let cut = 1 + pick.index(last - 1);
        let glued = glue(&clip.cleave(0, cut), &clip.cleave(cut, last), cut as i32)?;
        prop_assert_eq!(validate(&glued), Ok(()));
        prop_assert_eq!(geometry(&glued), geometry(&clip.cleave_all()));
    }
}

#[test]
fn all_five_patterns_occur_and_have_their_number_of_tets() {
    let clip = Clip::scattered([7, 6, 5], 5);
    let mut patterns: BTreeMap<Vec<i64>, usize> = BTreeMap::new();
    for tet in clip.lattice_tets() {
        let mut pattern: Vec<i64> = corners_by_label(&tet).into_values().collect();
        pattern.sort_unstable();
        *patterns.entry(pattern).or_default() += 1;
    }
    let stencils = [(vec![4], 1), (vec![1, 3], 4), (vec![2, 2], 6), (vec![1, 1, 2], 12), (vec![1, 1, 1, 1], 24)];
    assert!(patterns.keys().eq(stencils.iter().map(|(pattern, _)| pattern).collect::<BTreeSet<_>>()), "{patterns:?}");
    let expected: usize = stencils.iter().map(|(pattern, tets)| patterns[pattern] * tets).sum();
    assert_eq!(clip.cleave_all().tets.len(), expected);
}

#[test]
fn a_single_pixel_is_six_tets() {
    let mesh = Clip::new([1, 1, 2], 2, &[3, 3]).cleave_all();
    assert_eq!((mesh.positions.len(), mesh.wedges.len(), mesh.tets.len()), (8, 8, 6));
    assert_eq!(validate(&mesh), Ok(()));
    assert!(mesh.wedges.iter().all(|wedge| wedge.label == Label(3)));
}

#[test]
fn ids_ascend_with_the_owning_lattice_vertex() {
    let mesh = Clip::scattered([5, 4, 3], 1).cleave_all();
    let order: Vec<_> = mesh.positions.iter().map(|p| (p.z, p.y, p.x)).collect();
    assert!(order.is_sorted());
}

#[cfg(feature = "threads")]
#[test]
fn any_number_of_threads_gives_the_same_mesh() {
    let clip = Clip::scattered([40, 30, 4], 4);
    let cleave_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| clip.cleave_all())
    };
    assert_eq!(cleave_with(1), cleave_with(3));
}
