//! What the frames say about each fine tet: moments of its pixels' weights and colours.
//!
//! In: fine tets at their positions, and frames. Out: per tet that covers a pixel, sums from which the squared error,
//! its gradient and its Gauss-Newton matrix follow for any colours, without another look at the pixels.
//! A pixel counts where its centre lies in a slice of the tet, in exactly one tet (half-open spans whose ends are
//! computed from each edge in one direction); inverted tets count nothing, since they are drawn over.

use glam::{DVec2, DVec3, IVec3, Mat3, Vec3, Vec4};

use super::model::Model;
use super::parallel;
use crate::video::Volume;

/// Sums over the pixels of one fine tet. phi are the weights (barycentric coordinates) of a pixel's centre, and
/// colours are taken relative to `reference`, so that sums of squares stay exact enough in f32.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Moments {
    /// Number of the tet among the model's tets.
    pub(super) tet: u32,
    /// Number of pixels; 0 where all sums are.
    pub(super) pixels: u32,
    /// The colour that sums are relative to.
    reference: Vec3,
    /// Sum of phi phi^T: 00, 11, 22, 33, 01, 02, 03, 12, 13, 23.
    gram: [f32; 10],
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

    /// Sum of |frame - model|^2 over pixels and channels, for the corner colours `colors`.
    pub(super) fn energy(&self, colors: [Vec3; 4]) -> f64 {
        let u = colors.map(|c| c - self.reference);
        let w = self.product(u);
        let cross: f32 = (0..4).map(|i| u[i].dot(w[i] - 2.0 * self.rhs[i])).sum();
        f64::from((self.square + cross).max(0.0))
    }
}

/// Fewest fine tets that one worker takes at a time.
const TETS_PER_TASK: usize = 512;

/// The moments of all of the model's tets, in their order. `points` are the model's points (its fine units), `colors`
/// the nodes' colours (only to choose references by). They are written into the memory of `buffer`: it is most of what
/// a fit holds, and the time to be given it anew was a tenth of a fit.
pub(super) fn measure(
    model: &Model,
    points: &[IVec3],
    colors: &[Vec3],
    frames: &Volume,
    mut buffer: Vec<Moments>,
) -> Vec<Moments> {
    let planes = Planes::new(model, frames);
    buffer.resize(model.tets.len(), Moments::default());
    parallel::fill_by(TETS_PER_TASK, &mut buffer, |tet| {
        let nodes = model.tets[tet].map(|n| n as usize);
        let corners = nodes.map(|n| points[model.node_point[n] as usize]);
        let reference = nodes.iter().map(|&n| colors[n]).sum::<Vec3>() * 0.25;
        let empty = Moments { tet: tet as u32, ..Moments::default() };
        planes.moments(tet as u32, corners, reference).unwrap_or(empty)
    });
    buffer
}

/// The gradient of colour inside a tet with corners `p` (fine units) and corner colours `c`: maps a displacement in
/// (x, y, t), in pixels and frames, to a change of colour. Zero for a flat tet.
pub(super) fn color_gradient(p: [IVec3; 4], c: [Vec3; 4], fine_unit: f32) -> Mat3 {
    let [u, v, w] = [p[1] - p[0], p[2] - p[0], p[3] - p[0]].map(|e| e.as_dvec3() / f64::from(fine_unit));
    let volume6 = u.cross(v).dot(w);
    if volume6.abs() < FLAT {
        return Mat3::ZERO;
    }
    let gradients = [v.cross(w), w.cross(u), u.cross(v)].map(|g| (g / volume6).as_vec3());
    let steps = [c[1] - c[0], c[2] - c[0], c[3] - c[0]];
    let column = |axis: usize| (0..3).map(|i| steps[i] * gradients[i][axis]).sum();
    Mat3::from_cols(column(0), column(1), column(2))
}

/// Six times the volume (cubic pixels) below which a tet counts as flat: far below the smallest tet of any lattice
/// that the stream allows, far above the rounding of f64 at coordinates of 8192.
const FLAT: f64 = 1e-7;

/// The slices at which the frames lie.
struct Planes<'a> {
    frames: &'a Volume,
    /// Fine units in a pixel or a frame.
    unit: f64,
    /// The plane of the slab's first frame, in frames: half a lattice unit, as the renderer clamps it.
    first: f64,
    /// The slab's end, in frames.
    end: f64,
}

impl<'a> Planes<'a> {
    fn new(model: &Model, frames: &'a Volume) -> Self {
        let half_lattice_unit = 0.5 / f64::from(model.domain.unit());
        let end = f64::from(model.domain.duration);
        Self { frames, unit: f64::from(model.fine_unit), first: half_lattice_unit, end }
    }

    fn moments(&self, tet: u32, corners: [IVec3; 4], reference: Vec3) -> Option<Moments> {
        let p = corners.map(|c| c.as_dvec3() / self.unit);
        let low = p.iter().map(|p| p.z).fold(f64::INFINITY, f64::min);
        let high = p.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
        let first = if low < self.first { 0.0 } else { low.ceil() };
        let last = high.floor().min(self.end);
        let range = (first as u32).max(self.frames.first())..(last as u32 + 1).min(self.frames.end());
        if range.is_empty() || high < self.first {
            return None;
        }
        let weights = Weights::new(p)?;
        let mut sums = Sums::default();
        for k in range {
            let plane = f64::from(k).max(self.first);
            if let Some(frame) = self.frames.frame(k) {
                let polygon = Polygon::slice(p, plane);
                polygon.spans(frame.width(), frame.height(), |y, from, to| {
                    let row = &frame.row(y)[from as usize..to as usize];
                    sums.add(
                        row,
                        weights.at(DVec3::new(f64::from(from) + 0.5, f64::from(y) + 0.5, plane)),
                        reference,
                        weights.along_x,
                    );
                });
            }
        }
        sums.finish(tet, reference)
    }
}

/// The four barycentric coordinates as affine functions of (x, y, t).
struct Weights {
    origin: DVec3,
    gradient: [DVec3; 3],
    along_x: Vec4,
}

impl Weights {
    /// None for a flat or inverted tet.
    fn new(p: [DVec3; 4]) -> Option<Self> {
        let (u, v, w) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
        let volume6 = u.cross(v).dot(w);
        if volume6 < FLAT {
            return None;
        }
        let gradient = [v.cross(w), w.cross(u), u.cross(v)].map(|g| g / volume6);
        let [b, c, d] = gradient.map(|g| g.x as f32);
        Some(Self { origin: p[0], gradient, along_x: Vec4::new(-b - c - d, b, c, d) })
    }

    fn at(&self, x: DVec3) -> Vec4 {
        let [b, c, d] = self.gradient.map(|g| g.dot(x - self.origin) as f32);
        Vec4::new(1.0 - b - c - d, b, c, d)
    }
}

/// A slice of a tet: a convex polygon of three or four corners, or nothing.
struct Polygon {
    corners: [DVec2; 4],
    len: usize,
}

impl Polygon {
    /// Slices at time `t`; a corner is above when its time is >= t.
    fn slice(p: [DVec3; 4], t: f64) -> Self {
        let mut order = [0usize; 4];
        let (mut below, mut above) = (0, 4);
        for (i, p) in p.iter().enumerate() {
            if p.z >= t {
                above -= 1;
                order[above] = i;
            } else {
                order[below] = i;
                below += 1;
            }
        }
        let cut = |b: usize, a: usize| {
            let (b, a) = (p[order[b]], p[order[a]]);
            let s = (t - b.z) / (a.z - b.z);
            b.truncate() + (a.truncate() - b.truncate()) * s
        };
        match below {
            1 => Self { corners: [cut(0, 1), cut(0, 2), cut(0, 3), DVec2::ZERO], len: 3 },
            2 => Self { corners: [cut(0, 2), cut(0, 3), cut(1, 3), cut(1, 2)], len: 4 },
            3 => Self { corners: [cut(0, 3), cut(1, 3), cut(2, 3), DVec2::ZERO], len: 3 },
            _ => Self { corners: [DVec2::ZERO; 4], len: 0 },
        }
    }

    /// Calls `span(y, from, to)` for every row of pixels whose centres the polygon holds.
    fn spans(&self, width: u32, height: u32, mut span: impl FnMut(u32, u32, u32)) {
        let corners = &self.corners[..self.len];
        let low = corners.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
        let rows = first_centre(low, height)..first_centre(high, height);
        if rows.is_empty() {
            return;
        }
        let mut edges = [Edge::default(); 4];
        for (n, edge) in edges[..self.len].iter_mut().enumerate() {
            *edge = Edge::new(corners[n], corners[(n + 1) % self.len]);
        }
        for y in rows {
            let centre = f64::from(y) + 0.5;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for edge in &edges[..self.len] {
                if let Some(x) = edge.crossing(centre) {
                    left = left.min(x);
                    right = right.max(x);
                }
            }
            let (from, to) = (first_centre(left, width), first_centre(right, width));
            if from < to {
                span(y, from, to);
            }
        }
    }
}

/// An edge of a slice, from its upper end down: all who share it compute the same crossings.
#[derive(Debug, Clone, Copy, Default)]
struct Edge {
    start: DVec2,
    end: f64,
    slope: f64,
}

impl Edge {
    fn new(p: DVec2, q: DVec2) -> Self {
        let (p, q) = if (p.y, p.x) <= (q.y, q.x) { (p, q) } else { (q, p) };
        // Without a height it crosses no line, whatever the slope.
        Self { start: p, end: q.y, slope: (q.x - p.x) / (q.y - p.y) }
    }

    /// Where the line of height `y` crosses it; ends count above, not below.
    #[inline]
    fn crossing(&self, y: f64) -> Option<f64> {
        (self.start.y <= y && y < self.end).then_some(self.start.x + (y - self.start.y) * self.slope)
    }
}

/// The first pixel of 0..len whose centre is at or beyond `x`; len if none. (NaN and infinities give an end.)
#[inline]
fn first_centre(x: f64, len: u32) -> u32 {
    // Clamped before it is rounded up by hand: a call of `ceil` costs more than the rest.
    let shifted = (x - 0.5).clamp(0.0, f64::from(len));
    let whole = shifted as u32;
    whole + u32::from(f64::from(whole) < shifted)
}

/// The sums while they grow, four corners to a vector.
#[derive(Default)]
struct Sums {
    pixels: u32,
    gram: [Vec4; 4],
    rhs: [Vec4; 3],
    square: f32,
}

impl Sums {
    fn add(&mut self, row: &[[u8; 3]], first: Vec4, reference: Vec3, along_x: Vec4) {
        for (i, &[r, g, b]) in row.iter().enumerate() {
            let phi = first + along_x * i as f32;
            let color = Vec3::new(f32::from(r), f32::from(g), f32::from(b)) - reference;
            self.gram[0] += phi * phi.x;
            self.gram[1] += phi * phi.y;
            self.gram[2] += phi * phi.z;
            self.gram[3] += phi * phi.w;
            self.rhs[0] += phi * color.x;
            self.rhs[1] += phi * color.y;
            self.rhs[2] += phi * color.z;
            self.square += color.length_squared();
        }
        self.pixels += row.len() as u32;
    }

    fn finish(self, tet: u32, reference: Vec3) -> Option<Moments> {
        let Self { pixels, gram: g, rhs: [r, gr, b], square } = self;
        (pixels > 0).then(|| Moments {
            tet,
            pixels,
            reference,
            gram: [g[0].x, g[1].y, g[2].z, g[3].w, g[0].y, g[0].z, g[0].w, g[1].z, g[1].w, g[2].w],
            rhs: std::array::from_fn(|i| Vec3::new(r[i], gr[i], b[i])),
            square,
        })
    }
}
