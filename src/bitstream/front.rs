//! The front: faces of coded tets behind which nothing is coded yet (the "cut-border" of Gumhold et al. 1999).
//!
//! In: faces, as tets are coded. Out: the open faces at a vertex, the one that a new face closes. Forbidden here:
//! coding, and any order that depends on more than the order of calls.

mod lists;

use glam::{DVec3, I64Vec3, IVec3};

use super::vertices::Vertices;
use crate::mesh::VertexId;
use lists::Lists;
pub(super) use lists::{Lanes, List, Met, ROOM, Spoke, equal_lanes};

/// A face with a coded tet on one side only. A line of the cache.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct OpenFace {
    /// Unit normal, measured in the extents of edges around it, pointing to the open side.
    pub(super) normal: DVec3,
    /// Anticlockwise as seen from the open side: a tet of these and a vertex on the open side is positive.
    corners: [VertexId; 3],
    pub(super) behind: CodedTet,
    /// Where it stands in the list of each corner.
    blocks: [u32; 3],
}

/// The coded tet behind an open face.
#[derive(Debug, Clone, Copy)]
pub(super) struct CodedTet {
    pub(super) number: u32,
    pub(super) label: u32,
    /// Its corner that is not one of the face.
    pub(super) opposite: VertexId,
}

/// What the plane of (a, b, c) is perpendicular to, in lattice units, exact; the same for each corner that comes first.
#[inline]
pub(super) fn plane([a, b, c]: [IVec3; 3]) -> I64Vec3 {
    (b - a).as_i64vec3().cross((c - a).as_i64vec3())
}

/// Unit normal of a plane, not 0, where each axis is measured in units of `scale`. Every operation is one of IEEE 754's
/// correctly rounded ones, so all machines agree on it; a plane's components are less than 2^53.
#[inline]
pub(super) fn unit_normal(plane: I64Vec3, scale: DVec3) -> DVec3 {
    let n = plane.as_dvec3() * scale;
    n / (n.x * n.x + n.y * n.y + n.z * n.z).sqrt()
}

/// The open faces, listed at each of their vertices, the youngest first.
#[derive(Debug, Clone)]
pub(super) struct Front {
    faces: Vec<OpenFace>,
    free: Vec<u32>,
    lists: Lists,
}

impl Front {
    pub(super) fn new() -> Self {
        Self { faces: Vec::new(), free: Vec::new(), lists: Lists::new() }
    }

    #[inline]
    pub(super) fn face(&self, face: u32) -> &OpenFace {
        &self.faces[face as usize]
    }

    /// Open faces at `vertex`, the youngest first.
    #[inline]
    pub(super) fn at(&self, vertices: &Vertices, vertex: VertexId) -> impl Iterator<Item = Spoke> + use<'_> {
        self.lists.at(vertices[vertex].list)
    }

    /// Reads what will be asked of these vertices, all of them before the first answer is needed: so the waits for memory
    /// overlap.
    #[inline]
    pub(super) fn fetch(&self, vertices: &Vertices, around: impl Iterator<Item = VertexId>) {
        let sum = around.fold(0, |sum, vertex| sum ^ self.lists.youngest_face(vertices[vertex].list));
        std::hint::black_box(sum);
    }

    /// The youngest of the `scan` youngest open faces at `from` that leads around its edge to `to`, in the way that the
    /// edge is gone through from `to` to `from` (`back`) or the other way; with its third corner.
    pub(super) fn across(
        &self,
        vertices: &Vertices,
        [from, to]: [VertexId; 2],
        scan: u32,
        back: bool,
    ) -> Option<(u32, VertexId)> {
        let spoke = self.lists.find_across(vertices[from].list, scan, back, to)?;
        Some((spoke.face, if back { spoke.second } else { spoke.third }))
    }

    /// What of a new tet's face with these corners (seen from outside the new tet) is open. It is looked for where there
    /// are fewest.
    pub(super) fn meet(&self, vertices: &Vertices, [a, b, c]: [VertexId; 3]) -> Met {
        let [at_a, at_b, at_c] = [vertices[a].list, vertices[b].list, vertices[c].list];
        let (mut list, mut corners) = (at_a, [a, b, c]);
        if at_b.count() < list.count() {
            (list, corners) = (at_b, [b, c, a]);
        }
        if at_c.count() < list.count() {
            (list, corners) = (at_c, [c, a, b]);
        }
        self.lists.meet(list, corners)
    }

    /// Adds an open face of a tet with this unit normal. Returns its id.
    pub(super) fn insert(
        &mut self,
        vertices: &mut Vertices,
        corners: [VertexId; 3],
        normal: DVec3,
        behind: CodedTet,
    ) -> u32 {
        let [a, b, c] = corners;
        let face = self.free.last().copied().unwrap_or(self.faces.len() as u32);
        let mut list = |vertex: VertexId, second: VertexId, third: VertexId| {
            self.lists.push(vertex, &mut vertices[vertex].list, Spoke { face, second, third })
        };
        let blocks = [list(a, b, c), list(b, c, a), list(c, a, b)];
        let open = OpenFace { corners, behind, normal, blocks };
        match self.free.pop() {
            Some(face) => self.faces[face as usize] = open,
            None => self.faces.push(open),
        }
        face
    }

    /// Takes an open face out.
    pub(super) fn remove(&mut self, vertices: &mut Vertices, face: u32) {
        let OpenFace { corners, blocks, .. } = self.faces[face as usize];
        for (vertex, block) in corners.into_iter().zip(blocks) {
            self.lists.remove(vertex, &mut vertices[vertex].list, block, face);
        }
        self.free.push(face);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEHIND: CodedTet = CodedTet { number: 0, label: 0, opposite: VertexId(0) };

    fn front_of_four() -> (Front, Vertices) {
        let (mut front, mut vertices) = (Front::new(), Vertices::default());
        (0..4).for_each(|_| vertices.push(IVec3::ZERO, 0));
        for corners in crate::mesh::FACES {
            let corners = corners.map(|c| VertexId(c as u32));
            front.insert(&mut vertices, corners, DVec3::X, BEHIND);
        }
        (front, vertices)
    }

    #[test]
    fn lists_follow_insertions_and_removals() {
        let (mut front, mut vertices) = front_of_four();
        for v in (0..4).map(VertexId) {
            assert_eq!(front.at(&vertices, v).count(), 3);
            assert!(front.at(&vertices, v).all(|spoke| front.face(spoke.face).corners.contains(&v)));
        }
        let outside = [3, 2, 1].map(VertexId);
        let closed = front.meet(&vertices, outside).mirrored.expect("its mirror image is open");
        front.remove(&mut vertices, closed);
        assert_eq!(front.meet(&vertices, outside), Met::NOTHING);
        let left: Vec<usize> = (0..4).map(|v| front.at(&vertices, VertexId(v)).count()).collect();
        assert_eq!(left, [3, 2, 2, 2]);
    }

    #[test]
    fn a_face_is_met_from_any_corner() {
        let (front, vertices) = front_of_four();
        for corners in [[1, 2, 3], [2, 3, 1], [3, 1, 2]] {
            assert!(front.meet(&vertices, corners.map(VertexId)).is_there);
        }
        assert!(!front.meet(&vertices, [2, 1, 3].map(VertexId)).is_there);
    }

    #[test]
    fn normals_point_to_the_open_side() {
        let n = unit_normal(plane([IVec3::ZERO, IVec3::X, IVec3::Z]), DVec3::new(2.0, 3.0, 5.0));
        assert_eq!(n, DVec3::new(0.0, -1.0, 0.0));
    }
}
