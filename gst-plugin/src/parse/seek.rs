//! Seeks to keyframes: the base class seeks to any frame exactly, so a seek that asks for a keyframe gets the keyframe's
//! own time for its start. In: seek events and keyframes. Out: seek events.

use gst::ClockTime;

use super::timeline::Keyframe;

/// The seek to perform for `event`; `None`: as it is.
pub(super) fn snap(event: &gst::event::Seek, seqnum: gst::Seqnum, keyframes: &[Keyframe]) -> Option<gst::Event> {
    let (rate, flags, start_type, start, stop_type, stop) = event.get();
    let snaps = flags.intersects(gst::SeekFlags::KEY_UNIT | gst::SeekFlags::SNAP_BEFORE | gst::SeekFlags::SNAP_AFTER);
    // Backwards playback starts at the stop, of which no decoding depends on a keyframe.
    if !snaps || flags.contains(gst::SeekFlags::ACCURATE) || rate <= 0.0 || start_type != gst::SeekType::Set {
        return None;
    }
    let gst::GenericFormattedValue::Time(Some(start)) = start else { return None };
    let gst::GenericFormattedValue::Time(stop) = stop else { return None };
    let start = nearest(start, flags, keyframes)?;
    // A stop before the new start would leave nothing to play.
    let stop = stop.map(|stop| stop.max(start));
    Some(gst::event::Seek::builder(rate, flags, start_type, start, stop_type, stop).seqnum(seqnum).build())
}

/// The keyframe before, after or nearest to `time`, as the flags say; before, if they do not.
fn nearest(time: ClockTime, flags: gst::SeekFlags, keyframes: &[Keyframe]) -> Option<ClockTime> {
    let after = keyframes.partition_point(|keyframe| keyframe.time <= time);
    let before = after.checked_sub(1).map(|last| keyframes[last].time);
    let after = if before == Some(time) { before } else { keyframes.get(after).map(|next| next.time) };
    let (wants_before, wants_after) =
        (flags.contains(gst::SeekFlags::SNAP_BEFORE), flags.contains(gst::SeekFlags::SNAP_AFTER));
    match (wants_before, wants_after) {
        (true, true) => match (before, after) {
            (Some(before), Some(after)) => Some(if time - before <= after - time { before } else { after }),
            (before, after) => before.or(after),
        },
        (false, true) => after.or(before),
        _ => before.or(after),
    }
}

#[cfg(test)]
mod tests {
    use super::{Keyframe, snap};
    use gst::{ClockTime, SeekFlags};

    /// Start of the seek after snapping to keyframes at 0, 1, 2 and 3 s.
    fn start(flags: SeekFlags, milliseconds: u64) -> Option<ClockTime> {
        gst::init().expect("GStreamer starts");
        let keyframes: Vec<Keyframe> =
            (0..4).map(|k| Keyframe { offset: k * 1000, time: ClockTime::from_seconds(k) }).collect();
        let seek = gst::event::Seek::new(
            1.0,
            flags,
            gst::SeekType::Set,
            ClockTime::from_mseconds(milliseconds),
            gst::SeekType::None,
            ClockTime::NONE,
        );
        let gst::EventView::Seek(view) = seek.view() else { unreachable!("made above") };
        let snapped = snap(view, seek.seqnum(), &keyframes)?;
        assert_eq!(snapped.seqnum(), seek.seqnum());
        let gst::EventView::Seek(view) = snapped.view() else { panic!("no seek: {snapped:?}") };
        match view.get().3 {
            gst::GenericFormattedValue::Time(time) => time,
            other => panic!("no time: {other:?}"),
        }
    }

    #[test]
    fn flags_choose_the_side() {
        let seconds = |seconds| Some(ClockTime::from_seconds(seconds));
        assert_eq!(start(SeekFlags::KEY_UNIT, 1900), seconds(1));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_BEFORE, 1900), seconds(1));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_AFTER, 1100), seconds(2));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_NEAREST, 1100), seconds(1));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_NEAREST, 1900), seconds(2));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_AFTER, 2000), seconds(2));
        assert_eq!(start(SeekFlags::KEY_UNIT | SeekFlags::SNAP_AFTER, 3500), seconds(3));
    }

    #[test]
    fn accurate_seeks_stay() {
        assert_eq!(start(SeekFlags::FLUSH, 1900), None);
        assert_eq!(start(SeekFlags::FLUSH | SeekFlags::ACCURATE | SeekFlags::KEY_UNIT, 1900), None);
    }
}
