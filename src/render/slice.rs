//! The plane t = c through a tet: a triangle or a quad (§II: a frame is a cross-section of the mesh).

use glam::{DVec2, IVec3, Vec4};
use wide::f32x4;

use super::canvas::ColorSpace;
use super::cpu::{self, Kernel};
use super::interfaces::Faces;
use super::lanes::{LANES, Lanes};
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
    /// Three channels of the canvas, and 0.
    color: [f32; 4],
    /// x, y and t in fine units, and 1 where [`ColorSpace::holds`] does not say so of the colour, else 0.
    place: [i32; 4],
}

impl SliceNode {
    const NOTHING: Self = Self { color: [0.0; 4], place: [0; 4] };

    pub(super) fn new(node: &FineNode, space: ColorSpace) -> Self {
        let (IVec3 { x, y, z }, rgb) = (node.position, node.levels());
        Self { color: space.of_rgb(rgb).to_array(), place: [x, y, z, i32::from(!space.holds(rgb))] }
    }

    /// In fine units.
    #[inline(always)]
    pub(super) fn t(&self) -> i32 {
        self.place[2]
    }

    /// Which of four corners lie above the plane at `t`, as [`above`] says.
    #[inline(always)]
    pub(super) fn above(nodes: [&Self; 4], t: i32) -> usize {
        let is_above = |i: usize| usize::from(nodes[i].t() >= t) << i;
        is_above(0) | is_above(1) | is_above(2) | is_above(3)
    }

    #[inline(always)]
    fn is_beyond(&self) -> bool {
        self.place[3] != 0
    }
}

/// What a set of corners above says of a slice.
#[derive(Debug, Clone, Copy)]
struct Case {
    /// The corners below, then those above, in the order that [`ends`] expects.
    order: [u8; 4],
    /// Corners below.
    below: u8,
    /// Corners of the polygon: 3, 4, or 0 where there is none.
    corners: u8,
}

/// As of [`SLICES`].
const CASES: [Case; 16] = {
    let mut cases = [Case { order: [0; 4], below: 0, corners: 0 }; 16];
    let mut set = 1;
    while set < 15 {
        let (slice, below) = (SLICES[set], 4 - (set as u32).count_ones() as u8);
        let order = match below {
            1 => [slice[0][0], slice[0][1], slice[1][1], slice[2][1]],
            2 => [slice[0][0], slice[2][0], slice[0][1], slice[1][1]],
            _ => [slice[0][0], slice[1][0], slice[2][0], slice[0][1]],
        };
        cases[set] = Case { order, below, corners: slice.len() as u8 };
        set += 1;
    }
    cases
};

/// Tets that a plane cuts: the corners of each that lie below it, then those above.
#[derive(Debug)]
pub(super) struct Slices {
    nodes: [Lanes<SliceNode>; 4],
    /// Corners below the plane: 1 to 3.
    below: Lanes<u32>,
    polygons: Polygons,
}

/// What a plane cuts out of tets: convex polygons, side by side.
#[derive(Debug)]
pub(super) struct Polygons {
    /// How many there are.
    pub(super) count: usize,
    /// The control tet that each belongs to.
    pub(super) tets: Lanes<u32>,
    /// x and y of the corners in fine units; a triangle's last one stands twice.
    pub(super) places: [[Lanes<f64>; 2]; 4],
    /// The colours there, in the channels of the canvas.
    pub(super) colors: [[Lanes<f32>; 3]; 4],
    /// Corners: 3 or 4.
    pub(super) corners: Lanes<u8>,
    /// Edges that lie between labels, as far as interfaces are known; bit i: the edge from corner i to the next.
    pub(super) boundaries: Lanes<u8>,
    /// Whether a colour is beyond what [`ColorSpace::holds`].
    pub(super) are_beyond: Lanes<bool>,
}

impl Polygons {
    pub(super) const NONE: Self = Self {
        count: 0,
        tets: [0; LANES],
        places: [[[0.0; LANES]; 2]; 4],
        colors: [[[0.0; LANES]; 3]; 4],
        corners: [0; LANES],
        boundaries: [0; LANES],
        are_beyond: [false; LANES],
    };

    /// The colours of one of them at its corners.
    #[inline]
    pub(super) fn colors(&self, lane: usize) -> [Vec4; 4] {
        [0, 1, 2, 3].map(|corner| {
            let [first, second, third] = &self.colors[corner];
            Vec4::new(first[lane], second[lane], third[lane], 0.0)
        })
    }
}

impl Slices {
    pub(super) fn new() -> Self {
        Self { nodes: [[SliceNode::NOTHING; LANES]; 4], below: [0; LANES], polygons: Polygons::NONE }
    }

    /// Adds a tet if a plane cuts it, given its corners above the plane; there must be room for it. `tet` is the control tet
    /// that it belongs to.
    #[inline(always)]
    pub(super) fn push(&mut self, tet: u32, nodes: [&SliceNode; 4], above: usize, faces: Faces) {
        let (lane, case) = (self.polygons.count, CASES[above & 15]);
        if case.corners == 0 || lane >= LANES {
            return;
        }
        for (lanes, node) in self.nodes.iter_mut().zip(case.order) {
            lanes[lane] = *nodes[usize::from(node & 3)];
        }
        self.below[lane] = case.below.into();
        let Polygons { tets, corners, boundaries, are_beyond, count, .. } = &mut self.polygons;
        tets[lane] = tet;
        corners[lane] = case.corners;
        boundaries[lane] = edges_on(SLICES[above & 15], faces);
        are_beyond[lane] = nodes[0].is_beyond() | nodes[1].is_beyond() | nodes[2].is_beyond() | nodes[3].is_beyond();
        *count += 1;
    }

    /// How many more tets there is room for.
    pub(super) fn room(&self) -> usize {
        LANES - self.polygons.count
    }

    /// Hands out what the plane at `t` cuts out of the tets, and forgets these. Corners are computed as in [`cross`].
    pub(super) fn cut(&mut self, t: i32, take: impl FnOnce(&Polygons)) {
        cpu::run(Cutting { slices: self, plane: t });
        take(&self.polygons);
        self.polygons.count = 0;
    }
}

/// What [`Slices::cut`] computes.
struct Cutting<'a> {
    slices: &'a mut Slices,
    plane: i32,
}

/// The corners of tets, number by number, each by its bits.
type Corners = [[Lanes<u32>; 4]; 4];

/// Corners of polygons, each by the ends of the tet's edge that it lies on, below and above.
type Ends = [[Lanes<u32>; 2]; 4];

impl Kernel for Cutting<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Slices { nodes, below, polygons } = self.slices;
        let masks = [1, 2, 3].map(|count| {
            let mut mask = [0; LANES];
            for i in 0..LANES {
                mask[i] = if below[i] == count { u32::MAX } else { 0 };
            }
            mask
        });
        let [mut places, mut colors] = [[[[0; LANES]; 4]; 4]; 2];
        for corner in 0..4 {
            side_by_side(&nodes[corner], |node| node.place.map(|v| f32::from_bits(v as u32)), &mut places[corner]);
            side_by_side(&nodes[corner], |node| node.color, &mut colors[corner]);
        }
        let mut parts = [[0.0; LANES]; 4];
        let times = ends(&masks, &places, 2);
        for (parts, [low, high]) in parts.iter_mut().zip(&times) {
            for i in 0..LANES {
                parts[i] = f64::from(self.plane - low[i] as i32) / f64::from(high[i] as i32 - low[i] as i32);
            }
        }
        for axis in 0..2 {
            for (corner, [low, high]) in ends(&masks, &places, axis).iter().enumerate() {
                for i in 0..LANES {
                    let (low, high) = (f64::from(low[i] as i32), f64::from(high[i] as i32));
                    polygons.places[corner][axis][i] = low + (high - low) * parts[corner][i];
                }
            }
        }
        for channel in 0..3 {
            for (corner, [low, high]) in ends(&masks, &colors, channel).iter().enumerate() {
                for i in 0..LANES {
                    let (low, high) = (f32::from_bits(low[i]), f32::from_bits(high[i]));
                    // Exact where both ends are equal.
                    polygons.colors[corner][channel][i] = low + (high - low) * parts[corner][i] as f32;
                }
            }
        }
    }
}

/// Puts numbers of nodes side by side.
#[inline(always)]
fn side_by_side(nodes: &Lanes<SliceNode>, numbers: impl Fn(&SliceNode) -> [f32; 4], lanes: &mut [Lanes<u32>; 4]) {
    for (four, nodes) in nodes.as_chunks::<4>().0.iter().enumerate() {
        let of = |i: usize| f32x4::new(numbers(&nodes[i]));
        for (lanes, turned) in lanes.iter_mut().zip(f32x4::transpose([of(0), of(1), of(2), of(3)])) {
            lanes.as_chunks_mut::<4>().0[four] = turned.to_array().map(f32::to_bits);
        }
    }
}

/// One number of the ends of the tets' edges that the corners of polygons lie on. `masks` say how many of a tet's corners
/// are below: 1, 2 or 3; these come first, as [`Case::order`] says.
#[inline(always)]
fn ends([one, two, three]: &[Lanes<u32>; 3], corners: &Corners, number: usize) -> Ends {
    let [a, b, c, d] = [0, 1, 2, 3].map(|corner| &corners[corner][number]);
    let mut ends = [[[0; LANES]; 2]; 4];
    for i in 0..LANES {
        // By bits: of a choice between places in memory compilers make a load from one of them, which is slow in lanes.
        let by_count = |v: [u32; 3]| v[0] & one[i] | v[1] & two[i] | v[2] & three[i];
        let pick = |mask: u32, v: u32, other: u32| v & mask | other & !mask;
        let low = by_count([a[i], b[i], c[i]]);
        ends[0][0][i] = a[i];
        ends[0][1][i] = by_count([b[i], c[i], d[i]]);
        ends[1][0][i] = pick(three[i], b[i], a[i]);
        ends[1][1][i] = pick(one[i], c[i], d[i]);
        ends[2][0][i] = low;
        ends[2][1][i] = d[i];
        ends[3][0][i] = low;
        ends[3][1][i] = pick(two[i], c[i], d[i]);
    }
    ends
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
