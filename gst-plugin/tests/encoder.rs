//! `tetvecenc`: formats, times, drains, flushes, keyframes, presets and reports.

mod pipeline;

use gst::ClockTime;
use gst::prelude::*;
use pipeline::{ENCODER, RATE, TempFile, encode, init, packets, raw, run, time_of};
use tetvec::{EncoderConfig, SpeedPreset};

/// A harness with an encoder of small windows and keyframes every five frames.
fn harness() -> gst_check::Harness {
    init();
    gst_check::Harness::new_parse(ENCODER)
}

fn caps(width: i32, height: i32, rate: (i32, i32)) -> gst::Caps {
    gst_video::VideoCapsBuilder::new()
        .format(gst_video::VideoFormat::Rgb)
        .width(width)
        .height(height)
        .framerate(rate.into())
        .build()
}

/// Frame `number` of a stream of 25 frames a second.
fn frame(caps: &gst::Caps, number: u64) -> gst::Buffer {
    let info = gst_video::VideoInfo::from_caps(caps).expect("raw caps");
    // A ramp that moves: something to code in every frame, and quick to code.
    let bytes = (0..info.size()).map(|i| (i as u64 * 200 / info.size() as u64 + number) as u8).collect::<Vec<u8>>();
    let mut buffer = gst::Buffer::from_mut_slice(bytes);
    let header = buffer.get_mut().expect("a new buffer");
    header.set_pts(time_of(number));
    header.set_duration(time_of(1));
    buffer
}

fn is_index(buffer: &gst::BufferRef) -> bool {
    buffer.flags().contains(gst::BufferFlags::HEADER)
}

fn drain(harness: &mut gst_check::Harness) -> Vec<gst::Buffer> {
    std::iter::from_fn(|| harness.try_pull()).collect()
}

/// Start, length and kind of a buffer.
fn outline(buffer: &gst::BufferRef) -> (Option<ClockTime>, Option<ClockTime>, bool) {
    (buffer.pts(), buffer.duration(), buffer.flags().contains(gst::BufferFlags::DELTA_UNIT))
}

#[test]
fn every_format_and_odd_sizes_are_encoded() {
    init();
    for format in ["RGB", "RGBx", "BGRx", "I420", "NV12", "YUY2", "GRAY8"] {
        for (width, height) in [(24, 16), (17, 9), (1, 1)] {
            let source = format!(
                "videotestsrc num-buffers=3 ! video/x-raw,format={format},width={width},height={height},framerate=25/1"
            );
            let coded = encode(&source);
            let pictures = coded.buffers().filter(|buffer| !is_index(buffer)).count();
            assert_eq!(pictures, 3, "{format} {width}x{height}");
            let caps = coded.samples[0].caps().expect("caps").to_owned();
            let structure = caps.structure(0).expect("a structure");
            assert_eq!(structure.name(), "video/x-tetvec");
            assert_eq!((structure.get("width"), structure.get("height")), (Ok(width), Ok(height)));
            assert_eq!(structure.get("framerate"), Ok(gst::Fraction::new(25, 1)));
            assert_eq!((structure.get("parsed"), structure.get("alignment")), (Ok(true), Ok("frame")));
            assert!(structure.has_field("codec_data"));
        }
    }
}

/// A flat picture comes out in the colour that its format and colorimetry can hold.
#[test]
fn every_format_keeps_its_colours() {
    init();
    let color = [33, 48, 95];
    let formats = ["RGB", "xRGB", "xBGR", "BGR"].map(|format| (format, "sRGB"));
    let luma = ["I420", "NV12", "YV12", "NV21", "Y42B", "Y444", "YUY2", "UYVY"];
    let luma = luma.into_iter().flat_map(|format| [(format, "bt601"), (format, "bt709"), (format, "1:4:0:0")]);
    for (format, colorimetry) in formats.into_iter().chain(luma) {
        // Through 16 bits: the test must not lean on a conversion with an error of its own.
        let coded = encode(&format!(
            "videotestsrc num-buffers=1 pattern=solid-color foreground-color=0xff21305f ! video/x-raw,format=RGB ! \
             videoconvert ! video/x-raw,format=ARGB64 ! videoconvert dither=none ! \
             video/x-raw,format={format},colorimetry={colorimetry},width=24,height=16,framerate=25/1"
        ));
        let mut bytes = Vec::new();
        coded.buffers().for_each(|buffer| bytes.extend_from_slice(&buffer.map_readable().expect("memory")));
        let file = TempFile::new(&bytes);
        let shown = run(&format!("{} ! tetvecparse ! tetvecdec ! video/x-raw,format=RGB", file.source()));
        let shown = shown.expect_clean().bytes();
        let (pixels, _) = shown.as_chunks::<3>();
        let off = pixels.iter().flat_map(|pixel| (0..3).map(|c| pixel[c].abs_diff(color[c]))).max();
        assert!(off <= Some(2), "{format} {colorimetry}: {:?}", pixels[0]);
    }
}

#[test]
fn times_are_the_sources_and_keyframes_are_regular() {
    let coded = encode(&raw(13));
    let outlines: Vec<_> = coded.buffers().filter(|buffer| !is_index(buffer)).map(outline).collect();
    let expected: Vec<_> = (0..13).map(|k| (Some(time_of(k)), Some(time_of(1)), k % 5 != 0)).collect();
    assert_eq!(outlines, expected);
    let last = coded.buffers().next_back().expect("an index");
    assert!(is_index(last) && last.flags().contains(gst::BufferFlags::DELTA_UNIT));
    assert_eq!(last.pts(), Some(time_of(13)));
    let bytes = coded.bytes();
    let numbers: Vec<u64> = packets(&bytes).iter().map(|(_, packet)| packet.frame_number).collect();
    assert_eq!(numbers, (0..=13).collect::<Vec<u64>>());
}

#[test]
fn lengths_of_one_frame_up_to_some_windows_come_out_whole() {
    for frames in [1, 2, 3, 4, 5, 9] {
        let coded = encode(&raw(frames));
        assert_eq!(coded.buffers().filter(|buffer| !is_index(buffer)).count() as u64, frames);
    }
}

#[test]
fn no_frames_make_no_stream() {
    let mut harness = harness();
    harness.set_src_caps(caps(24, 16, (25, 1)));
    assert!(harness.push_event(gst::event::Eos::new()));
    assert_eq!(harness.buffers_received(), 0);
}

#[test]
fn frames_without_a_fixed_rate_keep_their_times() {
    let mut harness = harness();
    let caps = caps(24, 16, (0, 1));
    harness.set_src_caps(caps.clone());
    let times = [0, 40, 200, 201, 1000].map(ClockTime::from_mseconds);
    for (number, time) in times.into_iter().enumerate() {
        let mut buffer = frame(&caps, number as u64);
        let header = buffer.get_mut().expect("a new buffer");
        header.set_pts(time);
        header.set_duration(None);
        harness.push(buffer).expect("a frame is taken");
    }
    harness.push_event(gst::event::Eos::new());
    let came: Vec<_> = drain(&mut harness).iter().filter(|b| !is_index(b)).map(|b| b.pts().expect("a time")).collect();
    assert_eq!(came, times);
}

#[test]
fn latency_is_that_of_the_core() {
    let mut harness = harness();
    harness.set_src_caps(caps(24, 16, (25, 1)));
    let config = EncoderConfig { window: 4, key_int_max: 5, ..EncoderConfig::new(24, 16) };
    let frames = tetvec::Encoder::try_new(config).expect("sound settings").latency_frames();
    assert!(frames > 0);
    assert_eq!(harness.query_latency(), Some(time_of(u64::from(frames))));
}

#[test]
fn a_frame_waits_no_longer_than_the_latency() {
    let mut harness = harness();
    let caps = caps(24, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    let latency = harness.query_latency().expect("a latency");
    for number in 0..20 {
        harness.push(frame(&caps, number)).expect("a frame is taken");
        while let Some(packet) = harness.try_pull() {
            assert!(time_of(number) <= packet.pts().expect("a time") + latency);
        }
        let waiting = number + 1 - u64::from(harness.buffers_received());
        assert!(time_of(waiting) <= latency + time_of(1), "{waiting} frames wait");
    }
}

#[test]
fn pictures_are_given_back_at_once() {
    let mut harness = harness();
    let caps = caps(24, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    let pool = gst::BufferPool::new();
    let mut config = pool.config();
    config.set_params(Some(&caps), 24 * 16 * 3, 2, 2);
    pool.set_config(config).expect("a configuration");
    pool.set_active(true).expect("a pool starts");
    for number in 0..12 {
        let params = gst::BufferPoolAcquireParams::with_flags(gst::BufferPoolAcquireFlags::DONTWAIT);
        let mut buffer = pool.acquire_buffer(Some(&params)).expect("one of the two buffers is free");
        buffer.get_mut().expect("writable").set_pts(time_of(number));
        harness.push(buffer).expect("a frame is taken");
    }
    pool.set_active(false).expect("a pool stops");
}

#[test]
fn padded_rows_are_read_where_they_are() {
    init();
    let (width, height, stride) = (17usize, 9usize, 128usize);
    let info = gst_video::VideoInfo::builder(gst_video::VideoFormat::Rgb, 17, 9).fps((25, 1)).build().expect("info");
    let caps = info.to_caps().expect("caps");
    let color = |x: usize, y: usize, c: usize| (x * 5 + y * 3 + c * 40) as u8;
    let mut streams = Vec::new();
    for (row, pad) in [(width * 3, 0u8), (stride, 255)] {
        let row = row.next_multiple_of(4);
        let mut bytes = vec![pad; row * height];
        for (y, line) in bytes.chunks_mut(row).enumerate() {
            for (i, byte) in line.iter_mut().take(width * 3).enumerate() {
                *byte = color(i / 3, y, i % 3);
            }
        }
        let mut buffer = gst::Buffer::from_mut_slice(bytes);
        let header = buffer.get_mut().expect("a new buffer");
        header.set_pts(ClockTime::ZERO);
        gst_video::VideoMeta::add_full(
            header,
            gst_video::VideoFrameFlags::empty(),
            gst_video::VideoFormat::Rgb,
            17,
            9,
            &[0],
            &[row as i32],
        )
        .expect("a meta");
        let mut harness = harness();
        harness.set_src_caps(caps.clone());
        harness.push(buffer).expect("a frame is taken");
        harness.push_event(gst::event::Eos::new());
        let coded: Vec<u8> =
            drain(&mut harness).iter().flat_map(|buffer| buffer.map_readable().expect("memory").to_vec()).collect();
        streams.push(coded);
    }
    assert!(!streams[0].is_empty());
    assert_eq!(streams[0], streams[1]);
}

#[test]
fn a_keyframe_comes_where_it_is_asked_for() {
    let mut harness = harness();
    let caps = caps(24, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    for number in 0..8 {
        if number == 3 {
            let ask = gst_video::DownstreamForceKeyUnitEvent::builder()
                .timestamp(time_of(3))
                .stream_time(time_of(3))
                .running_time(time_of(3))
                .all_headers(true)
                .build();
            assert!(harness.push_event(ask));
        }
        harness.push(frame(&caps, number)).expect("a frame is taken");
    }
    harness.push_event(gst::event::Eos::new());
    let keys: Vec<u64> = drain(&mut harness)
        .iter()
        .filter(|buffer| !buffer.flags().contains(gst::BufferFlags::DELTA_UNIT))
        .map(|buffer| buffer.pts().expect("a time").nseconds() * RATE / 1_000_000_000)
        .collect();
    assert_eq!(keys, [0, 3]);
}

#[test]
fn new_caps_drain_the_old_stream_and_start_another() {
    let mut harness = harness();
    let (small, large) = (caps(24, 16, (25, 1)), caps(32, 24, (25, 1)));
    let mut number = 0;
    for caps in [&small, &large] {
        harness.set_src_caps(caps.clone());
        for _ in 0..6 {
            harness.push(frame(caps, number)).expect("a frame is taken");
            number += 1;
        }
    }
    harness.push_event(gst::event::Eos::new());
    let buffers = drain(&mut harness);
    let pictures: Vec<_> = buffers.iter().filter(|buffer| !is_index(buffer)).collect();
    assert_eq!(pictures.len(), 12);
    assert!(pictures.iter().zip(0..).all(|(buffer, k)| buffer.pts() == Some(time_of(k))));
    assert!(!pictures[6].flags().contains(gst::BufferFlags::DELTA_UNIT));
    // Two streams, each with its own index, one behind the other.
    let bytes: Vec<u8> = buffers.iter().flat_map(|buffer| buffer.map_readable().expect("memory").to_vec()).collect();
    let numbers: Vec<u64> = packets(&bytes).iter().map(|(_, packet)| packet.frame_number).collect();
    assert_eq!(numbers, [0, 1, 2, 3, 4, 5, 6, 0, 1, 2, 3, 4, 5, 6]);
}

#[test]
fn a_flush_drops_what_waits_and_goes_on_with_a_keyframe() {
    let mut harness = harness();
    let caps = caps(24, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    for number in 0..3 {
        harness.push(frame(&caps, number)).expect("a frame is taken");
    }
    harness.push_event(gst::event::FlushStart::new());
    harness.push_event(gst::event::FlushStop::new(true));
    drain(&mut harness);
    harness.push_event(gst::event::Segment::new(&gst::FormattedSegment::<ClockTime>::new()));
    for number in 50..53 {
        harness.push(frame(&caps, number)).expect("a frame is taken");
    }
    harness.push_event(gst::event::Eos::new());
    let outlines: Vec<_> = drain(&mut harness).iter().filter(|buffer| !is_index(buffer)).map(|b| outline(b)).collect();
    let expected: Vec<_> = (50..53).map(|k| (Some(time_of(k)), Some(time_of(1)), k != 50)).collect();
    assert_eq!(outlines, expected);
}

#[test]
fn sizes_beyond_the_limits_are_refused() {
    let mut harness = harness();
    let side = i32::try_from(tetvec::video::MAX_FRAME_SIDE).expect("a side") + 1;
    let caps = caps(side, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    assert_eq!(harness.push(frame(&caps, 0)), Err(gst::FlowError::NotNegotiated));
}

/// The value of a property as it is written.
fn written(element: &gst::Element, property: &str) -> String {
    element.property_value(property).serialize().expect("a value").to_string()
}

#[test]
fn the_preset_decides_what_is_not_set() {
    init();
    let element = gst::ElementFactory::make("tetvecenc").build().expect("an encoder");
    assert_eq!(written(&element, "speed-preset"), "medium");
    let defaults = EncoderConfig::new(1, 1);
    for (nick, preset) in [
        ("medium", SpeedPreset::Medium),
        ("fast", SpeedPreset::Fast),
        ("slow", SpeedPreset::Slow),
        ("paper", SpeedPreset::Paper),
        ("medium", SpeedPreset::Medium),
    ] {
        element.set_property_from_str("speed-preset", nick);
        let config = defaults.clone().with_preset(preset);
        assert_eq!(element.property::<u32>("window"), config.window, "{nick}");
        assert_eq!(element.property::<u32>("superpixels"), config.superpixels, "{nick}");
        assert_eq!(element.property::<u32>("subdivision-levels"), u32::from(config.subdivision_levels), "{nick}");
        assert_eq!(element.property::<f64>("lattice-density"), config.lattice_density, "{nick}");
        assert_eq!(element.property::<u32>("position-steps"), config.position_steps, "{nick}");
        assert_eq!(element.property::<u32>("refits"), config.refits, "{nick}");
        assert_eq!(element.property::<u32>("key-int-max"), defaults.key_int_max, "{nick}");
        let choices = ["lattice", "topology", "error-metric"].map(|property| written(&element, property));
        let expected = if nick == "paper" { ["dense", "strict", "paper"] } else { ["adaptive", "auto", "colour"] };
        assert_eq!(choices, expected, "{nick}");
    }
}

#[test]
fn what_is_set_by_itself_wins_before_and_after_the_preset() {
    init();
    for settings in ["window=7 topology=strict speed-preset=fast", "speed-preset=fast window=7 topology=strict"] {
        let element = gst::parse::launch(&format!("tetvecenc {settings}")).expect("an encoder");
        for preset in ["fast", "slow", "medium"] {
            element.set_property_from_str("speed-preset", preset);
            assert_eq!(element.property::<u32>("window"), 7, "{settings}, then {preset}");
            assert_eq!(written(&element, "topology"), "strict", "{settings}, then {preset}");
        }
    }
}

#[test]
fn the_core_gets_what_preset_and_properties_say() {
    init();
    let fast = EncoderConfig { key_int_max: 600, ..EncoderConfig::new(24, 16) }.with_preset(SpeedPreset::Fast);
    let longer = EncoderConfig { window: 40, ..fast.clone() };
    for (settings, config) in [("speed-preset=fast", fast), ("window=40 speed-preset=fast", longer)] {
        let mut harness = gst_check::Harness::new_parse(&format!("tetvecenc key-int-max=600 {settings}"));
        harness.set_src_caps(caps(24, 16, (25, 1)));
        let frames = tetvec::Encoder::try_new(config).expect("sound settings").latency_frames();
        assert_eq!(harness.query_latency(), Some(time_of(u64::from(frames))), "{settings}");
    }
}

#[test]
fn the_application_is_told_how_far_the_encoding_is() {
    let mut harness = harness();
    let bus = gst::Bus::new();
    harness.element().expect("an encoder").set_bus(Some(&bus));
    let caps = caps(24, 16, (25, 1));
    harness.set_src_caps(caps.clone());
    for number in 0..13 {
        harness.push(frame(&caps, number)).expect("a frame is taken");
    }
    harness.push_event(gst::event::Eos::new());
    let reports: Vec<gst::Structure> =
        bus.iter_filtered(&[gst::MessageType::Element]).filter_map(|m| m.structure().map(|s| s.to_owned())).collect();
    assert!(reports.len() >= 2, "with the first packets and at the end");
    let count = |report: &gst::Structure, field: &str| report.get::<u64>(field).expect("a count");
    for pair in reports.windows(2) {
        for field in ["frames-in", "packets-out", "vertices", "time-fit", "collapses", "evaluations"] {
            assert!(count(&pair[0], field) <= count(&pair[1], field), "{field}: {pair:?}");
        }
    }
    let last = reports.last().expect("a report");
    assert_eq!(last.name(), "tetvecenc-progress");
    assert_eq!((count(last, "frames-in"), count(last, "packets-out")), (13, 13));
    // Three slabs, each a box at least.
    assert!(count(last, "vertices") >= 3 * 8);
    let times = ["segment", "lattice", "simplify", "fit", "write"].map(|stage| count(last, &format!("time-{stage}")));
    assert!(times.iter().sum::<u64>() > 0);
    assert!(0 < count(last, "collapses") && count(last, "collapses") <= count(last, "evaluations"));
    let refusals = last.get::<gst::Structure>("refusals").expect("refusals");
    let mut names: Vec<&str> = refusals.fields().map(|name| name.as_str()).collect();
    names.sort_unstable();
    assert_eq!(names, ["extent", "flip", "frozen", "labels", "link", "sides", "sliver"]);
    assert!((0.0..255.0).contains(&last.get::<f64>("fit-rms").expect("an error")));
    assert_eq!(last.has_field("memory"), cfg!(target_os = "linux"));
}
