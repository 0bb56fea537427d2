//! Pieces to pixels: bands of rows, each painted whole in the order of pieces, then packed.
//!
//! Bands are independent, and within a band the order is that of control tets and children: so threads cannot change
//! a picture.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

use super::canvas::{Canvas, ColorSpace, PARTS};
use super::cpu::{self, Kernel};
use super::crossed::Crossed;
use super::near::{ROWS as TALL_ROWS, Sides};
use super::pack::{BAND_ROWS, Band, bands};
use super::parallel::for_each;
use super::piece::{Piece, Pieces, Shape};
use super::run::Brush;
use super::scan::{Edge, Outline, Span, spans};
use super::scene::CHUNK;
use super::view::View;
use crate::video::Surface;

/// Pieces that are fetched at a time.
const BATCH: usize = 16;

/// What a band is painted with; reused from band to band and from picture to picture.
#[derive(Debug)]
struct Painter {
    canvas: Canvas,
    crossed: Crossed,
    /// A row of chroma.
    chroma: Vec<[u8; 2]>,
}

/// Painters that no thread is using.
#[derive(Debug, Default)]
pub(super) struct Painters(Mutex<Vec<Painter>>);

impl Painters {
    fn with(&self, work: impl FnOnce(&mut Painter)) {
        let free = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let new = || Painter { canvas: Canvas::new(), crossed: Crossed::default(), chroma: Vec::new() };
        let mut painter = free.unwrap_or_else(new);
        work(&mut painter);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(painter);
    }
}

/// All that is painted.
pub(super) struct Picture<'a> {
    pub(super) view: &'a View,
    pub(super) antialias: bool,
    pub(super) lists: &'a [Pieces],
    /// Polygons whose edges are drawn over the rest, and the number of their corners.
    pub(super) outlines: &'a [Vec<(Outline, u8)>],
}

impl<'a> Picture<'a> {
    /// Paints all bands.
    pub(super) fn paint(&self, painters: &Painters, surface: &mut Surface<'_>) {
        let by_band = BandTable::new(self.lists, self.view.rows as usize);
        for_each(bands(surface), |mut band| {
            let names = by_band.row(band.index());
            painters.with(|painter| painter.paint(self, names, &mut band));
        });
    }

    fn named(&self, names: &'a [u32]) -> impl Iterator<Item = (&'a Pieces, usize)> + Clone {
        let lists = self.lists;
        names.iter().map(move |&name| (&lists[(name >> NAME_BITS) as usize], name as usize & ((1 << NAME_BITS) - 1)))
    }
}

impl Painter {
    /// Paints a band, which the named pieces touch.
    fn paint<'a>(&mut self, picture: &Picture<'a>, names: &'a [u32], band: &mut Band<'_>) {
        let Self { canvas, crossed, chroma } = self;
        let (rows, space) = (band.rows(), band.space());
        cpu::run(Painting { canvas, picture, names, space, rows: rows.clone() });
        if picture.antialias {
            let patches = picture.named(names).map(|(list, place)| &list.patches[place]);
            let edges = patches.clone().map(|patch| (&patch.outline, patch.count, patch.boundary));
            crossed.start(picture.view, rows.clone(), edges);
            for patch in patches {
                crossed.add(&patch.outline, patch.count, &patch.colors, space);
            }
            crossed.paint(canvas);
        }
        if !picture.outlines.is_empty() {
            const ALL_EDGES: u8 = 0b1111;
            let outlines = picture.outlines.iter().flatten().map(|(outline, count)| (outline, *count, ALL_EDGES));
            crossed.start(picture.view, rows, outlines);
            crossed.places().for_each(|[column, row]| canvas.set_apart(column, row));
        }
        band.pack(canvas, chroma);
    }
}

/// Paints pieces into the `rows` of a canvas.
struct Painting<'a, 'b> {
    canvas: &'b mut Canvas,
    picture: &'b Picture<'a>,
    names: &'a [u32],
    space: ColorSpace,
    rows: Range<i32>,
}

impl Kernel for Painting<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn run(mut self) {
        self.canvas.start(self.space, self.picture.view.columns as usize, self.rows.len());
        let mut pieces = [Piece::NOTHING; BATCH];
        let mut sides = [Sides::NOTHING; BATCH];
        for names in self.names.chunks(BATCH) {
            // Pieces lie far apart: fetched in one go, the waits for them overlap.
            for (piece, (list, place)) in pieces.iter_mut().zip(self.picture.named(names)) {
                *piece = list.pieces[place];
            }
            for ((sides, piece), (list, _)) in sides.iter_mut().zip(&pieces).zip(self.picture.named(names)) {
                if let Some(number) = piece.edges() {
                    *sides = list.tall[number];
                }
            }
            for ((piece, sides), (list, _)) in pieces.iter().zip(&sides).zip(self.picture.named(names)) {
                self.paint(piece, sides, &list.outlines);
            }
        }
    }
}

impl Painting<'_, '_> {
    /// Paints what of a piece lies in the rows. `sides` count where it is tall; among `outlines` is its own then.
    #[inline(always)]
    fn paint(&mut self, piece: &Piece, sides: &Sides, outlines: &[Outline]) {
        match piece.shape() {
            Shape::Small => self.paint_low(piece, &piece.run.brush::<1>(self.space)),
            Shape::Low => self.paint_low(piece, &piece.run.brush::<PARTS>(self.space)),
            Shape::Tall | Shape::Vast => self.paint_tall(piece, sides, outlines),
        }
    }

    #[inline(always)]
    fn paint_low<const WIDTH: usize>(&mut self, piece: &Piece, brush: &Brush<'_, WIDTH>) {
        let (own, seen) = self.rows_of(piece);
        // The table of bands names pieces in bands that they have rows in.
        let cover = (seen.start - own.start) as usize..(seen.end - own.start) as usize;
        let mut rows = self.canvas.rows_mut();
        let at = (seen.start - self.rows.start) as u32 * rows.stride;
        brush.paint(&mut rows, at, seen.start, piece.cover.get(cover).unwrap_or_default());
    }

    #[inline(always)]
    fn paint_tall(&mut self, piece: &Piece, sides: &Sides, outlines: &[Outline]) {
        let (_, seen) = self.rows_of(piece);
        let brush = piece.run.brush::<PARTS>(self.space);
        let mut rows = self.canvas.rows_mut();
        let columns = self.picture.view.columns;
        for row in seen.clone().step_by(TALL_ROWS) {
            let is_near = piece.shape() == Shape::Tall;
            let found = if is_near { sides.spans(piece.run.origin, row, columns) } else { None };
            let found = found.unwrap_or_else(|| exactly(piece, outlines, row, columns));
            let count = TALL_ROWS.min((seen.end - row) as usize);
            let at = (row - self.rows.start) as u32 * rows.stride;
            brush.paint(&mut rows, at, row, &found[..count]);
        }
    }

    /// The rows of a piece, and those of them that are painted.
    #[inline(always)]
    fn rows_of(&self, piece: &Piece) -> (Range<i32>, Range<i32>) {
        let own = piece.rows();
        let seen = own.start.max(self.rows.start)..own.end.min(self.rows.end);
        (own, seen)
    }
}

/// Spans of a tall piece where single precision is not sure of them.
#[cold]
#[inline(never)]
fn exactly(piece: &Piece, outlines: &[Outline], row: i32, columns: i32) -> [Span; TALL_ROWS] {
    let outline = piece.edges().and_then(|number| outlines.get(number));
    cpu::run(Exactly { outline: outline.unwrap_or(&Outline::NOTHING), row, columns })
}

/// See [`exactly`].
struct Exactly<'a> {
    outline: &'a Outline,
    row: i32,
    columns: i32,
}

impl Kernel for Exactly<'_> {
    type Output = [Span; TALL_ROWS];

    #[inline(always)]
    fn run(self) -> Self::Output {
        spans(&Edge::all(self.outline), self.row, self.columns)
    }
}

/// Low bits of a polygon's name: its place in its list; the others number the list.
const NAME_BITS: u32 = 14;
// A tet has up to eight children in the slice, each cut into up to two triangles.
const _: () = assert!(CHUNK * 16 <= 1 << NAME_BITS);

/// Names of the polygons that touch each band, ascending, as compressed rows.
struct BandTable {
    start: Vec<u32>,
    names: Vec<u32>,
}

impl BandTable {
    fn new(lists: &[Pieces], rows: usize) -> Self {
        let bands_of = |rows: &[u16; 2]| {
            let [first, end] = rows.map(usize::from);
            first / BAND_ROWS..(end - 1) / BAND_ROWS + 1
        };
        let mut start = vec![0u32; rows.div_ceil(BAND_ROWS) + 1];
        for rows in lists.iter().flat_map(|list| &list.rows) {
            bands_of(rows).for_each(|band| start[band + 1] += 1);
        }
        for band in 1..start.len() {
            start[band] += start[band - 1];
        }
        let mut next = start.clone();
        let mut names = vec![0; start[start.len() - 1] as usize];
        for (number, list) in lists.iter().enumerate() {
            for (place, rows) in list.rows.iter().enumerate() {
                for band in bands_of(rows) {
                    names[next[band] as usize] = (number << NAME_BITS | place) as u32;
                    next[band] += 1;
                }
            }
        }
        Self { start, names }
    }

    fn row(&self, band: usize) -> &[u32] {
        &self.names[self.start[band] as usize..self.start[band + 1] as usize]
    }
}
