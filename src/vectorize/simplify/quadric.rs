//! Error quadrics: what a collapse costs and where the merged vertex should go (§IV-A).
//!
//! All quadrics are stored about their own vertex (x = 0 there, in pixels and frames), which keeps single precision
//! accurate; merging moves the origin with [`WedgeQuadric::recentered`].

use glam::{DMat3, Mat3, Vec3};

/// A quadric in position alone: x' A x + 2 b . x + c.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PositionQuadric {
    /// Upper triangle of A: xx, xy, xt, yy, yt, tt.
    pub a: [f32; 6],
    /// Half the linear term.
    pub b: Vec3,
    /// Constant term.
    pub c: f32,
}

/// The linear colour field of one tet, seen from one of its corners.
#[derive(Debug, Clone, Copy)]
pub struct TetField {
    /// Change of (r, g, b) per pixel in x, per pixel in y, per frame in t.
    pub gradient: [Vec3; 3],
    /// Colour at the corner, in 8-bit levels.
    pub color: Vec3,
    /// Share of the tet's volume that counts for this corner: a quarter, in cubic pixels.
    pub weight: f32,
}

/// A quadric over position and colour of one wedge. Its unknown colour is eliminated when positions are sought.
pub trait WedgeQuadric: Copy + Default + Send + Sync {
    /// The error that one tet contributes to one of its corners.
    fn of_tet(field: &TetField) -> Self;
    /// `weight` times the squared distance to the origin, whatever the colour: a lattice vertex's part in the uniformity
    /// term (Eq. 5, 6).
    fn of_point(weight: f32) -> Self;
    /// Adds `other`, about the same origin.
    fn add(&mut self, other: &Self);
    /// The same quadric about an origin moved by `shift`.
    fn recentered(&self, shift: Vec3) -> Self;
    /// The quadric in position that remains when the colour is always the best one (Schur complement).
    fn reduced(&self) -> PositionQuadric;
    /// The best colour at `x`.
    fn color_at(&self, x: Vec3) -> Vec3;
}

/// Squared colour error at a fixed (x, y, t), integrated over the tets inherited: Hoppe, "New quadric metric for
/// simplifying meshes with appearance attributes", 1999, with the domain in place of the surface.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ColorQuadric {
    weight: f32,
    color: Vec3,
    // Per axis: sum of weight * d(rgb)/d(axis).
    gradient: [Vec3; 3],
    hessian: [f32; 6],
    linear: Vec3,
    constant: f32,
}

/// Squared distance in (x, y, t, r, g, b) to the flats that the tets span: the paper's metric, Eq. 1-4 (after Garland
/// and Zhou, "Quadric-based simplification in any dimension", 2005).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DistanceQuadric {
    position: [f32; 6],
    // Per axis: row of the mixed block, against (r, g, b).
    mixed: [Vec3; 3],
    color: [f32; 6],
    linear_position: Vec3,
    linear_color: Vec3,
    constant: f32,
}

#[inline]
fn times(a: &[f32; 6], x: Vec3) -> Vec3 {
    Vec3::new(
        a[0] * x.x + a[1] * x.y + a[2] * x.z,
        a[1] * x.x + a[3] * x.y + a[4] * x.z,
        a[2] * x.x + a[4] * x.y + a[5] * x.z,
    )
}

#[inline]
fn add6(a: &mut [f32; 6], b: &[f32; 6]) {
    for (x, y) in a.iter_mut().zip(b) {
        *x += y;
    }
}

/// Upper triangle of the Gram matrix of three vectors.
#[inline]
fn gram(v: &[Vec3; 3]) -> [f32; 6] {
    [v[0].dot(v[0]), v[0].dot(v[1]), v[0].dot(v[2]), v[1].dot(v[1]), v[1].dot(v[2]), v[2].dot(v[2])]
}

impl PositionQuadric {
    /// Squared distance to the plane through the origin's offset: weight * (normal . x - offset)^2, `normal` of
    /// length 1.
    pub fn plane(normal: Vec3, offset: f32, weight: f32) -> Self {
        let n = normal * weight;
        Self {
            a: [n.x * normal.x, n.x * normal.y, n.x * normal.z, n.y * normal.y, n.y * normal.z, n.z * normal.z],
            b: -offset * n,
            c: weight * offset * offset,
        }
    }

    /// Sum of squared distances to `count` points with coordinate sum `sum` and sum of squares `squares`.
    pub fn points(count: f32, sum: Vec3, squares: f32) -> Self {
        Self { a: [count, 0.0, 0.0, count, 0.0, count], b: -sum, c: squares }
    }

    /// Adds `other` times `factor`.
    #[inline]
    pub fn add_scaled(&mut self, other: &Self, factor: f32) {
        for (x, y) in self.a.iter_mut().zip(&other.a) {
            *x += factor * y;
        }
        self.b += factor * other.b;
        self.c += factor * other.c;
    }

    /// The same quadric about an origin moved by `shift`.
    #[inline]
    pub fn recentered(&self, shift: Vec3) -> Self {
        let moved = times(&self.a, shift);
        Self { a: self.a, b: self.b + moved, c: self.c + 2.0 * self.b.dot(shift) + shift.dot(moved) }
    }

    /// Its value at `x`.
    #[inline]
    pub fn at(&self, x: Vec3) -> f32 {
        x.dot(times(&self.a, x)) + 2.0 * self.b.dot(x) + self.c
    }

    /// The minimiser among the points that agree with `fixed` in every axis that is `Some`; `None` where the quadric
    /// does not determine one.
    #[inline]
    pub fn minimizer(&self, fixed: [Option<f32>; 3]) -> Option<Vec3> {
        let a = &self.a;
        let mut m = [[a[0], a[1], a[2]], [a[1], a[3], a[4]], [a[2], a[4], a[5]]];
        let mut r = [-self.b.x, -self.b.y, -self.b.z];
        for axis in 0..3 {
            if let Some(value) = fixed[axis] {
                for other in 0..3 {
                    if other != axis {
                        r[other] -= m[other][axis] * value;
                        m[other][axis] = 0.0;
                        m[axis][other] = 0.0;
                    }
                }
                m[axis][axis] = 1.0;
                r[axis] = value;
            }
        }
        // Cramer's rule; the matrix is symmetric, and so are its cofactors.
        let [[xx, xy, xt], [_, yy, yt], [_, _, tt]] = m;
        let (cxx, cxy, cxt) = (yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - xt * yy);
        let (cyy, cyt, ctt) = (xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy);
        let determinant = xx * cxx + xy * cxy + xt * cxt;
        let scale = m[0][0].abs() * m[1][1].abs() * m[2][2].abs();
        // Below this share of the diagonal's product the solution is noise in single precision.
        if determinant.is_nan() || determinant <= 1e-5 * scale {
            return None;
        }
        let x = times(&[cxx, cxy, cxt, cyy, cyt, ctt], Vec3::from_array(r)) / determinant;
        x.is_finite().then_some(x)
    }
}

impl WedgeQuadric for ColorQuadric {
    fn of_tet(field: &TetField) -> Self {
        let w = field.weight;
        let g = &field.gradient;
        Self {
            weight: w,
            color: w * field.color,
            gradient: g.map(|axis| w * axis),
            hessian: gram(g).map(|x| w * x),
            linear: w * Vec3::new(g[0].dot(field.color), g[1].dot(field.color), g[2].dot(field.color)),
            constant: w * field.color.length_squared(),
        }
    }

    fn of_point(weight: f32) -> Self {
        Self { hessian: [weight, 0.0, 0.0, weight, 0.0, weight], ..Self::default() }
    }

    #[inline]
    fn add(&mut self, other: &Self) {
        self.weight += other.weight;
        self.color += other.color;
        for (x, y) in self.gradient.iter_mut().zip(&other.gradient) {
            *x += *y;
        }
        add6(&mut self.hessian, &other.hessian);
        self.linear += other.linear;
        self.constant += other.constant;
    }

    #[inline]
    fn recentered(&self, shift: Vec3) -> Self {
        let moved = times(&self.hessian, shift);
        Self {
            color: self.color + self.gradient[0] * shift.x + self.gradient[1] * shift.y + self.gradient[2] * shift.z,
            linear: self.linear + moved,
            constant: self.constant + 2.0 * self.linear.dot(shift) + shift.dot(moved),
            ..*self
        }
    }

    #[inline]
    fn reduced(&self) -> PositionQuadric {
        if self.weight <= 0.0 {
            return PositionQuadric { a: self.hessian, b: self.linear, c: self.constant };
        }
        let inverse = 1.0 / self.weight;
        let mut a = gram(&self.gradient);
        for (x, h) in a.iter_mut().zip(&self.hessian) {
            *x = h - inverse * *x;
        }
        let g = &self.gradient;
        let mixed = Vec3::new(g[0].dot(self.color), g[1].dot(self.color), g[2].dot(self.color));
        PositionQuadric {
            a,
            b: self.linear - inverse * mixed,
            c: self.constant - inverse * self.color.length_squared(),
        }
    }

    fn color_at(&self, x: Vec3) -> Vec3 {
        let sum = self.color + self.gradient[0] * x.x + self.gradient[1] * x.y + self.gradient[2] * x.z;
        if self.weight > 0.0 { sum / self.weight } else { Vec3::ZERO }
    }
}

/// What nothing is inverted with: its cube, a determinant, is not 0 yet.
const LEAST_RIDGE: f32 = 1e-12;

impl DistanceQuadric {
    fn color_block(&self) -> Mat3 {
        let c = &self.color;
        // A steep flat leaves its colour block nearly singular; this much of the trace keeps it invertible.
        let ridge = 1e-6 * (c[0] + c[3] + c[5]) + LEAST_RIDGE;
        Mat3::from_cols(
            Vec3::new(c[0] + ridge, c[1], c[2]),
            Vec3::new(c[1], c[3] + ridge, c[4]),
            Vec3::new(c[2], c[4], c[5] + ridge),
        )
    }
}

impl WedgeQuadric for DistanceQuadric {
    fn of_tet(field: &TetField) -> Self {
        let w = field.weight;
        // The flat is the graph of the field. With J the 3x3 Jacobian and M = I + J'J, the projection on its normal
        // space is [J'J M^-1, -M^-1 J'; -J M^-1, I - J M^-1 J'] (blocks position, colour); the flat passes through
        // (0, colour), so with N its colour block and m its mixed block the error is that of (x, c - colour).
        // Where the flat is steep, single precision would leave nothing of M.
        let jacobian = DMat3::from_cols_array_2d(&field.gradient.map(|g| g.as_dvec3().to_array()));
        let square = jacobian.transpose() * jacobian;
        let inverse = (DMat3::IDENTITY + square).inverse();
        let position = (square * inverse).as_mat3();
        let mixed = (-(inverse * jacobian.transpose())).as_mat3();
        let color = (DMat3::IDENTITY - jacobian * inverse * jacobian.transpose()).as_mat3();
        let upper =
            |m: Mat3| [m.x_axis.x, m.y_axis.x, m.z_axis.x, m.y_axis.y, m.z_axis.y, m.z_axis.z].map(|value| w * value);
        let offset = color * field.color;
        Self {
            position: upper(position),
            mixed: [mixed.row(0) * w, mixed.row(1) * w, mixed.row(2) * w],
            color: upper(color),
            linear_position: -w * (mixed * field.color),
            linear_color: -w * offset,
            constant: w * field.color.dot(offset),
        }
    }

    fn of_point(weight: f32) -> Self {
        Self { position: [weight, 0.0, 0.0, weight, 0.0, weight], ..Self::default() }
    }

    #[inline]
    fn add(&mut self, other: &Self) {
        add6(&mut self.position, &other.position);
        for (x, y) in self.mixed.iter_mut().zip(&other.mixed) {
            *x += *y;
        }
        add6(&mut self.color, &other.color);
        self.linear_position += other.linear_position;
        self.linear_color += other.linear_color;
        self.constant += other.constant;
    }

    #[inline]
    fn recentered(&self, shift: Vec3) -> Self {
        let moved = times(&self.position, shift);
        let mixed = self.mixed[0] * shift.x + self.mixed[1] * shift.y + self.mixed[2] * shift.z;
        Self {
            linear_position: self.linear_position + moved,
            linear_color: self.linear_color + mixed,
            constant: self.constant + 2.0 * self.linear_position.dot(shift) + shift.dot(moved),
            ..*self
        }
    }

    #[inline]
    fn reduced(&self) -> PositionQuadric {
        let inverse = self.color_block().inverse();
        let solved = self.mixed.map(|row| inverse * row);
        let mut a = self.position;
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        for (x, (i, j)) in a.iter_mut().zip(pairs) {
            *x -= self.mixed[i].dot(solved[j]);
        }
        let toward = inverse * self.linear_color;
        let mixed = Vec3::new(self.mixed[0].dot(toward), self.mixed[1].dot(toward), self.mixed[2].dot(toward));
        PositionQuadric { a, b: self.linear_position - mixed, c: self.constant - self.linear_color.dot(toward) }
    }

    fn color_at(&self, x: Vec3) -> Vec3 {
        let pull = self.linear_color + self.mixed[0] * x.x + self.mixed[1] * x.y + self.mixed[2] * x.z;
        -(self.color_block().inverse() * pull)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(weight: f32) -> TetField {
        TetField {
            gradient: [Vec3::new(1.0, 2.0, -1.0), Vec3::new(0.5, 0.0, 3.0), Vec3::new(-2.0, 1.0, 0.0)],
            color: Vec3::new(100.0, 50.0, 25.0),
            weight,
        }
    }

    fn colors_agree<Q: WedgeQuadric>() {
        let f = field(2.0);
        let q = Q::of_tet(&f);
        let x = Vec3::new(1.5, -2.0, 0.5);
        let expected = f.color + f.gradient[0] * x.x + f.gradient[1] * x.y + f.gradient[2] * x.z;
        assert!((q.color_at(x) - expected).length() < 1e-2, "on the flat the best colour is the flat's");
        assert!(q.reduced().at(x).abs() < 0.05, "and costs nothing");
        let moved = q.recentered(x);
        assert!((moved.color_at(Vec3::ZERO) - expected).length() < 1e-2, "wherever the origin is");
    }

    #[test]
    fn one_tet_is_free_along_its_flat() {
        colors_agree::<ColorQuadric>();
        colors_agree::<DistanceQuadric>();
    }

    #[test]
    fn color_quadric_is_the_sum_of_squared_errors() {
        let (f, mut g) = (field(1.0), field(3.0));
        g.color = Vec3::new(90.0, 60.0, 25.0);
        g.gradient[0] = Vec3::ZERO;
        let mut q = ColorQuadric::of_tet(&f);
        q.add(&ColorQuadric::of_tet(&g));
        let x = Vec3::new(0.5, 1.0, -0.25);
        let at = |t: &TetField| t.color + t.gradient[0] * x.x + t.gradient[1] * x.y + t.gradient[2] * x.z;
        let best = (at(&f) + 3.0 * at(&g)) / 4.0;
        let expected = (at(&f) - best).length_squared() + 3.0 * (at(&g) - best).length_squared();
        assert!((q.color_at(x) - best).length() < 1e-3);
        assert!((q.reduced().at(x) - expected).abs() < 0.02 * expected);
    }

    #[test]
    fn distance_quadric_is_the_distance_to_the_flat() {
        // A field that rises by 1 a pixel in x and red only: the flat leans at 45 degrees.
        let f = TetField { gradient: [Vec3::X, Vec3::ZERO, Vec3::ZERO], color: Vec3::ZERO, weight: 1.0 };
        let q = DistanceQuadric::of_tet(&f);
        let at = |x: Vec3, c: Vec3| {
            let px = times(&q.position, x);
            let mixed = q.mixed[0] * x.x + q.mixed[1] * x.y + q.mixed[2] * x.z;
            x.dot(px) + 2.0 * mixed.dot(c) + c.dot(times(&q.color, c))
        };
        assert!((at(Vec3::X, Vec3::ZERO) - 0.5).abs() < 1e-6);
        assert!((at(Vec3::ZERO, Vec3::Y) - 1.0).abs() < 1e-6);
        assert!(at(Vec3::X, Vec3::X).abs() < 1e-6);
    }

    #[test]
    fn minimizer_respects_fixed_axes() {
        let q = PositionQuadric::points(2.0, Vec3::new(2.0, 4.0, 6.0), 30.0);
        assert_eq!(q.minimizer([None; 3]), Some(Vec3::new(1.0, 2.0, 3.0)));
        assert_eq!(q.minimizer([Some(5.0), None, None]), Some(Vec3::new(5.0, 2.0, 3.0)));
        assert_eq!(PositionQuadric::plane(Vec3::X, 1.0, 1.0).minimizer([None; 3]), None);
        let plane = PositionQuadric::plane(Vec3::X, 3.0, 2.0).recentered(Vec3::X);
        assert_eq!(plane.at(Vec3::ZERO), 8.0);
    }
}
