//! Labels at the lines of a layer: where cells must be small for them, and where the edges of larger ones are cut.
//!
//! In: planes of labels and the axes. Out: answers about boxes and edges of the layer. Forbidden here: colours.
//!
//! A tet between two labels may be as large as its piece of their surface is flat. Everything else between labels, three
//! of them in a place or a surface that bends, takes cells of the smallest size.

use super::axis::Axis;
use crate::vectorize::parallel::map;
use crate::video::{Label, LabelPlane};

/// How far past each other the samples of two labels may reach, in samples along the normal of the plane between them: a
/// flat surface has as much of a staircase.
const SLACK: f32 = 1.0;

/// Labels at the lines of a layer.
#[derive(Debug)]
pub(super) enum LayerLabels {
    /// All is one label.
    Uniform(Label),
    /// Labels differ.
    Mixed(MixedLabels),
}

/// Labels that differ.
#[derive(Debug)]
pub(super) struct MixedLabels {
    /// Lines in x, y, t.
    size: [usize; 3],
    /// Labels along x for each (t, y).
    rows: Vec<Vec<Label>>,
    /// Whether labels differ at the corners of each of the smallest cells, in rows as above.
    mixed: Vec<Vec<bool>>,
}

/// Where an edge passes from one label to the other.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Crossing {
    /// Samples of the first label's part, less one: it lies between this one and the next.
    pub(super) before: usize,
    /// Samples from end to end, less one.
    pub(super) steps: usize,
    /// The last sample of the first label and the first one of the other.
    pub(super) samples: [[usize; 3]; 2],
    /// The two labels.
    pub(super) labels: [Label; 2],
}

impl LayerLabels {
    pub(super) fn new(axes: &[Axis; 3], planes: &[LabelPlane]) -> Self {
        let first = planes[0].labels()[0];
        if planes.iter().all(|plane| plane.is_uniform() && plane.labels()[0] == first) {
            return Self::Uniform(first);
        }
        let [columns, lines, times] = axes.each_ref().map(Axis::lines);
        let row = |n: usize| {
            let (plane, line) = (&planes[times[n / lines.len()].low], lines[n % lines.len()].low);
            let start = line * plane.width() as usize;
            columns.iter().map(|column| plane.labels()[start + column.low]).collect()
        };
        let rows = map((0..lines.len() * times.len()).collect(), row);
        Self::Mixed(MixedLabels::new([columns.len(), lines.len(), times.len()], rows))
    }

    /// The label at a vertex.
    #[inline]
    pub(super) fn at(&self, vertex: [usize; 3]) -> Label {
        match self {
            Self::Uniform(label) => *label,
            Self::Mixed(labels) => labels.at(vertex),
        }
    }
}

impl MixedLabels {
    fn new(size: [usize; 3], rows: Vec<Vec<Label>>) -> Self {
        let cells = |n: usize| {
            let (y, z) = (n % size[1], n / size[1]);
            if y + 1 == size[1] || z + 1 == size[2] {
                return Vec::new();
            }
            let around = [n, n + 1, n + size[1], n + size[1] + 1].map(|n| &rows[n]);
            let differs = |x: usize| around.iter().any(|row| row[x..=x + 1].iter().any(|&l| l != around[0][x]));
            (0..size[0] - 1).map(differs).collect()
        };
        let mixed = map((0..rows.len()).collect(), cells);
        Self { size, rows, mixed }
    }

    #[inline]
    pub(super) fn at(&self, [x, y, z]: [usize; 3]) -> Label {
        self.rows[z * self.size[1] + y][x]
    }

    /// Whether the tets around a vertex of step `step` must be split there for the sake of labels.
    pub(super) fn need(&self, vertex: [usize; 3], step: usize) -> bool {
        let low = vertex.map(|n| n.saturating_sub(step));
        let high = std::array::from_fn(|axis| (vertex[axis] + step).min(self.size[axis] - 1));
        self.is_mixed(low, high) && !self.is_flat(low, high)
    }

    /// Whether labels differ in a box of samples.
    fn is_mixed(&self, low: [usize; 3], high: [usize; 3]) -> bool {
        (low[2]..high[2]).any(|z| {
            (low[1]..high[1]).any(|y| self.mixed[z * self.size[1] + y][low[0]..high[0]].iter().any(|&mixed| mixed))
        })
    }

    /// Whether a plane parts the labels of a box of samples, which are two.
    ///
    /// The plane's normal has as its components the differences of label between opposite sides: what the surface covers as
    /// it is seen along each axis.
    fn is_flat(&self, low: [usize; 3], high: [usize; 3]) -> bool {
        let first = self.at(low);
        let (mut other, mut normal) = (None, [0i32; 3]);
        let rows = || (low[2]..=high[2]).flat_map(|z| (low[1]..=high[1]).map(move |y| (y, z)));
        for (y, z) in rows() {
            for (x, &label) in self.row(y, z, low, high) {
                if label == first {
                    continue;
                }
                if *other.get_or_insert(label) != label {
                    return false;
                }
                for (axis, n) in [x, y, z].into_iter().enumerate() {
                    normal[axis] += i32::from(n == high[axis]) - i32::from(n == low[axis]);
                }
            }
        }
        let normal = normal.map(|n| n as f32);
        let along = |vertex: [usize; 3]| -> f32 { (0..3).map(|axis| normal[axis] * vertex[axis] as f32).sum() };
        let (mut last, mut next) = (f32::NEG_INFINITY, f32::INFINITY);
        for (y, z) in rows() {
            for (x, &label) in self.row(y, z, low, high) {
                let at = along([x, y, z]);
                if label == first {
                    last = last.max(at);
                } else {
                    next = next.min(at);
                }
            }
        }
        let length = normal.iter().map(|n| n * n).sum::<f32>().sqrt();
        length > 0.0 && last - next <= SLACK * length
    }

    /// The labels along x in a box, with their x.
    fn row(&self, y: usize, z: usize, low: [usize; 3], high: [usize; 3]) -> impl Iterator<Item = (usize, &Label)> {
        (low[0]..).zip(&self.rows[z * self.size[1] + y][low[0]..=high[0]])
    }

    /// Where an edge of the lattice passes between labels, if its ends differ. Were there several places, the one that
    /// leaves the first label its number of samples.
    pub(super) fn crossing(&self, ends: [[usize; 3]; 2]) -> Option<Crossing> {
        let [start, end] = ends;
        let steps = (0..3).map(|axis| start[axis].abs_diff(end[axis])).max().unwrap_or(0);
        let labels = ends.map(|end| self.at(end));
        if labels[0] == labels[1] {
            return None;
        }
        let sample = |n: usize| std::array::from_fn(|axis| step_between([start[axis], end[axis]], n, steps));
        let is_first = |n: usize| self.at(sample(n)) == labels[0];
        let count = (0..=steps).filter(|&n| is_first(n)).count();
        let before = (0..count).rev().find(|&n| is_first(n)).map_or(start, sample);
        let after = (count..steps).find(|&n| self.at(sample(n)) == labels[1]).map_or(end, sample);
        Some(Crossing { before: count - 1, steps, samples: [before, after], labels })
    }
}

/// The line after `n` of so many steps from one line to another.
pub(super) fn step_between([start, end]: [usize; 2], n: usize, steps: usize) -> usize {
    (start * (steps - n) + end * n) / steps
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(side: usize, label: impl Fn([usize; 3]) -> u32) -> MixedLabels {
        let row = |n: usize| (0..side).map(|x| Label(label([x, n % side, n / side]))).collect();
        MixedLabels::new([side; 3], (0..side * side).map(row).collect())
    }

    #[test]
    fn planes_need_no_small_cells_in_any_direction() {
        for normal in [[1.0, 0.0, 0.0], [1.0, 0.3, 0.0], [0.5, -0.4, 1.0], [1.0, 1.0, 1.0], [0.2, 0.9, -0.6]] {
            let side = |v: [usize; 3]| {
                let along: f32 = (0..3).map(|a| normal[a] * (v[a] as f32 - 4.1)).sum();
                u32::from(along > 0.0)
            };
            let labels = labels(9, side);
            for step in [1, 2, 4] {
                assert!(!labels.need([4, 4, 4], step), "{normal:?}, step {step}");
            }
        }
    }

    #[test]
    fn strokes_corners_and_three_labels_need_small_cells() {
        let stroke = labels(9, |[x, ..]| u32::from(x == 4));
        let wedge = labels(9, |[x, y, _]| u32::from(x > 4 && y > 4));
        let three = labels(9, |[x, y, _]| if x < 4 { 0 } else { 1 + u32::from(y > 4) });
        for (labels, name) in [(&stroke, "stroke"), (&wedge, "corner"), (&three, "three")] {
            assert!(labels.need([4, 4, 4], 4), "{name}");
        }
        assert!(!wedge.need([2, 2, 2], 2), "one label alone");
    }

    #[test]
    fn edges_are_cut_between_the_samples_of_their_labels() {
        let labels = labels(9, |[x, ..]| u32::from(x > 2));
        let crossing = labels.crossing([[0, 0, 8], [8, 8, 8]]).unwrap();
        let [first, second] = [0, 1].map(Label);
        let expected = Crossing { before: 2, steps: 8, samples: [[2, 2, 8], [3, 3, 8]], labels: [first, second] };
        assert_eq!(crossing, expected);
        let back = labels.crossing([[3, 0, 8], [2, 0, 8]]).unwrap();
        let expected = Crossing { before: 0, steps: 1, samples: [[3, 0, 8], [2, 0, 8]], labels: [second, first] };
        assert_eq!(back, expected);
        assert_eq!(labels.crossing([[0, 0, 0], [0, 8, 0]]), None);
    }
}
