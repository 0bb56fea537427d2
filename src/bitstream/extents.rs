//! How long edges are around each vertex, axis by axis: the scale in which the mesh is about as dense everywhere.
//!
//! In: tets as they are coded. Out: typical extents, the unit of distances, angles and residuals there. Forbidden here:
//! floating point, and any order that depends on more than the order of calls.

use glam::IVec3;

use crate::mesh::VertexId;

/// Extents are counted in this part of a lattice unit.
pub(crate) const PARTS: i32 = 16;

/// Per vertex the running mean of the extents of the edges at it, in 1/16 lattice units; 0 before its first tet.
#[derive(Debug, Clone, Default)]
pub(super) struct Extents(Vec<IVec3>);

impl Extents {
    pub(super) fn push_vertex(&mut self) {
        self.0.push(IVec3::ZERO);
    }

    /// Takes a tet into the means of its corners.
    pub(super) fn learn(&mut self, corners: [VertexId; 4], positions: [IVec3; 4]) {
        for (vertex, from) in corners.into_iter().zip(positions) {
            let here = positions.into_iter().map(|to| (to - from).abs()).sum::<IVec3>() * PARTS / 3;
            let mean = &mut self.0[vertex.index()];
            *mean = if *mean == IVec3::ZERO { here } else { *mean + ((here - *mean) >> 2) };
        }
    }

    /// The sum over three vertices, at least that of a lattice unit.
    pub(super) fn around(&self, vertices: [VertexId; 3]) -> IVec3 {
        vertices.map(|v| self.0[v.index()]).into_iter().sum::<IVec3>().max(IVec3::splat(3 * PARTS))
    }

    /// Binary logarithm of the product of a vertex's extents.
    pub(super) fn size(&self, vertex: VertexId) -> i32 {
        size_of(self.0[vertex.index()])
    }
}

/// Binary logarithm of the product of three extents in 1/16 lattice units.
pub(crate) fn size_of(extents: IVec3) -> i32 {
    let [x, y, t] = extents.max(IVec3::ONE).to_array().map(|extent| u128::from(extent.unsigned_abs()));
    (x * y * t).ilog2() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_follow_the_tets() {
        let mut extents = Extents::default();
        (0..4).for_each(|_| extents.push_vertex());
        let corners = [0, 1, 2, 3].map(VertexId);
        assert_eq!(extents.around([corners[0]; 3]), IVec3::splat(48));
        assert_eq!(extents.size(corners[0]), 0);
        let at = [[0, 0, 0], [30, 0, 0], [0, 60, 0], [0, 0, 90]].map(IVec3::from_array);
        extents.learn(corners, at);
        assert_eq!(extents.0[0], IVec3::new(160, 320, 480));
        assert_eq!(extents.size(corners[0]), 24);
        extents.learn(corners, at.map(|p| p * 2));
        assert_eq!(extents.0[0], IVec3::new(200, 400, 600));
    }
}
