//! Polygons to pixels: bands of rows, each painted whole in the order of polygons, then packed.
//!
//! Bands are independent, and within a band the order is that of control tets and children: so threads cannot change
//! a picture. Polygons that smoothing turned over are not drawn. The slice covers every pixel once, counted with
//! sign, as the box stays in place under subdivision; so each pixel has a polygon that was not turned over, and the
//! last of them is shown.

use std::ops::Range;

use glam::Vec3;

use super::crossed::Crossed;
use super::pack::{BAND_ROWS, bands};
use super::parallel::for_each;
use super::scan::{GridPoint, bounds, is_positive, scan, touched};
use super::scene::{CHUNK, Polygon, Scene};
use super::shade::{Rgb32, Shade};
use super::view::{View, Viewport, ViewportError, plane};
use crate::mesh::TetMesh;
use crate::video::Surface;

/// A part of a slice on its way to pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Triangle {
    pub(super) corners: [GridPoint; 3],
    pub(super) colors: [Vec3; 3],
    /// Edges that lie between labels; bit i: the edge from corner i to the next.
    pub(super) boundary: u8,
}

impl Triangle {
    /// Rows in which the triangle's bounds hold a pixel centre of the surface, if it is positive and there are any.
    #[inline]
    pub(super) fn rows(&self, view: &View) -> Option<Range<i32>> {
        let rows = bounds(&self.corners, view.columns, view.rows)?;
        is_positive(self.corners).then_some(rows)
    }

    /// Rows of the surface that the triangle's bounds touch, if it is positive and there are any.
    #[inline]
    fn touched_rows(&self, view: &View) -> Option<Range<i32>> {
        let (_, rows) = touched(&self.corners, view.columns, 0..view.rows)?;
        is_positive(self.corners).then_some(rows)
    }
}

/// A triangle and the rows in which it counts.
pub(super) type Placed = (Range<i32>, Triangle);

/// Cuts a slice's polygon into triangles on the surface's grid. A quad is always cut from
/// its first corner: both halves lie in one linear field.
#[inline]
pub(super) fn triangulate(view: &View, polygon: Polygon<'_>, mut triangle: impl FnMut(Triangle, [usize; 3])) {
    let mut grid = [GridPoint::default(); 4];
    for (grid, (place, _)) in grid.iter_mut().zip(polygon.corners) {
        *grid = view.grid(place.x, place.y);
    }
    let count = polygon.corners.len();
    for i in 2..count {
        let last = count - 1;
        let ends = [0, i - 1, i];
        // The diagonal of a quad is no edge of it.
        let outer = u8::from(i == 2) | 2 | u8::from(i == last) << 2;
        let edge = |k: usize| polygon.boundary >> k & 1;
        triangle(
            Triangle {
                corners: ends.map(|k| grid[k]),
                colors: ends.map(|k| polygon.corners[k].1),
                boundary: outer & (edge(0) | edge(i - 1) << 1 | edge(last) << 2),
            },
            ends,
        );
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
        let mut lists = std::mem::take(&mut self.triangles);
        self.cut(t, params.levels, &mut lists, |list, _, polygon| {
            triangulate(&view, polygon, |triangle, _| {
                let rows = if antialias { triangle.touched_rows(&view) } else { triangle.rows(&view) };
                if let Some(rows) = rows {
                    list.push((rows, triangle));
                }
            });
        });
        fill(&lists, &view, antialias, surface);
        self.triangles = lists;
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

/// Paints all bands.
fn fill(lists: &[Vec<Placed>], view: &View, antialias: bool, surface: &mut Surface<'_>) {
    let by_band = BandTable::new(lists, view.rows as usize);
    let width = view.columns as usize;
    for_each(bands(surface), |(pixels, crossed): &mut (Vec<Rgb32>, Crossed), mut band| {
        let rows = band.rows();
        let names = by_band.row(band.index()).iter();
        let triangles = names.map(|&name| &lists[(name >> NAME_BITS) as usize][name as usize & ((1 << NAME_BITS) - 1)]);
        if antialias {
            crossed.start(view, rows.clone(), triangles.clone().map(|(_, triangle)| triangle));
        }
        pixels.clear();
        pixels.resize(width * rows.len(), 0);
        for (own, triangle) in triangles {
            let both = own.start.max(rows.start)..own.end.min(rows.end);
            let shade = Shade::new(triangle.corners, triangle.colors);
            scan(triangle.corners, both, |row, columns| {
                let columns = columns.start.max(0) as usize..columns.end.clamp(0, width as i64) as usize;
                if !columns.is_empty() {
                    let start = (row - rows.start) as usize * width;
                    shade.paint(&mut pixels[start..start + width], row, columns);
                }
            });
            if antialias {
                crossed.add(triangle, &shade);
            }
        }
        if antialias {
            crossed.paint(pixels);
        }
        band.pack(pixels);
    });
}

/// Low bits of a triangle's name: its place in its list; the others number the list.
const NAME_BITS: u32 = 14;
// A tet has up to eight children in the slice, each cut into up to two triangles.
const _: () = assert!(CHUNK * 16 <= 1 << NAME_BITS);

/// Names of the triangles that touch each band, ascending, as compressed rows.
struct BandTable {
    start: Vec<u32>,
    names: Vec<u32>,
}

impl BandTable {
    fn new(lists: &[Vec<Placed>], rows: usize) -> Self {
        let bands_of = |rows: &Range<i32>| rows.start as usize / BAND_ROWS..(rows.end as usize - 1) / BAND_ROWS + 1;
        let mut start = vec![0u32; rows.div_ceil(BAND_ROWS) + 1];
        for (rows, _) in lists.iter().flatten() {
            bands_of(rows).for_each(|band| start[band + 1] += 1);
        }
        for band in 1..start.len() {
            start[band] += start[band - 1];
        }
        let mut next = start.clone();
        let mut names = vec![0; start[start.len() - 1] as usize];
        for (number, list) in lists.iter().enumerate() {
            for (place, (rows, _)) in list.iter().enumerate() {
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
