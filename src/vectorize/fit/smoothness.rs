//! The gradient of colour inside of a tet, and what it costs.
//!
//! In: a tet's corners. Out: the gradient for their colours; the integral of its square as a form of them. Forbidden here:
//! frames. Dirichlet's energy, in a measure far below that of pixels: it decides where no pixel does. Tets between the
//! centres of pixels would keep whatever colours their vertices had where they came from, and show it as splinters
//! when the picture is enlarged.

use glam::{DVec3, IVec3, Mat3, Vec3};

use super::polygon::FLAT;

/// A symmetric form over four corners, in the order of [`PAIRS`].
pub(super) type Gram = [f32; 10];

/// Corners that a form's entries belong to.
const PAIRS: [[usize; 2]; 10] = [[0, 0], [1, 1], [2, 2], [3, 3], [0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]];

/// The gradients of the weights of corners 1, 2, 3 times six times the volume, and that, for a tet with corners `p` (fine
/// units), in pixels and frames.
fn slopes(p: [IVec3; 4], fine_unit: i32) -> ([DVec3; 3], f64) {
    let [u, v, w] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]].map(|e| e.as_dvec3() / f64::from(fine_unit));
    let volume6 = u.cross(v).dot(w);
    ([v.cross(w), w.cross(u), u.cross(v)], volume6)
}

/// The gradient of colour inside a tet with corners `p` (fine units) and corner colours `c`: maps a displacement in
/// (x, y, t), in pixels and frames, to a change of colour. Zero for a flat tet.
pub(super) fn color_gradient(p: [IVec3; 4], c: [Vec3; 4], fine_unit: i32) -> Mat3 {
    let (slopes, volume6) = slopes(p, fine_unit);
    if volume6.abs() < FLAT {
        return Mat3::ZERO;
    }
    let gradients = slopes.map(|g| (g / volume6).as_vec3());
    let steps = [c[1] - c[0], c[2] - c[0], c[3] - c[0]];
    let column = |axis: usize| (0..3).map(|i| steps[i] * gradients[i][axis]).sum();
    Mat3::from_cols(column(0), column(1), column(2))
}

/// `weight` times the integral of the squared gradient over a tet with corners `p` (fine units), lengths in pixels and
/// frames alike. Nothing for a flat or an inverted one.
pub(super) fn gradient_form(p: [IVec3; 4], fine_unit: i32, weight: f32) -> Option<Gram> {
    if weight <= 0.0 {
        return None;
    }
    let (slopes, volume6) = slopes(p, fine_unit);
    if volume6 < FLAT {
        return None;
    }
    let [b, c, d] = slopes.map(|g| g / volume6);
    let gradients = [-(b + c + d), b, c, d];
    let scale = f64::from(weight) * volume6 / 6.0;
    Some(PAIRS.map(|[i, j]| (scale * gradients[i].dot(gradients[j])) as f32))
}

/// The value of a form for these colours, summed over channels.
pub(super) fn value(form: &Gram, colors: [Vec3; 4]) -> f64 {
    let twice = |[i, j]: [usize; 2]| if i == j { 1.0 } else { 2.0 };
    // Relative to one corner, which changes nothing but the digits lost.
    let u = colors.map(|color| color - colors[0]);
    form.iter().zip(PAIRS).map(|(entry, pair)| f64::from(entry * twice(pair) * u[pair[0]].dot(u[pair[1]]))).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_linear_field_costs_its_squared_gradient_times_the_volume() {
        let p = [[3, 1, 2], [30, 4, 0], [7, 41, 3], [1, 5, 60]].map(IVec3::from_array);
        let gradient = Vec3::new(3.0, -2.0, 0.5);
        let colors = p.map(|p| Vec3::new(gradient.dot(p.as_vec3() / 8.0), 7.0, 0.0));
        let volume = crate::mesh::volume6(p[0], p[1], p[2], p[3]) as f64 / 6.0 / 512.0;
        let form = gradient_form(p, 8, 0.25).expect("a tet");
        let expected = 0.25 * f64::from(gradient.length_squared()) * volume;
        assert!((value(&form, colors) / expected - 1.0).abs() < 1e-4);
        assert!(value(&form, [Vec3::splat(200.0); 4]).abs() < 1e-6);
    }

    #[test]
    fn flat_and_inverted_tets_cost_nothing() {
        let [a, b, c, d] = [[0, 0, 0], [8, 0, 0], [0, 8, 0], [0, 0, 8]].map(IVec3::from_array);
        assert!(gradient_form([a, b, c, d], 8, 1.0).is_some());
        assert_eq!(gradient_form([a, c, b, d], 8, 1.0), None);
        assert_eq!(gradient_form([a, b, c, b + c], 8, 1.0), None);
    }
}
