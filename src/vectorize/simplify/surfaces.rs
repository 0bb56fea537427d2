//! What label surfaces cost that are moved: a quadric a vertex of a run, where labels meet at a frame.
//!
//! In: a run of lattice, or a fitted mesh ([`face_quadrics`]). Out: quadrics of the in-frame distance to where the border was,
//! weighted by the jump there.
//! Frames are all that is seen, and what labels were carried to halfway between them is as good; so of a lattice only
//! vertices at its planes count. What it has elsewhere is a staircase wherever something moves. Forbidden here: collapsing.
//!
//! At such a vertex the border's normal within the frame comes from the border's points around it, and its speed along
//! the normal from the points half a frame or a frame before and after. The error that a surface makes there is
//! (n . (x - p) - u (t - k))^2 for a border that moves by u a frame.

use std::collections::HashMap;

use glam::{IVec3, Vec2, Vec3};

use super::quadric::PositionQuadric;
use crate::mesh::{FACES, FaceMap, TetMesh, WedgeId};
use crate::vectorize::parallel::map;
use crate::video::Label;

/// Radius around a vertex whose points make the normal, in pixels.
const NORMAL_RADIUS: f32 = 2.5;
/// How far along its normal a border is looked for later or earlier, and how far beside it.
const SPEED_REACH: f32 = 3.5;
const SPEED_WIDTH: f32 = 1.5;
/// Border points a pixel of border: a lattice with diagonals has about two.
const POINTS_PER_PIXEL: f32 = 2.0;
/// Part of the weight where the speed is not known.
const UNKNOWN_SPEED: f32 = 0.25;
/// Least |n| of a face that counts: what is nearly a frame's plane is no border in it.
const LEAST_INCLINE: f32 = 0.2;
/// Side of a search cell, in pixels.
const CELL: f32 = 4.0;

/// A vertex at a frame's time, or halfway between two, where labels meet.
#[derive(Debug, Clone, Copy)]
struct BorderPoint {
    vertex: u32,
    place: Vec2,
    /// Its time in halves of a frame.
    halves: i32,
    /// Its two labels; for more, the first two.
    labels: [Label; 2],
    /// Squared difference of colour between them.
    jump: f32,
    /// Whether more than two labels meet.
    is_junction: bool,
}

/// The quadrics of the vertices of `run` where labels meet at one of its planes, each about the vertex itself, in pixels and frames.
pub(super) fn surface_quadrics(run: &TetMesh, planes_a_frame: i32, weight: f32) -> HashMap<u32, PositionQuadric> {
    let points = border_points(run, planes_a_frame);
    let grid = Grid::new(&points);
    let quadrics = map((0..points.len()).collect(), |n| quadric(&points[n], &grid, weight));
    points.iter().map(|point| point.vertex).zip(quadrics).collect()
}

/// The same for a mesh whose surfaces are where they belong: each face between labels holds its corners in its plane.
///
/// What a displacement costs is measured as it is seen, within a frame: with |n| the length of the part of its unit normal
/// that lies there, a face that moves by a pixel moves its border by 1 / |n|, and is seen as |n| of its area.
pub(super) fn face_quadrics(mesh: &TetMesh, weight: f32) -> HashMap<u32, PositionQuadric> {
    let unit = mesh.domain.unit() as f32;
    let mut open: FaceMap<[WedgeId; 3]> = FaceMap::new();
    let mut quadrics: HashMap<u32, PositionQuadric> = HashMap::new();
    for tet in &mesh.tets {
        for face in FACES {
            let mut wedges = face.map(|corner| tet[corner]);
            wedges.sort_unstable_by_key(|&wedge| mesh.vertex(wedge));
            let key = wedges.map(|wedge| mesh.vertex(wedge));
            let Some(others) = open.remove(key) else {
                open.insert(key, wedges);
                continue;
            };
            let [wedges, others] = [wedges, others].map(|side| side.map(|wedge| &mesh.wedges[wedge.index()]));
            if wedges[0].label == others[0].label {
                continue;
            }
            let [a, b, c] = key.map(|v| mesh.positions[v.index()].as_vec3() / unit);
            let across = (b - a).cross(c - a);
            let normal = across.normalize_or_zero();
            let jump = (0..3).map(|corner| wedges[corner].color - others[corner].color).sum::<Vec3>() / 3.0;
            let share = across.length() / (6.0 * normal.truncate().length().max(LEAST_INCLINE));
            let plane = PositionQuadric::plane(normal, 0.0, weight * jump.length_squared() * share);
            key.into_iter().for_each(|v| quadrics.entry(v.0).or_default().add_scaled(&plane, 1.0));
        }
    }
    quadrics
}

fn border_points(run: &TetMesh, planes_a_frame: i32) -> Vec<BorderPoint> {
    let unit = run.domain.unit();
    let (half, step) = ((unit / 2).max(1), (unit / planes_a_frame).max(1));
    let mut first: Vec<Option<u32>> = vec![None; run.positions.len()];
    let mut points: Vec<BorderPoint> = Vec::new();
    let mut number = HashMap::new();
    for (wedge, whole) in (0..).zip(&run.wedges) {
        let vertex = whole.vertex.index();
        let Some(other) = first[vertex] else {
            first[vertex] = Some(wedge);
            continue;
        };
        let position = run.positions[vertex];
        let other = &run.wedges[other as usize];
        if position.z % step != 0 || other.label == whole.label {
            continue;
        }
        let jump = whole.color.distance_squared(other.color);
        let known = *number.entry(vertex).or_insert_with(|| {
            points.push(BorderPoint {
                vertex: vertex as u32,
                place: position.as_vec3().truncate() / unit as f32,
                halves: position.z / half,
                labels: [whole.label.min(other.label), whole.label.max(other.label)],
                jump: 0.0,
                is_junction: false,
            });
            points.len() - 1
        });
        let point = &mut points[known];
        point.is_junction |= point.jump > 0.0 && !point.labels.contains(&whole.label);
        point.jump = point.jump.max(jump);
    }
    points
}

/// Border points by frame and cell.
struct Grid<'a> {
    points: &'a [BorderPoint],
    cells: HashMap<IVec3, Vec<u32>>,
}

impl<'a> Grid<'a> {
    fn new(points: &'a [BorderPoint]) -> Self {
        let mut cells: HashMap<IVec3, Vec<u32>> = HashMap::new();
        for (n, point) in (0..).zip(points) {
            cells.entry(cell(point.place, point.halves)).or_default().push(n);
        }
        Self { points, cells }
    }

    /// Calls `found(offset)` for the points between the same labels around `point`, `later` halves of a frame later, within
    /// a cell either way.
    fn visit(&self, point: &BorderPoint, later: i32, mut found: impl FnMut(Vec2)) {
        let centre = cell(point.place, point.halves + later);
        for dy in -1..=1 {
            for dx in -1..=1 {
                for &n in self.cells.get(&(centre + IVec3::new(dx, dy, 0))).into_iter().flatten() {
                    let other = &self.points[n as usize];
                    if other.labels == point.labels {
                        found(other.place - point.place);
                    }
                }
            }
        }
    }
}

fn cell(place: Vec2, halves: i32) -> IVec3 {
    let cell = (place / CELL).floor().as_ivec2();
    IVec3::new(cell.x, cell.y, halves)
}

fn quadric(point: &BorderPoint, grid: &Grid<'_>, weight: f32) -> PositionQuadric {
    let weight = weight * point.jump / POINTS_PER_PIXEL;
    let Some(normal) = normal(point, grid).filter(|_| !point.is_junction) else {
        // A corner is held in place, not along a line.
        return PositionQuadric { a: [weight, 0.0, 0.0, weight, 0.0, 0.0], ..PositionQuadric::default() };
    };
    match speed(point, normal, grid) {
        Some(speed) => PositionQuadric::plane(normal.extend(-speed), 0.0, weight),
        None => PositionQuadric::plane(normal.extend(0.0), 0.0, UNKNOWN_SPEED * weight),
    }
}

/// The border's unit normal within the frame: across the direction in which its points lie.
fn normal(point: &BorderPoint, grid: &Grid<'_>) -> Option<Vec2> {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    let (mut total, mut mean) = (0.0, Vec2::ZERO);
    grid.visit(point, 0, |offset| {
        let near = 1.0 - offset.length_squared() / (NORMAL_RADIUS * NORMAL_RADIUS);
        if near > 0.0 {
            total += near;
            mean += offset * near;
            xx += offset.x * offset.x * near;
            xy += offset.x * offset.y * near;
            yy += offset.y * offset.y * near;
        }
    });
    let mean = mean / total;
    let (xx, xy, yy) = (xx / total - mean.x * mean.x, xy / total - mean.x * mean.y, yy / total - mean.y * mean.y);
    // The angle of the larger axis of a symmetric matrix.
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let is_line = (xx - yy).hypot(2.0 * xy) > 0.5 * (xx + yy);
    is_line.then(|| Vec2::from_angle(angle).perp())
}

/// How far the border moves along its normal in a frame, if it is found before or after: half a frame away, or else a
/// whole one.
fn speed(point: &BorderPoint, normal: Vec2, grid: &Grid<'_>) -> Option<f32> {
    [1, 2].into_iter().find_map(|halves| {
        let (mut total, mut sum) = (0.0, 0.0);
        for later in [-halves, halves] {
            grid.visit(point, later, |offset| {
                let (across, along) = (offset.dot(normal), offset.perp_dot(normal));
                if across.abs() <= SPEED_REACH && along.abs() <= SPEED_WIDTH {
                    total += 1.0;
                    sum += across * 2.0 / later as f32;
                }
            });
        }
        (total > 0.0).then(|| sum / total)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Domain, Wedge};

    /// A border that is tilted by 1 in 2 and moves by 1.5 pixels a frame, as points in three frames.
    #[test]
    fn a_moving_border_costs_nothing_where_it_goes() {
        let mut run = TetMesh::empty(Domain { width: 40, height: 20, duration: 2, subpixel_bits: 3 });
        for frame in 0..3 {
            for y in 0..40 {
                let y = y as f32 * 0.5;
                let place = Vec3::new(10.0 + 0.5 * y + 1.5 * frame as f32, y, frame as f32) * 8.0;
                let vertex = run.push_vertex(place.round().as_ivec3());
                for (label, level) in [(Label(0), 0.0), (Label(1), 100.0)] {
                    run.push_wedge(Wedge { vertex, label, color: Vec3::splat(level) });
                }
            }
        }
        let quadric = surface_quadrics(&run, 1, 1.0)[&60];
        let jump = 3.0 * 100.0f32.powi(2) / POINTS_PER_PIXEL;
        let along = Vec3::new(0.5, 1.0, 0.0) * 2.0;
        assert!(quadric.at(along) < 0.02 * jump, "{}", quadric.at(along) / jump);
        let later = Vec3::new(1.5, 0.0, 1.0);
        assert!(quadric.at(later) < 0.05 * jump, "{}", quadric.at(later) / jump);
        let off = Vec3::new(1.0, 0.0, 0.0);
        assert!((quadric.at(off) / jump - 0.8).abs() < 0.1, "{}", quadric.at(off) / jump);
    }

    /// Two tets on either side of a face that leans in time, as a border that moves by a pixel a frame.
    #[test]
    fn a_face_costs_what_the_moved_border_shows() {
        let mut mesh = TetMesh::empty(Domain { width: 40, height: 40, duration: 8, subpixel_bits: 3 });
        let corners = [[10, 0, 0], [10, 12, 0], [16, 0, 6], [4, 3, 3], [19, 3, 3]];
        let vertices = corners.map(|corner| mesh.push_vertex(IVec3::from_array(corner) * 8));
        for (label, level, far) in [(Label(0), 0.0, 3), (Label(1), 100.0, 4)] {
            let color = Vec3::splat(level);
            let tet = [0, 1, 2, far].map(|n| mesh.push_wedge(Wedge { vertex: vertices[n], label, color }));
            mesh.tets.push(tet);
        }
        let quadrics = face_quadrics(&mesh, 1.0);
        assert_eq!(quadrics.len(), 3);
        let total = |offset: Vec3| quadrics.values().map(|quadric| quadric.at(offset)).sum::<f32>();
        // 36 pixels of border times frames: half of 12 by 6.
        let jump = 3.0 * 100.0f32.powi(2) * 36.0;
        assert!((total(Vec3::X) / jump - 1.0).abs() < 1e-3, "{}", total(Vec3::X) / jump);
        assert!(total(Vec3::new(1.0, 5.0, 1.0)) < 1e-3 * jump, "along the face, nothing");
    }
}
