//! Lines of the adaptive lattice along one axis.
//!
//! In: how many pixels or frames there are. Out: where each line lies and which samples it reads. The lines are the
//! dense lattice's and a few more, since cells of [`CELL`] steps must fill the axis exactly: the last steps are halved
//! (or, on a short axis, divided further). Forbidden here: pixels.

/// Steps along each side of a cell of the coarsest level; a power of two.
pub(super) const CELL: usize = 8;

/// A line of the lattice.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Line {
    /// Its coordinate in lattice units.
    pub(super) place: i32,
    /// The sample (pixel column, pixel row or plane) at or before it.
    pub(super) low: usize,
    /// The sample at or after it.
    pub(super) high: usize,
    /// Share of `high` in the value there.
    pub(super) share: f32,
}

impl Line {
    /// The sample that it goes through, if it goes through one.
    pub(super) fn sample(&self) -> Option<usize> {
        (self.low == self.high).then_some(self.low)
    }
}

/// The lines of an axis; their number less one is a multiple of [`CELL`].
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Axis {
    lines: Vec<Line>,
}

impl Axis {
    /// Lines over a row of `side` pixels: at their centres, the outermost at the sides.
    pub(super) fn of_pixels(side: u32, unit: i32) -> Self {
        let samples = side.max(2) as usize;
        let places: Vec<i32> = (0..samples).map(|n| super::place_sample(n, samples, side, unit)).collect();
        let centre = |place: i32| (place as f32 / unit as f32 - 0.5).clamp(0.0, (side - 1) as f32);
        Self::through(&places, centre)
    }

    /// Lines over planes at these times, ascending, in lattice units.
    pub(super) fn of_planes(times: &[i32]) -> Self {
        let sample = |place: i32| {
            let after = times.partition_point(|&time| time < place).max(1);
            let [low, high] = [times[after - 1], times[after]];
            (after - 1) as f32 + (place - low) as f32 / (high - low) as f32
        };
        Self::through(times, sample)
    }

    /// Lines through all of `places`; `sample` gives the fractional sample at a coordinate.
    fn through(places: &[i32], sample: impl Fn(i32) -> f32) -> Self {
        let parts = parts(places.len() - 1);
        let mut lines = Vec::new();
        let mut push = |place: i32| {
            let at = sample(place);
            let low = at.floor();
            lines.push(Line { place, low: low as usize, high: at.ceil() as usize, share: at - low });
        };
        for (pair, &parts) in places.windows(2).zip(&parts) {
            let step = pair[1] - pair[0];
            for n in 0..parts {
                push(pair[0] + divide(step, n, parts));
            }
        }
        push(places[places.len() - 1]);
        Self { lines }
    }

    /// Steps between lines.
    pub(super) fn steps(&self) -> usize {
        self.lines.len() - 1
    }

    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }
}

/// Into how many parts each of `steps` steps is divided, so that the parts fill cells: the last ones, a power of two
/// each, as even as can be.
fn parts(steps: usize) -> Vec<i32> {
    let mut parts = vec![1; steps];
    let mut missing = steps.next_multiple_of(CELL) - steps;
    let mut at = steps;
    while missing > 0 {
        at = if at == 0 { steps - 1 } else { at - 1 };
        missing -= parts[at] as usize;
        parts[at] *= 2;
    }
    parts
}

/// `n` of `parts` parts of `step`, of equal size but for the long step at the picture's side, which is cut at the
/// pixel's centre: so all steps are multiples of half a pixel where that is possible.
fn divide(step: i32, n: i32, parts: i32) -> i32 {
    if parts == 2 && n == 1 && step % 8 != 0 { step - step / 3 * 2 } else { step * n / parts }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frames(first: i32, count: usize) -> Vec<i32> {
        (first..).map(|frame| 8 * frame).take(count).collect()
    }

    /// In lattice units.
    fn shortest_step(axis: &Axis) -> i32 {
        axis.lines().windows(2).map(|pair| pair[1].place - pair[0].place).min().unwrap_or(0)
    }

    #[test]
    fn lines_ascend_and_fill_cells_at_any_size() {
        for side in (1..60).chain([640, 641, 1001, 1920]) {
            for axis in [Axis::of_pixels(side, 8), Axis::of_planes(&frames(7, side as usize + 1))] {
                assert_eq!(axis.steps() % CELL, 0);
                assert!(shortest_step(&axis) > 0, "{side}");
                let last = axis.lines()[axis.steps()];
                assert!(side < 5 || shortest_step(&axis) >= 4, "{side}: {}", shortest_step(&axis));
                assert!(axis.lines().iter().all(|l| l.low <= l.high && l.high <= last.high));
            }
            let axis = Axis::of_pixels(side, 8);
            assert_eq!([axis.lines()[0].place, axis.lines()[axis.steps()].place], [0, 8 * side as i32]);
            assert_eq!(axis.lines()[axis.steps()].low, side as usize - 1);
        }
    }

    #[test]
    fn a_line_between_samples_reads_both() {
        let axis = Axis::of_planes(&frames(3, 6));
        let places: Vec<i32> = axis.lines().iter().map(|line| line.place).collect();
        assert_eq!(places, [24, 32, 40, 44, 48, 52, 56, 60, 64]);
        assert_eq!(axis.lines()[3], Line { place: 44, low: 2, high: 3, share: 0.5 });
        assert_eq!(axis.lines()[4], Line { place: 48, low: 3, high: 3, share: 0.0 });
    }

    #[test]
    fn planes_between_frames_are_samples_too() {
        let mut times = frames(1, 6);
        times.extend([44, 36, 28]);
        times.sort_unstable();
        let axis = Axis::of_planes(&times);
        let read: Vec<(i32, usize, usize)> = axis.lines().iter().map(|l| (l.place, l.low, l.high)).collect();
        assert_eq!(read, (0..9).map(|n| (times[n], n, n)).collect::<Vec<_>>());
    }
}
