//! Pixels that label boundaries pass, numbered.
//!
//! In: crossings. Out: a set of pixels for each frame, with a number for each over all frames.

use std::ops::Range;

use super::interface::Crossing;

/// Marked pixels of all frames.
#[derive(Debug, Clone, Default)]
pub(super) struct Marks {
    first_frame: u32,
    frames: Vec<FrameMarks>,
    count: u32,
}

/// Marked pixels of a frame, a bit each.
#[derive(Debug, Clone)]
pub(super) struct FrameMarks {
    /// Words of a row of pixels.
    words_a_row: usize,
    words: Vec<u64>,
    /// Number of the first marked pixel at or after each word's start.
    ranks: Vec<u32>,
}

impl Marks {
    /// Marks the pixels of `crossings` in frames of this size.
    pub(super) fn new(crossings: &[Crossing], width: u32, height: u32) -> Self {
        let frames = || crossings.iter().map(|c| c.frame);
        let (Some(first_frame), Some(last)) = (frames().min(), frames().max()) else { return Self::default() };
        let words_a_row = width.div_ceil(u64::BITS) as usize;
        let empty = FrameMarks { words_a_row, words: vec![0; words_a_row * height as usize], ranks: Vec::new() };
        let mut marks = Self { first_frame, frames: vec![empty; (last - first_frame) as usize + 1], count: 0 };
        for c in crossings {
            let word = c.y as usize * words_a_row + (c.x / u64::BITS) as usize;
            marks.frames[(c.frame - first_frame) as usize].words[word] |= 1 << (c.x % u64::BITS);
        }
        for frame in &mut marks.frames {
            let count = &mut marks.count;
            let rank = |word: &u64| {
                let rank = *count;
                *count += word.count_ones();
                rank
            };
            frame.ranks = frame.words.iter().map(rank).collect();
        }
        marks
    }

    /// How many pixels are marked.
    pub(super) fn count(&self) -> usize {
        self.count as usize
    }

    /// The marks of a frame, if it may have any.
    pub(super) fn frame(&self, frame: u32) -> Option<&FrameMarks> {
        self.frames.get(frame.checked_sub(self.first_frame)? as usize)
    }

    /// Calls `found(frame, x, y)` for all marked pixels in the order of their numbers.
    pub(super) fn for_each(&self, mut found: impl FnMut(u32, u32, u32)) {
        for (frame, marks) in (self.first_frame..).zip(&self.frames) {
            for (n, &word) in marks.words.iter().enumerate() {
                let (y, x) = ((n / marks.words_a_row) as u32, (n % marks.words_a_row) as u32 * u64::BITS);
                bits(word).for_each(|bit| found(frame, x + bit, y));
            }
        }
    }
}

impl FrameMarks {
    /// Whether a row has marked pixels.
    #[inline]
    pub(super) fn any_in_row(&self, y: u32) -> bool {
        self.row(y).iter().any(|&word| word != 0)
    }

    /// The number of a pixel that is marked.
    #[inline]
    pub(super) fn number(&self, x: u32, y: u32) -> u32 {
        let word = y as usize * self.words_a_row + (x / u64::BITS) as usize;
        self.ranks[word] + (self.words[word] & below(x % u64::BITS)).count_ones()
    }

    /// Calls `found(x, number)` for the marked pixels among some of a row.
    #[inline]
    pub(super) fn marked(&self, y: u32, columns: Range<u32>, mut found: impl FnMut(u32, u32)) {
        self.words_within(y, columns, |start, word| {
            bits(word).for_each(|bit| found(start + bit, self.number(start + bit, y)));
        });
    }

    /// Calls `run` for the runs of pixels that are not marked among some of a row.
    #[inline]
    pub(super) fn unmarked(&self, y: u32, columns: Range<u32>, mut run: impl FnMut(Range<u32>)) {
        let mut from = columns.start;
        self.words_within(y, columns.clone(), |start, word| {
            for bit in bits(word) {
                if from < start + bit {
                    run(from..start + bit);
                }
                from = start + bit + 1;
            }
        });
        if from < columns.end {
            run(from..columns.end);
        }
    }

    fn row(&self, y: u32) -> &[u64] {
        &self.words[y as usize * self.words_a_row..(y as usize + 1) * self.words_a_row]
    }

    /// The words of a row that are not empty, with the column of their first bit, bits outside `columns` cleared.
    #[inline]
    fn words_within(&self, y: u32, columns: Range<u32>, mut found: impl FnMut(u32, u64)) {
        if columns.is_empty() {
            return;
        }
        let row = self.row(y);
        let words = (columns.start / u64::BITS) as usize..=((columns.end - 1) / u64::BITS) as usize;
        for n in words {
            let start = n as u32 * u64::BITS;
            let low = below(columns.start.saturating_sub(start));
            let high = if columns.end - start >= u64::BITS { u64::MAX } else { below(columns.end - start) };
            let word = row[n] & high & !low;
            if word != 0 {
                found(start, word);
            }
        }
    }
}

/// The bits below bit `bit` (less than 64).
#[inline]
fn below(bit: u32) -> u64 {
    (1 << bit) - 1
}

/// The numbers of the set bits, ascending.
#[inline]
fn bits(mut word: u64) -> impl Iterator<Item = u32> {
    std::iter::from_fn(move || {
        if word == 0 {
            return None;
        }
        let bit = word.trailing_zeros();
        word &= word - 1;
        Some(bit)
    })
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;

    #[test]
    fn numbers_and_runs_agree_with_the_set() {
        let pixels = [(0, 1), (63, 1), (64, 1), (130, 1), (5, 0), (6, 0)];
        let at = |frame, (x, y)| Crossing { frame, x, y, interface: 0, share: Vec3::ZERO };
        let crossings: Vec<Crossing> = (3..5).flat_map(|frame| pixels.map(|p| at(frame, p))).collect();
        let marks = Marks::new(&crossings, 131, 2);
        assert_eq!(marks.count(), 12);
        assert!(marks.frame(2).is_none() && marks.frame(5).is_none());
        let mut all = Vec::new();
        marks.for_each(|frame, x, y| all.push((frame, x, y)));
        for (number, &(frame, x, y)) in all.iter().enumerate() {
            assert_eq!(marks.frame(frame).unwrap().number(x, y), number as u32);
        }
        let frame = marks.frame(4).unwrap();
        let (mut runs, mut marked) = (Vec::new(), Vec::new());
        frame.unmarked(1, 0..131, |run| runs.push(run));
        frame.marked(1, 1..130, |x, _| marked.push(x));
        assert_eq!(runs, [1..63, 65..130]);
        assert_eq!(marked, [63, 64]);
        frame.unmarked(0, 5..7, |run| panic!("all are marked, found {run:?}"));
    }
}
