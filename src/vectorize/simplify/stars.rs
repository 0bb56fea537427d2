//! Tets around each vertex, in one pool of numbers, for a mesh that shrinks.

use super::work_mesh::NONE;

/// A vertex's slot in the pool.
#[derive(Debug, Clone, Copy, Default)]
struct Slot {
    start: u32,
    len: u32,
    capacity: u32,
}

/// Tets around each vertex. A merged star is put where one of the old ones was, or at the pool's end; the pool is
/// packed when more than half of it is waste.
#[derive(Debug, Default)]
pub(super) struct Stars {
    slots: Vec<Slot>,
    pool: Vec<u32>,
    used: usize,
}

impl Stars {
    /// Builds the stars of `tets` over `vertices` vertices by a counting sort. Tets that have vanished have no corners.
    pub(super) fn new(vertices: usize, tets: &[[u32; 4]]) -> Self {
        let mut slots = vec![Slot::default(); vertices];
        let is_live = |v: &&u32| **v != NONE;
        for &v in tets.as_flattened().iter().filter(is_live) {
            slots[v as usize].capacity += 1;
        }
        let mut start = 0;
        for slot in &mut slots {
            slot.start = start;
            start += slot.capacity;
        }
        let mut pool = vec![0; start as usize];
        for (tet, corners) in tets.iter().enumerate() {
            for &v in corners.iter().filter(is_live) {
                let slot = &mut slots[v as usize];
                pool[(slot.start + slot.len) as usize] = tet as u32;
                slot.len += 1;
            }
        }
        Self { slots, used: pool.len(), pool }
    }

    #[inline]
    pub(super) fn star(&self, vertex: u32) -> &[u32] {
        let slot = self.slots[vertex as usize];
        &self.pool[slot.start as usize..(slot.start + slot.len) as usize]
    }

    /// Takes `tet` out of the star of `vertex`; the order of the others is kept.
    pub(super) fn remove(&mut self, vertex: u32, tet: u32) {
        let slot = &mut self.slots[vertex as usize];
        let star = &mut self.pool[slot.start as usize..(slot.start + slot.len) as usize];
        if let Some(at) = star.iter().position(|&t| t == tet) {
            star.copy_within(at + 1.., at);
            slot.len -= 1;
            self.used -= 1;
        }
    }

    /// Puts `tet` into the star of `vertex`.
    pub(super) fn add(&mut self, vertex: u32, tet: u32) {
        let mut slot = self.slots[vertex as usize];
        if slot.len == slot.capacity {
            let start = self.pool.len() as u32;
            self.pool.extend_from_within(slot.start as usize..(slot.start + slot.len) as usize);
            let capacity = slot.len + slot.len / 2 + 2;
            self.pool.resize((start + capacity) as usize, NONE);
            slot = Slot { start, len: slot.len, capacity };
        }
        self.pool[(slot.start + slot.len) as usize] = tet;
        slot.len += 1;
        self.used += 1;
        self.slots[vertex as usize] = slot;
        if self.pool.len() > 2 * self.used + 1024 {
            self.pack();
        }
    }

    /// Makes `star` the star of `kept` and empties that of `gone`.
    pub(super) fn merge(&mut self, kept: u32, gone: u32, star: &[u32]) {
        let (a, b) = (self.slots[kept as usize], self.slots[gone as usize]);
        self.used -= (a.len + b.len) as usize;
        self.used += star.len();
        self.slots[gone as usize] = Slot::default();
        let len = star.len() as u32;
        let mut slot = if a.capacity >= b.capacity { a } else { b };
        if slot.capacity < len {
            slot = Slot { start: self.pool.len() as u32, len, capacity: len };
            self.pool.extend_from_slice(star);
        } else {
            self.pool[slot.start as usize..(slot.start + len) as usize].copy_from_slice(star);
            slot.len = len;
        }
        self.slots[kept as usize] = slot;
        if self.pool.len() > 2 * self.used + 1024 {
            self.pack();
        }
    }

    fn pack(&mut self) {
        let mut pool = Vec::with_capacity(self.used + self.used / 2);
        for slot in &mut self.slots {
            let start = pool.len() as u32;
            pool.extend_from_slice(&self.pool[slot.start as usize..(slot.start + slot.len) as usize]);
            *slot = Slot { start, len: slot.len, capacity: slot.len };
        }
        self.pool = pool;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn merging_keeps_stars_through_packing() {
        let tets: Vec<[u32; 4]> = (0..2000).map(|t| [t, t + 1, t + 2, t + 3]).collect();
        let mut stars = Stars::new(2003, &tets);
        assert_eq!(stars.star(5), [2, 3, 4, 5]);
        for round in 0..400 {
            let (kept, gone) = (1000, 1001 + round);
            let mut star = stars.star(kept).to_vec();
            star.extend(stars.star(gone).iter().filter(|t| !stars.star(kept).contains(t)));
            stars.merge(kept, gone, &star);
            assert_eq!(stars.star(kept), star);
            assert!(stars.star(gone).is_empty());
        }
        assert_eq!(stars.star(2), [0, 1, 2]);
        stars.remove(2, 1);
        assert_eq!(stars.star(2), [0, 2]);
        (3000..6000).for_each(|tet| stars.add(2, tet));
        assert_eq!(stars.star(2).len(), 3002);
        assert_eq!(stars.star(2)[..4], [0, 2, 3000, 3001]);
        assert_eq!(stars.star(1), [0, 1]);
    }
}
