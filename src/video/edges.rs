//! Where between two pixels of different labels their edge lies.
//!
//! In: a frame, its labels and their pure colours. Out: how far from one pixel to the next an edge is. Forbidden here:
//! time.
//!
//! A pixel at an edge is the mean of what covers it, so its colour says how much of it its own label has. A straight edge
//! that leaves it as much, in the direction in which these parts fall, is where the edge is (piecewise linear interface
//! calculation: Youngs 1982; the offset for a part: Scardovelli and Zaleski 2000).

use std::sync::Arc;

use glam::{Vec2, Vec3};

use super::{Frame, Label, LabelPlane};

/// Least squared difference of pure colours, in squared levels over the channels, that tells how much of each a pixel has.
const LEAST_JUMP: f32 = 200.0;
/// From this part on a pixel is its label's alone: noise and rounding must not place edges.
const WHOLE: f32 = 0.97;
/// Closest to a pixel's centre that an edge is put, of the way to the next pixel.
const MARGIN: f32 = 0.05;
/// Squared length of the parts' gradient below which a pixel has no side that its label is on: a thin stroke's.
const FLAT: f32 = 0.02;
/// Least cosine between an edge's normal and the way to the next pixel that is to meet it.
const LEAST_COSINE: f32 = 0.3;

/// The edges between labels in one frame.
#[derive(Debug, Clone)]
pub struct Edges {
    labels: LabelPlane,
    pure: Arc<Frame>,
    /// Which part of each pixel its own label has, 0 to 1.
    parts: Vec<f32>,
}

impl Edges {
    /// The edges of a frame, if the pure colours of its labels are known.
    pub fn new(frame: &Frame, labels: &LabelPlane) -> Option<Self> {
        let pure = labels.pure_colors()?.clone();
        let mut edges = Self { labels: labels.clone(), pure, parts: Vec::new() };
        let pixels = (0..frame.height()).flat_map(|y| (0..frame.width()).map(move |x| [x, y]));
        edges.parts = pixels.map(|p| edges.part_of(frame, p)).collect();
        Some(edges)
    }

    /// How far from pixel `p` to its neighbour `q`, which has another label, their edge is: between 0 and 1. Halfway where
    /// colours do not say.
    pub fn share(&self, p: [u32; 2], q: [u32; 2]) -> f32 {
        let [of_p, of_q] = [p, q].map(|at| self.part(at));
        let from_p = || self.along(p, q);
        let from_q = || self.along(q, p).map(|share| 1.0 - share);
        // The pixel that is nearer to half has the edge.
        let share = if of_p <= of_q { from_p().or_else(from_q) } else { from_q().or_else(from_p) };
        share.unwrap_or(0.5).clamp(MARGIN, 1.0 - MARGIN)
    }

    /// How far pixel `p`, of another label, is from the edge of `label`, in pixels; at least a pixel counts as one.
    pub fn distance(&self, [x, y]: [u32; 2], label: Label) -> f32 {
        let (last_x, last_y) = (self.labels.width() - 1, self.labels.height() - 1);
        let rows = y.saturating_sub(1)..=(y + 1).min(last_y);
        let around = rows.flat_map(|v| (x.saturating_sub(1)..=(x + 1).min(last_x)).map(move |u| [u, v]));
        let beside = around.filter(|&[u, v]| self.labels.label(u, v) == label);
        let distance = |q: [u32; 2]| {
            let length = (q[0].abs_diff(x) as f32).hypot(q[1].abs_diff(y) as f32);
            self.share([x, y], q) * length
        };
        beside.map(distance).fold(1.0, f32::min)
    }

    fn part(&self, [x, y]: [u32; 2]) -> f32 {
        self.parts[(y * self.labels.width() + x) as usize]
    }

    /// How far towards `q` the edge lies that leaves pixel `p` its part.
    fn along(&self, p: [u32; 2], q: [u32; 2]) -> Option<f32> {
        let part = self.part(p);
        if part >= WHOLE {
            return None;
        }
        let way = Vec2::new(q[0] as f32 - p[0] as f32, q[1] as f32 - p[1] as f32);
        let slope = self.slope(p);
        if slope.length_squared() < FLAT {
            return Some(0.5 * part);
        }
        let normal = slope.normalize();
        let cosine = normal.dot(way) / way.length();
        (cosine > LEAST_COSINE).then(|| offset(normal, part) / normal.dot(way))
    }

    /// How fast the part of `p`'s label falls around it, in which direction.
    fn slope(&self, [x, y]: [u32; 2]) -> Vec2 {
        let own = self.labels.label(x, y);
        let at = |dx: i32, dy: i32| {
            let u = x.saturating_add_signed(dx).min(self.labels.width() - 1);
            let v = y.saturating_add_signed(dy).min(self.labels.height() - 1);
            let part = self.part([u, v]);
            if self.labels.label(u, v) == own { part } else { 1.0 - part }
        };
        let side = |d: [[i32; 2]; 3]| at(d[0][0], d[0][1]) + 2.0 * at(d[1][0], d[1][1]) + at(d[2][0], d[2][1]);
        let left = side([[-1, -1], [-1, 0], [-1, 1]]);
        let right = side([[1, -1], [1, 0], [1, 1]]);
        let above = side([[-1, -1], [0, -1], [1, -1]]);
        let below = side([[-1, 1], [0, 1], [1, 1]]);
        Vec2::new(left - right, above - below) / 4.0
    }

    /// The part of a pixel that its own label has: the rest is of that label beside it with which they blend best.
    fn part_of(&self, frame: &Frame, [x, y]: [u32; 2]) -> f32 {
        let own = self.labels.label(x, y);
        let color = |frame: &Frame, x: u32, y: u32| Vec3::from_array(frame.pixel(x, y).map(f32::from));
        let (here, first) = (color(frame, x, y), color(&self.pure, x, y));
        let mut best: Option<(f32, f32)> = None;
        for v in y.saturating_sub(1)..=(y + 1).min(frame.height() - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(frame.width() - 1) {
                if self.labels.label(u, v) == own {
                    continue;
                }
                let second = color(&self.pure, u, v);
                let jump = first - second;
                if jump.length_squared() < LEAST_JUMP {
                    continue;
                }
                let part = ((here - second).dot(jump) / jump.length_squared()).clamp(0.0, 1.0);
                let error = here.distance_squared(second.lerp(first, part));
                if best.is_none_or(|(least, _)| error < least) {
                    best = Some((error, part));
                }
            }
        }
        best.map_or(1.0, |(_, part)| part)
    }
}

/// How far from a pixel's centre, along the unit normal that points out of it, the straight edge lies that leaves `part` of
/// the pixel inside.
fn offset(normal: Vec2, part: f32) -> f32 {
    let (a, b) = (normal.x.abs().max(normal.y.abs()), normal.x.abs().min(normal.y.abs()));
    // By symmetry half of the pixel is at 0; what is cut off is at most the other half.
    let (cut, sign) = if part > 0.5 { (1.0 - part, 1.0) } else { (part, -1.0) };
    // A corner is cut off as long as the edge meets the two sides next to it, then a trapezium.
    let corner = b / (2.0 * a);
    let depth = if cut <= corner { (2.0 * a * b * cut).sqrt() } else { a * cut + 0.5 * b };
    sign * (0.5 * (a + b) - depth)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The part of the unit square around the origin where normal . p <= distance, by sampling.
    fn coverage(normal: Vec2, distance: f32) -> f32 {
        const N: usize = 200;
        let at = |n: usize| (n as f32 + 0.5) / N as f32 - 0.5;
        let inside = |n: &usize| normal.dot(Vec2::new(at(n % N), at(n / N))) <= distance;
        (0..N * N).filter(inside).count() as f32 / (N * N) as f32
    }

    #[test]
    fn offsets_leave_their_part() {
        for angle in [0.0f32, 0.2, 0.6, 0.785, 1.3, 2.0, 3.9, 5.5] {
            let normal = Vec2::from_angle(angle);
            for part in [0.05, 0.2, 0.5, 0.7, 0.95] {
                let found = coverage(normal, offset(normal, part));
                assert!((found - part).abs() < 0.01, "{angle}, {part}: {found}");
            }
        }
    }

    #[test]
    fn straight_edges_are_found_at_any_angle() {
        let centre = Vec2::new(20.3, 20.6);
        for angle in [0.0f32, 0.15, 0.4, 0.785, 1.2, 1.57, 2.5, 4.0] {
            let normal = Vec2::from_angle(angle);
            let part = |x: u32, y: u32| {
                let p = Vec2::new(x as f32 + 0.5, y as f32 + 0.5);
                coverage(normal, normal.dot(centre - p))
            };
            let level = |x: u32, y: u32| (40.0 + 160.0 * part(x, y)).round() as u8;
            let frame = Frame::from_fn(40, 40, |x, y| [level(x, y); 3]).expect("size");
            let label = |n: u32| Label(u32::from(part(n % 40, n / 40) >= 0.5));
            let labels = LabelPlane::new(40, 40, (0..1600).map(label).collect());
            let pure = Frame::from_fn(40, 40, |x, y| [[40, 200][usize::from(part(x, y) >= 0.5)]; 3]).expect("size");
            let edges = Edges::new(&frame, &labels.clone().with_pure_colors(pure)).expect("colours");
            let mut worst = 0.0f32;
            for y in 10..30 {
                for x in 10..30 {
                    for q in [[x + 1, y], [x, y + 1]] {
                        if labels.label(x, y) == labels.label(q[0], q[1]) {
                            continue;
                        }
                        let at = |p: [u32; 2]| normal.dot(Vec2::new(p[0] as f32 + 0.5, p[1] as f32 + 0.5) - centre);
                        let (here, there) = (at([x, y]), at(q));
                        let share = edges.share([x, y], q);
                        worst = worst.max((here + (there - here) * share).abs());
                    }
                }
            }
            assert!(worst < 0.06, "{angle}: {worst} px off");
        }
    }
}
