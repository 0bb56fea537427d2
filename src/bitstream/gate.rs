//! The choice of the next gate: the open face to be closed.
//!
//! In: the front around a focus vertex. Out: a gate, what lies across its edges, and measures there. Forbidden here: coding.
//!
//! The gap at an edge between two open faces is either sharp, then almost surely closed by one tet, or wide. So sharp gaps
//! at the focus come first. Meshes are long in time where nothing moves, so angles and distances are measured in the
//! extents of the edges around.

use glam::{Vec3A, Vec4};

use super::extents;
use super::front::{Corner, Front};
use super::normals::dot;
use super::vertices::Vertices;
use crate::mesh::VertexId;

/// Open faces of one vertex that are looked at. Typical vertices have six; a hub of thousands stays cheap.
pub(super) const SCAN: usize = 24;

/// Classes of distance: half octaves of its square, from less than 1 to 8 and more.
pub(super) const RANGES: usize = 8;

/// An open face to be closed.
#[derive(Debug, Clone)]
pub(super) struct Gate {
    /// Its corner at the focus.
    pub(super) corner: Corner,
    /// Its vertices, the focus first.
    pub(super) corners: [VertexId; 3],
    /// Its edges in the order in which what lies across them is asked for: to the focus, from there, opposite.
    pub(super) edges: [Corner; 3],
    /// Corners across them; rows of no face for none.
    pub(super) opposite: [Corner; 3],
    /// Vertices there; [`NOWHERE`](super::front::NOWHERE) for none.
    pub(super) across: [VertexId; 3],
    /// Sides of the box that all its corners lie on, as bits.
    pub(super) sides: u8,
    /// Sum of the extents at its corners.
    pub(super) extent: Vec3A,
    /// The inverse of each component.
    scale: Vec3A,
    /// Sum of the corners' positions.
    sum: Vec3A,
}

impl Gate {
    /// The open face at `focus` to close next. `None`: all faces at `focus` are closed.
    #[inline(always)]
    pub(super) fn choose(front: &mut Front, vertices: &Vertices, focus: VertexId) -> Option<Self> {
        let corner = front.find_sharpest(vertices, focus, SCAN)?;
        Some(Self::new(front, vertices, corner))
    }

    /// The open face of this corner.
    #[inline(always)]
    pub(super) fn new(front: &Front, vertices: &Vertices, corner: Corner) -> Self {
        let corners = front.vertices_from(corner);
        let edges = [corner.previous(), corner, corner.next()];
        let opposite = edges.map(|edge| front.corner_across(edge));
        let across = opposite.map(|corner| front.vertex(corner));
        let [a, b, c] = corners.map(|v| &vertices[v]);
        let extent = extents::around([a.extent, b.extent, c.extent]);
        Self {
            corner,
            corners,
            edges,
            opposite,
            across,
            sides: a.sides & b.sides & c.sides,
            extent,
            scale: Vec3A::ONE / extent,
            sum: a.position + b.position + c.position,
        }
    }

    /// Square of the distance of a vertex from the gate's centre, in extents.
    #[inline]
    pub(super) fn distance2(&self, vertices: &Vertices, vertex: VertexId) -> f32 {
        let d = (3.0 * vertices.position(vertex) - self.sum) * self.scale;
        dot(d, d)
    }

    /// The same of four points side by side, axis by axis.
    #[inline]
    pub(super) fn distances2(&self, [x, y, t]: [Vec4; 3]) -> Vec4 {
        let x = (3.0 * x - self.sum.x) * self.scale.x;
        let y = (3.0 * y - self.sum.y) * self.scale.y;
        let t = (3.0 * t - self.sum.z) * self.scale.z;
        x * x + y * y + t * t
    }

    /// Class of that distance.
    #[inline]
    pub(super) fn range(&self, vertices: &Vertices, vertex: VertexId) -> usize {
        // The exponent and the first bit of the mantissa.
        let half_octaves = self.distance2(vertices, vertex).to_bits() >> 22;
        const ONE: u32 = 1.0f32.to_bits() >> 22;
        (half_octaves + 1).saturating_sub(ONE).min(RANGES as u32 - 1) as usize
    }
}
