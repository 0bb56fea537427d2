//! Independent jobs on all threads.
//!
//! In: jobs and what to do with each. Forbidden here: results that depend on which thread did what.

/// Does the jobs, in any order, on all threads where there are some.
#[cfg(feature = "threads")]
pub(super) fn for_each<T: Send>(jobs: Vec<T>, job: impl Fn(T) + Send + Sync) {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};
    jobs.into_par_iter().for_each(job);
}

/// Does the jobs one after another.
#[cfg(not(feature = "threads"))]
pub(super) fn for_each<T>(jobs: Vec<T>, job: impl Fn(T)) {
    jobs.into_iter().for_each(job);
}

/// Does the jobs on all threads where there are some; results in the order of the jobs.
#[cfg(feature = "threads")]
pub(super) fn map<T: Send, R: Send>(jobs: Vec<T>, job: impl Fn(T) -> R + Send + Sync) -> Vec<R> {
    use rayon::iter::{IntoParallelIterator, ParallelIterator};
    jobs.into_par_iter().map(job).collect()
}

/// Does the jobs one after another; results in their order.
#[cfg(not(feature = "threads"))]
pub(super) fn map<T, R>(jobs: Vec<T>, job: impl Fn(T) -> R) -> Vec<R> {
    jobs.into_iter().map(job).collect()
}
