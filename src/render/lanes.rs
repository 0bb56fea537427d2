//! Polygons side by side: element i of each list belongs to polygon i.
//!
//! Loops over lists of a fixed length, without branches, become vector instructions as wide as the processor's. Here is
//! what they are made of. Numbers are not checked: lanes without a polygon hold whatever was there before.

/// Polygons that are worked on together: few enough for all of their lists to stay in the first-level cache.
pub(super) const LANES: usize = 32;

/// One a polygon.
pub(super) type Lanes<T> = [T; LANES];

/// Rounds up. Values are below 2^51, or what comes out is as large.
#[inline(always)]
pub(super) fn ceil(v: f64) -> f64 {
    // Added to it, a number has no digits after the point left.
    const WHOLE: f64 = (3u64 << 51) as f64;
    let near = (v + WHOLE) - WHOLE;
    near + if near < v { 1.0 } else { 0.0 }
}

/// The smaller one; what is no number may come out or not.
#[inline(always)]
pub(super) fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger one; what is no number may come out or not.
#[inline(always)]
pub(super) fn most(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// A whole number below 2^32 that is not negative.
#[inline(always)]
pub(super) fn whole(v: f64) -> u32 {
    // Added to 2^52, a number's last digits are those of the integer.
    (v + (1u64 << 52) as f64).to_bits() as u32
}
