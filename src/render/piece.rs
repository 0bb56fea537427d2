//! What is painted: a polygon's colour and rows, and what anti-aliasing needs of it besides.

use std::ops::Range;

use glam::Vec4;

use super::grid::turn;
use super::near::Sides;
use super::parallel::List;
use super::run::Run;
use super::scan::{Outline, ROWS, Span};

/// A part of a slice on the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) outline: Outline,
    /// In the channels of the canvas, one a corner.
    pub(super) colors: [Vec4; 4],
    /// As of [`Polygons`](super::slice::Polygons).
    pub(super) is_beyond: bool,
    /// 3 or 4.
    pub(super) count: u8,
    /// Edges that lie between labels; bit i: the edge from corner i to the next.
    pub(super) boundary: u8,
}

impl Patch {
    /// What of it is positive where it is not convex: rounding bends slivers. Of what smoothing turned over nothing is left.
    pub(super) fn halves(&self) -> impl Iterator<Item = Self> {
        let corners = self.outline.corners();
        let edge = |i: u8| self.boundary >> i & 1;
        // The diagonal of a quad is no edge of it.
        let halves = [([0, 1, 2], edge(0) | edge(1) << 1), ([0, 2, 3], edge(2) << 1 | edge(3) << 2)];
        halves.into_iter().filter(|_| self.count == 4).filter_map(move |(picked, boundary)| {
            let half = picked.map(|i| corners[i]);
            let [a, b, c] = picked.map(|i| self.colors[i]);
            let patch = || Self { outline: Outline::new(&half), colors: [a, b, c, c], count: 3, boundary, ..*self };
            (turn(half) > 0).then(patch)
        })
    }
}

/// How large a piece is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Shape {
    /// No more than [`ROWS`] rows, and [`PART`](super::canvas::PART) columns.
    Small,
    /// No more than [`ROWS`] rows.
    Low,
    /// More rows: its edges are kept apart.
    Tall,
    /// The same, but too large for [`near`](super::near).
    Vast,
}

/// A convex polygon that turns from +x to +y, ready to be painted; a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Piece {
    pub(super) run: Run,
    /// The first row beyond it.
    end_row: u16,
    shape: Shape,
    /// What it covers of each row; of a tall one, the number of its edges.
    pub(super) cover: [Span; ROWS],
}

const _: () = assert!(size_of::<Piece>() == 64);

impl Piece {
    pub(super) const NOTHING: Self =
        Self { run: Run::NOTHING, end_row: 0, shape: Shape::Small, cover: [Span::EMPTY; ROWS] };

    /// Of few rows.
    #[inline]
    pub(super) fn low(run: Run, end_row: u16, is_small: bool, cover: [Span; ROWS]) -> Self {
        Self { run, end_row, shape: if is_small { Shape::Small } else { Shape::Low }, cover }
    }

    /// Of many rows, given the number of its edges.
    #[inline]
    pub(super) fn tall(run: Run, end_row: u16, is_near: bool, edges: usize) -> Self {
        let shape = if is_near { Shape::Tall } else { Shape::Vast };
        Self { run, end_row, shape, cover: [Span::number(edges as u32); ROWS] }
    }

    /// Rows of the surface in which it counts.
    #[inline]
    pub(super) fn rows(&self) -> Range<i32> {
        self.run.row()..self.end_row.into()
    }

    /// How large it is.
    #[inline]
    pub(super) fn shape(&self) -> Shape {
        self.shape
    }

    /// Which of [`Pieces::tall`] are its edges, if it is tall.
    #[inline]
    pub(super) fn edges(&self) -> Option<usize> {
        matches!(self.shape, Shape::Tall | Shape::Vast).then_some(self.cover[0].to_number() as usize)
    }
}

/// Pieces in the order of painting.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// First and end row of each: all that sorting into bands reads.
    pub(super) rows: Vec<[u16; 2]>,
    /// For anti-aliasing, one a piece.
    pub(super) patches: Vec<Patch>,
    /// Edges of those that are tall.
    pub(super) tall: Vec<Sides>,
    /// Outlines of the same.
    pub(super) outlines: Vec<Outline>,
}

impl List for Pieces {
    fn clear(&mut self) {
        self.pieces.clear();
        self.rows.clear();
        self.patches.clear();
        self.tall.clear();
        self.outlines.clear();
    }
}
