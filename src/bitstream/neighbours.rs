//! Which wedges are neighbours: what colours are predicted from.
//!
//! In: edges between wedges of one label, as tets are coded. Out: the neighbours of a wedge that are older than it.
//! Forbidden here: colours.
//!
//! Only wedges whose colours are to come are looked up, so all is forgotten after each packet.

/// End of a list.
const NONE: u32 = u32::MAX;

/// Older neighbours of the wedges since [`Self::clear`].
#[derive(Debug, Clone, Default)]
pub(super) struct Neighbours {
    /// Wedges before this one are not listed.
    first: u32,
    /// Per wedge from there on the last entry of its list.
    last: Vec<u32>,
    /// Neighbours, and the entry before in the same list.
    entries: Vec<(u32, u32)>,
}

impl Neighbours {
    /// Adds the next wedge.
    pub(super) fn push_wedge(&mut self) {
        self.last.push(NONE);
    }

    /// Lists the older one of two wedges with the younger one.
    #[inline]
    pub(super) fn push(&mut self, one: u32, other: u32) {
        let (older, younger) = (one.min(other), one.max(other));
        if younger >= self.first {
            let last = &mut self.last[(younger - self.first) as usize];
            self.entries.push((older, std::mem::replace(last, self.entries.len() as u32)));
        }
    }

    /// Older neighbours of a wedge as often as they were listed, the last ones first.
    #[inline]
    pub(super) fn of(&self, wedge: u32) -> impl Iterator<Item = u32> + '_ {
        let mut entry = self.last[(wedge - self.first) as usize];
        std::iter::from_fn(move || {
            let &(neighbour, before) = self.entries.get(entry as usize)?;
            entry = before;
            Some(neighbour)
        })
    }

    /// Forgets all wedges, of which there are `count`.
    pub(super) fn clear(&mut self, count: u32) {
        self.first = count;
        self.last.clear();
        self.entries.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_older_wedge_is_listed_with_the_younger_one() {
        let mut neighbours = Neighbours::default();
        (0..4).for_each(|_| neighbours.push_wedge());
        for [one, other] in [[0, 2], [2, 1], [3, 0], [2, 0]] {
            neighbours.push(one, other);
        }
        assert!(neighbours.of(2).eq([0, 1, 0]));
        assert!(neighbours.of(3).eq([0]));
        assert_eq!(neighbours.of(0).next(), None);
        neighbours.clear(4);
        neighbours.push_wedge();
        neighbours.push(4, 3);
        neighbours.push(1, 2);
        assert!(neighbours.of(4).eq([3]));
    }
}
