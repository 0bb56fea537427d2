//! How much of a pixel a triangle covers, exactly: the area of their common part, and its centroid.
//!
//! Places are in pixels from a pixel's centre, so a pixel is the square [-1/2, 1/2]^2 of area 1.

use glam::DVec2;

use super::scan::{GridPoint, center_offset};

/// What lies on the inner side of a line.
#[derive(Debug, Clone, Copy)]
struct HalfPlane {
    /// Points inwards; |x| + |y| = 1, so that a pixel is cut if the line's value at its centre lies within +-1/2.
    normal: DVec2,
    /// Value at the centre of the first pixel.
    first: f64,
}

/// A part of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// In (0, 1].
    pub(super) area: f64,
    /// From the pixel's centre.
    pub(super) centroid: DVec2,
}

/// A triangle that covers pixels.
pub(super) struct Coverage {
    sides: [HalfPlane; 3],
    /// Column and row of the pixel that values are counted from.
    origin: [i32; 2],
}

impl Coverage {
    /// Of a positive triangle. Near `origin` (column, row) values are most exact.
    pub(super) fn new(corners: [GridPoint; 3], origin: [i32; 2]) -> Self {
        let places = corners.map(|corner| center_offset(corner, origin));
        let sides = [0, 1, 2].map(|i| {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let (dx, dy) = ((to.x - from.x) as f64, (to.y - from.y) as f64);
            let normal = DVec2::new(-dy, dx) / (dx.abs() + dy.abs());
            HalfPlane { normal, first: -normal.dot(places[i]) }
        });
        Self { sides, origin }
    }

    /// The part of a pixel that is covered.
    #[inline]
    pub(super) fn of(&self, column: i32, row: i32) -> Option<Part> {
        let step = DVec2::new(f64::from(column - self.origin[0]), f64::from(row - self.origin[1]));
        let values = self.sides.map(|side| side.first + side.normal.dot(step));
        let [a, b, c] = values;
        if a.min(b).min(c) <= -0.5 {
            return None;
        }
        match values.map(|value| value < 0.5) {
            [false, false, false] => Some(Part { area: 1.0, centroid: DVec2::ZERO }),
            [true, false, false] => cut_once(self.sides[0].normal, a),
            [false, true, false] => cut_once(self.sides[1].normal, b),
            [false, false, true] => cut_once(self.sides[2].normal, c),
            cuts => {
                let mut polygon = Polygon::PIXEL;
                for i in (0..3).filter(|&i| cuts[i]) {
                    polygon.clip(self.sides[i].normal, values[i]);
                }
                polygon.part()
            }
        }
    }
}

/// The part of a pixel where normal . place + value >= 0, for |value| < 1/2: a trapezium, or a corner is cut off.
#[inline]
fn cut_once(normal: DVec2, value: f64) -> Option<Part> {
    // By mirroring: the normal points away from the corner (1/2, 1/2), along x more than along y.
    let steep = normal.x.abs() >= normal.y.abs();
    let (a, b) = if steep { (normal.x.abs(), normal.y.abs()) } else { (normal.y.abs(), normal.x.abs()) };
    let corner = |height: f64| {
        let legs = DVec2::new(height / a, height / b);
        (0.5 * legs.x * legs.y, DVec2::splat(0.5) - legs / 3.0)
    };
    let (area, moment) = if value.abs() <= 0.5 * (a - b) {
        let (middle, slope) = (value / a, b / a);
        (0.5 + middle, DVec2::new(0.5 * (middle * middle + slope * slope / 12.0 - 0.25), -slope / 12.0))
    } else if value > 0.0 {
        let (missing, centroid) = corner(0.5 - value);
        (1.0 - missing, -missing * centroid)
    } else {
        let (area, centroid) = corner(0.5 + value);
        (area, -area * centroid)
    };
    let centroid = if steep { moment } else { DVec2::new(moment.y, moment.x) } / area;
    let mirror = |v: f64, normal: f64| if normal > 0.0 { -v } else { v };
    (area > 0.0)
        .then(|| Part { area, centroid: DVec2::new(mirror(centroid.x, normal.x), mirror(centroid.y, normal.y)) })
}

/// A convex polygon of up to seven corners: a pixel after three cuts.
struct Polygon {
    corners: [DVec2; 7],
    count: usize,
}

impl Polygon {
    const PIXEL: Self = {
        let mut corners = [DVec2::ZERO; 7];
        corners[0] = DVec2::new(-0.5, -0.5);
        corners[1] = DVec2::new(0.5, -0.5);
        corners[2] = DVec2::new(0.5, 0.5);
        corners[3] = DVec2::new(-0.5, 0.5);
        Self { corners, count: 4 }
    };

    /// Keeps what lies where normal . place + value >= 0.
    fn clip(&mut self, normal: DVec2, value: f64) {
        let mut kept = Self { corners: [DVec2::ZERO; 7], count: 0 };
        let height = |place: DVec2| normal.dot(place) + value;
        for i in 0..self.count {
            let (from, to) = (self.corners[i], self.corners[(i + 1) % self.count]);
            let (low, high) = (height(from), height(to));
            if low >= 0.0 {
                kept.push(from);
            }
            if (low >= 0.0) != (high >= 0.0) {
                kept.push(from + (to - from) * (low / (low - high)));
            }
        }
        *self = kept;
    }

    fn push(&mut self, corner: DVec2) {
        // Rounding may bend a sliver so that it is cut more often than a convex polygon can be.
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count += 1;
        }
    }

    fn part(&self) -> Option<Part> {
        let (mut area, mut moment) = (0.0, DVec2::ZERO);
        let first = self.corners[0];
        for pair in self.corners[..self.count].windows(2).skip(1) {
            let (u, v) = (pair[0] - first, pair[1] - first);
            let half = 0.5 * u.perp_dot(v);
            area += half;
            moment += (u + v) * (half / 3.0);
        }
        (area > 0.0).then(|| Part { area, centroid: first + moment / area })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::scan::{GRID_BITS, is_positive};

    fn triangle(corners: [[f64; 2]; 3]) -> [GridPoint; 3] {
        let grid = |v: f64| (v * f64::from(1 << GRID_BITS)) as i64;
        corners.map(|[x, y]| GridPoint { x: grid(x), y: grid(y) })
    }

    fn assert_near(found: Option<Part>, area: f64, centroid: [f64; 2]) {
        let found = found.expect("a part");
        let off = (found.centroid - DVec2::from_array(centroid)).length();
        assert!((found.area - area).abs() < 1e-6 && off < 1e-5, "{found:?} against {area}, {centroid:?}");
    }

    /// One cut by formula is what clipping gives, all around and at every height.
    #[test]
    fn formula_and_clipping_agree() {
        for i in 0..360 {
            let direction = DVec2::from_angle(f64::from(i).to_radians());
            let normal = direction / (direction.x.abs() + direction.y.abs());
            for value in (-49..=49).map(|n| f64::from(n) / 100.0) {
                let mut polygon = Polygon::PIXEL;
                polygon.clip(normal, value);
                let expected = polygon.part().expect("a part");
                assert_near(cut_once(normal, value), expected.area, expected.centroid.to_array());
            }
        }
    }

    #[test]
    fn parts_of_pixels_around_a_triangle() {
        let coverage = Coverage::new(triangle([[1.0, 1.0], [5.0, 1.0], [1.0, 5.0]]), [0, 0]);
        assert_near(coverage.of(1, 1), 1.0, [0.0, 0.0]);
        assert_near(coverage.of(3, 2), 0.5, [-1.0 / 6.0, -1.0 / 6.0]);
        assert_eq!([coverage.of(0, 2), coverage.of(4, 4), coverage.of(2, 5)], [None; 3]);
        let tip = Coverage::new(triangle([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75]]), [7, 3]);
        assert_near(tip.of(0, 0), 0.125, [-1.0 / 12.0, -1.0 / 12.0]);
    }

    /// Whatever the triangle, its parts add up to its area and its centroid.
    #[test]
    fn parts_add_up() {
        for n in 0..200 {
            let at = |i: i32| [f64::from(n * i * 37 % 101) / 12.0, f64::from(n * i * 53 % 97) / 11.0];
            let mut corners = triangle([at(1), at(2), at(5)]);
            if !is_positive(corners) {
                corners.swap(1, 2);
            }
            if !is_positive(corners) {
                continue;
            }
            let coverage = Coverage::new(corners, [4, 4]);
            let (mut area, mut moment) = (0.0, DVec2::ZERO);
            for (column, row) in (0..10).flat_map(|row| (0..10).map(move |column| (column, row))) {
                if let Some(part) = coverage.of(column, row) {
                    area += part.area;
                    moment += part.area * (part.centroid + DVec2::new(column.into(), row.into()) + 0.5);
                }
            }
            let [a, b, c] = corners.map(|corner| DVec2::from_array(corner.to_px()));
            let expected = (b - a).perp_dot(c - a) / 2.0;
            assert!((area - expected).abs() < 1e-9, "triangle {n}: {area} against {expected}");
            assert!((moment - (a + b + c) / 3.0 * expected).length() < 1e-8, "triangle {n}");
        }
    }
}
