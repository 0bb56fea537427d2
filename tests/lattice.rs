//! The adaptive lattice: layers of any size tile the box with their labels, vertices are where something is to be seen.
#![cfg(feature = "encode")]

use std::sync::Arc;

use proptest::prelude::{ProptestConfig, any, prop, prop_assert_eq, proptest};
use tetvec::Frame;
use tetvec::mesh::{Domain, TetMesh, validate, volume6};
use tetvec::vectorize::cleave::cleave_tets;
use tetvec::vectorize::lattice::{AdaptiveLattice, LatticeError, TetLattice};
use tetvec::vectorize::simplify::{ColorQuadric, SimplifyParams, WorkMesh};
use tetvec::video::{Label, LabelPlane};

struct Clip {
    domain: Domain,
    frames: Vec<Arc<Frame>>,
    labels: Vec<LabelPlane>,
}

impl Clip {
    fn new(
        [width, height, planes]: [u32; 3],
        color: impl Fn(u32, u32, u32) -> [u8; 3],
        label: impl Fn(u32, u32, u32) -> u32,
    ) -> Self {
        let plane = |t| {
            let labels = (0..width * height).map(|n| Label(label(n % width, n / width, t))).collect();
            LabelPlane::new(width, height, labels)
        };
        Self {
            domain: Domain { width, height, duration: planes - 1, subpixel_bits: 3 },
            frames: (0..planes)
                .map(|t| Arc::new(Frame::from_fn(width, height, |x, y| color(x, y, t)).unwrap()))
                .collect(),
            labels: (0..planes).map(plane).collect(),
        }
    }

    /// Lattices of layers of these numbers of steps.
    fn lattices(&self, layers: &[u32], vertices_per_pixel: f64) -> Vec<TetLattice> {
        self.lattices_of(layers, AdaptiveLattice::new(self.domain, vertices_per_pixel))
    }

    fn lattices_of(&self, layers: &[u32], mut adaptive: AdaptiveLattice) -> Vec<TetLattice> {
        let mut lattices = Vec::new();
        let mut first = 0;
        for &steps in layers {
            let planes = first as usize..=(first + steps) as usize;
            lattices.extend(adaptive.push(first, &self.frames[planes.clone()], &self.labels[planes]).unwrap());
            first += steps;
        }
        lattices.extend(adaptive.finish());
        assert_eq!(lattices.len(), layers.len());
        lattices
    }

    fn mesh(&self, layers: &[u32], vertices_per_pixel: f64) -> TetMesh {
        let mut work = WorkMesh::<ColorQuadric>::new(self.domain);
        for lattice in self.lattices(layers, vertices_per_pixel) {
            work.append(&cleave_tets(&lattice).unwrap(), &SimplifyParams::default());
        }
        let mut mesh = TetMesh::empty(self.domain);
        work.commit(i32::MAX, &mut mesh);
        mesh
    }
}

fn hash(n: u32) -> u32 {
    let n = n.wrapping_mul(0x9E37_79B9);
    (n ^ (n >> 15)).wrapping_mul(0x85EB_CA6B) >> 13
}

/// A few bright points on black: strong local refinement anywhere.
fn points(seed: u32) -> impl Fn(u32, u32, u32) -> [u8; 3] {
    move |x, y, t| if hash(hash(hash(x ^ seed) ^ y) ^ t).is_multiple_of(97) { [255; 3] } else { [0; 3] }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, ..ProptestConfig::default() })]

    #[test]
    fn layers_tile_the_box(
        size in [1u32..=40, 1u32..=40],
        layers in prop::collection::vec(1u32..=8, 1..=4),
        seed in any::<u32>(),
        vertices_per_pixel in 0.001..0.5,
    ) {
        let planes = layers.iter().sum::<u32>() + 1;
        let clip = Clip::new([size[0], size[1], planes], points(seed), |_, _, _| 3);
        prop_assert_eq!(validate(&clip.mesh(&layers, vertices_per_pixel)), Ok(()));
    }

    #[test]
    fn labels_are_cut_where_they_meet(
        size in [5u32..=24, 5u32..=24],
        layers in prop::collection::vec(5u32..=8, 1..=3),
        seed in any::<u32>(),
        block in 1u32..=9,
    ) {
        let planes = layers.iter().sum::<u32>() + 1;
        let label = |x: u32, y: u32, t: u32| hash(hash(hash((x / block) ^ seed) ^ (y / block)) ^ (t / block)) % 3;
        let clip = Clip::new([size[0], size[1], planes], points(seed), label);
        let mesh = clip.mesh(&layers, 0.02);
        prop_assert_eq!(validate(&mesh), Ok(()));
        // At each pixel's centre lies its own label.
        let unit = mesh.domain.unit();
        let mut wedges = vec![0; mesh.positions.len()];
        mesh.wedges.iter().for_each(|wedge| wedges[wedge.vertex.index()] += 1);
        for tet in 0..mesh.tets.len() {
            for vertex in mesh.tet_vertices(tet).into_iter().filter(|v| wedges[v.index()] == 1) {
                let position = mesh.positions[vertex.index()];
                let on_sample = |n: i32, side: u32| n % unit == unit / 2 && n > unit && n < (side as i32 - 1) * unit;
                if on_sample(position.x, size[0]) && on_sample(position.y, size[1]) && position.z % unit == 0 {
                    let (x, y, t) = (position.x / unit, position.y / unit, position.z / unit);
                    let found = mesh.tet_label(tet);
                    prop_assert_eq!(found, clip.labels[t as usize].label(x as u32, y as u32));
                }
            }
        }
    }
}

#[test]
fn cuts_lie_on_an_edge_that_moves_by_less_than_a_pixel() {
    // Everything left of x = 20.2 + 0.3 y + 0.4 t is bright; pixels are means over their squares.
    let beyond = |x: f32, y: f32, t: f32| x - 20.2 - 0.3 * y - 0.4 * t;
    let part = |x: u32, y: u32, t: u32| {
        let sample = |n: u32| beyond(x as f32 + (n % 16) as f32 / 16.0, y as f32 + (n / 16) as f32 / 16.0, t as f32);
        (0..256).filter(|&n| sample(n) < 0.0).count() as f32 / 256.0
    };
    let level = |x, y, t| [(30.0 + 200.0 * part(x, y, t)) as u8; 3];
    let mut clip = Clip::new([48, 32, 9], level, |x, y, t| u32::from(part(x, y, t) >= 0.5));
    for plane in &mut clip.labels {
        let pure = Frame::from_fn(48, 32, |x, y| [[30, 230][plane.label(x, y).0 as usize]; 3]).unwrap();
        *plane = plane.clone().with_pure_colors(pure);
    }
    let lattice = clip.lattices(&[8], 0.02).remove(0);
    let unit = lattice.domain.unit() as f32;
    let (mut squares, mut count) = (0.0, 0);
    for cut in &lattice.cuts {
        let [a, b] = cut.edge.map(|v| lattice.positions[v as usize].as_vec3() / unit);
        let at = a.lerp(b, cut.share);
        if at.min_element() >= 0.0 && (2.0..46.0).contains(&at.x) && (2.0..30.0).contains(&at.y) {
            squares += beyond(at.x, at.y, at.z).powi(2);
            count += 1;
            assert!(beyond(at.x, at.y, at.z).abs() < 0.45, "{at}");
            assert!(cut.colors.iter().all(|c| (c.x - 30.0).abs() < 1.0 || (c.x - 230.0).abs() < 1.0), "{cut:?}");
        }
    }
    let rms = (squares / count as f32).sqrt();
    assert!(count > 50 && rms < 0.1, "{count} cuts, {rms} px off");
}

#[test]
fn nothing_to_see_needs_only_the_coarsest_cells() {
    let clip = Clip::new([64, 48, 17], |_, _, _| [90, 100, 110], |_, _, _| 0);
    let mesh = clip.mesh(&[8, 8], 0.5);
    assert_eq!(mesh.positions.len(), 9 * 7 * 3);
    assert_eq!(mesh.tets.len(), 8 * 6 * 2 * 6);
}

#[test]
fn vertices_gather_where_colours_change_in_the_number_asked_for() {
    let disc = |x: u32, y: u32, t: u32| {
        let (dx, dy) = (x as f32 - 60.0 - t as f32, y as f32 - 40.0);
        let distance = dx.hypot(dy) - 600f32.sqrt();
        [(120.0 + 80.0 * (distance / 3.0).tanh()) as u8; 3]
    };
    let clip = Clip::new([128, 80, 9], disc, |_, _, _| 0);
    let pixels = 128.0 * 80.0 * 8.0;
    for ratio in [0.02, 0.05, 0.1] {
        let lattice = &clip.lattices(&[8], ratio)[0];
        let found = lattice.positions.len() as f64 / pixels;
        assert!((0.6..1.6).contains(&(found / ratio)), "asked for {ratio}, found {found}");
        let near_edge = |volume: &mut [i64; 2], tet: &[u32; 4]| {
            let p = tet.map(|v| lattice.positions[v as usize]);
            let middle = (p[0] + p[1] + p[2] + p[3]).as_vec3() / 32.0;
            let distance = ((middle.x - 60.0 - middle.z).hypot(middle.y - 40.0) - 600f32.sqrt()).abs();
            volume[usize::from(distance < 4.0)] += volume6(p[0], p[1], p[2], p[3]);
            usize::from(distance < 4.0)
        };
        let (mut volume, mut count) = ([0; 2], [0; 2]);
        lattice.tets.iter().for_each(|tet| count[near_edge(&mut volume, tet)] += 1);
        let mean = |n: usize| volume[n] / count[n].max(1);
        assert!(mean(0) > 5 * mean(1), "{ratio}: tets far from the edge are larger: {} and {}", mean(0), mean(1));
    }
}

#[test]
fn what_stands_still_is_sampled_more_finely_than_what_moves() {
    let texture = |x: u32, y: u32| [(hash(hash(x) ^ y) % 200) as u8 + 20; 3];
    let vertices = |drift: u32, ratio: f64| {
        let clip = Clip::new([64, 64, 17], |x, y, t| texture(x + drift * t, y), |_, _, _| 0);
        let adaptive = AdaptiveLattice::new(clip.domain, ratio).with_repeats(0.25);
        clip.lattices_of(&[8, 8], adaptive).iter().map(|lattice| lattice.positions.len()).sum::<usize>()
    };
    let [still, moving] = [0, 3].map(|drift| vertices(drift, 0.1));
    assert!(still > 2 * moving && still < 6 * moving, "{still} for {moving}");
    let [still, moving] = [0, 3].map(|drift| vertices(drift, 0.6));
    assert!(still < 5 * moving / 4, "there is an end to it: {still} for {moving}");
}

#[test]
fn refuses_layers_that_do_not_fit() {
    let clip = Clip::new([8, 8, 12], |_, _, _| [0; 3], |_, _, _| 0);
    let mut adaptive = AdaptiveLattice::new(clip.domain, 0.1);
    let planes = LatticeError::PlaneCount { frames: 10, labels: 10 };
    assert_eq!(adaptive.push(0, &clip.frames[..10], &clip.labels[..10]).err(), Some(planes));
    let planes = LatticeError::PlaneCount { frames: 1, labels: 1 };
    assert_eq!(adaptive.push(0, &clip.frames[..1], &clip.labels[..1]).err(), Some(planes));
    assert!(adaptive.finish().is_none());
}
