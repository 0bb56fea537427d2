//! Which vertices of the bisection hierarchy are worth having.
//!
//! In: colours and labels at the lines of a layer. Out: an importance a lattice vertex, saturated: never less than
//! that of a vertex whose tets come from splitting its own. So whatever the threshold, the vertices above it make a
//! conforming mesh (Gerstner and Rumpf, "Multiresolutional parallel isosurface extraction based on tetrahedral
//! bisection", 1999).
//!
//! The vertex of step s (the largest power of two that divides its index) has one, two or three odd coordinates in
//! units of s: it is the middle of an edge, a face or a cell of side 2 s, and splits the diagonal there. What it needs:
//! an edge's middle those of its faces, a face's those of its cells, a cell's those of the three edges of the next
//! larger cell that meet in its outer corner.

use super::axis::{Axis, CELL};
use super::samples::{Grid, LEVELS};
use crate::vectorize::parallel::{for_each, map};

/// Importance of a vertex that labels ask for.
pub(super) const NEEDED: f32 = f32::INFINITY;

/// Below this, nothing is to be seen; its inverse is finite.
const LEAST_THRESHOLD: f32 = 1e-3;

/// Most vertices that there are for the sake of those at which nothing changes, as a part of the dense lattice's.
const MOST_PART: f64 = 0.5;

/// Most of the threshold that the change at such a vertex may come to; noise stays above.
const MOST_CHANGE: f32 = 0.125;

/// Volume of the tets that a vertex splits, in sixths of s^3 where s is its step: by number of odd coordinates.
const SUPPORT: [f32; 4] = [0.0, 16.0, 16.0, 48.0];

/// An importance a vertex of the layer, plane by plane.
#[derive(Debug, Clone)]
pub(super) struct Importance {
    /// Vertices in a row, rows, planes.
    size: [usize; 3],
    planes: Vec<Vec<f32>>,
}

impl Importance {
    /// The squared colour error, in squared levels times cubic pixels, that a vertex takes away: unsaturated.
    pub(super) fn of_colors(axes: &[Axis; 3], pyramid: &[Grid; LEVELS]) -> Self {
        let size = axes.each_ref().map(|axis| axis.steps() + 1);
        let mut planes = vec![vec![0.0; size[0] * size[1]]; size[2]];
        let rows = planes.iter_mut().flat_map(|plane| plane.chunks_mut(size[0])).enumerate().collect();
        for_each(rows, |(n, row): (usize, &mut [f32])| {
            for (x, value) in row.iter_mut().enumerate() {
                *value = own_error([x, n % size[1], n / size[1]], pyramid);
            }
        });
        Self { size, planes }
    }

    /// Makes the vertices important that `is_needed` says of, given the vertex and its step.
    pub(super) fn need(&mut self, is_needed: impl Fn([usize; 3], usize) -> bool + Sync) {
        let (columns, lines) = (self.size[0], self.size[1]);
        let rows = self.planes.iter_mut().flat_map(|plane| plane.chunks_mut(columns)).enumerate().collect();
        for_each(rows, |(n, row): (usize, &mut [f32])| {
            for (x, value) in row.iter_mut().enumerate() {
                let vertex = [x, n % lines, n / lines];
                let level = (vertex[0] | vertex[1] | vertex[2]).trailing_zeros();
                if level < CELL.trailing_zeros() && is_needed(vertex, 1 << level) {
                    *value = NEEDED;
                }
            }
        });
    }

    /// Lets no vertex be less important than those that need it.
    pub(super) fn saturate(&mut self) {
        let mut step = 1;
        while step < CELL {
            // Faces need what their edges need, cells what their faces need.
            self.gather(step, 2, &axis_offsets(step));
            self.gather(step, 3, &axis_offsets(step));
            if 2 * step < CELL {
                self.gather(2 * step, 1, &edge_cells(step));
            }
            step *= 2;
        }
    }

    /// Raises the vertices of step `step` with `odd` odd coordinates to the most of those at `offsets`, of which each
    /// kind of vertex uses some, and which have another number of odd coordinates or another step.
    fn gather(&mut self, step: usize, odd: i32, offsets: &Offsets) {
        let planes: Vec<usize> = (0..self.size[2]).step_by(step).collect();
        let raised = map(planes.clone(), |z| self.raised_plane(z, step, odd, offsets));
        for (z, plane) in planes.into_iter().zip(raised) {
            self.planes[z] = plane;
        }
    }

    /// Plane `z` as [`Self::gather`] leaves it.
    fn raised_plane(&self, z: usize, step: usize, odd: i32, offsets: &Offsets) -> Vec<f32> {
        let [columns, lines, planes] = self.size;
        let mut plane = self.planes[z].clone();
        for y in (0..lines).step_by(step) {
            // Along x every second vertex has the right number of odd coordinates, or none has.
            let first = match odd - ((z / step) & 1) as i32 - ((y / step) & 1) as i32 {
                1 => step,
                0 => 0,
                _ => continue,
            };
            for x in (first..columns).step_by(2 * step) {
                let pattern = ((x / step) & 1) | (((y / step) & 1) << 1) | (((z / step) & 1) << 2);
                let most = &mut plane[y * columns + x];
                for &[dx, dy, dz] in &offsets[pattern] {
                    let at = [x.wrapping_add_signed(dx), y.wrapping_add_signed(dy), z.wrapping_add_signed(dz)];
                    if at[0] < columns && at[1] < lines && at[2] < planes {
                        *most = most.max(self.planes[at[2]][at[1] * columns + at[0]]);
                    }
                }
            }
        }
        plane
    }

    /// The importance that `count` vertices exceed; those that labels need are not counted, and of those at which nothing
    /// changes from step to step each counts `repeats`, as long as they are not more than [`MOST_PART`] of all.
    pub(super) fn threshold(&self, count: usize, repeats: f64, pyramid: &[Grid; LEVELS]) -> f32 {
        let [columns, lines, planes] = self.size;
        // The first plane is the last layer's.
        let histograms = map((1..planes).collect(), |z| {
            let mut histogram = Histogram::new();
            for (n, &value) in self.planes[z].iter().enumerate() {
                histogram.add(value, change([n % columns, n / columns, z], self.size, pyramid) / MOST_CHANGE);
            }
            histogram
        });
        let most = count.max(((columns * lines * (planes - 1)) as f64 * MOST_PART) as usize);
        let whole = histograms.into_iter().reduce(Histogram::joined).unwrap_or_else(Histogram::new);
        whole.threshold(count, repeats, most).max(LEAST_THRESHOLD)
    }

    /// Divides all importances by `threshold`.
    pub(super) fn normalize(&mut self, threshold: f32) {
        let factor = 1.0 / threshold;
        self.planes.iter_mut().flatten().for_each(|value| *value *= factor);
    }

    /// Gives the plane shared with the layer after this one the greater of both importances.
    pub(super) fn join(&mut self, next: &mut Self) {
        let last = self.planes.len() - 1;
        for (a, b) in self.planes[last].iter_mut().zip(&mut next.planes[0]) {
            let most = a.max(*b);
            (*a, *b) = (most, most);
        }
    }

    #[inline]
    pub(super) fn at(&self, [x, y, z]: [usize; 3]) -> f32 {
        self.planes[z][y * self.size[0] + x]
    }

    /// Vertices in a row, rows, planes.
    pub(super) fn size(&self) -> [usize; 3] {
        self.size
    }
}

/// The two ends of the diagonal that a vertex splits: each odd coordinate goes to where larger cells have their outer
/// corner at one end, to their middle at the other. Cells of the coarsest level all point the same way.
#[inline]
fn diagonal(vertex: [usize; 3], step: usize) -> [[usize; 3]; 2] {
    let (mut low, mut high) = (vertex, vertex);
    for axis in 0..3 {
        if (vertex[axis] / step) & 1 == 1 {
            let (before, after) = (vertex[axis] - step, vertex[axis] + step);
            let is_outer = step == CELL / 2 || before.is_multiple_of(4 * step);
            (low[axis], high[axis]) = if is_outer { (before, after) } else { (after, before) };
        }
    }
    [low, high]
}

/// What interpolation along a vertex's diagonal misses there, over the volume that its tets fill.
#[inline]
fn own_error(vertex: [usize; 3], pyramid: &[Grid; LEVELS]) -> f32 {
    let level = (vertex[0] | vertex[1] | vertex[2]).trailing_zeros();
    if level >= CELL.trailing_zeros() {
        return 0.0;
    }
    let step = 1usize << level;
    let odd = vertex.iter().filter(|&&n| n >> level & 1 == 1).count();
    let at = |vertex: [usize; 3]| pyramid[level as usize].at(vertex.map(|n| n >> level)).map(i32::from);
    let [a, b] = diagonal(vertex, step).map(at);
    let here = at(vertex);
    let squared: i32 = (0..3).map(|c| (2 * here[c] - a[c] - b[c]).pow(2)).sum();
    squared as f32 * (0.25 / 6.0) * SUPPORT[odd] * (step * step * step) as f32
}

/// The squared error of a colour that stays as it is a step earlier or later, over the volume of a vertex's tets.
#[inline]
fn change(vertex: [usize; 3], size: [usize; 3], pyramid: &[Grid; LEVELS]) -> f32 {
    let level = (vertex[0] | vertex[1] | vertex[2]).trailing_zeros();
    if level >= CELL.trailing_zeros() {
        return f32::INFINITY;
    }
    let step = 1usize << level;
    let at = |z: usize| pyramid[level as usize].at([vertex[0], vertex[1], z].map(|n| n >> level)).map(i32::from);
    let here = at(vertex[2]);
    let squared = |there: [i32; 3]| (0..3).map(|c| (here[c] - there[c]).pow(2)).sum::<i32>();
    let before = vertex[2].checked_sub(step).map_or(0, |z| squared(at(z)));
    let after = Some(vertex[2] + step).filter(|&z| z < size[2]).map_or(0, |z| squared(at(z)));
    before.max(after) as f32 * SUPPORT[1] / 6.0 * (step * step * step) as f32
}

/// Vertices by importance: the bits of a non-negative float ascend with its value, and the upper ones make 32 bins an octave.
struct Histogram {
    /// In each bin all vertices of that importance, and those that count in whole from that threshold down.
    bins: Vec<[usize; 2]>,
}

impl Histogram {
    const SHIFT: u32 = 18;

    fn new() -> Self {
        Self { bins: vec![[0; 2]; Self::bin(f32::INFINITY) + 1] }
    }

    fn bin(value: f32) -> usize {
        (value.to_bits() >> Self::SHIFT) as usize
    }

    /// Adds a vertex that counts in whole below the threshold `changes`.
    fn add(&mut self, importance: f32, changes: f32) {
        self.bins[Self::bin(importance)][0] += 1;
        self.bins[Self::bin(importance.min(changes))][1] += 1;
    }

    fn joined(mut self, other: Self) -> Self {
        self.bins.iter_mut().zip(other.bins).for_each(|(own, other)| (0..2).for_each(|n| own[n] += other[n]));
        self
    }

    /// The least threshold that leaves no more than `count` by what they count, and no more than `most` by number.
    fn threshold(&self, count: usize, repeats: f64, most: usize) -> f32 {
        let (mut all, mut whole) = (0, 0);
        // The last bin has what labels need.
        let last = self.bins[..self.bins.len() - 1].iter().rposition(|bin| {
            all += bin[0];
            whole += bin[1];
            let counted = whole as f64 + (all.saturating_sub(whole)) as f64 * repeats;
            counted > count as f64 || all > most
        });
        f32::from_bits((last.unwrap_or(0) as u32 + 1) << Self::SHIFT)
    }
}

/// Offsets to the vertices that need a vertex, by which of its coordinates are odd (bits x, y, t).
type Offsets = [Vec<[isize; 3]>; 8];

/// One step either way along each odd axis.
fn axis_offsets(step: usize) -> Offsets {
    let step = step as isize;
    std::array::from_fn(|odd| {
        let axes = (0..3).filter(|axis| odd >> axis & 1 == 1);
        axes.flat_map(|axis| [-step, step].map(|d| std::array::from_fn(|a| if a == axis { d } else { 0 }))).collect()
    })
}

/// The centres of the cells of half the size whose outer corner is an end of an edge.
fn edge_cells(step: usize) -> Offsets {
    let step = step as isize;
    let corners = (0..8).map(|c: usize| [0, 1, 2].map(|axis| if c >> axis & 1 == 1 { step } else { -step }));
    let corners: Vec<[isize; 3]> = corners.collect();
    std::array::from_fn(|_| corners.clone())
}
