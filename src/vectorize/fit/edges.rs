//! Pixels that label boundaries pass: what is drawn there is the mean over the pixel's square of all that covers it.
//!
//! In: parts of tets and of boundaries in each such pixel. Out: the error there and how it answers to changes of colour
//! and of place. A moved boundary sweeps area from one side to the other, so the mean changes by the jump times the
//! area swept: the term without which no boundary finds its place (the shape derivative; Haussmann's formula in
//! differentiable rendering, Li et al., "Differentiable Monte Carlo ray tracing through edge sampling", 2018).

use std::ops::Range;

use glam::{IVec3, Mat3, Vec3};

use super::interface::Crossing;
use super::marks::Marks;
use super::model::Model;
use super::parallel;
use super::smoothness::color_gradient;
use crate::video::Volume;

/// A tet's part in a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Piece {
    /// Number of the tet among the model's.
    pub(super) tet: u32,
    /// Area times the weights of the tet's corners at the part's centroid. (No vector: aligned, there are too many of them.)
    pub(super) share: [f32; 4],
}

/// A boundary's part in a pixel.
#[derive(Debug, Clone, Copy, Default)]
struct Side {
    interface: u32,
    /// Length times the weights of the interface's corners at the part's middle.
    share: Vec3,
}

impl Piece {
    /// The points of the tet's corners, with their part in the share.
    #[inline]
    fn corners(&self, model: &Model) -> impl Iterator<Item = (usize, f32)> + use<> {
        model.tet_points(self.tet as usize).into_iter().zip(self.share)
    }
}

impl Side {
    /// The points of the interface's corners, with their part in the share.
    #[inline]
    fn corners(&self, model: &Model) -> impl Iterator<Item = (usize, f32)> + use<> {
        let points = model.interfaces[self.interface as usize].points.map(|point| point as usize);
        points.into_iter().zip(self.share.to_array())
    }
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

/// How colour answers to displacements, at a state of the model.
pub(super) struct Slopes {
    /// Colour gradients of the model's tets.
    pub(super) gradients: Vec<Mat3>,
    /// Per interface: the displacement of the cut within the frame is this times that of the place.
    normals: Vec<Vec3>,
    /// Per part of a boundary in a pixel: by how much colour on the inside is more than that on the outside.
    jumps: Vec<Vec3>,
}

impl EdgePixels {
    /// Sorts what was found by pixel. Pixels that are not covered once are left out.
    pub(super) fn new(marks: &Marks, frames: &Volume, pieces: &[Vec<(u32, Piece)>], crossings: &[Crossing]) -> Self {
        let mut targets = Vec::with_capacity(marks.count());
        marks.for_each(|frame, x, y| {
            let color = frames.frame(frame).map_or([0; 3], |frame| frame.row(y)[x as usize]);
            targets.push(Vec3::from_array(color.map(f32::from)));
        });
        let mut area = vec![0.0; targets.len()];
        pieces.iter().flatten().for_each(|(row, piece)| area[*row as usize] += piece.share.iter().sum::<f32>());
        let is_whole = |row: u32| (area[row as usize] - 1.0).abs() < AREA_TOLERANCE;
        let whole_pieces = || pieces.iter().flatten().copied().filter(|(row, _)| is_whole(*row));
        let (piece_start, pieces) = by_row(targets.len(), whole_pieces);
        let side = |c: &Crossing| {
            let row = marks.frame(c.frame)?.number(c.x, c.y);
            is_whole(row).then_some((row, Side { interface: c.interface, share: c.share }))
        };
        let (side_start, sides) = by_row(targets.len(), || crossings.iter().filter_map(side));
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

    fn side_range(&self, row: usize) -> Range<usize> {
        self.side_start[row] as usize..self.side_start[row + 1] as usize
    }

    fn sides(&self, row: usize) -> &[Side] {
        &self.sides[self.side_range(row)]
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

    /// How colour answers to displacements where points and nodes are so.
    pub(super) fn slopes(&self, model: &Model, points: &[IVec3], nodes: &[Vec3]) -> Slopes {
        let normal = |n: usize| {
            let [a, b, c] = model.interfaces[n].points.map(|p| points[p as usize]);
            let normal = (b - a).as_dvec3().cross((c - a).as_dvec3()).normalize_or_zero().as_vec3();
            normal / normal.truncate().length().max(LEAST_INCLINE)
        };
        let gradient = |tet: usize| {
            let corners = model.tet_points(tet).map(|p| points[p]);
            color_gradient(corners, model.tets[tet].map(|n| nodes[n as usize]), model.fine_unit)
        };
        let jump = |n: usize| {
            let side = &self.sides[n];
            let interface = &model.interfaces[side.interface as usize];
            let value = |corner: [u32; 3]| (0..3).map(|i| nodes[corner[i] as usize] * side.share[i]).sum::<Vec3>();
            (value(interface.inside) - value(interface.outside)) / side.share.element_sum()
        };
        Slopes {
            gradients: parallel::map(model.tets.len(), gradient),
            normals: parallel::map(model.interfaces.len(), normal),
            jumps: parallel::map(self.sides.len(), jump),
        }
    }

    /// What a pixel changes by when points are displaced, in pixels and frames.
    #[inline]
    pub(super) fn change(&self, row: usize, (model, slopes): (&Model, &Slopes), displaced: &[Vec3]) -> Vec3 {
        let of_piece = |piece: &Piece| {
            let corners = piece.corners(model);
            let way = corners.map(|(point, share)| displaced[point] * share).sum::<Vec3>();
            slopes.gradients[piece.tet as usize] * -way
        };
        // Going outward, the inner side gains what the outer one loses.
        let of_side = |(side, jump): (&Side, &Vec3)| {
            let corners = side.corners(model);
            let way = corners.map(|(point, share)| displaced[point] * share).sum::<Vec3>();
            *jump * slopes.normals[side.interface as usize].dot(way)
        };
        let pieces = self.pieces(row).iter().map(of_piece).sum::<Vec3>();
        pieces + self.sides(row).iter().zip(&slopes.jumps[self.side_range(row)]).map(of_side).sum::<Vec3>()
    }

    /// The transpose of [`Self::change`]: calls `part(point, what)` with what a change of the pixel is to its points.
    #[inline]
    pub(super) fn change_back(
        &self,
        row: usize,
        (model, slopes): (&Model, &Slopes),
        change: Vec3,
        mut part: impl FnMut(usize, Vec3),
    ) {
        for piece in self.pieces(row) {
            let way = slopes.gradients[piece.tet as usize].transpose() * -change;
            let corners = piece.corners(model);
            corners.for_each(|(point, share)| part(point, way * share));
        }
        for (side, jump) in self.sides(row).iter().zip(&slopes.jumps[self.side_range(row)]) {
            let way = slopes.normals[side.interface as usize] * jump.dot(change);
            let corners = side.corners(model);
            corners.for_each(|(point, share)| part(point, way * share));
        }
    }

    /// The matrix of [`Self::change`]: calls `part(point, matrix)` with what the pixel changes by as its points are displaced.
    #[inline]
    pub(super) fn position_terms(
        &self,
        row: usize,
        (model, slopes): (&Model, &Slopes),
        mut part: impl FnMut(usize, Mat3),
    ) {
        for piece in self.pieces(row) {
            let gradient = slopes.gradients[piece.tet as usize];
            let corners = piece.corners(model);
            corners.for_each(|(point, share)| part(point, gradient * -share));
        }
        for (side, &jump) in self.sides(row).iter().zip(&slopes.jumps[self.side_range(row)]) {
            let normal = slopes.normals[side.interface as usize];
            let outer = Mat3::from_cols(jump * normal.x, jump * normal.y, jump * normal.z);
            let corners = side.corners(model);
            corners.for_each(|(point, share)| part(point, outer * share));
        }
    }
}

/// Compressed rows of items that come with their row's number, in the order in which they come each time.
fn by_row<T: Copy + Default, I: Iterator<Item = (u32, T)>>(rows: usize, items: impl Fn() -> I) -> (Vec<u32>, Vec<T>) {
    let mut start = vec![0u32; rows + 1];
    items().for_each(|(row, _)| start[row as usize + 1] += 1);
    for row in 0..rows {
        start[row + 1] += start[row];
    }
    let mut next = start.clone();
    let mut sorted = vec![T::default(); start[rows] as usize];
    for (row, item) in items() {
        let slot = &mut next[row as usize];
        sorted[*slot as usize] = item;
        *slot += 1;
    }
    (start, sorted)
}
