//! Regions, the seams between them, and greedy merging.
//!
//! In: seams. Out: which region each has become part of. Forbidden here: pixels, colours, labels.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BinaryHeap};

/// What speaks for a boundary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seam {
    /// For staying if positive, summed over the boundary's pixel sides.
    pub(super) margin: f32,
    /// What it is worth to keep, in levels, summed over the boundary's pixel sides.
    pub(super) worth: f32,
    /// Pixel sides.
    pub(super) length: f32,
}

impl Seam {
    fn strength(self) -> f32 {
        self.margin / self.length
    }

    fn joined(self, other: Self) -> Self {
        Self { margin: self.margin + other.margin, worth: self.worth + other.worth, length: self.length + other.length }
    }
}

/// Regions and the seams between them. Merged regions live on under the lower of their places.
pub(super) struct RegionGraph {
    parents: Vec<u32>,
    seams: Vec<BTreeMap<u32, Seam>>,
}

/// An entry of a queue: the lowest value first, then the lowest places.
#[derive(PartialEq)]
struct Due(f32, u32, u32);

impl Eq for Due {}

impl Ord for Due {
    fn cmp(&self, other: &Self) -> Ordering {
        other.0.total_cmp(&self.0).then((other.1, other.2).cmp(&(self.1, self.2)))
    }
}

impl PartialOrd for Due {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl RegionGraph {
    pub(super) fn new(count: usize) -> Self {
        Self { parents: (0..count as u32).collect(), seams: vec![BTreeMap::new(); count] }
    }

    pub(super) fn add(&mut self, a: u32, b: u32, seam: Seam) {
        for (from, to) in [(a, b), (b, a)] {
            self.seams[from as usize].entry(to).and_modify(|old| *old = old.joined(seam)).or_insert(seam);
        }
    }

    fn root(&self, mut region: u32) -> u32 {
        while self.parents[region as usize] != region {
            region = self.parents[region as usize];
        }
        region
    }

    /// Replaces each group by the region that it is part of now.
    pub(super) fn name(&self, groups: &mut [u32]) {
        groups.iter_mut().for_each(|group| *group = self.root(*group));
    }

    fn queue(&self) -> BinaryHeap<Due> {
        let all = self.seams.iter().zip(0..).flat_map(|(seams, a)| seams.iter().map(move |(&b, seam)| (seam, a, b)));
        all.filter(|&(_, a, b)| a < b).map(|(seam, a, b)| Due(seam.strength(), a, b)).collect()
    }

    /// Merges pairs of regions across seams weaker than `strength`, the weakest first, each region at most once.
    /// Whether there was one.
    pub(super) fn merge_pairs_below(&mut self, strength: f32) -> bool {
        let mut merged = vec![false; self.parents.len()];
        let mut queue = self.queue();
        while let Some(Due(found, a, b)) = queue.pop() {
            if found >= strength {
                break;
            }
            if !merged[a as usize] && !merged[b as usize] {
                self.join(a, b);
                (merged[a as usize], merged[b as usize]) = (true, true);
            }
        }
        merged.contains(&true)
    }

    /// Merges across the weakest seam until none is weaker than `strength`.
    pub(super) fn merge_seams_below(&mut self, strength: f32) {
        let mut queue = self.queue();
        while let Some(Due(found, a, b)) = queue.pop() {
            if found >= strength {
                break;
            }
            if self.seams[a as usize].get(&b).is_none_or(|seam| seam.strength() != found) {
                continue;
            }
            self.join(a, b);
            let seams = &self.seams[a as usize];
            queue.extend(seams.iter().map(|(&n, seam)| Due(seam.strength(), a.min(n), a.max(n))));
        }
    }

    /// Merges the region whose seams are worth least with the neighbour across its weakest one, until every region's
    /// are worth at least `worth`.
    pub(super) fn merge_regions_worth_less(&mut self, worth: f32) {
        let mut queue: BinaryHeap<Due> =
            (0..self.seams.len() as u32).filter(|&r| !self.seams[r as usize].is_empty()).map(|r| self.due(r)).collect();
        while let Some(due) = queue.pop() {
            if due.0 >= worth {
                break;
            }
            let region = due.1;
            if self.parents[region as usize] != region || self.due(region) != due {
                continue;
            }
            let weakest = self.seams[region as usize].iter().map(|(&n, seam)| (seam.strength(), n));
            let Some((_, neighbor)) = weakest.min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) else { continue };
            let kept = region.min(neighbor);
            self.join(kept, region.max(neighbor));
            queue.push(self.due(kept));
            queue.extend(self.seams[kept as usize].keys().map(|&n| self.due(n)));
        }
    }

    fn due(&self, region: u32) -> Due {
        Due(self.seams[region as usize].values().map(|seam| seam.worth).sum(), region, region)
    }

    /// Takes region `b` into `a`.
    fn join(&mut self, a: u32, b: u32) {
        self.parents[b as usize] = a;
        for (n, seam) in std::mem::take(&mut self.seams[b as usize]) {
            self.seams[n as usize].remove(&b);
            if n != a {
                self.add(a, n, seam);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{RegionGraph, Seam};

    /// Four regions in a row with seams of these strengths, 10 pixel sides each.
    fn row(strengths: [f32; 3]) -> RegionGraph {
        let mut graph = RegionGraph::new(4);
        for (a, strength) in (0..).zip(strengths) {
            graph.add(a, a + 1, Seam { margin: strength * 10.0, worth: strength * 10.0, length: 10.0 });
        }
        graph
    }

    fn named(graph: &RegionGraph) -> Vec<u32> {
        let mut groups = vec![0, 1, 2, 3];
        graph.name(&mut groups);
        groups
    }

    #[test]
    fn weak_seams_go_and_parallel_ones_count_together() {
        let mut graph = row([-5.0, 3.0, -4.0]);
        graph.merge_seams_below(0.0);
        assert_eq!(named(&graph), [0, 0, 2, 2]);
        // The seams 0-2 (3) and 1-2 (-2) become one of strength 0.5 when 0 and 1 merge.
        let mut graph = row([-5.0, -2.0, 3.0]);
        graph.add(0, 2, Seam { margin: 30.0, worth: 30.0, length: 10.0 });
        graph.merge_seams_below(0.0);
        assert_eq!(named(&graph), [0, 0, 2, 3]);
    }

    #[test]
    fn pairs_take_part_once() {
        let mut graph = row([-5.0, -6.0, -4.0]);
        assert!(graph.merge_pairs_below(0.0));
        assert_eq!(named(&graph), [0, 1, 1, 3]);
        assert!(!row([1.0, 1.0, 1.0]).merge_pairs_below(0.0));
    }

    #[test]
    fn regions_of_little_worth_join_across_their_weakest_seam() {
        let mut graph = row([9.0, 2.0, 20.0]);
        graph.merge_regions_worth_less(100.0);
        assert_eq!(named(&graph), [0, 0, 0, 3]);
        let mut graph = row([1.0, 1.0, 1.0]);
        graph.merge_regions_worth_less(f32::INFINITY);
        assert_eq!(named(&graph), [0; 4]);
    }
}
