//! Connected pieces of a picture.
//!
//! In: which pixels are meant and what links them. Out: a number for each piece. Forbidden here: motion, labels.

use super::raster::Raster;

/// No piece.
const NONE: u32 = u32::MAX;

/// 4-connected pieces of a plane.
#[derive(Debug)]
pub(super) struct Pieces {
    /// For every pixel the number of its piece, in order of first pixel.
    pub(super) of_pixel: Vec<u32>,
    /// Pixels of each piece.
    pub(super) areas: Vec<u32>,
}

/// Connected pieces of the pixels that `included` takes, across the sides that `linked` lets pass; other pixels have
/// piece `u32::MAX`.
pub(super) fn pieces(
    raster: Raster,
    included: impl Fn(usize) -> bool,
    linked: impl Fn(usize, usize) -> bool,
) -> Pieces {
    let mut found = Pieces { of_pixel: vec![NONE; raster.len()], areas: Vec::new() };
    let mut stack = Vec::new();
    for seed in 0..raster.len() {
        if found.of_pixel[seed] != NONE || !included(seed) {
            continue;
        }
        let piece = found.areas.len() as u32;
        let mut area = 0;
        found.of_pixel[seed] = piece;
        stack.push(seed);
        while let Some(p) = stack.pop() {
            area += 1;
            for q in raster.sides(p) {
                if found.of_pixel[q] == NONE && included(q) && linked(p, q) {
                    found.of_pixel[q] = piece;
                    stack.push(q);
                }
            }
        }
        found.areas.push(area);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_do_not_join_across_corners() {
        let plane = [1, 0, 0, 1];
        let found = pieces(Raster::new(2, 2), |p| plane[p] == 1, |_, _| true);
        assert_eq!(found.of_pixel, [0, NONE, NONE, 1]);
        assert_eq!(found.areas, [1, 1]);
    }
}
