//! The original boundary surfaces between labels, as points to project on.
//!
//! In: label planes of consecutive frames. Out: for a position and two labels, the nearest place where the planes put
//! the boundary between these two. Points lie halfway between neighbouring pixels (in x, y or t) of different labels;
//! a projection goes to the plane through the points around the nearest one (moving least squares, Levin 1998), so
//! that the stairs of pixels are not copied.

use glam::{DMat3, DVec3, Vec3};

use crate::video::{Label, LabelPlane};

/// Side of a search cell, in pixels and frames.
const CELL: f32 = 4.0;

/// Radius around the nearest point whose points make the plane: twice a stair's length on a slope of 1 in 2, the
/// least that averages stairs away.
const PLANE_RADIUS: f32 = 2.5;

/// Fewest points that make a plane.
const PLANE_POINTS: usize = 4;

/// Two labels, the lower one first.
pub(super) type LabelPair = (Label, Label);

/// Boundary points in a grid of cells.
#[derive(Debug, Clone)]
pub(super) struct BoundaryPoints {
    /// Near corner of the grid, in pixels and frames.
    origin: Vec3,
    /// Cells along x, y and t.
    cells: [usize; 3],
    /// Points of cell c: `start[c]..start[c + 1]`.
    start: Vec<u32>,
    points: Vec<(Vec3, LabelPair)>,
}

impl BoundaryPoints {
    /// Collects the boundary points of `planes`, each with its frame number; consecutive frames in ascending order.
    pub(super) fn new(planes: &[(u32, LabelPlane)]) -> Self {
        let mut points = Vec::new();
        for (k, plane) in planes {
            points_within(*k, plane, &mut points);
        }
        for pair in planes.windows(2).filter(|pair| pair[0].0 + 1 == pair[1].0) {
            points_between(&pair[0], &pair[1].1, &mut points);
        }
        let low = points.iter().fold(Vec3::INFINITY, |low, (p, _)| low.min(*p));
        let high = points.iter().fold(Vec3::NEG_INFINITY, |high, (p, _)| high.max(*p));
        let mut grid = Self { origin: low, cells: [0; 3], start: Vec::new(), points: Vec::new() };
        if !points.is_empty() {
            grid.cells = ((high - low) / CELL).to_array().map(|n| n as usize + 1);
        }
        grid.sort(points);
        grid
    }

    fn sort(&mut self, points: Vec<(Vec3, LabelPair)>) {
        self.start = vec![0; self.cells.iter().product::<usize>() + 1];
        for (p, _) in &points {
            let cell = self.cell(*p);
            self.start[cell + 1] += 1;
        }
        for cell in 1..self.start.len() {
            self.start[cell] += self.start[cell - 1];
        }
        let mut next = self.start.clone();
        self.points = points.clone();
        for point in points {
            let slot = &mut next[self.cell(point.0)];
            self.points[*slot as usize] = point;
            *slot += 1;
        }
    }

    fn cell(&self, p: Vec3) -> usize {
        let [x, y, t] = ((p - self.origin) / CELL).to_array().map(|c| c as usize);
        (t * self.cells[1] + y) * self.cells[0] + x
    }

    /// The point that `p` (pixels and frames) projects to on the boundary between the two labels, if one of its
    /// points is within `reach` pixels.
    pub(super) fn project(&self, p: Vec3, pair: LabelPair, reach: f32) -> Option<Vec3> {
        let mut nearest: Option<(f32, Vec3)> = None;
        self.visit(p, reach, pair, |q| {
            let distance = p.distance_squared(q);
            if distance <= reach * reach && nearest.is_none_or(|(least, _)| distance < least) {
                nearest = Some((distance, q));
            }
        });
        let (_, nearest) = nearest?;
        let Some((centre, normal)) = self.plane(nearest, pair) else {
            return Some(nearest);
        };
        Some(p - normal * normal.dot(p - centre))
    }

    /// The plane through the points around `q`: a point on it and its normal.
    fn plane(&self, q: Vec3, pair: LabelPair) -> Option<(Vec3, Vec3)> {
        let (mut count, mut total, mut sum, mut squares) = (0, 0.0, DVec3::ZERO, DMat3::ZERO);
        self.visit(q, PLANE_RADIUS, pair, |point| {
            let offset = (point - q).as_dvec3();
            let weight = 1.0 - offset.length_squared() / f64::from(PLANE_RADIUS * PLANE_RADIUS);
            if weight > 0.0 {
                let weight = weight * weight;
                count += 1;
                total += weight;
                sum += offset * weight;
                squares += outer(offset) * weight;
            }
        });
        if count < PLANE_POINTS {
            return None;
        }
        let mean = sum / total;
        let normal = smallest_axis(squares * (1.0 / total) + outer(mean) * -1.0);
        Some((q + mean.as_vec3(), normal.as_vec3()))
    }

    /// Calls `found` for the points of these labels in all cells within `reach` of `p`.
    fn visit(&self, p: Vec3, reach: f32, pair: LabelPair, mut found: impl FnMut(Vec3)) {
        let range = |axis: usize| {
            let last = self.cells[axis] as f32;
            let at = |x: f32| ((x - self.origin[axis]) / CELL).floor().clamp(0.0, last) as usize;
            at(p[axis] - reach)..(at(p[axis] + reach) + 1).min(self.cells[axis])
        };
        for t in range(2) {
            for y in range(1) {
                for x in range(0) {
                    let cell = (t * self.cells[1] + y) * self.cells[0] + x;
                    let points = &self.points[self.start[cell] as usize..self.start[cell + 1] as usize];
                    points.iter().filter(|(_, labels)| *labels == pair).for_each(|(q, _)| found(*q));
                }
            }
        }
    }
}

/// The pair of two different labels.
pub(super) fn label_pair(a: Label, b: Label) -> LabelPair {
    (a.min(b), a.max(b))
}

fn points_within(k: u32, plane: &LabelPlane, points: &mut Vec<(Vec3, LabelPair)>) {
    for y in 0..plane.height() {
        for x in 0..plane.width() {
            let here = plane.label(x, y);
            let centre = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, k as f32);
            for (dx, dy) in [(1, 0), (0, 1)] {
                if x + dx < plane.width() && y + dy < plane.height() && plane.label(x + dx, y + dy) != here {
                    let halfway = centre + Vec3::new(dx as f32, dy as f32, 0.0) * 0.5;
                    points.push((halfway, label_pair(here, plane.label(x + dx, y + dy))));
                }
            }
        }
    }
}

fn points_between((k, before): &(u32, LabelPlane), after: &LabelPlane, points: &mut Vec<(Vec3, LabelPair)>) {
    for y in 0..before.height().min(after.height()) {
        for x in 0..before.width().min(after.width()) {
            let (here, there) = (before.label(x, y), after.label(x, y));
            if here != there {
                let halfway = Vec3::new(x as f32 + 0.5, y as f32 + 0.5, *k as f32 + 0.5);
                points.push((halfway, label_pair(here, there)));
            }
        }
    }
}

fn outer(v: DVec3) -> DMat3 {
    DMat3::from_cols(v * v.x, v * v.y, v * v.z)
}

/// The unit eigenvector of the smallest eigenvalue of a covariance, by inverse iteration. (Where two are equally
/// small, some direction between theirs.)
fn smallest_axis(covariance: DMat3) -> DVec3 {
    /// Steps: the angle shrinks by the ratio of the two smallest eigenvalues in each.
    const STEPS: usize = 12;
    let trace = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    let floor = (trace * 1e-6).max(1e-12);
    let inverse = (covariance + DMat3::from_diagonal(DVec3::splat(floor))).inverse();
    let columns = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
    let start = columns.into_iter().max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
    let start = start.unwrap_or(DVec3::X).normalize_or(DVec3::X);
    (0..STEPS).fold(start, |axis, _| (inverse * axis).normalize_or(DVec3::X))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tilted(k: u32) -> LabelPlane {
        // The boundary x = 10 + y / 3 + k / 2 moves with time.
        let label = |x: u32, y: u32| Label(u32::from(x as f32 + 0.5 > 10.0 + (y as f32 + 0.5) / 3.0 + k as f32 * 0.5));
        LabelPlane::new(32, 24, (0..24).flat_map(|y| (0..32).map(move |x| (x, y))).map(|(x, y)| label(x, y)).collect())
    }

    #[test]
    fn projections_lie_on_the_plane_that_the_pixels_sampled() {
        let planes: Vec<_> = (0..8).map(|k| (k, tilted(k))).collect();
        let points = BoundaryPoints::new(&planes);
        let normal = Vec3::new(1.0, -1.0 / 3.0, -0.5).normalize();
        for (i, p) in [(12.0, 9.0, 3.0), (16.2, 12.3, 4.5), (15.0, 8.0, 3.7)].into_iter().enumerate() {
            let p = Vec3::from(p);
            let target = points.project(p, (Label(0), Label(1)), 6.0).expect("boundary within reach");
            let off = normal.dot(target - Vec3::new(10.0, 0.0, 0.0)).abs();
            assert!(off < 0.2, "case {i}: {off} px off");
            assert!(
                (target - p).cross(normal).length() < 0.25 * (target - p).length() + 0.05,
                "case {i}: not along the normal"
            );
        }
        assert_eq!(points.project(Vec3::new(12.0, 9.0, 3.0), (Label(0), Label(2)), 6.0), None);
        assert_eq!(points.project(Vec3::new(30.0, 2.0, 1.0), (Label(0), Label(1)), 6.0), None);
    }

    #[test]
    fn no_planes_no_points() {
        let none = BoundaryPoints::new(&[]);
        assert_eq!(none.project(Vec3::ZERO, (Label(0), Label(1)), 100.0), None);
        let flat = BoundaryPoints::new(&[(3, LabelPlane::uniform(4, 4, Label(7)))]);
        assert_eq!(flat.project(Vec3::ZERO, (Label(7), Label(8)), 100.0), None);
    }
}
