//! The superpixels of a frame: which pixel belongs to which, and the mean place and colour of each.
//!
//! In: assignments of pixels. Out: sums that follow every change. Forbidden here: deciding what belongs together.
//!
//! A superpixel is a Gaussian in (x, y, L*, a*, b*) with fixed variances, as in Chang, Wei and Fisher, "A video
//! representation using temporal superpixels" (CVPR 2013), §2; only its mean is estimated.

use super::lab::{Lab, distance2};
use super::raster::Raster;
use crate::video::Label;

/// Marks a pixel of no superpixel while a frame is being worked on.
pub(super) const NONE: u32 = u32::MAX;

/// One superpixel. Its place in [`Superpixels::cells`] may change from frame to frame, `id` never does.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Superpixel {
    /// Number within the slab, in order of birth.
    pub(super) id: u32,
    /// The label it had in the frame before, or of the superpixel it was split from; none if just born.
    pub(super) label: Option<Label>,
    /// Displacement from the frame before.
    pub(super) motion: [i32; 2],
    /// Pixels.
    pub(super) area: u32,
    sums: [f64; 5],
}

impl Superpixel {
    /// Mean x and y, in pixel indices. An empty superpixel stands at the origin.
    pub(super) fn place(&self) -> [f32; 2] {
        let n = f64::from(self.area.max(1));
        [(self.sums[0] / n) as f32, (self.sums[1] / n) as f32]
    }

    /// Mean colour.
    pub(super) fn color(&self) -> Lab {
        let n = f64::from(self.area.max(1));
        [(self.sums[2] / n) as f32, (self.sums[3] / n) as f32, (self.sums[4] / n) as f32]
    }
}

/// All superpixels of a frame.
#[derive(Debug, Clone)]
pub(super) struct Superpixels {
    pub(super) raster: Raster,
    /// For every pixel the place of its superpixel in `cells`.
    pub(super) plane: Vec<u32>,
    pub(super) cells: Vec<Superpixel>,
    next_id: u32,
}

/// Weights of place against colour: energies are squared colour distances of [`super::lab`].
#[derive(Debug, Clone, Copy)]
pub(super) struct Spread {
    /// Squared colour distance that a distance of one pixel weighs.
    pub(super) per_pixel2: f32,
}

impl Spread {
    /// For superpixels `spacing` pixels apart. Compactness 10, SLIC's default (Achanta et al. 2012, §3): a distance of
    /// one spacing weighs as much as 10 units of colour.
    pub(super) fn new(spacing: f32) -> Self {
        let compactness = 10.0 / spacing;
        Self { per_pixel2: compactness * compactness }
    }
}

impl Superpixels {
    pub(super) fn new(raster: Raster) -> Self {
        Self { raster, plane: vec![NONE; raster.len()], cells: Vec::new(), next_id: 0 }
    }

    /// Adds an empty superpixel and returns its place.
    pub(super) fn add(&mut self, label: Option<Label>, motion: [i32; 2]) -> u32 {
        let place = self.cells.len() as u32;
        self.cells.push(Superpixel { id: self.next_id, label, motion, area: 0, sums: [0.0; 5] });
        self.next_id += 1;
        place
    }

    /// Negative log-likelihood, up to constants, of pixel `p` of colour `color` in superpixel `cell`.
    pub(super) fn energy(&self, cell: u32, p: usize, color: Lab, spread: Spread) -> f32 {
        let cell = &self.cells[cell as usize];
        let (x, y) = self.raster.xy(p);
        let place = cell.place();
        let (dx, dy) = (x as f32 - place[0], y as f32 - place[1]);
        distance2(color, cell.color()) + spread.per_pixel2 * (dx * dx + dy * dy)
    }

    /// Moves pixel `p` to superpixel `to`, and the sums with it.
    pub(super) fn reassign(&mut self, p: usize, to: u32, color: Lab) {
        let from = self.plane[p];
        if from == to {
            return;
        }
        if from != NONE {
            self.count(from, p, color, -1.0);
        }
        if to != NONE {
            self.count(to, p, color, 1.0);
        }
        self.plane[p] = to;
    }

    fn count(&mut self, cell: u32, p: usize, color: Lab, sign: f64) {
        let (x, y) = self.raster.xy(p);
        let cell = &mut self.cells[cell as usize];
        cell.area = if sign > 0.0 { cell.area + 1 } else { cell.area - 1 };
        let values = [x as f64, y as f64, f64::from(color[0]), f64::from(color[1]), f64::from(color[2])];
        for (sum, value) in cell.sums.iter_mut().zip(values) {
            *sum += sign * value;
        }
    }

    /// Recomputes all sums from the plane.
    pub(super) fn recount(&mut self, colors: &[Lab]) {
        for cell in &mut self.cells {
            cell.area = 0;
            cell.sums = [0.0; 5];
        }
        for (p, &color) in colors.iter().enumerate() {
            if self.plane[p] != NONE {
                self.count(self.plane[p], p, color, 1.0);
            }
        }
    }

    /// Lets go of empty superpixels; the others keep their order.
    pub(super) fn drop_empty(&mut self) {
        let mut places = vec![NONE; self.cells.len()];
        let mut next = 0;
        for (place, cell) in places.iter_mut().zip(&self.cells) {
            if cell.area > 0 {
                *place = next;
                next += 1;
            }
        }
        self.cells.retain(|cell| cell.area > 0);
        for entry in &mut self.plane {
            if *entry != NONE {
                *entry = places[*entry as usize];
            }
        }
    }

    /// Pairs (i, j), i < j, of superpixels that share a side, with the number of pixel sides they share, in order.
    pub(super) fn adjacent(&self) -> Vec<(u32, u32, u32)> {
        let mut pairs: Vec<(u32, u32)> = self
            .raster
            .side_pairs()
            .map(|(p, q)| (self.plane[p], self.plane[q]))
            .filter(|(a, b)| a != b)
            .map(|(a, b)| (a.min(b), a.max(b)))
            .collect();
        pairs.sort_unstable();
        pairs.chunk_by(|a, b| a == b).map(|run| (run[0].0, run[0].1, run.len() as u32)).collect()
    }

    /// For each superpixel its neighbours, with the number of pixel sides shared.
    pub(super) fn neighbors(&self) -> Vec<Vec<(u32, u32)>> {
        let mut neighbors = vec![Vec::new(); self.cells.len()];
        for (a, b, sides) in self.adjacent() {
            neighbors[a as usize].push((b, sides));
            neighbors[b as usize].push((a, sides));
        }
        neighbors
    }

    /// The pixels of each superpixel: those of cell i are `pixels[starts[i]..starts[i + 1]]`, in row order.
    pub(super) fn members(&self) -> Members {
        let mut starts = vec![0usize; self.cells.len() + 1];
        for &cell in self.plane.iter().filter(|&&cell| cell != NONE) {
            starts[cell as usize + 1] += 1;
        }
        for i in 1..starts.len() {
            starts[i] += starts[i - 1];
        }
        let mut next = starts.clone();
        let mut pixels = vec![0u32; starts.last().copied().unwrap_or(0)];
        for (p, &cell) in self.plane.iter().enumerate().filter(|&(_, &cell)| cell != NONE) {
            pixels[next[cell as usize]] = p as u32;
            next[cell as usize] += 1;
        }
        Members { starts, pixels }
    }
}

/// Pixels by superpixel, see [`Superpixels::members`].
#[derive(Debug)]
pub(super) struct Members {
    starts: Vec<usize>,
    pixels: Vec<u32>,
}

impl Members {
    pub(super) fn of(&self, cell: u32) -> &[u32] {
        &self.pixels[self.starts[cell as usize]..self.starts[cell as usize + 1]]
    }
}

#[cfg(test)]
mod tests {
    use super::{NONE, Raster, Superpixels};

    #[test]
    fn sums_follow_reassignment_and_recount_agrees() {
        let mut map = Superpixels::new(Raster::new(2, 2));
        let colors = [[10.0, 0.0, 0.0], [20.0, 1.0, 0.0], [30.0, 0.0, 2.0], [40.0, 0.0, 0.0]];
        let (a, b) = (map.add(None, [0, 0]), map.add(None, [0, 0]));
        for (p, &color) in colors.iter().enumerate() {
            map.reassign(p, a, color);
        }
        map.reassign(3, b, colors[3]);
        assert_eq!((map.cells[0].area, map.cells[1].area), (3, 1));
        assert_eq!(map.cells[0].color(), [20.0, 1.0 / 3.0, 2.0 / 3.0]);
        assert_eq!(map.cells[1].place(), [1.0, 1.0]);
        let before = map.cells.clone();
        map.recount(&colors);
        assert_eq!(map.cells, before);
        assert_eq!(map.adjacent(), [(0, 1, 2)]);
        assert_eq!(map.members().of(a), [0, 1, 2]);
        map.reassign(3, a, colors[3]);
        map.drop_empty();
        assert_eq!((map.cells.len(), map.plane.contains(&NONE)), (1, false));
    }
}
