//! Conformance vectors: stored streams, what they hold packet by packet, and a second parser that reads the same.
//!
//! `tests/bitstream/vectors/<version>/` has streams and, line by line for each packet: frame number, vertices, wedges and
//! tets so far, duration (0 while it is unknown), and a CRC-32 of what is new. `tests/bitstream/parser.py`, written from
//! docs/format.md alone, prints the same lines. A version that is out never changes: with another syntax comes another
//! `VERSION`, and `TETVEC_WRITE_VECTORS=1 cargo test --test conformance` writes its vectors where there are none yet.

#![cfg(feature = "encode")]

#[path = "bitstream/meshes.rs"]
mod meshes;
#[path = "bitstream/vector.rs"]
mod vector;

use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::Command;

use meshes::{MeshParams, Random, irregular_mesh};
use tetvec::bitstream::{
    ColorSteps, Fraction, IndexWriter, Limits, SequenceHeader, SlabParser, SlabWriter, VERSION, parse_packet_header,
};
use tetvec::mesh::{Domain, TetMesh};
use tetvec::{Encoder, EncoderConfig, Frame};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/bitstream/vectors").join(VERSION.to_string())
}

/// The stream of slabs that follow each other, with an index.
fn write_stream(slabs: &[TetMesh], color_steps: ColorSteps) -> Vec<u8> {
    let mut stream = Vec::new();
    let mut index = IndexWriter::new();
    let mut first_frame = 0;
    for mesh in slabs {
        let Domain { width, height, duration, subpixel_bits } = mesh.domain;
        let header = SequenceHeader {
            width,
            height,
            frame_rate: Fraction { numerator: 30_000, denominator: 1_001 },
            pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
            subpixel_bits,
            subdivision_levels: u8::from(duration > 4),
        };
        let mut writer = SlabWriter::try_new(header, first_frame).expect("a header in range");
        writer.set_color_steps(color_steps).expect("steps in range");
        for k in 1..=duration {
            let packet = writer.write_packet(mesh, k == duration).expect("a tiling");
            index.push(&packet);
            stream.extend(packet.data);
        }
        first_frame += u64::from(duration);
    }
    stream.extend(index.finish().expect("a short index").data);
    stream
}

/// A mesh with holes, in several pieces.
fn pieces() -> TetMesh {
    let domain = Domain { width: 40, height: 30, duration: 4, subpixel_bits: 4 };
    let mut mesh = irregular_mesh(&MeshParams { domain, cells: [5, 4, 4], labels: 2, thinning: 30, seed: 3 });
    let mut random = Random::new(3);
    mesh.tets.retain(|_| random.below(10) < 4);
    mesh
}

/// What the writer must write to the bit, by name.
fn written() -> Vec<(&'static str, Vec<u8>)> {
    let mesh = |size: [u32; 3], cells, labels, thinning, seed| {
        let domain = Domain { width: size[0], height: size[1], duration: size[2], subpixel_bits: 3 };
        irregular_mesh(&MeshParams { domain, cells, labels, thinning, seed })
    };
    let by_size = |step, size| ColorSteps { step, size };
    vec![
        ("example", write_stream(&[vector::example_mesh()], ColorSteps::even(1))),
        ("one-label", write_stream(&[mesh([96, 64, 10], [9, 7, 7], 1, 60, 1)], by_size(32, 36))),
        ("labels", write_stream(&[mesh([64, 48, 8], [6, 5, 6], 6, 50, 2)], by_size(24, 34))),
        ("pieces", write_stream(&[pieces()], by_size(16, 30))),
        (
            "slabs",
            write_stream(
                &[mesh([48, 32, 5], [4, 3, 4], 2, 40, 4), mesh([48, 32, 3], [4, 3, 3], 3, 20, 5)],
                by_size(40, 69),
            ),
        ),
        (
            "empty",
            write_stream(
                &[TetMesh::empty(Domain { width: 7, height: 5, duration: 2, subpixel_bits: 0 })],
                by_size(1, 0),
            ),
        ),
    ]
}

/// A stream of the whole encoder. It may write another one day; this one must be read for ever.
fn encoded() -> Vec<u8> {
    let config = EncoderConfig { simplification_ratio: 0.05, superpixels: 0, ..EncoderConfig::new(64, 48) };
    let mut encoder = Encoder::try_new(config).expect("settings in range");
    for k in 0..6 {
        let frame = Frame::from_fn(64, 48, |x, y| {
            let (dx, dy) = (x.abs_diff(20 + 3 * k), y.abs_diff(24));
            if dx * dx + dy * dy < 150 { [230, 60 + y as u8, 40] } else { [20 + x as u8, 90, 120 + y as u8] }
        });
        let frame = frame.expect("a picture of this size");
        encoder.send_frame(frame, k == 3).expect("a frame of the right size");
    }
    encoder.finish().expect("a mesh that can be written");
    std::iter::from_fn(|| encoder.receive_packet()).flat_map(|packet| packet.data).collect()
}

/// What a stream holds, a line a packet.
fn describe(stream: &[u8]) -> String {
    let limits = Limits::default();
    let mut parser = SlabParser::new(limits);
    let mut lines = String::new();
    let (mut at, mut before) = (0, [0; 3]);
    while at < stream.len() {
        let header = parse_packet_header(&stream[at..], &limits).expect("a packet").expect("a whole one");
        parser.parse_packet(&stream[at..at + header.length]).expect("an undamaged packet");
        at += header.length;
        if !header.picture {
            continue;
        }
        if header.keyframe {
            before = [0; 3];
        }
        let mesh = parser.mesh().expect("a keyframe was parsed");
        let crc = checksum(mesh, before);
        before = [mesh.positions.len(), mesh.wedges.len(), mesh.tets.len()];
        let duration = if parser.is_duration_known() { mesh.domain.duration } else { 0 };
        let [vertices, wedges, tets] = before;
        writeln!(lines, "{} {vertices} {wedges} {tets} {duration} {crc:08x}", header.frame_number).expect("memory");
    }
    lines
}

/// CRC-32 of what is new since the mesh had so many vertices, wedges and tets: little-endian 32-bit integers.
fn checksum(mesh: &TetMesh, [vertices, wedges, tets]: [usize; 3]) -> u32 {
    let mut bytes = Vec::new();
    let mut put = |value: i32| bytes.extend_from_slice(&value.to_le_bytes());
    for (position, pinned) in mesh.positions[vertices..].iter().zip(&mesh.pinned[vertices..]) {
        position.to_array().into_iter().chain([i32::from(*pinned)]).for_each(&mut put);
    }
    for wedge in &mesh.wedges[wedges..] {
        let grains = wedge.color.to_array().map(|level| (level * 128.0) as i32);
        [wedge.vertex.0 as i32, wedge.label.0 as i32].into_iter().chain(grains).for_each(&mut put);
    }
    mesh.tets[tets..].iter().flatten().for_each(|wedge| put(wedge.0 as i32));
    crc32fast::hash(&bytes)
}

/// Stored vectors: names, streams and descriptions.
fn stored() -> Vec<(String, Vec<u8>, String)> {
    let mut names: Vec<String> = std::fs::read_dir(folder())
        .expect("vectors of this version: see the head of this file")
        .filter_map(|entry| entry.expect("an entry").file_name().to_str()?.strip_suffix(".tetv").map(str::to_owned))
        .collect();
    names.sort_unstable();
    let read = |name: String| {
        let stream = std::fs::read(folder().join(format!("{name}.tetv"))).expect("a stream");
        let lines = std::fs::read_to_string(folder().join(format!("{name}.txt"))).expect("its description");
        (name, stream, lines)
    };
    names.into_iter().map(read).collect()
}

/// Writes the vectors of a version that has none.
fn write_vectors() {
    std::fs::create_dir(folder()).expect("no vectors of this version yet");
    for (name, stream) in written().into_iter().chain([("encoded", encoded())]) {
        std::fs::write(folder().join(format!("{name}.txt")), describe(&stream)).expect("a file");
        std::fs::write(folder().join(format!("{name}.tetv")), stream).expect("a file");
    }
}

#[test]
fn vectors_hold_what_is_stored_and_are_written_again() {
    if std::env::var_os("TETVEC_WRITE_VECTORS").is_some() {
        write_vectors();
    }
    let stored = stored();
    assert_eq!(stored.len(), 7);
    for (name, stream, lines) in &stored {
        assert_eq!(&describe(stream), lines, "{name}");
    }
    for (name, stream) in written() {
        let (_, vector, _) = stored.iter().find(|(stored, ..)| stored == name).expect("a stored vector");
        assert!(&stream == vector, "{name}: the format has changed, so VERSION must: see the head of this file");
    }
}

#[test]
fn a_parser_written_from_the_document_agrees() {
    if Command::new("python3").arg("--version").output().is_err() {
        eprintln!("SKIPPED: python3 is not installed, so docs/format.md is not checked against the crate");
        return;
    }
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/bitstream/parser.py");
    for (name, _, lines) in stored() {
        let stream = folder().join(format!("{name}.tetv"));
        let output = Command::new("python3").arg(&script).arg(stream).output().expect("python3");
        assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        assert_eq!(String::from_utf8_lossy(&output.stdout), lines, "{name}");
    }
}
