//! Moves of control vertices that keep every tet upright and every side of the box straight.
//!
//! In: a mesh and wished steps. Out: the mesh with as much of them done as is safe. All checks are exact: positions
//! are integers. Vertices are moved one after another in the order of their ids, so the result is unique.

use glam::{IVec3, Vec3};

use crate::mesh::{Domain, StarTable, TetMesh, VertexId, volume6};

/// Checks and makes moves of the vertices of one mesh.
pub(super) struct Guard {
    stars: StarTable,
    /// Smallest altitude, in lattice units, that a move may leave a tet with, unless the tet had less before.
    minimum_altitude: f64,
}

impl Guard {
    /// A guard for meshes of the same tets as `mesh`.
    pub(super) fn new(mesh: &TetMesh, minimum_altitude: f32) -> Self {
        Self { stars: StarTable::new(mesh), minimum_altitude: f64::from(minimum_altitude) }
    }

    /// Moves each vertex by its step (lattice units), rounded; where that would flatten a tet, by half, a quarter,
    /// an eighth of it. Returns how many vertices were wished to move and could not at all.
    pub(super) fn move_all(&self, mesh: &mut TetMesh, steps: &[Vec3]) -> u32 {
        let mut refused = 0;
        for (v, &step) in steps.iter().enumerate() {
            let wished = self.target(mesh, v, step) != mesh.positions[v];
            let moved = [1.0, 0.5, 0.25, 0.125].into_iter().any(|part| {
                let target = self.target(mesh, v, step * part);
                target != mesh.positions[v] && self.try_move(mesh, VertexId(v as u32), target)
            });
            refused += u32::from(wished && !moved);
        }
        refused
    }

    /// Moves one vertex if all tets around it stay upright and no thinner than allowed.
    pub(super) fn try_move(&self, mesh: &mut TetMesh, vertex: VertexId, target: IVec3) -> bool {
        let before = std::mem::replace(&mut mesh.positions[vertex.index()], target);
        let keeps = self.stars.star(vertex).iter().all(|&tet| {
            let corners = mesh.tet_vertices(tet as usize);
            let now = corners.map(|v| mesh.positions[v.index()]);
            let was = corners.map(|v| if v == vertex { before } else { mesh.positions[v.index()] });
            let altitude = minimum_altitude(now);
            altitude > 0.0 && (altitude >= self.minimum_altitude || altitude >= minimum_altitude(was))
        });
        if !keeps {
            mesh.positions[vertex.index()] = before;
        }
        keeps
    }

    fn target(&self, mesh: &TetMesh, vertex: usize, step: Vec3) -> IVec3 {
        let position = mesh.positions[vertex];
        let held = step * free_components(&mesh.domain, position);
        let inside = IVec3::ONE.min(position);
        let target = position + held.round().as_ivec3();
        target.clamp(inside, (mesh.domain.extent() - IVec3::ONE).max(position))
    }
}

/// 1 for the coordinates that a vertex may change, 0 for those that a side of the box holds.
pub(super) fn free_components(domain: &Domain, position: IVec3) -> Vec3 {
    let on_side = position.cmpeq(IVec3::ZERO) | position.cmpeq(domain.extent());
    Vec3::select(on_side, Vec3::ZERO, Vec3::ONE)
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
