//! Sparse linear maps on vectors of triples, and the conjugate gradient method.
//!
//! In: rows of (column, weight). Out: products and solutions. Forbidden here: what the numbers mean.

use glam::Vec3;

use super::parallel::{dot, fill, update};

/// A sparse matrix in compressed rows; it maps a vector of triples (colours, positions) component by component.
#[derive(Debug, Clone, Default)]
pub(super) struct Sparse {
    columns: usize,
    start: Vec<u32>,
    column: Vec<u32>,
    weight: Vec<f32>,
}

impl Sparse {
    /// Takes compressed rows: row r holds the entries `start[r]..start[r + 1]`.
    pub(super) fn new(columns: usize, start: Vec<u32>, column: Vec<u32>, weight: Vec<f32>) -> Self {
        Self { columns, start, column, weight }
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// The entries of one row: (column, weight).
    pub(super) fn row(&self, row: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let range = self.start[row] as usize..self.start[row + 1] as usize;
        self.column[range.clone()].iter().zip(&self.weight[range]).map(|(&c, &w)| (c as usize, w))
    }

    /// The transposed matrix, entries of a row ascending by column: a product with it gathers in a fixed order.
    pub(super) fn transposed(&self) -> Self {
        let mut start = vec![0u32; self.columns + 1];
        for &c in &self.column {
            start[c as usize + 1] += 1;
        }
        for c in 1..start.len() {
            start[c] += start[c - 1];
        }
        let mut next = start.clone();
        let mut column = vec![0u32; self.column.len()];
        let mut weight = vec![0f32; self.weight.len()];
        for row in 0..self.rows() {
            for (c, w) in self.row(row) {
                let slot = next[c] as usize;
                next[c] += 1;
                column[slot] = row as u32;
                weight[slot] = w;
            }
        }
        Self { columns: self.rows(), start, column, weight }
    }

    /// Matrix times vector.
    pub(super) fn times(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut out = vec![Vec3::ZERO; self.rows()];
        fill(&mut out, |row| self.row(row).fold(Vec3::ZERO, |sum, (c, w)| sum + x[c] * w));
        out
    }
}

/// A symmetric positive definite system that is known by its products only.
pub(super) trait System: Sync {
    /// Matrix times `x`.
    fn times(&self, x: &[Vec3]) -> Vec<Vec3>;
    /// An approximate inverse of the matrix times `r` (a symmetric positive definite preconditioner).
    fn precondition(&self, r: &[Vec3]) -> Vec<Vec3>;
}

/// Solves `system * x = rhs` from x = 0 by preconditioned conjugate gradients (Hestenes and Stiefel 1952), until the
/// residual, in the preconditioner's norm, has fallen to `tolerance` times its start, or for `iterations` steps.
///
/// The components of `rhs` that are zero in both it and every product stay zero in x. A direction that is not of
/// positive curvature (rounding; a singular system) ends the iteration with what was found so far.
pub(super) fn conjugate_gradient(system: &impl System, rhs: Vec<Vec3>, iterations: u32, tolerance: f64) -> Vec<Vec3> {
    let mut x = vec![Vec3::ZERO; rhs.len()];
    let mut residual = rhs;
    let mut z = system.precondition(&residual);
    let mut rho = dot(&residual, &z);
    let target = rho * tolerance * tolerance;
    let mut direction = z.clone();
    for _ in 0..iterations {
        if !(rho.is_finite() && rho > target && rho > 0.0) {
            break;
        }
        let product = system.times(&direction);
        let curvature = dot(&direction, &product);
        if !(curvature.is_finite() && curvature > 0.0) {
            break;
        }
        let step = (rho / curvature) as f32;
        update(&mut x, |i, x| *x += direction[i] * step);
        update(&mut residual, |i, r| *r -= product[i] * step);
        z = system.precondition(&residual);
        let next = dot(&residual, &z);
        let keep = (next / rho) as f32;
        update(&mut direction, |i, d| *d = z[i] + *d * keep);
        rho = next;
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Dense([[f32; 3]; 3]);

    impl System for Dense {
        fn times(&self, x: &[Vec3]) -> Vec<Vec3> {
            self.0.iter().map(|row| row.iter().zip(x).map(|(w, x)| *x * *w).sum()).collect()
        }
        fn precondition(&self, r: &[Vec3]) -> Vec<Vec3> {
            r.iter().enumerate().map(|(i, r)| *r / self.0[i][i]).collect()
        }
    }

    #[test]
    fn conjugate_gradient_solves_in_as_many_steps_as_unknowns() {
        let system = Dense([[4.0, 1.0, 0.0], [1.0, 3.0, -1.0], [0.0, -1.0, 5.0]]);
        let x = [Vec3::new(1.0, -2.0, 0.5), Vec3::new(0.0, 3.0, 7.0), Vec3::new(-4.0, 1.0, 2.0)];
        // Three channels share one step length, so up to nine steps may be needed.
        let found = conjugate_gradient(&system, system.times(&x), 9, 0.0);
        for (x, found) in x.iter().zip(&found) {
            assert!((*x - *found).length() < 1e-4, "{x} {found}");
        }
    }

    #[test]
    fn transposed_swaps_the_inner_product() {
        let m = Sparse::new(4, vec![0, 2, 2, 5], vec![3, 0, 1, 0, 2], vec![0.5, -1.0, 2.0, 0.25, 1.0]);
        let x: Vec<Vec3> = (0..4).map(|i| Vec3::splat(i as f32 + 1.0)).collect();
        let y: Vec<Vec3> = (0..3).map(|i| Vec3::new(1.0, i as f32, -2.0)).collect();
        assert!((dot(&m.times(&x), &y) - dot(&x, &m.transposed().times(&y))).abs() < 1e-6);
        assert_eq!(m.transposed().rows(), 4);
    }

    #[test]
    fn singular_and_zero_systems_end() {
        let zero = Dense([[0.0; 3]; 3]);
        struct Null;
        impl System for Null {
            fn times(&self, x: &[Vec3]) -> Vec<Vec3> {
                vec![Vec3::ZERO; x.len()]
            }
            fn precondition(&self, r: &[Vec3]) -> Vec<Vec3> {
                r.to_vec()
            }
        }
        assert_eq!(conjugate_gradient(&Null, vec![Vec3::ONE; 2], 10, 0.0), vec![Vec3::ZERO; 2]);
        assert!(conjugate_gradient(&zero, vec![Vec3::ZERO; 3], 10, 0.0).iter().all(|x| x.is_finite()));
    }
}
