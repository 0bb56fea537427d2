//! Maps keyed by a face, for drawing and for simplification, which find a tet's neighbours as it comes.
//!
//! In: faces, as three vertices in whatever order the caller keeps to. Out: what was stored under them. Forbidden
//! here: iteration, whose order is no one's business.

use std::collections::HashMap;
use std::hash::{BuildHasher, Hasher, RandomState};

use super::VertexId;

/// A map from faces to `T`. Lookups are the hot spot of both, and three small integers do not need SipHash: two
/// multiplications under keys drawn at random keep a hostile stream from choosing its collisions. Results never depend
/// on the keys, since nothing can iterate.
#[derive(Debug, Clone)]
pub(crate) struct FaceMap<T>(HashMap<[u64; 2], T, FoldState>);

fn key([a, b, c]: [VertexId; 3]) -> [u64; 2] {
    [u64::from(a.0) << 32 | u64::from(b.0), c.0.into()]
}

impl<T> FaceMap<T> {
    pub(crate) fn new() -> Self {
        let random = RandomState::new();
        Self(HashMap::with_hasher(FoldState([random.hash_one(0u8), random.hash_one(1u8) | 1])))
    }

    pub(crate) fn insert(&mut self, face: [VertexId; 3], value: T) -> Option<T> {
        self.0.insert(key(face), value)
    }

    pub(crate) fn remove(&mut self, face: [VertexId; 3]) -> Option<T> {
        self.0.remove(&key(face))
    }
}

/// Random keys of a map.
#[derive(Debug, Clone)]
struct FoldState([u64; 2]);

impl BuildHasher for FoldState {
    type Hasher = FoldHasher;

    fn build_hasher(&self) -> FoldHasher {
        FoldHasher { state: self.0[0], key: self.0[1] }
    }
}

/// Folds each word in by a multiplication to 128 bits, whose halves are added.
#[derive(Debug)]
struct FoldHasher {
    state: u64,
    key: u64,
}

impl Hasher for FoldHasher {
    fn write(&mut self, bytes: &[u8]) {
        for chunk in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            self.write_u64(u64::from_le_bytes(word));
        }
    }

    fn write_u64(&mut self, word: u64) {
        let product = u128::from(self.state ^ word).wrapping_mul(u128::from(self.key));
        self.state = (product as u64).wrapping_add((product >> 64) as u64);
    }

    /// The length of an array is the same for all keys.
    fn write_usize(&mut self, _: usize) {}

    fn finish(&self) -> u64 {
        self.state
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_goes_in_comes_out() {
        let mut map = FaceMap::new();
        let faces =
            || (0..30u32).flat_map(|a| (0..30).flat_map(move |b| (0..30).map(move |c| [a, b, c].map(VertexId))));
        assert!(faces().enumerate().all(|(n, face)| map.insert(face, n).is_none()));
        assert!(faces().enumerate().all(|(n, face)| map.remove(face) == Some(n) && map.remove(face).is_none()));
    }
}
