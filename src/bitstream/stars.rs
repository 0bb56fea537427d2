//! The coded tets around each vertex.
//!
//! In: tets as they are coded. Out: those of a vertex, the youngest first. Forbidden here: coding.
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
struct Block {
    tets: [u32; BLOCK],
    older: u32,
}

/// The star of a vertex.
#[derive(Debug, Clone, Copy)]
struct Star {
    /// The block with its youngest tets, full or not.
    youngest: u32,
    count: u32,
}

/// Stars of all vertices.
#[derive(Debug, Clone, Default)]
pub(super) struct Stars {
    stars: Vec<Star>,
    blocks: Vec<Block>,
}

impl Stars {
    pub(super) fn push_vertex(&mut self) {
        self.stars.push(Star { youngest: NONE, count: 0 });
    }

    /// Adds a tet at its four corners.
    pub(super) fn push_tet(&mut self, tet: u32, corners: [VertexId; 4]) {
        for vertex in corners {
            let star = &mut self.stars[vertex.index()];
            let place = star.count as usize % BLOCK;
            if place == 0 {
                self.blocks.push(Block { tets: [0; BLOCK], older: star.youngest });
                star.youngest = self.blocks.len() as u32 - 1;
            }
            self.blocks[star.youngest as usize].tets[place] = tet;
            star.count += 1;
        }
    }

    /// Number of tets at `vertex`.
    pub(super) fn count(&self, vertex: VertexId) -> u32 {
        self.stars[vertex.index()].count
    }

    /// Tets at `vertex`, the youngest first.
    pub(super) fn at(&self, vertex: VertexId) -> impl Iterator<Item = u32> + '_ {
        let Star { youngest, count } = self.stars[vertex.index()];
        let filled = (count as usize + BLOCK - 1) % BLOCK + 1;
        let mut block = youngest;
        let mut filled = if count == 0 { 0 } else { filled };
        std::iter::from_fn(move || {
            let found = self.blocks.get(block as usize)?;
            block = found.older;
            let tets = &found.tets[..std::mem::replace(&mut filled, BLOCK)];
            Some(tets.iter().rev().copied())
        })
        .flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stars_are_listed_youngest_first() {
        let mut stars = Stars::default();
        (0..5).for_each(|_| stars.push_vertex());
        for tet in 0..50 {
            stars.push_tet(tet, [0, 1, 2, 3 + tet % 2].map(VertexId));
        }
        assert!(stars.at(VertexId(1)).eq((0..50).rev()));
        assert!(stars.at(VertexId(4)).eq((0..25).rev().map(|k| 2 * k + 1)));
        assert_eq!(stars.count(VertexId(3)), 25);
        stars.push_vertex();
        assert_eq!((stars.at(VertexId(5)).next(), stars.count(VertexId(5))), (None, 0));
    }
}
