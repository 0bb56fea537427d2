//! Maps and sums that give the same result for any number of threads.
//!
//! In: a count and a function of the index. Out: results in the order of the index. Forbidden here: anything whose
//! result depends on how the work was shared out; sums add fixed chunks in a fixed order.

use glam::Vec3;

/// Items a chunk of a sum covers. Part of the result (float sums depend on it), so never derived from the machine.
const CHUNK: usize = 4096;

/// `f(0), f(1), ...` in order.
pub(super) fn map<T: Send>(count: usize, f: impl Fn(usize) -> T + Sync + Send) -> Vec<T> {
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        (0..count).into_par_iter().map(f).collect()
    }
    #[cfg(not(feature = "threads"))]
    {
        (0..count).map(f).collect()
    }
}

/// Overwrites `values[i]` with `f(i)`.
pub(super) fn fill<T: Send>(values: &mut [T], f: impl Fn(usize) -> T + Sync + Send) {
    update(values, |i, value| *value = f(i));
}

/// Changes every value by `f(i, value)`.
pub(super) fn update<T: Send>(values: &mut [T], f: impl Fn(usize, &mut T) + Sync + Send) {
    update_by(CHUNK, values, f);
}

/// Overwrites `values[i]` with `f(i)`, at least `least` of them at a time.
pub(super) fn fill_by<T: Send>(least: usize, values: &mut [T], f: impl Fn(usize) -> T + Sync + Send) {
    update_by(least, values, |i, value| *value = f(i));
}

#[cfg(feature = "threads")]
fn update_by<T: Send>(least: usize, values: &mut [T], f: impl Fn(usize, &mut T) + Sync + Send) {
    use rayon::prelude::*;
    values.par_iter_mut().with_min_len(least).enumerate().for_each(|(i, value)| f(i, value));
}

#[cfg(not(feature = "threads"))]
fn update_by<T>(_least: usize, values: &mut [T], f: impl Fn(usize, &mut T)) {
    values.iter_mut().enumerate().for_each(|(i, value)| f(i, value));
}

/// The sum of `f(i)` over `0..count`, chunk by chunk.
pub(super) fn sum(count: usize, f: impl Fn(usize) -> f64 + Sync + Send) -> f64 {
    let chunk_sum = |chunk: usize| (chunk * CHUNK..((chunk + 1) * CHUNK).min(count)).map(&f).sum::<f64>();
    map(count.div_ceil(CHUNK), chunk_sum).iter().sum()
}

/// The inner product of two vectors of triples.
pub(super) fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    sum(a.len().min(b.len()), |i| f64::from(a[i].dot(b[i])))
}
