//! A layer of the adaptive lattice, from pixels to tets: `cargo bench --bench lattice`. Items are pixels.

use divan::{Bencher, counter::ItemsCount};
use tetvec::mesh::TetMesh;

#[expect(dead_code, reason = "other stages use more of it")]
mod clip;

use clip::Clip;

fn main() {
    divan::main();
}

/// Vertices a pixel: what the presets medium and slow start from at a simplification ratio of 1 %.
#[divan::bench(args = [0.12, 0.24], sample_count = 10, sample_size = 1)]
fn layer_640x360(bencher: Bencher<'_, '_>, vertices_per_pixel: f64) {
    let clip = Clip::new(640, 360, 9);
    let lattice = || -> TetMesh { clip.lattice(vertices_per_pixel) };
    bencher.counter(ItemsCount::new(640u32 * 360 * 8)).bench(lattice);
}
