//! The front: faces of coded tets behind which nothing is coded yet (the "cut-border" of Gumhold et al. 1999).
//!
//! In: tets, as they are coded. Out: the open faces at a vertex, the one across each edge of a face, and how sharp the gap
//! between the two is. Forbidden here: coding, and any order that depends on more than the order of calls.
//!
//! As in a half-edge structure, every edge of an open face knows its partner, the edge of the face on the other side of
//! the gap there; so what lies next to a gate is read, not looked for. A new tet changes partners at its own six edges
//! only ([`cover`]).

mod cover;
mod rows;

use glam::Vec3A;

use super::normals::{cross, dot};
use super::vertices::Vertices;
use crate::mesh::VertexId;
pub(super) use cover::{Met, NewTet};
pub(super) use rows::{Corner, MAX_VERTICES, NOWHERE, Sharpness, WIDE};
use rows::{Row, UNKNOWN, pair, unlist};

/// Gaps from here on are as good as sure to be closed by one tet: about 80 degrees.
const SHARP: Sharpness = 150;

/// Steps of sharpness for the cosines from -1 to 1.
const STEPS: Sharpness = 253;

/// The coded tet before an open face.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// The tet's number.
    pub(super) tet: u32,
    pub(super) label: u32,
    /// Its corner that is not one of the face.
    pub(super) opposite: VertexId,
}

impl Before {
    fn to_row(self) -> Row {
        let Self { tet, label, opposite } = self;
        Row { across: Corner(tet), older: Corner(label), ..Row::new(opposite) }
    }

    fn from_row(row: Row) -> Self {
        Self { tet: row.across.0, label: row.older.0, opposite: row.vertex() }
    }
}

/// The open faces, listed at each of their vertices, the youngest first.
#[derive(Debug, Clone)]
pub(super) struct Front {
    /// Four a face.
    rows: Vec<Row>,
    /// Unit normals, one a face, measured in the extents of edges around it, pointing to the open side. They have lines of
    /// the cache of their own: only gaps ask for them.
    normals: Vec<Vec3A>,
    /// Faces that are not in use.
    free: Vec<u32>,
    /// Where the list of the next vertex ends, unless it is a multiple of four.
    next_end: u32,
}

impl Front {
    pub(super) fn new() -> Self {
        let mut front = Self { rows: Vec::new(), normals: Vec::new(), free: Vec::new(), next_end: 0 };
        front.grow();
        front
    }

    /// Adds the rows of a face. Returns the first.
    #[inline]
    fn grow(&mut self) -> Corner {
        let first = Corner(self.rows.len() as u32);
        self.rows.extend([Row::NONE; 4]);
        self.normals.push(Vec3A::ZERO);
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
    pub(super) fn before(&self, corner: Corner) -> Before {
        Before::from_row(self.rows_of(corner)[3])
    }

    /// All rows of a face.
    #[inline(always)]
    fn rows_of(&self, corner: Corner) -> &[Row; 4] {
        &self.rows.as_chunks().0[corner.face()]
    }

    /// The vertex of a corner; [`NOWHERE`] in a row that has none.
    #[inline]
    pub(super) fn vertex(&self, corner: Corner) -> VertexId {
        self.rows[corner.index()].vertex()
    }

    /// The vertices of a face, this corner's first.
    #[inline]
    pub(super) fn vertices_from(&self, corner: Corner) -> [VertexId; 3] {
        let rows = self.rows_of(corner);
        let at = |corner: Corner| rows[corner.place()].vertex();
        [at(corner), at(corner.next()), at(corner.previous())]
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
        let across = |edge: Corner| rows[edge.place()].across;
        [across(edge), across(edge.next()), across(edge.previous())]
    }

    #[inline]
    pub(super) fn has_partner(&self, edge: Corner) -> bool {
        self.across(edge).is_some()
    }

    /// The corner across an edge, that of its partner's face that is not on it; a row that has no vertex without a partner.
    #[inline]
    pub(super) fn corner_across(&self, edge: Corner) -> Corner {
        self.across(edge).previous()
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
    #[inline(always)]
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
    #[inline(always)]
    pub(super) fn gap(&mut self, vertices: &Vertices, edge: Corner) -> Sharpness {
        let known = self.rows[edge.index()].gap();
        if known == UNKNOWN { self.measure(vertices, edge) } else { known }
    }

    #[inline(always)]
    fn measure(&mut self, vertices: &Vertices, edge: Corner) -> Sharpness {
        let row = self.rows[edge.index()];
        let partner = row.across;
        let along = vertices.position(self.vertex(partner)) - vertices.position(row.vertex());
        let (n, m) = (self.normals[edge.face()], self.normals[partner.face()]);
        let steps = ((1.0 - dot(n, m)) * (f32::from(STEPS) / 2.0)) as Sharpness;
        let steps = steps.min(STEPS) + 1;
        let gap = if dot(cross(n, m), along) < 0.0 { steps } else { WIDE };
        // The partner sees the same products, of two that change their signs.
        self.rows[edge.index()].set_gap(gap);
        self.rows[partner.index()].set_gap(gap);
        gap
    }

    /// Makes sure that so many faces are not in use.
    #[inline(always)]
    fn reserve(&mut self, count: usize) {
        while self.free.len() < count {
            let face = self.grow().face() as u32;
            self.free.push(face);
        }
    }

    /// Takes out an open face behind which nothing lies. Its neighbours have no partners there from now on.
    pub(super) fn give_up(&mut self, corner: Corner) {
        for partner in self.across_from(corner) {
            pair(&mut self.rows, partner, Corner::NONE);
        }
        unlist(&mut self.rows, corner);
        self.free.push(corner.face() as u32);
    }
}
