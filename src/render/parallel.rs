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

/// Splits `0..count` into runs of `chunk` and fills one list for each. `lists` keep their memory from call to call, and
/// come out as many as there are runs.
pub(super) fn fill_chunks<T: Send>(
    lists: &mut Vec<Vec<T>>,
    count: usize,
    chunk: usize,
    fill: impl Fn(&mut Vec<T>, Range<usize>) + Sync + Send,
) {
    lists.resize_with(count.div_ceil(chunk), Vec::new);
    let run = |(i, list): (usize, &mut Vec<T>)| {
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

/// Does `work` on each item, in any order and on any thread. Scratch is handed from item to item with what it holds.
pub(super) fn for_each<T: Send, S: Default>(items: Vec<T>, work: impl Fn(&mut S, T) + Sync + Send) {
    #[cfg(feature = "threads")]
    {
        use rayon::prelude::*;
        items.into_par_iter().for_each_init(S::default, |scratch, item| work(scratch, item));
    }
    #[cfg(not(feature = "threads"))]
    {
        let mut scratch = S::default();
        items.into_iter().for_each(|item| work(&mut scratch, item));
    }
}
