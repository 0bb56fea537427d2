//! The normal equations of a fit: how the squared error answers to wedge colours and vertex positions together.
//!
//! In: a model, its points and colours, and what the frames say about its tets. Out: the Gauss-Newton system, known
//! by products only, and its right-hand side. Inside a tet with colour gradient C a displacement d of corner i
//! changes a pixel's colour by -phi_i C d, and a change f of the corner's colour changes it by phi_i f; with
//! u_i = f_i - C d_i both go through the same moments. Pixels that a boundary passes have terms of their own (`edges`).

use std::ops::AddAssign;

use glam::{IVec3, Mat3, Vec3};

use super::edges::Slopes;
use super::evidence::Evidence;
use super::model::Model;
use super::parallel;
use super::sparse::System;

/// Parts in which sums over tets are collected. Part of the result, so never derived from the machine.
const PARTS: usize = 8;

/// What keeps positions from running where the frames say little.
#[derive(Debug, Clone)]
pub(super) struct PositionDamping {
    /// Per vertex: Marquardt's factor on the mean of the vertex's own diagonal.
    pub(super) relative: Vec<f32>,
    /// Squared levels times pixels that a displacement of one pixel costs, whatever the frames say.
    pub(super) absolute: f32,
}

/// A fit linearised at a state of the model. Vectors hold one triple per wedge (change of colour) and, where positions
/// move, one per vertex after these (displacement in pixels and frames).
pub(super) struct NormalEquations<'a> {
    model: &'a Model,
    evidence: &'a Evidence,
    /// 1 for components that may change, 0 for others.
    mask: Vec<Vec3>,
    /// Added to the diagonal, per entry of a vector.
    damping: Vec<f32>,
    /// Inverse of the wedges' diagonal.
    color_inverse: Vec<f32>,
    /// Inverse of the vertices' diagonal blocks; empty where positions are held.
    position_inverse: Vec<Mat3>,
    /// How colours answer to displacements. None where positions are held.
    slopes: Option<Slopes>,
}

impl<'a> NormalEquations<'a> {
    /// Colours alone. `mask` and `damping` (in pixels) have an entry per wedge.
    pub(super) fn of_colors(model: &'a Model, evidence: &'a Evidence, mask: Vec<Vec3>, damping: Vec<f32>) -> Self {
        let (color_inverse, position_inverse) = (Vec::new(), Vec::new());
        let mut system = Self { model, evidence, mask, damping, color_inverse, position_inverse, slopes: None };
        system.color_inverse = system.invert_color_diagonal();
        system
    }

    /// Colours and positions together. `mask` has an entry per wedge, then one per vertex.
    pub(super) fn of_colors_and_positions(
        (model, evidence): (&'a Model, &'a Evidence),
        (points, node_colors): (&[IVec3], &[Vec3]),
        mask: Vec<Vec3>,
        color_damping: Vec<f32>,
        position_damping: &PositionDamping,
    ) -> Self {
        let mut system = Self::of_colors(model, evidence, mask, color_damping);
        let slopes = evidence.edges.slopes(model, points, node_colors);
        system.damp_and_invert_positions(&slopes, position_damping);
        system.slopes = Some(slopes);
        system
    }

    /// The right-hand side, for nodes of these colours: minus half the gradient of the squared error, and for wedge w
    /// its damping times `pull(w)`, the way from its colour to the one it would have if no pixel spoke.
    pub(super) fn right_hand_side(&self, node_colors: &[Vec3], pull: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
        let moments = &self.evidence.moments;
        let mut out = self.adjoint(
            |m| moments[m].residual(self.corner_values(m, node_colors)),
            |row| self.evidence.edges.residual(row, self.model, node_colors),
        );
        for (wedge, out) in out.iter_mut().enumerate().take(self.wedges()) {
            *out += pull(wedge) * self.damping[wedge] * self.mask[wedge];
        }
        out
    }

    fn corner_values(&self, moment: usize, node_values: &[Vec3]) -> [Vec3; 4] {
        self.model.tets[self.evidence.moments[moment].tet as usize].map(|n| node_values[n as usize])
    }

    fn wedges(&self) -> usize {
        self.model.colors_back.rows()
    }

    /// Carries what `corner_change(m)` finds at the corners of each measured tet, and `change(row)` in each edge pixel,
    /// back to wedges and vertices.
    fn adjoint(
        &self,
        corner_change: impl Fn(usize) -> [Vec3; 4] + Sync + Send,
        change: impl Fn(usize) -> Vec3 + Sync + Send,
    ) -> Vec<Vec3> {
        let (model, nodes) = (self.model, self.model.node_point.len());
        let (moments, edges) = (&self.evidence.moments, &self.evidence.edges);
        let points = if self.slopes.is_none() { 0 } else { model.positions.rows() };
        let mut sums = collect(moments.len(), nodes + points, |m, out: &mut [Vec3]| {
            let tet = moments[m].tet as usize;
            let change = corner_change(m);
            for (corner, &node) in model.tets[tet].iter().enumerate() {
                out[node as usize] += change[corner];
            }
            if let Some(slopes) = &self.slopes {
                let transposed = slopes.gradients[tet].transpose();
                for (corner, point) in model.tet_points(tet).into_iter().enumerate() {
                    out[nodes + point] -= transposed * change[corner];
                }
            }
        });
        add_all(&mut sums, edges.len(), |row, out: &mut [Vec3]| {
            let change = change(row);
            edges.color_terms(row, model, |node, weight| out[node] += change * weight);
            if let Some(slopes) = &self.slopes {
                edges.change_back(row, (model, slopes), change, |point, part| out[nodes + point] += part);
            }
        });
        let mut out = model.colors_back.times(&sums[..nodes]);
        if points > 0 {
            out.extend(model.positions_back.times(&sums[nodes..]));
        }
        parallel::update(&mut out, |i, out| *out *= self.mask[i]);
        out
    }

    /// Approximates the diagonal by the tets' own diagonals through squared weights.
    fn invert_color_diagonal(&self) -> Vec<f32> {
        let (model, count) = (self.model, self.model.node_point.len());
        let (moments, edges) = (&self.evidence.moments, &self.evidence.edges);
        let mut nodes = collect(moments.len(), count, |m, out: &mut [f32]| {
            for (corner, &node) in model.tets[moments[m].tet as usize].iter().enumerate() {
                out[node as usize] += moments[m].diagonal(corner);
            }
        });
        add_all(&mut nodes, edges.len(), |row, out: &mut [f32]| {
            let mut weights = Terms::<f32>::default();
            edges.color_terms(row, model, |node, weight| weights.add(node, weight));
            weights.for_each(|node, weight| out[node] += weight * weight);
        });
        let diagonal = |wedge: usize| self.model.colors_back.row(wedge).map(|(n, w)| w * w * nodes[n]).sum::<f32>();
        parallel::map(self.wedges(), |wedge| 1.0 / (diagonal(wedge) + self.damping[wedge]).max(f32::MIN_POSITIVE))
    }

    fn damp_and_invert_positions(&mut self, slopes: &Slopes, damping: &PositionDamping) {
        let (model, wedges) = (self.model, self.wedges());
        let (moments, edges) = (&self.evidence.moments, &self.evidence.edges);
        let mut points = collect(moments.len(), model.positions.rows(), |m, out: &mut [Block]| {
            let tet = moments[m].tet as usize;
            let block = Block::of(&slopes.gradients[tet]);
            for (corner, point) in model.tet_points(tet).into_iter().enumerate() {
                out[point] += block.scaled(moments[m].diagonal(corner));
            }
        });
        add_all(&mut points, edges.len(), |row, out: &mut [Block]| {
            let mut matrices = Terms::<Mat3>::default();
            edges.position_terms(row, (model, slopes), |point, matrix| matrices.add(point, matrix));
            matrices.for_each(|point, matrix| out[point] += Block::of(&matrix));
        });
        let rows = parallel::map(model.positions_back.rows(), |vertex| {
            let mut block = Block::default();
            model.positions_back.row(vertex).for_each(|(p, w)| block += points[p].scaled(w * w));
            let damping = damping.absolute + damping.relative[vertex] * block.diagonal.element_sum() / 3.0;
            (damping, block.inverse(damping, self.mask[wedges + vertex]))
        });
        self.damping.extend(rows.iter().map(|r| r.0));
        self.position_inverse = rows.into_iter().map(|r| r.1).collect();
    }
}

/// The terms of one pixel, those of the same unknown added up; they are few.
#[derive(Default)]
struct Terms<T>(Vec<(usize, T)>);

impl<T: Copy + AddAssign> Terms<T> {
    fn add(&mut self, unknown: usize, term: T) {
        match self.0.iter_mut().find(|(known, _)| *known == unknown) {
            Some((_, sum)) => *sum += term,
            None => self.0.push((unknown, term)),
        }
    }

    fn for_each(&self, mut each: impl FnMut(usize, T)) {
        self.0.iter().for_each(|&(unknown, term)| each(unknown, term));
    }
}

impl System for NormalEquations<'_> {
    fn times(&self, x: &[Vec3]) -> Vec<Vec3> {
        let (colors, positions) = x.split_at(self.wedges());
        let nodes = self.model.colors.times(colors);
        let points = if self.slopes.is_none() { Vec::new() } else { self.model.positions.times(positions) };
        let mut out = self.adjoint(
            |m| {
                let mut u = self.corner_values(m, &nodes);
                let tet = self.evidence.moments[m].tet as usize;
                if let Some(slopes) = &self.slopes {
                    let corners = self.model.tet_points(tet);
                    u.iter_mut().zip(corners).for_each(|(u, p)| *u -= slopes.gradients[tet] * points[p]);
                }
                self.evidence.moments[m].product(u)
            },
            |row| {
                let edges = &self.evidence.edges;
                let change = self.slopes.as_ref().map(|slopes| edges.change(row, (self.model, slopes), &points));
                edges.mean(row, self.model, &nodes) + change.unwrap_or_default()
            },
        );
        parallel::update(&mut out, |i, out| *out += x[i] * self.damping[i]);
        out
    }

    fn precondition(&self, r: &[Vec3]) -> Vec<Vec3> {
        let wedges = self.wedges();
        let mut out = vec![Vec3::ZERO; r.len()];
        parallel::fill(&mut out, |i| match self.color_inverse.get(i) {
            Some(inverse) => r[i] * *inverse,
            None => self.position_inverse[i - wedges] * r[i],
        });
        out
    }
}

/// A symmetric 3x3 matrix.
#[derive(Debug, Clone, Copy, Default)]
struct Block {
    diagonal: Vec3,
    /// xy, xt, yt.
    off: Vec3,
}

impl Block {
    /// C^T C.
    fn of(c: &Mat3) -> Self {
        let [x, y, t] = [c.x_axis, c.y_axis, c.z_axis];
        Self { diagonal: Vec3::new(x.dot(x), y.dot(y), t.dot(t)), off: Vec3::new(x.dot(y), x.dot(t), y.dot(t)) }
    }

    fn scaled(self, s: f32) -> Self {
        Self { diagonal: self.diagonal * s, off: self.off * s }
    }

    /// The inverse of this plus `damping` on the diagonal, in the components that `mask` leaves.
    fn inverse(self, damping: f32, mask: Vec3) -> Mat3 {
        let floor = f32::MIN_POSITIVE.sqrt();
        let d = (self.diagonal + damping).max(Vec3::splat(floor)) * mask + (Vec3::ONE - mask);
        let o = self.off * Vec3::new(mask.x * mask.y, mask.x * mask.z, mask.y * mask.z);
        let full = Mat3::from_cols_array(&[d.x, o.x, o.y, o.x, d.y, o.z, o.y, o.z, d.z]);
        let inverse = full.inverse();
        // Rounding can leave a nearly singular block indefinite; its diagonal alone is always safe.
        let safe = full.determinant() > 1e-4 * d.element_product() && inverse.is_finite();
        if safe { inverse } else { Mat3::from_diagonal(d.recip()) }
    }
}

impl AddAssign for Block {
    fn add_assign(&mut self, other: Self) {
        self.diagonal += other.diagonal;
        self.off += other.off;
    }
}

/// Adds to `sums` what [`collect`] finds; where there are no items, without a vector for it.
fn add_all<T>(sums: &mut [T], items: usize, add: impl Fn(usize, &mut [T]) + Sync + Send)
where
    T: Copy + Default + AddAssign + Send + Sync,
{
    if items > 0 {
        let more = collect(items, sums.len(), add);
        sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
    }
}

/// Sums that every item adds to: `add(item, sums)` for all items, in parts that are added up in order.
fn collect<T>(items: usize, len: usize, add: impl Fn(usize, &mut [T]) + Sync + Send) -> Vec<T>
where
    T: Copy + Default + AddAssign + Send + Sync,
{
    let per_part = items.div_ceil(PARTS).max(1);
    let mut parts = parallel::map(items.div_ceil(per_part), |part| {
        let mut sums = vec![T::default(); len];
        (part * per_part..((part + 1) * per_part).min(items)).for_each(|item| add(item, &mut sums));
        sums
    });
    let Some((total, rest)) = parts.split_first_mut() else {
        return vec![T::default(); len];
    };
    let first = std::mem::take(total);
    let mut sums = vec![T::default(); len];
    parallel::fill(&mut sums, |i| {
        let mut sum = first[i];
        rest.iter().for_each(|part| sum += part[i]);
        sum
    });
    sums
}
