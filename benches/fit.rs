//! Fit of a slab's mesh to its frames: `cargo bench --bench fit`. Items are vertices.

use divan::{Bencher, counter::ItemsCount};
use tetvec::vectorize::fit::{FitParams, FitRequest, fit};
use tetvec::video::Volume;

mod clip;

use clip::Clip;

fn main() {
    divan::main();
}

/// By the steps of the position optimisation and the level of subdivision that is fitted for.
#[divan::bench(args = [(0, 0), (12, 0), (12, 1)], sample_count = 5, sample_size = 1)]
fn slab_320x180(bencher: Bencher<'_, '_>, (position_iterations, subdivision_levels): (u32, u8)) {
    let clip = Clip::new(320, 180, 9);
    let mesh = clip.simplified(0.01);
    let free = vec![true; mesh.positions.len()];
    let mut frames = Volume::new(0);
    clip.frames.iter().for_each(|frame| frames.push(frame.clone()));
    let labels: Vec<_> = (0..).zip(clip.labels.iter().cloned()).collect();
    let params = FitParams { position_iterations, subdivision_levels, ..FitParams::default() };
    bencher.counter(ItemsCount::new(mesh.positions.len())).with_inputs(|| mesh.clone()).bench_values(|mut mesh| {
        fit(&mut FitRequest { mesh: &mut mesh, free: &free, frames: &frames, labels: &labels, params: &params })
    });
}
