//! Which tets of the source mesh share faces.
//!
//! In: tets, more and more of them. Out: the tets across their faces. Forbidden here: what that is for.
//!
//! Faces are sorted by their lowest vertex, many tets at a time; among those of one vertex, some twenty, mirror images are
//! found by looking. So no face is looked for anywhere else, and nothing is asked that is as good as random.

use crate::mesh::{FACES, VertexId};

/// Tets whose faces are sorted at once: what that takes should stay in the caches.
const BATCH: usize = 1 << 15;

/// Faces of one vertex that are compared one with another; more are sorted.
const FEW: usize = 64;

/// No entry.
const NONE: u32 = u32::MAX;

/// A face of a tet: the one opposite a corner. The number of the tet, and below it that of the corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct FaceOfTet(u32);

impl FaceOfTet {
    /// No face.
    pub(super) const NONE: Self = Self(NONE);

    fn new(tet: usize, corner: usize) -> Self {
        Self((tet as u32) << 2 | corner as u32)
    }

    pub(super) fn tet(self) -> usize {
        (self.0 >> 2) as usize
    }

    pub(super) fn corner(self) -> usize {
        (self.0 & 3) as usize
    }
}

/// A tet among others: half a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
pub(super) struct SourceTet {
    pub(super) vertices: [VertexId; 4],
    /// The face of another tet that is the mirror image of that opposite each corner.
    pub(super) across: [FaceOfTet; 4],
}

impl SourceTet {
    /// A tet by itself.
    pub(super) fn new(vertices: [VertexId; 4]) -> Self {
        Self { vertices, across: [FaceOfTet::NONE; 4] }
    }

    /// The face opposite a corner: its lowest vertex, and the others, the lower one above.
    fn face(&self, corner: usize) -> (usize, u64) {
        let [a, b, c] = FACES[corner].map(|corner| self.vertices[corner].0);
        let (low, high) = (a.min(b), a.max(b));
        let (lowest, middle, highest) = (low.min(c), low.max(c.min(high)), high.max(c));
        (lowest as usize, u64::from(middle) << 32 | u64::from(highest))
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
    /// Where the faces of each vertex end, and these: kept for their memory.
    ends: Vec<u32>,
    sorted: Vec<Listed>,
}

impl Faces {
    /// Finds what lies across the faces of the tets from `first` on, whose vertices are below `vertices`, among them and
    /// the faces met once before.
    pub(super) fn pair(&mut self, tets: &mut [SourceTet], first: usize, vertices: usize) {
        self.last.resize(vertices, NONE);
        for start in (first..tets.len()).step_by(BATCH) {
            let (ends, sorted) = (std::mem::take(&mut self.ends), std::mem::take(&mut self.sorted));
            let (ends, mut sorted) = sort(tets, start..tets.len().min(start + BATCH), vertices, (ends, sorted));
            let mut begin = 0;
            for (vertex, &end) in ends.iter().enumerate() {
                let faces = &mut sorted[begin..end as usize];
                begin = end as usize;
                if faces.len() > FEW {
                    faces.sort_unstable();
                }
                self.pair_at(tets, vertex, faces);
            }
            (self.ends, self.sorted) = (ends, sorted);
        }
    }

    /// The same for faces with one lowest vertex. Of many those that are mirror images lie side by side.
    fn pair_at(&mut self, tets: &mut [SourceTet], lowest: usize, faces: &mut [Listed]) {
        let most = if faces.len() > FEW { 1 } else { FEW };
        let mut left = faces;
        while let [one, rest @ ..] = left {
            let pair = match rest.iter().take(most).position(|other| other.others == one.others) {
                Some(place) => {
                    // The first of the rest is looked at next, so it takes the place of the one that was found.
                    let other = rest[place];
                    rest[place] = rest[0];
                    left = &mut rest[1..];
                    Some(other.face)
                }
                None => {
                    left = rest;
                    self.meet(lowest, *one)
                }
            };
            link(tets, one.face, pair);
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

/// Notes that two faces are mirror images.
fn link(tets: &mut [SourceTet], one: FaceOfTet, other: Option<FaceOfTet>) {
    if let Some(other) = other {
        tets[one.tet()].across[one.corner()] = other;
        tets[other.tet()].across[other.corner()] = one;
    }
}

/// The faces of some tets by their lowest vertices, and where those of each vertex end, in the memory of others.
fn sort(
    tets: &[SourceTet],
    range: std::ops::Range<usize>,
    vertices: usize,
    (mut ends, mut sorted): (Vec<u32>, Vec<Listed>),
) -> (Vec<u32>, Vec<Listed>) {
    ends.clear();
    ends.resize(vertices, 0);
    for tet in &tets[range.clone()] {
        (0..4).for_each(|corner| ends[tet.face(corner).0] += 1);
    }
    let mut start = 0;
    for end in &mut ends {
        start += std::mem::replace(end, start);
    }
    sorted.clear();
    sorted.resize(start as usize, Listed { others: 0, face: FaceOfTet::NONE });
    for tet in range {
        for corner in 0..4 {
            let (lowest, others) = tets[tet].face(corner);
            let end = &mut ends[lowest];
            sorted[*end as usize] = Listed { others, face: FaceOfTet::new(tet, corner) };
            *end += 1;
        }
    }
    (ends, sorted)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    #[test]
    fn pairs_are_found_whenever_they_come() {
        let mut tets: Vec<SourceTet> = Vec::new();
        let mut faces = Faces::default();
        let mut met: BTreeMap<[u32; 3], FaceOfTet> = BTreeMap::new();
        let mut across: Vec<[FaceOfTet; 4]> = Vec::new();
        for first in 0..9u32 {
            let corners = [first, first + 1, (first + 2) % 12, first + 3];
            tets.push(SourceTet::new(corners.map(VertexId)));
            across.push([FaceOfTet::NONE; 4]);
            if first % 3 == 1 {
                continue;
            }
            let known = tets.len() - if first % 3 == 2 { 2 } else { 1 };
            faces.pair(&mut tets, known, 12);
            for tet in known..tets.len() {
                for (corner, face) in FACES.into_iter().enumerate() {
                    let mut key = face.map(|corner| tets[tet].vertices[corner].0);
                    key.sort_unstable();
                    let here = FaceOfTet::new(tet, corner);
                    match met.remove(&key) {
                        Some(other) => {
                            across[tet][corner] = other;
                            across[other.tet()][other.corner()] = here;
                        }
                        None => drop(met.insert(key, here)),
                    }
                }
            }
            assert!(tets.iter().map(|tet| tet.across).eq(across.iter().copied()));
        }
        assert_eq!(met.len(), 4 * 9 - 2 * 8);
    }

    /// A vertex with more faces than are compared one with another.
    #[test]
    fn pairs_at_a_hub_are_found() {
        let count = 100u32;
        let fan = |i: u32| SourceTet::new([0, 1, 2 + i, 2 + (i + 1) % count].map(VertexId));
        let mut tets: Vec<SourceTet> = (0..count).map(fan).collect();
        Faces::default().pair(&mut tets, 0, count as usize + 2);
        for (i, tet) in tets.iter().enumerate() {
            let [at_hub, other, before, after] = tet.across;
            assert_eq!([at_hub, other], [FaceOfTet::NONE; 2]);
            let next = (i + 1) % count as usize;
            assert_eq!([before.tet(), tets[next].across[3].tet()], [next, i]);
            assert_eq!(after.tet(), (i + count as usize - 1) % count as usize);
        }
    }
}
