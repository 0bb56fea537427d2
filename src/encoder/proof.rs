//! What decoders will show of a slab, beside its frames: the error that the target is about.
//!
//! In: the mesh as it was coded, frames. Out: the difference. The fit knows the error, too, but by squares, and mean absolute
//! differences are 0.5 to 0.7 of their root, clip by clip.

use std::sync::Arc;

use super::EncodeError;
use crate::mesh::TetMesh;
use crate::metrics::Difference;
use crate::render::{DrawParams, Scene};
use crate::video::{Frame, Surface};

/// One frame in so many is drawn.
const INTERVAL: u32 = 3;

/// Draws a slab as its packets come out.
#[derive(Debug)]
pub(super) struct Proof {
    params: DrawParams,
    scene: Option<Scene>,
    total: Difference,
}

impl Proof {
    pub(super) fn new(subdivision_levels: u8) -> Self {
        let params = DrawParams { levels: subdivision_levels, antialias: true, viewport: None, mesh: false };
        Self { params, scene: None, total: Difference::default() }
    }

    /// Compares the `frames` of the slab, with their numbers in it, whose packets have been written. Gives their mean
    /// absolute error; `None` where none was drawn.
    ///
    /// # Errors
    /// A size that cannot be drawn.
    pub(super) fn compare<'a>(
        &mut self,
        mesh: &TetMesh,
        frames: impl Iterator<Item = (u32, &'a Arc<Frame>)>,
    ) -> Result<Option<f64>, EncodeError> {
        let scene = self.scene.get_or_insert_with(|| Scene::new(mesh.domain));
        scene.extend(mesh);
        let mut here = Difference::default();
        for (number, frame) in frames.filter(|(number, _)| number % INTERVAL == 0) {
            let mut picture = Frame::clone(frame);
            scene.draw(number.into(), &self.params, &mut Surface::of_frame(&mut picture))?;
            here.add(frame, &picture);
            self.total.add(frame, &picture);
        }
        Ok((here != Difference::default()).then(|| here.reconstruction_error()))
    }

    /// Mean absolute error of all frames compared; `None` where none was.
    pub(super) fn error(&self) -> Option<f64> {
        (self.total != Difference::default()).then(|| self.total.reconstruction_error())
    }
}
