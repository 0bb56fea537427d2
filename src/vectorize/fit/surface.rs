//! Boundary surface fitting (§IV-B, Eq. 7-11).
//!
//! In: a patch, its model, the original boundary points. Out: the patch's free vertices moved so that the subdivided
//! boundaries lie on the original ones, with the Laplacian coordinates of all vertices changed as little as possible.
//! Per iteration the fine boundary points are projected and (A^T A + lambda L^T L) d = A^T (v^t - A v) is solved for
//! the displacements d of the vertices from where they were at the start.

use glam::{IVec3, Vec3};

use super::FitParams;
use super::boundary::{BoundaryPoints, LabelPair, label_pair};
use super::guard::Guard;
use super::model::Model;
use super::parallel;
use super::patch::Patch;
use super::sparse::{Sparse, System, conjugate_gradient};
use crate::mesh::TetMesh;

/// What a surface fit did. Distances are root mean squares over the fine boundary points, in pixels.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SurfaceFit {
    pub(super) distance_before: f64,
    pub(super) distance_after: f64,
    pub(super) refused: u32,
}

/// Fits the boundaries of `patch`.
pub(super) fn optimize_surfaces(
    patch: &mut Patch,
    model: &Model,
    boundary: &BoundaryPoints,
    params: &FitParams,
) -> SurfaceFit {
    let guard = Guard::new(&patch.mesh, params.minimum_altitude);
    let rows = boundary_rows(model);
    let start = patch.mesh.positions.clone();
    let mut system = SurfaceSystem::new(patch, model, params.laplacian_weight);
    let unit = patch.mesh.domain.unit() as f32;
    let mut report = SurfaceFit::default();
    for iteration in 0..params.surface_iterations {
        let offsets =
            Offsets::new(model, &rows, boundary, &model.points(&patch.mesh.positions), params.surface_reach_px);
        if offsets.is_empty() {
            break;
        }
        if iteration == 0 {
            report.distance_before = offsets.distance();
        }
        // v^t - A v of the start = offset from the present + how far A v has moved since.
        let moved = moved_px(&patch.mesh.positions, &start, unit);
        system.set_weights(&offsets.count);
        let rhs = system.right_hand_side(&offsets, &model.positions.times(&moved));
        let wish = conjugate_gradient(&system, rhs, params.surface_cg_iterations, params.tolerance);
        let steps: Vec<Vec3> = wish.iter().zip(&moved).map(|(wish, moved)| (*wish - *moved) * unit).collect();
        report.refused += guard.move_all(&mut patch.mesh, &steps);
    }
    let points = model.points(&patch.mesh.positions);
    report.distance_after = Offsets::new(model, &rows, boundary, &points, params.surface_reach_px).distance();
    report
}

fn moved_px(now: &[IVec3], start: &[IVec3], unit: f32) -> Vec<Vec3> {
    now.iter().zip(start).map(|(now, start)| (*now - *start).as_vec3() / unit).collect()
}

/// The fine boundary points that belong to a tet of the model, each with every pair of labels that meets there.
fn boundary_rows(model: &Model) -> Vec<(u32, LabelPair)> {
    let mut nodes: Vec<u32> = model.tets.iter().flatten().copied().collect();
    nodes.sort_unstable_by_key(|&n| (model.node_point[n as usize], model.node_label[n as usize]));
    nodes.dedup();
    let same_point = |a: &u32, b: &u32| model.node_point[*a as usize] == model.node_point[*b as usize];
    let mut rows = Vec::new();
    for group in nodes.chunk_by(same_point) {
        for (i, &a) in group.iter().enumerate() {
            for &b in &group[i + 1..] {
                let labels = label_pair(model.node_label[a as usize], model.node_label[b as usize]);
                rows.push((model.node_point[a as usize], labels));
            }
        }
    }
    rows
}

/// Where the fine boundary points should go: per point the sum of offsets to its projections, and their number.
struct Offsets {
    sum: Vec<Vec3>,
    count: Vec<f32>,
    squares: f64,
}

impl Offsets {
    fn new(
        model: &Model,
        rows: &[(u32, LabelPair)],
        boundary: &BoundaryPoints,
        points: &[IVec3],
        reach_px: f32,
    ) -> Self {
        let found = parallel::map(rows.len(), |row| {
            let (point, pair) = rows[row];
            let p = points[point as usize].as_vec3() / model.fine_unit as f32;
            boundary.project(p, pair, reach_px).map(|target| target - p)
        });
        let mut offsets = Self { sum: vec![Vec3::ZERO; points.len()], count: vec![0.0; points.len()], squares: 0.0 };
        for (&(point, _), offset) in rows.iter().zip(&found) {
            if let Some(offset) = offset {
                offsets.sum[point as usize] += *offset;
                offsets.count[point as usize] += 1.0;
                offsets.squares += f64::from(offset.length_squared());
            }
        }
        offsets
    }

    fn number(&self) -> f64 {
        self.count.iter().map(|&c| f64::from(c)).sum()
    }

    fn is_empty(&self) -> bool {
        self.count.iter().all(|&c| c == 0.0)
    }

    fn distance(&self) -> f64 {
        (self.squares / self.number().max(1.0)).sqrt()
    }
}

/// A^T A + lambda L^T L over the components that may change.
struct SurfaceSystem<'a> {
    model: &'a Model,
    laplacian: Sparse,
    laplacian_back: Sparse,
    lambda: f32,
    /// Rows of A per fine point.
    weights: Vec<f32>,
    mask: Vec<Vec3>,
    inverse: Vec<f32>,
}

/// Keeps the system regular where a whole component has neither a target nor a fixed vertex.
const REGULAR: f32 = 1e-4;

impl<'a> SurfaceSystem<'a> {
    fn new(patch: &Patch, model: &'a Model, lambda: f32) -> Self {
        let mesh = &patch.mesh;
        let laplacian = laplacian(mesh);
        Self {
            model,
            laplacian_back: laplacian.transposed(),
            laplacian,
            lambda,
            weights: Vec::new(),
            mask: (0..mesh.positions.len()).map(|v| patch.movable_components(v)).collect(),
            inverse: Vec::new(),
        }
    }

    fn set_weights(&mut self, count: &[f32]) {
        let square = |map: &Sparse, v: usize, scale: &dyn Fn(usize) -> f32| -> f32 {
            map.row(v).map(|(row, w)| w * w * scale(row)).sum()
        };
        let diagonal = |v: usize| {
            let fit = square(&self.model.positions_back, v, &|point| count[point]);
            fit + self.lambda * square(&self.laplacian_back, v, &|_| 1.0) + REGULAR
        };
        self.inverse = parallel::map(self.mask.len(), |v| 1.0 / diagonal(v));
        self.weights = count.to_vec();
    }

    fn right_hand_side(&self, offsets: &Offsets, points_moved: &[Vec3]) -> Vec<Vec3> {
        let target = |point: usize| offsets.sum[point] + points_moved[point] * offsets.count[point];
        let targets: Vec<Vec3> = (0..points_moved.len()).map(target).collect();
        self.masked(self.model.positions_back.times(&targets))
    }

    fn masked(&self, mut x: Vec<Vec3>) -> Vec<Vec3> {
        x.iter_mut().zip(&self.mask).for_each(|(x, mask)| *x *= *mask);
        x
    }
}

impl System for SurfaceSystem<'_> {
    fn times(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut points = self.model.positions.times(x);
        points.iter_mut().zip(&self.weights).for_each(|(p, w)| *p *= *w);
        let fit = self.model.positions_back.times(&points);
        let smooth = self.laplacian_back.times(&self.laplacian.times(x));
        let sum = (0..x.len()).map(|v| fit[v] + smooth[v] * self.lambda + x[v] * REGULAR);
        self.masked(sum.collect())
    }

    fn precondition(&self, r: &[Vec3]) -> Vec<Vec3> {
        r.iter().zip(&self.inverse).map(|(r, d)| *r * *d).collect()
    }
}

/// Eq. 10: a vertex minus the mean of its neighbours.
fn laplacian(mesh: &TetMesh) -> Sparse {
    let mut edges: Vec<(u32, u32)> = Vec::with_capacity(mesh.tets.len() * 12);
    for tet in 0..mesh.tets.len() {
        let corners = mesh.tet_vertices(tet);
        edges.extend(corners.iter().flat_map(|a| corners.iter().map(move |b| (a.0, b.0))));
    }
    edges.sort_unstable();
    edges.dedup();
    let mut start = vec![0u32; mesh.positions.len() + 1];
    edges.iter().for_each(|&(a, _)| start[a as usize + 1] += 1);
    for v in 1..start.len() {
        start[v] += start[v - 1];
    }
    let weight = edges.iter().map(|&(a, b)| {
        // The pair (v, v) is in the row too: the vertex itself.
        let neighbours = start[a as usize + 1] - start[a as usize] - 1;
        if a == b { 1.0 } else { -1.0 / neighbours as f32 }
    });
    let weight = weight.collect();
    Sparse::new(mesh.positions.len(), start, edges.iter().map(|&(_, b)| b).collect(), weight)
}
