//! Which tets of the source mesh share faces.
//!
//! In: a mesh that only grows. Out: pairs of faces with the same vertices. Forbidden here: what the pairs are for.
//!
//! Faces are sorted by their lowest vertex, many tets at a time; among those of one vertex, some twenty, mirror images lie
//! next to each other once they are in order. So no face is looked for, and nothing is asked that is as good as random.

use crate::mesh::{FACES, TetMesh};

/// Tets whose faces are sorted at once: bounds what that takes.
const BATCH: usize = 1 << 16;

/// No entry.
const NONE: u32 = u32::MAX;

/// A face of a tet: the one opposite a corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FaceOfTet(u64);

impl FaceOfTet {
    fn new(tet: usize, corner: usize) -> Self {
        Self((tet as u64) << 2 | corner as u64)
    }

    pub(super) fn tet(self) -> usize {
        (self.0 >> 2) as usize
    }

    pub(super) fn corner(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// A face in the list of its lowest vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Listed {
    /// The other vertices, the lower one above.
    others: u64,
    face: FaceOfTet,
}

/// Faces met once so far.
#[derive(Debug, Default)]
pub(super) struct Faces {
    /// Per vertex the last entry of the faces whose lowest vertex it is.
    last: Vec<u32>,
    /// Faces, and the entry before in the same list.
    entries: Vec<(Listed, u32)>,
    /// Entries that are not in use.
    free: Vec<u32>,
}

impl Faces {
    /// Finds the pairs among the faces of the tets from `first` on and those met once before.
    pub(super) fn pair(&mut self, mesh: &TetMesh, first: usize, mut found: impl FnMut(FaceOfTet, FaceOfTet)) {
        self.last.resize(mesh.positions.len(), NONE);
        for start in (first..mesh.tets.len()).step_by(BATCH) {
            let (mut ends, mut sorted) = sort(mesh, start..mesh.tets.len().min(start + BATCH));
            ends.insert(0, 0);
            for (vertex, range) in ends.windows(2).enumerate() {
                let faces = &mut sorted[range[0] as usize..range[1] as usize];
                faces.sort_unstable();
                let mut left = &*faces;
                while let [one, rest @ ..] = left {
                    left = rest;
                    if let Some(other) = left.first().filter(|other| other.others == one.others) {
                        left = &left[1..];
                        found(one.face, other.face);
                    } else if let Some(other) = self.meet(vertex, *one) {
                        found(one.face, other);
                    }
                }
            }
        }
    }

    /// The face with the same vertices, if it was met before; it is forgotten then. Else the new one is kept.
    fn meet(&mut self, lowest: usize, listed: Listed) -> Option<FaceOfTet> {
        let (mut younger, mut at) = (NONE, self.last[lowest]);
        while let Some(&(entry, before)) = self.entries.get(at as usize) {
            if entry.others == listed.others {
                match self.entries.get_mut(younger as usize) {
                    Some(younger) => younger.1 = before,
                    None => self.last[lowest] = before,
                }
                self.free.push(at);
                return Some(entry.face);
            }
            (younger, at) = (at, before);
        }
        let entry = (listed, self.last[lowest]);
        self.last[lowest] = match self.free.pop() {
            Some(free) => {
                self.entries[free as usize] = entry;
                free
            }
            None => {
                self.entries.push(entry);
                self.entries.len() as u32 - 1
            }
        };
        None
    }
}

/// The faces of some tets by their lowest vertices, and where those of each vertex end.
fn sort(mesh: &TetMesh, tets: std::ops::Range<usize>) -> (Vec<u32>, Vec<Listed>) {
    let faces: Vec<(u32, Listed)> = tets
        .flat_map(|tet| {
            let vertices = mesh.tet_vertices(tet);
            [0, 1, 2, 3].map(|corner| {
                let [a, b, c] = FACES[corner].map(|corner| vertices[corner].0);
                let (low, high) = (a.min(b), a.max(b));
                let (lowest, middle, highest) = (low.min(c), low.max(c.min(high)), high.max(c));
                let others = u64::from(middle) << 32 | u64::from(highest);
                (lowest, Listed { others, face: FaceOfTet::new(tet, corner) })
            })
        })
        .collect();
    let mut ends = vec![0; mesh.positions.len()];
    faces.iter().for_each(|(lowest, _)| ends[*lowest as usize] += 1);
    let mut start = 0;
    for end in &mut ends {
        start += std::mem::replace(end, start);
    }
    let mut sorted = vec![Listed { others: 0, face: FaceOfTet(0) }; faces.len()];
    for (lowest, listed) in faces {
        let end = &mut ends[lowest as usize];
        sorted[*end as usize] = listed;
        *end += 1;
    }
    (ends, sorted)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use glam::{IVec3, Vec3};

    use super::*;
    use crate::mesh::{Domain, VertexId, Wedge, WedgeId};
    use crate::video::Label;

    #[test]
    fn pairs_are_found_whenever_they_come() {
        let mut mesh = TetMesh::empty(Domain { width: 1, height: 1, duration: 1, subpixel_bits: 0 });
        for vertex in 0..12 {
            mesh.push_vertex(IVec3::ZERO);
            mesh.push_wedge(Wedge { vertex: VertexId(vertex), label: Label(0), color: Vec3::ZERO });
        }
        let mut faces = Faces::default();
        let mut expected: BTreeMap<[u32; 3], FaceOfTet> = BTreeMap::new();
        for first in 0..9u32 {
            let corners = [first, first + 1, (first + 2) % 12, first + 3];
            mesh.tets.push(corners.map(WedgeId));
            if first % 3 == 1 {
                continue;
            }
            let mut found = Vec::new();
            let known = mesh.tets.len() - if first % 3 == 2 { 2 } else { 1 };
            faces.pair(&mesh, known, |one, other| found.push((one.max(other), one.min(other))));
            let mut wanted = Vec::new();
            for tet in known..mesh.tets.len() {
                for (corner, face) in FACES.into_iter().enumerate() {
                    let mut key = face.map(|corner| mesh.tet_vertices(tet)[corner].0);
                    key.sort_unstable();
                    let here = FaceOfTet::new(tet, corner);
                    match expected.remove(&key) {
                        Some(other) => wanted.push((here, other)),
                        None => drop(expected.insert(key, here)),
                    }
                }
            }
            found.sort_unstable();
            wanted.sort_unstable();
            assert_eq!(found, wanted);
        }
        assert_eq!(expected.len(), 4 * 9 - 2 * 8);
    }
}
