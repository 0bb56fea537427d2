//! Moves of control vertices that keep every tet upright and every side of the box straight.
//!
//! In: a mesh and wished steps. Out: the mesh with as much of them done as is safe. All checks are exact: positions
//! are integers. Vertices that share no tet are moved at the same time, class after class, so the result is unique.

use glam::{IVec3, Vec3};

use super::parallel;
use crate::mesh::{StarTable, TetMesh, VertexId, volume6};

/// Checks and makes moves of the vertices of one mesh.
pub(super) struct Guard {
    stars: StarTable,
    /// Vertices of each tet: the mesh has them only by way of its wedges.
    corners: Vec<[VertexId; 4]>,
    /// All vertices, in classes of which no two share a tet.
    classes: Vec<Vec<VertexId>>,
    /// Smallest altitude, in lattice units, that a move may leave a tet with, unless the tet had less before.
    minimum_altitude: f64,
}

/// What became of a vertex's wish.
enum Move {
    Unwished,
    Made(IVec3),
    Refused,
}

impl Guard {
    /// A guard for meshes of the same tets as `mesh`.
    pub(super) fn new(mesh: &TetMesh, minimum_altitude: f32) -> Self {
        let stars = StarTable::new(mesh);
        let corners: Vec<[VertexId; 4]> = (0..mesh.tets.len()).map(|tet| mesh.tet_vertices(tet)).collect();
        let classes = classes(&stars, &corners, mesh.positions.len());
        Self { stars, corners, classes, minimum_altitude: f64::from(minimum_altitude) }
    }

    /// Moves each vertex by its step (lattice units), rounded; where that would flatten a tet, by half, a quarter,
    /// an eighth of it. Returns how many vertices were wished to move and could not at all.
    pub(super) fn move_all(&self, mesh: &mut TetMesh, steps: &[Vec3]) -> u32 {
        let mut refused = 0;
        for class in &self.classes {
            let moves = parallel::map(class.len(), |n| self.best_move(mesh, class[n], steps[class[n].index()]));
            for (vertex, made) in class.iter().zip(moves) {
                match made {
                    Move::Made(target) => mesh.positions[vertex.index()] = target,
                    Move::Refused => refused += 1,
                    Move::Unwished => {}
                }
            }
        }
        refused
    }

    fn best_move(&self, mesh: &TetMesh, vertex: VertexId, step: Vec3) -> Move {
        let position = mesh.positions[vertex.index()];
        let target = |part: f32| Some(target(mesh, position, step * part)).filter(|&target| target != position);
        if target(1.0).is_none() {
            return Move::Unwished;
        }
        let mut targets = [1.0, 0.5, 0.25, 0.125].into_iter().filter_map(target);
        targets.find(|&target| self.allows(mesh, vertex, target)).map_or(Move::Refused, Move::Made)
    }

    /// Whether all tets around a vertex stay upright, and no thinner than allowed, when it goes to `target`.
    fn allows(&self, mesh: &TetMesh, vertex: VertexId, target: IVec3) -> bool {
        let at = |v: VertexId| mesh.positions[v.index()];
        self.stars.star(vertex).iter().all(|&tet| {
            let corners = self.corners[tet as usize];
            let now = corners.map(|v| if v == vertex { target } else { at(v) });
            let bound = altitude_bound(now);
            if bound > 0.0 && bound >= self.minimum_altitude {
                return true;
            }
            let altitude = minimum_altitude(now);
            altitude > 0.0 && (altitude >= self.minimum_altitude || altitude >= minimum_altitude(corners.map(at)))
        })
    }
}

/// The position, `step` away, that stays on the sides of the box where `position` is, and off the others.
fn target(mesh: &TetMesh, position: IVec3, step: Vec3) -> IVec3 {
    let held = step * mesh.domain.sides(position).free_axes();
    let inside = IVec3::ONE.min(position);
    (position + held.round().as_ivec3()).clamp(inside, (mesh.domain.extent() - IVec3::ONE).max(position))
}

/// Classes of vertices of which no two share a tet: each vertex joins the first class that has none of its neighbours.
fn classes(stars: &StarTable, corners: &[[VertexId; 4]], vertices: usize) -> Vec<Vec<VertexId>> {
    const NONE: u32 = u32::MAX;
    let mut class_of = vec![NONE; vertices];
    let mut classes: Vec<Vec<VertexId>> = Vec::new();
    // The last vertex that had a neighbour in each class.
    let mut taken_by: Vec<u32> = Vec::new();
    for v in 0..vertices as u32 {
        for neighbour in stars.star(VertexId(v)).iter().flat_map(|&tet| corners[tet as usize]) {
            if let Some(by) = taken_by.get_mut(class_of[neighbour.index()] as usize) {
                *by = v;
            }
        }
        let class = taken_by.iter().position(|&by| by != v).unwrap_or_else(|| {
            taken_by.push(NONE);
            classes.push(Vec::new());
            classes.len() - 1
        });
        class_of[v as usize] = class as u32;
        classes[class].push(VertexId(v));
    }
    classes
}

/// At most the smallest altitude of a tet, in lattice units, at a fraction of the cost; not positive if it is flat or
/// inverted. No face's area exceeds three halves of the longest squared edge at the first corner.
fn altitude_bound([a, b, c, d]: [IVec3; 4]) -> f64 {
    let squared = |p: IVec3| (p - a).as_dvec3().length_squared();
    volume6(a, b, c, d) as f64 / (3.0 * squared(b).max(squared(c)).max(squared(d)))
}

/// The smallest altitude of a tet, in lattice units; 0 exactly if it is flat or inverted.
fn minimum_altitude([a, b, c, d]: [IVec3; 4]) -> f64 {
    let volume6 = volume6(a, b, c, d);
    if volume6 <= 0 {
        return 0.0;
    }
    let area2 = |p: IVec3, q: IVec3, r: IVec3| (q - p).as_dvec3().cross((r - p).as_dvec3()).length_squared();
    let largest = area2(b, c, d).max(area2(a, c, d)).max(area2(a, b, d)).max(area2(a, b, c));
    volume6 as f64 / largest.sqrt()
}
