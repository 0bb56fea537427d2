//! Polygons of a slice to pieces, which are ready to be painted: where each is seen, what it covers, its colour.
//!
//! Polygons that smoothing turned over are not drawn. The slice covers every pixel once, counted with
//! sign, as the box stays in place under subdivision; so each pixel has a polygon that was not turned over, and the
//! last of them is shown.

use std::ops::Range;

use glam::Vec4;

use super::canvas::ColorSpace;
use super::grid::turn;
use super::paint::Picture;
use super::parallel::List;
use super::run::Run;
use super::scan::{Edges, Hull, Outline, ROWS, Seen, Span};
use super::scene::Scene;
use super::slice::Polygon;
use super::view::{View, Viewport, ViewportError, plane};
use crate::mesh::TetMesh;
use crate::video::Surface;

/// A part of a slice on the surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) outline: Outline,
    /// In the channels of the canvas, one a corner.
    pub(super) colors: [Vec4; 4],
    /// As of [`Polygon`].
    is_beyond: bool,
    /// 3 or 4.
    pub(super) count: u8,
    /// Edges that lie between labels; bit i: the edge from corner i to the next.
    pub(super) boundary: u8,
}

impl Patch {
    /// A polygon of a slice.
    #[inline]
    fn new(outline: Outline, polygon: &Polygon<'_>) -> Self {
        let Polygon { count, boundary, is_beyond, .. } = *polygon;
        Self { outline, colors: polygon.colors(), is_beyond, count, boundary }
    }

    /// Hands out what of a patch is positive where it is not convex: rounding bends slivers. Of what smoothing turned over
    /// nothing is left.
    #[cold]
    fn halves(&self, mut take: impl FnMut(&Self)) {
        if self.count == 3 {
            return;
        }
        let corners = self.outline.corners();
        let edge = |i: u8| self.boundary >> i & 1;
        // The diagonal of a quad is no edge of it.
        for (picked, boundary) in [([0, 1, 2], edge(0) | edge(1) << 1), ([0, 2, 3], edge(2) << 1 | edge(3) << 2)] {
            let half = picked.map(|i| corners[i]);
            if turn(half) > 0 {
                let [a, b, c] = picked.map(|i| self.colors[i]);
                take(&Self { outline: Outline::new(&half), colors: [a, b, c, c], count: 3, boundary, ..*self });
            }
        }
    }
}

/// A convex polygon that turns from +x to +y, ready to be painted; a line of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Piece {
    pub(super) run: Run,
    /// The first row beyond it.
    end_row: u16,
    /// Whether it covers more than [`ROWS`] rows.
    is_tall: bool,
    /// What it covers of each row; of a tall one, the number of its outline.
    pub(super) cover: [Span; ROWS],
}

const _: () = assert!(size_of::<Piece>() == 64);

impl Piece {
    pub(super) const NOTHING: Self = Self { run: Run::NOTHING, end_row: 0, is_tall: false, cover: [Span::EMPTY; ROWS] };

    /// Rows of the surface in which it counts.
    #[inline]
    pub(super) fn rows(&self) -> Range<i32> {
        self.run.row()..self.end_row.into()
    }

    /// Which of [`Pieces::tall`] is its outline, if it is tall.
    #[inline]
    pub(super) fn tall(&self) -> Option<usize> {
        self.is_tall.then_some(self.cover[0].to_number() as usize)
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
    /// Outlines of those that are tall.
    pub(super) tall: Vec<Outline>,
}

impl List for Pieces {
    fn clear(&mut self) {
        self.pieces.clear();
        self.rows.clear();
        self.patches.clear();
        self.tall.clear();
    }
}

/// What pieces are made for.
struct Making<'a> {
    view: &'a View,
    space: ColorSpace,
    antialias: bool,
}

impl Pieces {
    /// Appends what of a polygon is seen.
    #[inline(always)]
    fn push(&mut self, making: &Making<'_>, polygon: &Polygon<'_>) {
        let places = making.view.places(polygon);
        let hull = Hull::new(places);
        // Before all else: a quarter of all polygons covers no pixel where pictures are small.
        let Some(seen) = making.seen(&hull) else { return };
        let (outline, extent) = (Outline::of_places(places), hull.extent());
        if outline.is_convex(extent) {
            self.push_convex(making, &seen, extent, outline, || Patch::new(outline, polygon));
        } else {
            self.push_halves(making, &Patch::new(outline, polygon));
        }
    }

    #[cold]
    fn push_halves(&mut self, making: &Making<'_>, patch: &Patch) {
        patch.halves(|half| {
            let hull = half.outline.hull();
            if let Some(seen) = making.seen(&hull) {
                self.push_convex(making, &seen, hull.extent(), half.outline, || *half);
            }
        });
    }

    /// Appends a convex polygon, whose colours are asked for if it covers anything.
    #[inline(always)]
    fn push_convex(
        &mut self,
        making: &Making<'_>,
        Seen { column, rows }: &Seen,
        extent: f64,
        outline: Outline,
        patch: impl FnOnce() -> Patch,
    ) {
        let is_tall = rows.len() > ROWS;
        let cover = if is_tall {
            // Looked up row by row when it is painted.
            self.tall.push(outline);
            [Span::number(self.tall.len() as u32 - 1); ROWS]
        } else {
            let cover = Edges::new(outline).spans(rows.start, making.view.columns);
            if !making.antialias && Span::are_empty(&cover) {
                return;
            }
            cover
        };
        let patch = patch();
        let run = Run::new(outline, (patch.colors, patch.is_beyond), making.space, [*column, rows.start], extent);
        self.rows.push([rows.start as u16, rows.end as u16]);
        self.pieces.push(Piece { run, end_row: rows.end as u16, is_tall, cover });
        if making.antialias {
            self.patches.push(patch);
        }
    }
}

impl Making<'_> {
    /// Where a polygon may be seen.
    #[inline(always)]
    fn seen(&self, hull: &Hull) -> Option<Seen> {
        let size = [self.view.columns, self.view.rows];
        if self.antialias { hull.pixels(size) } else { hull.centers(size) }
    }
}

/// How a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawParams {
    /// How often the mesh is subdivided; at most twice.
    pub levels: u8,
    /// Whether pixels that a boundary between labels crosses show the mean over their square of all that covers it.
    /// Other pixels, and without it all, show the colour at their centre.
    pub antialias: bool,
    /// The part of the picture to draw; `None`: the whole.
    pub viewport: Option<Viewport>,
    /// Whether the control mesh's cross-section is drawn over the picture, as lines that are lighter or darker than
    /// what they cross.
    pub mesh: bool,
}

impl Scene {
    /// Draws the picture at time `frame`, in frames since the slab's first, clamped to the slab. Pixels do not depend on
    /// the number of threads of the rayon pool that this runs in.
    ///
    /// # Errors
    /// A viewport that cannot be drawn; nothing is drawn then.
    pub fn draw(&mut self, frame: f64, params: &DrawParams, surface: &mut Surface<'_>) -> Result<(), ViewportError> {
        let viewport = params.viewport.unwrap_or_else(|| Viewport::whole(self.domain()));
        viewport.check()?;
        let view = View::new(self.domain(), viewport, (surface.width(), surface.height()));
        let t = plane(self.domain(), frame);
        let antialias = params.antialias && self.find_interfaces();
        let space = ColorSpace::of(surface.format(), surface.matrix());
        self.color_in(space);
        let making = Making { view: &view, space, antialias };
        let mut lists = std::mem::take(&mut self.pieces);
        let part = params.viewport.map(|viewport| (viewport, (surface.width(), surface.height())));
        self.cut(t, params.levels, part, &mut lists, |list, _, polygon| list.push(&making, &polygon));
        let mut outlines: Vec<Vec<(Outline, u8)>> = Vec::new();
        if params.mesh {
            self.cut(t, 0, part, &mut outlines, |list, _, polygon| {
                list.push((Outline::of_places(view.places(&polygon)), polygon.count));
            });
        }
        Picture { view: &view, antialias, lists: &lists, outlines: &outlines }.paint(&self.painters, surface);
        self.pieces = lists;
        Ok(())
    }
}

/// Draws `mesh` at time `frame` without keeping anything: [`Scene::draw`] of a scene made for one picture.
///
/// # Errors
/// A viewport that cannot be drawn.
pub fn draw(mesh: &TetMesh, frame: f64, params: &DrawParams, surface: &mut Surface<'_>) -> Result<(), ViewportError> {
    let mut scene = Scene::new(mesh.domain);
    scene.extend(mesh);
    scene.draw(frame, params, surface)
}
