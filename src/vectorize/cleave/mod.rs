//! Cleaving: the dense tetrahedral mesh of a run of frames, split where labels meet (paper §III-B; Bronson, Levine,
//! Whitaker: "Lattice Cleaving: A Multimaterial Tetrahedral Meshing Algorithm with Guarantees", 2014).
//!
//! In: a [`Lattice`]. Out: a [`TetMesh`] that tiles the planes' box exactly, all tets positive, one label each, faces
//! conforming; every lattice vertex has one wedge, every point between labels one a label, with the colour of the
//! pixel on that side. Forbidden here: choices that look further than the simplex at hand, since runs of frames that
//! share a plane must split it alike to be glued there.
//!
//! Every cell of 2 x 2 x 2 lattice vertices is six lattice tets around the diagonal from its lowest to its highest
//! corner. An edge between labels has a cut point, a face of three labels a triple point, a tet of four a quadruple
//! point; `stencil` says how a lattice tet splits between them, `slots` how they are numbered without a search, and
//! `point` where they are. A first pass counts, so that the second writes into arrays of the right size.
//!
//! Vertices, wedges and tets are numbered by (t, y, x) of the lattice vertex that owns them.

mod cells;
mod fill;
mod plan;
mod point;
mod slots;
mod split;
mod stencil;

use glam::{IVec3, Vec3};
use thiserror::Error;

use self::fill::{Filler, split_rows};
use self::plan::Plan;
use self::slots::PlaceTable;
pub use self::split::cleave_tets;
use self::stencil::StencilTable;
use super::lattice::Lattice;
use super::parallel::for_each;
use crate::mesh::{TetMesh, VertexId, Wedge, WedgeId};
use crate::video::Label;

/// Why a lattice could not be cleaved.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum CleaveError {
    /// The mesh would have more elements than ids of 32 bits can number. Cleave fewer frames at a time.
    #[error("{field}: expected at most {limit}, found {found}")]
    TooLarge {
        /// Which elements.
        field: &'static str,
        /// Most that ids can number.
        limit: u64,
        /// How many there would be.
        found: u64,
    },
}

/// Builds the mesh of `lattice`: positions in lattice units, t since the slab's first frame, colours as in the frames,
/// nothing pinned. Its `domain` is the whole slab's, also where the lattice covers a part of it.
///
/// Time and space are linear in the lattice; besides the mesh, 8 bytes a lattice vertex are held.
///
/// # Errors
/// [`CleaveError::TooLarge`], found before the mesh is allocated.
pub fn cleave(lattice: &Lattice) -> Result<TetMesh, CleaveError> {
    let (stencils, places) = (StencilTable::new(), PlaceTable::new());
    let plan = Plan::new(lattice, &stencils)?;
    let blank = Wedge { vertex: VertexId(0), label: Label(0), color: Vec3::ZERO };
    let mut mesh = TetMesh {
        domain: lattice.domain(),
        positions: vec![IVec3::ZERO; plan.total.vertices as usize],
        pinned: vec![false; plan.total.vertices as usize],
        wedges: vec![blank; plan.total.wedges as usize],
        tets: vec![[WedgeId(0); 4]; plan.total.tets as usize],
    };
    let rows = split_rows(&mut mesh, &plan.rows);
    let filler = Filler { lattice, plan: &plan, stencils: &stencils, places: &places };
    for_each(rows, |row| filler.fill(row));
    Ok(mesh)
}

/// Wedges, vertices and corners of tets are all numbered with 32 bits.
fn check_size(vertices: u64, wedges: u64, tets: u64) -> Result<(), CleaveError> {
    let limit = u64::from(u32::MAX);
    for (field, found) in [("vertices", vertices), ("wedges", wedges), ("tet corners", 4 * tets)] {
        if found > limit {
            return Err(CleaveError::TooLarge { field, limit, found });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_what_ids_cannot_number() {
        assert_eq!(check_size(1 << 20, u32::MAX.into(), (1 << 30) - 1), Ok(()));
        let tets = check_size(1 << 20, u32::MAX.into(), 1 << 30);
        assert_eq!(tets, Err(CleaveError::TooLarge { field: "tet corners", limit: u32::MAX.into(), found: 1 << 32 }));
        assert!(check_size(1, 1 << 32, 1).is_err());
    }
}
