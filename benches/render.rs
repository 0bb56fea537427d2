//! Drawing a slab frame after frame, as a player does: `cargo bench --bench render`.
//!
//! Items are frames. Meshes are regular lattices, moved at random, with as many tets at a time as a 640x360 clip has
//! at a simplification ratio of about 1 % (14,000) and of about 5 % (62,000).

use divan::{Bencher, counter::ItemsCount};
use glam::{IVec3, Vec3};
use tetvec::mesh::TetMesh;
use tetvec::render::{DrawParams, Scene, sample, subdivide};
use tetvec::{PixelFormat, Plane, Surface, YuvMatrix};

#[path = "../tests/render/meshes.rs"]
#[expect(dead_code, reason = "the tests use more of it")]
mod meshes;

use meshes::{Lattice, Random};

const FRAMES: u32 = 30;
const SIZES: [(u32, u32); 3] = [(640, 360), (1920, 1080), (3840, 2160)];

fn main() {
    divan::main();
}

/// A slab of 640x360 pixels and 30 frames in cells of `cell` pixels and 10 frames; `labels` of them in bands.
fn slab(cell: u32, labels: i32) -> TetMesh {
    let lattice = Lattice::new([640, 360, FRAMES], [640 / cell, 360 / cell, FRAMES / 10]);
    let mut random = Random(7);
    let positions = lattice.jittered(&mut random);
    let band = lattice.domain.extent().x / labels + 1;
    let mut mesh = lattice.mesh(positions, |_, corner: IVec3| (corner.x / band) as u32, |_, _| Vec3::ZERO);
    for wedge in &mut mesh.wedges {
        wedge.color = Vec3::from_array([(); 3].map(|()| random.range(0, 255) as f32));
    }
    mesh
}

/// Draws all frames in order with one thread, from a scene that has refined nothing yet.
fn play(mesh: &TetMesh, levels: u8, antialias: bool, (width, height): (u32, u32), data: &mut [u8]) {
    let params = DrawParams { levels, antialias, viewport: None, mesh: false };
    let mut scene = Scene::new(mesh.domain);
    scene.extend(mesh);
    for frame in 0..FRAMES {
        let planes = vec![Plane { data, stride: 4 * width as usize }];
        let surface = Surface::try_new(PixelFormat::Rgbx, YuvMatrix::Bt601, (width, height), planes);
        scene.draw(frame.into(), &params, &mut surface.expect("a surface")).expect("the whole picture");
    }
}

fn bench_play(bencher: Bencher<'_, '_>, mesh: &TetMesh, levels: u8, antialias: bool, size: (u32, u32)) {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread pool");
    let mut data = vec![0; 4 * (size.0 * size.1) as usize];
    bencher
        .counter(ItemsCount::new(FRAMES))
        .bench_local(|| pool.install(|| play(mesh, levels, antialias, size, &mut data)));
}

#[divan::bench(args = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (2, 0)], sample_count = 3, sample_size = 1)]
fn play_14000_tets(bencher: Bencher<'_, '_>, (levels, size): (u8, usize)) {
    bench_play(bencher, &slab(10, 1), levels, true, SIZES[size]);
}

#[divan::bench(args = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2)], sample_count = 3, sample_size = 1)]
fn play_14000_tets_20_labels(bencher: Bencher<'_, '_>, (levels, size): (u8, usize)) {
    bench_play(bencher, &slab(10, 20), levels, true, SIZES[size]);
}

#[divan::bench(args = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2)], sample_count = 3, sample_size = 1)]
fn play_14000_tets_20_labels_as_stairs(bencher: Bencher<'_, '_>, (levels, size): (u8, usize)) {
    bench_play(bencher, &slab(10, 20), levels, false, SIZES[size]);
}

#[divan::bench(args = [(0, 0), (1, 0), (1, 1), (1, 2)], sample_count = 3, sample_size = 1)]
fn play_62000_tets(bencher: Bencher<'_, '_>, (levels, size): (u8, usize)) {
    bench_play(bencher, &slab(5, 1), levels, true, SIZES[size]);
}

/// Where a frame's pixels lie in the mesh, for the fit.
#[divan::bench(args = [0, 1], sample_count = 3, sample_size = 1)]
fn sample_frames(bencher: Bencher<'_, '_>, levels: u8) {
    let mesh = slab(10, 1);
    let refined = subdivide(&mesh, levels);
    bencher.counter(ItemsCount::new(FRAMES)).bench_local(|| {
        for frame in 0..FRAMES {
            divan::black_box(sample(&refined, &mesh.domain, frame.into(), 0..360));
        }
    });
}

/// Subdivision of a whole slab, for the fit. Items are control tets.
#[divan::bench(args = [1, 2], sample_count = 3, sample_size = 1)]
fn subdivide_14000_tets(bencher: Bencher<'_, '_>, levels: u8) {
    let mesh = slab(10, 1);
    bencher.counter(ItemsCount::new(mesh.tets.len())).bench_local(|| subdivide(&mesh, levels));
}
