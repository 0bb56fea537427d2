//! Cross-sections as polygons, for figures.

use glam::{DVec2, Vec3};

use super::canvas::ColorSpace;
use super::complex::FINE_BITS;
use super::lanes::Lanes;
use super::scene::Scene;
use super::view::plane;
use crate::mesh::TetMesh;
use crate::video::Label;

/// One tet's part of a slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SectionPolygon {
    /// The control tet it belongs to.
    pub tet: u32,
    /// Its label.
    pub label: Label,
    /// 3 or 4 corners in source pixels, turning from +x to +y (the other way in a child that smoothing turned over).
    pub corners: Vec<DVec2>,
    /// One a corner, in 8-bit levels, not clamped.
    pub colors: Vec<Vec3>,
}

/// The slice of `mesh`, subdivided `levels` times, at time `frame` (frames since the slab's first, clamped to the
/// slab). Neighbouring polygons share the bits of their corners.
pub fn cross_section(mesh: &TetMesh, frame: f64, levels: u8) -> Vec<SectionPolygon> {
    let mut scene = Scene::new(mesh.domain);
    scene.extend(mesh);
    let fine = f64::from(mesh.domain.unit()) * f64::from(1 << FINE_BITS);
    let mut lists: Vec<Vec<SectionPolygon>> = Vec::new();
    scene.cut(plane(&mesh.domain, frame), levels, None, &mut lists, |list, polygons, (): &mut ()| {
        list.extend((0..polygons.count).map(|lane| {
            let (tet, count) = (polygons.tets[lane], usize::from(polygons.corners[lane]));
            let corner = |[x, y]: &[Lanes<f64>; 2]| DVec2::new(x[lane], y[lane]) / fine;
            SectionPolygon {
                tet,
                label: mesh.tet_label(tet as usize),
                corners: polygons.places[..count].iter().map(corner).collect(),
                colors: polygons.colors(lane)[..count]
                    .iter()
                    .map(|color| ColorSpace::Rgb.to_rgb(*color).into())
                    .collect(),
            }
        }));
    });
    lists.concat()
}
