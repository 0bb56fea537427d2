//! Geometry in IEEE 754 binary32, operation by operation: where both sides must come to the same bits.
//!
//! In: points in lattice units. Out: differences, products, normals measured in extents. Forbidden here: operations whose
//! order or rounding a library or a machine may choose.

use glam::{IVec3, Vec3A, Vec3Swizzles};

/// A point in lattice units; exact, as coordinates are below 2^20. So are differences of two points and sums of three.
#[inline(always)]
pub(super) fn point(position: IVec3) -> Vec3A {
    let [x, y, t] = position.to_array();
    Vec3A::new(x as f32, y as f32, t as f32)
}

/// A point in whole lattice units.
#[inline(always)]
pub(super) fn whole(point: Vec3A) -> IVec3 {
    let [x, y, t] = point.to_array();
    IVec3::new(x as i32, y as i32, t as i32)
}

/// The sum of products, from left to right.
#[inline(always)]
pub(super) fn dot(u: Vec3A, v: Vec3A) -> f32 {
    let products = u * v;
    products.x + products.y + products.z
}

/// The cross product.
#[inline(always)]
pub(super) fn cross(u: Vec3A, v: Vec3A) -> Vec3A {
    u.yzx() * v.zxy() - u.zxy() * v.yzx()
}

/// Unit normal of a plane that is perpendicular to `plane`, where each axis is measured in extents; 0 where that comes to
/// nothing by rounding.
#[inline(always)]
pub(super) fn unit_normal(plane: Vec3A, extent: Vec3A) -> Vec3A {
    let n = plane * extent;
    n / dot(n, n).sqrt().max(1.0)
}

/// The largest integer that is not above a number.
#[inline(always)]
pub(super) fn floor(number: f32) -> i32 {
    let whole = number as i32;
    whole - i32::from(whole as f32 > number)
}

/// Whether the tet is surely positive whose corners but for the last one lie at these offsets from it. Of the six products
/// of three that its volume is made of none is greater than `bound`, and rounding changes each by less than 2^-22 of it.
#[inline(always)]
pub(super) fn is_positive([a, b, c]: [Vec3A; 3]) -> bool {
    let largest = a.abs().max(b.abs()).max(c.abs());
    let bound = largest.x * largest.y * largest.z;
    -dot(cross(a, b), c) > bound * (6.0 / (1 << 21) as f32)
}
