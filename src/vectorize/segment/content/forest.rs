//! Which items hang together: disjoint sets as trees (Galler and Fischer 1964).

/// No number.
pub(super) const NONE: u32 = u32::MAX;

/// Items, each at first a tree of its own.
#[derive(Debug, Clone)]
pub(super) struct Forest(Vec<u32>);

impl Forest {
    /// Of so many items.
    pub(super) fn new(items: usize) -> Self {
        Self((0..items as u32).collect())
    }

    /// The root of an item's tree, whose paths are halved on the way.
    pub(super) fn root(&mut self, mut item: u32) -> u32 {
        while self.0[item as usize] != item {
            self.0[item as usize] = self.0[self.0[item as usize] as usize];
            item = self.0[item as usize];
        }
        item
    }

    /// Joins two trees under the lower root.
    pub(super) fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b) as usize] = a.min(b);
    }

    /// Numbers the trees that have one of the items `wanted`, in the order in which these come, from `first` on: the
    /// number of every item's tree, [`NONE`] where none is wanted, and the number after the last.
    pub(super) fn number(mut self, wanted: impl Iterator<Item = u32>, first: u32) -> (Vec<u32>, u32) {
        let mut numbers = vec![NONE; self.0.len()];
        let mut next = first;
        for item in wanted {
            let number = &mut numbers[self.root(item) as usize];
            if *number == NONE {
                *number = next;
                next += 1;
            }
        }
        // Roots keep their own.
        for item in 0..self.0.len() as u32 {
            numbers[item as usize] = numbers[self.root(item) as usize];
        }
        (numbers, next)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trees_are_numbered_as_they_are_wanted() {
        let mut forest = Forest::new(7);
        for (a, b) in [(5, 2), (6, 5), (3, 1)] {
            forest.join(a, b);
        }
        assert_eq!(forest.number([6, 0, 5].into_iter(), 4), (vec![5, NONE, 4, NONE, NONE, 4, 4], 6));
    }
}
