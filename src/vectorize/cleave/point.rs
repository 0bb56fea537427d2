//! Where a simplex of the lattice has its cut, triple or quadruple point.
//!
//! In: positions of its corners; of an edge of the adaptive lattice also how far along its labels meet. Out: a position
//! strictly inside. Forbidden here: anything beyond the simplex, so that all who share it agree.

use glam::IVec3;

/// The lattice position nearest to a simplex's barycentre along its chain that lies in its plane and strictly inside.
///
/// From corner to corner of an n-simplex the chain steps along axes of its own, and the barycentre takes n/(n+1) of
/// the first step, (n-1)/(n+1) of the next, and so on. Each share is rounded to what the step can be divided into:
/// the greatest common divisor of its components. So the point of an edge is its middle (alpha = 1/2 in Bronson et
/// al.), that of a face lies exactly in the face, and every tet over it has a positive volume.
///
/// A step along one axis is even and at least 4, one along two axes can be halved at least: so the shares stay apart
/// from each other, from 0 and from 1 at any [`crate::vectorize::lattice::MIN_SUBPIXEL_BITS`].
pub(super) fn inner_point(corners: &[IVec3]) -> IVec3 {
    let count = corners.len() as i32;
    corners.windows(2).zip((1..count).rev()).fold(corners[0], |point, (pair, share)| {
        let (least, parts) = divided(pair[1] - pair[0]);
        let taken = (2 * parts * share + count) / (2 * count);
        point + least * taken
    })
}

/// The lattice position strictly inside of an edge that is nearest to `share` of its way. Edges of the adaptive lattice
/// have several.
///
/// Wherever cuts lie on their edges, and other points inside of their simplices, all pieces are positive: the corners of
/// each lie in simplices that contain one another, so its volume is a product of shares.
pub(super) fn cut_point([start, end]: [IVec3; 2], share: f32) -> IVec3 {
    let (least, parts) = divided(end - start);
    debug_assert!(parts > 1, "{start} to {end}");
    start + least * ((parts as f32 * share).round() as i32).clamp(1, parts - 1)
}

/// A step as a multiple of the least step of that direction.
fn divided(step: IVec3) -> (IVec3, i32) {
    let parts = gcd(gcd(step.x.abs(), step.y.abs()), step.z.abs());
    (step / parts, parts)
}

/// Greatest common divisor of numbers >= 0 that are not both 0.
fn gcd(a: i32, b: i32) -> i32 {
    if b == 0 { a } else { gcd(b, a % b) }
}

#[cfg(test)]
mod tests {
    use super::super::slots::{CHAINS, KUHN_TETS};
    use super::super::stencil::StencilTable;
    use super::*;
    use crate::mesh::volume6;
    use crate::video::Label;

    /// All sizes of a cell: inside the picture, at one border, between both at two pixels and at one.
    fn cells() -> impl Iterator<Item = IVec3> {
        (2..=6).flat_map(|bits| {
            let unit = 1 << bits;
            let steps = move |n: usize| [unit, unit + unit / 2, 2 * unit][n];
            (0..9).map(move |n| IVec3::new(steps(n % 3), steps(n / 3), unit))
        })
    }

    fn corner_position(cell: IVec3, corner: u8) -> IVec3 {
        let bit = |axis: u8| i32::from(corner >> axis & 1);
        IVec3::new(3, 5, 7) + cell * IVec3::new(bit(0), bit(1), bit(2))
    }

    #[test]
    fn points_lie_in_the_plane_of_their_face() {
        for cell in cells() {
            for chain in CHAINS {
                let corners: Vec<IVec3> = chain.iter().map(|&c| corner_position(cell, c)).collect();
                let point = inner_point(&corners);
                match corners[..] {
                    [a, b] => assert_eq!(point * 2, a + b),
                    [a, b, c] => assert_eq!((b - a).cross(c - a).dot(point - a), 0),
                    _ => {}
                }
            }
        }
    }

    #[test]
    fn edges_may_be_cut_anywhere() {
        let table = StencilTable::new();
        let mut seed = 1u32;
        let mut share = || {
            seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        for (chain, positive) in KUHN_TETS {
            let corners = chain.map(|c| corner_position(IVec3::splat(64), c));
            for assignment in (0..256u32).flat_map(|n| [n; 20]) {
                let labels = std::array::from_fn(|corner| Label(assignment >> (2 * corner) & 3));
                let mut points = [IVec3::ZERO; 16];
                for (simplex, point) in points.iter_mut().enumerate().skip(1) {
                    let members: Vec<IVec3> = (0..4).filter(|c| simplex >> c & 1 == 1).map(|c| corners[c]).collect();
                    *point = match members[..] {
                        [start, end] => cut_point([start, end], share()),
                        _ => inner_point(&members),
                    };
                }
                let mut filled = 0;
                for tet in &table.stencil(labels).tets {
                    let [a, b, c, d] = tet.map(|corner| points[usize::from(corner.simplex)]);
                    let volume = if positive { volume6(a, b, c, d) } else { volume6(a, b, d, c) };
                    assert!(volume > 0, "{chain:?} {labels:?} {tet:?}: {volume}");
                    filled += volume;
                }
                assert_eq!(filled, 64 * 64 * 64);
            }
        }
    }

    #[test]
    fn every_pattern_fills_every_lattice_tet_with_positive_tets() {
        let table = StencilTable::new();
        for cell in cells() {
            for (chain, positive) in KUHN_TETS {
                let corners = chain.map(|c| corner_position(cell, c));
                let point = |simplex: u8| {
                    let members: Vec<IVec3> = (0..4).filter(|c| simplex >> c & 1 == 1).map(|c| corners[c]).collect();
                    inner_point(&members)
                };
                for assignment in 0..256u32 {
                    let labels = std::array::from_fn(|corner| Label(assignment >> (2 * corner) & 3));
                    let mut filled = 0;
                    for tet in &table.stencil(labels).tets {
                        let [a, b, c, d] = tet.map(|corner| point(corner.simplex));
                        let volume = if positive { volume6(a, b, c, d) } else { volume6(a, b, d, c) };
                        assert!(volume > 0, "{cell:?} {chain:?} {labels:?} {tet:?}: {volume}");
                        filled += volume;
                    }
                    assert_eq!(filled, i64::from(cell.x * cell.y * cell.z));
                }
            }
        }
    }
}
