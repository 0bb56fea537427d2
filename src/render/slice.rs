//! The plane t = c through a tet: a triangle or a quad (§II: a frame is a cross-section of the mesh).

use glam::{DVec2, IVec3, Vec4};
use wide::{f64x2, f64x4, i32x4};

use super::canvas::ColorSpace;
use super::interfaces::Faces;
use super::refiner::FineNode;

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

/// A corner of a tet as slices see it, in one piece of memory.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct SliceNode {
    /// In the channels of the canvas.
    color: Vec4,
    /// x and y in fine units.
    place: [i32; 2],
    /// In fine units.
    t: i32,
    /// Whether [`ColorSpace::holds`] does not say so of the colour.
    is_beyond: bool,
}

impl SliceNode {
    pub(super) const ZERO: Self = Self { color: Vec4::ZERO, place: [0; 2], t: 0, is_beyond: false };

    pub(super) fn new(node: &FineNode, space: ColorSpace) -> Self {
        let (IVec3 { x, y, z }, rgb) = (node.position, node.levels());
        Self { color: space.of_rgb(rgb), place: [x, y], t: z, is_beyond: !space.holds(rgb) }
    }

    #[inline]
    fn place(&self) -> f64x2 {
        f64x2::new([self.place[0].into(), self.place[1].into()])
    }
}

/// A tet's part of a slice: a convex polygon.
#[derive(Debug, Clone, Copy)]
pub(super) struct Polygon<'a> {
    /// x and y of the corners in fine units; a triangle's last one stands twice.
    pub(super) places: [f64x2; 4],
    /// Corners: 3 or 4.
    pub(super) count: u8,
    /// Edges that lie between labels, as far as interfaces are known; bit i: the edge from corner i to the next.
    pub(super) boundary: u8,
    /// Whether a colour is beyond what [`ColorSpace::holds`].
    pub(super) is_beyond: bool,
    /// For each corner the ends of the tet's edge, below and above, and the part of the way between them.
    edges: [[&'a SliceNode; 2]; 4],
    parts: [f64; 4],
}

impl Polygon<'_> {
    /// The colours at the corners, in the channels of the canvas.
    #[inline]
    pub(super) fn colors(&self) -> [Vec4; 4] {
        let color = |i: usize| {
            let [low, high] = [self.edges[i][0].color, self.edges[i][1].color];
            // Exact where both ends are equal.
            low + (high - low) * self.parts[i] as f32
        };
        [color(0), color(1), color(2), color(3)]
    }
}

/// [`SLICES`] of four corners: a triangle's last one twice.
const PADDED: [[[u8; 2]; 4]; 16] = {
    let mut padded = [[[0; 2]; 4]; 16];
    let mut i = 0;
    while i < 16 * 4 {
        let (slice, corner) = (SLICES[i / 4], i % 4);
        if !slice.is_empty() {
            padded[i / 4][corner] = slice[if corner < slice.len() { corner } else { slice.len() - 1 }];
        }
        i += 1;
    }
    padded
};

/// Slices one tet; `None` if the plane does not cut it. Corners are computed as in [`cross`].
#[inline(always)]
pub(super) fn slice<'a>(nodes: [&'a SliceNode; 4], t: i32, faces: Faces) -> Option<Polygon<'a>> {
    let is_above = |i: usize| usize::from(nodes[i].t >= t) << i;
    let set = is_above(0) | is_above(1) | is_above(2) | is_above(3);
    let count = SLICES[set].len();
    if count == 0 {
        return None;
    }
    let ends = |i: usize| {
        let [below, above] = PADDED[set][i];
        [nodes[usize::from(below & 3)], nodes[usize::from(above & 3)]]
    };
    let edges = [ends(0), ends(1), ends(2), ends(3)];
    let way = |i: usize| t - edges[i][0].t;
    let height = |i: usize| edges[i][1].t - edges[i][0].t;
    let ways = f64x4::from_i32x4(i32x4::new([way(0), way(1), way(2), way(3)]));
    let heights = f64x4::from_i32x4(i32x4::new([height(0), height(1), height(2), height(3)]));
    let parts = (ways / heights).to_array();
    let place = |i: usize| {
        let [low, high] = [edges[i][0].place(), edges[i][1].place()];
        low + (high - low) * f64x2::splat(parts[i])
    };
    Some(Polygon {
        places: [place(0), place(1), place(2), place(3)],
        count: count as u8,
        boundary: edges_on(SLICES[set], faces),
        is_beyond: nodes[0].is_beyond | nodes[1].is_beyond | nodes[2].is_beyond | nodes[3].is_beyond,
        edges,
        parts,
    })
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
