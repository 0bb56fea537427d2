//! The rows of open faces: what is asked of their corners when the front is walked.
//!
//! In: corners. Out: rows, listed and paired. Forbidden here: geometry, and which faces there are.
//!
//! What is done to several rows in a row takes them as a slice, so that they are asked for their number once.

use crate::mesh::VertexId;

/// A corner of an open face: the number of its row. It also stands for the edge from it to the next corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bitstream) struct Corner(pub(super) u32);

impl Corner {
    /// A row that may be written to, and belongs to no face.
    pub(in crate::bitstream) const NONE: Self = Self(0);

    /// The first corner of a face.
    #[inline]
    pub(super) fn first_of(face: u32) -> Self {
        Self(face << 2)
    }

    #[inline]
    pub(super) fn index(self) -> usize {
        self.0 as usize
    }

    #[inline]
    pub(super) fn face(self) -> usize {
        (self.0 >> 2) as usize
    }

    #[inline]
    pub(super) fn place(self) -> usize {
        (self.0 & 3) as usize
    }

    #[inline]
    pub(in crate::bitstream) fn is_some(self) -> bool {
        self != Self::NONE
    }

    /// The next corner of the face, anticlockwise as seen from the open side.
    #[inline]
    pub(in crate::bitstream) fn next(self) -> Self {
        Self(if self.0 & 2 == 0 { self.0 + 1 } else { self.0 - 2 })
    }

    /// The corner before it.
    #[inline]
    pub(in crate::bitstream) fn previous(self) -> Self {
        Self(if self.0 & 3 == 0 { self.0 + 2 } else { self.0 - 1 })
    }
}

/// How sharp a gap is: 0 if it is 180 degrees or wider or there is no partner, else 1 to 254 with the cosine of its angle.
pub(in crate::bitstream) type Sharpness = u8;

/// See [`Sharpness`].
pub(in crate::bitstream) const WIDE: Sharpness = 0;

/// A gap that has not been asked for since its edge got its partner.
pub(super) const UNKNOWN: Sharpness = 255;

/// Vertices that rows can name.
pub(in crate::bitstream) const MAX_VERTICES: u32 = 1 << (u32::BITS - Sharpness::BITS);

/// What is asked of a corner when the front is walked.
///
/// A face has four rows, a line of the cache; the last one holds what there is once a face ([`Before`]). So has what no face
/// has: [`Corner::NONE`], and the ends of the lists of four vertices at a time, so that lists are circles, and that nothing
/// has to be asked before a row is written to.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
pub(super) struct Row {
    /// The vertex above, and below it how sharp the gap at the edge is.
    pub(super) vertex_and_gap: u32,
    /// The partner of the edge, which runs the other way.
    pub(super) across: Corner,
    /// Neighbours in the list of the vertex.
    pub(super) older: Corner,
    pub(super) younger: Corner,
}

impl Row {
    /// A row that belongs to nothing.
    pub(super) const NONE: Self = Self::new(NOWHERE);

    /// A row of a vertex that is in no list and has no partner.
    #[inline]
    pub(super) const fn new(vertex: VertexId) -> Self {
        Self {
            vertex_and_gap: vertex.0 << Sharpness::BITS,
            across: Corner::NONE,
            older: Corner::NONE,
            younger: Corner::NONE,
        }
    }

    #[inline]
    pub(super) fn vertex(self) -> VertexId {
        VertexId(self.vertex_and_gap >> Sharpness::BITS)
    }

    #[inline]
    pub(super) fn gap(self) -> Sharpness {
        self.vertex_and_gap as Sharpness
    }

    #[inline]
    pub(super) fn set_gap(&mut self, gap: Sharpness) {
        self.vertex_and_gap = self.vertex_and_gap & u32::MAX << Sharpness::BITS | u32::from(gap);
    }
}

/// No vertex.
pub(in crate::bitstream) const NOWHERE: VertexId = VertexId(MAX_VERTICES - 1);

/// Puts a corner at the front of the list of a vertex that ends at `end`. Returns its row.
#[inline(always)]
pub(super) fn enlist(rows: &mut [Row], corner: Corner, (vertex, end): (VertexId, Corner)) -> Row {
    let older = std::mem::replace(&mut rows[end.index()].older, corner);
    rows[older.index()].younger = corner;
    Row { older, younger: end, ..Row::new(vertex) }
}

/// Takes a face out of the lists of its vertices. Returns the partners of its edges, this corner's first.
#[inline(always)]
pub(super) fn unlist(rows: &mut [Row], corner: Corner) -> [Corner; 3] {
    let face = &rows.as_chunks::<4>().0[corner.face()];
    let across = |corner: Corner| face[corner.place()].across;
    let across = [across(corner), across(corner.next()), across(corner.previous())];
    let links = |place: usize| (face[place].older, face[place].younger);
    let [a, b, c] = [links(0), links(1), links(2)];
    skip(rows, a);
    skip(rows, b);
    skip(rows, c);
    across
}

/// Makes two rows neighbours in their list.
#[inline(always)]
fn skip(rows: &mut [Row], (older, younger): (Corner, Corner)) {
    rows[younger.index()].older = older;
    rows[older.index()].younger = younger;
}

/// Makes two edges partners; either may be [`Corner::NONE`].
#[inline(always)]
pub(super) fn pair(rows: &mut [Row], one: Corner, other: Corner) {
    pair_as(rows, one, other, if one.is_some() & other.is_some() { UNKNOWN } else { WIDE });
}

/// The same where it is known how sharp the gap is.
#[inline(always)]
pub(super) fn pair_as(rows: &mut [Row], one: Corner, other: Corner, gap: Sharpness) {
    for (edge, partner) in [(one, other), (other, one)] {
        let row = &mut rows[edge.index()];
        row.across = partner;
        row.set_gap(gap);
    }
}
