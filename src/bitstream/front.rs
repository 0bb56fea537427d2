//! The front: faces of coded tets behind which nothing is coded yet (the "cut-border" of Gumhold et al. 1999).
//!
//! In: tets, as they are coded. Out: the open faces at a vertex, the one across each edge of a face, and how sharp the gap
//! between the two is. Forbidden here: coding, and any order that depends on more than the order of calls.
//!
//! As in a half-edge structure, every edge of an open face knows its partner, the edge of the face on the other side of
//! the gap there; so what lies next to a gate is read, not looked for. A new tet changes partners at its own six edges
//! only ([`cover`]).

mod cover;

use glam::Vec3;

use super::vertices::Vertices;
use crate::mesh::VertexId;
pub(super) use cover::{Met, NewTet};

/// A corner of an open face: the number of its row. It also stands for the edge from it to the next corner.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Corner(u32);

impl Corner {
    /// A row that may be written to, and belongs to no face.
    pub(super) const NONE: Self = Self(0);

    #[inline]
    fn index(self) -> usize {
        self.0 as usize
    }

    #[inline]
    fn face(self) -> usize {
        (self.0 >> 2) as usize
    }

    #[inline]
    fn place(self) -> usize {
        (self.0 & 3) as usize
    }

    #[inline]
    pub(super) fn is_some(self) -> bool {
        self != Self::NONE
    }

    /// The next corner of the face, anticlockwise as seen from the open side.
    #[inline]
    pub(super) fn next(self) -> Self {
        Self(if self.0 & 2 == 0 { self.0 + 1 } else { self.0 - 2 })
    }

    /// The corner before it.
    #[inline]
    pub(super) fn previous(self) -> Self {
        Self(if self.0 & 3 == 0 { self.0 + 2 } else { self.0 - 1 })
    }
}

/// No vertex.
pub(super) const NOWHERE: VertexId = VertexId(u32::MAX);

/// How sharp a gap is: 0 if it is 180 degrees or wider or there is no partner, else 1 to 254 with the cosine of its angle.
pub(super) type Sharpness = u8;

/// See [`Sharpness`].
pub(super) const WIDE: Sharpness = 0;

/// Gaps from here on are as good as sure to be closed by one tet: about 80 degrees.
const SHARP: Sharpness = 150;

/// A gap that has not been asked for since its edge got its partner.
const UNKNOWN: Sharpness = 255;

/// Steps of sharpness for the cosines from -1 to 1.
const STEPS: f32 = 253.0;

/// What is asked of a corner when the front is walked.
///
/// A face has four rows, the last one unused. So has what no face has: [`Corner::NONE`], and the ends of the lists of four
/// vertices at a time, so that lists are circles, and that nothing has to be asked before a row is written to.
#[derive(Debug, Clone, Copy)]
#[repr(align(16))]
struct Row {
    vertex: VertexId,
    /// The partner of the edge, which runs the other way.
    across: Corner,
    /// Neighbours in the list of the vertex.
    older: Corner,
    younger: Corner,
}

impl Row {
    const NONE: Self = Self { vertex: NOWHERE, across: Corner::NONE, older: Corner::NONE, younger: Corner::NONE };
}

/// What else there is to an open face: half a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(32))]
struct Back {
    /// Unit normal, measured in the extents of edges around it, pointing to the open side.
    normal: Vec3,
    /// How sharp the gap at each edge is.
    gaps: [Sharpness; 4],
    before: Before,
}

/// The coded tet before an open face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// The tet's number.
    pub(super) tet: u32,
    pub(super) label: u32,
    /// Its corner that is not one of the face.
    pub(super) opposite: VertexId,
}

impl Back {
    const NONE: Self =
        Self { normal: Vec3::ZERO, gaps: [WIDE; 4], before: Before { tet: 0, label: 0, opposite: NOWHERE } };
}

/// The open faces, listed at each of their vertices, the youngest first.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// Four a face.
    rows: Vec<Row>,
    /// One a face.
    backs: Vec<Back>,
    /// Faces that are not in use.
    free: Vec<u32>,
    /// Where the list of the next vertex ends, unless it is a multiple of four.
    next_end: u32,
}

impl Front {
    pub(super) fn new() -> Self {
        let mut front = Self { rows: Vec::new(), backs: Vec::new(), free: Vec::new(), next_end: 0 };
        front.grow();
        front
    }

    /// Adds the rows of a face. Returns the first.
    #[inline]
    fn grow(&mut self) -> Corner {
        let first = Corner(self.rows.len() as u32);
        self.rows.extend([Row::NONE; 4]);
        self.backs.push(Back::NONE);
        first
    }

    /// An empty list for a new vertex: its end.
    pub(super) fn push_list(&mut self) -> Corner {
        if self.next_end & 3 == 0 {
            self.next_end = self.grow().0;
        }
        let end = Corner(self.next_end);
        self.next_end += 1;
        let row = &mut self.rows[end.index()];
        (row.older, row.younger) = (end, end);
        end
    }

    /// The tet before the face of this corner.
    #[inline]
    pub(super) fn before(&self, corner: Corner) -> &Before {
        &self.backs[corner.face()].before
    }

    /// All rows of a face.
    #[inline(always)]
    fn rows_of(&self, corner: Corner) -> &[Row; 4] {
        &self.rows.as_chunks().0[corner.face()]
    }

    #[inline]
    fn vertex(&self, corner: Corner) -> VertexId {
        self.rows[corner.index()].vertex
    }

    /// The vertices of a face, this corner's first.
    #[inline]
    pub(super) fn vertices_from(&self, corner: Corner) -> [VertexId; 3] {
        let rows = self.rows_of(corner);
        [corner, corner.next(), corner.previous()].map(|corner| rows[corner.place()].vertex)
    }

    /// The partner of an edge.
    #[inline]
    fn across(&self, edge: Corner) -> Corner {
        self.rows[edge.index()].across
    }

    /// The partners of a face's edges, this one's first.
    #[inline]
    fn across_from(&self, edge: Corner) -> [Corner; 3] {
        let rows = self.rows_of(edge);
        [edge, edge.next(), edge.previous()].map(|edge| rows[edge.place()].across)
    }

    /// The vertex across an edge, [`NOWHERE`] without a partner: the corner of its face that is not on the edge.
    #[inline]
    pub(super) fn vertex_across(&self, edge: Corner) -> VertexId {
        self.vertex(self.across(edge).previous())
    }

    /// Corners of open faces at `vertex`, the youngest first.
    #[inline]
    pub(super) fn at(&self, vertices: &Vertices, vertex: VertexId) -> impl Iterator<Item = Corner> + use<'_> {
        let end = vertices[vertex].open;
        let mut corner = end;
        std::iter::from_fn(move || {
            corner = self.rows[corner.index()].older;
            (corner != end).then_some(corner)
        })
    }

    /// The corner at `vertex` of the youngest face before a gap of [`SHARP`] there, going around it anticlockwise; if the
    /// `scan` youngest have none, of the one before the sharpest: the youngest of equals, and without a gap below 180
    /// degrees the youngest.
    #[inline]
    pub(super) fn find_sharpest(&mut self, vertices: &Vertices, vertex: VertexId, scan: usize) -> Option<Corner> {
        let end = vertices[vertex].open;
        let mut corner = self.rows[end.index()].older;
        if corner == end {
            return None;
        }
        let (mut found, mut sharpest) = (corner, WIDE);
        for _ in 0..scan {
            let older = self.rows[corner.index()].older;
            let gap = self.gap(vertices, corner.previous());
            found = if gap > sharpest { corner } else { found };
            sharpest = sharpest.max(gap);
            if older == end || sharpest >= SHARP {
                break;
            }
            corner = older;
        }
        Some(found)
    }

    /// How sharp the gap between an edge's face and its partner's is.
    #[inline]
    pub(super) fn gap(&mut self, vertices: &Vertices, edge: Corner) -> Sharpness {
        let known = self.backs[edge.face()].gaps[edge.place()];
        if known == UNKNOWN { self.measure(vertices, edge) } else { known }
    }

    #[inline(never)]
    fn measure(&mut self, vertices: &Vertices, edge: Corner) -> Sharpness {
        let Row { vertex, across: partner, .. } = self.rows[edge.index()];
        let along = (vertices.position(self.vertex(partner)) - vertices.position(vertex)).as_vec3();
        let (n, m) = (self.backs[edge.face()].normal, self.backs[partner.face()].normal);
        let fold = n.cross(m);
        let gap = if fold.x * along.x + fold.y * along.y + fold.z * along.z < 0.0 {
            let cos = -(n.x * m.x + n.y * m.y + n.z * m.z);
            ((cos + 1.0) * (STEPS / 2.0)).clamp(0.0, STEPS) as Sharpness + 1
        } else {
            WIDE
        };
        // The partner sees the same products, of two that change their signs.
        self.backs[edge.face()].gaps[edge.place()] = gap;
        self.backs[partner.face()].gaps[partner.place()] = gap;
        gap
    }

    /// Makes two edges partners; either may be [`Corner::NONE`].
    #[inline(always)]
    fn pair(&mut self, one: Corner, other: Corner) {
        let gap = if one.is_some() & other.is_some() { UNKNOWN } else { WIDE };
        self.rows[one.index()].across = other;
        self.rows[other.index()].across = one;
        self.backs[one.face()].gaps[one.place()] = gap;
        self.backs[other.face()].gaps[other.place()] = gap;
    }

    /// Adds an open face: its vertices, each with the end of its list, and its normal. Its edges have no partners yet.
    /// Returns its first corner.
    #[inline(always)]
    fn insert(&mut self, corners: [(VertexId, Corner); 3], normal: Vec3, before: Before) -> Corner {
        let first = match self.free.pop() {
            Some(face) => Corner(face << 2),
            None => self.grow(),
        };
        self.backs[first.face()] = Back { normal, gaps: [WIDE; 4], before };
        let [a, b, c] = corners;
        let rows =
            [self.list(first, a), self.list(Corner(first.0 + 1), b), self.list(Corner(first.0 + 2), c), Row::NONE];
        self.rows.as_chunks_mut().0[first.face()] = rows;
        first
    }

    /// Puts a corner at the front of the list of a vertex. Returns its row.
    #[inline(always)]
    fn list(&mut self, corner: Corner, (vertex, end): (VertexId, Corner)) -> Row {
        let older = std::mem::replace(&mut self.rows[end.index()].older, corner);
        self.rows[older.index()].younger = corner;
        Row { vertex, across: Corner::NONE, older, younger: end }
    }

    /// Takes the open face of this corner out of the lists. What becomes of its edges' partners is the caller's matter.
    #[inline(always)]
    fn remove(&mut self, corner: Corner) {
        let [a, b, c, _] = *self.rows_of(corner);
        for Row { older, younger, .. } in [a, b, c] {
            self.rows[younger.index()].older = older;
            self.rows[older.index()].younger = younger;
        }
        self.free.push(corner.face() as u32);
    }

    /// Takes out an open face behind which nothing lies. Its neighbours have no partners there from now on.
    pub(super) fn give_up(&mut self, corner: Corner) {
        for partner in self.across_from(corner) {
            self.pair(partner, Corner::NONE);
        }
        self.remove(corner);
    }
}
