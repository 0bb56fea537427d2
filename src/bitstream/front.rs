//! The front: faces of coded tets behind which nothing is coded yet (the "cut-border" of Gumhold et al. 1999).
//!
//! In: faces, as tets are coded. Out: the open faces at a vertex, the one that a new face closes. Forbidden here:
//! coding, and any order that depends on more than the order of calls.

use glam::{DVec3, IVec3};

use super::MeshFault;
use crate::mesh::{FaceMap, VertexId};

/// End of a list.
const NONE: u32 = u32::MAX;

/// A face with a coded tet on one side only.
#[derive(Debug, Clone)]
pub(super) struct OpenFace {
    /// Anticlockwise as seen from the open side: a tet of these and a vertex on the open side is positive.
    pub(super) corners: [VertexId; 3],
    /// The coded tet behind it.
    pub(super) tet: u32,
    /// Unit normal, measured in the extents of edges around it, pointing to the open side.
    pub(super) normal: DVec3,
    next: [u32; 3],
    prev: [u32; 3],
}

/// Unit normal of (a, b, c), not collinear, where each axis is measured in units of `scale`. Every operation is one of
/// IEEE 754's correctly rounded ones, so all machines agree on it.
pub(super) fn unit_normal([a, b, c]: [IVec3; 3], scale: DVec3) -> DVec3 {
    let (u, v) = ((b - a).as_dvec3(), (c - a).as_dvec3());
    let n = DVec3::new(
        (u.y * v.z - u.z * v.y) * scale.x,
        (u.z * v.x - u.x * v.z) * scale.y,
        (u.x * v.y - u.y * v.x) * scale.z,
    );
    n / (n.x * n.x + n.y * n.y + n.z * n.z).sqrt()
}

/// The open faces, listed at each of their vertices, the youngest first.
#[derive(Debug, Clone)]
pub(super) struct Front {
    faces: Vec<OpenFace>,
    free: Vec<u32>,
    /// Per vertex: first slot of its list; slot 3 f + c is corner c of face f.
    head: Vec<u32>,
    /// Per vertex: number of open faces.
    count: Vec<u32>,
    /// Face by its corners, the lowest id first.
    by_corners: FaceMap<u32>,
}

/// The same cyclic order, starting at the lowest id.
fn canonical([a, b, c]: [VertexId; 3]) -> [VertexId; 3] {
    if a < b && a < c {
        [a, b, c]
    } else if b < c {
        [b, c, a]
    } else {
        [c, a, b]
    }
}

impl Front {
    pub(super) fn new() -> Self {
        Self { faces: Vec::new(), free: Vec::new(), head: Vec::new(), count: Vec::new(), by_corners: FaceMap::new() }
    }

    /// Makes room for the lists of one more vertex.
    pub(super) fn push_vertex(&mut self) {
        self.head.push(NONE);
        self.count.push(0);
    }

    pub(super) fn face(&self, face: u32) -> &OpenFace {
        &self.faces[face as usize]
    }

    /// Number of open faces at `vertex`.
    pub(super) fn count(&self, vertex: VertexId) -> u32 {
        self.count[vertex.index()]
    }

    /// Open faces at `vertex`, the youngest first, each with its corners turned so that `vertex` comes first.
    pub(super) fn at(&self, vertex: VertexId) -> impl Iterator<Item = (u32, [VertexId; 3])> + '_ {
        let mut slot = self.head[vertex.index()];
        std::iter::from_fn(move || {
            let (face, corner) = (slot / 3, slot as usize % 3);
            let open = self.faces.get(face as usize)?;
            slot = open.next[corner];
            Some((face, [0, 1, 2].map(|i| open.corners[(corner + i) % 3])))
        })
    }

    /// The open face that a new tet's face with these corners (seen from outside the new tet) closes.
    pub(super) fn facing(&self, [a, b, c]: [VertexId; 3]) -> Option<u32> {
        self.by_corners.get(canonical([a, c, b])).copied()
    }

    /// Adds an open face of `tet` with this unit normal.
    pub(super) fn insert(&mut self, corners: [VertexId; 3], normal: DVec3, tet: u32) -> Result<(), MeshFault> {
        let open = OpenFace { corners, tet, normal, next: [NONE; 3], prev: [NONE; 3] };
        let face = match self.free.pop() {
            Some(face) => {
                self.faces[face as usize] = open;
                face
            }
            None => {
                self.faces.push(open);
                self.faces.len() as u32 - 1
            }
        };
        if self.by_corners.insert(canonical(corners), face).is_some() {
            return Err(MeshFault::DuplicateFace { face: corners.map(|v| v.0) });
        }
        for (corner, vertex) in corners.into_iter().enumerate() {
            let slot = face * 3 + corner as u32;
            let second = std::mem::replace(&mut self.head[vertex.index()], slot);
            self.faces[face as usize].next[corner] = second;
            if second != NONE {
                self.faces[second as usize / 3].prev[second as usize % 3] = slot;
            }
            self.count[vertex.index()] += 1;
        }
        Ok(())
    }

    /// Takes an open face out.
    pub(super) fn remove(&mut self, face: u32) {
        let OpenFace { corners, next, prev, .. } = self.faces[face as usize];
        for (corner, vertex) in corners.into_iter().enumerate() {
            let (after, before) = (next[corner], prev[corner]);
            if before == NONE {
                self.head[vertex.index()] = after;
            } else {
                self.faces[before as usize / 3].next[before as usize % 3] = after;
            }
            if after != NONE {
                self.faces[after as usize / 3].prev[after as usize % 3] = before;
            }
            self.count[vertex.index()] -= 1;
        }
        self.by_corners.remove(canonical(corners));
        self.free.push(face);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn front_of_four() -> Front {
        let mut front = Front::new();
        (0..4).for_each(|_| front.push_vertex());
        for corners in crate::mesh::FACES {
            front.insert(corners.map(|c| VertexId(c as u32)), DVec3::X, 0).unwrap();
        }
        front
    }

    #[test]
    fn lists_follow_insertions_and_removals() {
        let mut front = front_of_four();
        for v in 0..4 {
            assert_eq!(front.count(VertexId(v)), 3);
            assert!(front.at(VertexId(v)).all(|(_, corners)| corners[0] == VertexId(v)));
        }
        let closed = front.facing([VertexId(3), VertexId(2), VertexId(1)]).expect("its mirror image is open");
        front.remove(closed);
        assert_eq!(front.facing([VertexId(3), VertexId(2), VertexId(1)]), None);
        let left: Vec<u32> = (0..4).map(|v| front.at(VertexId(v)).count() as u32).collect();
        assert_eq!(left, [3, 2, 2, 2]);
        assert_eq!(left, (0..4).map(|v| front.count(VertexId(v))).collect::<Vec<_>>());
    }

    #[test]
    fn a_face_is_open_once() {
        let mut front = front_of_four();
        let again = front.insert([VertexId(2), VertexId(3), VertexId(1)], DVec3::X, 7);
        assert_eq!(again, Err(MeshFault::DuplicateFace { face: [2, 3, 1] }));
    }

    #[test]
    fn normals_point_to_the_open_side() {
        let n = unit_normal([IVec3::ZERO, IVec3::X, IVec3::Z], DVec3::new(2.0, 3.0, 5.0));
        assert_eq!(n, DVec3::new(0.0, -1.0, 0.0));
    }
}
