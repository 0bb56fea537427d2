//! Cross-sections as polygons, for figures.

use glam::{DVec2, Vec3};

use super::canvas::ColorSpace;
use super::complex::FINE_BITS;
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
    scene.cut(plane(&mesh.domain, frame), levels, None, &mut lists, |polygons, tet, polygon| {
        let count = usize::from(polygon.count);
        polygons.push(SectionPolygon {
            tet,
            label: mesh.tet_label(tet as usize),
            corners: polygon.places[..count].iter().map(|place| DVec2::from_array(place.to_array()) / fine).collect(),
            colors: polygon.colors()[..count].iter().map(|color| ColorSpace::Rgb.to_rgb(*color).into()).collect(),
        });
    });
    lists.concat()
}
