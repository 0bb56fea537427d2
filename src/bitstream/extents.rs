//! How long edges are around each vertex, axis by axis: the scale in which the mesh is about as dense everywhere.
//!
//! In: tets behind gates, as they are coded. Out: typical extents, the unit of distances, angles and residuals there. Forbidden here:
//! floating point, and any order that depends on more than the order of calls.

use glam::IVec3;

use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Extents are counted in this part of a lattice unit.
pub(crate) const PARTS: i32 = 16;

/// Takes the edges from a tet's gate to its apex, its last corner, into the running means of the extents of the edges at
/// its corners, in 1/16 lattice units; they are 0 before the first.
#[inline]
pub(super) fn learn(vertices: &mut Vertices, corners: [VertexId; 4], positions: [IVec3; 4]) {
    let [first, second, third, apex] = positions;
    let [a, b, c] = [first, second, third].map(|position| PARTS * (apex - position).abs());
    for (vertex, here) in corners.into_iter().zip([a, b, c]) {
        let mean = &mut vertices[vertex].extent;
        *mean = if *mean == IVec3::ZERO { here } else { *mean + ((here - *mean) >> 3) };
    }
    let mean = &mut vertices[corners[3]].extent;
    if *mean == IVec3::ZERO {
        // A third, exact for what is not negative.
        let third = |sum: i32| ((i64::from(sum) * 0x5555_5556) >> 32) as i32;
        let sum = a + b + c;
        *mean = IVec3::new(third(sum.x), third(sum.y), third(sum.z));
    }
}

/// The sum over three vertices, at least that of a lattice unit.
pub(super) fn around(vertices: &Vertices, [a, b, c]: [VertexId; 3]) -> IVec3 {
    (vertices[a].extent + vertices[b].extent + vertices[c].extent).max(IVec3::splat(3 * PARTS))
}

/// Binary logarithm of the product of three extents in 1/16 lattice units.
pub(crate) fn size_of(extents: IVec3) -> i32 {
    let [x, y, t] = extents.max(IVec3::ONE).to_array().map(|extent| u128::from(extent.unsigned_abs()));
    (x * y * t).ilog2() as i32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bitstream::front::Corner;

    #[test]
    fn means_follow_the_tets() {
        let mut vertices = Vertices::default();
        (0..4).for_each(|_| vertices.push(IVec3::ZERO, 0, Corner::NONE));
        let corners = [0, 1, 2, 3].map(VertexId);
        assert_eq!(around(&vertices, [corners[0]; 3]), IVec3::splat(48));
        assert_eq!(size_of(vertices[corners[0]].extent), 0);
        let at = [[0, 0, 0], [30, 0, 0], [0, 60, 0], [0, 0, 90]].map(IVec3::from_array);
        learn(&mut vertices, corners, at);
        let extents = |vertices: &Vertices| corners.map(|v| vertices[v].extent);
        let gate = [[0, 0, 1440], [480, 0, 1440], [0, 960, 1440]].map(IVec3::from_array);
        assert_eq!(extents(&vertices)[..3], gate);
        assert_eq!(extents(&vertices)[3], IVec3::new(160, 320, 1440));
        assert_eq!(size_of(vertices[corners[3]].extent), 26);
        learn(&mut vertices, corners, at.map(|p| p * 2));
        assert_eq!(extents(&vertices)[1], IVec3::new(540, 0, 1620));
        assert_eq!(extents(&vertices)[3], IVec3::new(160, 320, 1440));
    }
}
