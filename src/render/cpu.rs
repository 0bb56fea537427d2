//! The one way to code for wide registers, for processors that have them.
//!
//! In: kernels. Out: what they compute, the same bits on any processor: wider instructions do the same operations on more
//! numbers at a time. Products are never fused with sums, so `fma` is not among them.
//!
//! Only here is `unsafe` code allowed: a single call.
#![allow(unsafe_code, reason = "code for instructions that not every processor has can be called in no other way")]

/// Work on many numbers of a kind. `run`, and all that it calls, must be inlined: what is not has no wide instructions.
pub(super) trait Kernel {
    type Output;

    fn run(self) -> Self::Output;
}

/// Runs a kernel with the widest instructions that there are.
#[inline]
pub(super) fn run<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(test)]
    if tests::NARROW.get() {
        return kernel.run();
    }
    #[cfg(target_arch = "x86_64")]
    if std::arch::is_x86_feature_detected!("avx2") {
        // SAFETY: `run_avx2` asks nothing of its caller but a processor with AVX2, and that has just been asked for.
        return unsafe { run_avx2(kernel) };
    }
    kernel.run()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2")]
fn run_avx2<K: Kernel>(kernel: K) -> K::Output {
    kernel.run()
}

#[cfg(test)]
pub(super) mod tests {
    use std::cell::Cell;

    thread_local! {
        /// Whether this thread does without wide instructions.
        pub(super) static NARROW: Cell<bool> = const { Cell::new(false) };
    }

    /// Does work with and without wide instructions.
    pub(in super::super) fn both_ways<T>(mut work: impl FnMut() -> T) -> [T; 2] {
        [false, true].map(|narrow| {
            NARROW.set(narrow);
            let done = work();
            NARROW.set(false);
            done
        })
    }
}
