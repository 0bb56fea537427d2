//! The generalised stencil: how a lattice tet splits so that each piece has one label (paper §III-B, Fig. 2;
//! Bronson, Levine, Whitaker: "Lattice Cleaving", 2014).
//!
//! Take corners A < B < C < D of a lattice tet, a cut point on every edge, a triple point on every face and a quadruple
//! point inside. The 24 tets (X, XY, XYZ, ABCD), one for each order of the corners, split the lattice tet such that
//! each lies with corner X:
//!
//! ```text
//!         C              face ABC: (A, AB, ABC), (A, AC, ABC), (B, AB, ABC), ...
//!        / \
//!      AC   BC           joined to ABCD, each of these triangles is a tet of the label of its
//!      / ABC \           first point
//!     A--AB---B
//! ```
//!
//! Where corners share a label, points fall together: a simplex has its point not on itself but on its *root*, the
//! simplex of the highest corner of each of its labels. Tets that lose a dimension vanish, and what remains is the
//! stencil of the pattern: 1 tet for one label, 4 or 6 for two, 12 for three, 24 for four. On a face of two labels the
//! quad behind the cut so takes the diagonal from its lower lattice corner; a root depends on the simplex alone, hence
//! all tets around a face split it alike.
//!
//! In: the labels of a tet's corners. Out: tets over subsets of its corners. Forbidden here: positions and ids.

use super::slots::Subset;
use crate::video::Label;

/// A corner of a stencil's tet: a point and the wedge on the tet's side of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct StencilCorner {
    /// The simplex whose point it is: lattice corner, cut, triple or quadruple point by number of corners.
    pub(super) simplex: Subset,
    /// Rank among the simplex's corners of the one that has the tet's label.
    pub(super) rank: u8,
}

/// The split of one pattern.
#[derive(Debug, Clone, Default)]
pub(super) struct Stencil {
    /// Tets, oriented as the lattice tet's chain of corners is.
    pub(super) tets: Vec<[StencilCorner; 4]>,
    /// Simplices whose points the tets use, each once.
    pub(super) simplices: Vec<Subset>,
}

/// Stencils by pattern of labels.
#[derive(Debug)]
pub(super) struct StencilTable(Vec<Stencil>);

impl StencilTable {
    /// Derives the stencils of all 15 ways to share labels among four corners.
    pub(super) fn new() -> Self {
        let mut stencils = vec![Stencil::default(); 64];
        for assignment in 0..256u32 {
            let labels = std::array::from_fn(|corner| Label(assignment >> (2 * corner) & 3));
            let stencil = &mut stencils[pattern(labels)];
            if stencil.tets.is_empty() {
                *stencil = split(labels);
            }
        }
        Self(stencils)
    }

    /// The stencil of a lattice tet whose corners, in the order of its chain, have `labels`.
    #[inline]
    pub(super) fn stencil(&self, labels: [Label; 4]) -> &Stencil {
        &self.0[pattern(labels)]
    }
}

/// Which edges are cut, one bit each: two tets split alike if and only if these agree.
#[inline]
fn pattern([a, b, c, d]: [Label; 4]) -> usize {
    [a != b, a != c, a != d, b != c, b != d, c != d].iter().rev().fold(0, |bits, &cut| bits << 1 | usize::from(cut))
}

/// The generalised stencil with every point moved to its root.
fn split(labels: [Label; 4]) -> Stencil {
    let mut stencil = Stencil::default();
    for (order, even) in orders() {
        let mut simplex = 0;
        let mut roots = order.map(|corner| {
            simplex |= 1 << corner;
            root(labels, simplex)
        });
        if (1..4).any(|n| roots[..n].contains(&roots[n])) {
            continue;
        }
        if !even {
            roots.swap(2, 3);
        }
        let label = labels[order[0]];
        stencil.tets.push(roots.map(|simplex| StencilCorner { simplex, rank: rank(labels, simplex, label) }));
        stencil.simplices.extend(roots);
    }
    stencil.simplices.sort_unstable();
    stencil.simplices.dedup();
    stencil
}

/// The highest corner of each label in `simplex`.
fn root(labels: [Label; 4], simplex: Subset) -> Subset {
    let has = |corner: usize| simplex >> corner & 1 == 1;
    let is_highest = |&corner: &usize| has(corner) && (corner + 1..4).all(|c| !has(c) || labels[c] != labels[corner]);
    (0..4).filter(is_highest).fold(0, |root, corner| root | 1 << corner)
}

/// How many corners of `simplex`, a root, come before the one with `label`.
fn rank(labels: [Label; 4], simplex: Subset, label: Label) -> u8 {
    (0..4).filter(|corner| simplex >> corner & 1 == 1).take_while(|&corner| labels[corner] != label).count() as u8
}

/// The 24 orders of four corners, and whether each is an even permutation.
fn orders() -> impl Iterator<Item = ([usize; 4], bool)> {
    (0..256usize).map(|code| [code & 3, code >> 2 & 3, code >> 4 & 3, code >> 6]).filter_map(|order| {
        let is_permutation = (1..4).all(|n| !order[..n].contains(&order[n]));
        let inversions: usize = (1..4).map(|n| order[..n].iter().filter(|&&c| c > order[n]).count()).sum();
        is_permutation.then_some((order, inversions.is_multiple_of(2)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn five_patterns_have_the_stencils_of_the_literature() {
        let table = StencilTable::new();
        assert_eq!(table.0.iter().filter(|stencil| !stencil.tets.is_empty()).count(), 15);
        for (labels, tets) in
            [([0; 4], 1), ([0, 0, 1, 0], 4), ([1, 0, 0, 1], 6), ([2, 0, 1, 0], 12), ([3, 1, 0, 2], 24)]
        {
            assert_eq!(table.stencil(labels.map(Label)).tets.len(), tets);
        }
    }

    #[test]
    fn corners_lie_on_the_tets_side() {
        for assignment in 0..256u32 {
            let labels: [Label; 4] = std::array::from_fn(|corner| Label(assignment >> (2 * corner) & 3));
            for tet in split(labels).tets {
                let label_of = |corner: StencilCorner| {
                    let mut members = (0..4).filter(|c| corner.simplex >> c & 1 == 1).map(|c| labels[c]);
                    members.nth(corner.rank.into())
                };
                let found = tet.map(label_of);
                assert!(found[0].is_some() && found.iter().all(|&label| label == found[0]), "{labels:?}: {tet:?}");
            }
        }
    }
}
