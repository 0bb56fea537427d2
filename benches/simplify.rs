//! Edge collapse on one thread: `cargo bench --bench simplify`. Items are collapses, evaluations included.

use divan::{Bencher, counter::ItemsCount};
use tetvec::mesh::TetMesh;
use tetvec::vectorize::cleave::cleave;
use tetvec::vectorize::lattice::Lattice;
use tetvec::vectorize::simplify::{BlockGoal, ColorQuadric, SimplifyParams, SimplifyReport, WorkMesh, simplify};

#[expect(dead_code, reason = "other stages use more of it")]
mod clip;

use clip::{ALL, Clip};

const RATIO: f64 = 0.01;

fn main() {
    divan::main();
}

/// In blocks down to twice the ratio, then as a whole, as the encoder does it.
fn run(clip: &Clip, lattice: &TetMesh) -> (SimplifyReport, SimplifyReport) {
    let params = SimplifyParams::default();
    let goal = clip.goal(RATIO);
    let keep = 2.0 * goal.vertices as f64 / lattice.positions.len() as f64;
    let mut work = WorkMesh::<ColorQuadric>::new(clip.domain);
    let blocks = BlockGoal { keep, max_error: f32::INFINITY, shift: 0.0 };
    (work.append_simplified(lattice, 1, blocks, &params), simplify(&mut work, ALL, goal, &params))
}

fn bench(bencher: Bencher<'_, '_>, clip: &Clip, lattice: &TetMesh) {
    #[cfg(feature = "threads")]
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    #[cfg(feature = "threads")]
    let run = |clip, lattice| pool.install(|| run(clip, lattice));
    let (blocks, whole) = run(clip, lattice);
    bencher.counter(ItemsCount::new(blocks.collapses + whole.collapses)).bench(|| run(clip, lattice));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn adaptive_640x360(bencher: Bencher<'_, '_>) {
    let clip = Clip::new(640, 360, 9);
    bench(bencher, &clip, &clip.lattice(12.0 * RATIO));
}

#[divan::bench(sample_count = 5, sample_size = 1)]
fn dense_320x180(bencher: Bencher<'_, '_>) {
    let clip = Clip::new(320, 180, 6);
    let lattice = Lattice::try_new(clip.domain, 0, &clip.frames, &clip.labels).expect("planes that fit");
    bench(bencher, &clip, &cleave(&lattice).expect("few tets"));
}
