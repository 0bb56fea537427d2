//! Simplification of the window's mesh by edge collapse (§IV-A): extended quadric error metrics with a uniformity
//! term, one colour per label at boundary vertices, categories of vertices, named refusals.
//!
//! In: runs of lattice ([`WorkMesh::append`], [`WorkMesh::append_simplified`]). Out: a sparse mesh that tiles the same box
//! ([`WorkMesh::commit`]). Forbidden here: pixels, coding, deciding how long the window is.

mod blocks;
mod collapse;
mod commit;
mod improve;
mod legality;
mod proposal;
mod quadric;
mod queue;
mod relax;
mod stars;
mod surfaces;
mod swaps;
mod work_mesh;

pub use blocks::BlockGoal;
pub use collapse::{Goal, SimplifyReport, Unfrozen, simplify};
pub use legality::{Refusal, RefusalCounts, Topology};
pub use quadric::{ColorQuadric, DistanceQuadric, PositionQuadric, TetField, WedgeQuadric};
pub use work_mesh::WorkMesh;

/// Settings of [`simplify`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimplifyParams {
    /// Eta of Eq. 5 and 6: weight of the squared distance (pixels) to the lattice vertices inherited, against squared
    /// colour levels. Flat between 0.03 and 3 (docs/benchmarks.md).
    pub spread_weight: f32,
    /// Weight of the squared distance (pixels) to the label surfaces inherited, per square pixel of surface and squared
    /// level of the jump there: 1 is what the moved jump costs.
    pub surface_weight: f32,
    /// Least six-fold volume of a tet, in cubic pixels; a tet of the unit lattice has 1.
    pub min_volume6: f32,
    /// Least mean ratio of a tet, between 0 (flat) and 1 (regular).
    pub min_shape: f32,
    /// What errors of colour in the first and the last plane of the box count beside those in the volume, in frames. The plane of
    /// any other frame has half a frame's volume before and half a frame's after it.
    pub end_weights: [f32; 2],
    /// Most frames that a tet may reach through: bounds how long a packet can wait for its tets.
    pub max_extent_frames: u32,
    /// How strictly the topology of labels is kept.
    pub topology: Topology,
    /// What a change costs where topology has its price ([`Topology::Priced`]): the squared jump of colour between the labels
    /// that it is about, over so many cubic pixels. Flat between 0.1 and 1 (docs/benchmarks.md).
    pub topology_price: f32,
    /// Whenever this part of the vertices is left, tets inside of labels are improved: most collapses are refused since tets that
    /// nothing is seen of would turn over. 0: never.
    pub improve_at: f32,
    /// What a swap or a move that does this may cost, over the greatest cost of a collapse so far.
    pub improve_cost: f32,
    /// Vertices that a block has which is simplified by itself; at least 1. By default its data fill a core's share of
    /// the caches.
    pub block_vertices: usize,
}

impl SimplifyParams {
    /// Blocks of a mesh of so many vertices.
    fn blocks(&self, vertices: usize) -> usize {
        vertices.div_ceil(self.block_vertices.max(1)).max(1)
    }
}

impl Default for SimplifyParams {
    fn default() -> Self {
        Self {
            spread_weight: 0.3,
            surface_weight: 1.0,
            min_volume6: 1.0 / 16.0,
            min_shape: 0.03,
            end_weights: [0.0; 2],
            max_extent_frames: 10,
            topology: Topology::Free,
            topology_price: 0.5,
            improve_at: 0.0,
            improve_cost: 0.1,
            block_vertices: 20_000,
        }
    }
}
