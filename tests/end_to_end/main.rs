//! Frames through the encoder, the stream and the decoder, as an application uses them.

#![cfg(feature = "encode")]

mod clips;
mod damage;

use clips::{bars, config, decode, difference, disc, encode, picture, psnr, waves};
use tetvec::metrics::simplification_ratio;
use tetvec::{
    DecodeError, Decoder, DecoderConfig, EncodeError, Encoder, EncoderConfig, ErrorMetric, Event, Frame, Stage, Surface,
};

const SIZE: (u32, u32) = (24, 16);

/// Videos of one frame, of two, and of about a window's length, for a short window and the default one.
#[test]
fn videos_of_any_length_come_back() {
    for (window, lengths) in [(4, [1, 2, 3, 4, 5]), (10, [1, 2, 9, 10, 11])] {
        for length in lengths {
            let frames = disc(SIZE, 0, length);
            let stream = encode(&frames, EncoderConfig { window, ..config(SIZE) }, &[]);
            stream.check_framing(length.into());
            assert_eq!(stream.keyframes(), [0], "{length} frames");
            let decoded = decode(&stream.packets, SIZE, DecoderConfig::default());
            let psnr = psnr(&frames, &decoded);
            let floor = if length == 1 { 23.0 } else { 31.0 };
            assert!(psnr > floor, "{length} frames, window {window}: {psnr:.1} dB");
        }
    }
}

/// Keyframes are where they are forced, where the longest slab ends and where the scene changes, and decoding can
/// start at each.
#[test]
fn slabs_follow_each_other() {
    let mut frames = disc(SIZE, 0, 7);
    frames.extend(bars(SIZE, 7));
    let stream = encode(&frames, EncoderConfig { key_int_max: 5, ..config(SIZE) }, &[3]);
    stream.check_framing(frames.len() as u64);
    assert_eq!(stream.keyframes(), [0, 3, 7, 12], "forced, scene cut, longest slab");
    let decoded = decode(&stream.packets, SIZE, DecoderConfig::default());
    let quality = psnr(&frames, &decoded);
    assert!(quality > 28.0, "{quality:.1} dB");
    for start in [3, 7, 12] {
        let from_here = decode(&stream.packets[start..], SIZE, DecoderConfig::default());
        assert!(from_here == decoded[start..], "decoding from keyframe {start}");
    }
    let mut decoder = Decoder::new(DecoderConfig::default());
    assert_eq!(decoder.send_packet(&stream.packets[4].data), Err(DecodeError::NoKeyframe));
}

/// A picture between the last frame before a keyframe and the keyframe lies between both: slabs that follow each other
/// leave no gap in time. Before a scene cut the old scene holds.
#[test]
fn time_flows_across_keyframes_but_not_across_cuts() {
    let mut frames = disc(SIZE, 0, 6);
    frames.extend(bars(SIZE, 2));
    let stream = encode(&frames, EncoderConfig { simplification_ratio: 0.3, ..config(SIZE) }, &[3]);
    let mut decoder = Decoder::new(DecoderConfig::default());
    let mut between = |last: usize, time: f64| {
        decoder.flush();
        let slab = if last < 3 { 0..3 } else { 3..6 };
        for k in slab {
            decoder.send_packet(&stream.packets[k].data).expect("a good packet");
        }
        picture(&mut decoder, time, SIZE)
    };
    let towards_keyframe = between(2, 2.9);
    assert!(
        error(&frames[3], &towards_keyframe) < error(&frames[2], &towards_keyframe),
        "2.9 is nearer to 3 than to 2"
    );
    let before_cut = between(5, 5.9);
    assert!(error(&frames[5], &before_cut) < error(&frames[6], &before_cut), "5.9 holds frame 5");
    assert!(before_cut == between(5, 5.0), "5.9 is frame 5");
}

/// Mean squared error in dB below the peak, negated: larger is worse.
fn error(reference: &Frame, test: &Frame) -> f64 {
    -psnr(std::slice::from_ref(reference), std::slice::from_ref(test))
}

#[test]
fn settings_reach_the_stream() {
    let frames = disc(SIZE, 0, 4);
    for superpixels in [0, 1, 20] {
        for subdivision_levels in 0..=2 {
            let settings = EncoderConfig { superpixels, subdivision_levels, ..config(SIZE) };
            let stream = encode(&frames, settings.clone(), &[]);
            let mut decoder = Decoder::new(DecoderConfig::default());
            decoder.send_packet(&stream.packets[0].data).expect("a keyframe");
            // Slabs that begin with labels have finer positions.
            let mut header = *decoder.header().expect("a header");
            let usual = settings.header().subpixel_bits;
            let finest = if superpixels == 1 { usual } else { usual + 1 };
            assert!((usual..=finest).contains(&header.subpixel_bits), "{superpixels}: {}", header.subpixel_bits);
            header.subpixel_bits = usual;
            assert_eq!(header, settings.header());
            let decoded = decode(&stream.packets, SIZE, DecoderConfig::default());
            let psnr = psnr(&frames, &decoded);
            let what = format!("{superpixels} superpixels, level {subdivision_levels}");
            assert!(psnr > 28.0, "{what}: {psnr:.1} dB");
            // Drawing at another level than the one fitted for works as well.
            let other = DecoderConfig { subdivision_levels: Some(2 - subdivision_levels), ..DecoderConfig::default() };
            decode(&stream.packets, SIZE, other);
        }
    }
}

/// A fit on the way lowers the error of as many vertices.
#[test]
fn refits_pay() {
    const LARGE: (u32, u32) = (96, 64);
    let frames = waves(LARGE, 6);
    let with = |refits: u32| {
        let settings = EncoderConfig { refits, window: 60, simplification_ratio: 0.03, ..config(LARGE) };
        let stream = encode(&frames, settings, &[]);
        (stream.vertices, psnr(&frames, &decode(&stream.packets, LARGE, DecoderConfig::default())))
    };
    let ((vertices, without), (again, refitted)) = (with(0), with(2));
    assert_eq!(vertices, again);
    assert!(refitted > without + 0.5, "{without:.2} dB without, {refitted:.2} dB with two");
}

#[test]
fn both_metrics_reach_the_ratio_asked_for() {
    const LARGE: (u32, u32) = (48, 32);
    let frames = disc(LARGE, 0, 5);
    for (error_metric, asked, floor) in
        [(ErrorMetric::Color, 0.04, 33.0), (ErrorMetric::Color, 0.15, 42.0), (ErrorMetric::Paper, 0.04, 31.0)]
    {
        let settings = EncoderConfig { error_metric, simplification_ratio: asked, ..config(LARGE) };
        let stream = encode(&frames, settings, &[]);
        let found = simplification_ratio(stream.vertices, LARGE.0, LARGE.1, frames.len() as u64);
        assert!((found / asked - 1.0).abs() < 0.2, "{error_metric:?}: asked for {asked}, found {found}");
        let psnr = psnr(&frames, &decode(&stream.packets, LARGE, DecoderConfig::default()));
        assert!(psnr > floor, "{error_metric:?} at {asked}: {psnr:.1} dB");
    }
}

#[test]
fn threads_change_neither_bytes_nor_pixels() {
    let mut frames = disc(SIZE, 0, 6);
    frames.extend(bars(SIZE, 3));
    let [one, two] = [1, 2].map(|threads| encode(&frames, EncoderConfig { threads, ..config(SIZE) }, &[]));
    assert!(one.bytes() == two.bytes(), "bytes with 1 and 2 threads");
    for levels in 0..=2 {
        let draw = |threads| {
            let config = DecoderConfig { subdivision_levels: Some(levels), threads, ..DecoderConfig::default() };
            decode(&one.packets, (197, 131), config)
        };
        assert!(draw(1) == draw(2), "pixels with 1 and 2 threads at level {levels}");
    }
}

/// `cat a.tetv b.tetv` plays as one: frame numbers restart, pictures are those of each alone.
#[test]
fn streams_behind_each_other_play_as_one() {
    let first = encode(&disc(SIZE, 0, 3), config(SIZE), &[]);
    let second = encode(&disc((16, 20), 5, 2), config((16, 20)), &[]);
    let both: Vec<_> = first.packets.iter().chain(&second.packets).cloned().collect();
    let decoded = decode(&both, SIZE, DecoderConfig::default());
    assert_eq!(decoded.len(), 5);
    assert!(decoded[..3] == decode(&first.packets, SIZE, DecoderConfig::default()));
    assert!(decoded[3..] == decode(&second.packets, SIZE, DecoderConfig::default()));
}

#[test]
fn the_smallest_pictures_come_back() {
    for size in [(1, 1), (2, 1), (1, 7), (3, 3)] {
        let frames = disc(size, 0, 5);
        let stream = encode(&frames, EncoderConfig { simplification_ratio: 1.0, ..config(size) }, &[2]);
        stream.check_framing(5);
        let psnr = psnr(&frames, &decode(&stream.packets, size, DecoderConfig::default()));
        assert!(psnr > 20.0, "{size:?}: {psnr:.1} dB");
        let large = decode(&stream.packets, (33, 1), DecoderConfig::default());
        assert_eq!(large.len(), 5, "{size:?} drawn at another size");
    }
}

/// Where nothing moves, pictures differ less from each other than if their errors were independent, which would be
/// twice the squared error of each, 3 dB.
/// A drawing that moves a little, at `scale` times its size: a disc, a bar that is no whole number of pixels wide, a thin
/// slanted stroke of the bar's ink.
fn drawing((width, height): (u32, u32), scale: u32, count: u32) -> Vec<Frame> {
    let picture = |k: u32| {
        let color = |x: u32, y: u32| {
            let [x, y] = [x, y].map(|n| (n as f32 + 0.5) / scale as f32);
            let ink = (50.3..73.8).contains(&x) && (40.4..49.7).contains(&y);
            let stroke = (y - 8.0 - 0.2 * x).abs() < 0.6 && (10.0..86.0).contains(&x);
            let disc = (x - 26.4 - 0.3 * k as f32).hypot(y - 38.7) < 14.0;
            if ink || stroke { [24, 20, 32] } else { [[230, 220, 200], [200, 50, 60]][usize::from(disc)] }
        };
        Frame::from_fn(width * scale, height * scale, color).expect("a size within the limits")
    };
    (0..count).map(picture).collect()
}

/// Means over squares of `scale` pixels a side.
fn reduced(frame: &Frame, scale: u32) -> Frame {
    let mean = |x: u32, y: u32| {
        let mut sum = [0u32; 3];
        for n in 0..scale * scale {
            let pixel = frame.pixel(x * scale + n % scale, y * scale + n / scale);
            (0..3).for_each(|c| sum[c] += u32::from(pixel[c]));
        }
        sum.map(|s| ((s + scale * scale / 2) / (scale * scale)) as u8)
    };
    Frame::from_fn(frame.width() / scale, frame.height() / scale, mean).expect("a size within the limits")
}

/// Enlarged by linear interpolation.
fn enlarged(frame: &Frame, scale: u32) -> Frame {
    let color = |x: u32, y: u32| {
        let at = |n: u32, side: u32| ((n as f32 + 0.5) / scale as f32 - 0.5).clamp(0.0, (side - 1) as f32);
        let (x, y) = (at(x, frame.width()), at(y, frame.height()));
        let pixel = |dx: u32, dy: u32| {
            frame.pixel((x as u32 + dx).min(frame.width() - 1), (y as u32 + dy).min(frame.height() - 1)).map(f32::from)
        };
        let quad = [pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)];
        let (u, v) = (x.fract(), y.fract());
        [0, 1, 2].map(|c| {
            let [a, b, e, f] = quad.map(|pixel| pixel[c]);
            ((a + (b - a) * u) * (1.0 - v) + (e + (f - e) * u) * v).round() as u8
        })
    };
    Frame::from_fn(frame.width() * scale, frame.height() * scale, color).expect("a size within the limits")
}

/// What vectors are for: edges within pixels, found again when the picture is enlarged.
#[test]
fn drawings_enlarge_sharper_than_their_pixels() {
    const LARGE: (u32, u32) = (96, 64);
    const SCALE: u32 = 8;
    let truth = drawing(LARGE, SCALE, 9);
    let frames: Vec<Frame> = truth.iter().map(|frame| reduced(frame, SCALE)).collect();
    let settings = EncoderConfig { superpixels: 0, simplification_ratio: 0.02, ..EncoderConfig::new(LARGE.0, LARGE.1) };
    let stream = encode(&frames, settings, &[]);
    let drawn = decode(&stream.packets, (LARGE.0 * SCALE, LARGE.1 * SCALE), DecoderConfig::default());
    let pixels: Vec<Frame> = frames.iter().map(|frame| enlarged(frame, SCALE)).collect();
    let (drawn, pixels) = (psnr(&truth, &drawn), psnr(&truth, &pixels));
    assert!(drawn > pixels + 3.0, "{drawn:.1} dB as vectors, {pixels:.1} dB as pixels");
}

#[test]
fn a_still_scene_is_still() {
    let frames = vec![disc(SIZE, 3, 1).remove(0); 9];
    let stream = encode(&frames, config(SIZE), &[]);
    let decoded = decode(&stream.packets, SIZE, DecoderConfig::default());
    let (flicker, quality) = (psnr(&decoded[1..], &decoded[..8]), psnr(&frames, &decoded));
    assert!(flicker > quality - 3.0, "{flicker:.1} dB from frame to frame, {quality:.1} dB from the source");
}

#[test]
fn an_empty_stream_is_empty() {
    let mut encoder = Encoder::try_new(config(SIZE)).expect("settings in range");
    encoder.finish().expect("nothing to write");
    assert_eq!(encoder.receive_packet(), None);
    assert_eq!(encoder.vertices(), 0);
    let frame = disc(SIZE, 0, 1).remove(0);
    assert_eq!(encoder.send_frame(frame, false), Err(EncodeError::Finished));
    let mut decoder = Decoder::new(DecoderConfig::default());
    assert!(decoder.header().is_none());
    assert!(decoder.send_packet(&[]).is_err());
    let mut picture = Frame::from_fn(4, 4, |_, _| [0; 3]).expect("a size within the limits");
    assert_eq!(decoder.render(0.0, None, &mut Surface::of_frame(&mut picture)), Err(DecodeError::NoKeyframe));
}

#[test]
fn frames_of_another_size_are_refused_and_the_stream_goes_on() {
    let mut encoder = Encoder::try_new(config((4, 4))).expect("settings in range");
    for frame in disc((4, 4), 0, 2) {
        let other = disc((5, 4), 0, 1).remove(0);
        let refused = encoder.send_frame(other, false);
        assert_eq!(refused, Err(EncodeError::FrameSize { expected: (4, 4), found: (5, 4) }));
        encoder.send_frame(frame, false).expect("a good frame");
    }
    encoder.finish().expect("a stream");
    assert_eq!(std::iter::from_fn(|| encoder.receive_packet()).count(), 3);
}

/// Whoever asks is told of every stage, in brackets, and of what collapses and fits did.
#[test]
fn an_observer_hears_of_every_stage() {
    use std::sync::{Arc, Mutex};
    let heard = Arc::new(Mutex::new(Vec::new()));
    let mut encoder = Encoder::try_new(config(SIZE)).expect("good settings");
    let told = heard.clone();
    encoder.observe(move |event| told.lock().unwrap().push(event));
    for frame in disc(SIZE, 0, 6) {
        encoder.send_frame(frame, false).expect("a good frame");
    }
    encoder.finish().expect("an end");
    let heard = heard.lock().unwrap();
    for stage in Stage::ALL {
        assert!(heard.contains(&Event::Began(stage)), "{}", stage.name());
    }
    let mut open = false;
    for event in heard.iter() {
        match event {
            Event::Began(_) => assert!(!std::mem::replace(&mut open, true), "one stage at a time"),
            Event::Ended => assert!(std::mem::replace(&mut open, false)),
            Event::Simplified(_) | Event::Fitted(_) => {}
        }
    }
    assert!(heard.iter().any(|event| matches!(event, Event::Simplified(report) if report.collapses > 0)));
    assert!(heard.iter().any(|event| matches!(event, Event::Fitted(report) if report.pixels > 0)));
}

/// Ten seconds at 25 frames a second, in slabs of a second.
#[test]
fn the_bit_rate_is_kept_over_ten_seconds() {
    let size = (64, 48);
    let frames = disc(size, 0, 250);
    for kilobits in [60, 150] {
        let config = EncoderConfig { bitrate: kilobits, key_int_max: 25, position_steps: 2, ..config(size) };
        let stream = encode(&frames, config, &[]);
        let reached = stream.bytes().len() as f64 * 8.0 / 10.0 / 1000.0;
        let off = reached / f64::from(kilobits) - 1.0;
        assert!(off.abs() <= 0.05, "{kilobits} kbit/s asked for, {reached:.1} reached");
    }
}

/// The error is kept slab by slab by one fit, and by several, which need fewer vertices for it.
#[test]
fn the_error_is_kept_and_refits_have_it_for_less() {
    const TARGET: f64 = 2.5;
    let size = (64, 48);
    let frames = waves(size, 48);
    let with = |refits: u32| {
        let goal = EncoderConfig { target_error: TARGET, key_int_max: 16, window: 16, superpixels: 1, ..config(size) };
        let stream = encode(&frames, EncoderConfig { refits, ..goal }, &[]);
        let shown = decode(&stream.packets, size, DecoderConfig::default());
        let reached = difference(&frames, &shown).reconstruction_error();
        assert!((reached / TARGET - 1.0).abs() <= 0.05, "{refits} refits: {reached:.2} for {TARGET}");
        stream.vertices
    };
    let (without, refitted) = (with(0), with(2));
    assert!((refitted as f64) < 0.9 * without as f64, "{refitted} for {without} vertices");
}
