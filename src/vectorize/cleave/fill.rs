//! Second pass: vertices, wedges and tets of each row, written to where the plan says.
//!
//! In: a lattice and its plan. Out: slices of the mesh. Forbidden here: deciding what is cut.

use glam::{IVec3, Vec3};

use super::cells::{CellRow, is_uniform};
use super::plan::{Counts, Plan};
use super::point::inner_point;
use super::slots::{CHAINS, KUHN_TETS, Owner, PlaceTable};
use super::stencil::StencilTable;
use crate::mesh::{TetMesh, VertexId, Wedge, WedgeId};
use crate::vectorize::lattice::Lattice;
use crate::video::Label;

/// A row's share of the mesh.
pub(super) struct RowSlices<'m> {
    /// Number of the lattice row, by (plane, row).
    row: usize,
    first_vertex: u32,
    positions: &'m mut [IVec3],
    wedges: &'m mut [Wedge],
    tets: &'m mut [[WedgeId; 4]],
}

/// Divides the arrays of `mesh` among the rows.
pub(super) fn split_rows<'m>(mesh: &'m mut TetMesh, rows: &[Counts]) -> Vec<RowSlices<'m>> {
    let (mut positions, mut wedges, mut tets) = (&mut mesh.positions[..], &mut mesh.wedges[..], &mut mesh.tets[..]);
    let mut first_vertex = 0;
    let share = |(row, counts): (usize, &Counts)| {
        let slices = RowSlices {
            row,
            first_vertex,
            positions: positions.split_off_mut(..counts.vertices as usize).unwrap_or_default(),
            wedges: wedges.split_off_mut(..counts.wedges as usize).unwrap_or_default(),
            tets: tets.split_off_mut(..counts.tets as usize).unwrap_or_default(),
        };
        first_vertex += counts.vertices as u32;
        slices
    };
    rows.iter().enumerate().map(share).collect()
}

/// What filling a row reads.
pub(super) struct Filler<'a> {
    pub(super) lattice: &'a Lattice<'a>,
    pub(super) plan: &'a Plan,
    pub(super) stencils: &'a StencilTable,
    pub(super) places: &'a PlaceTable,
}

impl Filler<'_> {
    /// Writes a row's vertices and wedges, and the tets of the cells above it.
    pub(super) fn fill(&self, out: RowSlices) {
        let (row, plane) = (out.row % self.lattice.rows(), out.row / self.lattice.rows());
        let cells = CellRow::new(self.lattice, row, plane);
        let (mut positions, mut wedges) = (out.positions.iter_mut(), out.wedges.iter_mut());
        let mut vertex = out.first_vertex;
        for (column, owner) in self.owner_row(row, plane).iter().enumerate() {
            let around = Surroundings { lattice: self.lattice, labels: cells.labels(column), column, row, plane };
            around.write_point(&[0], vertex, &mut positions, &mut wedges);
            vertex += 1;
            for (_, chain) in CHAINS.iter().enumerate().filter(|(slot, _)| owner.points >> slot & 1 == 1) {
                around.write_point(chain, vertex, &mut positions, &mut wedges);
                vertex += 1;
            }
        }
        self.fill_tets(&cells, row, plane, out.tets);
    }

    fn owner_row(&self, row: usize, plane: usize) -> &[Owner] {
        let columns = self.lattice.columns();
        let start = (plane * self.lattice.rows() + row) * columns;
        &self.plan.owners[start..start + columns]
    }

    fn fill_tets(&self, cells: &CellRow, row: usize, plane: usize, tets: &mut [[WedgeId; 4]]) {
        if cells.cell_count() == 0 {
            return;
        }
        let owners = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(y, t)| self.owner_row(row + y, plane + t));
        let mut tets = tets.iter_mut();
        for column in 0..cells.cell_count() {
            let owners: [Owner; 8] = std::array::from_fn(|c| owners[c >> 1][column + (c & 1)]);
            let labels = cells.labels(column);
            if is_uniform(&labels) {
                for ((chain, positive), tet) in KUHN_TETS.iter().zip(&mut tets) {
                    let corners = chain.map(|c| WedgeId(owners[usize::from(c)].first_wedge));
                    *tet = orient(corners, *positive);
                }
            } else {
                self.fill_cut_cell(&owners, &labels, &mut tets);
            }
        }
    }

    fn fill_cut_cell<'m>(
        &self,
        owners: &[Owner; 8],
        labels: &[Label; 8],
        tets: &mut impl Iterator<Item = &'m mut [WedgeId; 4]>,
    ) {
        for (n, (chain, positive)) in KUHN_TETS.iter().enumerate() {
            let stencil = self.stencils.stencil(chain.map(|c| labels[usize::from(c)]));
            let mut first_wedges = [0; 16];
            for &simplex in &stencil.simplices {
                let place = self.places.place(n, simplex);
                let owner = owners[usize::from(place.owner)];
                first_wedges[usize::from(simplex)] = place.slot.map_or(owner.first_wedge, |slot| owner.wedge_at(slot));
            }
            for (pieces, tet) in stencil.tets.iter().zip(&mut *tets) {
                let wedge = |simplex: u8, rank: u8| WedgeId(first_wedges[usize::from(simplex)] + u32::from(rank));
                *tet = orient(pieces.map(|corner| wedge(corner.simplex, corner.rank)), *positive);
            }
        }
    }
}

/// A tet with the orientation of a lattice tet turned positive.
#[inline]
fn orient([a, b, c, d]: [WedgeId; 4], positive: bool) -> [WedgeId; 4] {
    if positive { [a, b, c, d] } else { [a, b, d, c] }
}

/// A lattice vertex and the cell above it.
struct Surroundings<'a> {
    lattice: &'a Lattice<'a>,
    labels: [Label; 8],
    column: usize,
    row: usize,
    plane: usize,
}

impl Surroundings<'_> {
    /// Writes the point of the simplex `chain` as `vertex`, and a wedge for each of its corners, with the label and the
    /// colour of the pixel there.
    #[inline]
    fn write_point<'m>(
        &self,
        chain: &[u8],
        vertex: u32,
        positions: &mut impl Iterator<Item = &'m mut IVec3>,
        wedges: &mut impl Iterator<Item = &'m mut Wedge>,
    ) {
        let mut corners = [IVec3::ZERO; 4];
        for ((&corner, position), wedge) in chain.iter().zip(&mut corners).zip(wedges) {
            let step = |axis: u8| usize::from(corner >> axis & 1);
            let (column, row, plane) = (self.column + step(0), self.row + step(1), self.plane + step(2));
            *position = self.lattice.position(column, row, plane);
            let label = self.labels[usize::from(corner)];
            let colors = self.lattice.color_row(row, plane);
            let color = Vec3::from_array(colors[column.min(colors.len() - 1)].map(f32::from));
            *wedge = Wedge { vertex: VertexId(vertex), label, color };
        }
        if let Some(position) = positions.next() {
            *position = inner_point(&corners[..chain.len()]);
        }
    }
}
