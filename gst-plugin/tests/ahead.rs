//! `tetvecdec` where upstream has packets in store: they are read ahead, and nothing is shown late, twice or out of order.

mod pipeline;

use std::sync::{Arc, Mutex};
use std::time::Duration;

use gst::ClockTime;
use gst::prelude::*;
use pipeline::{Outcome, encode, init, raw, time_of};

/// Longer than upstream may take for a packet that it has in store.
const PAUSE: Duration = Duration::from_millis(40);

/// A harness with a decoder whose upstream is not live.
fn harness(packets: &Outcome) -> gst_check::Harness {
    init();
    let mut harness = gst_check::Harness::new("tetvecdec");
    harness.set_live(false);
    harness.set_src_caps(packets.samples[0].caps_owned().expect("caps"));
    harness
}

/// Coded packets without the index.
fn pictures(packets: &Outcome) -> Vec<gst::Buffer> {
    let is_picture = |buffer: &&gst::BufferRef| !buffer.flags().contains(gst::BufferFlags::HEADER);
    packets.buffers().filter(is_picture).map(|buffer| buffer.copy_deep().expect("a copy")).collect()
}

/// The frame number that a buffer's stamp says.
fn number(buffer: &gst::BufferRef) -> u64 {
    buffer.pts().expect("a stamp").nseconds() * pipeline::RATE / 1_000_000_000
}

/// Frame numbers of the pictures that are out.
fn shown(harness: &mut gst_check::Harness) -> Vec<u64> {
    std::iter::from_fn(|| harness.try_pull()).map(|buffer| number(&buffer)).collect()
}

fn push(harness: &mut gst_check::Harness, packets: &[gst::Buffer]) {
    for packet in packets {
        harness.push(packet.clone()).expect("a packet is taken");
    }
}

#[test]
fn the_first_picture_does_not_wait_and_the_end_brings_the_rest() {
    let coded = encode(&raw(40));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    push(&mut harness, &packets[..1]);
    assert_eq!(shown(&mut harness), [0]);
    push(&mut harness, &packets[1..]);
    let mut rest = shown(&mut harness);
    assert!(rest.len() >= packets.len() - 13, "no more than a dozen wait: {rest:?}");
    harness.push_event(gst::event::Eos::new());
    rest.extend(shown(&mut harness));
    assert_eq!(rest, (1..40).collect::<Vec<_>>());
}

#[test]
fn nothing_waits_where_upstream_has_nothing_in_store() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    push(&mut harness, &packets[..5]);
    let mut out = shown(&mut harness);
    for packet in &packets[5..8] {
        std::thread::sleep(PAUSE);
        push(&mut harness, std::slice::from_ref(packet));
        out.extend(shown(&mut harness));
        assert_eq!(out.last(), Some(&number(packet)));
    }
    assert_eq!(out, (0..8).collect::<Vec<_>>());
}

#[test]
fn a_flush_drops_what_waits() {
    let coded = encode(&raw(20));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    push(&mut harness, &packets[..8]);
    let before = shown(&mut harness);
    assert!(before.iter().copied().eq(0..before.len() as u64));
    harness.push_event(gst::event::FlushStart::new());
    harness.push_event(gst::event::FlushStop::new(true));
    harness.push_event(gst::event::Segment::new(&gst::FormattedSegment::<ClockTime>::new()));
    push(&mut harness, &packets[10..15]);
    harness.push_event(gst::event::Eos::new());
    assert_eq!(shown(&mut harness), (10..15).collect::<Vec<_>>());
}

/// Other serialized events wait for the pictures of packets before them, which are shown at once.
#[test]
fn events_do_not_overtake_pictures() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    push(&mut harness, &packets[..6]);
    harness.push_event(gst::event::CustomDownstream::new(gst::Structure::new_empty("still")));
    assert_eq!(shown(&mut harness), (0..6).collect::<Vec<_>>());
}

/// A parser sends tags between any two packets: they keep their place, but nothing need be shown for them.
#[test]
fn tags_wait_among_the_packets() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    let seen = Arc::new(Mutex::new(Vec::new()));
    let note = seen.clone();
    let kinds = gst::PadProbeType::BUFFER | gst::PadProbeType::EVENT_DOWNSTREAM;
    harness.sinkpad().unwrap().add_probe(kinds, move |_, info| {
        match &info.data {
            Some(gst::PadProbeData::Buffer(buffer)) => note.lock().unwrap().push(Some(number(buffer.as_ref()))),
            Some(gst::PadProbeData::Event(event)) if event.type_() == gst::EventType::Tag => {
                note.lock().unwrap().push(None);
            }
            _ => (),
        }
        gst::PadProbeReturn::Ok
    });
    push(&mut harness, &packets[..6]);
    shown(&mut harness);
    let mut tags = gst::TagList::new();
    tags.make_mut().add::<gst::tags::Title>(&"between", gst::TagMergeMode::Append);
    harness.push_event(gst::event::Tag::new(tags));
    assert!(shown(&mut harness).is_empty(), "nothing is shown for a tag");
    push(&mut harness, &packets[6..]);
    harness.push_event(gst::event::Eos::new());
    let expected: Vec<_> = (0..6).map(Some).chain([None]).chain((6..10).map(Some)).collect();
    assert_eq!(*seen.lock().unwrap(), expected);
}

/// Packets before the segment's start may wait; the first picture within does not.
#[test]
fn the_target_of_a_seek_does_not_wait() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    let mut segment = gst::FormattedSegment::<ClockTime>::new();
    segment.set_start(time_of(3));
    assert!(harness.push_event(gst::event::Segment::new(&segment)));
    push(&mut harness, &packets[..3]);
    assert!(shown(&mut harness).is_empty());
    push(&mut harness, &packets[3..4]);
    assert_eq!(shown(&mut harness), [3]);
}

/// Beyond the end of the segment nothing is shown, and the flow says so.
#[test]
fn the_end_of_the_segment_ends_the_flow() {
    let coded = encode(&raw(40));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    let mut segment = gst::FormattedSegment::<ClockTime>::new();
    segment.set_stop(time_of(12));
    assert!(harness.push_event(gst::event::Segment::new(&segment)));
    let flows: Vec<_> = packets.iter().map(|packet| harness.push(packet.clone())).collect();
    assert_eq!(flows.last(), Some(&Err(gst::FlowError::Eos)));
    harness.push_event(gst::event::Eos::new());
    assert_eq!(shown(&mut harness), (0..12).collect::<Vec<_>>());
}

/// Pictures that come too late are left out, but what they bring to later ones is not.
#[test]
fn late_packets_are_decoded_all_the_same() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    push(&mut harness, &packets[..1]);
    assert_eq!(shown(&mut harness), [0]);
    let late = i64::try_from(time_of(2).nseconds()).expect("a difference");
    harness.push_upstream_event(gst::event::Qos::new(gst::QOSType::Underflow, 2.0, late, time_of(0)));
    push(&mut harness, &packets[1..]);
    harness.push_event(gst::event::Eos::new());
    assert_eq!(shown(&mut harness), (4..10).collect::<Vec<_>>());
}
