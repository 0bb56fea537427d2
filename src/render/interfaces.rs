//! Which faces of control tets lie between two labels: the only places where colour may jump.
//!
//! In: a complex that grows at its ends. Out: four bits a tet. The faces of a child lie on those of its parent or
//! inside it, so what is known of control tets says all about every level ([`child_faces`]).

use super::complex::Complex;
use crate::mesh::{EDGES, FACES, FaceMap, VertexId};

/// Bits of a tet's faces; bit i: the face that lacks corner i.
pub(super) type Faces = u8;

const ALL: Faces = 0b1111;

/// Faces of control tets between labels.
#[derive(Debug)]
pub(super) struct Interfaces {
    nodes: usize,
    /// For each point whether it has a node.
    has_node: Vec<bool>,
    /// Whether labels share a point; nothing else is done as long as none do.
    shared: bool,
    /// One a tet.
    faces: Vec<Faces>,
    /// Faces that one tet has shown so far, with that tet and the corner of it that they lack.
    unpaired: FaceMap<(u32, u8)>,
}

impl Interfaces {
    /// Of no tets.
    pub(super) fn new() -> Self {
        Self { nodes: 0, has_node: Vec::new(), shared: false, faces: Vec::new(), unpaired: FaceMap::new() }
    }

    /// Takes in what `complex` gained since the last call.
    pub(super) fn extend(&mut self, complex: &Complex) {
        self.has_node.resize(complex.points.len(), false);
        for node in &complex.nodes[self.nodes..] {
            self.shared |= std::mem::replace(&mut self.has_node[node.point as usize], true);
        }
        self.nodes = complex.nodes.len();
        if self.shared {
            self.pair_faces(complex);
        }
    }

    /// Whether there may be any.
    pub(super) fn any(&self) -> bool {
        self.shared
    }

    /// The faces of a control tet that lie between labels.
    #[inline]
    pub(super) fn faces(&self, tet: u32) -> Faces {
        self.faces.get(tet as usize).copied().unwrap_or(0)
    }

    /// Finds the neighbours of tets that are new here. Tets come in the order of a growing region, so few faces wait at
    /// a time.
    fn pair_faces(&mut self, complex: &Complex) {
        let label = |tet: u32| complex.nodes[complex.tets[tet as usize][0] as usize].label;
        let first = self.faces.len();
        self.faces.resize(complex.tets.len(), 0);
        for tet in first as u32..complex.tets.len() as u32 {
            let corners = complex.tets[tet as usize].map(|node| VertexId(complex.point(node)));
            for (lacking, face) in (0..).zip(FACES) {
                let mut face = face.map(|i| corners[i]);
                face.sort_unstable();
                let Some((other, lacking_there)) = self.unpaired.insert(face, (tet, lacking)) else { continue };
                self.unpaired.remove(face);
                if label(other) != label(tet) {
                    self.faces[tet as usize] |= 1 << lacking;
                    self.faces[other as usize] |= 1 << lacking_there;
                }
            }
        }
    }
}

/// The faces of a child (over its parent's ten nodes) that lie on `faces` of the parent.
#[inline]
pub(super) fn child_faces(child: [u8; 4], faces: Faces) -> Faces {
    if faces == 0 {
        return 0;
    }
    let on = child.map(|node| NODE_FACES[node as usize] & faces);
    let face = |lacking: usize| on[(lacking + 1) % 4] & on[(lacking + 2) % 4] & on[(lacking + 3) % 4];
    (0..4).map(|lacking| u8::from(face(lacking) != 0) << lacking).sum()
}

/// For each of a parent's ten nodes the faces that it lies on.
const NODE_FACES: [Faces; 10] = {
    let mut faces = [0; 10];
    let mut node = 0;
    while node < 10 {
        let [a, b] = if node < 4 { [node, node] } else { EDGES[node - 4] };
        faces[node] = ALL & !(1 << a | 1 << b);
        node += 1;
    }
    faces
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::children::CHILDREN;

    /// Four children have a face on each face of the parent, and the other sixteen are inside.
    #[test]
    fn each_face_is_shared_out_to_four_children() {
        for row in CHILDREN {
            for face in 0..4 {
                let shares = row.map(|child| child_faces(child, 1 << face));
                assert_eq!(shares.iter().map(|faces| faces.count_ones()).sum::<u32>(), 4);
            }
            assert_eq!(row.map(|child| child_faces(child, ALL).count_ones()).iter().sum::<u32>(), 16);
            assert_eq!(row.map(|child| child_faces(child, 0)), [0; 8]);
        }
    }
}
