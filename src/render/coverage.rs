//! How much of a pixel a convex polygon covers, exactly: the area of their common part, and its moment.
//!
//! Places are in pixels from a pixel's centre, so a pixel is the square [-1/2, 1/2]^2 of area 1. A side of the polygon
//! cuts the pixel if its value at the centre lies within +-(|x| + |y|) / 2 of its normal. Pixels cut once or twice, nearly
//! all, have formulas of their own: this runs for each polygon at each pixel on a boundary. For the same reason normals
//! are of any length, which saves divisions.

use glam::DVec2;

use super::grid::{GridPoint, center_offset};

/// Corners of a pixel in the polygon's sense of turning; corner i ends side i, and side 0 is the upper one.
const CORNERS: [DVec2; 4] =
    [DVec2::new(0.5, -0.5), DVec2::new(0.5, 0.5), DVec2::new(-0.5, 0.5), DVec2::new(-0.5, -0.5)];

/// A part of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Part {
    /// In [0, 1].
    pub(super) area: f64,
    /// The integral of places: the centroid times the area.
    pub(super) moment: DVec2,
}

impl Part {
    const NOTHING: Self = Self { area: 0.0, moment: DVec2::ZERO };
    const PIXEL: Self = Self { area: 1.0, moment: DVec2::ZERO };

    /// Of a polygon around (or from) `hub`, whose other corners are `ends[0]`, `between`, `ends[1]`, as seen from it.
    #[inline]
    fn fan(hub: DVec2, ends: [DVec2; 2], between: impl Iterator<Item = DVec2>) -> Self {
        let (mut area, mut moment) = (0.0, DVec2::ZERO);
        let mut last = ends[0];
        for next in between.chain([ends[1]]) {
            let double = last.perp_dot(next);
            area += double;
            moment += (last + next) * double;
            last = next;
        }
        Self { area: 0.5 * area, moment: hub * (0.5 * area) + moment / 6.0 }
    }
}

/// What lies where normal . place + value >= 0.
#[derive(Debug, Clone, Copy)]
struct HalfPlane {
    /// Points inwards; not 0.
    normal: DVec2,
    /// Value at a pixel's centre.
    value: f64,
    /// Half of |x| + |y|: how far values within the pixel differ from that at its centre.
    reach: f64,
}

impl HalfPlane {
    #[inline]
    fn new(normal: DVec2, value: f64) -> Self {
        Self { normal, value, reach: 0.5 * (normal.x.abs() + normal.y.abs()) }
    }

    /// Its share of a pixel that it cuts: a trapezium, or all but a corner, or a corner.
    #[inline]
    fn part(&self) -> Part {
        // By mirroring: the normal points away from the corner (1/2, 1/2), along x more than along y.
        let (x, y) = (self.normal.x.abs(), self.normal.y.abs());
        let steep = x >= y;
        let (a, b) = if steep { (x, y) } else { (y, x) };
        let (area, along, across) = if self.value.abs() <= 0.5 * (a - b) {
            let scale = 1.0 / a;
            let (middle, slope) = (self.value * scale, b * scale);
            (0.5 + middle, 0.5 * (middle * middle + slope * slope / 12.0 - 0.25), -slope / 12.0)
        } else {
            let height = self.reach - self.value.abs();
            let scale = height / (a * b);
            let corner = 0.5 * height * scale;
            let (along, across) = (-corner * (0.5 - scale * b / 3.0), -corner * (0.5 - scale * a / 3.0));
            // The moment of what is missing is that of its mirror image.
            (if self.value > 0.0 { 1.0 - corner } else { corner }, along, across)
        };
        let (mx, my) = if steep { (along, across) } else { (across, along) };
        Part { area, moment: DVec2::new(-mx.copysign(mx * self.normal.x), -my.copysign(my * self.normal.y)) }
    }

    /// Whether a line through the pixel holds a point of another one's border: that on the diagonal towards its normal,
    /// which is in the pixel whatever the slope.
    #[inline]
    fn holds_border_of(&self, other: &Self) -> bool {
        let across = self.normal.x.copysign(self.normal.x * other.normal.x)
            + self.normal.y.copysign(self.normal.y * other.normal.y);
        2.0 * other.reach * self.value >= across * other.value
    }
}

/// A convex polygon that covers pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Coverage {
    /// Side i leads from corner i to the next; seen from `origin`, as the corners are.
    sides: [HalfPlane; 4],
    corners: [DVec2; 4],
    count: usize,
    /// Column and row of the pixel that all is seen from.
    origin: [i32; 2],
}

impl Coverage {
    /// Of a convex polygon of 3 or 4 corners that turns from +x to +y. Near `origin` (column, row) it is most exact.
    #[inline]
    pub(super) fn new(corners: &[GridPoint], origin: [i32; 2]) -> Self {
        let count = corners.len();
        let mut coverage = Self { sides: [HalfPlane::new(DVec2::X, 1.0); 4], corners: [DVec2::ZERO; 4], count, origin };
        for (i, &from) in corners.iter().enumerate() {
            let to = corners[if i + 1 == count { 0 } else { i + 1 }];
            let (dx, dy) = ((to.x - from.x) as f64, (to.y - from.y) as f64);
            let (place, normal) = (center_offset(from, origin), DVec2::new(-dy, dx));
            coverage.corners[i] = place;
            coverage.sides[i] = HalfPlane::new(normal, -normal.dot(place));
        }
        coverage
    }

    /// The part of a pixel (column, row) that is covered.
    #[inline]
    pub(super) fn of(&self, [column, row]: [i32; 2]) -> Part {
        let step = DVec2::new(f64::from(column - self.origin[0]), f64::from(row - self.origin[1]));
        let mut cutting = [0; 4];
        let mut cuts = 0;
        let mut sides = self.sides;
        for (i, side) in sides[..self.count].iter_mut().enumerate() {
            side.value += side.normal.dot(step);
            if side.value <= -side.reach {
                // A side without length says nothing.
                if side.reach > 0.0 {
                    return Part::NOTHING;
                }
            } else if side.value < side.reach {
                cutting[cuts] = i;
                cuts += 1;
            }
        }
        match cutting[..cuts] {
            [] => Part::PIXEL,
            [one] => sides[one].part(),
            [one, next] if next == one + 1 => cut_twice(&sides[one], &sides[next], self.corners[next] - step),
            [first, last] if first == 0 && last + 1 == self.count => {
                cut_twice(&sides[last], &sides[first], self.corners[0] - step)
            }
            _ => cut(cutting[..cuts].iter().map(|&i| sides[i])),
        }
    }
}

/// The part of a pixel between two sides that cut it and meet in `corner`.
#[inline]
fn cut_twice(to: &HalfPlane, from: &HalfPlane, corner: DVec2) -> Part {
    if corner.x.abs() < 0.5 && corner.y.abs() < 0.5 {
        return wedge(to, from, corner);
    }
    // The lines do not cross in the pixel, so each lies on one side of the other.
    match (to.holds_border_of(from), from.holds_border_of(to)) {
        (true, true) => {
            let (one, other) = (to.part(), from.part());
            Part { area: (one.area + other.area - 1.0).max(0.0), moment: one.moment + other.moment }
        }
        (true, false) => from.part(),
        (false, true) => to.part(),
        (false, false) => Part::NOTHING,
    }
}

/// The part of a pixel between two sides that meet in its inside.
#[inline]
fn wedge(to: &HalfPlane, from: &HalfPlane, corner: DVec2) -> Part {
    let (first, mut side) = leave(corner, DVec2::new(from.normal.y, -from.normal.x));
    let (last, end) = leave(corner, DVec2::new(-to.normal.y, to.normal.x));
    let between = std::iter::from_fn(|| {
        let passed = side;
        (side != end).then(|| {
            side = (side + 1) % 4;
            CORNERS[passed] - corner
        })
    });
    Part::fan(corner, [first, last], between)
}

/// Where a ray from within a pixel leaves it, seen from the ray's start, and through which side.
#[inline]
fn leave(from: DVec2, direction: DVec2) -> (DVec2, usize) {
    // Divided by 0 they are infinite, and the other one counts.
    let x = (0.5f64.copysign(direction.x) - from.x) / direction.x;
    let y = (0.5f64.copysign(direction.y) - from.y) / direction.y;
    if x < y {
        (direction * x, if direction.x > 0.0 { 1 } else { 3 })
    } else {
        (direction * y, if direction.y > 0.0 { 2 } else { 0 })
    }
}

/// The part of a pixel within half planes: clipped one by one (Sutherland and Hodgman 1974).
fn cut(sides: impl IntoIterator<Item = HalfPlane>) -> Part {
    let mut polygon = [DVec2::ZERO; MOST_CORNERS];
    polygon[..4].copy_from_slice(&CORNERS);
    let mut count = 4;
    for side in sides {
        let before = polygon;
        let Some(&(mut last)) = before[..count].last() else { break };
        let mut low = side.normal.dot(last) + side.value;
        let mut kept = 0;
        for &corner in &before[..count] {
            let high = side.normal.dot(corner) + side.value;
            // Rounding may bend a sliver so that it is cut more often than a convex polygon can be.
            if (low >= 0.0) != (high >= 0.0) && kept < MOST_CORNERS {
                polygon[kept] = last + (corner - last) * (low / (low - high));
                kept += 1;
            }
            if high >= 0.0 && kept < MOST_CORNERS {
                polygon[kept] = corner;
                kept += 1;
            }
            (last, low) = (corner, high);
        }
        count = kept;
    }
    match &polygon[..count] {
        [hub, first, between @ .., last] => {
            Part::fan(*hub, [*first - *hub, *last - *hub], between.iter().map(|corner| *corner - *hub))
        }
        _ => Part::NOTHING,
    }
}

/// Corners of a pixel after four cuts.
const MOST_CORNERS: usize = 8;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::grid::{GRID_BITS, is_positive};

    /// No bound.
    const ALL: HalfPlane = HalfPlane { normal: DVec2::X, value: 1.0, reach: 0.5 };

    fn triangle(corners: [[f64; 2]; 3]) -> [GridPoint; 3] {
        let grid = |v: f64| (v * f64::from(1 << GRID_BITS)) as i64;
        corners.map(|[x, y]| GridPoint { x: grid(x), y: grid(y) })
    }

    fn assert_near(found: Part, expected: Part) {
        let off = (found.area - expected.area).abs().max((found.moment - expected.moment).abs().max_element());
        assert!(off < 1e-6, "{found:?} against {expected:?}");
    }

    fn half_plane(degrees: i32, value: f64) -> HalfPlane {
        let direction = DVec2::from_angle(f64::from(degrees).to_radians());
        let reach = 0.5 * (direction.x.abs() + direction.y.abs());
        // Of a length that differs from angle to angle.
        let length = f64::from(1 + degrees % 7) / reach;
        HalfPlane::new(direction * length, 2.0 * value * reach * length)
    }

    /// One cut by formula is what clipping gives, all around and at every height.
    #[test]
    fn formulas_for_one_cut_agree_with_clipping() {
        for degrees in 0..360 {
            for value in (-49..=49).map(|n| f64::from(n) / 100.0) {
                let side = half_plane(degrees, value);
                assert_near(side.part(), cut([side, ALL, ALL]));
            }
        }
    }

    /// And so are two, whether they meet in the pixel or not.
    #[test]
    fn formulas_for_two_cuts_agree_with_clipping() {
        for (one, turn) in (0..360).step_by(15).flat_map(|one| (5..180).step_by(12).map(move |turn| (one, turn))) {
            for (v, w) in (-9..=9).flat_map(|v| (-9..=9).map(move |w| (f64::from(v) / 19.0, f64::from(w) / 19.0))) {
                let (to, from) = (half_plane(one, v), half_plane(one + turn, w));
                let (n, m) = (to.normal, from.normal);
                let (v, w) = (to.value, from.value);
                let corner = DVec2::new(w * n.y - v * m.y, v * m.x - w * n.x) / n.perp_dot(m);
                assert_near(cut_twice(&to, &from, corner), cut([to, from, ALL]));
            }
        }
    }

    #[test]
    fn parts_of_pixels_around_a_triangle() {
        let part = |area: f64, [x, y]: [f64; 2]| Part { area, moment: DVec2::new(x, y) * area };
        let coverage = Coverage::new(&triangle([[1.0, 1.0], [5.0, 1.0], [1.0, 5.0]]), [0, 0]);
        assert_near(coverage.of([1, 1]), Part::PIXEL);
        assert_near(coverage.of([3, 2]), part(0.5, [-1.0 / 6.0, -1.0 / 6.0]));
        for pixel in [[0, 2], [4, 4], [2, 5]] {
            assert_near(coverage.of(pixel), Part::NOTHING);
        }
        let within = Coverage::new(&triangle([[0.25, 0.25], [0.75, 0.25], [0.25, 0.75]]), [7, 3]);
        assert_near(within.of([0, 0]), part(0.125, [-1.0 / 12.0, -1.0 / 12.0]));
    }

    /// Whatever the triangle, its parts add up to its area and its moment.
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
            let coverage = Coverage::new(&corners, [4, 4]);
            let (mut area, mut moment) = (0.0, DVec2::ZERO);
            for (column, row) in (0..10).flat_map(|row| (0..10).map(move |column| (column, row))) {
                let part = coverage.of([column, row]);
                area += part.area;
                moment += part.moment + part.area * (DVec2::new(column.into(), row.into()) + 0.5);
            }
            let [a, b, c] = corners.map(|corner| DVec2::from_array(corner.to_px()));
            let expected = (b - a).perp_dot(c - a) / 2.0;
            assert!((area - expected).abs() < 1e-9, "triangle {n}: {area} against {expected}");
            assert!((moment - (a + b + c) / 3.0 * expected).length() < 1e-8, "triangle {n}");
        }
    }
}
