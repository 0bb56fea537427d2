//! The colours that labels have where no other shows through.
//!
//! In: a mesh, and the planes of labels with their pure colours. Out: for each wedge, the colour of its label around it.
//! Forbidden here: frames. A thin label has no pixel of its own: a wide grey stroke fits as well as a narrow black one, and
//! only what the label is elsewhere tells them apart.

use glam::Vec3;

use super::parallel;
use crate::mesh::TetMesh;
use crate::video::{Label, LabelPlane};

/// How far from a vertex pixels of its labels are looked for.
const REACH: i32 = 3;

/// The pure colour of each wedge's label around its vertex, if the plane next in time knows it: a mean over the label's
/// nearest pixels.
pub(super) fn pure_colors(mesh: &TetMesh, labels: &[(u32, LabelPlane)]) -> Vec<Option<Vec3>> {
    let unit = mesh.domain.unit();
    parallel::map(mesh.wedges.len(), |w| {
        let wedge = mesh.wedges[w];
        let place = mesh.positions[wedge.vertex.index()];
        let frame = ((place.z + unit / 2) / unit) as u32;
        let next = labels.partition_point(|(number, _)| *number < frame);
        let (_, plane) = labels.get(next).or(labels.last())?;
        around(plane, [place.x / unit, place.y / unit], wedge.label)
    })
}

/// The mean pure colour of the pixels of `label` in the smallest square around pixel (x, y) that has any.
fn around(plane: &LabelPlane, [x, y]: [i32; 2], label: Label) -> Option<Vec3> {
    let pure = plane.pure_colors()?;
    let (width, height) = (plane.width() as i32, plane.height() as i32);
    (0..=REACH).find_map(|reach| {
        let (mut sum, mut count) = (Vec3::ZERO, 0);
        for v in (y - reach).max(0)..=(y + reach).min(height - 1) {
            for u in (x - reach).max(0)..=(x + reach).min(width - 1) {
                if plane.label(u as u32, v as u32) == label {
                    sum += Vec3::from_array(pure.pixels()[(v * width + u) as usize].map(f32::from));
                    count += 1;
                }
            }
        }
        (count > 0).then(|| sum / count as f32)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{Domain, Wedge};
    use crate::video::Frame;
    use glam::IVec3;

    #[test]
    fn wedges_have_the_colours_of_their_labels_nearby() {
        let mut mesh = TetMesh::empty(Domain { width: 16, height: 4, duration: 1, subpixel_bits: 3 });
        let vertex = mesh.push_vertex(IVec3::new(8 * 8, 16, 3));
        for label in 0..3 {
            mesh.push_wedge(Wedge { vertex, label: Label(label), color: Vec3::ZERO });
        }
        // Label 0 left of the vertex, 1 from two pixels beyond it on, 2 farther away than is looked for.
        let label = |x: u32| if x < 10 { 0 } else { 1 + u32::from(x > 11) };
        let labels: Vec<Label> = (0..64).map(|n| Label(label(n % 16))).collect();
        let plane = LabelPlane::new(16, 4, labels);
        assert_eq!(pure_colors(&mesh, &[(0, plane.clone())]), [None; 3], "nothing is known");
        let pure = Frame::from_fn(16, 4, |x, _| [x as u8 * 10; 3]).expect("a frame");
        let found = pure_colors(&mesh, &[(0, plane.with_pure_colors(pure))]);
        assert_eq!(found, [Some(Vec3::splat(80.0)), Some(Vec3::splat(100.0)), None]);
        assert_eq!(pure_colors(&mesh, &[]), [None; 3]);
    }
}
