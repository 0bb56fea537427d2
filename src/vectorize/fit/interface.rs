//! Faces of the fine mesh across which the label changes, and where frames cut them.
//!
//! In: fine tets. Out: pairs of faces, and their cuts with a frame's plane, divided among pixels. Forbidden here:
//! colours of frames.

use glam::{DVec2, DVec3, IVec3, Vec3};

use super::parallel;
use super::planes::Planes;
use crate::mesh::FACES;
use crate::video::Label;

/// A face between two labels. Its points are seen anticlockwise from outside.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Interface {
    pub(super) points: [u32; 3],
    /// The nodes at these points on the inner and on the outer side.
    pub(super) inside: [u32; 3],
    pub(super) outside: [u32; 3],
}

/// The faces between labels of `tets`, given the point and the label of each node.
pub(super) fn find_interfaces(tets: &[[u32; 4]], node_point: &[u32], node_label: &[Label]) -> Vec<Interface> {
    let mut nodes_at = vec![0u8; node_point.iter().map(|&p| p as usize + 1).max().unwrap_or(0)];
    node_point.iter().for_each(|&p| nodes_at[p as usize] = nodes_at[p as usize].saturating_add(1));
    let is_shared = |n: u32| nodes_at[node_point[n as usize] as usize] > 1;
    let mut faces: Vec<([u32; 3], [u32; 3])> = Vec::new();
    for tet in tets {
        for face in FACES {
            let nodes = face.map(|corner| tet[corner]);
            if nodes.iter().all(|&n| is_shared(n)) {
                let mut points = nodes.map(|n| node_point[n as usize]);
                points.sort_unstable();
                faces.push((points, nodes));
            }
        }
    }
    faces.sort_unstable();
    let label = |nodes: &[u32; 3]| node_label[nodes[0] as usize];
    let pair = |same: &[([u32; 3], [u32; 3])]| match same {
        [(_, a), (_, b)] if label(a) != label(b) => {
            let points = a.map(|n| node_point[n as usize]);
            let across = |p: u32| b.iter().copied().find(|&n| node_point[n as usize] == p);
            let [Some(x), Some(y), Some(z)] = points.map(across) else { return None };
            Some(Interface { points, inside: *a, outside: [x, y, z] })
        }
        _ => None,
    };
    faces.chunk_by(|a, b| a.0 == b.0).filter_map(pair).collect()
}

/// The part in one pixel of a frame's cut with an interface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    pub(super) frame: u32,
    pub(super) x: u32,
    pub(super) y: u32,
    /// Number of the interface.
    pub(super) interface: u32,
    /// Length of the part, in pixels, times the weights of the corners at its middle.
    pub(super) share: Vec3,
}

/// Interfaces that one worker takes at a time.
const PER_TASK: usize = 512;

/// All crossings, interface by interface.
pub(super) fn find_crossings(interfaces: &[Interface], points: &[IVec3], planes: &Planes<'_>) -> Vec<Crossing> {
    let task = |task: usize| {
        let mut found = Vec::new();
        for (number, interface) in interfaces.iter().enumerate().skip(task * PER_TASK).take(PER_TASK) {
            let corners = interface.points.map(|p| planes.to_px(points[p as usize]));
            for frame in planes.range(&corners) {
                let Some(picture) = planes.frames.frame(frame) else { continue };
                let Some(cut) = Cut::new(corners, planes.time(frame)) else { continue };
                cut.divide([picture.width(), picture.height()], |x, y, share| {
                    found.push(Crossing { frame, x, y, interface: number as u32, share });
                });
            }
        }
        found
    };
    parallel::map(interfaces.len().div_ceil(PER_TASK), task).concat()
}

/// A plane's cut with a triangle: a segment, with the corners' weights at its ends.
struct Cut {
    ends: [DVec2; 2],
    weights: [DVec3; 2],
}

impl Cut {
    /// None where the plane misses the triangle or has a corner or less of it.
    fn new(corners: [DVec3; 3], t: f64) -> Option<Self> {
        let mut ends = [DVec2::ZERO; 2];
        let mut weights = [DVec3::ZERO; 2];
        let mut count = 0;
        for n in 0..3 {
            let (p, q) = (n, (n + 1) % 3);
            if (corners[p].z >= t) != (corners[q].z >= t) && count < 2 {
                let s = (t - corners[p].z) / (corners[q].z - corners[p].z);
                weights[count][p] = 1.0 - s;
                weights[count][q] = s;
                ends[count] = corners[p].truncate().lerp(corners[q].truncate(), s);
                count += 1;
            }
        }
        (count == 2 && ends[0] != ends[1]).then_some(Self { ends, weights })
    }

    /// Calls `part(x, y, length times weights)` for each pixel it passes.
    fn divide(&self, size: [u32; 2], mut part: impl FnMut(u32, u32, Vec3)) {
        let along = self.ends[1] - self.ends[0];
        let length = along.length();
        // Where it enters a new row or column, as shares of the way.
        let mut stops = vec![0.0, 1.0];
        for axis in 0..2 {
            let (a, b) = (self.ends[0][axis], self.ends[1][axis]);
            let mut line = a.min(b).floor() + 1.0;
            while line < a.max(b) {
                stops.push((line - a) / along[axis]);
                line += 1.0;
            }
        }
        stops.sort_unstable_by(f64::total_cmp);
        for pair in stops.windows(2) {
            let part_length = (pair[1] - pair[0]) * length;
            if part_length <= 0.0 {
                continue;
            }
            let middle = pair[0].midpoint(pair[1]);
            let place = self.ends[0] + along * middle;
            let pixel = |axis: usize| (place[axis].max(0.0) as u32).min(size[axis] - 1);
            let weights = self.weights[0].lerp(self.weights[1], middle);
            part(pixel(0), pixel(1), (weights * part_length).as_vec3());
        }
    }
}
