//! The lattice row by row: the labels around each vertex.
//!
//! In: a lattice. Out: the labels of the cell above a vertex. Forbidden here: what to make of them.

use super::slots::CellCorner;
use crate::vectorize::lattice::Lattice;
use crate::video::Label;

/// A row of lattice vertices and the cells above it.
#[derive(Debug, Clone, Copy)]
pub(super) struct CellRow<'a> {
    /// Labels of the pixel rows that bound the cells, by the y and t bits of a [`CellCorner`]. Beyond the last row or
    /// plane they repeat.
    labels: [&'a [Label]; 4],
    columns: usize,
    /// Whether there is a next row and a next plane, bits as in [`CellCorner`].
    axes: CellCorner,
}

impl<'a> CellRow<'a> {
    /// The cells above row `row` of plane `plane`.
    pub(super) fn new(lattice: &Lattice<'a>, row: usize, plane: usize) -> Self {
        let next_row = usize::from(row + 1 < lattice.rows());
        let next_plane = usize::from(plane + 1 < lattice.planes());
        let labels = [0, 1, 2, 3].map(|c| lattice.label_row(row + (c & 1) * next_row, plane + (c >> 1) * next_plane));
        let axes = (next_row << 1 | next_plane << 2) as CellCorner;
        Self { labels, columns: lattice.columns(), axes }
    }

    /// Directions in which the lattice goes on from column `column`, bits as in [`CellCorner`].
    #[inline]
    pub(super) fn axes(&self, column: usize) -> CellCorner {
        self.axes | CellCorner::from(column + 1 < self.columns)
    }

    /// Labels of the corners of the cell above column `column`; beyond the lattice they repeat.
    #[inline]
    pub(super) fn labels(&self, column: usize) -> [Label; 8] {
        let last = self.labels[0].len() - 1;
        let (left, right) = (column.min(last), (column + 1).min(last));
        let [a, b, c, d] = self.labels;
        [a[left], a[right], b[left], b[right], c[left], c[right], d[left], d[right]]
    }

    /// Number of cells: one less than there are columns, none on the last row or plane.
    pub(super) fn cell_count(&self) -> usize {
        if self.axes == 6 { self.columns - 1 } else { 0 }
    }
}

/// Whether all corners have one label: then nothing is cut.
#[inline]
pub(super) fn is_uniform(labels: &[Label; 8]) -> bool {
    labels[1..].iter().fold(0, |differences, label| differences | (label.0 ^ labels[0].0)) == 0
}
