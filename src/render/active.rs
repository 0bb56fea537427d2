//! Which tets a plane cuts, found from those that the last plane cut.
//!
//! In: the times of tets, in a list that grows at its end, and planes. Out: the tets that are cut, ascending. Going on in
//! time costs as much as there are tets in the two slices; going back or jumping, a look at all tets.

use super::refiner::Span;

/// Tets cut by the last plane, and where to find those that begin after it.
#[derive(Debug, Default)]
pub(super) struct Active {
    /// Fine units of time from a list of `beginning` to the next; a power of two, given by its exponent.
    shift: u32,
    /// The last plane; nothing is known before the first.
    plane: Option<i32>,
    /// Tets cut by it, ascending, of those taken in.
    tets: Vec<u32>,
    /// Tets by the time that they begin at, each list ascending.
    beginning: Vec<Vec<u32>>,
    /// How many tets are in `beginning`.
    taken: usize,
}

impl Active {
    /// Nothing yet; planes are expected to be about `step` fine units apart.
    pub(super) fn new(step: i32) -> Self {
        Self { shift: step.max(1).ilog2(), ..Self::default() }
    }

    /// The tets that the plane at `t` cuts, ascending. `spans` are those of the last call, and others behind them.
    pub(super) fn cut(&mut self, spans: &[Span], t: i32) -> &[u32] {
        let first_new = self.taken as u32;
        for (tet, span) in (first_new..).zip(&spans[self.taken..]) {
            let slot = self.slot(span.low());
            if slot >= self.beginning.len() {
                self.beginning.resize_with(slot + 1, Vec::new);
            }
            self.beginning[slot].push(tet);
        }
        self.taken = spans.len();
        match self.plane {
            Some(last) if last <= t => self.advance(spans, last, t, first_new),
            _ => {
                self.tets.clear();
                self.tets.extend((0..spans.len() as u32).filter(|&tet| spans[tet as usize].is_cut(t)));
            }
        }
        self.plane = Some(t);
        &self.tets
    }

    /// Drops what ends before `t`, adds what begins from `last` on and what is new.
    fn advance(&mut self, spans: &[Span], last: i32, t: i32, first_new: u32) {
        self.tets.retain(|&tet| spans[tet as usize].is_cut(t));
        let mut added: Vec<u32> = Vec::new();
        let slots = self.slot(last)..(self.slot(t) + 1).min(self.beginning.len());
        for slot in slots {
            let begun = self.beginning[slot].iter().filter(|&&tet| tet < first_new);
            added.extend(begun.filter(|&&tet| spans[tet as usize].low() >= last && spans[tet as usize].is_cut(t)));
        }
        added.extend((first_new..spans.len() as u32).filter(|&tet| spans[tet as usize].is_cut(t)));
        if added.is_empty() {
            return;
        }
        // Two runs that are nearly sorted.
        self.tets.extend(added);
        self.tets.sort();
    }

    fn slot(&self, low: i32) -> usize {
        (low.max(0) >> self.shift) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::random;

    #[test]
    fn every_way_through_time_finds_what_a_search_finds() {
        let mut random = random::below::<u64>(9);
        let mut spans = Vec::new();
        let mut active = Active::new(64);
        let mut t = 0;
        for _ in 0..400 {
            for _ in 0..random(20) {
                let low = random(3000) as i32 - 5;
                spans.push(Span::new(low, low + random(900) as i32));
            }
            t = match random(8) {
                0 => random(3000) as i32,
                1 => t,
                _ => t + random(130) as i32,
            };
            let expected: Vec<u32> = (0..spans.len() as u32).filter(|&tet| spans[tet as usize].is_cut(t)).collect();
            assert_eq!(active.cut(&spans, t), expected, "at {t}");
        }
    }
}
