//! Cross-sections of tets with the plane of a frame, and which pixels they hold.
//!
//! In: a tet's corners, a time. Out: a convex polygon; the pixels whose centres it holds, or the part of a pixel's
//! square that it covers. Forbidden here: colours.

use std::ops::Range;

use glam::{DVec2, DVec3, Vec4};

/// Six times the volume (cubic pixels) below which a tet counts as flat: far below the smallest tet of any lattice
/// that the stream allows, far above the rounding of f64 at coordinates of 8192.
pub(super) const FLAT: f64 = 1e-7;

/// The four barycentric coordinates as affine functions of (x, y, t).
pub(super) struct Weights {
    origin: DVec3,
    gradient: [DVec3; 3],
    pub(super) along_x: Vec4,
}

impl Weights {
    /// None for a flat or inverted tet.
    pub(super) fn new(p: [DVec3; 4]) -> Option<Self> {
        let (u, v, w) = (p[1] - p[0], p[2] - p[0], p[3] - p[0]);
        let volume6 = u.cross(v).dot(w);
        if volume6 < FLAT {
            return None;
        }
        let gradient = [v.cross(w), w.cross(u), u.cross(v)].map(|g| g / volume6);
        let [b, c, d] = gradient.map(|g| g.x as f32);
        Some(Self { origin: p[0], gradient, along_x: Vec4::new(-b - c - d, b, c, d) })
    }

    pub(super) fn at(&self, x: DVec3) -> Vec4 {
        let [b, c, d] = self.gradient.map(|g| g.dot(x - self.origin) as f32);
        Vec4::new(1.0 - b - c - d, b, c, d)
    }
}

/// A slice of a tet: a convex polygon of three or four corners, or nothing.
pub(super) struct Polygon {
    corners: [DVec2; 4],
    len: usize,
}

impl Polygon {
    /// Slices at time `t`; a corner is above when its time is >= t.
    pub(super) fn slice(p: [DVec3; 4], t: f64) -> Self {
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

    /// The same, `scale` times as large.
    pub(super) fn enlarged(&self, scale: f64) -> Self {
        Self { corners: self.corners.map(|corner| corner * scale), len: self.len }
    }

    /// Rows of pixels that it touches.
    pub(super) fn rows(&self, height: u32) -> Range<u32> {
        touched(bounds(&self.corners[..self.len], 1), height)
    }

    /// The part of it in a row of pixels.
    pub(super) fn strip(&self, row: u32) -> Clipped {
        let mut clipped = Clipped { corners: [DVec2::ZERO; CLIPPED], len: self.len };
        clipped.corners[..self.len].copy_from_slice(&self.corners[..self.len]);
        clipped.cut(1, f64::from(row), 1.0);
        clipped.cut(1, f64::from(row) + 1.0, -1.0);
        clipped
    }

    /// Calls `span(y, from, to)` for every row of pixels whose centres the polygon holds.
    pub(super) fn spans(&self, width: u32, height: u32, mut span: impl FnMut(u32, u32, u32)) {
        let corners = &self.corners[..self.len];
        let (low, high) = bounds(corners, 1);
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

/// The least and the greatest coordinate along an axis; infinities turned round where there are no corners.
#[inline]
fn bounds(corners: &[DVec2], axis: usize) -> (f64, f64) {
    let along = corners.iter().map(|p| p[axis]);
    along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// The pixels of 0..len that bounds touch.
#[inline]
fn touched((low, high): (f64, f64), len: u32) -> Range<u32> {
    low.clamp(0.0, f64::from(len)) as u32..high.ceil().clamp(0.0, f64::from(len)) as u32
}

/// Most corners of a quad after a cut at each side of a square.
const CLIPPED: usize = 8;

/// A convex polygon that has been cut.
#[derive(Debug, Clone, Copy)]
pub(super) struct Clipped {
    corners: [DVec2; CLIPPED],
    len: usize,
}

impl Clipped {
    /// Columns of pixels that it touches.
    pub(super) fn columns(&self, width: u32) -> Range<u32> {
        touched(bounds(&self.corners[..self.len], 0), width)
    }

    /// Area and centroid of the part of it in a column of pixels; none if there is no area.
    pub(super) fn in_column(mut self, column: u32) -> Option<(f64, DVec2)> {
        self.cut(0, f64::from(column), 1.0);
        self.cut(0, f64::from(column) + 1.0, -1.0);
        self.area()
    }

    /// Leaves the side of the line `axis` = `at` on which `side` * (coordinate - at) >= 0 (Sutherland and Hodgman,
    /// "Reentrant polygon clipping", 1974).
    fn cut(&mut self, axis: usize, at: f64, side: f64) {
        let whole = *self;
        self.len = 0;
        for n in 0..whole.len {
            let (p, q) = (whole.corners[n], whole.corners[(n + 1) % whole.len]);
            let (from, to) = (side * (p[axis] - at), side * (q[axis] - at));
            if from >= 0.0 {
                self.push(p);
            }
            if (from >= 0.0) != (to >= 0.0) {
                let mut crossing = p + (q - p) * (from / (from - to));
                crossing[axis] = at;
                self.push(crossing);
            }
        }
    }

    fn push(&mut self, corner: DVec2) {
        if let Some(slot) = self.corners.get_mut(self.len) {
            *slot = corner;
            self.len += 1;
        }
    }

    fn area(&self) -> Option<(f64, DVec2)> {
        let origin = self.corners[0];
        let (mut area2, mut moment) = (0.0, DVec2::ZERO);
        for n in 2..self.len {
            let (p, q) = (self.corners[n - 1] - origin, self.corners[n] - origin);
            let part = p.perp_dot(q);
            area2 += part;
            moment += (p + q) * part;
        }
        let area = 0.5 * area2.abs();
        (area > LEAST_AREA).then(|| (area, origin + moment / (3.0 * area2)))
    }
}

/// Parts of a pixel smaller than this are nothing to be seen, and their centroids not to be trusted.
const LEAST_AREA: f64 = 1e-9;
