//! All that the frames say about a model: tet by tet where colour is continuous, pixel by pixel along label boundaries.

use glam::{IVec3, Vec3};

use super::edges::EdgePixels;
use super::interface::find_crossings;
use super::marks::Marks;
use super::model::Model;
use super::moments::{Moments, View, find_pieces, measure};
use super::parallel;
use super::planes::Planes;
use crate::video::Volume;

/// What the frames say at the model's present positions.
#[derive(Debug, Clone, Default)]
pub(super) struct Evidence {
    /// Of tets, over the pixels whose centres they hold and that no boundary passes.
    pub(super) moments: Vec<Moments>,
    /// Pixels that boundaries pass.
    pub(super) edges: EdgePixels,
}

impl Evidence {
    /// Looks at the frames, in the memory of what was seen before; a quarter of a pixel counts `quarter_weight`. `points`
    /// are the model's points, `colors` its nodes' colours (only to choose references by).
    pub(super) fn gather(
        self,
        model: &Model,
        (points, colors): (&[IVec3], &[Vec3]),
        frames: &Volume,
        quarter_weight: f32,
    ) -> Self {
        let planes = Planes::new(model, frames);
        let crossings = find_crossings(&model.interfaces, points, &planes);
        let marks = Marks::new(&crossings, model.domain.width, model.domain.height);
        let view = View { planes, marks: &marks, quarter_weight };
        let moments = measure(model, points, colors, &view, self.moments);
        let pieces = find_pieces(model, points, &view);
        Self { moments, edges: EdgePixels::new(&marks, frames, pieces, &crossings) }
    }

    /// Number of pixels that count.
    pub(super) fn pixels(&self) -> u64 {
        self.moments.iter().map(|m| u64::from(m.pixels)).sum::<u64>() + self.edges.counted()
    }

    /// What all counts, in pixels.
    pub(super) fn weight(&self) -> f64 {
        self.moments.iter().map(|m| f64::from(m.weight)).sum::<f64>() + self.edges.counted() as f64
    }

    /// The squared error over all pixels and channels, for wedges of these colours.
    pub(super) fn squared_error(&self, model: &Model, wedge_colors: &[Vec3]) -> f64 {
        let nodes = model.node_colors(wedge_colors);
        let inside = parallel::sum(self.moments.len(), |m| {
            let tet = model.tets[self.moments[m].tet as usize];
            self.moments[m].energy(tet.map(|n| nodes[n as usize]))
        });
        inside + self.edges.energy(model, &nodes)
    }

    /// The root mean square error inside of a tet, a mean over all pixels that no boundary passes.
    pub(super) fn error_within_tets(&self, model: &Model, wedge_colors: &[Vec3]) -> f64 {
        let nodes = model.node_colors(wedge_colors);
        let sum = parallel::sum(self.moments.len(), |m| {
            let moments = &self.moments[m];
            let tet = model.tets[moments.tet as usize];
            (moments.energy(tet.map(|n| nodes[n as usize])) * f64::from(moments.weight) / 3.0).sqrt()
        });
        let weight: f64 = self.moments.iter().map(|m| f64::from(m.weight)).sum();
        sum / weight.max(1.0)
    }
}
