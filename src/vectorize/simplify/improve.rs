//! Improving the mesh between collapses, so that there are collapses to come.
//!
//! In: a mesh in which edges collapse. Out: the same surfaces between labels, with better tets between them. Edge collapses alone
//! lead to a mesh where most of what is cheap would turn tets over: of drawings that move, nineteen of twenty. (So swaps,
//! moves and collapses go together in all that improves meshes: Klingner and Shewchuk, "Aggressive tetrahedral mesh
//! improvement", 2007.) Forbidden here: collapsing, moving what is seen.

use super::collapse::Unfrozen;
use super::legality::{Form, Limits};
use super::quadric::WedgeQuadric;
use super::work_mesh::WorkMesh;

impl<Q: WedgeQuadric> WorkMesh<Q> {
    /// Swaps edges and moves vertices inside of labels where that makes the worst tet around better, and changes colours by no more
    /// than `price` (squared levels times cubic pixels). Stars and places must be there.
    pub(super) fn improve(&mut self, unfrozen: Unfrozen, limits: &Limits, price: f32) {
        self.swap(limits, price);
        self.relax(unfrozen, limits, price);
    }

    /// The quality of a tet, the cube of its mean ratio: between 0 and 1, negative where it is not allowed.
    pub(super) fn quality(&self, places: [glam::IVec3; 4], limits: &Limits) -> f32 {
        let form = Form::of(places);
        let times = places.map(|place| place.z);
        let reach = times.iter().max().zip(times.iter().min()).map_or(0, |(last, first)| last - first);
        if form.volume6 >= limits.min_volume6 && reach <= limits.max_extent { form.shape() } else { -1.0 }
    }

    /// The same of a tet as it is, or of one that could be.
    pub(super) fn quality_of(&self, corners: [u32; 4], limits: &Limits) -> f32 {
        self.quality(corners.map(|v| self.places[v as usize]), limits)
    }
}
