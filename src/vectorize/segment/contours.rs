//! How far the colour jumps between superpixels.
//!
//! In: superpixels and the frame. Out: the strength of each boundary. Forbidden here: deciding which boundaries stay.
//!
//! A jump is measured between both sides a little away from the boundary, so that blended edge pixels and gradients
//! do not count.

use super::superpixels::Superpixels;
use crate::video::Frame;

/// Pixels on each side of a boundary over which a jump is measured; the outermost on each side is left out where it can
/// be, since it may be a blend.
const DEPTH: usize = 2;

/// The common boundary of two superpixels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Contour {
    pub(super) cells: [u32; 2],
    /// Length of the mean difference vector between both sides, root mean square of the channels, in levels. The mean
    /// of vectors, not of lengths: noise and texture average out, an edge does not.
    pub(super) jump: f32,
    /// Pixel sides.
    pub(super) length: f32,
}

/// A pixel side between two superpixels: the left or upper pixel, and whether the other is below.
struct PixelSide {
    cells: [u32; 2],
    pixel: usize,
    is_vertical: bool,
}

/// All pixel sides between superpixels, ordered by these, the lower place first.
fn pixel_sides(map: &Superpixels) -> Vec<PixelSide> {
    let mut sides: Vec<PixelSide> = map
        .raster
        .side_pairs()
        .map(|(p, q)| (p, q, map.plane[p], map.plane[q]))
        .filter(|(_, _, a, b)| a != b)
        .map(|(p, q, a, b)| PixelSide {
            cells: [a.min(b), a.max(b)],
            pixel: p,
            is_vertical: q != p + 1 || map.raster.width == 1,
        })
        .collect();
    sides.sort_unstable_by_key(|side| (side.cells, side.pixel, side.is_vertical));
    sides
}

/// A frame's superpixels and the pixel sides between them.
pub(super) struct Contours<'a> {
    map: &'a Superpixels,
    frame: &'a Frame,
    sides: Vec<PixelSide>,
}

impl<'a> Contours<'a> {
    pub(super) fn new(map: &'a Superpixels, frame: &'a Frame) -> Self {
        Self { map, frame, sides: pixel_sides(map) }
    }

    /// The boundaries between superpixels of different groups, by place. A jump is measured no deeper than its groups
    /// reach.
    pub(super) fn between(&self, groups: &[u32]) -> Vec<Contour> {
        let apart = |run: &&[PixelSide]| groups[run[0].cells[0] as usize] != groups[run[0].cells[1] as usize];
        let contour = |run: &[PixelSide]| {
            // Where a group is one pixel thin there is only a border pixel to look at: heard if there are no others.
            let (mut deep, mut shallow) = (MeanJump::default(), MeanJump::default());
            for side in run {
                let (jump, is_deep) = doubled_jump(self.map, self.frame, side, groups);
                if is_deep { &mut deep } else { &mut shallow }.add(jump);
            }
            let jump = if deep.count > 0 { deep } else { shallow }.level();
            Contour { cells: run[0].cells, jump, length: run.len() as f32 }
        };
        self.sides.chunk_by(|a, b| a.cells == b.cells).filter(apart).map(contour).collect()
    }
}

/// Sum of doubled difference vectors.
#[derive(Default)]
struct MeanJump {
    sum: [i32; 3],
    count: u32,
}

impl MeanJump {
    fn add(&mut self, doubled: [i16; 3]) {
        self.sum = [0, 1, 2].map(|c| self.sum[c] + i32::from(doubled[c]));
        self.count += 1;
    }

    /// Length of the mean vector, root mean square of the channels, in levels.
    fn level(&self) -> f32 {
        let mean = self.sum.map(|sum| sum as f32 / (2 * self.count.max(1)) as f32);
        (mean.iter().map(|d| d * d).sum::<f32>() / 3.0).sqrt()
    }
}

/// For each superpixel how flat it is, as in drawn pictures: 0 where up to a quarter of its pixels equal their right and
/// lower neighbours to within a level, 1 where three quarters do (the rest may be blends at its border).
pub(super) fn flatness(map: &Superpixels, frame: &Frame) -> Vec<f32> {
    let mut uneven = vec![false; map.raster.len()];
    for (p, q) in map.raster.side_pairs() {
        let far = |(a, b): (&u8, &u8)| a.abs_diff(*b) > 1;
        uneven[p] |= map.plane[p] == map.plane[q] && frame.pixels()[p].iter().zip(&frame.pixels()[q]).any(far);
    }
    let mut flat = vec![0.0; map.cells.len()];
    for (&cell, _) in map.plane.iter().zip(&uneven).filter(|(_, uneven)| !**uneven) {
        flat[cell as usize] += 1.0;
    }
    let share = |count: f32, area: u32| (2.0 * count / area.max(1) as f32 - 0.5).clamp(0.0, 1.0);
    flat.iter().zip(&map.cells).map(|(&count, cell)| share(count, cell.area)).collect()
}

/// Twice the difference of colour from the superpixel of the lower place to the other across a pixel side, and whether
/// it could be measured away from the border on both sides.
fn doubled_jump(map: &Superpixels, frame: &Frame, side: &PixelSide, groups: &[u32]) -> ([i16; 3], bool) {
    let (p, raster) = (side.pixel, map.raster);
    let (x, y) = raster.xy(p);
    let (step, before, after) =
        if side.is_vertical { (raster.width, y, raster.height - 2 - y) } else { (1, x, raster.width - 2 - x) };
    let q = p + step;
    let group_at = |p: usize| groups[map.plane[p] as usize];
    let (near, near_is_deep) = side_color(frame, &group_at, p, (1..=before.min(DEPTH)).map(|i| p - i * step));
    let (far, far_is_deep) = side_color(frame, &group_at, q, (1..=after.min(DEPTH)).map(|i| q + i * step));
    let sign = if map.plane[p] == side.cells[0] { 1 } else { -1 };
    ([0, 1, 2].map(|c| sign * (far[c] - near[c])), near_is_deep && far_is_deep)
}

/// Twice the mean colour of the pixels `deeper` that hang together with `edge` in its group, or twice that of `edge`;
/// whether there were deeper ones.
fn side_color(
    frame: &Frame,
    group_at: &impl Fn(usize) -> u32,
    edge: usize,
    deeper: impl Iterator<Item = usize>,
) -> ([i16; 3], bool) {
    let group = group_at(edge);
    let mut sum = [0i16; 3];
    let mut count = 0;
    for p in deeper.take_while(|&p| group_at(p) == group) {
        sum = [0, 1, 2].map(|c| sum[c] + i16::from(frame.pixels()[p][c]));
        count += 1;
    }
    match count {
        0 => (frame.pixels()[edge].map(|level| 2 * i16::from(level)), false),
        1 => (sum.map(|level| 2 * level), true),
        _ => (sum, true),
    }
}

#[cfg(test)]
mod tests {
    use super::{Contours, flatness};
    use crate::vectorize::segment::raster::Raster;
    use crate::vectorize::segment::superpixels::Superpixels;
    use crate::video::Frame;

    /// A picture of 12x8 grey pixels with superpixels given by `cell`.
    fn picture(cell: impl Fn(usize, usize) -> u32, level: impl Fn(u32, u32) -> u8) -> (Superpixels, Frame) {
        let mut map = Superpixels::new(Raster::new(12, 8));
        map.plane = (0..96).map(|p| cell(p % 12, p / 12)).collect();
        (0..=map.plane.iter().copied().max().unwrap_or(0)).for_each(|_| _ = map.add(None, [0, 0]));
        map.recount(&[[0.0; 3]; 96]);
        (map, Frame::from_fn(12, 8, |x, y| [level(x, y); 3]).expect("size"))
    }

    #[test]
    fn a_blended_column_does_not_lessen_the_jump() {
        for edge in [5, 6] {
            let (map, frame) =
                picture(|x, _| u32::from(x >= edge), |x, _| [40, 90, 140][(x.cmp(&5) as i8 + 1) as usize]);
            let [contour] = Contours::new(&map, &frame).between(&[0, 1])[..] else { panic!("one contour") };
            assert_eq!((contour.cells, contour.jump, contour.length), ([0, 1], 100.0, 8.0));
        }
    }

    #[test]
    fn a_thin_arm_along_another_edge_is_not_heard() {
        // Superpixel 0 is the left of the picture, and an arm of it, one pixel wide, holds the blends before a bright bar.
        let cell = |x: usize, y: usize| if x >= 8 { 2 } else { u32::from(y >= 3 && x < 7) };
        let (map, frame) = picture(cell, |x, _| [40, 90, 240][(x.cmp(&7) as i8 + 1) as usize]);
        let contours = Contours::new(&map, &frame).between(&[0, 1, 2]);
        assert_eq!(contours.iter().map(|c| c.cells).collect::<Vec<_>>(), [[0, 1], [0, 2]]);
        assert_eq!(contours[0].jump, 0.0);
    }

    #[test]
    fn jumps_inside_a_group_are_none() {
        let (map, frame) = picture(|x, _| (x / 4) as u32, |x, _| (x * 20) as u8);
        let contours = Contours::new(&map, &frame).between(&[0, 0, 2]);
        assert_eq!(contours.iter().map(|c| c.cells).collect::<Vec<_>>(), [[1, 2]]);
    }

    #[test]
    fn flatness_tells_drawn_from_grainy() {
        let (map, frame) =
            picture(|x, _| u32::from(x >= 6), |x, y| if x < 6 { 70 } else { 70 + 9 * ((x + y) % 2) as u8 });
        assert_eq!(flatness(&map, &frame), [1.0, 0.0]);
    }
}
