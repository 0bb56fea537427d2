//! Lattice and cleaving of six planes, on one thread: `cargo bench --bench cleave`.

use std::sync::Arc;

use divan::{Bencher, counter::ItemsCount};
use tetvec::Frame;
use tetvec::mesh::Domain;
use tetvec::vectorize::cleave::cleave;
use tetvec::vectorize::lattice::Lattice;
use tetvec::video::{Label, LabelPlane};

const PLANES: u32 = 6;

fn main() {
    divan::main();
}

/// Each pixel takes the nearest of as many seeds as there are labels, which drift by a pixel a frame: cells with
/// boundaries about as long as those of superpixels.
fn label_plane(width: u32, height: u32, plane: u32, label_count: u32) -> LabelPlane {
    let columns = f64::from(label_count).sqrt().ceil() as u32;
    let rows = label_count.div_ceil(columns);
    let seed = |label: u32| {
        let jitter = |n: u32| i64::from((label * 7919 + n * 104_729) % 17);
        let x = i64::from((label % columns * 2 + 1) * width / (2 * columns)) + jitter(0) + i64::from(plane);
        let y = i64::from((label / columns * 2 + 1) * height / (2 * rows)) + jitter(1);
        (x, y)
    };
    let seeds: Vec<_> = (0..label_count).map(seed).collect();
    let nearest = |x: u32, y: u32| {
        let distance = |&(_, (sx, sy)): &(u32, &(i64, i64))| (sx - i64::from(x)).pow(2) + (sy - i64::from(y)).pow(2);
        (0..).zip(&seeds).min_by_key(distance).map_or(Label(0), |(label, _)| Label(label))
    };
    let labels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| nearest(x, y)).collect();
    LabelPlane::new(width, height, labels)
}

fn bench(bencher: Bencher, (width, height): (u32, u32), label_count: u32) {
    let frame = |t: u32| Arc::new(Frame::from_fn(width, height, |x, y| [x as u8, y as u8, t as u8]).unwrap());
    let frames: Vec<_> = (0..PLANES).map(frame).collect();
    let labels: Vec<_> = (0..PLANES).map(|plane| label_plane(width, height, plane, label_count)).collect();
    let domain = Domain { width, height, duration: PLANES - 1, subpixel_bits: 3 };
    let cleave_all = || cleave(&Lattice::try_new(domain, 0, &frames, &labels).unwrap()).unwrap();
    let tets = ItemsCount::new(cleave_all().tets.len());
    #[cfg(feature = "threads")]
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    #[cfg(feature = "threads")]
    let cleave_all = || pool.install(cleave_all);
    bencher.counter(tets).bench(cleave_all);
}

#[divan::bench(args = [1, 20, 200])]
fn planes_320x180(bencher: Bencher, label_count: u32) {
    bench(bencher, (320, 180), label_count);
}

#[divan::bench(args = [1, 20], sample_count = 10)]
fn planes_640x360(bencher: Bencher, label_count: u32) {
    bench(bencher, (640, 360), label_count);
}
