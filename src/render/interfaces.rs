//! Which faces of control tets lie between two labels: the only places where colour may jump.
//!
//! In: a complex that grows at its ends. Out: four bits a tet. The faces of a child lie on those of its parent or
//! inside it, so what is known of control tets says all about every level ([`child_faces`]).

use super::children::EDGES;
use super::complex::{Complex, Stars};

/// Bits of a tet's faces; bit i: the face that lacks corner i.
pub(super) type Faces = u8;

const ALL: Faces = 0b1111;

/// Faces of control tets between labels.
#[derive(Debug, Default)]
pub(super) struct Interfaces {
    stars: Stars,
    /// For each point how many labels share it.
    shares: Vec<u32>,
    nodes: usize,
    /// Whether a point is shared; nothing else is done as long as none is.
    shared: bool,
    /// One a tet.
    faces: Vec<Faces>,
}

impl Interfaces {
    /// Takes in what `complex` gained since the last call.
    pub(super) fn extend(&mut self, complex: &Complex) {
        self.shares.resize(complex.points.len(), 0);
        for node in &complex.nodes[self.nodes..] {
            let shares = &mut self.shares[node.point as usize];
            *shares += 1;
            self.shared |= *shares > 1;
        }
        self.nodes = complex.nodes.len();
        if !self.shared {
            return;
        }
        self.stars.extend(complex);
        let first = self.faces.len();
        self.faces.resize(complex.tets.len(), 0);
        for tet in first..complex.tets.len() {
            for lacking in 0..4 {
                self.find_interface(complex, tet, lacking);
            }
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

    /// Marks the face of `tet` without the corner `lacking`, on both sides, if an earlier tet of another label has it
    /// too. Whichever of the two comes last finds the other, and both labels have their nodes by then.
    fn find_interface(&mut self, complex: &Complex, tet: usize, lacking: usize) {
        let corners = complex.tets[tet].map(|node| complex.point(node));
        let face = [1, 2, 3].map(|i| corners[(lacking + i) % 4]);
        if face.iter().any(|&point| self.shares[point as usize] < 2) {
            return;
        }
        let label = |tet: usize| complex.nodes[complex.tets[tet][0] as usize].label;
        for (other, _) in self.stars.star(face[0]).take_while(|&(other, _)| other < tet) {
            if label(other) == label(tet) {
                continue;
            }
            let corners = complex.tets[other].map(|node| complex.point(node));
            if face.iter().all(|point| corners.contains(point)) {
                let opposite = (0..4).find(|&i| !face.contains(&corners[i]));
                self.faces[other] |= opposite.map_or(0, |i| 1 << i);
                self.faces[tet] |= 1 << lacking;
                return;
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
