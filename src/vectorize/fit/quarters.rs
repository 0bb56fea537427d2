//! Quarters of pixels: what lies between the centres.
//!
//! In: a frame. Out: the colours of the four quarters of a pixel, whose mean is the pixel. A pixel's colour is a mean over its
//! square; within, it is taken to change linearly, as steeply as its neighbours allow without a new extremum: van Leer,
//! "Towards the ultimate conservative difference scheme IV", 1977 (his monotonic central difference). Without them nothing
//! would hold what a mesh shows between centres, and edges that fit all pixels would be ragged when enlarged.

use glam::Vec3;

use crate::video::Frame;

/// The colour at the middle of quarter (`column`, `row`), two of them to a pixel either way.
#[inline]
pub(super) fn quarter(frame: &Frame, column: u32, row: u32) -> Vec3 {
    let (x, y) = (column / 2, row / 2);
    let here = frame.row(y);
    let (left, right) = (x.saturating_sub(1), (x + 1).min(frame.width() - 1));
    let (above, below) = (frame.row(y.saturating_sub(1)), frame.row((y + 1).min(frame.height() - 1)));
    let own = color(here[x as usize]);
    let along_x = slope(own - color(here[left as usize]), color(here[right as usize]) - own);
    let along_y = slope(own - color(above[x as usize]), color(below[x as usize]) - own);
    let away = |bit: u32| if bit % 2 == 1 { 0.25 } else { -0.25 };
    own + along_x * away(column) + along_y * away(row)
}

/// A pixel's colour.
#[inline]
pub(super) fn color([r, g, b]: [u8; 3]) -> Vec3 {
    Vec3::new(f32::from(r), f32::from(g), f32::from(b))
}

/// The mean of two differences, but not more than twice either, and nothing where they have different signs.
#[inline]
fn slope(before: Vec3, after: Vec3) -> Vec3 {
    let most = 2.0 * before.abs().min(after.abs());
    let mean = 0.5 * (before + after);
    Vec3::select((before * after).cmpgt(Vec3::ZERO), mean.clamp(-most, most), Vec3::ZERO)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quarters_keep_the_mean_and_add_no_extremum() {
        let levels = [0, 0, 64, 255, 255, 40];
        let frame = Frame::from_fn(6, 3, |x, y| [levels[x as usize], 10 * y as u8, 7]).expect("a frame");
        for x in 0..6 {
            let [a, b] = [0, 1].map(|half| quarter(&frame, 2 * x + half, 2).x);
            let own = f32::from(levels[x as usize]);
            assert_eq!(0.5 * (a + b), own);
            assert!((0.0..=255.0).contains(&a) && (0.0..=255.0).contains(&b), "{a} and {b} of {own}");
        }
        assert_eq!([4, 5].map(|column| quarter(&frame, column, 2).x), [32.125, 95.875]);
        assert_eq!([2, 3].map(|row| quarter(&frame, 0, row).y), [7.5, 12.5]);
    }
}
