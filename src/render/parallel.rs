//! Work shared among threads so that results cannot depend on how many there are.

use std::ops::Range;

/// Splits `0..count` into runs of `chunk` (the last one shorter), maps each run and returns the results in order.
///
/// With feature `threads` runs go to the current rayon pool; the results are the same without it.
pub(super) fn map_chunks<R: Send>(count: usize, chunk: usize, map: impl Fn(Range<usize>) -> R + Sync + Send) -> Vec<R> {
    let runs = count.div_ceil(chunk);
    let run = |i: usize| map(i * chunk..((i + 1) * chunk).min(count));
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        (0..runs).into_par_iter().map(run).collect()
    }
    #[cfg(not(feature = "threads"))]
    {
        (0..runs).map(run).collect()
    }
}

/// What a thread fills, reused from call to call.
pub(super) trait List: Default + Send {
    /// Empties it, but keeps its memory.
    fn clear(&mut self);
}

impl<T: Send> List for Vec<T> {
    fn clear(&mut self) {
        self.clear();
    }
}

/// Splits `0..count` into runs of `chunk` and fills one list for each. `lists` keep their memory from call to call, and
/// come out as many as there are runs.
pub(super) fn fill_chunks<L: List>(
    lists: &mut Vec<L>,
    count: usize,
    chunk: usize,
    fill: impl Fn(&mut L, Range<usize>) + Sync + Send,
) {
    lists.resize_with(count.div_ceil(chunk), L::default);
    let run = |(i, list): (usize, &mut L)| {
        list.clear();
        fill(list, i * chunk..((i + 1) * chunk).min(count));
    };
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        lists.par_iter_mut().enumerate().for_each(run);
    }
    #[cfg(not(feature = "threads"))]
    lists.iter_mut().enumerate().for_each(run);
}

/// Does `work` on each item, in any order and on any thread.
pub(super) fn for_each<T: Send>(items: Vec<T>, work: impl Fn(T) + Sync + Send) {
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        items.into_par_iter().for_each(work);
    }
    #[cfg(not(feature = "threads"))]
    items.into_iter().for_each(work);
}
