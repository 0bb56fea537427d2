//! The example of docs/format.md: a stored stream, which this version must write and parse for ever.

use glam::{IVec3, Vec3};
use tetvec::mesh::{Domain, TetMesh, VertexId, Wedge, WedgeId};
use tetvec::video::Label;

/// The example's mesh: a box of 2 x 2 pixels and one frame in half pixels, cut into six tets around the diagonal, those
/// below it red, the others blue.
pub(crate) fn example_mesh() -> TetMesh {
    let domain = Domain { width: 2, height: 2, duration: 1, subpixel_bits: 1 };
    let mut mesh = TetMesh::empty(domain);
    let extent = domain.extent();
    for corner in 0..8 {
        mesh.push_vertex(IVec3::from_array([0, 1, 2].map(|axis| extent[axis] * (corner >> axis & 1))));
    }
    mesh.pinned[7] = true;
    for (axes, is_even) in [
        ([0, 1, 2], true),
        ([1, 2, 0], true),
        ([2, 0, 1], true),
        ([0, 2, 1], false),
        ([1, 0, 2], false),
        ([2, 1, 0], false),
    ] {
        let [second, third, fourth] = [1 << axes[0], 1 << axes[0] | 1 << axes[1], 7];
        let corners = if is_even { [0, second, third, fourth] } else { [0, second, fourth, third] };
        let label = Label(u32::from(axes[0] == 1));
        let color = if label.0 == 0 { Vec3::new(255.0, 0.0, 0.0) } else { Vec3::new(0.0, 0.0, 200.0) };
        let wedges = corners.map(|v: u32| {
            let wedge = Wedge { vertex: VertexId(v), label, color };
            match mesh.wedges.iter().position(|&known| known == wedge) {
                Some(known) => WedgeId(known as u32),
                None => mesh.push_wedge(wedge),
            }
        });
        mesh.tets.push(wedges);
    }
    mesh
}
