//! A picture of a scene: cut, set up, painted.

use super::canvas::ColorSpace;
use super::paint::Picture;
use super::scan::Outline;
use super::scene::Scene;
use super::setup::Making;
use super::view::{View, Viewport, ViewportError, plane};
use crate::mesh::TetMesh;
use crate::video::Surface;

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
        self.cut(t, params.levels, part, &mut lists, |list, polygons, table| list.push(&making, polygons, table));
        let mut outlines: Vec<Vec<(Outline, u8)>> = Vec::new();
        if params.mesh {
            self.cut(t, 0, part, &mut outlines, |list, polygons, (): &mut ()| {
                list.extend((0..polygons.count).map(|lane| {
                    let axis = |axis: usize| polygons.places.map(|place| view.px(axis, place[axis][lane]));
                    (Outline { x: axis(0), y: axis(1) }, polygons.corners[lane])
                }));
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
