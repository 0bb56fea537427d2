//! What the frames say about each fine tet: moments of its pixels' weights and colours.
//!
//! In: fine tets at their positions, and frames. Out: per tet sums from which the squared error, its gradient and its
//! Gauss-Newton matrix follow for any colours, without another look at the pixels; and the parts of marked pixels.
//! An unmarked pixel counts where its centre lies in a slice of the tet, in exactly one tet (half-open spans whose ends are
//! computed from each edge in one direction), and its quarters, a little, where theirs lie; inverted tets count nothing,
//! since they are drawn over.

use std::ops::Range;

use glam::{DVec3, IVec3, Vec3, Vec4};

use super::edges::Piece;
use super::evidence::Beside;
use super::marks::Marks;
use super::model::Model;
use super::parallel;
use super::planes::Planes;
use super::polygon::{Polygon, Weights};
use super::quarters::{color, quarter};
use super::smoothness::{Gram, gradient_form};
use crate::video::Frame;

/// Sums over the pixels of one fine tet. phi are the weights (barycentric coordinates) of a pixel's centre, and
/// colours are taken relative to `reference`, so that sums of squares stay exact enough in f32.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    /// Number of the tet among the model's tets.
    pub(super) tet: u32,
    /// Number of pixels.
    pub(super) pixels: u32,
    /// What they count, and their quarters.
    pub(super) weight: f32,
    /// The colour that sums are relative to.
    reference: Vec3,
    /// Sum of phi phi^T, and what gradients cost.
    gram: Gram,
    /// Sum of phi_i times colour.
    rhs: [Vec3; 4],
    /// Sum of squared colour.
    square: f32,
}

impl Moments {
    /// Sum of phi_i^2.
    pub(super) fn diagonal(&self, corner: usize) -> f32 {
        self.gram[corner]
    }

    /// Gram matrix times a value at each corner.
    #[inline]
    pub(super) fn product(&self, u: [Vec3; 4]) -> [Vec3; 4] {
        let [g00, g11, g22, g33, g01, g02, g03, g12, g13, g23] = self.gram;
        [
            u[0] * g00 + u[1] * g01 + u[2] * g02 + u[3] * g03,
            u[0] * g01 + u[1] * g11 + u[2] * g12 + u[3] * g13,
            u[0] * g02 + u[1] * g12 + u[2] * g22 + u[3] * g23,
            u[0] * g03 + u[1] * g13 + u[2] * g23 + u[3] * g33,
        ]
    }

    /// Sum of phi_i times (frame - model), for the corner colours `colors`.
    pub(super) fn residual(&self, colors: [Vec3; 4]) -> [Vec3; 4] {
        let w = self.product(colors.map(|c| c - self.reference));
        std::array::from_fn(|i| self.rhs[i] - w[i])
    }

    /// Sum of |frame - model|^2 over pixels and channels, and what the gradient costs, for the corner colours `colors`.
    pub(super) fn energy(&self, colors: [Vec3; 4]) -> f64 {
        let u = colors.map(|c| c - self.reference);
        let w = self.product(u);
        let cross: f32 = (0..4).map(|i| u[i].dot(w[i] - 2.0 * self.rhs[i])).sum();
        f64::from((self.square + cross).max(0.0))
    }
}

/// Fewest fine tets that one worker takes at a time.
const TETS_PER_TASK: usize = 512;

/// What tets are looked at with.
pub(super) struct View<'a> {
    pub(super) planes: Planes<'a>,
    /// Pixels that are taken whole and not at their centres.
    pub(super) marks: &'a Marks,
    /// What counts beside the centres.
    pub(super) beside: Beside,
}

/// The moments of all of the model's tets, in their order, over the pixels that are not marked. `points` are the model's
/// points (its fine units), `colors` the nodes' colours (only to choose references by). They are written into the memory
/// of `buffer`: it is most of what a fit holds, and the time to be given it anew was a tenth of a fit.
pub(super) fn measure(
    model: &Model,
    points: &[IVec3],
    colors: &[Vec3],
    view: &View<'_>,
    mut buffer: Vec<Moments>,
) -> Vec<Moments> {
    buffer.resize(model.tets.len(), Moments::default());
    parallel::fill_by(TETS_PER_TASK, &mut buffer, |tet| {
        let nodes = model.tets[tet].map(|n| n as usize);
        let corners = nodes.map(|n| points[model.node_point[n] as usize]);
        let reference = nodes.iter().map(|&n| colors[n]).sum::<Vec3>() * 0.25;
        let empty = Moments { tet: tet as u32, reference, ..Moments::default() };
        let mut moments = view.moments(tet as u32, corners, reference).unwrap_or(empty);
        if let Some(form) = gradient_form(corners, model.fine_unit, view.beside.gradient) {
            moments.gram.iter_mut().zip(form).for_each(|(sum, entry)| *sum += entry);
        }
        moments
    });
    buffer
}

/// The parts of marked pixels that tets cover, each with the pixel's number, in the order of the tets. (Lists, since they take
/// the most memory of all.)
pub(super) fn find_pieces(model: &Model, points: &[IVec3], view: &View<'_>) -> Vec<Vec<(u32, Piece)>> {
    if view.marks.count() == 0 {
        return Vec::new();
    }
    let task = |task: usize| {
        let mut pieces = Vec::new();
        for tet in task * TETS_PER_TASK..((task + 1) * TETS_PER_TASK).min(model.tets.len()) {
            view.pieces(tet as u32, model.tet_points(tet).map(|p| points[p]), &mut pieces);
        }
        pieces
    };
    parallel::map(model.tets.len().div_ceil(TETS_PER_TASK), task)
}

impl View<'_> {
    /// The moments of one tet; none if it covers no pixel.
    fn moments(&self, tet: u32, corners: [IVec3; 4], reference: Vec3) -> Option<Moments> {
        let p = corners.map(|c| self.planes.to_px(c));
        let range = self.planes.range(&p);
        if range.is_empty() {
            return None;
        }
        let weights = Weights::new(p)?;
        let mut sums = Sums::default();
        for k in range {
            let Some(frame) = self.planes.frames.frame(k) else { continue };
            let plane = self.planes.time(k);
            let polygon = Polygon::slice(p, plane);
            let mut add = |y: u32, from: u32, to: u32| {
                let start = weights.at(DVec3::new(f64::from(from) + 0.5, f64::from(y) + 0.5, plane));
                sums.add(&frame.row(y)[from as usize..to as usize], start, reference, weights.along_x);
            };
            match self.marks.frame(k) {
                None => polygon.spans(frame.width(), frame.height(), add),
                Some(marks) => polygon.spans(frame.width(), frame.height(), |y, from, to| {
                    marks.unmarked(y, from..to, |run| add(y, run.start, run.end));
                }),
            }
            if self.beside.quarter > 0.0 {
                self.add_quarters(&mut sums, (k, frame), &polygon.enlarged(2.0), &weights, reference);
            }
        }
        sums.finish(tet, reference)
    }

    /// Adds the quarters whose middles lie in a slice (in units of half a pixel), of pixels that are not marked.
    fn add_quarters(
        &self,
        sums: &mut Sums,
        (k, frame): (u32, &Frame),
        polygon: &Polygon,
        weights: &Weights,
        reference: Vec3,
    ) {
        let (plane, along_x) = (self.planes.time(k), 0.5 * weights.along_x);
        let mut add = |row: u32, columns: Range<u32>| {
            let middle = |n: u32| 0.5 * (f64::from(n) + 0.5);
            let first = weights.at(DVec3::new(middle(columns.start), middle(row), plane));
            for (i, column) in columns.enumerate() {
                let phi = first + along_x * i as f32;
                sums.add_one(phi, quarter(frame, column, row) - reference, self.beside.quarter);
            }
        };
        polygon.spans(2 * frame.width(), 2 * frame.height(), |row, from, to| match self.marks.frame(k) {
            None => add(row, from..to),
            Some(marks) => marks.unmarked(row / 2, from / 2..to.div_ceil(2), |run| {
                add(row, (2 * run.start).max(from)..(2 * run.end).min(to));
            }),
        });
    }

    /// Appends the parts of marked pixels that one tet covers.
    fn pieces(&self, tet: u32, corners: [IVec3; 4], pieces: &mut Vec<(u32, Piece)>) {
        let p = corners.map(|c| self.planes.to_px(c));
        let range = self.planes.range(&p);
        if range.is_empty() {
            return;
        }
        let Some(weights) = Weights::new(p) else { return };
        for k in range {
            let (Some(frame), Some(marks)) = (self.planes.frames.frame(k), self.marks.frame(k)) else { continue };
            let plane = self.planes.time(k);
            let polygon = Polygon::slice(p, plane);
            for y in polygon.rows(frame.height()).filter(|&y| marks.any_in_row(y)) {
                let strip = polygon.strip(y);
                marks.marked(y, strip.columns(frame.width()), |x, row| {
                    if let Some((area, centre)) = strip.in_column(x) {
                        let share = weights.at(centre.extend(plane)) * area as f32;
                        pieces.push((row, Piece { tet, share: share.to_array() }));
                    }
                });
            }
        }
    }
}

/// The sums while they grow, four corners to a vector.
#[derive(Default)]
struct Sums {
    pixels: u32,
    weight: f32,
    gram: [Vec4; 4],
    rhs: [Vec4; 3],
    square: f32,
}

impl Sums {
    fn add(&mut self, row: &[[u8; 3]], first: Vec4, reference: Vec3, along_x: Vec4) {
        for (i, &pixel) in row.iter().enumerate() {
            self.add_one(first + along_x * i as f32, color(pixel) - reference, 1.0);
        }
        self.pixels += row.len() as u32;
    }

    #[inline(always)]
    fn add_one(&mut self, phi: Vec4, color: Vec3, weight: f32) {
        let weighted = phi * weight;
        self.gram[0] += weighted * phi.x;
        self.gram[1] += weighted * phi.y;
        self.gram[2] += weighted * phi.z;
        self.gram[3] += weighted * phi.w;
        self.rhs[0] += weighted * color.x;
        self.rhs[1] += weighted * color.y;
        self.rhs[2] += weighted * color.z;
        self.square += weight * color.length_squared();
        self.weight += weight;
    }

    fn finish(self, tet: u32, reference: Vec3) -> Option<Moments> {
        let Self { pixels, weight, gram: g, rhs: [r, gr, b], square } = self;
        (weight > 0.0).then(|| Moments {
            tet,
            pixels,
            weight,
            reference,
            gram: [g[0].x, g[1].y, g[2].z, g[3].w, g[0].y, g[0].z, g[0].w, g[1].z, g[1].w, g[2].w],
            rhs: std::array::from_fn(|i| Vec3::new(r[i], gr[i], b[i])),
            square,
        })
    }
}
