//! Steps of colours: as coarse as the slab's own error allows.
//!
//! In: a fitted mesh and the error that it leaves. Out: steps, and what they add to the error. Forbidden here: pictures.
//!
//! The error meant is what most of the picture has, not what edges of a drawing have: in its flat parts nothing hides the
//! steps.

use glam::IVec3;

use crate::bitstream::{ColorSteps, EXTENT_PARTS, size_of};
use crate::mesh::{TetMesh, volume6};

/// Root mean square step, over what is coloured, per root mean square error within tets, which is about seven eighths of
/// that over all pixels on natural clips. Errors of rounding are independent, and a picture interpolates between the
/// wedges of a tet, so a step s adds s^2 / 30 to the squared error: 0.19 dB at this ratio (docs/benchmarks.md).
const STEP_OVER_RMS: f64 = 1.15;

/// Root mean square steps in levels.
const STEPS: std::ops::RangeInclusive<f64> = 0.5..=8.0;

/// The part of a squared step that rounding adds to the squared error: 1/12 at a wedge, 2/5 of it inside of a tet.
const NOISE: f64 = 1.0 / 30.0;

/// The root mean square step, in levels, for a slab whose tets have this root mean square error, in levels.
fn mean_step(rms: f64) -> f64 {
    // `max` gives the least step without an error to go by, too.
    (STEP_OVER_RMS * rms).max(*STEPS.start()).min(*STEPS.end())
}

/// Steps for a slab's colours, with the first part of its mesh, whose tets have this root mean square error in levels.
pub(super) fn color_steps(mesh: &TetMesh, rms: f64) -> ColorSteps {
    let stars = Stars::of(mesh);
    let size = stars.mean_size();
    let by_size = ColorSteps { step: 1, size };
    let (mut squares, mut volume) = (0.0, 0.0);
    for (star, &around) in stars.sizes.iter().zip(&stars.volumes) {
        squares += around * f64::from(2 * by_size.octaves(*star)).exp2();
        volume += around;
    }
    let relative = if volume > 0.0 { (squares / volume).sqrt() } else { 1.0 };
    let step = (16.0 * mean_step(rms) / relative).round().clamp(1.0, 128.0);
    ColorSteps { step: step as u8, size }
}

/// The error in levels after rounding to the steps chosen for it.
pub(super) fn rounded_rms(rms: f64, rms_within_tets: f64) -> f64 {
    (rms * rms + NOISE * mean_step(rms_within_tets).powi(2)).sqrt()
}

/// What is around each wedge.
struct Stars {
    /// Logarithms of extents, as [`ColorSteps`] has them, but from whole stars.
    sizes: Vec<i32>,
    volumes: Vec<f64>,
}

impl Stars {
    fn of(mesh: &TetMesh) -> Self {
        let mut volumes = vec![0.0; mesh.wedges.len()];
        // Sums over the edges at vertices, as often as tets have them, and how many.
        let mut edges = vec![(IVec3::ZERO, 0); mesh.positions.len()];
        for tet in 0..mesh.tets.len() {
            let corners = mesh.tet_positions(tet);
            let [a, b, c, d] = corners;
            let volume = volume6(a, b, c, d) as f64;
            for (wedge, from) in mesh.tets[tet].into_iter().zip(corners) {
                volumes[wedge.index()] += volume;
                let (sum, count) = &mut edges[mesh.vertex(wedge).index()];
                *sum += corners.into_iter().map(|to| (to - from).abs()).sum::<IVec3>();
                *count += 3;
            }
        }
        let size = |&(sum, count): &(IVec3, i32)| {
            size_of((sum.as_dvec3() * f64::from(EXTENT_PARTS) / f64::from(count.max(1))).as_ivec3())
        };
        let at_vertices: Vec<i32> = edges.iter().map(size).collect();
        let sizes = mesh.wedges.iter().map(|wedge| at_vertices[wedge.vertex.index()]).collect();
        Self { sizes, volumes }
    }

    /// The mean of the logarithms.
    fn mean_size(&self) -> u8 {
        let sum: i64 = self.sizes.iter().map(|&size| i64::from(size)).sum();
        (sum as f64 / self.sizes.len().max(1) as f64).round() as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Domain, Wedge};
    use crate::video::Label;

    /// Two lone tets, one `ratio` times as long each way as the other.
    fn two_tets(ratio: i32) -> TetMesh {
        let mut mesh = TetMesh::empty(Domain { width: 100, height: 100, duration: 100, subpixel_bits: 0 });
        for side in [4, 4 * ratio] {
            let corners = [[0, 0, 0], [side, 0, 0], [0, side, 0], [0, 0, side]].map(|corner| {
                let vertex = mesh.push_vertex(IVec3::from_array(corner));
                mesh.push_wedge(Wedge { vertex, label: Label(0), color: glam::Vec3::ZERO })
            });
            mesh.tets.push(corners);
        }
        mesh
    }

    #[test]
    fn steps_follow_the_error_within_their_range() {
        assert_eq!([0.0, 0.1, 4.0, 100.0, f64::NAN].map(mean_step), [0.5, 0.5, 4.6, 8.0, 0.5]);
        let loss = |rms: f64| 20.0 * (rounded_rms(rms, rms) / rms).log10();
        assert!(loss(4.0) < 0.19);
    }

    #[test]
    fn the_mean_over_the_volume_is_the_step_asked_for() {
        for ratio in [1, 2, 4] {
            let mesh = two_tets(ratio);
            let steps = color_steps(&mesh, 2.0);
            let stars = Stars::of(&mesh);
            let (mut squares, mut volume) = (0.0, 0.0);
            for (&size, around) in stars.sizes.iter().zip(&stars.volumes) {
                squares += around * (f64::from(steps.step) / 16.0 * f64::from(steps.octaves(size)).exp2()).powi(2);
                volume += around;
            }
            let mean = (squares / volume).sqrt();
            assert!((mean / mean_step(2.0) - 1.0).abs() < 0.05, "{ratio}: {steps:?}, {mean}");
        }
        let empty = TetMesh::empty(Domain { width: 8, height: 8, duration: 1, subpixel_bits: 0 });
        assert_eq!(color_steps(&empty, 1.0).step, 18);
    }
}
