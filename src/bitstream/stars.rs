//! The coded tets around each vertex.
//!
//! In: tets as they are coded. Out: those of a vertex, the youngest first. Forbidden here: coding.
//!
//! Tets of a vertex lie together in blocks, so that one does not have to be read to find the next: stars are gone through
//! for every vertex several times, and waiting for memory is most of the time it takes.

/// End of a list.
const NONE: u32 = u32::MAX;

/// Tets in a block: a cache line with the link.
pub(super) const BLOCK: usize = 15;

/// Some tets of a vertex, oldest first, and the block before.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Block {
    tets: [u32; BLOCK],
    older: u32,
}

/// The star of a vertex.
#[derive(Debug, Clone, Copy)]
pub(super) struct Star {
    /// The block with its youngest tets, full or not.
    youngest: u32,
    /// Number of its tets.
    pub(super) count: u32,
}

impl Star {
    pub(super) const EMPTY: Self = Self { youngest: NONE, count: 0 };
}

/// The blocks of all stars.
#[derive(Debug, Clone, Default)]
pub(super) struct Stars(Vec<Block>);

impl Stars {
    /// Adds a tet to a star.
    #[inline]
    pub(super) fn push(&mut self, star: &mut Star, tet: u32) {
        let place = star.count as usize % BLOCK;
        if place == 0 {
            self.0.push(Block { tets: [0; BLOCK], older: star.youngest });
            star.youngest = self.0.len() as u32 - 1;
        }
        self.0[star.youngest as usize].tets[place] = tet;
        star.count += 1;
    }

    /// The `scan` youngest tets of a star in runs, the youngest run first, each from its oldest tet on.
    #[inline]
    pub(super) fn runs(&self, star: Star, scan: u32) -> impl Iterator<Item = &[u32]> + use<'_> {
        let Star { youngest, count } = star;
        let mut block = youngest;
        let mut filled = if count == 0 { 0 } else { (count as usize - 1) % BLOCK + 1 };
        let mut left = scan as usize;
        std::iter::from_fn(move || {
            if left == 0 {
                return None;
            }
            let found = self.0.get(block as usize)?;
            block = found.older;
            let tets = &found.tets[..std::mem::replace(&mut filled, BLOCK)];
            let tets = &tets[tets.len().saturating_sub(left)..];
            left -= tets.len();
            Some(tets)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_are_listed_youngest_first() {
        let mut stars = Stars::default();
        let mut of = [Star::EMPTY; 5];
        for tet in 0..50 {
            for vertex in [0, 1, 2, 3 + tet as usize % 2] {
                stars.push(&mut of[vertex], tet);
            }
        }
        let at = |star, scan| stars.runs(star, scan).flat_map(|run| run.iter().rev().copied());
        assert!(at(of[1], 50).eq((0..50).rev()));
        assert!(at(of[1], 17).eq((33..50).rev()));
        assert!(at(of[4], 99).eq((0..25).rev().map(|k| 2 * k + 1)));
        assert_eq!(of[3].count, 25);
        assert_eq!(at(Star::EMPTY, 9).next(), None);
        assert_eq!(at(of[1], 0).next(), None);
    }
}
