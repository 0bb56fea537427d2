//! `tetvecparse`: framing, times, joined, cut and damaged files, seeks to keyframes.

mod pipeline;

use gst::ClockTime;
use gst::prelude::*;
use pipeline::{ENCODER, Outcome, Running, TempFile, encode, init, packets, raw, run, stream, time_of};

/// Parses a file in pull mode and in push mode.
fn parse(bytes: &[u8]) -> [Outcome; 2] {
    let file = TempFile::new(bytes);
    [file.source(), file.push_source()].map(|source| run(&format!("{source} ! tetvecparse")))
}

/// Start, length, whether it is a delta unit and whether a picture belongs to it.
fn outlines(outcome: &Outcome) -> Vec<(ClockTime, ClockTime, bool, bool)> {
    outcome
        .buffers()
        .map(|buffer| {
            let (start, length) = buffer.pts().zip(buffer.duration()).expect("times");
            let flag = |flag| buffer.flags().contains(flag);
            (start, length, flag(gst::BufferFlags::DELTA_UNIT), !flag(gst::BufferFlags::HEADER))
        })
        .collect()
}

/// Starts of the pictures' packets.
fn starts(outcome: &Outcome) -> Vec<ClockTime> {
    outlines(outcome).iter().filter(|outline| outline.3).map(|outline| outline.0).collect()
}

/// The duration that a pipeline tells when it is paused.
fn duration(bytes: &[u8]) -> Option<ClockTime> {
    let file = TempFile::new(bytes);
    let running = Running::new(&format!("{} ! tetvecparse", file.source()));
    running.preroll();
    let duration = running.pipeline.query_duration::<ClockTime>();
    running.finish().expect_clean();
    duration
}

#[test]
fn a_file_comes_out_packet_by_packet() {
    let bytes = stream(12);
    for outcome in parse(&bytes) {
        let outcome = outcome.expect_clean();
        assert_eq!(outcome.bytes(), bytes);
        let mut expected: Vec<_> = (0..12).map(|k| (time_of(k), time_of(1), k % 5 != 0, true)).collect();
        expected.push((time_of(12), ClockTime::ZERO, true, false));
        assert_eq!(outlines(&outcome), expected);
        let caps = outcome.samples[0].caps_owned().expect("caps");
        let structure = caps.structure(0).expect("a structure");
        assert_eq!((structure.get("width"), structure.get("height")), (Ok(48), Ok(32)));
        assert_eq!(structure.get("framerate"), Ok(gst::Fraction::new(25, 1)));
        assert_eq!(structure.get("pixel-aspect-ratio"), Ok(gst::Fraction::new(1, 1)));
        assert_eq!((structure.get("parsed"), structure.get("alignment")), (Ok(true), Ok("frame")));
    }
    assert_eq!(duration(&bytes), Some(time_of(12)));
}

#[test]
fn packets_come_whole_from_pieces_of_any_size() {
    let bytes = stream(6);
    init();
    for piece in [1, 13, 1000] {
        let mut harness = gst_check::Harness::new("tetvecparse");
        harness.set_src_caps(gst::Caps::new_empty_simple("video/x-tetvec"));
        for piece in bytes.chunks(piece) {
            harness.push(gst::Buffer::from_slice(piece.to_vec())).expect("bytes are taken");
        }
        harness.push_event(gst::event::Eos::new());
        let lengths: Vec<usize> = std::iter::from_fn(|| harness.try_pull()).map(|buffer| buffer.size()).collect();
        let expected: Vec<usize> = packets(&bytes).iter().map(|(_, header)| header.length).collect();
        assert_eq!(lengths, expected, "pieces of {piece} bytes");
    }
}

#[test]
fn garbage_between_packets_is_skipped() {
    let bytes = stream(10);
    let mut dirty = b"garbage \x89TETV".to_vec();
    for (number, (at, header)) in packets(&bytes).into_iter().enumerate() {
        dirty.extend_from_slice(&bytes[at..at + header.length]);
        if number % 3 == 1 {
            dirty.extend((0..50 * number).map(|i| (i * 37) as u8));
        }
    }
    for outcome in parse(&dirty) {
        let outcome = outcome.expect_clean();
        assert_eq!(starts(&outcome), (0..10).map(time_of).collect::<Vec<_>>());
        assert_eq!(outcome.bytes(), bytes);
    }
    assert_eq!(duration(&dirty), Some(time_of(10)));
}

#[test]
fn a_file_cut_off_anywhere_plays_to_the_cut() {
    let bytes = stream(12);
    let packets = packets(&bytes);
    for part in 1..20 {
        let cut = bytes.len() * part / 20;
        let whole = packets.iter().filter(|(at, header)| header.picture && at + header.length <= cut).count() as u64;
        let [pull, push] = parse(&bytes[..cut]);
        for outcome in [&pull, &push] {
            assert_eq!(starts(outcome), (0..whole).map(time_of).collect::<Vec<_>>(), "{cut} bytes");
        }
        if whole > 0 {
            assert_eq!(duration(&bytes[..cut]), Some(time_of(whole)), "{cut} bytes");
        }
    }
}

#[test]
fn a_file_cut_at_the_front_starts_with_its_first_keyframe() {
    let bytes = stream(12);
    let cut = packets(&bytes)[2].0 + 5;
    let [pull, push] = parse(&bytes[cut..]);
    for outcome in [pull, push] {
        let expected: Vec<_> = (0..7).map(time_of).collect();
        assert_eq!(starts(&outcome.expect_clean()), expected);
    }
    assert_eq!(duration(&bytes[cut..]), Some(time_of(7)));
}

#[test]
fn joined_files_play_as_one() {
    let first = stream(7);
    let other = "videotestsrc num-buffers=10 ! video/x-raw,width=64,height=48,framerate=50/1";
    let second = encode(other).bytes();
    let mut expected: Vec<_> = (0..7).map(time_of).collect();
    expected.extend((0..10).map(|k| time_of(7) + ClockTime::from_mseconds(20 * k)));
    let end = time_of(7) + ClockTime::from_mseconds(200);
    let without_index = &first[..packets(&first)[7].0];
    for joined in [[first.as_slice(), &second].concat(), [without_index, &second].concat()] {
        for outcome in parse(&joined) {
            let outcome = outcome.expect_clean();
            assert_eq!(starts(&outcome), expected);
            let last = outcome.samples.last().expect("a packet").caps_owned().expect("caps");
            assert_eq!(last.structure(0).expect("a structure").get("width"), Ok(64));
        }
        assert_eq!(duration(&joined), Some(end));
    }
}

#[test]
fn an_index_that_is_not_true_is_not_believed() {
    let bytes = stream(12);
    let index = packets(&bytes)[12].0;
    for at in index..bytes.len() {
        let mut broken = bytes.clone();
        broken[at] ^= 0xff;
        let file = TempFile::new(&broken);
        let running = Running::new(&format!("{} ! tetvecparse", file.source()));
        running.preroll();
        assert_eq!(running.pipeline.query_duration::<ClockTime>(), Some(time_of(12)), "byte {at}");
        assert_eq!(starts(&running.finish()).len(), 12, "byte {at}");
    }
    // A sound index behind another stream than its own.
    let moved = [&stream(3)[..], &bytes[index..]].concat();
    assert_eq!(duration(&moved), Some(time_of(3)));
}

#[test]
fn what_is_no_stream_is_an_error() {
    for bytes in [vec![0u8; 10], vec![0x89; 5000], b"some text that is no video".repeat(100)] {
        for outcome in parse(&bytes) {
            assert!(outcome.samples.is_empty());
            assert!(!outcome.errors.is_empty());
        }
    }
}

#[test]
fn times_of_a_container_are_kept() {
    let source = format!("{} ! {ENCODER}", raw(6));
    let outcome = run(&format!("{source} ! identity ts-offset=0 ! gdppay ! gdpdepay ! tetvecparse")).expect_clean();
    assert_eq!(starts(&outcome), (0..6).map(time_of).collect::<Vec<_>>());
}

#[test]
fn seeks_for_keyframes_find_them() {
    let file = TempFile::new(&stream(30));
    for (flags, frame, expected) in [
        (gst::SeekFlags::KEY_UNIT, 13, 10),
        (gst::SeekFlags::KEY_UNIT | gst::SeekFlags::SNAP_AFTER, 11, 15),
        (gst::SeekFlags::KEY_UNIT | gst::SeekFlags::SNAP_NEAREST, 13, 15),
    ] {
        let running = Running::new(&format!("{} ! tetvecparse", file.source()));
        running.preroll();
        running.clear();
        let done = running.pipeline.seek_simple(gst::SeekFlags::FLUSH | flags, time_of(frame));
        done.expect("a seek is done");
        let segment_start = {
            let outcome = running.finish().expect_clean();
            assert_eq!(starts(&outcome)[0], time_of(expected), "{flags:?}");
            let segment = outcome.samples[0].segment().expect("a segment").clone();
            segment.downcast::<ClockTime>().expect("a segment in time").start()
        };
        assert_eq!(segment_start, Some(time_of(expected)), "{flags:?}");
    }
}

#[test]
fn files_are_recognized() {
    init();
    let bytes = stream(1);
    let found = |bytes: &[u8]| {
        let buffer = gst::Buffer::from_slice(bytes.to_vec());
        gst_base::type_find_helper_for_data(None::<&gst::Object>, buffer.map_readable().expect("memory").as_slice())
    };
    let (caps, probability) = found(&bytes).expect("a type");
    assert_eq!(caps.structure(0).expect("a structure").name(), "video/x-tetvec");
    assert_eq!(probability, gst::TypeFindProbability::Maximum);
    assert!(found(&bytes[1..]).is_err());
}
