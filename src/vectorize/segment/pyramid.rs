//! A picture's brightness at halved sizes.
//!
//! In: a frame. Out: levels from full size down. Forbidden here: any comparison of two pictures.

use crate::video::Frame;

/// Brightness of a picture, 8 bits a pixel, row by row.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Gray {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) pixels: Vec<u8>,
}

impl Gray {
    /// Luma of BT.601.
    pub(super) fn from_frame(frame: &Frame) -> Self {
        let luma =
            |&[r, g, b]: &[u8; 3]| ((77 * u32::from(r) + 150 * u32::from(g) + 29 * u32::from(b) + 128) >> 8) as u8;
        let pixels = frame.pixels().iter().map(luma).collect();
        Self { width: frame.width() as usize, height: frame.height() as usize, pixels }
    }

    /// Half the size (rounded up), each pixel the mean of 2x2; the last row and column stand for missing ones.
    pub(super) fn halved(&self) -> Self {
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut pixels = Vec::with_capacity(width * height);
        for y in 0..height {
            let upper = &self.pixels[2 * y * self.width..][..self.width];
            let lower = &self.pixels[(2 * y + 1).min(self.height - 1) * self.width..][..self.width];
            pixels.extend((0..width).map(|x| {
                let (left, right) = (2 * x, (2 * x + 1).min(self.width - 1));
                let sum = [upper[left], upper[right], lower[left], lower[right]].map(u16::from).iter().sum::<u16>();
                ((sum + 2) / 4) as u8
            }));
        }
        Self { width, height, pixels }
    }

    /// The pixel at (x, y), the nearest one where that is outside.
    pub(super) fn clamped(&self, x: isize, y: isize) -> u8 {
        let x = x.clamp(0, self.width as isize - 1) as usize;
        let y = y.clamp(0, self.height as isize - 1) as usize;
        self.pixels[y * self.width + x]
    }
}

/// Levels stop where a side would fall below this, in pixels: a block match needs some context.
const SMALLEST_SIDE: usize = 24;
/// Most levels; with five, 12 pixels at the smallest are 192 at full size.
const MOST_LEVELS: usize = 5;

/// The picture at full size (level 0) and at successive halves.
pub(super) fn pyramid(frame: &Frame) -> Vec<Gray> {
    let mut levels = vec![Gray::from_frame(frame)];
    while let Some(last) = levels.last()
        && levels.len() < MOST_LEVELS
        && last.width.min(last.height) >= 2 * SMALLEST_SIDE
    {
        levels.push(last.halved());
    }
    levels
}

#[cfg(test)]
mod tests {
    use super::{Gray, pyramid};
    use crate::video::Frame;

    #[test]
    fn halving_takes_the_mean_and_repeats_the_border() {
        let gray = Gray { width: 3, height: 1, pixels: vec![10, 20, 40] };
        assert_eq!(gray.halved(), Gray { width: 2, height: 1, pixels: vec![15, 40] });
    }

    #[test]
    fn levels_follow_the_size() {
        let levels = |w, h| pyramid(&Frame::from_fn(w, h, |_, _| [9; 3]).expect("size")).len();
        assert_eq!([levels(1, 1), levels(48, 47), levels(48, 48), levels(2000, 2000)], [1, 1, 2, 5]);
    }
}
