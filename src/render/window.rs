//! Which tets a part of the picture can show, found without a look at their corners.
//!
//! In: a complex that grows at its ends, and viewports. Out: whether a control tet may be seen. Only those that are not
//! subdivided: smoothing moves corners.

use super::complex::{Complex, FINE_BITS};
use super::view::Viewport;
use crate::mesh::Domain;

/// A rectangle of the picture in steps of an [`Extents`]: x and y of the first corner, then of the last.
type Rectangle = [u16; 4];

/// The rectangles that control tets lie in; grows when it is asked.
#[derive(Debug, Default)]
pub(super) struct Extents {
    /// Fine units of a step; a power of two, given by its exponent.
    shift: u32,
    /// One a tet.
    tets: Vec<Rectangle>,
}

impl Extents {
    /// Takes in what `complex` gained since the last call.
    pub(super) fn extend(&mut self, domain: &Domain, complex: &Complex) {
        let largest = domain.extent().truncate().max_element() << FINE_BITS;
        self.shift = (i32::BITS - largest.leading_zeros()).saturating_sub(u16::BITS);
        let step = |v: i32| (v.max(0) >> self.shift) as u16;
        let of_tet = |corners: &[u32; 4]| {
            let [a, b, c, d] = corners.map(|node| complex.position(node).truncate());
            let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
            [step(low.x), step(low.y), step(high.x), step(high.y)]
        };
        self.tets.extend(complex.tets[self.tets.len()..].iter().map(of_tet));
    }

    /// What `viewport` shows on a surface of this size, and a pixel around it.
    pub(super) fn window(&self, domain: &Domain, viewport: &Viewport, (width, height): (u32, u32)) -> Rectangle {
        let steps = f64::from(domain.unit()) * f64::from(1 << FINE_BITS) / f64::from(1 << self.shift);
        // Casts saturate.
        let side = |from: f64, length: f64, pixels: u32| {
            let pixel = length / f64::from(pixels);
            [from - pixel, from + length + pixel].map(|edge| edge * steps)
        };
        let [x, y] = [side(viewport.x, viewport.width, width), side(viewport.y, viewport.height, height)];
        [x[0].floor() as u16, y[0].floor() as u16, x[1].ceil() as u16, y[1].ceil() as u16]
    }

    /// Whether a tet may be seen in `window`.
    #[inline]
    pub(super) fn is_seen(&self, tet: u32, window: &Rectangle) -> bool {
        let [left, top, right, bottom] = self.tets[tet as usize];
        left <= window[2] && top <= window[3] && right >= window[0] && bottom >= window[1]
    }
}

#[cfg(test)]
mod tests {
    use glam::IVec3;

    use super::super::complex::Node;
    use super::*;
    use crate::render::random;
    use crate::video::Label;

    /// Whatever the viewport, what it leaves out lies outside of it.
    #[test]
    fn tets_left_out_lie_outside() {
        let mut random = random::below::<i32>(3);
        for (width, height) in [(64, 48), (16384, 9000)] {
            let domain = Domain { width, height, duration: 4, subpixel_bits: 3 };
            let far = domain.extent();
            let mut complex = Complex::default();
            for tet in 0..400u32 {
                let around = IVec3::new(random(far.x), random(far.y), 0);
                for corner in 0..4 {
                    let near = around + IVec3::new(random(200) - 100, random(200) - 100, random(9));
                    complex.points.push(near.clamp(IVec3::ZERO, far) << FINE_BITS as i32);
                    complex.nodes.push(Node { point: 4 * tet + corner, label: Label(0) });
                }
                complex.tets.push([0, 1, 2, 3].map(|corner| 4 * tet + corner));
            }
            let mut extents = Extents::default();
            extents.extend(&domain, &complex);
            let mut seen = 0;
            for _ in 0..50 {
                let [x, y, w, h] = [random(far.x), random(far.y), random(far.x / 2) + 1, random(far.y / 2) + 1];
                let px = |v: i32| f64::from(v) / 8.0;
                let viewport = Viewport { x: px(x), y: px(y), width: px(w), height: px(h) };
                let window = extents.window(&domain, &viewport, (33, 700));
                for tet in 0..400 {
                    let corners = [0, 1, 2, 3].map(|corner| complex.points[4 * tet + corner] >> FINE_BITS as i32);
                    let low = corners.into_iter().reduce(IVec3::min).expect("four");
                    let high = corners.into_iter().reduce(IVec3::max).expect("four");
                    let meets = low.x <= x + w && high.x >= x && low.y <= y + h && high.y >= y;
                    let found = extents.is_seen(tet as u32, &window);
                    assert!(found || !meets, "tet {tet}");
                    seen += usize::from(found);
                }
            }
            assert!((100..15_000).contains(&seen), "{seen} of 20000");
        }
    }
}
