//! The order of collapses: a bucket queue over edges with lazily renewed keys.
//!
//! Keys are costs on a logarithmic scale, sixteen buckets an octave; within a bucket the order is last in, first out.
//! A binary heap spent a third of the simplification's time in `pop` (docs/benchmarks.md); nothing is gained by an
//! order finer than the costs' own uncertainty.

/// An edge waiting for its collapse.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Entry {
    /// One end, as numbered when the entry was made.
    pub(super) u: u32,
    /// The other end.
    pub(super) v: u32,
    /// Sum of the ends' change counts when the cost was computed: the cost is current while this still holds.
    pub(super) stamp: u32,
    /// Times the collapse was refused since the ends last changed.
    pub(super) attempts: u16,
    /// Whether a change of topology is in its cost that only a look at the surfaces around tells of.
    pub(super) paid: bool,
}

/// Edges by cost.
#[derive(Debug)]
pub(super) struct BucketQueue {
    buckets: Vec<Vec<Entry>>,
    // No bucket before this one holds an entry.
    lowest: usize,
    len: usize,
}

/// Mantissa bits that tell buckets apart.
const MANTISSA_BITS: u32 = 4;

impl BucketQueue {
    pub(super) fn new() -> Self {
        Self { buckets: vec![Vec::new(); 256 << MANTISSA_BITS], lowest: 256 << MANTISSA_BITS, len: 0 }
    }

    /// Bucket of a cost; negative costs (rounding) count as zero.
    pub(super) fn bucket(cost: f32) -> usize {
        // The bits of a non-negative float ascend with its value.
        (cost.max(0.0).to_bits() >> (23 - MANTISSA_BITS)) as usize
    }

    /// Least cost of a bucket.
    pub(super) fn cost(bucket: usize) -> f32 {
        f32::from_bits((bucket as u32) << (23 - MANTISSA_BITS))
    }

    pub(super) fn push(&mut self, bucket: usize, entry: Entry) {
        self.buckets[bucket].push(entry);
        self.lowest = self.lowest.min(bucket);
        self.len += 1;
    }

    /// Takes an entry of the lowest bucket in use, with the bucket's number.
    pub(super) fn pop(&mut self) -> Option<(usize, Entry)> {
        if self.len == 0 {
            return None;
        }
        while self.buckets[self.lowest].is_empty() {
            self.lowest += 1;
        }
        self.len -= 1;
        self.buckets[self.lowest].pop().map(|entry| (self.lowest, entry))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pops_by_cost() {
        let mut queue = BucketQueue::new();
        let entry = |u| Entry { u, v: 0, stamp: 0, attempts: 0, paid: false };
        for (u, cost) in [(1, 4.0), (2, 0.0), (3, 1e9), (4, 0.5), (5, -1e-9)] {
            queue.push(BucketQueue::bucket(cost), entry(u));
        }
        let order: Vec<u32> = std::iter::from_fn(|| queue.pop()).map(|(_, e)| e.u).collect();
        assert_eq!(order, [5, 2, 4, 1, 3]);
        assert!(BucketQueue::bucket(f32::MAX) < 256 << MANTISSA_BITS);
        for cost in [0.0, 1.0, 3.3, 1e6] {
            let least = BucketQueue::cost(BucketQueue::bucket(cost));
            assert!(least <= cost && cost <= least * 1.0626, "{cost} is in the bucket from {least}");
        }
    }
}
