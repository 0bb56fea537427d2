//! The slab that is drawn: what packets brought of it, and which of its pictures there are.

use super::reader::{Growth, Progress};
use super::{DecodeError, DecoderConfig, RenderParams};
use crate::bitstream::SequenceHeader;
use crate::mesh::{Domain, MeshCounts, TetMesh};
use crate::render::{DrawParams, Scene};
use crate::video::Surface;

/// Deepest subdivision drawn, as in the stream's header.
const MAX_LEVELS: u8 = 2;

/// A slab as far as its packets have come.
#[derive(Debug)]
pub(super) struct Slab {
    scene: Scene,
    /// What the scene has not taken in yet: packets on the way to a picture cost no more than parsing.
    behind: Vec<TetMesh>,
    header: SequenceHeader,
    /// Number of its first frame, counted from the start of the stream.
    first_frame: u64,
    /// The last time to draw, in frames since the slab's first: beyond it the mesh has not come yet.
    last_frame: f64,
}

/// A picture of a slab.
#[derive(Debug)]
pub(super) struct DrawingAt {
    /// Frames since the slab's first.
    frame: f64,
    params: DrawParams,
}

impl Slab {
    /// A slab of which nothing has come, in the memory of one that is over.
    pub(super) fn new(header: SequenceHeader, first_frame: u64, domain: Domain, over: Option<Self>) -> Self {
        let scene = over.map_or_else(|| Scene::new(domain), |slab| slab.scene.emptied(domain));
        Self { scene, behind: Vec::new(), header, first_frame, last_frame: 0.0 }
    }

    /// Takes in what a packet brought.
    pub(super) fn grow(&mut self, growth: Growth) {
        self.come_to(growth.progress);
        self.behind.push(growth.tail);
    }

    /// Notes how far it has come; not so far as before where its packets come again.
    pub(super) fn come_to(&mut self, Progress { frames, ended }: Progress) {
        self.last_frame = ended.map_or_else(|| f64::from(frames) - self.scene.time_step(), f64::from);
    }

    /// The header of its keyframe.
    pub(super) fn header(&self) -> SequenceHeader {
        self.header
    }

    /// What is drawn for these parameters; the scene is brought up to it.
    pub(super) fn prepare(&mut self, config: &DecoderConfig, params: &RenderParams) -> DrawingAt {
        for tail in self.behind.drain(..) {
            self.scene.append(&tail.tail(MeshCounts::default()));
        }
        let levels = match (self.header.subdivision_levels, config.subdivision_levels) {
            // Its packets do not bring the stars that masks need.
            (0, _) => 0,
            (of_stream, wanted) => wanted.unwrap_or(of_stream).min(MAX_LEVELS),
        };
        let frame = (params.frame - self.first_frame as f64).min(self.last_frame);
        let RenderParams { viewport, mesh, .. } = *params;
        DrawingAt { frame, params: DrawParams { levels, antialias: config.antialias, viewport, mesh } }
    }

    /// Draws a picture that was prepared.
    ///
    /// # Errors
    /// A viewport that cannot be drawn.
    pub(super) fn draw(&mut self, at: &DrawingAt, surface: &mut Surface<'_>) -> Result<(), DecodeError> {
        Ok(self.scene.draw(at.frame, &at.params, surface)?)
    }
}
