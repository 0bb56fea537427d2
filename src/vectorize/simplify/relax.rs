//! Relaxing: vertices inside of labels make room.
//!
//! In: a mesh in which edges collapse. Out: the same with vertices of one label closer to the middle of their neighbours, where
//! the worst tet around them gains by it. Forbidden here: moving surfaces and what has been handed on.

use glam::{IVec3, Vec3};

use super::collapse::Unfrozen;
use super::legality::Limits;
use super::quadric::WedgeQuadric;
use super::work_mesh::{NONE, WorkMesh};

/// Parts of the way to the middle that are tried.
const PARTS: [f32; 3] = [1.0, 0.5, 0.25];

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Moves vertices where their worst tet becomes better and costs no more than `price`.
    pub(super) fn relax(&mut self, unfrozen: Unfrozen, limits: &Limits, price: f32) {
        for v in 0..self.vertices.len() as u32 {
            let vertex = &self.vertices[v as usize];
            let is_inside = vertex.stamp != NONE && vertex.first.next == NONE;
            let is_held = vertex.frozen || self.committed[v as usize] != NONE || unfrozen.freezes(vertex.position.z);
            if !is_inside || is_held || self.stars.star(v).is_empty() {
                continue;
            }
            if let Some(place) = self.roomier_place(v, limits, price).filter(|place| !unfrozen.freezes(place.z)) {
                self.move_to(v, place);
            }
        }
    }

    fn roomier_place(&self, v: u32, limits: &Limits, price: f32) -> Option<IVec3> {
        let vertex = &self.vertices[v as usize];
        let now = vertex.position;
        let star = self.stars.star(v);
        let offsets = star.iter().flat_map(|&tet| self.tets[tet as usize]).map(|w| self.places[w as usize] - now);
        let way = offsets.sum::<IVec3>().as_vec3() / (3 * star.len()) as f32 * vertex.sides.free_axes();
        let worst = self.worst_around(v, now, limits);
        let quadric = vertex.first.quadric.reduced();
        let most = quadric.at(Vec3::ZERO).max(0.0) + price;
        let is_better = |place: &IVec3| {
            let is_elsewhere = *place != now && self.domain.sides(*place) == vertex.sides;
            is_elsewhere && quadric.at(self.offset(now, *place)) <= most && self.worst_around(v, *place, limits) > worst
        };
        PARTS.into_iter().map(|part| now + (way * part).round().as_ivec3()).find(is_better)
    }

    /// The quality of the worst tet around `v` if it were at `place`.
    fn worst_around(&self, v: u32, place: IVec3, limits: &Limits) -> f32 {
        let at = |w: u32| if w == v { place } else { self.places[w as usize] };
        let qualities = self.stars.star(v).iter().map(|&tet| self.quality(self.tets[tet as usize].map(at), limits));
        qualities.fold(f32::INFINITY, f32::min)
    }

    fn move_to(&mut self, v: u32, place: IVec3) {
        let offset = self.offset(self.vertices[v as usize].position, place);
        let vertex = &mut self.vertices[v as usize];
        vertex.first.quadric = vertex.first.quadric.recentered(offset);
        vertex.position = place;
        vertex.stamp += 1;
        self.places[v as usize] = place;
    }
}
