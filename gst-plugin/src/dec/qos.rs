//! Quality of service: which pictures come too late to be worth rendering. In: the sink's reports. Out: the running
//! time before which nothing needs to be shown, and counts for the message on the bus.

use gst::ClockTime;

/// What the sink said last, and what became of the pictures.
#[derive(Debug, Default)]
pub(super) struct Qos {
    earliest: Option<ClockTime>,
    proportion: f64,
    rendered: u64,
    dropped: u64,
}

impl Qos {
    /// Takes a report: a picture of running time `timestamp` was `diff` ns late (early, if negative).
    pub(super) fn report(&mut self, proportion: f64, diff: i64, timestamp: Option<ClockTime>) {
        self.proportion = proportion;
        // Late pictures are caught up twice over, as those that follow are delayed as well.
        let shift = if diff > 0 { diff.saturating_mul(2) } else { diff };
        self.earliest = timestamp.map(|timestamp| {
            let earliest = timestamp.nseconds().saturating_add_signed(shift);
            ClockTime::from_nseconds(earliest.min(u64::MAX - 1))
        });
    }

    /// Forgets the reports; they are of another timeline.
    pub(super) fn reset(&mut self) {
        self.earliest = None;
    }

    /// Counts a picture of this running time and tells whether it comes too late to render.
    pub(super) fn is_late(&mut self, running_time: Option<ClockTime>) -> bool {
        let late = matches!((self.earliest, running_time), (Some(earliest), Some(time)) if time < earliest);
        *(if late { &mut self.dropped } else { &mut self.rendered }) += 1;
        late
    }

    /// The message that tells the application of a dropped picture at `time`.
    pub(super) fn message(
        &self,
        time: ClockTime,
        duration: Option<ClockTime>,
        segment: &gst::FormattedSegment<ClockTime>,
    ) -> gst::message::QosBuilder<'static> {
        let running_time = segment.to_running_time(time);
        let jitter = match (self.earliest, running_time) {
            (Some(earliest), Some(time)) => i64::try_from(earliest.saturating_sub(time).nseconds()).unwrap_or(i64::MAX),
            _ => 0,
        };
        gst::message::Qos::builder(false)
            .running_time(running_time)
            .stream_time(segment.to_stream_time(time))
            .timestamp(time)
            .duration(duration)
            .values(jitter, self.proportion, 1_000_000)
            .stats(gst::format::Buffers::from_u64(self.rendered), gst::format::Buffers::from_u64(self.dropped))
    }
}

#[cfg(test)]
mod tests {
    use super::Qos;
    use gst::ClockTime;

    #[test]
    fn late_reports_skip_and_a_reset_forgets() {
        let (at, late) = (ClockTime::from_seconds(1), 10_000_000);
        let mut qos = Qos::default();
        assert!(!qos.is_late(Some(at)));
        qos.report(1.5, late, Some(at));
        assert!(qos.is_late(Some(at + ClockTime::from_mseconds(19))));
        assert!(!qos.is_late(Some(at + ClockTime::from_mseconds(20))));
        assert!(!qos.is_late(None));
        qos.reset();
        assert!(!qos.is_late(Some(at)));
    }

    #[test]
    fn reports_at_the_ends_of_the_clock_do_not_overflow() {
        let mut qos = Qos::default();
        qos.report(1.0, i64::MAX, Some(ClockTime::from_nseconds(u64::MAX - 1)));
        assert!(qos.is_late(Some(ClockTime::ZERO)));
        qos.report(1.0, i64::MIN, Some(ClockTime::ZERO));
        assert!(!qos.is_late(Some(ClockTime::ZERO)));
    }
}
