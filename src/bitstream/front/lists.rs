//! Lists of open faces, one a vertex, the youngest first.
//!
//! In: faces that come and go, as their corners see them. Out: those of a vertex, one of them by its corners. Forbidden
//! here: geometry.
//!
//! A vertex has six open faces on average and its list is gone through for every tet around it. So what is asked of them
//! lies together in blocks, where it can be read without following links from face to face.

use wide::u32x8;

use crate::mesh::{FaceMap, VertexId};

/// End of a list.
const NONE: u32 = u32::MAX;

/// Faces in a block: two lines of the cache with the links. They are compared all at once, since how many there are and
/// which one is wanted are beyond what a processor can foretell.
pub(in crate::bitstream) const ROOM: usize = 8;

/// A vertex with more faces than the second becomes a hub, whose faces are looked up in a map; with fewer than the first
/// it is none any more.
const HUB: [u32; 2] = [128, 256];

/// An open face as one of its corners sees it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bitstream) struct Spoke {
    /// Its id in the front.
    pub(in crate::bitstream) face: u32,
    /// The corner after this one, anticlockwise.
    pub(in crate::bitstream) second: VertexId,
    /// The corner before it.
    pub(in crate::bitstream) third: VertexId,
}

/// One number of each face of a block.
pub(in crate::bitstream) type Lanes = [u32; ROOM];

/// The lanes that hold `wanted`, as bits.
#[inline]
pub(in crate::bitstream) fn equal_lanes(lanes: &Lanes, wanted: u32) -> u32 {
    u32x8::new(*lanes).simd_eq(u32x8::splat(wanted)).to_bitmask()
}

/// Some faces of a vertex, oldest first, with holes; never empty while it is in a list.
#[derive(Debug, Clone)]
#[repr(align(128))]
struct Block {
    faces: Lanes,
    seconds: Lanes,
    thirds: Lanes,
    /// Bits of the lanes that have a face.
    live: u32,
    /// Lanes from which on no face has been put yet.
    used: u32,
    /// Blocks before and after it.
    older: u32,
    younger: u32,
}

impl Block {
    #[inline]
    fn spoke(&self, place: usize) -> Spoke {
        Spoke { face: self.faces[place], second: VertexId(self.seconds[place]), third: VertexId(self.thirds[place]) }
    }

    #[inline]
    fn put(&mut self, place: usize, Spoke { face, second, third }: Spoke) {
        (self.faces[place], self.seconds[place], self.thirds[place]) = (face, second.0, third.0);
        self.live |= 1 << place;
    }

    /// Moves faces up to fill the holes.
    fn close_ranks(&mut self) {
        let mut old = std::mem::take(&mut self.live);
        self.used = 0;
        while old != 0 {
            let spoke = self.spoke(old.trailing_zeros() as usize % ROOM);
            old &= old - 1;
            self.put(self.used as usize, spoke);
            self.used += 1;
        }
    }
}

/// The list of a vertex.
#[derive(Debug, Clone, Copy)]
pub(in crate::bitstream) struct List {
    /// The block with its youngest faces.
    youngest: u32,
    /// Faces in all its blocks.
    count: u32,
}

impl List {
    pub(in crate::bitstream) const EMPTY: Self = Self { youngest: NONE, count: 0 };

    #[inline]
    pub(in crate::bitstream) fn count(self) -> u32 {
        self.count & !IS_HUB
    }
}

/// What of a face is open already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::bitstream) struct Met {
    /// The open face with the same corners seen from the other side: the one that the face closes.
    pub(in crate::bitstream) mirrored: Option<u32>,
    /// Whether there is an open face just like it.
    pub(in crate::bitstream) is_there: bool,
}

impl Met {
    pub(in crate::bitstream) const NOTHING: Self = Self { mirrored: None, is_there: false };
}

/// The bit of a count that says that the vertex is a hub.
const IS_HUB: u32 = 1 << 31;

/// The blocks of all lists.
#[derive(Debug, Clone)]
pub(super) struct Lists {
    blocks: Vec<Block>,
    free: Vec<u32>,
    /// Faces at hubs, each turned so that the hub comes first: no stream can make a search long.
    at_hubs: FaceMap<u32>,
}

impl Lists {
    pub(super) fn new() -> Self {
        Self { blocks: Vec::new(), free: Vec::new(), at_hubs: FaceMap::new() }
    }

    /// The first face of the youngest block.
    #[inline]
    pub(super) fn youngest_face(&self, list: List) -> u32 {
        self.blocks.get(list.youngest as usize).map_or(NONE, |block| block.faces[0])
    }

    /// Faces of a list, the youngest first.
    #[inline]
    pub(super) fn at(&self, list: List) -> impl Iterator<Item = Spoke> + use<'_> {
        let mut block = list.youngest;
        std::iter::from_fn(move || {
            let found = self.blocks.get(block as usize)?;
            block = found.older;
            let mut left = found.live;
            Some(std::iter::from_fn(move || {
                let place = left.checked_ilog2()?;
                left ^= 1 << place;
                Some(found.spoke(place as usize % ROOM))
            }))
        })
        .flatten()
    }

    /// What of a face and its mirror image is in the list of a vertex.
    #[inline]
    pub(super) fn meet(&self, list: List, [vertex, second, third]: [VertexId; 3]) -> Met {
        if list.count & IS_HUB != 0 {
            let find = |second, third| self.at_hubs.get([vertex, second, third]).copied();
            return Met { mirrored: find(third, second), is_there: find(second, third).is_some() };
        }
        let mut met = Met::NOTHING;
        let mut block = list.youngest;
        while let Some(found) = self.blocks.get(block as usize) {
            let seconds = [second, third].map(|v| equal_lanes(&found.seconds, v.0));
            let thirds = [second, third].map(|v| equal_lanes(&found.thirds, v.0));
            met.is_there |= seconds[0] & thirds[1] & found.live != 0;
            let mirrored = seconds[1] & thirds[0] & found.live;
            if mirrored != 0 {
                met.mirrored = Some(found.faces[mirrored.trailing_zeros() as usize % ROOM]);
            }
            block = found.older;
        }
        met
    }

    /// The youngest of the `scan` youngest faces of a list that has this vertex as its second or (`third`) its third corner.
    #[inline]
    pub(super) fn find_across(&self, list: List, scan: u32, third: bool, wanted: VertexId) -> Option<Spoke> {
        if list.count() > scan {
            let is_it = |spoke: &Spoke| wanted == if third { spoke.third } else { spoke.second };
            return self.at(list).take(scan as usize).find(is_it);
        }
        let mut block = list.youngest;
        while let Some(found) = self.blocks.get(block as usize) {
            let lanes = if third { &found.thirds } else { &found.seconds };
            let equal = equal_lanes(lanes, wanted.0) & found.live;
            if equal != 0 {
                return Some(found.spoke(equal.ilog2() as usize % ROOM));
            }
            block = found.older;
        }
        None
    }

    /// Adds a face to the list of a vertex. Returns the block that it is in.
    #[inline]
    pub(super) fn push(&mut self, vertex: VertexId, list: &mut List, spoke: Spoke) -> u32 {
        if self.blocks.get(list.youngest as usize).is_none_or(|block| block.used as usize == ROOM) {
            self.make_room(list);
        }
        let block = &mut self.blocks[list.youngest as usize];
        block.put(block.used as usize % ROOM, spoke);
        block.used += 1;
        list.count += 1;
        // So it is for hubs, too.
        if list.count > HUB[1] {
            self.push_at_hub(vertex, list, spoke);
        }
        list.youngest
    }

    /// Room for one more face in the youngest block of a list.
    #[inline(never)]
    fn make_room(&mut self, list: &mut List) {
        match self.blocks.get_mut(list.youngest as usize) {
            Some(block) if block.live + 1 != 1 << ROOM => block.close_ranks(),
            _ => list.youngest = self.push_block(list.youngest),
        }
    }

    #[cold]
    fn push_at_hub(&mut self, vertex: VertexId, list: &mut List, spoke: Spoke) {
        if list.count & IS_HUB != 0 {
            self.at_hubs.insert([vertex, spoke.second, spoke.third], spoke.face);
        } else {
            self.open_hub(vertex, list);
        }
    }

    /// An empty block before the youngest of a list.
    fn push_block(&mut self, older: u32) -> u32 {
        let block = self.free.pop().unwrap_or_else(|| {
            let lanes = [NONE; ROOM];
            let [faces, seconds, thirds] = [lanes; 3];
            self.blocks.push(Block { faces, seconds, thirds, live: 0, used: 0, older: NONE, younger: NONE });
            self.blocks.len() as u32 - 1
        });
        let empty = &mut self.blocks[block as usize];
        (empty.live, empty.used, empty.older, empty.younger) = (0, 0, older, NONE);
        if let Some(older) = self.blocks.get_mut(older as usize) {
            older.younger = block;
        }
        block
    }

    /// Takes a face out of the list of a vertex, from the block that it is in.
    #[inline]
    pub(super) fn remove(&mut self, vertex: VertexId, list: &mut List, block: u32, face: u32) {
        let found = &mut self.blocks[block as usize];
        let equal = equal_lanes(&found.faces, face) & found.live;
        if equal == 0 {
            return;
        }
        found.live ^= equal;
        let spoke = found.spoke(equal.trailing_zeros() as usize % ROOM);
        if found.live == 0 {
            let (older, younger) = (found.older, found.younger);
            self.unlink(list, block, older, younger);
        }
        list.count -= 1;
        if list.count & IS_HUB != 0 {
            self.remove_at_hub(vertex, list, spoke);
        }
    }

    #[cold]
    fn remove_at_hub(&mut self, vertex: VertexId, list: &mut List, spoke: Spoke) {
        self.at_hubs.remove([vertex, spoke.second, spoke.third]);
        if list.count() < HUB[0] {
            self.close_hub(vertex, list);
        }
    }

    fn unlink(&mut self, list: &mut List, block: u32, older: u32, younger: u32) {
        match self.blocks.get_mut(younger as usize) {
            Some(younger) => younger.older = older,
            None => list.youngest = older,
        }
        if let Some(older) = self.blocks.get_mut(older as usize) {
            older.younger = younger;
        }
        self.free.push(block);
    }

    #[cold]
    fn open_hub(&mut self, hub: VertexId, list: &mut List) {
        let spokes: Vec<Spoke> = self.at(*list).collect();
        for Spoke { face, second, third } in spokes {
            self.at_hubs.insert([hub, second, third], face);
        }
        list.count |= IS_HUB;
    }

    #[cold]
    fn close_hub(&mut self, hub: VertexId, list: &mut List) {
        let spokes: Vec<Spoke> = self.at(*list).collect();
        for Spoke { second, third, .. } in spokes {
            self.at_hubs.remove([hub, second, third]);
        }
        list.count &= !IS_HUB;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Lists against plain vectors, across the sizes at which a vertex becomes a hub and is one no more.
    #[test]
    fn lists_keep_their_order_at_any_length() {
        let mut seed = 7u64;
        let mut random = |end: usize| {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 33) as usize % end
        };
        let mut lists = Lists::new();
        let mut heads = [List::EMPTY; 2];
        let mut plain: [Vec<(Spoke, u32)>; 2] = [Vec::new(), Vec::new()];
        // Miri is a thousand times slower.
        let faces = if cfg!(miri) { 64 } else { 4000 };
        for face in 0..faces {
            let vertex = random(2);
            let id = VertexId(vertex as u32);
            // Grows at first, then shrinks.
            if random(10) < if face < 3 * faces / 8 { 8 } else { 3 } {
                let spoke = Spoke { face, second: VertexId(face + 7), third: VertexId(face + 9) };
                plain[vertex].push((spoke, lists.push(id, &mut heads[vertex], spoke)));
            } else if !plain[vertex].is_empty() {
                let (Spoke { face, second, third }, block) = plain[vertex].remove(random(plain[vertex].len()));
                lists.remove(id, &mut heads[vertex], block, face);
                assert_eq!(lists.meet(heads[vertex], [id, second, third]), Met::NOTHING);
            }
            assert_eq!(heads[vertex].count() as usize, plain[vertex].len());
            assert!(lists.at(heads[vertex]).eq(plain[vertex].iter().rev().map(|&(spoke, _)| spoke)));
            let across = |spoke: &Spoke| lists.find_across(heads[vertex], 24, true, spoke.third).is_some();
            assert!(plain[vertex].iter().rev().enumerate().all(|(age, (spoke, _))| across(spoke) == (age < 24)));
            if let Some((Spoke { face, second, third }, _)) = plain[vertex].first() {
                assert!(lists.meet(heads[vertex], [id, *second, *third]).is_there);
                assert_eq!(lists.meet(heads[vertex], [id, *third, *second]).mirrored, Some(*face));
            }
        }
    }
}
