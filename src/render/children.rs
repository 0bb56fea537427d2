//! A tet's eight children over its ten nodes, and which diagonal splits the octahedron between them (§V, Fig. 4a).
//!
//! Nodes 0 to 3 of a parent are its corners, node 4 + i is the point of its edge i ([`EDGES`](crate::mesh::EDGES)).

use glam::{I64Vec3, IVec3};

/// The children for each diagonal, over a parent's ten nodes: first the four at the corners, then the four around the
/// diagonal. All are positive where the parent is and nothing was smoothed.
pub(super) const CHILDREN: [[[u8; 4]; 8]; 3] = [
    around([[4, 9, 5, 6], [4, 9, 6, 8], [4, 9, 8, 7], [4, 9, 7, 5]]),
    around([[5, 8, 4, 7], [5, 8, 7, 9], [5, 8, 9, 6], [5, 8, 6, 4]]),
    around([[6, 7, 4, 5], [6, 7, 5, 9], [6, 7, 9, 8], [6, 7, 8, 4]]),
];

const fn around(inner: [[u8; 4]; 4]) -> [[u8; 4]; 8] {
    let outer = [[0, 4, 5, 6], [4, 1, 7, 8], [5, 7, 2, 9], [6, 8, 9, 3]];
    [outer[0], outer[1], outer[2], outer[3], inner[0], inner[1], inner[2], inner[3]]
}

/// Which of the three diagonals (row of [`CHILDREN`]) splits a parent: the shortest before smoothing, as short
/// diagonals give the roundest children (Zhang 1995); among equals the one that pairs the parent's lowest corner in
/// the order of (x, y, t) with the lowest other corner. So the choice follows from positions alone, and encoder
/// and decoder agree however the stream orders a tet's corners.
pub(super) fn diagonal(corners: [IVec3; 4]) -> usize {
    let [a, b, c, d] = corners.map(|p| p.as_i64vec3());
    let lengths = [a + b - c - d, a + c - b - d, a + d - b - c].map(I64Vec3::length_squared);
    let keys = corners.map(|p| p.to_array());
    let lowest = (0..4).min_by_key(|&i| keys[i]).unwrap_or(0);
    // Row r pairs corner 0 with corner r + 1, and the other two with one another.
    let partner = |row: usize| match (lowest, row + 1) {
        (0, other) => other,
        (lowest, other) if lowest == other => 0,
        (lowest, other) => 6 - lowest - other,
    };
    (0..3).min_by_key(|&row| (lengths[row], keys[partner(row)])).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{EDGES, volume6};

    fn ten(corners: [IVec3; 4]) -> [IVec3; 10] {
        let middle = EDGES.map(|[i, j]| (corners[i] + corners[j]) / 2);
        std::array::from_fn(|i| if i < 4 { corners[i] } else { middle[i - 4] })
    }

    #[test]
    fn children_are_positive_and_equal_in_volume() {
        let corners = [[0, 0, 0], [8, 2, 0], [0, 6, 2], [4, 2, 10]].map(IVec3::from_array);
        let nodes = ten(corners);
        let parent = volume6(corners[0], corners[1], corners[2], corners[3]);
        for children in CHILDREN {
            for child in children {
                let [a, b, c, d] = child.map(|i| nodes[i as usize]);
                assert_eq!(8 * volume6(a, b, c, d), parent, "{child:?}");
            }
        }
    }

    #[test]
    fn diagonal_does_not_depend_on_the_order_of_corners() {
        // A regular tet: all three diagonals are of one length, so that the tie decides.
        let shapes = [[[0, 0, 0], [2, 2, 0], [2, 0, 2], [0, 2, 2]], [[0, 0, 0], [8, 2, 0], [0, 6, 2], [4, 2, 10]]];
        for corners in shapes.map(|s| s.map(IVec3::from_array)) {
            let ends = |order: [usize; 4]| {
                let corners = order.map(|i| corners[i]);
                let [p, q, ..] = CHILDREN[diagonal(corners)][4];
                let nodes = ten(corners);
                let mut ends = [nodes[p as usize].to_array(), nodes[q as usize].to_array()];
                ends.sort_unstable();
                ends
            };
            let expected = ends([0, 1, 2, 3]);
            for order in [[1, 0, 3, 2], [2, 3, 0, 1], [3, 1, 0, 2], [0, 2, 3, 1], [1, 3, 2, 0], [2, 0, 1, 3]] {
                assert_eq!(ends(order), expected, "{order:?}");
            }
        }
    }
}
