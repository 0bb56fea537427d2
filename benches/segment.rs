//! Labels of frames as they come: `cargo bench --bench segment`. Items are frames.

use divan::{Bencher, counter::ItemsCount};
use tetvec::vectorize::segment::{SegmentParams, Segmenter};

#[expect(dead_code, reason = "other stages use more of it")]
mod clip;

use clip::Clip;

const FRAMES: u32 = 4;

fn main() {
    divan::main();
}

/// 0: labels by content.
#[divan::bench(args = [0, 200], sample_count = 5, sample_size = 1)]
fn frames_320x180(bencher: Bencher<'_, '_>, superpixels: u32) {
    let clip = Clip::new(320, 180, FRAMES);
    bencher.counter(ItemsCount::new(FRAMES)).bench(|| {
        let mut segmenter = Segmenter::new(320, 180, SegmentParams::new(superpixels));
        clip.frames.iter().map(|frame| segmenter.push(frame)).collect::<Vec<_>>()
    });
}
