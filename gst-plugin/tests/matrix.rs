//! The decoder under all that players do at once: seeks in every mode, loops, resizing, formats and sizes against the
//! library's own pictures.

mod pipeline;

use std::collections::BTreeMap;

use gst::ClockTime;
use gst::prelude::*;
use pipeline::{Outcome, Running, TempFile, packets, run, stream, time_of};

const FRAMES: u64 = 20;

/// Pictures by their times.
fn pictures(outcome: &Outcome) -> BTreeMap<ClockTime, Vec<u8>> {
    let bytes = |buffer: &gst::BufferRef| buffer.map_readable().expect("memory").to_vec();
    outcome.buffers().map(|buffer| (buffer.pts().expect("a time"), bytes(buffer))).collect()
}

/// A paused pipeline that shows a file in small pictures.
fn paused(source: &str, decoder: &str, caps: &str) -> Running {
    let running = Running::new(&format!("{source} ! tetvecparse ! tetvecdec {decoder} ! {caps}"));
    running.preroll();
    running.clear();
    running
}

fn seek(running: &Running, rate: f64, flags: gst::SeekFlags, range: [u64; 2]) {
    let [start, stop] = range.map(time_of);
    running.pipeline.seek(rate, flags, gst::SeekType::Set, start, gst::SeekType::Set, stop).expect("a seek is done");
}

/// What a seek to `range` at `rate` shows, against what of it is shown without a seek.
#[track_caller]
fn check(outcome: &Outcome, straight: &BTreeMap<ClockTime, Vec<u8>>, rate: f64, range: [u64; 2]) {
    let [start, stop] = range.map(time_of);
    let expected: BTreeMap<_, _> = straight.range(start..stop).map(|(time, bytes)| (*time, bytes.clone())).collect();
    let times = outcome.times();
    let ordered = times.windows(2).all(|pair| (pair[0] < pair[1]) == (rate > 0.0));
    assert!(ordered && times.len() == expected.len(), "rate {rate}, {range:?}: {times:?}");
    assert!(pictures(outcome) == expected, "rate {rate}, {range:?}: other pictures");
}

#[test]
fn seeks_show_the_same_pictures_in_every_mode() {
    let file = TempFile::new(&stream(FRAMES));
    let (pull, push) = (file.source(), file.source().replacen("filesrc", "pushfilesrc", 1));
    for rate in ["25/1", "50/1"] {
        let caps = format!("video/x-raw,format=RGB,width=24,framerate={rate}");
        let straight = pictures(&run(&format!("{pull} ! tetvecparse ! tetvecdec ! {caps}")).expect_clean());
        for (source, rates) in [(&pull, &[1.0, 2.0, 0.5, -1.0, -2.0][..]), (&push, &[1.0, 2.0][..])] {
            for range in [[0, FRAMES], [7, 13], [5, 6], [12, FRAMES]] {
                for &rate in rates {
                    let running = paused(source, "", &caps);
                    seek(&running, rate, gst::SeekFlags::FLUSH | gst::SeekFlags::ACCURATE, range);
                    check(&running.finish().expect_clean(), &straight, rate, range);
                }
            }
        }
    }
}

#[test]
fn loops_by_segment_seeks_repeat_the_same_pictures() {
    let file = TempFile::new(&stream(FRAMES));
    for rate in [1.0, -1.0] {
        let running = paused(&file.source(), "", "video/x-raw,format=RGB,width=24");
        let straight =
            pictures(&run(&format!("{} ! tetvecparse ! tetvecdec ! video/x-raw,format=RGB,width=24", file.source())));
        let flags = gst::SeekFlags::ACCURATE | gst::SeekFlags::SEGMENT;
        let bus = running.pipeline.bus().expect("a bus");
        seek(&running, rate, flags | gst::SeekFlags::FLUSH, [4, 11]);
        running.pipeline.set_state(gst::State::Playing).expect("can play");
        for _ in 0..2 {
            let kinds = [gst::MessageType::SegmentDone, gst::MessageType::Error, gst::MessageType::Eos];
            let done = bus.timed_pop_filtered(ClockTime::from_seconds(60), &kinds).expect("an end");
            assert_eq!(done.type_(), gst::MessageType::SegmentDone, "rate {rate}");
            seek(&running, rate, flags, [4, 11]);
        }
        let done = bus.timed_pop_filtered(ClockTime::from_seconds(60), &[gst::MessageType::SegmentDone]);
        assert!(done.is_some());
        seek(&running, rate, gst::SeekFlags::ACCURATE, [4, 11]);
        let outcome = running.finish().expect_clean();
        let mut once: Vec<_> = (4..11).map(time_of).collect();
        if rate < 0.0 {
            once.reverse();
        }
        assert_eq!(outcome.times(), once.repeat(4), "rate {rate}");
        for buffer in outcome.buffers() {
            let bytes = buffer.map_readable().expect("memory");
            assert!(straight[&buffer.pts().expect("a time")][..] == bytes[..], "rate {rate}");
        }
    }
}

/// A window that is resized with every picture, and reports of it without a new size: the next picture has the size, and
/// the rest costs nothing.
#[test]
fn storms_of_resizing_and_reconfiguring_lose_no_picture() {
    let file = TempFile::new(&stream(FRAMES));
    let description = format!("{} ! tetvecparse ! tetvecdec name=decoder ! capsfilter name=filter", file.source());
    let running = Running::new(&description);
    let (decoder, filter) = (running.element("decoder"), running.element("filter"));
    let changes = std::sync::Arc::new(std::sync::atomic::AtomicU64::new(0));
    let counted = std::sync::Arc::clone(&changes);
    let pad = decoder.static_pad("src").expect("a pad");
    pad.add_probe(gst::PadProbeType::EVENT_DOWNSTREAM, move |_, info| {
        if info.event().is_some_and(|event| event.type_() == gst::EventType::Caps) {
            counted.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        }
        gst::PadProbeReturn::Ok
    });
    let count = std::sync::atomic::AtomicU64::new(0);
    let sizer = filter.clone();
    filter.static_pad("src").expect("a pad").add_probe(gst::PadProbeType::BUFFER, move |pad, _| {
        let number = count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        if number < FRAMES / 2 {
            let width = 20 + 3 * number as i32;
            sizer.set_property("caps", gst_video::VideoCapsBuilder::new().width(width).height(30).build());
        }
        for _ in 0..50 {
            pad.push_event(gst::event::Reconfigure::new());
        }
        gst::PadProbeReturn::Ok
    });
    let outcome = running.finish().expect_clean();
    assert_eq!(outcome.times(), (0..FRAMES).map(time_of).collect::<Vec<_>>());
    for sample in &outcome.samples {
        let info = gst_video::VideoInfo::from_caps(sample.caps().expect("caps")).expect("raw caps");
        assert_eq!(sample.buffer().expect("a buffer").size(), info.size());
    }
    let changes = changes.load(std::sync::atomic::Ordering::Relaxed);
    assert!((2..=FRAMES / 2 + 2).contains(&changes), "{changes} CAPS events");
}

/// The picture of a frame as the library draws it, in planes without padding.
fn drawn(bytes: &[u8], frame: u64, format: tetvec::PixelFormat, size: (u32, u32)) -> Vec<u8> {
    let mut decoder = tetvec::Decoder::new(tetvec::DecoderConfig { threads: 1, ..Default::default() });
    for (at, header) in packets(bytes) {
        if !header.picture || header.frame_number > frame {
            break;
        }
        decoder.send_packet(&bytes[at..at + header.length]).expect("a sound packet");
    }
    let sizes = format.plane_sizes(size.0, size.1);
    let mut planes: Vec<Vec<u8>> = sizes.iter().map(|(row, rows)| vec![0; row * rows]).collect();
    let views = planes.iter_mut().zip(&sizes).map(|(data, (stride, _))| tetvec::Plane { data, stride: *stride });
    let matrix = if size.1 <= 576 { tetvec::YuvMatrix::Bt601 } else { tetvec::YuvMatrix::Bt709 };
    let mut surface = tetvec::Surface::try_new(format, matrix, size, views.collect()).expect("a surface");
    decoder.render(frame as f64, None, &mut surface).expect("a picture");
    planes.concat()
}

/// Rows of all planes without padding.
fn shown(sample: &gst::Sample) -> Vec<u8> {
    use gst_video::prelude::*;
    let info = gst_video::VideoInfo::from_caps(sample.caps().expect("caps")).expect("raw caps");
    let buffer = sample.buffer_owned().expect("a buffer");
    let frame = gst_video::VideoFrame::from_buffer_readable(buffer, &info).expect("a picture");
    let plane = |number: u32| {
        // The first component of each plane of our formats has the plane's number.
        let interleaved = if number == 1 && info.format() == gst_video::VideoFormat::Nv12 { 2 } else { 1 };
        let pixel = frame.comp_pstride(number) as usize / interleaved;
        let row = frame.comp_width(number) as usize * pixel * interleaved;
        let stride = frame.plane_stride()[number as usize] as usize;
        let data = frame.plane_data(number).expect("a plane");
        (0..frame.comp_height(number) as usize).flat_map(move |y| data[y * stride..][..row].to_vec())
    };
    (0..frame.n_planes()).flat_map(plane).collect()
}

#[test]
fn every_format_and_size_is_the_library_s_picture_for_any_number_of_threads() {
    let bytes = stream(FRAMES);
    let file = TempFile::new(&bytes);
    let formats = [
        ("RGB", tetvec::PixelFormat::Rgb),
        ("RGBx", tetvec::PixelFormat::Rgbx),
        ("BGRx", tetvec::PixelFormat::Bgrx),
        ("I420", tetvec::PixelFormat::I420),
        ("NV12", tetvec::PixelFormat::Nv12),
    ];
    for (name, format) in formats {
        for (size, threads) in [((16, 16), 1), ((47, 33), 2), ((320, 214), 3), ((1081, 721), 2)] {
            let caps = format!("video/x-raw,format={name},width={},height={}", size.0, size.1);
            let decoder = format!("tetvecdec threads={threads}");
            let outcome = run(&format!("{} ! tetvecparse ! {decoder} ! {caps}", file.source())).expect_clean();
            for frame in [0, 7, FRAMES - 1] {
                let found = shown(&outcome.samples[frame as usize]);
                assert!(found == drawn(&bytes, frame, format, size), "{caps}, frame {frame}");
            }
        }
    }
}
