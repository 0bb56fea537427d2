//! Pixels that label boundaries pass: what is drawn there is the mean over the pixel's square of all that covers it.
//!
//! In: parts of tets and of boundaries in each such pixel. Out: the error there and how it answers to changes of colour
//! and of place. A moved boundary sweeps area from one side to the other, so the mean changes by the jump times the
//! area swept: the term without which no boundary finds its place (the shape derivative; Haussmann's formula in
//! differentiable rendering, Li et al., "Differentiable Monte Carlo ray tracing through edge sampling", 2018).

use glam::{IVec3, Mat3, Vec3, Vec4};

use super::interface::{Crossing, Interface};
use super::marks::Marks;
use super::model::Model;
use super::parallel;
use crate::video::Volume;

/// A tet's part in a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// Number of the tet among the model's.
    pub(super) tet: u32,
    /// Area times the weights of the tet's corners at the part's centroid.
    pub(super) share: Vec4,
}

/// A boundary's part in a pixel.
#[derive(Debug, Clone, Copy)]
struct Side {
    interface: u32,
    /// Length times the weights of the interface's corners at the part's middle.
    share: Vec3,
}

/// All edge pixels, in compressed rows.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgePixels {
    /// What the frames have there.
    targets: Vec<Vec3>,
    piece_start: Vec<u32>,
    pieces: Vec<Piece>,
    side_start: Vec<u32>,
    sides: Vec<Side>,
}

/// How far the areas in a pixel may be from its own for it to count: less where the mesh is not whole there, more where
/// it folds.
const AREA_TOLERANCE: f32 = 1e-2;

/// Least part of a boundary's unit normal within the frame: what is nearly a frame's plane sweeps no more than this.
const LEAST_INCLINE: f32 = 0.2;

/// How edges answer to displacements, at a state of the model.
pub(super) struct Slopes {
    /// Per interface: the displacement of the cut within the frame is this times that of the place.
    normals: Vec<Vec3>,
}

impl EdgePixels {
    /// Sorts what was found by pixel. Pixels that are not covered once are left out.
    pub(super) fn new(marks: &Marks, frames: &Volume, pieces: Vec<(u32, Piece)>, crossings: &[Crossing]) -> Self {
        let mut targets = Vec::with_capacity(marks.count());
        marks.for_each(|frame, x, y| {
            let color = frames.frame(frame).map_or([0; 3], |frame| frame.row(y)[x as usize]);
            targets.push(Vec3::from_array(color.map(f32::from)));
        });
        let mut area = vec![0.0; targets.len()];
        pieces.iter().for_each(|(row, piece)| area[*row as usize] += piece.share.element_sum());
        let is_whole = |row: u32| (area[row as usize] - 1.0).abs() < AREA_TOLERANCE;
        let (piece_start, pieces) = by_row(targets.len(), pieces.into_iter().filter(|(row, _)| is_whole(*row)));
        let side = |c: &Crossing| {
            let row = marks.frame(c.frame)?.number(c.x, c.y);
            is_whole(row).then_some((row, Side { interface: c.interface, share: c.share }))
        };
        let (side_start, sides) = by_row(targets.len(), crossings.iter().filter_map(side));
        Self { targets, piece_start, pieces, side_start, sides }
    }

    /// Number of pixels, those left out too.
    pub(super) fn len(&self) -> usize {
        self.targets.len()
    }

    /// Number of pixels that count.
    pub(super) fn counted(&self) -> u64 {
        self.piece_start.windows(2).filter(|pair| pair[0] < pair[1]).count() as u64
    }

    fn pieces(&self, row: usize) -> &[Piece] {
        &self.pieces[self.piece_start[row] as usize..self.piece_start[row + 1] as usize]
    }

    fn sides(&self, row: usize) -> &[Side] {
        &self.sides[self.side_start[row] as usize..self.side_start[row + 1] as usize]
    }

    /// Frame minus model, for nodes of these colours; zero where the pixel does not count.
    pub(super) fn residual(&self, row: usize, model: &Model, nodes: &[Vec3]) -> Vec3 {
        let pieces = self.pieces(row);
        if pieces.is_empty() { Vec3::ZERO } else { self.targets[row] - self.mean(row, model, nodes) }
    }

    /// The mean over a pixel of the field with these values at the nodes.
    pub(super) fn mean(&self, row: usize, model: &Model, nodes: &[Vec3]) -> Vec3 {
        let value = |piece: &Piece| {
            let corners = model.tets[piece.tet as usize].map(|n| nodes[n as usize]);
            (0..4).map(|i| corners[i] * piece.share[i]).sum::<Vec3>()
        };
        self.pieces(row).iter().map(value).sum()
    }

    /// The sum of squared residuals.
    pub(super) fn energy(&self, model: &Model, nodes: &[Vec3]) -> f64 {
        parallel::sum(self.len(), |row| f64::from(self.residual(row, model, nodes).length_squared()))
    }

    /// Calls `part(node, weight)`: the pixel changes by weight times the node's change of colour.
    #[inline]
    pub(super) fn color_terms(&self, row: usize, model: &Model, mut part: impl FnMut(usize, f32)) {
        for piece in self.pieces(row) {
            for (corner, &node) in model.tets[piece.tet as usize].iter().enumerate() {
                part(node as usize, piece.share[corner]);
            }
        }
    }

    /// Calls `part(point, matrix)`: the pixel changes by matrix times the point's displacement, in pixels and frames.
    /// `gradients` are the colour gradients of the model's tets.
    #[inline]
    pub(super) fn position_terms(
        &self,
        row: usize,
        (model, gradients, slopes): (&Model, &[Mat3], &Slopes),
        nodes: &[Vec3],
        mut part: impl FnMut(usize, Mat3),
    ) {
        for piece in self.pieces(row) {
            let gradient = gradients[piece.tet as usize];
            for (corner, point) in model.tet_points(piece.tet as usize).into_iter().enumerate() {
                part(point, gradient * -piece.share[corner]);
            }
        }
        for side in self.sides(row) {
            let interface = &model.interfaces[side.interface as usize];
            let normal = slopes.normals[side.interface as usize];
            let length = side.share.element_sum();
            let value = |corner: [u32; 3]| (0..3).map(|i| nodes[corner[i] as usize] * side.share[i]).sum::<Vec3>();
            // Going outward, the inner side gains what the outer one loses.
            let jump = (value(interface.inside) - value(interface.outside)) / length;
            let outer = Mat3::from_cols(jump * normal.x, jump * normal.y, jump * normal.z);
            for (corner, &point) in interface.points.iter().enumerate() {
                part(point as usize, outer * side.share[corner]);
            }
        }
    }
}

impl Slopes {
    pub(super) fn new(interfaces: &[Interface], points: &[IVec3]) -> Self {
        let normal = |n: usize| {
            let [a, b, c] = interfaces[n].points.map(|p| points[p as usize]);
            let normal = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or_zero().as_vec3();
            normal / normal.truncate().length().max(LEAST_INCLINE)
        };
        Self { normals: parallel::map(interfaces.len(), normal) }
    }
}

/// Compressed rows of items that come with their row's number, in the order they come.
fn by_row<T: Copy>(rows: usize, items: impl Iterator<Item = (u32, T)>) -> (Vec<u32>, Vec<T>) {
    let items: Vec<(u32, T)> = items.collect();
    let mut start = vec![0u32; rows + 1];
    items.iter().for_each(|(row, _)| start[*row as usize + 1] += 1);
    for row in 0..rows {
        start[row + 1] += start[row];
    }
    let mut next = start.clone();
    let mut order = vec![0u32; items.len()];
    for (n, (row, _)) in items.iter().enumerate() {
        let slot = &mut next[*row as usize];
        order[*slot as usize] = n as u32;
        *slot += 1;
    }
    (start, order.into_iter().map(|n| items[n as usize].1).collect())
}
