//! Which pixels have not changed since they last did.
//!
//! In: frames. Out: for each pixel, whether its surroundings still look as they did. Forbidden here: labels, motion.

use super::raster::Raster;
use crate::video::Frame;

/// A pixel counts as unchanged while every channel stays within this many levels of its reference: coding noise of a
/// still picture stays below.
const TOLERANCE: u8 = 4;

/// Compares frames to a reference that is renewed, pixel by pixel, only where a change is seen: slow changes add up
/// until they are noticed.
#[derive(Debug, Clone)]
pub(super) struct Stillness {
    raster: Raster,
    reference: Vec<[u8; 3]>,
}

impl Stillness {
    pub(super) fn new(frame: &Frame) -> Self {
        Self { raster: Raster::new(frame.width(), frame.height()), reference: frame.pixels().to_vec() }
    }

    /// Whether each pixel and the eight around it are unchanged; takes `frame` as reference where they are not.
    pub(super) fn update(&mut self, frame: &Frame) -> Vec<bool> {
        let same = |(a, b): (&[u8; 3], &[u8; 3])| a.iter().zip(b).all(|(a, b)| a.abs_diff(*b) <= TOLERANCE);
        let unchanged: Vec<bool> = self.reference.iter().zip(frame.pixels()).map(same).collect();
        let Raster { width, height } = self.raster;
        let mut rows = unchanged.clone();
        for (row, source) in rows.chunks_exact_mut(width).zip(unchanged.chunks_exact(width)) {
            for x in 0..width {
                row[x] = source[x.saturating_sub(1)] && source[x] && source[(x + 1).min(width - 1)];
            }
        }
        let still: Vec<bool> = (0..self.raster.len())
            .map(|p| {
                let (x, y) = self.raster.xy(p);
                rows[y.saturating_sub(1) * width + x] && rows[p] && rows[(y + 1).min(height - 1) * width + x]
            })
            .collect();
        for ((reference, &color), _) in self.reference.iter_mut().zip(frame.pixels()).zip(&still).filter(|(_, s)| !**s)
        {
            *reference = color;
        }
        still
    }
}

#[cfg(test)]
mod tests {
    use super::Stillness;
    use crate::video::Frame;

    fn flat(level: u8, dot: Option<u8>) -> Frame {
        Frame::from_fn(7, 5, |x, y| if (x, y) == (3, 2) { [dot.unwrap_or(level); 3] } else { [level; 3] })
            .expect("size")
    }

    #[test]
    fn a_change_wakes_its_neighbours_only() {
        let mut stillness = Stillness::new(&flat(100, None));
        let still = stillness.update(&flat(100, Some(120)));
        let awake: Vec<usize> = (0..35).filter(|&p| !still[p]).collect();
        assert_eq!(awake, [9, 10, 11, 16, 17, 18, 23, 24, 25]);
        assert!(stillness.update(&flat(100, Some(120))).iter().all(|&s| s));
    }

    #[test]
    fn slow_fades_are_noticed_in_the_end() {
        let mut stillness = Stillness::new(&flat(100, None));
        let woken = (101..=110).filter(|&level| !stillness.update(&flat(level, None))[0]).collect::<Vec<_>>();
        assert_eq!(woken, [105, 110]);
    }
}
