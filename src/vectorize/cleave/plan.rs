//! First pass: which points there will be, and how much room each row needs.
//!
//! In: a lattice. Out: an owner a lattice vertex, sums a row. Forbidden here: positions, colours, the mesh.

use super::cells::{CellRow, is_uniform};
use super::slots::{KUHN_TETS, Owner};
use super::stencil::StencilTable;
use super::{CleaveError, check_size};
use crate::vectorize::lattice::Lattice;
use crate::vectorize::parallel::for_each;

/// How many of each a row of lattice vertices holds, or all rows before it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) vertices: u64,
    pub(super) wedges: u64,
    pub(super) tets: u64,
}

impl Counts {
    fn add(self, other: Self) -> Self {
        Self {
            vertices: self.vertices + other.vertices,
            wedges: self.wedges + other.wedges,
            tets: self.tets + other.tets,
        }
    }
}

/// Everything about the mesh but its contents.
pub(super) struct Plan {
    /// By (plane, row, column).
    pub(super) owners: Vec<Owner>,
    /// By (plane, row): what the row itself holds.
    pub(super) rows: Vec<Counts>,
    /// What all rows hold.
    pub(super) total: Counts,
}

impl Plan {
    /// Finds all points and numbers the wedges in the order of their owners.
    ///
    /// # Errors
    /// [`CleaveError::TooLarge`] if ids of 32 bits would not do.
    pub(super) fn new(lattice: &Lattice, stencils: &StencilTable) -> Result<Self, CleaveError> {
        let (columns, row_count) = (lattice.columns(), lattice.rows() * lattice.planes());
        let mut owners = vec![Owner::default(); columns * row_count];
        let mut rows = vec![Counts::default(); row_count];
        let jobs = owners.chunks_mut(columns).zip(&mut rows).enumerate().collect();
        for_each(jobs, |(n, (owners, counts)): (usize, (&mut [Owner], &mut Counts))| {
            let cells = CellRow::new(lattice, n % lattice.rows(), n / lattice.rows());
            *counts = count_row(&cells, owners, stencils);
        });
        let total = rows.iter().fold(Counts::default(), |sum, &row| sum.add(row));
        check_size(total.vertices, total.wedges, total.tets)?;
        let mut wedges = 0;
        for (owners, counts) in owners.chunks_mut(columns).zip(&rows) {
            for owner in owners {
                owner.first_wedge += wedges;
            }
            wedges += counts.wedges as u32;
        }
        Ok(Self { owners, rows, total })
    }
}

/// Fills in a row's owners, their wedges numbered from the row's start.
fn count_row(cells: &CellRow, owners: &mut [Owner], stencils: &StencilTable) -> Counts {
    let mut counts = Counts::default();
    let cell_count = cells.cell_count();
    for (column, owner) in owners.iter_mut().enumerate() {
        let labels = cells.labels(column);
        let uniform = is_uniform(&labels);
        let points = if uniform { 0 } else { Owner::find_points(&labels, cells.axes(column)) };
        *owner = Owner { first_wedge: counts.wedges as u32, points };
        counts.vertices += u64::from(owner.vertex_count());
        counts.wedges += u64::from(owner.wedge_count());
        if column >= cell_count {
            continue;
        }
        counts.tets += if uniform {
            KUHN_TETS.len() as u64
        } else {
            let split = |chain: [u8; 4]| stencils.stencil(chain.map(|c| labels[usize::from(c)])).tets.len() as u64;
            KUHN_TETS.iter().map(|&(chain, _)| split(chain)).sum()
        };
    }
    counts
}
