//! Damaged streams through the decoder: no panic, a typed error, and the next keyframe plays on.

use std::sync::LazyLock;

use tetvec::{DecodeError, Decoder, DecoderConfig, Frame, Packet, Surface};

use crate::clips::{Stream, config, disc, encode, picture};

const SIZE: (u32, u32) = (16, 12);
/// Frames in the slab that is damaged; another keyframe follows.
const SLAB: usize = 4;

static STREAM: LazyLock<Stream> = LazyLock::new(|| encode(&disc(SIZE, 0, SLAB as u32 + 2), config(SIZE), &[SLAB]));

/// What the stream shows at its second keyframe when nothing is damaged.
static AFTER: LazyLock<Frame> = LazyLock::new(|| {
    let mut decoder = Decoder::new(DecoderConfig::default());
    play_on(&mut decoder)
});

/// Decodes the second keyframe and draws it.
fn play_on(decoder: &mut Decoder) -> Frame {
    decoder.send_packet(&STREAM.packets[SLAB].data).expect("a keyframe whatever came before");
    picture(decoder, SLAB as f64, SIZE)
}

/// Sends the packets of the first slab with one replaced. Pictures are drawn in between: whatever was decoded must be
/// drawn without harm.
fn play_damaged(packet: usize, data: &[u8]) -> Result<(), DecodeError> {
    let mut decoder = Decoder::new(DecoderConfig { threads: 1, ..DecoderConfig::default() });
    let mut result = Ok(());
    for (k, good) in STREAM.packets[..SLAB].iter().enumerate() {
        let sent = decoder.send_packet(if k == packet { data } else { &good.data });
        if k == packet {
            result = sent.map(|_| ());
        }
        let mut shown = Frame::from_fn(8, 6, |_, _| [0; 3]).expect("a size within the limits");
        match decoder.render(k as f64 + 0.5, None, &mut Surface::of_frame(&mut shown)) {
            Ok(()) => {}
            Err(error) => assert_eq!(error, DecodeError::NoKeyframe, "packet {packet}, picture {k}"),
        }
    }
    assert!(play_on(&mut decoder) == *AFTER, "the next keyframe after damage in packet {packet}");
    result
}

/// Sets length, header check and CRC of a packet to what its bytes ask for, so that damage reaches the parser.
fn reframe(packet: &Packet, body: &[u8]) -> Vec<u8> {
    let fields = if packet.keyframe { 8 } else { 4 };
    let mut data = packet.data[..fields + 1].to_vec();
    let length = fields + 15 + body.len() + 4;
    data.extend_from_slice(&(length as u32).to_le_bytes());
    data.extend_from_slice(&packet.data[fields + 5..fields + 13]);
    data.extend_from_slice(&(crc32fast::hash(&data) as u16).to_le_bytes());
    data.extend_from_slice(body);
    data.extend_from_slice(&crc32fast::hash(&data).to_le_bytes());
    data
}

fn body(packet: &Packet) -> &[u8] {
    let start = if packet.keyframe { 23 } else { 19 };
    &packet.data[start..packet.data.len() - 4]
}

#[test]
fn reframing_a_whole_body_changes_nothing() {
    for packet in &STREAM.packets[..SLAB] {
        assert_eq!(reframe(packet, body(packet)), packet.data);
    }
}

#[test]
fn every_truncation_is_an_error() {
    let mut decoder = Decoder::new(DecoderConfig::default());
    for packet in &STREAM.packets {
        for length in 0..packet.data.len() {
            assert!(decoder.send_packet(&packet.data[..length]).is_err(), "{length} of {} bytes", packet.data.len());
        }
    }
    assert!(play_on(&mut decoder) == *AFTER);
}

#[test]
fn a_truncated_or_missing_packet_loses_its_slab_alone() {
    for packet in 0..SLAB {
        let data = &STREAM.packets[packet].data;
        for length in [0, 3, 12, data.len() / 2, data.len() - 1] {
            assert!(play_damaged(packet, &data[..length]).is_err(), "packet {packet} cut to {length} bytes");
        }
        let next = &STREAM.packets[packet + 1].data;
        if packet + 1 < SLAB {
            assert!(play_damaged(packet, next).is_err(), "packet {packet} missing");
        }
    }
}

#[test]
fn flipped_bits_are_found_by_the_checksum() {
    let mut decoder = Decoder::new(DecoderConfig::default());
    for packet in &STREAM.packets {
        let mut data = packet.data.clone();
        for bit in 0..8 * data.len() {
            data[bit / 8] ^= 1 << (bit % 8);
            assert!(decoder.send_packet(&data).is_err(), "bit {bit} of packet {}", packet.frame_number);
            data[bit / 8] ^= 1 << (bit % 8);
        }
    }
    assert!(play_on(&mut decoder) == *AFTER);
}

/// With a checksum that fits, damage reaches every stage of the parser; what it lets pass is drawn.
#[test]
fn flipped_bits_behind_a_good_checksum_do_no_harm() {
    let mut refused = 0;
    let mut seed = 1u64;
    for case in 0..400 {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let random = (seed >> 33) as usize;
        let packet = case % SLAB;
        let mut bytes = body(&STREAM.packets[packet]).to_vec();
        let bit = random % (8 * bytes.len());
        bytes[bit / 8] ^= 1 << (bit % 8);
        refused += usize::from(play_damaged(packet, &reframe(&STREAM.packets[packet], &bytes)).is_err());
    }
    assert!(refused > 100, "{refused} of 400 refused: the parser checks too little");
}

#[test]
fn bodies_cut_off_behind_a_good_checksum_do_no_harm() {
    for packet in 0..SLAB {
        let whole = body(&STREAM.packets[packet]);
        for length in (0..whole.len()).step_by(1 + whole.len() / 40) {
            // Entropy-coded tails may be all zeros, which a cut leaves as they were: an error is not certain.
            let _ = play_damaged(packet, &reframe(&STREAM.packets[packet], &whole[..length]));
        }
    }
}
