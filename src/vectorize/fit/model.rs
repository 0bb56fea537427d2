//! The fine mesh that the decoder will draw, as linear functions of the control mesh.
//!
//! In: a control mesh, which of its vertices may change, a number of levels. Out: fine tets over nodes (wedges of the
//! fine mesh), each node's colour a weighted sum of wedge colours, each point's position a weighted sum of vertex
//! positions. Topology and weights stay while positions and colours change.

use glam::{DVec3, IVec3, Vec3};

use super::interface::{Interface, find_interfaces};
use super::parallel;
use super::sparse::Sparse;
use crate::mesh::{Domain, TetMesh};
use crate::render::{FINE_BITS, Masks, color_masks, position_masks, subdivide};
use crate::video::Label;

/// A refined mesh as a linear function of its control mesh.
#[derive(Debug, Clone)]
pub(super) struct Model {
    /// The box of the control mesh.
    pub(super) domain: Domain,
    /// Fine units of a point's position in a pixel or a frame.
    pub(super) fine_unit: i32,
    /// The point of each node.
    pub(super) node_point: Vec<u32>,
    /// The label of each node.
    pub(super) node_label: Vec<Label>,
    /// Fine tets that depend on something free, over nodes.
    pub(super) tets: Vec<[u32; 4]>,
    /// Faces between labels of these tets.
    pub(super) interfaces: Vec<Interface>,
    /// Node colours from wedge colours, and back.
    pub(super) colors: Sparse,
    pub(super) colors_back: Sparse,
    /// Point positions from vertex positions, and back.
    pub(super) positions: Sparse,
    pub(super) positions_back: Sparse,
}

impl Model {
    /// Refines `mesh` by `levels` and keeps the tets that a free vertex or one of its wedges has a share in.
    pub(super) fn new(mesh: &TetMesh, free: &[bool], levels: u8) -> Self {
        let refined = subdivide(mesh, levels);
        let sparse = |masks: Masks| Sparse::new(masks.sources, masks.start, masks.source, masks.weight);
        let colors = sparse(color_masks(mesh, levels));
        let positions = sparse(position_masks(mesh, levels));
        let node_point: Vec<u32> = refined.nodes.iter().map(|node| node.point).collect();
        let free_wedges: Vec<bool> = mesh.wedges.iter().map(|w| free[w.vertex.index()]).collect();
        let shares = |map: &Sparse, row: usize, free: &[bool]| map.row(row).any(|(c, _)| free[c]);
        let moves = parallel::map(positions.rows(), |point| shares(&positions, point, free));
        let active = parallel::map(node_point.len(), |node| {
            moves[node_point[node] as usize] || shares(&colors, node, &free_wedges)
        });
        let depends = |tet: &[u32; 4]| tet.iter().any(|&n| active[n as usize]);
        let node_label: Vec<Label> = refined.nodes.iter().map(|node| node.label).collect();
        let tets: Vec<[u32; 4]> = refined.tets.into_iter().filter(depends).collect();
        Self {
            domain: mesh.domain,
            fine_unit: mesh.domain.unit() << FINE_BITS,
            interfaces: find_interfaces(&tets, &node_point, &node_label),
            tets,
            node_point,
            node_label,
            colors_back: colors.transposed(),
            colors,
            positions_back: positions.transposed(),
            positions,
        }
    }

    /// The points, in fine units, for vertices at `positions` (lattice units). Rounded, so that points on a side of
    /// the box lie exactly on it.
    pub(super) fn points(&self, positions: &[IVec3]) -> Vec<IVec3> {
        let mut points = vec![IVec3::ZERO; self.positions.rows()];
        let scale = f64::from(1 << FINE_BITS);
        parallel::fill(&mut points, |point| {
            // Relative to one source, so that a coordinate that all share stays exact.
            let base = self.positions.row(point).next().map_or(IVec3::ZERO, |(v, _)| positions[v]);
            let offset = |(v, w): (usize, f32)| (positions[v] - base).as_dvec3() * f64::from(w);
            let sum = self.positions.row(point).map(offset).sum::<DVec3>();
            (base << FINE_BITS) + (sum * scale).round().as_ivec3()
        });
        points
    }

    /// The nodes' colours, for wedges of these colours.
    pub(super) fn node_colors(&self, wedge_colors: &[Vec3]) -> Vec<Vec3> {
        self.colors.times(wedge_colors)
    }

    /// The points of a tet's corners.
    #[inline]
    pub(super) fn tet_points(&self, tet: usize) -> [usize; 4] {
        self.tets[tet].map(|n| self.node_point[n as usize] as usize)
    }
}
