//! `tetvecdec`: sizes, formats, memory, rates, segments, flushes and damaged packets.

mod pipeline;

use gst::ClockTime;
use gst::prelude::*;
use gst_controller::prelude::*;
use gst_video::prelude::*;
use pipeline::{Outcome, RATE, Running, SIZE, TempFile, encode, init, packets, raw, run, stream, time_of};

/// A harness with a decoder that has got `packets`' caps.
fn harness(packets: &Outcome) -> gst_check::Harness {
    init();
    let mut harness = gst_check::Harness::new("tetvecdec");
    harness.set_src_caps(packets.samples[0].caps_owned().expect("caps"));
    harness
}

/// Coded packets of `frames` frames, without the index.
fn pictures(packets: &Outcome) -> Vec<gst::Buffer> {
    let is_picture = |buffer: &&gst::BufferRef| !buffer.flags().contains(gst::BufferFlags::HEADER);
    packets.buffers().filter(is_picture).map(|buffer| buffer.copy_deep().expect("a copy")).collect()
}

/// A packet with one bit of its body flipped.
fn damage(packet: &gst::Buffer) -> gst::Buffer {
    let mut damaged = packet.copy_deep().expect("a copy");
    let mut map = damaged.get_mut().expect("writable").map_writable().expect("memory");
    let last = map.len() - 1;
    map[last] ^= 1;
    drop(map);
    damaged
}

/// Pushes a packet and counts the pictures that come out.
fn push(harness: &mut gst_check::Harness, packet: &gst::Buffer) -> usize {
    harness.push(packet.clone()).expect("a packet is taken");
    std::iter::from_fn(|| harness.try_pull()).count()
}

/// Numbers of the frames shown, at the streams' own rate.
fn numbers(outcome: &Outcome) -> Vec<u64> {
    outcome.times().iter().map(|time| time.nseconds() * RATE / 1_000_000_000).collect()
}

/// Bytes of a plane's rows without padding.
fn plane(sample: &gst::Sample, plane: usize) -> Vec<u8> {
    let info = gst_video::VideoInfo::from_caps(sample.caps().expect("caps")).expect("raw caps");
    let frame = gst_video::VideoFrame::from_buffer_readable(sample.buffer_owned().expect("a buffer"), &info);
    let frame = frame.expect("a picture");
    let row = frame.comp_width(plane as u32) as usize * frame.comp_pstride(plane as u32) as usize;
    let rows = frame.plane_height(plane as u32) as usize;
    let stride = frame.plane_stride()[plane] as usize;
    let data = frame.plane_data(plane as u32).expect("a plane");
    (0..rows).flat_map(|y| data[y * stride..y * stride + row].to_vec()).collect()
}

#[test]
fn any_size_and_format_is_rendered() {
    let file = TempFile::new(&stream(6));
    for format in ["RGB", "RGBx", "BGRx", "I420", "NV12"] {
        for (width, height) in [(48, 32), (96, 64), (33, 71), (1, 1), (200, 3)] {
            let caps = format!("video/x-raw,format={format},width={width},height={height}");
            let outcome = run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean();
            assert_eq!(outcome.times(), (0..6).map(time_of).collect::<Vec<_>>(), "{caps}");
            let info = outcome.info();
            assert_eq!((info.width(), info.height(), info.format().to_str().as_str()), (width, height, format));
            assert!(outcome.buffers().all(|buffer| buffer.size() == info.size()), "{caps}");
        }
    }
}

#[test]
fn the_other_side_follows_the_aspect() {
    let file = TempFile::new(&stream(2));
    for (caps, expected) in [("width=96", (96, 64)), ("height=16", (24, 16)), ("width=[1,24]", (24, 16)), ("", SIZE)] {
        let caps = format!("video/x-raw,{caps}").trim_end_matches(',').to_string();
        let outcome = run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean();
        let info = outcome.info();
        assert_eq!((info.width() as i32, info.height() as i32), expected, "{caps}");
        assert_eq!(info.par(), gst::Fraction::new(1, 1), "{caps}");
    }
}

#[test]
fn formats_show_the_same_picture() {
    let file = TempFile::new(&stream(1));
    let first = |format: &str| {
        let caps = format!("video/x-raw,format={format},width=37,height=23,colorimetry=(string)bt601");
        let caps = if format.starts_with(['I', 'N']) { caps } else { caps.replace(",colorimetry=(string)bt601", "") };
        let outcome = run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean();
        outcome.samples[0].clone()
    };
    let rgb = plane(&first("RGB"), 0);
    let luma: Vec<f64> = rgb
        .chunks(3)
        .map(|c| 16.0 + (65.481 * f64::from(c[0]) + 128.553 * f64::from(c[1]) + 24.966 * f64::from(c[2])) / 255.0)
        .collect();
    let spread = luma.iter().fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(*y), high.max(*y)));
    assert!(spread.1 - spread.0 > 50.0, "the picture shows nothing: {spread:?}");
    let rgbx = plane(&first("RGBx"), 0);
    assert!(rgbx.chunks(4).zip(rgb.chunks(3)).all(|(four, three)| four[..3] == *three));
    let bgrx = plane(&first("BGRx"), 0);
    assert!(bgrx.chunks(4).zip(rgb.chunks(3)).all(|(four, three)| [four[2], four[1], four[0]] == *three));
    for format in ["I420", "NV12"] {
        let y = plane(&first(format), 0);
        assert!(y.iter().zip(&luma).all(|(y, luma)| (f64::from(*y) - luma).abs() <= 1.5), "{format}");
    }
}

#[test]
fn pools_with_padded_rows_are_used() {
    let file = TempFile::new(&stream(3));
    let description =
        format!("{} ! tetvecparse ! tetvecdec ! video/x-raw,format=I420,width=33,height=17", file.source());
    let plain = run(&description).expect_clean();
    let running = Running::new(&description);
    let sink = running.element("sink").static_pad("sink").expect("a pad");
    sink.add_probe(gst::PadProbeType::QUERY_DOWNSTREAM, |_, info| {
        let Some(query) = info.query_mut() else { return gst::PadProbeReturn::Ok };
        let gst::QueryViewMut::Allocation(allocation) = query.view_mut() else { return gst::PadProbeReturn::Ok };
        let caps = allocation.get_owned().0.expect("caps");
        let video = gst_video::VideoInfo::from_caps(&caps).expect("raw caps");
        let pool = gst_video::VideoBufferPool::new();
        let mut config = pool.config();
        config.set_params(Some(&caps), video.size() as u32, 2, 4);
        config.add_option(gst_video::BUFFER_POOL_OPTION_VIDEO_META);
        config.add_option(gst_video::BUFFER_POOL_OPTION_VIDEO_ALIGNMENT);
        config.set_video_alignment(&gst_video::VideoAlignment::new(3, 5, 7, 9, &[15, 15, 15, 15]));
        pool.set_config(config).expect("a configuration");
        allocation.add_allocation_pool(Some(&pool), video.size() as u32, 2, 4);
        allocation.add_allocation_meta::<gst_video::VideoMeta>(None);
        gst::PadProbeReturn::Handled
    });
    let padded = running.finish().expect_clean();
    let strides = |outcome: &Outcome| {
        let buffer = outcome.samples[0].buffer().expect("a buffer");
        buffer.meta::<gst_video::VideoMeta>().map(|meta| meta.stride().to_vec())
    };
    assert_ne!(strides(&padded).expect("a meta"), plain.info().stride().to_vec());
    assert_eq!(padded.samples.len(), 3);
    for (a, b) in plain.samples.iter().zip(&padded.samples) {
        assert!((0..3).all(|index| plane(a, index) == plane(b, index)));
    }
}

#[test]
fn frame_rates_follow_downstream() {
    let file = TempFile::new(&stream(25));
    for (rate, expected) in [("50/1", 50), ("10/1", 10), ("30000/1001", 30), ("25/1", 25)] {
        let caps = format!("video/x-raw,framerate={rate}");
        let outcome = run(&format!("{} ! tetvecparse ! tetvecdec ! {caps}", file.source())).expect_clean();
        assert_eq!(outcome.samples.len(), expected, "{rate}");
        let ends: Vec<_> =
            outcome.buffers().map(|b| b.pts().expect("a time") + b.duration().expect("a length")).collect();
        assert!(outcome.times().iter().skip(1).eq(ends.iter().take(ends.len() - 1)), "{rate}: a hole or an overlap");
    }
}

#[test]
fn caps_may_change_while_playing() {
    let file = TempFile::new(&stream(20));
    let description = format!("{} ! tetvecparse ! tetvecdec ! capsfilter name=filter", file.source());
    let running = Running::new(&description);
    let filter = running.element("filter");
    let count = std::sync::atomic::AtomicU32::new(0);
    let pad = filter.static_pad("src").expect("a pad");
    pad.add_probe(gst::PadProbeType::BUFFER, move |_, _| {
        let number = count.fetch_add(1, std::sync::atomic::Ordering::Relaxed);
        if number.is_multiple_of(5) {
            let caps =
                gst_video::VideoCapsBuilder::new().width(10 + number as i32).height(20).framerate((25, 1).into());
            filter.set_property("caps", caps.build());
        }
        gst::PadProbeReturn::Ok
    });
    let outcome = running.finish().expect_clean();
    assert_eq!(numbers(&outcome), (0..20).collect::<Vec<_>>());
    let mut widths = std::collections::BTreeSet::new();
    for sample in &outcome.samples {
        let info = gst_video::VideoInfo::from_caps(sample.caps().expect("caps")).expect("raw caps");
        assert_eq!(sample.buffer().expect("a buffer").size(), info.size());
        widths.insert(info.width());
    }
    assert_eq!(widths.len(), 5, "{widths:?}");
}

/// The picture before a loss stands in, marked, up to the next keyframe.
#[test]
fn a_damaged_packet_costs_only_what_depends_on_it() {
    let bytes = stream(15);
    let file = TempFile::new(&bytes);
    let whole = run(&format!("{} ! tetvecparse ! tetvecdec", file.source())).expect_clean();
    for damaged in [0usize, 2, 5, 7, 14] {
        let mut broken = bytes.clone();
        let (at, header) = packets(&bytes)[damaged];
        broken[at + header.length - 1] ^= 0x10;
        let file = TempFile::new(&broken);
        let outcome = run(&format!("{} ! tetvecparse ! tetvecdec", file.source())).expect_clean();
        let lost = damaged..(damaged / 5 + 1) * 5;
        let first = if damaged == 0 { lost.end as u64 } else { 0 };
        assert_eq!(numbers(&outcome), (first..15).collect::<Vec<_>>(), "packet {damaged}");
        assert_eq!(outcome.warnings.len(), 1, "{:?}", outcome.warnings);
        let mut last = None;
        for (sample, k) in outcome.samples.iter().zip(first as usize..) {
            let flags = sample.buffer().expect("a buffer").flags();
            assert_eq!(flags.contains(gst::BufferFlags::CORRUPTED), lost.contains(&k), "packet {damaged}, frame {k}");
            let shown = plane(sample, 0);
            if !lost.contains(&k) {
                assert!(shown == plane(&whole.samples[k], 0), "packet {damaged}, frame {k}");
            } else if k > damaged {
                assert!(Some(&shown) == last.as_ref(), "packet {damaged}: frame {k} stands still");
            }
            last = Some(shown);
        }
    }
}

#[test]
fn a_keyframe_is_asked_for_once_after_a_loss() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    assert_eq!(push(&mut harness, &packets[0]), 1);
    while harness.try_pull_upstream_event().is_some() {}
    for damaged in [&damage(&packets[1]), &packets[2], &packets[3]] {
        harness.push(damaged.clone()).expect("a packet is taken");
        let stands_in = harness.pull().expect("a picture in place of the lost one");
        assert!(stands_in.flags().contains(gst::BufferFlags::CORRUPTED));
        assert_eq!(stands_in.pts(), damaged.pts());
    }
    let asked = std::iter::from_fn(|| harness.try_pull_upstream_event())
        .filter(|event| gst_video::ForceKeyUnitEvent::is(event))
        .count();
    assert_eq!(asked, 1);
    harness.push(packets[5].clone()).expect("a packet is taken");
    let after = harness.pull().expect("a picture").flags();
    assert!(!after.contains(gst::BufferFlags::CORRUPTED) && after.contains(gst::BufferFlags::DISCONT));
}

#[test]
fn nothing_but_damage_is_an_error() {
    let coded = encode(&raw(3));
    let mut harness = harness(&coded);
    let bus = gst::Bus::new();
    harness.element().expect("an element").set_bus(Some(&bus));
    for packet in pictures(&coded) {
        assert_eq!(push(&mut harness, &damage(&packet)), 0);
    }
    harness.push_event(gst::event::Eos::new());
    let error = bus.pop_filtered(&[gst::MessageType::Error]).expect("an error");
    let gst::MessageView::Error(error) = error.view() else { unreachable!("filtered") };
    assert!(error.error().matches(gst::StreamError::Decode));
    let types: Vec<_> = std::iter::from_fn(|| harness.try_pull_event()).map(|event| event.type_()).collect();
    assert_eq!(types.last(), Some(&gst::EventType::Eos), "{types:?}");
}

#[test]
fn the_end_comes_through_without_a_packet() {
    init();
    let coded = encode(&raw(1));
    let mut harness = harness(&coded);
    assert!(harness.push_event(gst::event::Eos::new()));
    let types: Vec<_> = std::iter::from_fn(|| harness.try_pull_event()).map(|event| event.type_()).collect();
    let expected = [gst::EventType::StreamStart, gst::EventType::Caps, gst::EventType::Segment, gst::EventType::Eos];
    assert_eq!(types, expected);
}

#[test]
fn buffers_that_are_no_packets_are_survived() {
    let coded = encode(&raw(2));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    for length in [0usize, 1, 7, 23, 100] {
        assert_eq!(push(&mut harness, &gst::Buffer::from_mut_slice(vec![0x89; length])), 0);
        let cut = packets[0].map_readable().expect("memory")[..length.min(packets[0].size() - 1)].to_vec();
        assert_eq!(push(&mut harness, &gst::Buffer::from_mut_slice(cut)), 0);
    }
    assert_eq!(push(&mut harness, &packets[0]), 1);
}

#[test]
fn a_flush_forgets_and_waits_for_a_keyframe() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    assert_eq!(packets[..3].iter().map(|packet| push(&mut harness, packet)).sum::<usize>(), 3);
    harness.push_event(gst::event::FlushStart::new());
    assert_eq!(harness.push(packets[3].clone()), Err(gst::FlowError::Flushing));
    harness.push_event(gst::event::FlushStop::new(true));
    harness.push_event(gst::event::Segment::new(&gst::FormattedSegment::<ClockTime>::new()));
    assert_eq!(push(&mut harness, &packets[4]), 0);
    assert_eq!(push(&mut harness, &packets[5]), 1);
    assert_eq!(push(&mut harness, &packets[0]), 1);
}

#[test]
fn pictures_are_clipped_to_the_segment() {
    let coded = encode(&raw(10));
    let mut harness = harness(&coded);
    let mut segment = gst::FormattedSegment::<ClockTime>::new();
    let (start, stop) = (time_of(2) + time_of(1) / 2, time_of(6) + time_of(1) / 4);
    segment.set_start(start);
    segment.set_stop(stop);
    assert!(harness.push_event(gst::event::Segment::new(&segment)));
    let flows: Vec<_> = pictures(&coded).into_iter().map(|packet| harness.push(packet)).collect();
    assert!(flows[..7].iter().all(Result::is_ok), "{flows:?}");
    assert_eq!(flows[7], Err(gst::FlowError::Eos));
    let shown: Vec<_> = std::iter::from_fn(|| harness.try_pull()).collect();
    assert_eq!(shown.len(), 5);
    assert_eq!(shown[0].pts(), Some(start));
    assert_eq!(shown[0].duration(), Some(time_of(3) - start));
    assert_eq!(shown[4].pts().zip(shown[4].duration()).map(|(pts, length)| pts + length), Some(stop));
}

#[test]
fn late_pictures_are_left_out_and_reported() {
    let coded = encode(&raw(10));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    let bus = gst::Bus::new();
    harness.element().expect("an element").set_bus(Some(&bus));
    assert_eq!(push(&mut harness, &packets[0]), 1);
    let late = i64::try_from(time_of(2).nseconds()).expect("a difference");
    harness.push_upstream_event(gst::event::Qos::new(gst::QOSType::Underflow, 2.0, late, time_of(0)));
    let shown: Vec<usize> = packets[1..6].iter().map(|packet| push(&mut harness, packet)).collect();
    assert_eq!(shown, [0, 0, 0, 1, 1]);
    let reports = std::iter::from_fn(|| bus.pop_filtered(&[gst::MessageType::Qos])).count();
    assert_eq!(reports, 3);
}

#[test]
fn edges_between_labels_can_be_left_as_stairs() {
    let labelled = run(&format!("{} ! tetvecenc superpixels=8", raw(2))).expect_clean().bytes();
    let file = TempFile::new(&labelled);
    let play = |settings: &str| {
        let caps = "video/x-raw,format=RGB,width=96,height=64";
        run(&format!("{} ! tetvecparse ! tetvecdec {settings} ! {caps}", file.source())).expect_clean().bytes()
    };
    assert_eq!(play("antialias=true"), play(""));
    assert_ne!(play("antialias=false"), play(""));
}

#[test]
fn the_level_of_subdivision_and_the_threads_can_be_set() {
    let file = TempFile::new(&stream(2));
    let play = |settings: &str| {
        let caps = "video/x-raw,format=RGB,width=96,height=64";
        run(&format!("{} ! tetvecparse ! tetvecdec {settings} ! {caps}", file.source())).expect_clean().bytes()
    };
    assert_eq!(play("threads=1"), play("threads=2"));
    for level in 0..=2 {
        assert_eq!(play(&format!("subdivision-levels={level}")).len(), 2 * 96 * 64 * 3);
    }
    let fitted = tetvec::EncoderConfig::new(48, 32).subdivision_levels;
    assert_eq!(play(&format!("subdivision-levels={fitted}")), play(""));
}

/// A pipeline that shows the small stream in RGB through a decoder with these properties.
fn view(file: &TempFile, properties: &str, size: (i32, i32)) -> Outcome {
    let caps = format!("video/x-raw,format=RGB,width={},height={}", size.0, size.1);
    run(&format!("{} ! tetvecparse ! tetvecdec {properties} ! {caps}", file.source())).expect_clean()
}

#[test]
fn a_viewport_shows_a_part() {
    let file = TempFile::new(&stream(2));
    let whole = plane(&view(&file, "", (48 * 4, 32 * 4)).samples[1], 0);
    let part = view(&file, "viewport-x=12 viewport-y=8 viewport-width=24 viewport-height=16", (24 * 4, 16 * 4));
    let part = plane(&part.samples[1], 0);
    for y in 0..64 {
        let row = &whole[3 * ((y + 32) * 192 + 48)..][..3 * 96];
        let shown = &part[3 * y * 96..][..3 * 96];
        assert!(row.iter().zip(shown).all(|(a, b)| a.abs_diff(*b) <= 1), "row {y}");
    }
    let corner = view(&file, "viewport-x=24 viewport-y=16", (24 * 4, 16 * 4));
    let corner = plane(&corner.samples[0], 0);
    let row = &plane(&view(&file, "", (48 * 4, 32 * 4)).samples[0], 0)[3 * (64 * 192 + 96)..][..3 * 96];
    assert!(row.iter().zip(&corner[..3 * 96]).all(|(a, b)| a.abs_diff(*b) <= 1), "sides of 0 reach to the edges");
}

#[test]
fn a_viewport_may_change_while_playing() {
    let file = TempFile::new(&stream(10));
    let caps = "video/x-raw,format=RGB,width=48,height=32";
    let description = format!("{} ! tetvecparse ! tetvecdec name=decoder viewport-x=-48 ! {caps}", file.source());
    let running = Running::new(&description);
    let decoder = running.element("decoder");
    let count = std::sync::atomic::AtomicU32::new(0);
    let watched = decoder.clone();
    decoder.static_pad("src").expect("a pad").add_probe(gst::PadProbeType::BUFFER, move |_, _| {
        if count.fetch_add(1, std::sync::atomic::Ordering::Relaxed) == 4 {
            watched.set_property("viewport-x", 0.0);
        }
        gst::PadProbeReturn::Ok
    });
    let outcome = running.finish().expect_clean();
    // To the left of the source all is black.
    let left = |sample: &gst::Sample| plane(sample, 0).chunks(3 * 48).all(|row| row[..3 * 24].iter().all(|v| *v == 0));
    let dark: Vec<bool> = outcome.samples.iter().map(left).collect();
    assert_eq!(dark[..5], [true; 5], "the property is set after the fifth picture");
    let whole = view(&file, "", (48, 32));
    assert!(plane(&outcome.samples[9], 0) == plane(&whole.samples[9], 0));
}

#[test]
fn a_controller_pans_picture_by_picture() {
    let file = TempFile::new(&stream(10));
    let caps = "video/x-raw,format=RGB,width=96,height=64";
    let window = "viewport-y=8 viewport-width=24 viewport-height=16";
    let description = format!("{} ! tetvecparse ! tetvecdec name=decoder {window} ! {caps}", file.source());
    let running = Running::new(&description);
    let decoder = running.element("decoder");
    let path = gst_controller::InterpolationControlSource::new();
    path.set_property("mode", gst_controller::InterpolationMode::Linear);
    assert!(path.set(time_of(0), 2.0) && path.set(time_of(8), 18.0));
    let binding = gst_controller::DirectControlBinding::new_absolute(&decoder, "viewport-x", &path);
    decoder.add_control_binding(&binding).expect("a property that can be controlled");
    let panned = running.finish().expect_clean();
    for frame in [0, 3, 8] {
        let still = view(&file, &format!("{window} viewport-x={}", 2 * frame + 2), (96, 64));
        let (found, expected) = (plane(&panned.samples[frame], 0), plane(&still.samples[frame], 0));
        assert!(found.iter().zip(&expected).all(|(a, b)| a.abs_diff(*b) <= 1), "frame {frame}");
    }
    assert_ne!(plane(&panned.samples[0], 0), plane(&panned.samples[8], 0));
}

#[test]
fn a_mesh_is_drawn_over_the_picture() {
    let file = TempFile::new(&stream(1));
    for levels in [0, 1] {
        let settings = format!("subdivision-levels={levels}");
        let plain = plane(&view(&file, &settings, (480, 320)).samples[0], 0);
        let lined = plane(&view(&file, &format!("{settings} draw-mesh=true"), (480, 320)).samples[0], 0);
        let changed = plain.chunks(3).zip(lined.chunks(3)).filter(|(a, b)| a != b).count();
        assert!((480..480 * 320 / 2).contains(&changed), "level {levels}: {changed} pixels");
    }
}

#[test]
fn places_of_navigation_go_upstream_in_source_pixels() {
    let coded = encode(&raw(2));
    let packets = pictures(&coded);
    let mut harness = harness(&coded);
    let decoder = harness.element().expect("an element");
    decoder.set_property("viewport-x", 12.0);
    decoder.set_property("viewport-width", 24.0);
    assert_eq!(push(&mut harness, &packets[0]), 1);
    let structure = gst::Structure::builder("application/x-gst-navigation")
        .field("event", "mouse-move")
        .field("pointer_x", 24.0)
        .field("pointer_y", 16.0)
        .build();
    while harness.try_pull_upstream_event().is_some() {}
    assert!(harness.push_upstream_event(gst::event::Navigation::new(structure)));
    let found = harness.pull_upstream_event().expect("a navigation event");
    let place = |name| found.structure().expect("a place").get::<f64>(name);
    assert_eq!((place("pointer_x"), place("pointer_y")), (Ok(24.0), Ok(16.0)));
}
