//! The elements in players: plugging, seeking, reverse playback, damaged files.

mod pipeline;

use std::collections::BTreeMap;

use gst::ClockTime;
use gst::prelude::*;
use pipeline::{Outcome, Running, TempFile, init, run, stream, time_of};

const FRAMES: u64 = 30;

/// Frames by their times.
fn pictures(outcome: &Outcome) -> BTreeMap<ClockTime, Vec<u8>> {
    outcome
        .buffers()
        .map(|buffer| (buffer.pts().expect("a time"), buffer.map_readable().expect("memory").to_vec()))
        .collect()
}

/// A paused pipeline that renders a file.
fn paused(file: &TempFile, caps: &str) -> Running {
    let running = Running::new(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source()));
    running.preroll();
    running.clear();
    running
}

#[test]
fn decodebin_plugs_the_elements() {
    let file = TempFile::new(&stream(FRAMES));
    let outcome = run(&format!("{} ! decodebin ! video/x-raw,width=96", file.source())).expect_clean();
    assert_eq!(outcome.times(), (0..FRAMES).map(time_of).collect::<Vec<_>>());
    assert_eq!((outcome.info().width(), outcome.info().height()), (96, 64));
}

#[test]
fn playbin_plays_to_the_end() {
    init();
    let file = TempFile::new(&stream(10));
    for name in ["playbin", "playbin3"] {
        let sink = gst::ElementFactory::make("fakevideosink").build().expect("a sink");
        sink.set_property("sync", false);
        let player = gst::ElementFactory::make(name).property("uri", file.uri()).property("video-sink", &sink);
        let player = player.build().expect("a player");
        player.set_state(gst::State::Playing).expect("can play");
        let bus = player.bus().expect("a bus");
        let end =
            bus.timed_pop_filtered(ClockTime::from_seconds(60), &[gst::MessageType::Eos, gst::MessageType::Error]);
        assert_eq!(end.expect("an end").type_(), gst::MessageType::Eos, "{name}");
        let stats = sink.property::<gst::Structure>("stats");
        assert_eq!(stats.get::<u64>("rendered"), Ok(10), "{name}");
        player.set_state(gst::State::Null).expect("can stop");
    }
}

#[test]
fn a_discoverer_knows_size_and_duration() {
    init();
    let whole = stream(FRAMES);
    let cut = &whole[..whole.len() / 2];
    for bytes in [&whole[..], cut] {
        let file = TempFile::new(bytes);
        let frames = if bytes.len() == whole.len() {
            FRAMES
        } else {
            let packets = pipeline::packets(&whole);
            packets.iter().filter(|(at, header)| header.picture && at + header.length <= bytes.len()).count() as u64
        };
        let discoverer = gst_pbutils::Discoverer::new(ClockTime::from_seconds(60)).expect("a discoverer");
        let info = discoverer.discover_uri(&file.uri()).expect("a known file");
        assert_eq!(info.duration(), Some(time_of(frames)));
        assert!(info.is_seekable());
        let video = &info.video_streams()[0];
        assert_eq!((video.width(), video.height()), (48, 32));
        assert_eq!(video.framerate(), gst::Fraction::new(25, 1));
    }
}

#[test]
fn accurate_seeks_show_the_same_pictures() {
    let file = TempFile::new(&stream(FRAMES));
    let caps = "video/x-raw,format=RGB,width=60";
    let straight = pictures(&run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean());
    for frame in [0, 1, 4, 5, 13, 29] {
        let running = paused(&file, caps);
        let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE;
        running.pipeline.seek_simple(flags, time_of(frame)).expect("a seek is done");
        let found = pictures(&running.finish().expect_clean());
        let expected: BTreeMap<_, _> = straight.range(time_of(frame)..).map(|(k, v)| (*k, v.clone())).collect();
        assert!(found == expected, "from frame {frame}: {:?}", found.keys());
    }
}

#[test]
fn a_seek_between_frames_clips_the_first() {
    let file = TempFile::new(&stream(FRAMES));
    let running = paused(&file, "video/x-raw");
    let (start, stop) = (time_of(7) + time_of(1) / 2, time_of(11));
    let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE;
    running.pipeline.seek(1.0, flags, gst::SeekType::Set, start, gst::SeekType::Set, stop).expect("a seek is done");
    let times = running.finish().expect_clean().times();
    assert_eq!(times, [start, time_of(8), time_of(9), time_of(10)]);
}

#[test]
fn reverse_playback_shows_the_same_pictures_backwards() {
    let file = TempFile::new(&stream(FRAMES));
    for caps in ["video/x-raw,format=RGB", "video/x-raw,format=RGB,framerate=60/1"] {
        let straight = pictures(&run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean());
        let running = paused(&file, caps);
        let (start, stop) = (ClockTime::ZERO, time_of(FRAMES));
        let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE;
        running
            .pipeline
            .seek(-1.0, flags, gst::SeekType::Set, start, gst::SeekType::Set, stop)
            .expect("a seek is done");
        let outcome = running.finish().expect_clean();
        let times = outcome.times();
        assert!(times.windows(2).all(|pair| pair[0] > pair[1]), "{caps}: {times:?}");
        assert!(pictures(&outcome) == straight, "{caps}: {} of {}", times.len(), straight.len());
    }
}

#[test]
fn fast_forward_over_keyframes_shows_only_them() {
    let file = TempFile::new(&stream(FRAMES));
    for rate in [4.0, -4.0] {
        let running = paused(&file, "video/x-raw");
        let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::TRICKMODE | gst::SeekFlags::TRICKMODE_KEY_UNITS;
        let (start, stop) = (ClockTime::ZERO, time_of(FRAMES));
        running
            .pipeline
            .seek(rate, flags, gst::SeekType::Set, start, gst::SeekType::Set, stop)
            .expect("a seek is done");
        let mut expected: Vec<_> = (0..FRAMES).step_by(5).map(time_of).collect();
        if rate < 0.0 {
            expected.reverse();
        }
        assert_eq!(running.finish().expect_clean().times(), expected, "rate {rate}");
    }
}

#[test]
fn seeks_into_a_joined_file_find_their_part() {
    let joined = [stream(FRAMES), stream(FRAMES)].concat();
    let file = TempFile::new(&joined);
    for frame in [3, 29, 30, 44] {
        let running = paused(&file, "video/x-raw");
        let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE;
        running.pipeline.seek_simple(flags, time_of(frame)).expect("a seek is done");
        let times = running.finish().expect_clean().times();
        assert_eq!(times, (frame..2 * FRAMES).map(time_of).collect::<Vec<_>>());
    }
}

#[test]
fn many_seeks_in_a_row_hang_nowhere() {
    let file = TempFile::new(&stream(FRAMES));
    let running = paused(&file, "video/x-raw,width=64");
    running.pipeline.set_state(gst::State::Playing).expect("can play");
    let mut random = Random(7);
    for round in 0..60 {
        let (start, stop) = (time_of(random.below(FRAMES)), time_of(FRAMES));
        let rate = if round % 3 == 0 { -1.0 } else { 1.0 };
        let range = if rate < 0.0 { (ClockTime::ZERO, start + time_of(1)) } else { (start, stop) };
        let flags = gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE;
        running.pipeline.seek(rate, flags, gst::SeekType::Set, range.0, gst::SeekType::Set, range.1).expect("a seek");
    }
    running.pipeline.seek_simple(gst::SeekFlags::FLUSH, time_of(20)).expect("a seek is done");
    let (result, _, _) = running.pipeline.state(ClockTime::from_seconds(60));
    assert!(result.is_ok());
    let times = running.finish().expect_clean().times();
    assert_eq!(times.last(), Some(&time_of(FRAMES - 1)));
}

#[test]
fn flipped_bits_end_in_pictures_or_errors_but_never_in_a_hang() {
    let bytes = stream(12);
    let mut random = Random(42);
    let mut shown = 0;
    for _ in 0..60 {
        let mut broken = bytes.clone();
        for _ in 0..=random.below(4) {
            let at = random.below(broken.len() as u64) as usize;
            broken[at] ^= 1 << random.below(8);
        }
        let file = TempFile::new(&broken);
        shown += run(&format!("{} ! tetvecparse ! tetvecdec", file.source())).samples.len();
    }
    assert!(shown > 60 * 12 / 3, "only {shown} pictures survived");
}

/// A small generator of numbers for tests (xorshift64*).
struct Random(u64);

impl Random {
    fn below(&mut self, end: u64) -> u64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) % end
    }
}
