//! Cleaving of tets that are no cells' but anyone's: those of an adaptive lattice.
//!
//! In: a [`TetLattice`]. Out: the mesh of it, split as the dense lattice would be, its edges where it says. Forbidden here: numbering by
//! arithmetic; points between labels are few and found by their corners.

use std::collections::HashMap;

use glam::{IVec3, Vec3};

use super::point::{cut_point, inner_point};
use super::stencil::StencilTable;
use super::{CleaveError, check_size};
use crate::mesh::{TetMesh, Wedge, WedgeId};
use crate::vectorize::lattice::{EdgeCut, TetLattice};

/// Builds the mesh of `lattice`: as [`super::cleave`] does of a dense one.
///
/// # Errors
/// [`CleaveError::TooLarge`] if ids of 32 bits would not do.
pub fn cleave_tets(lattice: &TetLattice) -> Result<TetMesh, CleaveError> {
    // A mixed tet becomes 24 tets at most, with 11 points and 28 wedges of points.
    let is_mixed = |tet: &&[u32; 4]| tet.iter().any(|&v| lattice.labels[v as usize] != lattice.labels[tet[0] as usize]);
    let mixed = lattice.tets.iter().filter(is_mixed).count() as u64;
    let vertices = lattice.positions.len() as u64;
    check_size(vertices + 11 * mixed, vertices + 28 * mixed, lattice.tets.len() as u64 + 23 * mixed)?;
    let mut splitter = Splitter {
        lattice,
        stencils: StencilTable::new(),
        points: HashMap::new(),
        mesh: TetMesh::empty(lattice.domain),
    };
    splitter.mesh.tets.reserve(lattice.tets.len());
    for ((&position, &label), &color) in lattice.positions.iter().zip(&lattice.labels).zip(&lattice.colors) {
        let vertex = splitter.mesh.push_vertex(position);
        splitter.mesh.push_wedge(Wedge { vertex, label, color });
    }
    for &tet in &lattice.tets {
        if is_mixed(&&tet) {
            splitter.split(tet);
        } else {
            // Each vertex of the lattice has one wedge, of the same number.
            splitter.mesh.tets.push(tet.map(WedgeId));
        }
    }
    Ok(splitter.mesh)
}

/// Corners of a simplex in ascending order, the last repeated.
type Simplex = [u32; 4];

struct Splitter<'a> {
    lattice: &'a TetLattice,
    stencils: StencilTable,
    /// First wedge of the point between the corners of a simplex; the others follow in the corners' order.
    points: HashMap<Simplex, u32>,
    mesh: TetMesh,
}

impl Splitter<'_> {
    fn split(&mut self, mut tet: [u32; 4]) {
        // Corners in the order of the lattice, so that all tets around a face split it alike.
        let mut positive = true;
        for last in (1..4).rev() {
            for n in 0..last {
                if tet[n] > tet[n + 1] {
                    tet.swap(n, n + 1);
                    positive = !positive;
                }
            }
        }
        let labels = tet.map(|v| self.lattice.labels[v as usize]);
        let mut first_wedges = [0; 16];
        // The table is small and its entries are shared: taken apart here so that points can be made meanwhile.
        let simplices = self.stencils.stencil(labels).simplices.clone();
        for simplex in simplices {
            first_wedges[usize::from(simplex)] = self.point(tet, simplex);
        }
        for pieces in &self.stencils.stencil(labels).tets {
            let [a, b, c, d] =
                pieces.map(|corner| WedgeId(first_wedges[usize::from(corner.simplex)] + u32::from(corner.rank)));
            self.mesh.tets.push(if positive { [a, b, c, d] } else { [a, b, d, c] });
        }
    }

    /// First wedge of the point of a simplex of `tet`, made if there is none.
    fn point(&mut self, tet: [u32; 4], simplex: u8) -> u32 {
        let members: Vec<u32> = (0..4).filter(|corner| simplex >> corner & 1 == 1).map(|corner| tet[corner]).collect();
        let &[first, .., last] = &members[..] else {
            return members[0];
        };
        let mut key = [last; 4];
        key[..members.len()].copy_from_slice(&members);
        debug_assert!(first < last);
        if let Some(&wedge) = self.points.get(&key) {
            return wedge;
        }
        let wedge = match self.cut(&members) {
            Some(cut) => {
                let position = cut_point(cut.edge.map(|v| self.lattice.positions[v as usize]), cut.share);
                self.push_point(position, cut.edge.into_iter().zip(cut.colors))
            }
            None => {
                let corners: Vec<IVec3> = members.iter().map(|&v| self.lattice.positions[v as usize]).collect();
                let colors = members.iter().map(|&v| (v, self.lattice.colors[v as usize]));
                self.push_point(inner_point(&corners), colors)
            }
        };
        self.points.insert(key, wedge);
        wedge
    }

    /// The lattice's own cut of an edge.
    fn cut(&self, members: &[u32]) -> Option<&EdgeCut> {
        let edge: [u32; 2] = members.try_into().ok()?;
        let found = self.lattice.cuts.binary_search_by_key(&edge, |cut| cut.edge).ok()?;
        Some(&self.lattice.cuts[found])
    }

    /// A point with a wedge of the label of each of `corners`, of these colours. The first wedge.
    fn push_point(&mut self, position: IVec3, corners: impl Iterator<Item = (u32, Vec3)>) -> u32 {
        let (vertex, first) = (self.mesh.push_vertex(position), self.mesh.wedges.len() as u32);
        for (corner, color) in corners {
            self.mesh.push_wedge(Wedge { vertex, label: self.lattice.labels[corner as usize], color });
        }
        first
    }
}
