//! All that the frames say about a model: tet by tet where colour is continuous, pixel by pixel along label boundaries.

use glam::{IVec3, Vec3};

use super::edges::EdgePixels;
use super::interface::find_crossings;
use super::marks::Marks;
use super::model::Model;
use super::moments::{Moments, View, find_pieces, measure};
use super::parallel;
use super::planes::Planes;
use super::smoothness::{gradient_form, value};
use crate::video::Volume;

/// What counts beside the centres of pixels.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Beside {
    /// [`super::FitParams::quarter_weight`].
    pub(super) quarter: f32,
    /// [`super::FitParams::gradient_weight`].
    pub(super) gradient: f32,
}

/// What the frames say at the model's present positions.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Of tets, over the pixels whose centres they hold and that no boundary passes.
    pub(super) moments: Vec<Moments>,
    /// Pixels that boundaries pass.
    pub(super) edges: EdgePixels,
    /// What was counted.
    pub(super) beside: Beside,
}

impl Evidence {
    /// Looks at the frames, in the memory of what was seen before. `points` are the model's points, `colors` its nodes'
    /// colours (only to choose references by).
    pub(super) fn gather(
        self,
        model: &Model,
        (points, colors): (&[IVec3], &[Vec3]),
        frames: &Volume,
        beside: Beside,
    ) -> Self {
        let planes = Planes::new(model, frames);
        let crossings = find_crossings(&model.interfaces, points, &planes);
        let marks = Marks::new(&crossings, model.domain.width, model.domain.height);
        let view = View { planes, marks: &marks, beside };
        let moments = measure(model, points, colors, &view, self.moments);
        let pieces = find_pieces(model, points, &view);
        Self { moments, edges: EdgePixels::new(&marks, frames, &pieces, &crossings), beside }
    }

    /// Number of pixels that count.
    pub(super) fn pixels(&self) -> u64 {
        self.moments.iter().map(|m| u64::from(m.pixels)).sum::<u64>() + self.edges.counted()
    }

    /// What all counts, in pixels.
    pub(super) fn weight(&self) -> f64 {
        self.moments.iter().map(|m| f64::from(m.weight)).sum::<f64>() + self.edges.counted() as f64
    }

    /// The squared error over all pixels and channels, and what gradients cost, for wedges of these colours.
    pub(super) fn squared_error(&self, model: &Model, wedge_colors: &[Vec3]) -> f64 {
        let nodes = model.node_colors(wedge_colors);
        let inside = parallel::sum(self.moments.len(), |m| {
            let tet = model.tets[self.moments[m].tet as usize];
            self.moments[m].energy(tet.map(|n| nodes[n as usize]))
        });
        inside + self.edges.energy(model, &nodes)
    }

    /// The squared error without what gradients cost. `points` are those that were looked at.
    pub(super) fn error_of_pixels(&self, model: &Model, points: &[IVec3], wedge_colors: &[Vec3]) -> f64 {
        let nodes = model.node_colors(wedge_colors);
        let inside = parallel::sum(self.moments.len(), |m| self.error_of_tet(model, points, &nodes, m));
        inside + self.edges.energy(model, &nodes)
    }

    /// [`Self::error_of_pixels`] within the tet of moments `m`.
    fn error_of_tet(&self, model: &Model, points: &[IVec3], nodes: &[Vec3], m: usize) -> f64 {
        let moments = &self.moments[m];
        let tet = moments.tet as usize;
        let colors = model.tets[tet].map(|n| nodes[n as usize]);
        let corners = model.tet_points(tet).map(|p| points[p]);
        let cost =
            gradient_form(corners, model.fine_unit, self.beside.gradient).map_or(0.0, |form| value(&form, colors));
        (moments.energy(colors) - cost).max(0.0)
    }

    /// The root mean square error inside of a tet, a mean over all pixels that no boundary passes.
    pub(super) fn error_within_tets(&self, model: &Model, points: &[IVec3], wedge_colors: &[Vec3]) -> f64 {
        let nodes = model.node_colors(wedge_colors);
        let sum = parallel::sum(self.moments.len(), |m| {
            (self.error_of_tet(model, points, &nodes, m) * f64::from(self.moments[m].weight) / 3.0).sqrt()
        });
        let weight: f64 = self.moments.iter().map(|m| f64::from(m.weight)).sum();
        sum / weight.max(1.0)
    }
}
