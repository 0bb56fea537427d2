//! A synthetic clip for benches of single stages: drifting texture behind a moving disc.

use std::sync::Arc;

use tetvec::Frame;
use tetvec::mesh::{Domain, TetMesh};
use tetvec::vectorize::cleave::cleave_tets;
use tetvec::vectorize::lattice::AdaptiveLattice;
use tetvec::vectorize::simplify::{ColorQuadric, Goal, SimplifyParams, Unfrozen, WorkMesh, simplify};
use tetvec::video::{Label, LabelPlane};

/// All of a mesh may change.
pub(crate) const ALL: Unfrozen = Unfrozen { low: i32::MIN, high: i32::MAX };

/// Frames of one slab, and what they are labelled: all alike.
pub(crate) struct Clip {
    pub(crate) domain: Domain,
    pub(crate) frames: Vec<Arc<Frame>>,
    pub(crate) labels: Vec<LabelPlane>,
}

impl Clip {
    pub(crate) fn new(width: u32, height: u32, frames: u32) -> Self {
        let frame = |t: u32| {
            let color = |x: u32, y: u32| {
                let wave = |along: u32, across: u32, scale: f64| {
                    100.0 + 40.0 * (f64::from(along + t) / scale).sin() + 30.0 * (f64::from(across) / 5.0).cos()
                };
                let is_inside = (f64::from(x) - 60.0 - 2.0 * f64::from(t)).hypot(f64::from(y) - 70.0) < 40.0;
                let lift = if is_inside { 70.0 } else { 0.0 };
                [wave(x, y, 7.0) + lift, wave(y, x, 11.0), wave(x + y, x, 23.0) - lift].map(|channel| channel as u8)
            };
            Arc::new(Frame::from_fn(width, height, color).expect("a frame"))
        };
        Self {
            domain: Domain { width, height, duration: frames - 1, subpixel_bits: 3 },
            frames: (0..frames).map(frame).collect(),
            labels: vec![LabelPlane::uniform(width, height, Label(0)); frames as usize],
        }
    }

    /// Its adaptive lattice, in one layer.
    pub(crate) fn lattice(&self, vertices_per_pixel: f64) -> TetMesh {
        let mut lattice = AdaptiveLattice::new(self.domain, vertices_per_pixel);
        lattice.push(0, &self.frames, &self.labels).expect("planes that fit");
        cleave_tets(&lattice.finish().expect("a layer")).expect("few tets")
    }

    /// Its mesh of so many vertices a pixel, as it would be fitted and written.
    pub(crate) fn simplified(&self, vertices_per_pixel: f64) -> TetMesh {
        let params = SimplifyParams::default();
        let mut work = WorkMesh::<ColorQuadric>::new(self.domain);
        work.append(&self.lattice(12.0 * vertices_per_pixel), &params);
        simplify(&mut work, ALL, self.goal(vertices_per_pixel), &params);
        let mut mesh = TetMesh::empty(self.domain);
        work.commit(i32::MAX, &mut mesh);
        mesh
    }

    /// To simplify to so many vertices a pixel.
    pub(crate) fn goal(&self, vertices_per_pixel: f64) -> Goal {
        let Domain { width, height, duration, .. } = self.domain;
        Goal {
            vertices: (f64::from(width * height * (duration + 1)) * vertices_per_pixel) as usize,
            before: i32::MAX,
            vertices_in_window: usize::MAX,
            max_cost: f32::MAX,
            max_error: f32::INFINITY,
        }
    }
}
