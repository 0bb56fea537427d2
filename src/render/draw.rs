//! Polygons to pixels: bands of rows, each painted whole in the order of polygons, then packed.
//!
//! Bands are independent, and within a band the order is that of control tets and children: so threads cannot change
//! a picture. Polygons that smoothing turned over are not drawn. The slice covers every pixel once, counted with
//! sign, as the box stays in place under subdivision; so each pixel has a polygon that was not turned over, and the
//! last of them is shown.

use std::sync::{Mutex, PoisonError};

use glam::Vec3;

use super::canvas::{Canvas, ColorSpace};
use super::crossed::Crossed;
use super::pack::{BAND_ROWS, Band, bands};
use super::parallel::{List, for_each};
use super::scan::{GridPoint, bounds, scan, touched, turn};
use super::scene::{CHUNK, Polygon, Scene};
use super::shade::Run;
use super::view::{View, Viewport, ViewportError, plane};
use crate::mesh::TetMesh;
use crate::video::Surface;

/// A part of a slice on the surface's grid.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) corners: [GridPoint; 4],
    /// RGB levels, one a corner. They are linear: the first three say all.
    pub(super) colors: [Vec3; 4],
    /// 3 or 4.
    count: u8,
    /// Edges that lie between labels; bit i: the edge from corner i to the next.
    boundary: u8,
}

impl Patch {
    /// A triangle that is known to turn from +x to +y.
    pub(super) fn triangle([a, b, c]: [GridPoint; 3], colors: [Vec3; 3], boundary: u8) -> Self {
        Self { corners: [a, b, c, c], colors: [colors[0], colors[1], colors[2], colors[2]], count: 3, boundary }
    }

    /// A polygon of a slice.
    #[inline]
    fn new(view: &View, polygon: Polygon<'_>) -> Self {
        let count = polygon.corners.len() as u8;
        let (corners, colors) = ([GridPoint::default(); 4], [Vec3::ZERO; 4]);
        let mut patch = Self { corners, colors, count, boundary: polygon.boundary };
        for (i, (place, color)) in polygon.corners.iter().enumerate() {
            patch.corners[i] = view.grid(place.x, place.y);
            patch.colors[i] = *color;
        }
        patch
    }

    /// The corners in order.
    #[inline]
    pub(super) fn corners(&self) -> &[GridPoint] {
        &self.corners[..self.count.into()]
    }

    /// The same quad from its third corner on.
    fn turned(self) -> Self {
        let ([a, b, c, d], [p, q, r, s]) = (self.corners, self.colors);
        let boundary = (self.boundary >> 2 | self.boundary << 2) & 0b1111;
        Self { corners: [c, d, a, b], colors: [r, s, p, q], count: self.count, boundary }
    }

    /// Hands out the patch whole where it is convex, else the halves of it that are positive: rounding bends slivers.
    /// Of what smoothing turned over nothing is left. The first three corners of a quad are its larger half.
    #[inline]
    fn convex(self, mut take: impl FnMut(Self)) {
        let [a, b, c, d] = self.corners;
        if self.count == 3 {
            if turn([a, b, c]) > 0 {
                take(self);
            }
            return;
        }
        let halves = [turn([a, b, c]), turn([a, c, d])];
        if halves[0] >= 0 && halves[1] >= 0 && halves != [0, 0] && turn([b, c, d]) >= 0 && turn([d, a, b]) >= 0 {
            return take(if halves[0] >= halves[1] { self } else { self.turned() });
        }
        let [p, q, r, s] = self.colors;
        let edge = |i: u8| self.boundary >> i & 1;
        // The diagonal of a quad is no edge of it.
        if halves[0] > 0 {
            take(Self::triangle([a, b, c], [p, q, r], edge(0) | edge(1) << 1));
        }
        if halves[1] > 0 {
            take(Self::triangle([a, c, d], [p, r, s], edge(2) << 1 | edge(3) << 2));
        }
    }
}

/// A convex polygon that turns from +x to +y, ready to be painted; two lines of the cache.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
pub(super) struct Piece {
    corners: [GridPoint; 4],
    run: Run,
    /// Rows of the surface in which it counts.
    first_row: i32,
    end_row: i32,
    /// 3 or 4.
    count: u8,
    /// As of [`Patch`].
    pub(super) boundary: u8,
}

impl Piece {
    const NOTHING: Self = Self {
        corners: [GridPoint { x: 0, y: 0 }; 4],
        run: Run::NOTHING,
        first_row: 0,
        end_row: 0,
        count: 0,
        boundary: 0,
    };

    /// The corners in order.
    #[inline]
    pub(super) fn corners(&self) -> &[GridPoint] {
        &self.corners[..self.count.into()]
    }
}

/// Pieces in the order of painting, and for anti-aliasing the colours of each.
#[derive(Debug, Default)]
pub(super) struct Pieces {
    pieces: Vec<Piece>,
    /// First and end row of each: all that sorting into bands reads.
    rows: Vec<[i32; 2]>,
    colors: Vec<[Vec3; 4]>,
}

impl List for Pieces {
    fn clear(&mut self) {
        self.pieces.clear();
        self.rows.clear();
        self.colors.clear();
    }
}

impl Pieces {
    /// Appends what of a patch is seen.
    #[inline]
    fn push(&mut self, view: &View, space: ColorSpace, antialias: bool, patch: &Patch) {
        let corners = patch.corners();
        let seen = if antialias {
            touched(corners, view.columns, 0..view.rows)
        } else {
            bounds(corners, view.columns, view.rows)
        };
        let Some((columns, rows)) = seen else { return };
        self.rows.push([rows.start, rows.end]);
        self.pieces.push(Piece {
            corners: patch.corners,
            run: Run::new(patch, space, [columns.start, rows.start], columns.len() as u32),
            first_row: rows.start,
            end_row: rows.end,
            count: patch.count,
            boundary: patch.boundary,
        });
        if antialias {
            self.colors.push(patch.colors);
        }
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
        let mut lists = std::mem::take(&mut self.pieces);
        self.cut(t, params.levels, &mut lists, |list, _, polygon| {
            Patch::new(&view, polygon).convex(|patch| list.push(&view, space, antialias, &patch));
        });
        let mut outlines: Vec<Vec<Patch>> = Vec::new();
        if params.mesh {
            self.cut(t, 0, &mut outlines, |list, _, polygon| list.push(Patch::new(&view, polygon)));
        }
        let picture = Picture { view: &view, antialias, lists: &lists, outlines: &outlines };
        picture.fill(&self.painters, surface);
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

/// Pieces that are fetched at a time.
const BATCH: usize = 16;

/// What a band is painted with; reused from band to band and from picture to picture.
#[derive(Debug)]
struct Painter {
    canvas: Canvas,
    crossed: Crossed,
}

/// Painters that no thread is using.
#[derive(Debug, Default)]
pub(super) struct Painters(Mutex<Vec<Painter>>);

impl Painters {
    fn with(&self, work: impl FnOnce(&mut Painter)) {
        let free = self.0.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut painter = free.unwrap_or_else(|| Painter { canvas: Canvas::new(), crossed: Crossed::default() });
        work(&mut painter);
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(painter);
    }
}

/// All that is painted.
struct Picture<'a> {
    view: &'a View,
    antialias: bool,
    lists: &'a [Pieces],
    /// Polygons whose edges are drawn over the rest.
    outlines: &'a [Vec<Patch>],
}

impl<'a> Picture<'a> {
    /// Paints all bands.
    fn fill(&self, painters: &Painters, surface: &mut Surface<'_>) {
        let by_band = BandTable::new(self.lists, self.view.rows as usize);
        for_each(bands(surface), |mut band| {
            let names = by_band.row(band.index());
            painters.with(|painter| painter.paint(self, names, &mut band));
        });
    }

    fn named(&self, names: &'a [u32]) -> impl Iterator<Item = (&'a Pieces, usize)> {
        let lists = self.lists;
        names.iter().map(move |&name| (&lists[(name >> NAME_BITS) as usize], name as usize & ((1 << NAME_BITS) - 1)))
    }
}

impl Painter {
    /// Paints a band, which the named pieces touch.
    fn paint<'a>(&mut self, picture: &Picture<'a>, names: &'a [u32], band: &mut Band<'_>) {
        let Self { canvas, crossed } = self;
        let (rows, width) = (band.rows(), picture.view.columns as usize);
        let space = band.space();
        canvas.start(space, width, rows.len());
        for names in names.chunks(BATCH) {
            // Pieces lie far apart: fetched in one go, the waits for them overlap.
            let mut pieces = [Piece::NOTHING; BATCH];
            pieces.iter_mut().zip(picture.named(names)).for_each(|(piece, (list, place))| *piece = list.pieces[place]);
            for piece in &pieces[..names.len()] {
                let both = piece.first_row.max(rows.start)..piece.end_row.min(rows.end);
                let brush = piece.run.brush(space);
                scan(piece.corners(), both, |row, columns| {
                    let columns = columns.start.max(0) as usize..columns.end.clamp(0, width as i64) as usize;
                    if !columns.is_empty() {
                        brush.paint(canvas.row_mut((row - rows.start) as usize), row, columns);
                    }
                });
            }
        }
        if picture.antialias {
            let pieces = picture.named(names).map(|(list, place)| &list.pieces[place]);
            crossed.start(picture.view, rows.clone(), pieces.map(|piece| (piece.corners(), piece.boundary)));
            for (list, place) in picture.named(names) {
                crossed.add(list.pieces[place].corners(), &list.colors[place]);
            }
            crossed.paint(canvas);
        }
        if !picture.outlines.is_empty() {
            const ALL_EDGES: u8 = 0b1111;
            let outlines = picture.outlines.iter().flatten().map(|patch| (patch.corners(), ALL_EDGES));
            crossed.start(picture.view, rows, outlines);
            crossed.places().for_each(|[column, row]| canvas.set_apart(column, row));
        }
        band.pack(canvas);
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
        let bands_of = |&[first, end]: &[i32; 2]| first as usize / BAND_ROWS..(end as usize - 1) / BAND_ROWS + 1;
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
