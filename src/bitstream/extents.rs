//! How long edges are around each vertex, axis by axis: the scale in which the mesh is about as dense everywhere.
//!
//! In: tets behind gates, as they are coded. Out: typical extents, the unit of distances, angles and residuals there.
//! Forbidden here: any order that depends on more than the order of calls.

use glam::Vec3A;

/// Least extent of a sum over three vertices, in lattice units.
const LEAST: f32 = 3.0;
/// What part of the way to the next edge a mean moves.
const RATE: f32 = 0.125;

/// Takes the edges between a tet's gate and its apex into the running means of the extents of the edges at its corners, the
/// apex's last; they are 0 before the first.
#[inline(always)]
pub(super) fn learn([a, b, c, apex]: [Vec3A; 4], edges: [Vec3A; 3]) -> [Vec3A; 4] {
    let [first, second, third] = edges.map(Vec3A::abs);
    let follow = |mean: Vec3A, here: Vec3A| {
        let rate = if mean == Vec3A::ZERO { 1.0 } else { RATE };
        mean + (here - mean) * rate
    };
    let apex = if apex == Vec3A::ZERO { (first + second + third) / 3.0 } else { apex };
    [follow(a, first), follow(b, second), follow(c, third), apex]
}

/// The sum over three vertices.
#[inline(always)]
pub(super) fn around([a, b, c]: [Vec3A; 3]) -> Vec3A {
    (a + b + c).max(Vec3A::splat(LEAST))
}

/// Sizes are counted from this part of a lattice unit.
pub(crate) const PARTS: i32 = 16;

/// Binary logarithm of the product of three extents in 1/16 lattice units, each at least 1.
#[inline]
pub(super) fn size(extents: Vec3A) -> i32 {
    let parts = (extents * PARTS as f32).max(Vec3A::ONE);
    ilog2(parts.x * parts.y * parts.z)
}

/// The same of extents that are counted in 1/16 lattice units.
#[cfg(feature = "encode")]
pub(crate) fn size_of(extents: glam::IVec3) -> i32 {
    size(extents.as_vec3a() / PARTS as f32)
}

/// Binary logarithm of a number that is at least 1, rounded down.
#[inline]
pub(super) fn ilog2(number: f32) -> i32 {
    (number.to_bits() >> (f32::MANTISSA_DIGITS - 1)) as i32 - (f32::MAX_EXP - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_follow_the_tets() {
        assert_eq!(around([Vec3A::ZERO; 3]), Vec3A::splat(3.0));
        assert_eq!(size(Vec3A::ZERO), 0);
        let edges = [[0.0, 0.0, -90.0], [30.0, 0.0, -90.0], [0.0, 60.0, -90.0]].map(Vec3A::from_array);
        let once = learn([Vec3A::ZERO; 4], edges);
        assert_eq!(once[..3], edges.map(Vec3A::abs));
        assert_eq!(once[3], Vec3A::new(10.0, 20.0, 90.0));
        assert_eq!(size(once[3]), 26);
        let twice = learn(once, edges.map(|edge| 2.0 * edge));
        assert_eq!(twice[1], Vec3A::new(33.75, 0.0, 101.25));
        assert_eq!(twice[3], once[3]);
    }

    #[test]
    fn logarithms_are_rounded_down() {
        assert_eq!([1.0, 1.99, 2.0, 1e9, (1u64 << 40) as f32].map(ilog2), [0, 0, 1, 29, 40]);
    }

    #[cfg(feature = "encode")]
    #[test]
    fn sizes_are_products() {
        assert_eq!(size_of(glam::IVec3::new(160, 320, 1440)), 26);
        assert_eq!(size_of(glam::IVec3::ZERO), 0);
    }
}
