//! Edge collapse: the mesh stays a tiling, colours and surfaces stay where they belong, windows join.
#![cfg(feature = "encode")]

use std::sync::Arc;

use glam::{IVec3, Vec3};
use proptest::prelude::{ProptestConfig, any, prop, proptest};
use tetvec::Frame;
use tetvec::mesh::{Domain, TetMesh, validate, volume6};
use tetvec::vectorize::cleave::cleave;
use tetvec::vectorize::lattice::Lattice;
use tetvec::vectorize::simplify::{
    BlockGoal, ColorQuadric, DistanceQuadric, Goal, Refusal, SimplifyParams, SimplifyReport, Topology, Unfrozen,
    WedgeQuadric, WorkMesh, simplify,
};
use tetvec::video::{Label, LabelPlane};

const ALL: Unfrozen = Unfrozen { low: -1, high: i32::MAX };

fn goal(vertices: usize) -> Goal {
    Goal { vertices, before: i32::MAX, vertices_in_window: usize::MAX, max_cost: f32::MAX, max_error: f32::INFINITY }
}

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
        let frame = |t| Arc::new(Frame::from_fn(width, height, |x, y| color(x, y, t)).unwrap());
        let plane = |t| {
            let labels = (0..width * height).map(|i| Label(label(i % width, i / width, t))).collect();
            LabelPlane::new(width, height, labels)
        };
        Self {
            domain: Domain { width, height, duration: planes - 1, subpixel_bits: 3 },
            frames: (0..planes).map(frame).collect(),
            labels: (0..planes).map(plane).collect(),
        }
    }

    /// The lattice of planes `first` to `last`.
    fn run(&self, first: usize, last: usize) -> TetMesh {
        let lattice =
            Lattice::try_new(self.domain, first as u32, &self.frames[first..=last], &self.labels[first..=last]);
        cleave(&lattice.unwrap()).unwrap()
    }

    fn whole(&self) -> TetMesh {
        self.run(0, self.frames.len() - 1)
    }

    fn simplified<Q: WedgeQuadric>(&self, vertices: usize, params: &SimplifyParams) -> (TetMesh, SimplifyReport) {
        let mut work = WorkMesh::<Q>::new(self.domain);
        work.append(&self.whole(), params);
        let report = simplify(&mut work, ALL, goal(vertices), params);
        let mut mesh = TetMesh::empty(self.domain);
        work.commit(i32::MAX, &mut mesh);
        (mesh, report)
    }
}

fn volume_of_label(mesh: &TetMesh, label: u32) -> i64 {
    let tets = (0..mesh.tets.len()).filter(|&tet| mesh.tet_label(tet) == Label(label));
    tets.map(|tet| mesh.tet_positions(tet)).map(|[a, b, c, d]| volume6(a, b, c, d)).sum()
}

fn textured(x: u32, y: u32, t: u32) -> [u8; 3] {
    [(x * 37 + y * 11 + t * 5) as u8, (x * y * 3 + t * 40) as u8, ((x ^ y ^ t) as u8).wrapping_mul(16)]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, ..ProptestConfig::default() })]

    #[test]
    fn stays_a_tiling(
        size in prop::array::uniform3(2u32..7),
        seed in any::<u32>(),
        labels in 1u32..4,
        share in 0.02f64..0.6,
        topology in prop::sample::select(vec![Topology::Free, Topology::Priced, Topology::Strict]),
        distance in any::<bool>(),
        improve_at in prop::sample::select(vec![0.0f32, 0.7]),
        improve_cost in prop::sample::select(vec![0.1f32, 1e6]),
    ) {
        let noise = |x: u32, y: u32, t: u32| {
            (x ^ y.rotate_left(9) ^ t.rotate_left(18) ^ seed).wrapping_mul(0x9e37_79b1) >> 24
        };
        let clip = Clip::new(size, |x, y, t| [noise(x, y, t) as u8; 3], |x, y, t| noise(x / 2, y / 2, t / 2) % labels);
        let params = SimplifyParams {
            topology,
            improve_at,
            improve_cost,
            ..SimplifyParams::default()
        };
        let start = clip.whole();
        let vertices = (start.positions.len() as f64 * share) as usize;
        let (mesh, report) = if distance {
            clip.simplified::<DistanceQuadric>(vertices, &params)
        } else {
            clip.simplified::<ColorQuadric>(vertices, &params)
        };
        assert_eq!(validate(&mesh), Ok(()));
        assert_eq!(mesh.positions.len() as u64 + report.collapses, start.positions.len() as u64);
        assert_eq!(mesh.positions.len(), report.vertices);
        assert!(mesh.wedges.iter().all(|wedge| wedge.color.is_finite()));
        if topology == Topology::Strict {
            for label in 0..labels {
                let volume = (volume_of_label(&start, label), volume_of_label(&mesh, label));
                assert_eq!(volume.0 > 0, volume.1 > 0, "strict topology loses no label");
            }
        }
    }
}

#[test]
fn a_linear_field_costs_nothing() {
    let clip = Clip::new([12, 10, 8], |x, y, t| [(10 * x + 5) as u8, (20 * y) as u8, (8 * t + x) as u8], |_, _, _| 0);
    let (mesh, report) = clip.simplified::<ColorQuadric>(60, &SimplifyParams::default());
    assert_eq!(validate(&mesh), Ok(()));
    assert!(mesh.positions.len() <= 60, "reaches its goal, found {} ({report:?})", mesh.positions.len());
    for wedge in &mesh.wedges {
        let p = mesh.positions[wedge.vertex.index()];
        // The outermost half pixel repeats the sample at the border's centre instead of going on.
        let inner = |value: i32, size: u32| (value as f32 / 8.0 - 0.5).clamp(0.0, size as f32 - 1.0);
        let (x, y, t) = (inner(p.x, 12), inner(p.y, 10), p.z as f32 / 8.0);
        let expected = Vec3::new(10.0 * x + 5.0, 20.0 * y, 8.0 * t + x);
        assert!((wedge.color - expected).abs().max_element() < 12.0, "{:?} at {p}, expected {expected}", wedge.color);
    }
}

#[test]
fn a_flat_surface_stays_flat() {
    let label = |x: u32, _: u32, _: u32| u32::from(x >= 6);
    let clip = Clip::new([12, 12, 8], |x, _, _| if x >= 6 { [200, 20, 20] } else { [10, 90, 160] }, label);
    let (mesh, _) = clip.simplified::<ColorQuadric>(80, &SimplifyParams::default());
    assert_eq!(validate(&mesh), Ok(()));
    let half = clip.domain.volume6() / 2;
    let drift = (volume_of_label(&mesh, 0) - half).abs();
    assert!(200 * drift < half, "the uniformity term moves surfaces by less than 1/200, found {drift} of {half}");
    let mut colors: Vec<[i32; 3]> = mesh.wedges.iter().map(|w| w.color.round().as_ivec3().to_array()).collect();
    colors.sort_unstable();
    colors.dedup();
    assert_eq!(colors, [[10, 90, 160], [200, 20, 20]], "no colour leaks over the surface");
}

#[test]
fn frozen_vertices_stay() {
    let clip = Clip::new([8, 8, 9], textured, |x, y, _| u32::from(x > y));
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    work.append(&clip.whole(), &SimplifyParams { surface_weight: 100.0, ..SimplifyParams::default() });
    let unfrozen = Unfrozen { low: 2 * 8, high: 6 * 8 };
    let params = SimplifyParams { improve_at: 0.8, improve_cost: 10.0, ..SimplifyParams::default() };
    let report = simplify(&mut work, unfrozen, goal(0), &params);
    let mut mesh = TetMesh::empty(clip.domain);
    work.commit(i32::MAX, &mut mesh);
    assert_eq!(validate(&mesh), Ok(()));
    let frozen = |mesh: &TetMesh| {
        let outside = |p: &&IVec3| p.z <= unfrozen.low || p.z >= unfrozen.high;
        let mut list: Vec<[i32; 3]> = mesh.positions.iter().filter(outside).map(|p| p.to_array()).collect();
        list.sort_unstable();
        list
    };
    let whole = clip.whole();
    let (before, after) = (frozen(&whole), frozen(&mesh));
    assert!(before.iter().all(|p| after.binary_search(p).is_ok()), "every frozen vertex is still there");
    assert!(mesh.positions.len() < whole.positions.len(), "and others went: {report:?}");
}

#[test]
fn windows_join_into_one_tiling() {
    let clip = Clip::new([10, 9, 13], textured, |x, y, t| u32::from((x + t) / 6 > y / 3));
    let params = SimplifyParams { max_extent_frames: 4, improve_at: 0.8, ..SimplifyParams::default() };
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    let mut mesh = TetMesh::empty(clip.domain);
    let mut low = -1;
    for (first, last) in [(0, 4), (4, 8), (8, 12)] {
        work.append(&clip.run(first, last), &params);
        let end = last == 12;
        let high = if end { i32::MAX } else { (last as i32 - 1) * 8 };
        simplify(&mut work, Unfrozen { low, high }, goal(60), &params);
        low = if end { i32::MAX } else { (last as i32 - 2) * 8 };
        let tets_before = mesh.tets.clone();
        work.commit(low, &mut mesh);
        assert_eq!(mesh.tets[..tets_before.len()], tets_before, "what is committed stays");
    }
    assert_eq!(validate(&mesh), Ok(()));
    for tet in 0..mesh.tets.len() {
        let times = mesh.tet_positions(tet).map(|p| p.z);
        assert!(times.iter().max().unwrap() - times.iter().min().unwrap() <= 2 * 4 * 8);
    }
}

#[test]
fn stops_at_the_error() {
    let clip = Clip::new([10, 10, 6], textured, |_, _, _| 0);
    let params = SimplifyParams::default();
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    work.append(&clip.whole(), &params);
    let report = simplify(&mut work, ALL, Goal { max_cost: 50.0, ..goal(0) }, &params);
    assert!(report.max_cost <= 50.0 * 1.05, "a bucket is 1/16 octave wide, found {}", report.max_cost);
    let further = simplify(&mut work, ALL, Goal { max_cost: 5000.0, ..goal(0) }, &params);
    assert!(further.vertices < report.vertices);
}

#[test]
fn refusals_have_names() {
    let clip = Clip::new([6, 6, 4], textured, |x, _, _| x / 2);
    let params = SimplifyParams { topology: Topology::Strict, ..SimplifyParams::default() };
    let (_, report) = clip.simplified::<ColorQuadric>(0, &params);
    for refusal in [Refusal::Sides, Refusal::Labels, Refusal::Flip] {
        assert!(report.refusals.count(refusal) > 0, "{refusal:?} in {report:?}");
    }
}

/// A stroke that moves by half its width a frame lies askew in the volume, and inside it there is next to nothing.
#[test]
fn a_stroke_stays_whole_at_a_price() {
    let is_stroke = |x: u32, t: u32| (10 + t..12 + t).contains(&x);
    let color = |x, _, t| if is_stroke(x, t) { [20; 3] } else { [220; 3] };
    let clip = Clip::new([36, 24, 9], color, |x, _, t| u32::from(is_stroke(x, t)));
    let truth = volume_of_label(&clip.whole(), 1);
    let params = SimplifyParams { topology: Topology::Priced, ..SimplifyParams::default() };
    let (mesh, report) = clip.simplified::<ColorQuadric>(60, &params);
    assert_eq!(validate(&mesh), Ok(()));
    assert_eq!(report.vertices, 60, "a price is no refusal: {report:?}");
    let part = volume_of_label(&mesh, 1) as f64 / truth as f64;
    assert!((0.9..1.1).contains(&part), "{part} of the stroke is left");
}

/// A bar that moves by two pixels a frame before two grounds.
fn moving_bar() -> Clip {
    let label = |x: u32, y: u32, t: u32| if (4 + 2 * t..12 + 2 * t).contains(&x) { 2 } else { u32::from(y >= 10) };
    let color = |x, y, t| [[90, 160, 220], [60, 60, 70], [200, 80, 20]][label(x, y, t) as usize];
    Clip::new([40, 16, 11], color, label)
}

#[test]
fn improving_moves_no_surface() {
    let clip = moving_bar();
    let mesh = |improves: bool| {
        let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
        work.append(&clip.whole(), &SimplifyParams::default());
        simplify(&mut work, ALL, goal(1000), &SimplifyParams::default());
        if improves {
            let params = SimplifyParams { improve_at: 1.0, ..SimplifyParams::default() };
            // Nothing costs nothing: so nothing collapses, but there is a goal to make room for.
            let report = simplify(&mut work, ALL, Goal { max_cost: 0.0, ..goal(0) }, &params);
            assert_eq!(report.collapses, 0);
        }
        let mut mesh = TetMesh::empty(clip.domain);
        work.commit(i32::MAX, &mut mesh);
        assert_eq!(validate(&mesh), Ok(()));
        mesh
    };
    let (before, after) = (mesh(false), mesh(true));
    assert_ne!(after.tets.len(), before.tets.len(), "edges were swapped");
    for label in 0..3 {
        assert_eq!(volume_of_label(&after, label), volume_of_label(&before, label));
    }
}

#[test]
fn what_moves_costs_less_with_improvement() {
    let clip = moving_bar();
    let cost = |improve_at| {
        let params = SimplifyParams { topology: Topology::Priced, improve_at, ..SimplifyParams::default() };
        let (mesh, report) = clip.simplified::<ColorQuadric>(200, &params);
        assert_eq!(validate(&mesh), Ok(()));
        report.max_cost
    };
    let (plain, improved) = (cost(0.0), cost(0.7));
    assert!(improved < 0.7 * plain, "{improved} with, {plain} without");
}

#[test]
fn blocks_join_into_one_tiling() {
    let clip = Clip::new([24, 15, 11], textured, |x, y, t| u32::from((x + t) / 6 > y / 3) + (x + y) / 20);
    let params = SimplifyParams { block_vertices: 1500, ..SimplifyParams::default() };
    let simplified = || {
        let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
        let goal = BlockGoal { keep: 0.5, max_error: f32::INFINITY, shift: 0.0 };
        let mut collapses = 0;
        for (first, last) in [(0, 4), (4, 7), (7, 10)] {
            let run = clip.run(first, last);
            let report = work.append_simplified(&run, 1, goal, &params);
            assert!(report.collapses > run.positions.len() as u64 / 8, "{report:?}");
            collapses += report.collapses;
        }
        let before = work.vertex_count();
        let report = work.simplify_blocks(ALL, goal, &params);
        assert_eq!(work.vertex_count() as u64, before as u64 - report.collapses);
        assert!(report.collapses > before as u64 / 8, "{before}: {report:?}");
        let last = simplify(&mut work, ALL, self::goal(100), &params);
        assert_eq!(last.vertices, 100);
        let mut mesh = TetMesh::empty(clip.domain);
        work.commit(i32::MAX, &mut mesh);
        let vertices = clip.whole().positions.len() as u64;
        assert_eq!(collapses + report.collapses + last.collapses + 100, vertices, "every vertex is accounted for");
        mesh
    };
    let mesh = simplified();
    assert_eq!(validate(&mesh), Ok(()));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(pool.install(simplified), mesh, "with any number of threads");
}

#[test]
fn blocks_and_the_whole_take_turns() {
    let clip = Clip::new([24, 15, 9], textured, |x, y, _| u32::from(x > 8) + u32::from(y > 7));
    let params = SimplifyParams { block_vertices: 1500, ..SimplifyParams::default() };
    let strict = SimplifyParams { topology: Topology::Strict, ..params };
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    work.append(&clip.whole(), &params);
    simplify(&mut work, ALL, goal(800), &strict);
    work.simplify_blocks(ALL, BlockGoal { keep: 0.5, max_error: f32::INFINITY, shift: 0.0 }, &params);
    assert!(work.vertex_count() < 500, "{}", work.vertex_count());
    let mut mesh = TetMesh::empty(clip.domain);
    work.commit(i32::MAX, &mut mesh);
    assert_eq!(validate(&mesh), Ok(()));
}

#[test]
fn blocks_leave_frozen_vertices() {
    let clip = Clip::new([24, 15, 9], textured, |_, _, _| 0);
    let params = SimplifyParams { block_vertices: 1500, ..SimplifyParams::default() };
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    work.append(&clip.whole(), &params);
    let unfrozen = Unfrozen { low: 2 * 8, high: 6 * 8 };
    work.simplify_blocks(unfrozen, BlockGoal { keep: 0.1, max_error: f32::INFINITY, shift: 0.5 }, &params);
    let mut mesh = TetMesh::empty(clip.domain);
    work.commit(i32::MAX, &mut mesh);
    assert_eq!(validate(&mesh), Ok(()));
    let outside =
        |mesh: &TetMesh| mesh.positions.iter().filter(|p| p.z <= unfrozen.low || p.z >= unfrozen.high).count();
    assert_eq!(outside(&mesh), outside(&clip.whole()));
}

#[test]
fn same_mesh_with_any_number_of_threads() {
    let clip = Clip::new([20, 16, 7], textured, |x, y, t| (x + t) / 7 + 3 * (y / 8));
    let params = SimplifyParams::default();
    let meshes = [1, 2, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| clip.simplified::<ColorQuadric>(200, &params)).0
    });
    assert_eq!(meshes[0], meshes[1]);
    assert_eq!(meshes[0], meshes[2]);
}

#[test]
fn what_counts_more_at_an_end_keeps_more_vertices_there() {
    let clip = Clip::new([20, 20, 7], textured, |_, _, _| 0);
    let at_ends = |end_weights| {
        let params = SimplifyParams { end_weights, ..SimplifyParams::default() };
        let (mesh, _) = clip.simplified::<ColorQuadric>(300, &params);
        let last = clip.domain.duration as i32 * clip.domain.unit();
        [0, last].map(|t| mesh.positions.iter().filter(|p| p.z == t).count() as f64)
    };
    let (even, first, last) = (at_ends([0.0, 0.0]), at_ends([2.0, 0.0]), at_ends([0.0, 2.0]));
    assert!(first[0] > 1.2 * even[0] && last[1] > 1.2 * even[1], "{even:?}, {first:?}, {last:?}");
    assert!(first[1] < 1.1 * even[1] && last[0] < 1.1 * even[0], "{even:?}, {first:?}, {last:?}");
}
