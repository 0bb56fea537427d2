//! Temporal superpixels of a picture that moves, on one thread: `cargo bench --bench superpixels`.

use divan::{Bencher, counter::ItemsCount};
use tetvec::Frame;
use tetvec::vectorize::segment::{SegmentParams, Segmenter};

fn main() {
    divan::main();
}

/// Waves and a noise that is fixed to them, seen through a window that moves by (3, 1) pixels a frame.
fn frame(width: u32, height: u32, k: u32) -> Frame {
    let color = |x: u32, y: u32| {
        let noise = ((x * 7919 + y * 104_729).wrapping_mul(2_654_435_761) >> 28) as f32;
        let (x, y) = (x as f32, y as f32);
        let wave = 50.0 * ((x * 0.07).sin() * (y * 0.05).cos() + (x * 0.021 + y * 0.034).sin());
        [120.0 + wave, 110.0 - wave * 0.7, 90.0 + wave * 0.4].map(|level| (level + noise) as u8)
    };
    Frame::from_fn(width, height, |x, y| color(x + 3 * k, y + k)).expect("size")
}

/// Frames of the steady state: the first two are not counted.
fn bench(bencher: Bencher, (width, height): (u32, u32), superpixels: u32) {
    let frames: Vec<Frame> = (0..6).map(|k| frame(width, height, k)).collect();
    let mut started = Segmenter::new(width, height, SegmentParams::new(superpixels));
    frames[..2].iter().for_each(|frame| _ = started.push(frame));
    let pixels = (frames.len() - 2) * (width * height) as usize;
    bencher.counter(ItemsCount::new(pixels)).with_inputs(|| started.clone()).bench_values(|mut segmenter| {
        frames[2..].iter().for_each(|frame| _ = segmenter.push(frame));
    });
}

#[divan::bench(args = [400, 1000], sample_count = 20)]
fn frames_640x360(bencher: Bencher, superpixels: u32) {
    bench(bencher, (640, 360), superpixels);
}

#[divan::bench(args = [400, 1000], sample_count = 20)]
fn frames_176x144(bencher: Bencher, superpixels: u32) {
    bench(bencher, (176, 144), superpixels);
}
