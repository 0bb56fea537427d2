//! When pictures are shown: one a packet, or on a grid of k / framerate from time 0. In: the packets' times. Out: the
//! times of their pictures. Forbidden here: buffers, segments, clocks.
//!
//! A grid from time 0 gives the same pictures whatever was sought before. What was last shown is remembered, so that
//! the rate may change in the middle of a packet and no two pictures overlap.

use gst::ClockTime;

/// The time that a packet covers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Span {
    /// What the packet is stamped with.
    stamp: ClockTime,
    /// First moment: the stamp, or nearby where that closes a hole.
    pub(super) start: ClockTime,
    /// First moment after; `None` where the packet's length is unknown.
    pub(super) end: Option<ClockTime>,
}

/// A picture to show.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Picture {
    /// When to show it.
    pub(super) time: ClockTime,
    /// How long; `None` where that is unknown.
    pub(super) duration: Option<ClockTime>,
    /// The part of its packet that has passed, in [0, 1).
    pub(super) position: f64,
}

/// Which way the stream is played.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// Time rises.
    Forward,
    /// Time falls.
    Reverse,
}

/// Chooses the times of pictures.
#[derive(Debug, Default)]
pub(super) struct Schedule {
    /// Frames a second of the grid; `None`: one picture a packet.
    grid: Option<gst::Fraction>,
    /// Start of the last picture.
    shown_from: Option<ClockTime>,
    /// End of the last picture.
    shown_to: Option<ClockTime>,
    /// Whether the last picture was on a grid.
    on_grid: bool,
    /// End of the last packet admitted.
    packet_end: Option<ClockTime>,
    /// Start of the last group admitted.
    group_start: Option<ClockTime>,
}

impl Schedule {
    /// Sets the rate to show at beside the stream's own. The same rate, or an unknown one, means one picture a packet.
    pub(super) fn set_rates(&mut self, stream: gst::Fraction, output: gst::Fraction) {
        self.grid = (stream != output && output.numer() > 0).then_some(output);
    }

    /// End of the last packet.
    pub(super) fn end(&self) -> Option<ClockTime> {
        self.packet_end
    }

    /// Forgets what was shown; the rate stays.
    pub(super) fn reset(&mut self) {
        *self = Self { grid: self.grid, ..Self::default() };
    }

    /// Takes the next packet in the order of the stream. Holes and overlaps by the rounding of stamps are closed: up to
    /// half a packet a packet starts where the last one ended. Stamps that start again are a new timeline.
    pub(super) fn admit(&mut self, start: ClockTime, duration: Option<ClockTime>, discont: bool) -> Span {
        let (stamp, end) = (start, duration.and_then(|duration| start.checked_add(duration)));
        let tolerance = duration.unwrap_or(ClockTime::ZERO) / 2;
        let start = match self.packet_end {
            Some(last) if !discont && last.absdiff(start) <= tolerance => last,
            Some(last) if start < last => {
                self.reset();
                start
            }
            _ => start,
        };
        self.packet_end = end;
        Span { stamp, start, end: end.map(|end| end.max(start)) }
    }

    /// Takes a group of packets that is shown backwards, given as (start, duration) in ascending order. Holes are closed
    /// as in [`Self::admit`], here by moving ends, the last one to the start of the group shown before.
    pub(super) fn admit_group(&mut self, packets: &[(ClockTime, Option<ClockTime>)]) -> Vec<Span> {
        let mut follower = self.group_start;
        let mut spans: Vec<Span> = Vec::with_capacity(packets.len());
        for &(start, duration) in packets.iter().rev() {
            let tolerance = duration.unwrap_or(ClockTime::ZERO) / 2;
            let end = duration.and_then(|duration| start.checked_add(duration));
            let end = match (end, follower) {
                (Some(end), Some(follower)) if follower.absdiff(end) <= tolerance => Some(follower.max(start)),
                _ => end,
            };
            follower = Some(start);
            spans.push(Span { stamp: start, start, end });
        }
        self.group_start = follower;
        spans.reverse();
        spans
    }

    /// The next picture of a packet; `None` when it has no more.
    pub(super) fn next(&mut self, span: Span, direction: Direction, single: bool) -> Option<Picture> {
        match (self.grid, direction) {
            (Some(rate), Direction::Forward) if !single => self.next_on_grid(span, rate),
            (Some(rate), Direction::Reverse) if !single => self.previous_on_grid(span, rate),
            (_, direction) => self.next_single(span, direction),
        }
    }

    fn next_single(&mut self, span: Span, direction: Direction) -> Option<Picture> {
        let shown = match direction {
            Direction::Forward => self.shown_from.is_some_and(|last| span.stamp <= last),
            Direction::Reverse => self.shown_from.is_some_and(|last| span.stamp >= last),
        };
        // Stamps leave as they came, but for a packet whose first part a grid has shown.
        let start = match (self.shown_to, direction) {
            (Some(to), Direction::Forward) if self.on_grid => span.stamp.max(to),
            _ => span.stamp,
        };
        if shown || (start > span.stamp && span.end.is_some_and(|end| start >= end)) {
            return None;
        }
        (self.shown_from, self.shown_to, self.on_grid) = (Some(start), span.end, false);
        let duration = span.end.map(|end| end.saturating_sub(start));
        Some(Picture { time: start, duration, position: position(start, span) })
    }

    fn next_on_grid(&mut self, span: Span, rate: gst::Fraction) -> Option<Picture> {
        let mut from = span.start;
        if let Some(last) = self.shown_from {
            from = from.max(self.shown_to.or_else(|| last.checked_add(ClockTime::NSECOND))?);
        }
        let number = first_number(from, rate)?;
        let (time, next) = (grid_time(number, rate)?, grid_time(number.checked_add(1)?, rate)?);
        self.show(span.end.map_or(self.shown_from < Some(span.start), |end| time < end), time, next, span)
    }

    fn previous_on_grid(&mut self, span: Span, rate: gst::Fraction) -> Option<Picture> {
        let mut before = span.end.or_else(|| grid_time(first_number(span.start, rate)?.checked_add(1)?, rate))?;
        if let Some(last) = self.shown_from {
            before = before.min(last);
        }
        let number = first_number(before, rate)?.checked_sub(1)?;
        let (time, next) = (grid_time(number, rate)?, grid_time(number.checked_add(1)?, rate)?);
        self.show(time >= span.start, time, next, span)
    }

    fn show(&mut self, within: bool, time: ClockTime, next: ClockTime, span: Span) -> Option<Picture> {
        if !within {
            return None;
        }
        (self.shown_from, self.shown_to, self.on_grid) = (Some(time), Some(next), true);
        Some(Picture { time, duration: Some(next.saturating_sub(time)), position: position(time, span) })
    }
}

/// Where `time` lies in `span`, in [0, 1).
fn position(time: ClockTime, span: Span) -> f64 {
    let Some(length) = span.end.map(|end| end.saturating_sub(span.start)).filter(|length| !length.is_zero()) else {
        return 0.0;
    };
    (time.saturating_sub(span.start).nseconds() as f64 / length.nseconds() as f64).clamp(0.0, 1.0 - f64::EPSILON)
}

/// Time of picture `number` on the grid, rounded down; `None` beyond what a clock can tell.
fn grid_time(number: u64, rate: gst::Fraction) -> Option<ClockTime> {
    let second = ClockTime::SECOND.nseconds() as i128;
    let time = i128::from(number) * second * i128::from(rate.denom()) / i128::from(rate.numer());
    u64::try_from(time).ok().filter(|&time| time < u64::MAX).map(ClockTime::from_nseconds)
}

/// Number of the first picture on the grid at or after `time`.
fn first_number(time: ClockTime, rate: gst::Fraction) -> Option<u64> {
    let second = ClockTime::SECOND.nseconds() as i128;
    let (scaled, unit) = (i128::from(time.nseconds()) * i128::from(rate.numer()), second * i128::from(rate.denom()));
    // floor(k * unit / n) >= time: k >= time * n / unit, as time is whole.
    u64::try_from((scaled + unit - 1) / unit).ok()
}

#[cfg(test)]
mod tests {
    use super::{Direction, Schedule};
    use gst::ClockTime;

    fn ms(milliseconds: u64) -> ClockTime {
        ClockTime::from_mseconds(milliseconds)
    }

    fn schedule(stream: (i32, i32), output: (i32, i32)) -> Schedule {
        let mut schedule = Schedule::default();
        schedule.set_rates(stream.into(), output.into());
        schedule
    }

    /// Times of all pictures of packets 0..count at `rate`, stamped in whole milliseconds.
    fn play(schedule: &mut Schedule, rate: u64, count: u64) -> Vec<(ClockTime, ClockTime)> {
        let mut shown = Vec::new();
        for k in 0..count {
            let start = ms((k * 1000 + rate / 2) / rate);
            let span = schedule.admit(start, Some(ms(1000 / rate)), false);
            while let Some(picture) = schedule.next(span, Direction::Forward, false) {
                assert!((0.0..1.0).contains(&picture.position));
                shown.push((picture.time, picture.time + picture.duration.expect("known")));
            }
        }
        shown
    }

    #[test]
    fn same_rate_shows_each_packet_once() {
        let mut schedule = schedule((24, 1), (24, 1));
        assert_eq!(play(&mut schedule, 24, 240).len(), 240);
    }

    #[test]
    fn other_rates_fill_the_grid_without_holes() {
        for (rate, expected) in [((60, 1), 600), ((10, 1), 100), ((30000, 1001), 300), ((120, 1), 1200)] {
            let mut schedule = schedule((24, 1), rate);
            let shown = play(&mut schedule, 24, 240);
            assert!((expected - 1..=expected).contains(&shown.len()), "{rate:?}: {}", shown.len());
            assert!(shown.windows(2).all(|pair| pair[0].1 == pair[1].0), "{rate:?}: a hole or an overlap");
            assert_eq!(shown[0].0, ClockTime::ZERO);
        }
    }

    #[test]
    fn reverse_shows_the_same_grid_backwards() {
        let packets: Vec<(ClockTime, Option<ClockTime>)> =
            (0..48).map(|k| (ms((k * 1000 + 12) / 24), Some(ms(1000 / 24)))).collect();
        let mut forward = schedule((24, 1), (60, 1));
        let mut times = Vec::new();
        for &(start, duration) in &packets {
            let span = forward.admit(start, duration, false);
            while let Some(picture) = forward.next(span, Direction::Forward, false) {
                times.push((picture.time, picture.position));
            }
        }
        let mut reverse = schedule((24, 1), (60, 1));
        let mut backwards = Vec::new();
        for group in packets.chunks(10).rev() {
            for &span in reverse.admit_group(group).iter().rev() {
                while let Some(picture) = reverse.next(span, Direction::Reverse, false) {
                    backwards.push((picture.time, picture.position));
                }
            }
        }
        backwards.reverse();
        assert_eq!(times.len(), 120);
        assert!(times.iter().zip(&backwards).all(|(a, b)| a.0 == b.0), "{times:?} {backwards:?}");
    }

    #[test]
    fn a_change_of_rate_inside_a_packet_overlaps_nothing() {
        let mut schedule = schedule((25, 1), (60, 1));
        let mut shown = Vec::new();
        for k in 0..50u64 {
            let span = schedule.admit(ms(40 * k), Some(ms(40)), false);
            while let Some(picture) = schedule.next(span, Direction::Forward, false) {
                shown.push((picture.time, picture.time + picture.duration.expect("known")));
                if shown.len() % 7 == 0 {
                    let grid = if shown.len() % 2 == 0 { (60, 1) } else { (25, 1) };
                    schedule.set_rates((25, 1).into(), grid.into());
                }
            }
        }
        assert!(shown.len() > 50);
        assert!(shown.windows(2).all(|pair| pair[0].1 <= pair[1].0), "{shown:?}");
    }

    #[test]
    fn stamps_that_start_again_are_a_new_timeline() {
        for output in [(25, 1), (50, 1)] {
            let mut schedule = schedule((25, 1), output);
            let first = play(&mut schedule, 25, 25).len();
            assert_eq!(play(&mut schedule, 25, 25).len(), first);
        }
    }

    #[test]
    fn unknown_lengths_show_one_picture_a_packet() {
        for output in [(0, 1), (50, 1)] {
            let mut schedule = schedule((0, 1), output);
            let mut shown = 0;
            for start in [0, 500, 520, 2000] {
                let span = schedule.admit(ms(start), None, false);
                while schedule.next(span, Direction::Forward, false).is_some() {
                    shown += 1;
                }
            }
            assert_eq!(shown, 4, "{output:?}");
        }
    }

    #[test]
    fn times_at_the_end_of_the_clock_do_not_overflow() {
        let last = ClockTime::from_nseconds(u64::MAX - 1);
        for rate in [(60, 1), (1, i32::MAX), (i32::MAX, 1)] {
            let mut schedule = schedule((25, 1), rate);
            let span = schedule.admit(last, Some(last), false);
            assert!(std::iter::from_fn(|| schedule.next(span, Direction::Forward, false)).take(3).count() <= 3);
            let span = schedule.admit(last, None, false);
            assert!(std::iter::from_fn(|| schedule.next(span, Direction::Reverse, false)).take(3).count() <= 3);
        }
    }
}
