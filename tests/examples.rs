//! What the examples read: y4m files, streams with damage in them, times to draw at.

#![cfg(feature = "encode")]

#[path = "../examples/vectorize/source.rs"]
mod source;
#[path = "../examples/render/stream.rs"]
mod stream;
#[path = "../examples/render/times.rs"]
mod times;

use std::path::PathBuf;

use source::{Source, SourceError};
use stream::Packets;
use tetvec::bitstream::Fraction;
use tetvec::{Encoder, EncoderConfig, Frame};
use times::{Times, parse_time, parse_viewport};

/// Writes `bytes` to a file of its own and opens it.
fn open(name: &str, bytes: &[u8]) -> Result<Source, SourceError> {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::write(&path, bytes).expect("a place for temporary files");
    source::open(&[path])
}

fn y4m(header: &str, frames: &[&[u8]]) -> Vec<u8> {
    let mut bytes = format!("{header}\n").into_bytes();
    for frame in frames {
        bytes.extend_from_slice(b"FRAME\n");
        bytes.extend_from_slice(frame);
    }
    bytes
}

#[test]
fn y4m_is_read_with_what_its_header_says() {
    let frame = [&[235; 15][..], &[128; 6], &[128; 6]].concat();
    let bytes = y4m("YUV4MPEG2 W5 H3 F30000:1001 Ip A8:9 C420jpeg Xcomment", &[&frame, &frame]);
    let source = open("halved.y4m", &bytes).expect("a y4m file");
    assert_eq!((source.width, source.height, source.length), (5, 3, Some(2)));
    assert_eq!(source.frame_rate, Fraction { numerator: 30_000, denominator: 1_001 });
    assert_eq!(source.pixel_aspect_ratio, Fraction { numerator: 8, denominator: 9 });
    assert_eq!(source.to_string(), "5x3, 29.970 frames a second, pixels of 8:9, 2 frames");
    let frames: Vec<Frame> = source.frames.collect::<Result<_, _>>().expect("two frames");
    let white = Frame::from_fn(5, 3, |_, _| [255; 3]).expect("a small frame");
    assert!(frames == [white.clone(), white]);
}

#[test]
fn y4m_without_colour_is_grey() {
    let source = open("mono.y4m", &y4m("YUV4MPEG2 W2 H1 F0:0 Cmono", &[&[16, 126]])).expect("a y4m file");
    assert_eq!(source.frame_rate, Fraction { numerator: 0, denominator: 1 });
    let frames: Vec<Frame> = source.frames.collect::<Result<_, _>>().expect("a frame");
    assert!(frames == [Frame::from_fn(2, 1, |x, _| [128 * x as u8; 3]).expect("a small frame")]);
}

#[test]
fn unusable_y4m_is_refused_by_field() {
    let field = |name: &str, header: &str| match open(name, format!("{header}\n").as_bytes()) {
        Err(SourceError::Header { field, .. }) => field,
        Err(SourceError::Size(_)) => "size",
        Err(other) => panic!("{header}: {other}"),
        Ok(source) => panic!("{header}: {source}"),
    };
    assert_eq!(field("1.y4m", "RIFF"), "magic");
    assert_eq!(field("2.y4m", "YUV4MPEG2 Wfive H3"), "width");
    assert_eq!(field("3.y4m", "YUV4MPEG2 W5"), "size");
    assert_eq!(field("4.y4m", "YUV4MPEG2 W99999 H99999"), "size");
    assert_eq!(field("5.y4m", "YUV4MPEG2 W5 H3 F25:0"), "frame rate");
    assert_eq!(field("6.y4m", "YUV4MPEG2 W5 H3 C444"), "color space");
    assert_eq!(field("7.y4m", "YUV4MPEG2 W5 H3 XCOLORRANGE=FULL"), "color range");
}

#[test]
fn y4m_that_ends_early_gives_its_whole_frames_and_an_error() {
    let bytes = y4m("YUV4MPEG2 W2 H2", &[&[90; 6], &[90; 5]]);
    let mut frames = open("cut.y4m", &bytes).expect("a y4m file").frames;
    assert!(matches!(frames.next(), Some(Ok(_))));
    assert!(matches!(frames.next(), Some(Err(SourceError::Truncated { frame: 1, expected: 6, found: 5 }))));
    assert!(frames.next().is_none());
    assert!(matches!(source::open(&[]), Err(SourceError::Empty)));
}

/// Packets of a small stream.
fn packets() -> Vec<Vec<u8>> {
    let mut encoder = Encoder::try_new(EncoderConfig::new(4, 4)).expect("settings in range");
    for k in 0..3 {
        let frame = Frame::from_fn(4, 4, |x, _| [80 * k, 60 * x as u8, 7]).expect("a small frame");
        encoder.send_frame(frame, false).expect("a good frame");
    }
    encoder.finish().expect("a stream");
    std::iter::from_fn(|| encoder.receive_packet()).map(|packet| packet.data).collect()
}

#[test]
fn damage_between_packets_is_skipped_and_reported() {
    let packets = packets();
    let whole = packets.concat();
    let found: Vec<Vec<u8>> = Packets::new(&whole).map(|packet| packet.expect("a packet").to_vec()).collect();
    assert_eq!(found, packets);

    let damaged = [&packets[0][..], b"noise \x89TVP", &packets[1], &packets[2][..9]].concat();
    let found: Vec<_> = Packets::new(&damaged).map(|packet| packet.map(<[u8]>::to_vec)).collect();
    let ends = |index: usize| found[index].as_ref().err().map(|damage| (damage.start, damage.end));
    assert_eq!(found.len(), 4);
    assert_eq!(found[0].as_ref(), Ok(&packets[0]));
    let (first, second) = (packets[0].len(), packets[0].len() + 10);
    assert_eq!(ends(1), Some((first, second)));
    assert_eq!(found[2].as_ref(), Ok(&packets[1]));
    assert_eq!(ends(3), Some((second + packets[1].len(), damaged.len())));
}

/// A packet that was cut off swallows the start of what follows it, until it is found to be damaged.
#[test]
fn packets_inside_of_a_distrusted_one_are_found() {
    let packets = packets();
    let cut = [&packets[0][..packets[0].len() / 2], &packets.concat()].concat();
    let mut found = Packets::new(&cut);
    assert_ne!(found.next().expect("bytes").ok(), Some(&packets[0][..]), "the cut packet and what follows");
    found.distrust_last();
    let rest: Vec<Vec<u8>> = found.map(|packet| packet.expect("a packet").to_vec()).collect();
    assert_eq!(rest, packets);
}

#[test]
fn times_are_ranges_and_numbers() {
    assert_eq!("all".parse(), Ok(Times::All));
    assert_eq!("3..5,0.5,4".parse(), Ok(Times::At(vec![0.5, 3.0, 4.0])));
    for bad in ["", "5..3", "-1", "nan", "1,,2", "0..9999999", "1..x"] {
        assert!(bad.parse::<Times>().is_err(), "{bad:?}");
    }
    assert_eq!(parse_time("12.5"), Ok(12.5));
    assert!(parse_viewport("1,2,3,4.5").is_ok());
    for bad in ["1,2,3", "1,2,0,4", "a,2,3,4", "nan,1,1,1"] {
        assert!(parse_viewport(bad).is_err(), "{bad:?}");
    }
}
