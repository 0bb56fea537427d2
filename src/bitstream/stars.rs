//! The coded tets around each vertex, where hops are passed on.
//!
//! In: tets as they are coded. Out: those of a vertex that have not been told its hop. Forbidden here: coding.
//!
//! Tets of a vertex lie together in blocks, so that one does not have to be read to find the next: stars are gone through
//! for every vertex several times, and waiting for memory is most of the time it takes.

use crate::mesh::VertexId;

/// End of a list.
const NONE: u32 = u32::MAX;

/// Tets in a block: a cache line with the link.
const BLOCK: usize = 15;

/// Some tets of a vertex, oldest first, and the block before.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Block {
    tets: [u32; BLOCK],
    older: u32,
}

/// The star of a vertex.
#[derive(Debug, Clone, Copy)]
struct Star {
    /// The block with its youngest tets, full or not.
    youngest: u32,
    /// Number of its tets.
    count: u32,
    /// How many of them had been told a hop of this vertex, and which.
    told_tets: u32,
    told_hop: u8,
}

impl Star {
    const EMPTY: Self = Self { youngest: NONE, count: 0, told_tets: 0, told_hop: u8::MAX };
}

/// Stars, and the tets in them.
#[derive(Debug, Clone, Default)]
pub(super) struct Stars {
    /// By vertex.
    of: Vec<Star>,
    blocks: Vec<Block>,
    /// Vertices of each tet: the mesh has them only by way of its wedges.
    corners: Vec<[VertexId; 4]>,
    /// Per tet the lowest of the hops that its corners have been told.
    told: Vec<u8>,
}

impl Stars {
    /// Adds the next tet to the stars of its corners.
    pub(super) fn push(&mut self, corners: [VertexId; 4]) {
        let tet = self.corners.len() as u32;
        self.corners.push(corners);
        self.told.push(u8::MAX);
        for vertex in corners {
            if self.of.len() <= vertex.index() {
                self.of.resize(vertex.index() + 1, Star::EMPTY);
            }
            let star = &mut self.of[vertex.index()];
            let place = star.count as usize % BLOCK;
            if place == 0 {
                self.blocks.push(Block { tets: [0; BLOCK], older: star.youngest });
                star.youngest = self.blocks.len() as u32 - 1;
            }
            self.blocks[star.youngest as usize].tets[place] = tet;
            star.count += 1;
        }
    }

    /// Calls `lower` for the corners of all tets of a vertex that have not been told a hop as low as this, the youngest
    /// first. Those that were there the last time are passed over, so that all visits together are linear in the star.
    pub(super) fn tell(&mut self, vertex: VertexId, hop: u8, mut lower: impl FnMut(VertexId)) {
        let Some(star) = self.of.get_mut(vertex.index()) else { return };
        let new = if star.told_hop == hop { star.count - star.told_tets } else { star.count };
        (star.told_tets, star.told_hop) = (star.count, hop);
        let star = *star;
        for run in runs(&self.blocks, star, new) {
            // All that are untold are found before the first of them is gone into: so the waits for memory overlap.
            let untold = |(i, &tet): (usize, &u32)| u32::from(self.told[tet as usize] > hop) << i;
            let mut untold: u32 = run.iter().enumerate().map(untold).sum();
            while let Some(youngest) = untold.checked_ilog2() {
                untold ^= 1 << youngest;
                let tet = run[youngest as usize] as usize;
                self.told[tet] = hop;
                self.corners[tet].into_iter().for_each(&mut lower);
            }
        }
    }
}

/// The `scan` youngest tets of a star in runs, the youngest run first, each from its oldest tet on.
fn runs(blocks: &[Block], star: Star, scan: u32) -> impl Iterator<Item = &[u32]> {
    let Star { youngest, count, .. } = star;
    let mut block = youngest;
    let mut filled = if count == 0 { 0 } else { (count as usize - 1) % BLOCK + 1 };
    let mut left = scan as usize;
    std::iter::from_fn(move || {
        if left == 0 {
            return None;
        }
        let found = blocks.get(block as usize)?;
        block = found.older;
        let tets = &found.tets[..std::mem::replace(&mut filled, BLOCK)];
        let tets = &tets[tets.len().saturating_sub(left)..];
        left -= tets.len();
        Some(tets)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_are_told_once_the_youngest_first() {
        let mut stars = Stars::default();
        let corners = |tet: u32| [0, 1, 2, 3 + tet].map(VertexId);
        (0..50).for_each(|tet| stars.push(corners(tet)));
        let told = |stars: &mut Stars, vertex, hop| {
            let mut found = Vec::new();
            stars.tell(VertexId(vertex), hop, |corner| found.push(corner.0));
            found
        };
        let all: Vec<u32> = (0..50).rev().flat_map(|tet| corners(tet).map(|corner| corner.0)).collect();
        assert_eq!(told(&mut stars, 1, 1), all);
        assert_eq!(told(&mut stars, 2, 1), []);
        stars.push(corners(50));
        assert_eq!(told(&mut stars, 1, 1), [0, 1, 2, 53]);
        assert_eq!(told(&mut stars, 1, 0), (0..51).rev().flat_map(|t| [0, 1, 2, 3 + t]).collect::<Vec<_>>());
        assert_eq!(told(&mut stars, 60, 0), []);
    }
}
