//! Exact predicates on lattice positions.

use glam::IVec3;

/// Six times the signed volume of tet (a, b, c, d), in cubic lattice units: (b-a) x (c-a) . (d-a).
///
/// Exact while coordinates differ by less than 2^19 units (a side of 8192 pixels at 6 sub-pixel bits).
#[inline]
pub fn volume6(a: IVec3, b: IVec3, c: IVec3, d: IVec3) -> i64 {
    let (u, v, w) = ((b - a).as_i64vec3(), (c - a).as_i64vec3(), (d - a).as_i64vec3());
    u.cross(v).dot(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unit_corner_is_positive_and_swaps_sign() {
        let (o, x, y, t) = (IVec3::ZERO, IVec3::X, IVec3::Y, IVec3::Z);
        assert_eq!(volume6(o, x, y, t), 1);
        assert_eq!(volume6(o, y, x, t), -1);
        let far = IVec3::splat(1 << 19);
        assert_eq!(volume6(o, IVec3::new(far.x, 0, 0), IVec3::new(0, far.y, 0), IVec3::new(0, 0, far.z)), 1 << 57);
    }
}
