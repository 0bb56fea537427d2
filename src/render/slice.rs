//! The plane t = c through a tet: a triangle or a quad (§II: a frame is a cross-section of the mesh).

use glam::{DVec2, IVec3, Vec3};

use super::interfaces::Faces;

/// Edges that the plane crosses, as (corner below, corner above), for each set of corners above (bit i: corner i).
/// Slices of positive tets turn from +x to +y.
pub(super) const SLICES: [&[[u8; 2]]; 16] = [
    &[],
    &[[1, 0], [3, 0], [2, 0]],
    &[[0, 1], [2, 1], [3, 1]],
    &[[2, 0], [2, 1], [3, 1], [3, 0]],
    &[[0, 2], [3, 2], [1, 2]],
    &[[1, 2], [1, 0], [3, 0], [3, 2]],
    &[[0, 1], [0, 2], [3, 2], [3, 1]],
    &[[3, 0], [3, 2], [3, 1]],
    &[[0, 3], [1, 3], [2, 3]],
    &[[1, 0], [1, 3], [2, 3], [2, 0]],
    &[[0, 3], [0, 1], [2, 1], [2, 3]],
    &[[2, 0], [2, 1], [2, 3]],
    &[[0, 2], [0, 3], [1, 3], [1, 2]],
    &[[1, 0], [1, 3], [1, 2]],
    &[[0, 1], [0, 2], [0, 3]],
    &[],
];

/// Which corners lie above the plane: t_v >= t.
#[inline]
pub(super) fn above(corners: [IVec3; 4], t: i32) -> usize {
    corners.iter().enumerate().map(|(i, corner)| usize::from(corner.z >= t) << i).sum()
}

/// Which edges of a slice lie on `faces` of its tet; bit i: the edge from corner i to the next. The ends of the edges
/// that two neighbouring corners lie on are the corners of a face.
#[inline]
pub(super) fn edges_on(slice: &[[u8; 2]], faces: Faces) -> u8 {
    if faces == 0 {
        return 0;
    }
    let ends = |i: usize| slice[i % slice.len()].iter().fold(0, |ends: Faces, end| ends | 1 << end);
    (0..slice.len()).map(|i| u8::from(faces & !(ends(i) | ends(i + 1)) != 0) << i).sum()
}

/// Where the plane crosses an edge, as the part of the way from `below` to `above`, and the place in (x, y).
///
/// Always computed from the end below, so that every tet at the edge gets the same bits.
#[inline]
pub(super) fn cross(below: IVec3, above: IVec3, t: i32) -> (f64, DVec2) {
    let part = f64::from(t - below.z) / f64::from(above.z - below.z);
    let (low, high) = (below.as_dvec3().truncate(), above.as_dvec3().truncate());
    (part, low + (high - low) * part)
}

/// The colour at part of the way along an edge; exact where both ends are equal.
#[inline]
pub(super) fn blend(below: Vec3, above: Vec3, part: f64) -> Vec3 {
    below + (above - below) * part as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::volume6;

    #[test]
    fn slices_of_positive_tets_turn_the_same_way_and_are_convex() {
        let corners = [[0, 0, 0], [9, 1, 4], [2, 8, 2], [3, 2, 9]].map(IVec3::from_array);
        let mut seen = std::collections::BTreeSet::new();
        for order in permutations() {
            let corners = order.map(|i| corners[i]);
            if volume6(corners[0], corners[1], corners[2], corners[3]) < 0 {
                continue;
            }
            for t in 1..=9 {
                let set = above(corners, t);
                seen.insert(set);
                let polygon: Vec<DVec2> =
                    SLICES[set].iter().map(|&[b, a]| cross(corners[b as usize], corners[a as usize], t).1).collect();
                for i in 0..polygon.len() {
                    let [p, q, r] = [0, 1, 2].map(|k| polygon[(i + k) % polygon.len()]);
                    assert!((q - p).perp_dot(r - q) >= 0.0, "set {set:04b} at {t}, corner {i}: {polygon:?}");
                }
            }
        }
        assert_eq!(seen.len(), 14, "all proper cuts were met");
    }

    fn permutations() -> Vec<[usize; 4]> {
        let all = (0..256).map(|n| [n & 3, n >> 2 & 3, n >> 4 & 3, n >> 6 & 3]);
        all.filter(|p| (0..4).all(|i| p.contains(&i))).collect()
    }

    #[test]
    fn corners_on_the_plane_are_above() {
        let flat = [[0, 0, 0], [4, 0, 0], [0, 4, 0], [0, 0, 4]].map(IVec3::from_array);
        assert_eq!(above(flat, 4), 0b1000);
        assert_eq!(above(flat, 0), 0b1111);
    }
}
