//! Names for the simplices of the Kuhn lattice, so that points are found by arithmetic instead of by hashing.
//!
//! A simplex of the lattice is a chain of corners of one cell, each a step further along some axes. It is *owned* by
//! its lowest corner, the first of the chain, and named there by its *slot*. So each simplex has one owner and one
//! slot, whichever cell or tet asks.
//!
//! In: labels around a lattice vertex, wedge numbers. Out: which slots hold a point, and whose wedge is where.
//! Forbidden here: pixels, positions, growing tables.

use crate::video::Label;

/// A corner of a cell relative to its lowest one: bit 0 is a step in x, bit 1 in y, bit 2 in t.
pub(super) type CellCorner = u8;

/// Corners of a lattice tet, one bit each in the order of its chain: a simplex of the tet.
pub(super) type Subset = u8;

/// Chains of the simplices of at least two corners that a lattice vertex owns, by slot: edges, faces, tets.
///
/// Corners ascend along a chain, so its order is that of positions by (t, y, x), in every cell and every chunk.
pub(super) const CHAINS: [&[CellCorner]; 25] = [
    &[0, 1],
    &[0, 2],
    &[0, 3],
    &[0, 4],
    &[0, 5],
    &[0, 6],
    &[0, 7],
    &[0, 1, 3],
    &[0, 1, 5],
    &[0, 1, 7],
    &[0, 2, 3],
    &[0, 2, 6],
    &[0, 2, 7],
    &[0, 4, 5],
    &[0, 4, 6],
    &[0, 4, 7],
    &[0, 3, 7],
    &[0, 5, 7],
    &[0, 6, 7],
    &[0, 1, 3, 7],
    &[0, 1, 5, 7],
    &[0, 2, 3, 7],
    &[0, 2, 6, 7],
    &[0, 4, 5, 7],
    &[0, 4, 6, 7],
];
const FIRST_FACE: usize = 7;
const FIRST_TET: usize = 19;
const NOT_EDGES: u32 = u32::MAX << FIRST_FACE;
const NOT_FACES: u32 = u32::MAX << FIRST_TET;

/// The six lattice tets of a cell (Kuhn's subdivision) as chains, with whether the chain is positively oriented.
pub(super) const KUHN_TETS: [([CellCorner; 4], bool); 6] = [
    ([0, 1, 3, 7], true),
    ([0, 1, 5, 7], false),
    ([0, 2, 3, 7], false),
    ([0, 2, 6, 7], true),
    ([0, 4, 5, 7], true),
    ([0, 4, 6, 7], false),
];

/// Wedges and points of a lattice vertex and the simplices it owns.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Owner {
    /// Number of the lattice vertex's wedge; those of its points follow by slot, then by corner.
    pub(super) first_wedge: u32,
    /// Slots that hold a cut, triple or quadruple point, one bit each.
    pub(super) points: u32,
}

impl Owner {
    /// Which slots hold a point: the simplices whose corners all differ in label. `labels` are those of the cell above
    /// the vertex; corners beyond the lattice are out of the reach of `axes`, bits as in [`CellCorner`].
    pub(super) fn find_points(labels: &[Label; 8], axes: CellCorner) -> u32 {
        let has_point = |chain: &[CellCorner]| {
            let (last, rest) = (chain[chain.len() - 1], &chain[1..]);
            last & !axes == 0
                && rest.iter().enumerate().all(|(n, &c)| {
                    chain[..=n].iter().all(|&lower| labels[usize::from(lower)] != labels[usize::from(c)])
                })
        };
        CHAINS.iter().enumerate().fold(0, |points, (slot, chain)| points | (u32::from(has_point(chain)) << slot))
    }

    /// Number of vertices: the lattice vertex and the points.
    pub(super) fn vertex_count(self) -> u32 {
        1 + self.points.count_ones()
    }

    /// Number of wedges: one of the lattice vertex, and at a point one for each corner of its simplex.
    pub(super) fn wedge_count(self) -> u32 {
        wedges_before(self.points)
    }

    /// Number of the first wedge at `slot`.
    #[inline]
    pub(super) fn wedge_at(self, slot: u8) -> u32 {
        self.first_wedge + wedges_before(self.points & !(u32::MAX << slot))
    }
}

/// The lattice vertex's wedge and those of `points`: an edge has two, a face three, a tet four.
#[inline]
fn wedges_before(points: u32) -> u32 {
    1 + 2 * points.count_ones() + (points & NOT_EDGES).count_ones() + (points & NOT_FACES).count_ones()
}

/// Where the wedges of a tet's simplex are.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Place {
    /// Corner of the cell that owns the simplex.
    pub(super) owner: CellCorner,
    /// Its slot there; none for the corner itself.
    pub(super) slot: Option<u8>,
}

/// Places of the simplices of a cell's six tets.
#[derive(Debug)]
pub(super) struct PlaceTable([[Place; 16]; 6]);

impl PlaceTable {
    /// Looks up every subset of every tet's corners.
    pub(super) fn new() -> Self {
        let place = |chain: [CellCorner; 4], subset: usize| {
            let corners: Vec<_> = (0..4).filter(|c| subset >> c & 1 == 1).map(|c| chain[c]).collect();
            let owner = corners.first().copied().unwrap_or_default();
            let steps: Vec<_> = corners.iter().map(|corner| corner ^ owner).collect();
            let slot = CHAINS.iter().position(|&chain| chain == steps).map(|slot| slot as u8);
            Place { owner, slot }
        };
        Self(KUHN_TETS.map(|(chain, _)| std::array::from_fn(|subset| place(chain, subset))))
    }

    /// Place of simplex `subset` of lattice tet `tet`.
    #[inline]
    pub(super) fn place(&self, tet: usize, subset: Subset) -> Place {
        self.0[tet][usize::from(subset)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_simplex_of_a_cell_has_a_place_of_its_own() {
        let table = PlaceTable::new();
        let mut simplices = std::collections::BTreeMap::new();
        for (tet, (chain, _)) in KUHN_TETS.iter().enumerate() {
            for subset in 1..16u8 {
                let corners: Vec<_> = (0..4).filter(|c| subset >> c & 1 == 1).map(|c| chain[c]).collect();
                let place = table.place(tet, subset);
                assert_eq!(place.slot.is_none(), corners.len() == 1);
                let key = (place.owner, place.slot);
                assert_eq!(*simplices.entry(key).or_insert(corners.clone()), corners, "one simplex a place");
            }
        }
        // Kuhn's cell: 8 corners, 12 + 6 + 1 edges, 12 + 6 faces, 6 tets.
        assert_eq!(simplices.len(), 8 + 19 + 18 + 6);
    }

    #[test]
    fn wedge_numbers_follow_slot_by_slot() {
        let labels = std::array::from_fn(|corner| Label(corner as u32));
        for axes in 0..8 {
            let owner = Owner { first_wedge: 10, points: Owner::find_points(&labels, axes) };
            let mut next = 11;
            for (slot, chain) in CHAINS.iter().enumerate() {
                if chain.iter().all(|corner| corner & !axes == 0) {
                    assert_eq!(owner.wedge_at(slot as u8), next);
                    next += chain.len() as u32;
                }
            }
            assert_eq!(10 + owner.wedge_count(), next);
        }
    }
}
