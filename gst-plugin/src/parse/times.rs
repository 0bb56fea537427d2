//! Times of packets from their frame numbers, also where streams were joined. In: packet headers in the order of the
//! stream. Out: times. Forbidden here: bytes, buffers.
//!
//! Frame numbers start again where one stream was put behind another; times go on.

use gst::ClockTime;
use gst::prelude::*;
use tetvec::SequenceHeader;
use tetvec::bitstream::{Fraction, Limits, PacketHeader};

/// Rate that frames of streams without a fixed rate are stamped with: the format holds no times of its own.
const UNKNOWN_RATE: Fraction = Fraction { numerator: 25, denominator: 1 };

/// One stream among several joined: which time its first frame has, and how fast frames follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Origin {
    /// Time of its first frame.
    time: ClockTime,
    /// Number of its first frame, not 0 where the stream was cut off at the front.
    first_frame: u64,
    rate: Fraction,
}

impl Origin {
    /// A stream that starts with frame `first_frame` at `time`.
    pub(super) fn new(time: ClockTime, first_frame: u64, header: &SequenceHeader) -> Self {
        let rate = if header.frame_rate.numerator > 0 { header.frame_rate } else { UNKNOWN_RATE };
        Self { time, first_frame, rate }
    }

    /// When a frame starts; `None` before the first frame or beyond what a clock can tell.
    pub(super) fn time_of(&self, frame_number: u64) -> Option<ClockTime> {
        let frames = frame_number.checked_sub(self.first_frame)?;
        let unit = ClockTime::SECOND.nseconds().checked_mul(u64::from(self.rate.denominator))?;
        let elapsed = frames.mul_div_floor(unit, u64::from(self.rate.numerator))?;
        self.time.nseconds().checked_add(elapsed).filter(|&time| time < u64::MAX).map(ClockTime::from_nseconds)
    }

    /// Start and length of a frame; lengths are such that frames touch.
    pub(super) fn span_of(&self, frame_number: u64) -> Option<(ClockTime, ClockTime)> {
        let start = self.time_of(frame_number)?;
        Some((start, self.time_of(frame_number.checked_add(1)?)?.saturating_sub(start)))
    }
}

/// Follows the packets of a stream as they come.
#[derive(Debug, Default)]
pub(super) struct Follower {
    origin: Option<Origin>,
    /// Number of the frame that should come next.
    next_frame: u64,
    /// The last packet was an index: another stream may follow.
    ended: bool,
    /// Packets were left out on purpose: lower numbers are no new stream.
    jumped: bool,
}

impl Follower {
    /// Packets that follow are from elsewhere in the same stream.
    pub(super) fn jump(&mut self) {
        self.jumped = true;
    }

    /// Start and length of the next packet, an index has none. `None`: a number that cannot be right.
    pub(super) fn follow(&mut self, packet: &PacketHeader, header: &SequenceHeader) -> Option<(ClockTime, ClockTime)> {
        if !packet.picture {
            self.ended = true;
            let end = self.origin.and_then(|origin| origin.time_of(self.next_frame))?;
            return Some((end, ClockTime::ZERO));
        }
        let restarts = packet.keyframe && !self.jumped && (self.ended || packet.frame_number < self.next_frame);
        let origin = match self.origin {
            Some(old) if restarts => Origin::new(old.time_of(self.next_frame)?, packet.frame_number, header),
            Some(old) => old,
            None if self.jumped => Origin::new(ClockTime::ZERO, 0, header),
            None => Origin::new(ClockTime::ZERO, packet.frame_number, header),
        };
        // A slab's packets follow closely, so that no damaged number leads far away.
        let far = u64::from(Limits::default().max_duration);
        if !packet.keyframe && !self.jumped && packet.frame_number.abs_diff(self.next_frame) > far {
            return None;
        }
        let span = origin.span_of(packet.frame_number)?;
        *self = Self {
            origin: Some(origin),
            next_frame: packet.frame_number.checked_add(1)?,
            ended: false,
            jumped: self.jumped && !packet.keyframe,
        };
        Some(span)
    }
}

#[cfg(test)]
mod tests {
    use super::Follower;
    use gst::ClockTime;
    use tetvec::SequenceHeader;
    use tetvec::bitstream::{Fraction, PacketHeader};

    fn header(numerator: u32, denominator: u32) -> SequenceHeader {
        SequenceHeader {
            width: 48,
            height: 32,
            frame_rate: Fraction { numerator, denominator },
            pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
            subpixel_bits: 3,
            subdivision_levels: 1,
        }
    }

    fn packet(frame_number: u64, keyframe: bool, picture: bool) -> PacketHeader {
        PacketHeader { length: 100, frame_number, keyframe, last: false, picture }
    }

    #[test]
    fn frames_touch_at_any_rate() {
        for header in [header(24, 1), header(30000, 1001), header(0, 1)] {
            let mut follower = Follower::default();
            let spans: Vec<_> = (0..1000)
                .map(|number| follower.follow(&packet(number, number % 10 == 0, true), &header).expect("a time"))
                .collect();
            assert!(spans.windows(2).all(|pair| pair[0].0 + pair[0].1 == pair[1].0));
            assert_eq!(spans[0].0, ClockTime::ZERO);
        }
    }

    #[test]
    fn joined_streams_go_on_with_their_own_rates() {
        let mut follower = Follower::default();
        for number in 0..24 {
            follower.follow(&packet(number, number == 0, true), &header(24, 1));
        }
        let index = follower.follow(&packet(24, false, false), &header(24, 1));
        assert_eq!(index, Some((ClockTime::SECOND, ClockTime::ZERO)));
        let joined = follower.follow(&packet(0, true, true), &header(50, 1)).expect("a time");
        assert_eq!(joined, (ClockTime::SECOND, ClockTime::from_mseconds(20)));
        // Without an index in between, too.
        let again = follower.follow(&packet(0, true, true), &header(50, 1)).expect("a time");
        assert_eq!(again.0, ClockTime::from_mseconds(1020));
    }

    #[test]
    fn a_cut_front_starts_at_zero_and_losses_leave_a_gap() {
        let mut follower = Follower::default();
        assert_eq!(follower.follow(&packet(120, true, true), &header(25, 1)).map(|span| span.0), Some(ClockTime::ZERO));
        let later = follower.follow(&packet(180, true, true), &header(25, 1)).map(|span| span.0);
        assert_eq!(later, Some(ClockTime::from_mseconds(2400)));
    }

    #[test]
    fn a_jump_back_is_no_new_stream() {
        let mut follower = Follower::default();
        follower.follow(&packet(0, true, true), &header(25, 1));
        follower.follow(&packet(50, true, true), &header(25, 1));
        follower.jump();
        let back = follower.follow(&packet(25, true, true), &header(25, 1)).map(|span| span.0);
        assert_eq!(back, Some(ClockTime::SECOND));
    }

    #[test]
    fn numbers_out_of_reach_are_refused() {
        let mut follower = Follower::default();
        follower.follow(&packet(0, true, true), &header(25, 1));
        assert_eq!(follower.follow(&packet(1 << 40, false, true), &header(25, 1)), None);
        assert_eq!(follower.follow(&packet(u64::MAX, true, true), &header(25, 1)), None);
        assert!(follower.follow(&packet(1, false, true), &header(25, 1)).is_some());
    }
}
