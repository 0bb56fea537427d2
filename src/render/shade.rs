//! Linear colour inside a polygon, as a function of places.
//!
//! In: an outline, colours at its corners. Out: the integral over a part of a pixel. Forbidden here: pixels.

use glam::{Vec3A, Vec4};

use super::canvas::ColorSpace;
use super::coverage::Part;
use super::grid::{GridPoint, center_distance};
use super::scan::{Outline, Turning};

/// The linear colour of a polygon in RGB levels: its value at a corner and how it changes a pixel to the right and down.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shade {
    corner: GridPoint,
    color: Vec3A,
    right: Vec3A,
    down: Vec3A,
    low: Vec3A,
    high: Vec3A,
}

impl Shade {
    /// The field that takes these colours, given in the channels of a canvas, at the corners.
    pub(super) fn new(outline: &Outline, colors: &[Vec4; 4], space: ColorSpace) -> Self {
        let colors = colors.map(|color| space.to_rgb(color));
        let (low, high) = range(&colors);
        let Turning { diagonals: [u, v], double_area, .. } = Turning::new(outline.x, outline.y);
        let [along_u, along_v] = [colors[2] - colors[0], colors[3] - colors[1]].map(|change| change.as_dvec3());
        let scale = 1.0 / double_area;
        let right = (along_u * (v[1] * scale) - along_v * (u[1] * scale)).as_vec3a();
        let down = (along_v * (u[0] * scale) - along_u * (v[0] * scale)).as_vec3a();
        Self { corner: GridPoint::from_px(outline.x[0], outline.y[0]), color: colors[0], right, down, low, high }
    }

    /// The integral over a part of a pixel. The mean is the colour at the part's centroid, held within that of the
    /// corners and [0, 255].
    #[inline]
    pub(super) fn integral(&self, [column, row]: [i32; 2], part: Part) -> Vec3A {
        let [x, y] = center_distance(self.corner, column.into(), row.into());
        let area = part.area as f32;
        let right = self.right * (x * area + part.moment.x as f32);
        let down = self.down * (y * area + part.moment.y as f32);
        let levels = |color: Vec3A| color.clamp(Vec3A::ZERO, Vec3A::splat(255.0)) * area;
        (self.color * area + right + down).max(levels(self.low)).min(levels(self.high))
    }
}

#[inline]
fn range([a, b, c, d]: &[Vec3A; 4]) -> (Vec3A, Vec3A) {
    (a.min(*b).min(c.min(*d)), a.max(*b).max(c.max(*d)))
}
