//! The decoder's door: packets in, pictures out.

#![cfg(feature = "encode")]

#[path = "bitstream/meshes.rs"]
mod meshes;

use meshes::{MeshParams, irregular_mesh};
use tetvec::bitstream::{Fraction, SequenceHeader, SlabWriter};
use tetvec::mesh::{Domain, TetMesh};
use tetvec::render::DrawParams;
use tetvec::{
    DecodeError, Decoder, DecoderConfig, Packet, PacketInfo, PixelFormat, Plane, SequenceHeader as Header, Surface,
    Viewport, YuvMatrix,
};

const SIZE: (u32, u32) = (97, 71);
const FRAMES: u32 = 9;

fn slab(first_frame: u64, seed: u64) -> (Vec<Packet>, TetMesh) {
    let domain = Domain { width: 64, height: 48, duration: 8, subpixel_bits: 3 };
    let mesh = irregular_mesh(&MeshParams { domain, cells: [6, 5, 6], labels: 4, thinning: 50, seed });
    let header = SequenceHeader {
        width: domain.width,
        height: domain.height,
        frame_rate: Fraction { numerator: 25, denominator: 1 },
        pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
        subpixel_bits: domain.subpixel_bits,
        subdivision_levels: 1,
    };
    let mut writer = SlabWriter::try_new(header, first_frame).expect("a header in range");
    let packets = (0..FRAMES).map(|k| writer.write_packet(&mesh, k + 1 == FRAMES).expect("a tiling")).collect();
    let coded = writer.coded_mesh().expect("a written mesh").clone();
    (packets, coded)
}

fn picture(decoder: &mut Decoder, frame: f64) -> Result<Vec<u8>, DecodeError> {
    let mut data = vec![0; 3 * (SIZE.0 * SIZE.1) as usize];
    let planes = vec![Plane { data: &mut data, stride: 3 * SIZE.0 as usize }];
    let mut surface = Surface::try_new(PixelFormat::Rgb, YuvMatrix::Bt601, SIZE, planes).expect("a surface");
    decoder.render(frame, None, &mut surface)?;
    Ok(data)
}

fn decoder(levels: u8) -> Decoder {
    Decoder::new(DecoderConfig { subdivision_levels: Some(levels), ..DecoderConfig::default() })
}

/// What is drawn right after frame k's packet is what is drawn when all packets have come: packets bring all that a
/// picture needs, at every level, and refining early does no harm.
#[test]
fn pictures_do_not_depend_on_when_they_are_drawn() {
    let (packets, _) = slab(40, 3);
    for levels in 0..=2 {
        let mut late = decoder(levels);
        for packet in &packets {
            late.send_packet(&packet.data).expect("a good packet");
        }
        let mut live = decoder(levels);
        for (k, packet) in packets.iter().enumerate() {
            live.send_packet(&packet.data).expect("a good packet");
            for part in [0.0, 0.4, 0.9] {
                let frame = 40.0 + k as f64 + part;
                assert!(picture(&mut live, frame) == picture(&mut late, frame), "level {levels} at {frame}");
            }
        }
    }
}

/// A picture drawn while the next packet is decoded is the one before that packet, a keyframe and a damaged one included.
#[test]
fn drawing_and_decoding_at_once_is_one_after_the_other() {
    let (mut packets, _) = slab(0, 3);
    packets.extend(slab(u64::from(FRAMES), 4).0);
    let damaged = packets.len() - 3;
    let last = packets[damaged].data.len() - 1;
    packets[damaged].data[last] ^= 1;
    let (mut both, mut turns) = (decoder(1), decoder(1));
    for decoder in [&mut both, &mut turns] {
        decoder.send_packet(&packets[0].data).expect("a keyframe");
    }
    for (k, next) in packets.iter().enumerate().skip(1) {
        both.queue_packet(next.data.clone());
        let drawn = picture(&mut both, k as f64 - 1.0);
        assert!(drawn.is_ok(), "frame {k}");
        assert_eq!(picture(&mut turns, k as f64 - 1.0), drawn, "frame {k}");
        let sent = both.receive_packet().expect("a packet is queued");
        assert_eq!(turns.send_packet(&next.data), sent, "packet {k}");
        assert_eq!(sent.is_ok(), k < damaged, "packet {k}");
    }
}

/// What became of a packet, and the picture right after it.
type Shown = (Result<PacketInfo, DecodeError>, Result<Vec<u8>, DecodeError>);

/// What a decoder makes of packets that are sent one by one.
fn play_in_turns(decoder: &mut Decoder, packets: &[Packet]) -> Vec<Shown> {
    let mut shown = |k: usize| (decoder.send_packet(&packets[k].data), picture(decoder, k as f64));
    (0..packets.len()).map(&mut shown).collect()
}

/// What a decoder makes of packets that are queued so many ahead.
fn play_ahead(decoder: &mut Decoder, packets: &[Packet], ahead: usize) -> Vec<Shown> {
    let mut shown = Vec::new();
    let mut queued = 0;
    for k in 0..packets.len() {
        while queued < packets.len().min(k + 1 + ahead) {
            decoder.queue_packet(packets[queued].data.clone());
            queued += 1;
        }
        shown.push((decoder.receive_packet().expect("a packet is queued"), picture(decoder, k as f64)));
    }
    assert_eq!(decoder.receive_packet(), None);
    shown
}

/// However far packets are read ahead, each brings the same and pictures are the same: over keyframes, damage, and with
/// any number of threads.
#[test]
fn reading_ahead_changes_nothing() {
    let (mut packets, _) = slab(0, 3);
    packets.extend(slab(u64::from(FRAMES), 4).0);
    packets.extend(slab(2 * u64::from(FRAMES), 5).0);
    let damaged = FRAMES as usize + 4;
    let last = packets[damaged].data.len() - 1;
    packets[damaged].data[last] ^= 1;
    let expected = play_in_turns(&mut decoder(1), &packets);
    assert_eq!(expected[damaged + 1].0, Err(DecodeError::NoKeyframe));
    assert_eq!(expected.iter().filter(|(result, _)| result.is_ok()).count(), 2 * FRAMES as usize + 4);
    assert!(expected.iter().all(|(_, picture)| picture.is_ok()));
    for threads in [0, 1, 3] {
        for ahead in [0, 1, 5, packets.len()] {
            let config = DecoderConfig { subdivision_levels: Some(1), threads, ..DecoderConfig::default() };
            let found = play_ahead(&mut Decoder::new(config), &packets, ahead);
            assert!(found == expected, "{threads} threads, {ahead} packets ahead");
        }
    }
}

/// Packets that are queued, or being decoded, are gone with a flush; the next keyframe starts anew.
#[test]
fn a_flush_forgets_what_is_queued() {
    let (packets, _) = slab(0, 3);
    let expected = play_in_turns(&mut decoder(0), &packets);
    let mut decoder = decoder(0);
    for taken in [0, 1, 3] {
        packets.iter().for_each(|packet| decoder.queue_packet(packet.data.clone()));
        for _ in 0..taken {
            decoder.receive_packet().expect("a packet is queued").expect("a good packet");
        }
        decoder.flush();
        assert_eq!(decoder.receive_packet(), None);
        assert_eq!(picture(&mut decoder, 0.0), Err(DecodeError::NoKeyframe));
        assert_eq!(decoder.send_packet(&packets[3].data), Err(DecodeError::NoKeyframe));
        assert!(play_ahead(&mut decoder, &packets, 4) == expected);
    }
}

/// Packets that come again after a flush bring what they brought at first, wherever the flush came, and so does what is
/// new behind them.
#[test]
fn packets_that_come_again_bring_the_same() {
    let (first, _) = slab(0, 3);
    let (second, _) = slab(u64::from(FRAMES), 4);
    let whole = [&first[..], &second[..]].concat();
    for levels in [0, 1] {
        let expected = play_in_turns(&mut decoder(levels), &whole);
        let mut decoder = decoder(levels);
        for (played, ahead) in [(1, 0), (5, 0), (3, 4), (9, 0), (9, 1), (12, 3), (18, 0)] {
            assert!(play_ahead(&mut decoder, &whole, ahead) == expected, "level {levels}");
            decoder.flush();
            assert!(play_ahead(&mut decoder, &whole[..played], ahead) == expected[..played], "{played} packets");
            whole[played..].iter().take(ahead).for_each(|packet| decoder.queue_packet(packet.data.clone()));
            decoder.flush();
        }
    }
}

/// What else comes after a flush, or between packets that come again, is judged as by a new decoder.
#[test]
fn what_comes_instead_of_known_packets_is_judged_by_itself() {
    let (known, _) = slab(0, 3);
    let (other, _) = slab(0, 4);
    let damaged = |k: usize| {
        let mut packet = known[k].clone();
        let last = packet.data.len() - 1;
        packet.data[last] ^= 1;
        packet
    };
    let sequences = [
        other.clone(),
        vec![known[0].clone(), known[1].clone(), known[3].clone(), known[4].clone(), known[0].clone()],
        vec![known[0].clone(), damaged(1), known[2].clone(), other[0].clone(), known[1].clone()],
        vec![damaged(0), known[1].clone(), known[0].clone(), known[1].clone()],
        vec![known[2].clone(), known[3].clone(), other[0].clone(), other[1].clone()],
        vec![known[0].clone(), other[1].clone(), other[2].clone(), known[0].clone()],
        vec![known[0].clone(), known[1].clone(), other[0].clone(), other[1].clone(), known[2].clone()],
    ];
    for (number, sequence) in sequences.iter().enumerate() {
        let expected = play_in_turns(&mut decoder(0), sequence);
        let mut decoder = decoder(0);
        play_in_turns(&mut decoder, &known);
        decoder.flush();
        assert!(play_in_turns(&mut decoder, sequence) == expected, "sequence {number}");
    }
}

/// A packet that is sent comes behind those queued.
#[test]
fn sending_takes_what_is_queued_before() {
    let (packets, _) = slab(0, 3);
    let (mut queued, mut sent) = (decoder(0), decoder(0));
    packets[..3].iter().for_each(|packet| queued.queue_packet(packet.data.clone()));
    for packet in &packets[..3] {
        sent.send_packet(&packet.data).expect("a good packet");
    }
    assert_eq!(queued.send_packet(&packets[3].data), sent.send_packet(&packets[3].data));
    assert_eq!(queued.receive_packet(), None);
    assert!(picture(&mut queued, 3.5) == picture(&mut sent, 3.5));
}

#[test]
fn pictures_are_those_of_the_coded_mesh() {
    let (packets, mesh) = slab(7, 5);
    for levels in 0..=2 {
        let mut decoder = decoder(levels);
        for packet in &packets {
            decoder.send_packet(&packet.data).expect("a good packet");
        }
        for frame in [0.0, 2.5, 8.0] {
            let found = picture(&mut decoder, 7.0 + frame).expect("a picture");
            let mut data = vec![0; found.len()];
            let planes = vec![Plane { data: &mut data, stride: 3 * SIZE.0 as usize }];
            let mut surface = Surface::try_new(PixelFormat::Rgb, YuvMatrix::Bt601, SIZE, planes).expect("a surface");
            let params = DrawParams { levels, antialias: true, viewport: None, mesh: false };
            tetvec::render::draw(&mesh, frame, &params, &mut surface).expect("the whole picture");
            // Numbering differs, and with it the order of sums: by a rounding at most.
            let off = found.iter().zip(&data).filter(|(a, b)| a.abs_diff(**b) > 1).count();
            assert_eq!(off, 0, "level {levels} at {frame}");
        }
    }
}

#[test]
fn times_are_clamped_to_what_has_come() {
    let (packets, _) = slab(100, 3);
    let mut decoder = decoder(1);
    decoder.send_packet(&packets[0].data).expect("a keyframe");
    decoder.send_packet(&packets[1].data).expect("a good packet");
    let last = picture(&mut decoder, 102.0 - 1.0 / 1024.0).expect("a picture");
    assert_eq!(picture(&mut decoder, 107.0), Ok(last), "beyond the packets");
    let first = picture(&mut decoder, 100.0).expect("a picture");
    assert_eq!(picture(&mut decoder, 3.0), Ok(first), "before the slab");
}

#[test]
fn errors_leave_the_picture_and_wait_for_a_keyframe() {
    let (packets, _) = slab(0, 3);
    let (next, _) = slab(9, 4);
    let mut decoder = decoder(1);
    assert_eq!(picture(&mut decoder, 0.0), Err(DecodeError::NoKeyframe));
    assert_eq!(decoder.send_packet(&packets[1].data), Err(DecodeError::NoKeyframe));
    decoder.send_packet(&packets[0].data).expect("a keyframe");
    let before = picture(&mut decoder, 0.0).expect("a picture");
    let mut damaged = packets[1].data.clone();
    damaged[30] ^= 4;
    assert!(matches!(decoder.send_packet(&damaged), Err(DecodeError::Packet(_))));
    assert_eq!(decoder.send_packet(&packets[2].data), Err(DecodeError::NoKeyframe));
    assert_eq!(picture(&mut decoder, 0.0), Ok(before), "the frame before the damage");
    let info = decoder.send_packet(&next[0].data).expect("a keyframe");
    assert_eq!((info.frame_number, info.keyframe, info.picture), (9, true, true));
    let header: Header = *decoder.header().expect("a header");
    assert_eq!((header.width, header.height), (64, 48));
    assert!(picture(&mut decoder, 9.0).is_ok());
    decoder.flush();
    assert_eq!(picture(&mut decoder, 9.0), Err(DecodeError::NoKeyframe));
}

/// Pictures of a slab's frames, each drawn after its packet, whether that is good or not.
fn play(decoder: &mut Decoder, packets: &[Packet]) -> Vec<Result<Vec<u8>, DecodeError>> {
    let mut draw = |packet: &Packet| {
        let _ = decoder.send_packet(&packet.data);
        picture(decoder, packet.frame_number as f64)
    };
    packets.iter().map(&mut draw).collect()
}

#[test]
fn a_lost_packet_costs_the_rest_of_its_slab_and_the_last_picture_stays() {
    let (first, _) = slab(0, 3);
    let (second, _) = slab(9, 4);
    let whole = [first.clone(), second.clone()].map(|packets| play(&mut decoder(1), &packets));
    for lost in 0..first.len() {
        let mut decoder = decoder(1);
        let kept: Vec<Packet> =
            first.iter().enumerate().filter(|&(k, _)| k != lost).map(|(_, packet)| packet.clone()).collect();
        let shown = play(&mut decoder, &kept);
        assert_eq!(shown[..lost], whole[0][..lost]);
        // The mesh that has come is held at the end of what it is complete for.
        let held = if lost == 0 { Err(DecodeError::NoKeyframe) } else { picture(&mut decoder, 1e6) };
        assert!(shown[lost..].iter().all(|picture| *picture == held), "packet {lost}");
        assert_eq!(play(&mut decoder, &second), whole[1]);
    }
}

#[test]
fn streams_are_joined_late_and_continued_by_others() {
    let (first, _) = slab(0, 3);
    let (second, _) = slab(9, 4);
    // A stream of its own, which counts from 0 again.
    let (other, _) = slab(0, 5);
    let alone = [&second, &other].map(|packets| play(&mut decoder(1), packets));
    for joined in 1..first.len() {
        let mut decoder = decoder(1);
        assert!(play(&mut decoder, &first[joined..]).iter().all(|p| *p == Err(DecodeError::NoKeyframe)));
        assert_eq!(play(&mut decoder, &second), alone[0]);
        assert_eq!(play(&mut decoder, &other), alone[1]);
    }
}

#[test]
fn unusable_viewports_are_refused() {
    let (packets, _) = slab(0, 3);
    let mut decoder = decoder(0);
    decoder.send_packet(&packets[0].data).expect("a keyframe");
    let mut data = [0; 12];
    let planes = vec![Plane { data: &mut data, stride: 6 }];
    let mut surface = Surface::try_new(PixelFormat::Rgb, YuvMatrix::Bt601, (2, 2), planes).expect("a surface");
    let viewport = Viewport { x: 0.0, y: 0.0, width: 0.0, height: 5.0 };
    assert!(matches!(decoder.render(0.0, Some(viewport), &mut surface), Err(DecodeError::Viewport(_))));
}
