//! Streams from outside: what is written comes back, and no bytes do harm.

#![cfg(feature = "encode")]

#[path = "bitstream/framed.rs"]
mod framed;
#[path = "bitstream/meshes.rs"]
mod meshes;
#[path = "bitstream/vector.rs"]
mod vector;

use std::collections::{BTreeMap, BTreeSet};

use framed::{body, header_bytes, repair, with_body};
use meshes::{MeshParams, Random, irregular_mesh};
use tetvec::Packet;
use tetvec::bitstream::{
    ColorSteps, Fraction, Index, IndexWriter, Limits, MAGIC, MeshFault, ParseError, Part, SYNC, SequenceHeader,
    SlabParser, SlabWriter, TAIL_BYTES, VERSION, WriteError, find_packet, index_length, parse_packet_header,
};
use tetvec::mesh::{Domain, TetMesh, validate, volume6};
use tetvec::video::Label;

/// Rings around the vertices before t = k + 1 whose tets packet k completes, in streams with so many levels of subdivision.
fn rings_of(levels: u8) -> u32 {
    if levels == 0 { 0 } else { 2 }
}

fn header_of(domain: Domain) -> SequenceHeader {
    SequenceHeader {
        width: domain.width,
        height: domain.height,
        frame_rate: Fraction { numerator: 25, denominator: 1 },
        pixel_aspect_ratio: Fraction { numerator: 1, denominator: 1 },
        subpixel_bits: domain.subpixel_bits,
        subdivision_levels: 1,
    }
}

fn small_params(seed: u64) -> MeshParams {
    let domain = Domain { width: 64, height: 48, duration: 8, subpixel_bits: 3 };
    MeshParams { domain, cells: [6, 5, 6], labels: 4, thinning: 50, seed }
}

/// Packets of a slab of `frames` frames.
fn write_slab(mesh: &TetMesh, first_frame: u64, frames: u32) -> Vec<Packet> {
    write_slab_for(1, mesh, first_frame, frames)
}

/// The same for so many levels of subdivision.
fn write_slab_for(levels: u8, mesh: &TetMesh, first_frame: u64, frames: u32) -> Vec<Packet> {
    let header = SequenceHeader { subdivision_levels: levels, ..header_of(mesh.domain) };
    let mut writer = SlabWriter::try_new(header, first_frame).expect("a header in range");
    writer.set_color_steps(ColorSteps::even(1)).expect("steps in range");
    let packets = (0..frames).map(|k| writer.write_packet(mesh, k + 1 == frames).expect("a tiling")).collect();
    assert!(writer.is_drained());
    packets
}

/// A tet by what does not depend on numbering: its corners' positions and colours in levels, ascending.
type TetKey = [([i32; 3], [i32; 3]); 4];

fn tet_keys(mesh: &TetMesh, wanted: impl Fn(usize) -> bool) -> BTreeSet<TetKey> {
    let key = |tet: usize| {
        let mut key = mesh.tets[tet].map(|w| {
            let color = mesh.wedges[w.index()].color.round().clamp(glam::Vec3::splat(-128.0), glam::Vec3::splat(383.0));
            (mesh.position(w).to_array(), color.as_ivec3().to_array())
        });
        key.sort_unstable();
        key
    };
    (0..mesh.tets.len()).filter(|&tet| wanted(tet)).map(key).collect()
}

/// Which tets the packets 0 to k of a slab bring, by the rule of docs/format.md.
fn tets_by_hop_rule(mesh: &TetMesh, k: i32, rings: u32) -> Vec<bool> {
    let low = (k + 1) * mesh.domain.unit();
    let mut hop: Vec<u32> = mesh.positions.iter().map(|p| if p.z < low { 0 } else { rings + 1 }).collect();
    for ring in 1..=rings {
        let before = hop.clone();
        for tet in 0..mesh.tets.len() {
            let corners = mesh.tet_vertices(tet);
            if corners.iter().any(|v| before[v.index()] < ring) {
                corners.iter().for_each(|v| hop[v.index()] = hop[v.index()].min(ring));
            }
        }
    }
    (0..mesh.tets.len()).map(|tet| mesh.tet_vertices(tet).iter().any(|v| hop[v.index()] <= rings)).collect()
}

#[test]
fn slabs_come_back_packet_by_packet() {
    for seed in 0..6 {
        let params = MeshParams { labels: [1, 4][seed as usize % 2], ..small_params(seed) };
        let mesh = irregular_mesh(&params);
        assert_eq!(validate(&mesh), Ok(()));
        let mut parser = SlabParser::new(Limits::default());
        let levels = seed as u8 % 3;
        for (k, packet) in write_slab_for(levels, &mesh, 100, 8).iter().enumerate() {
            let info = parser.parse_packet(&packet.data).expect("an undamaged packet");
            assert_eq!((info.frame_number, info.keyframe, info.last), (100 + k as u64, k == 0, k == 7));
            assert_eq!(parser.frames_complete(), k as u32 + 1);
            let parsed = parser.mesh().expect("a keyframe was parsed");
            let in_packet = tets_by_hop_rule(&mesh, k as i32, rings_of(levels));
            let expected = tet_keys(&mesh, |tet| k == 7 || in_packet[tet]);
            assert_eq!(tet_keys(parsed, |_| true), expected, "packet {k} of mesh {seed}");
        }
        assert!(parser.is_ended());
        assert_same(parser.mesh().expect("a whole slab"), &mesh);
    }
}

/// Checks all but the numbering of vertices, wedges and labels.
fn assert_same(parsed: &TetMesh, source: &TetMesh) {
    assert_eq!(validate(parsed), Ok(()));
    assert_eq!(parsed.domain, source.domain);
    let pins = |mesh: &TetMesh| -> BTreeMap<[i32; 3], bool> {
        mesh.positions.iter().map(|p| p.to_array()).zip(mesh.pinned.iter().copied()).collect()
    };
    assert_eq!(pins(parsed), pins(source));
    assert_eq!(parsed.wedges.len(), source.wedges.len());
    // Labels correspond one to one.
    let labels = |mesh: &TetMesh| -> BTreeMap<_, Label> {
        let corners = |tet| {
            let mut corners = mesh.tet_positions(tet).map(|p| p.to_array());
            corners.sort_unstable();
            corners
        };
        (0..mesh.tets.len()).map(|tet| (corners(tet), mesh.tet_label(tet))).collect()
    };
    let (mut there, mut back) = (BTreeMap::new(), BTreeMap::new());
    for ((tet, ours), (same_tet, theirs)) in labels(parsed).into_iter().zip(labels(source)) {
        assert_eq!(tet, same_tet);
        assert_eq!(*there.entry(ours).or_insert(theirs), theirs);
        assert_eq!(*back.entry(theirs).or_insert(ours), ours);
    }
}

/// Parses packets one after the other; errors are let through, as in a player.
fn parse_all<'a>(packets: impl IntoIterator<Item = &'a [u8]>, limits: Limits) -> (SlabParser, Vec<ParseError>) {
    let mut parser = SlabParser::new(limits);
    let errors = packets.into_iter().filter_map(|p| parser.parse_packet(p).err()).collect();
    (parser, errors)
}

/// Whatever was parsed holds what the parser promises of any bytes.
fn assert_sound(parser: &SlabParser) {
    let Some(mesh) = parser.mesh() else { return };
    let extent = mesh.domain.extent();
    assert!(mesh.positions.iter().all(|p| p.cmpge(glam::IVec3::ZERO).all() && p.cmple(extent).all()));
    assert_eq!(mesh.positions.len(), mesh.pinned.len());
    for tet in 0..mesh.tets.len() {
        let [a, b, c, d] = mesh.tet_positions(tet);
        assert!(volume6(a, b, c, d) > 0);
        assert!(mesh.tets[tet].iter().all(|w| mesh.wedges[w.index()].label == mesh.tet_label(tet)));
    }
}

/// A stream so small that every bit of it can be tried.
fn tiny_slab() -> Vec<Packet> {
    let domain = Domain { width: 16, height: 16, duration: 3, subpixel_bits: 2 };
    let mesh = irregular_mesh(&MeshParams { domain, cells: [2, 2, 3], labels: 2, thinning: 20, seed: 5 });
    write_slab(&mesh, 0, 3)
}

#[test]
fn the_same_mesh_gives_the_same_bytes() {
    let mesh = irregular_mesh(&small_params(1));
    assert_eq!(write_slab(&mesh, 0, 8), write_slab(&mesh, 0, 8));
}

#[test]
fn real_sizes_stay_below_nine_bytes_a_vertex() {
    for labels in [1, 12] {
        let domain = Domain { width: 320, height: 240, duration: 20, subpixel_bits: 3 };
        let mesh = irregular_mesh(&MeshParams { domain, cells: [40, 30, 12], labels, thinning: 80, seed: 9 });
        let bytes: usize = write_slab(&mesh, 0, 20).iter().map(|p| p.data.len()).sum();
        let (vertices, wedges) = (mesh.positions.len(), mesh.wedges.len());
        assert!(vertices > 2_500, "{vertices} vertices");
        let bytes_a_vertex = bytes as f64 / vertices as f64;
        assert!(bytes_a_vertex <= 9.0, "{bytes_a_vertex} bytes, {wedges} wedges for {vertices} vertices");
    }
}

#[test]
fn a_mesh_may_grow_between_packets() {
    let whole = irregular_mesh(&small_params(3));
    let needed_by = |tet: usize, k: i32| tets_by_hop_rule(&whole, k, rings_of(1))[tet];
    let first_packet: Vec<i32> =
        (0..whole.tets.len()).map(|tet| (0..8).find(|&k| needed_by(tet, k)).unwrap_or(8)).collect();
    let mut order: Vec<usize> = (0..whole.tets.len()).collect();
    order.sort_by_key(|&tet| first_packet[tet]);
    let mut writer = SlabWriter::try_new(header_of(whole.domain), 0).expect("a header in range");
    let mut parser = SlabParser::new(Limits::default());
    for k in 0..8 {
        let tets: Vec<_> =
            order.iter().filter(|&&tet| first_packet[tet] <= k || k == 7).map(|&tet| whole.tets[tet]).collect();
        let committed: BTreeSet<_> = tets.iter().flatten().map(|&w| whole.vertex(w)).collect();
        let mut mesh = TetMesh { tets, ..whole.clone() };
        // What is not committed has no place yet, and the end is known only at the end.
        for vertex in (0..mesh.positions.len()).filter(|&v| !committed.contains(&tetvec::mesh::VertexId(v as u32))) {
            mesh.positions[vertex] = glam::IVec3::splat(-7);
        }
        let highest = committed.iter().map(|v| mesh.positions[v.index()].z).max();
        if highest < Some(whole.domain.extent().z) {
            mesh.domain.duration = 1000;
        }
        let packet = writer.write_packet(&mesh, k == 7).expect("a part of a tiling");
        parser.parse_packet(&packet.data).expect("an undamaged packet");
        let parsed = parser.mesh().expect("a keyframe was parsed");
        assert_eq!(parsed.tets.len(), mesh.tets.len(), "packet {k}");
        assert_eq!(writer.coded_mesh(), Some(parsed));
    }
    assert_same(parser.mesh().expect("a whole slab"), &whole);
}

#[test]
fn the_duration_is_provisional_until_it_is_known() {
    let mesh = irregular_mesh(&small_params(2));
    let mut parser = SlabParser::new(Limits::default());
    let mut known_at = None;
    for (k, packet) in write_slab(&mesh, 0, 8).iter().enumerate() {
        parser.parse_packet(&packet.data).expect("an undamaged packet");
        let parsed = parser.mesh().expect("a keyframe was parsed");
        let highest = parsed.positions.iter().map(|p| p.z).max().unwrap_or(0);
        let top = parsed.domain.extent().z;
        assert!(top >= highest);
        if top == highest {
            assert_eq!(parsed.domain, mesh.domain);
            known_at = known_at.or(Some(k));
        }
    }
    assert!(known_at.is_some_and(|k| k < 7), "known from faces at the end of the box, before the last packet");
}

#[test]
fn meshes_of_many_pieces_with_holes_come_back() {
    for seed in 0..8 {
        let mut mesh = irregular_mesh(&small_params(seed));
        let mut random = Random::new(seed);
        let keep = 1 + random.below(9);
        mesh.tets.retain(|_| random.below(10) < keep);
        let packets = write_slab(&mesh, 0, 8);
        let (parser, errors) = parse_all(packets.iter().map(|p| &p.data[..]), Limits::default());
        assert_eq!(errors, []);
        let parsed = parser.mesh().expect("a keyframe was parsed");
        assert_eq!(tet_keys(parsed, |_| true), tet_keys(&mesh, |_| true));
    }
}

#[test]
fn an_empty_mesh_is_a_stream_too() {
    let domain = Domain { width: 16, height: 16, duration: 2, subpixel_bits: 3 };
    let packets = write_slab(&TetMesh::empty(domain), 7, 2);
    let (parser, errors) = parse_all(packets.iter().map(|p| &p.data[..]), Limits::default());
    assert_eq!(errors, []);
    assert_eq!((parser.mesh(), parser.first_frame()), (Some(&TetMesh::empty(domain)), Some(7)));
}

#[test]
fn every_truncation_is_refused() {
    let packets = tiny_slab();
    for (k, packet) in packets.iter().enumerate() {
        for length in 0..packet.data.len() {
            let cut = &packet.data[..length];
            let before = packets[..k].iter().map(|p| &p.data[..]);
            let (parser, errors) = parse_all(before.chain([cut]), Limits::default());
            assert_eq!(errors.len(), 1);
            assert_eq!(parser.frames_complete(), k as u32);
            assert_sound(&parser);
        }
    }
}

#[test]
fn truncated_bodies_do_no_harm() {
    let packets = tiny_slab();
    for (k, packet) in packets.iter().enumerate() {
        let whole = body(&packet.data);
        for length in 0..whole.len() {
            let cut = with_body(&packet.data, &whole[..length]);
            let before = packets[..k].iter().map(|p| &p.data[..]);
            let (parser, _) = parse_all(before.chain([&cut[..]]), Limits::default());
            assert_sound(&parser);
        }
    }
}

#[test]
fn every_flipped_bit_is_noticed_and_does_no_harm() {
    let packets = tiny_slab();
    for k in 0..packets.len() {
        for bit in 0..packets[k].data.len() * 8 {
            let mut packets: Vec<Vec<u8>> = packets.iter().map(|p| p.data.clone()).collect();
            packets[k][bit / 8] ^= 1 << (bit % 8);
            let (parser, errors) = parse_all(packets.iter().map(|p| &p[..]), Limits::default());
            assert!(!errors.is_empty());
            assert_eq!(parser.frames_complete(), k as u32);
            assert_sound(&parser);
            if bit / 8 >= 8 {
                repair(&mut packets[k]);
                let (parser, _) = parse_all(packets.iter().map(|p| &p[..]), Limits::default());
                assert_sound(&parser);
            }
        }
    }
}

#[test]
fn random_payloads_do_no_harm() {
    let keyframe = &tiny_slab()[0].data;
    let whole = body(keyframe);
    let payload_at = 2 + usize::from(whole[0]) + 1;
    let mut random = Random::new(11);
    for round in 0..3_000 {
        let mut body = whole[..payload_at].to_vec();
        let length = random.below(400);
        // Bytes of one value run through long stretches of one decision.
        let fixed = random.below(256) as u8;
        body.extend((0..length).map(|_| if round % 3 == 0 { fixed } else { random.below(256) as u8 }));
        let packet = with_body(keyframe, &body);
        let (parser, _) = parse_all([&packet[..]], Limits::default());
        assert_sound(&parser);
    }
}

#[test]
fn every_bit_is_counted_once() {
    let packets = write_slab(&irregular_mesh(&small_params(1)), 0, 8);
    let mut parser = SlabParser::new(Limits::default());
    parser.count_bits();
    for packet in &packets {
        parser.parse_packet(&packet.data).expect("an undamaged packet");
    }
    let bytes: usize = packets.iter().map(|packet| packet.data.len()).sum();
    let counts = parser.bits();
    assert!((counts.total() - 8.0 * bytes as f64).abs() < 1e-3);
    assert!(Part::ALL.iter().all(|&part| counts.bits(part) > 0.0), "{counts:?}");
    let mut damaged = packets[1].data.clone();
    damaged[30] ^= 1;
    assert!(parser.parse_packet(&damaged).is_err());
    assert_eq!(parser.bits(), counts, "damage is not counted");
}

#[test]
fn after_damage_a_parser_waits_for_a_keyframe() {
    let mesh = irregular_mesh(&small_params(4));
    let first = write_slab(&mesh, 0, 8);
    let second = write_slab(&mesh, 8, 8);
    let lost: Vec<&[u8]> = first.iter().chain(&second).map(|p| &p.data[..]).collect();
    let lost = [&lost[..3], &lost[4..]].concat();
    let (parser, errors) = parse_all(lost, Limits::default());
    assert_eq!(errors[0], ParseError::FrameNumber { expected: 3, found: 4 });
    assert_eq!(errors[1..], [ParseError::NoKeyframe, ParseError::NoKeyframe, ParseError::NoKeyframe]);
    assert_eq!((parser.first_frame(), parser.is_ended()), (Some(8), true));
}

#[test]
fn a_broken_slab_keeps_what_was_complete() {
    let mesh = irregular_mesh(&small_params(4));
    let mut packets: Vec<Vec<u8>> = write_slab(&mesh, 0, 8).into_iter().map(|p| p.data).collect();
    let (intact, _) = parse_all(packets[..4].iter().map(|p| &p[..]), Limits::default());
    let middle = packets[4].len() / 2;
    packets[4][middle] ^= 0x10;
    repair(&mut packets[4]);
    let (parser, errors) = parse_all(packets.iter().map(|p| &p[..]), Limits::default());
    assert!(!errors.is_empty());
    assert!(parser.frames_complete() >= 4);
    if parser.frames_complete() == 4 {
        assert_eq!(parser.mesh(), intact.mesh());
    }
    let header = parser.header();
    assert_eq!(header, Some(&header_of(mesh.domain)));
}

#[test]
fn packets_are_found_between_garbage() {
    let packets = tiny_slab();
    let mut random = Random::new(1);
    let mut stream = Vec::new();
    for packet in &packets {
        let garbage = random.below(60);
        stream.extend((0..garbage).map(|_| random.below(256) as u8));
        // Starts that are none: cut off by what follows, or with a wrong header check.
        stream.extend_from_slice(&MAGIC[..random.below(9)]);
        stream.extend_from_slice(&SYNC);
        stream.extend_from_slice(&packet.data);
    }
    let limits = Limits::default();
    let (mut at, mut found) = (0, Vec::new());
    loop {
        at += find_packet(&stream[at..], &limits);
        match parse_packet_header(&stream[at..], &limits) {
            Ok(Some(header)) => {
                found.push(stream[at..at + header.length].to_vec());
                at += header.length;
            }
            _ => break,
        }
    }
    assert_eq!(found, packets.into_iter().map(|p| p.data).collect::<Vec<_>>());
    assert_eq!(at, stream.len());
}

#[test]
fn a_header_asks_for_more_bytes_until_it_is_whole() {
    for packet in tiny_slab() {
        let whole = header_bytes(&packet.data);
        for length in 0..packet.data.len() {
            let parsed = parse_packet_header(&packet.data[..length], &Limits::default());
            match parsed.expect("a start that matches so far") {
                None => assert!(length < whole),
                Some(header) => assert_eq!((length >= whole, header.length), (true, packet.data.len())),
            }
        }
    }
}

#[test]
fn streams_may_follow_each_other() {
    let slabs = [tiny_slab(), write_slab(&irregular_mesh(&small_params(6)), 0, 8)];
    let mut stream = Vec::new();
    for packets in &slabs {
        let mut index = IndexWriter::new();
        for packet in packets {
            index.push(packet);
            stream.extend_from_slice(&packet.data);
        }
        stream.extend_from_slice(&index.finish().expect("a short index").data);
    }
    let limits = Limits::default();
    let mut parser = SlabParser::new(limits);
    let (mut at, mut ended, mut indexes) = (0, 0, 0);
    while at < stream.len() {
        let header = parse_packet_header(&stream[at..], &limits).expect("a packet").expect("a whole one");
        let parsed = parser.parse_packet(&stream[at..at + header.length]).expect("an undamaged packet");
        assert_eq!(parsed, header);
        at += header.length;
        ended += usize::from(header.last);
        indexes += usize::from(!header.picture);
    }
    assert_eq!((ended, indexes), (2, 2));
    assert_eq!(parser.frames_complete(), 8);
}

#[test]
fn limits_hold() {
    let mesh = irregular_mesh(&small_params(4));
    let packets = write_slab(&mesh, 0, 8);
    let first_error = |change: fn(&mut Limits)| {
        let mut limits = Limits::default();
        change(&mut limits);
        let (parser, errors) = parse_all(packets.iter().map(|p| &p.data[..]), limits);
        assert_sound(&parser);
        errors.into_iter().next().expect("beyond the limits")
    };
    let too_many = |field, limit| ParseError::Mesh(MeshFault::TooMany { field, limit });
    assert_eq!(first_error(|l| l.max_vertices = 20), too_many("vertices", 20));
    assert_eq!(first_error(|l| l.max_wedges = 20), too_many("wedges", 20));
    assert_eq!(first_error(|l| l.max_tets = 20), too_many("tets", 20));
    assert_eq!(first_error(|l| l.max_labels = 2), too_many("labels", 2));
    assert_eq!(first_error(|l| l.max_width = 63), ParseError::TooLarge { field: "width", limit: 63, found: 64 });
    assert_eq!(first_error(|l| l.max_height = 47), ParseError::TooLarge { field: "height", limit: 47, found: 48 });
    assert!(matches!(first_error(|l| l.max_packet_bytes = 99), ParseError::TooLarge { field: "packet", .. }));
    assert_eq!(first_error(|l| l.max_duration = 7), too_many("frames in a slab", 7));
}

#[test]
fn other_versions_and_formats_are_named() {
    let mut keyframe = tiny_slab()[0].data.clone();
    keyframe[MAGIC.len() - 1] = VERSION + 1;
    let version = Err(ParseError::Version { expected: VERSION, found: VERSION + 1 });
    assert_eq!(parse_packet_header(&keyframe, &Limits::default()), version);
    let png = Err(ParseError::Start { found: [0x89, b'P', b'N', b'G'] });
    assert_eq!(parse_packet_header(b"\x89PNG\r\n\x1a\n", &Limits::default()), png);
}

#[test]
fn an_index_leads_to_keyframes() {
    let mesh = irregular_mesh(&small_params(6));
    let packets: Vec<Packet> = (0..3).flat_map(|slab| write_slab(&mesh, slab * 8, 8)).collect();
    let mut index = IndexWriter::new();
    packets.iter().for_each(|packet| index.push(packet));
    let index_packet = index.finish().expect("a short index");
    assert_eq!((index_packet.frame_number, index_packet.picture), (24, false));
    let mut stream: Vec<u8> = vec![0x55; 1000];
    packets.iter().chain([&index_packet]).for_each(|packet| stream.extend_from_slice(&packet.data));

    let tail: [u8; TAIL_BYTES] = stream[stream.len() - TAIL_BYTES..].try_into().expect("a tail");
    let start = stream.len() - index_length(&tail).expect("an index");
    let parsed = Index::from_packet(&stream[start..], &Limits::default()).expect("an undamaged index");
    assert_eq!((parsed.frame_count, parsed.entries.len()), (24, 3));
    for (frame, keyframe) in [(0, 0), (7, 0), (8, 8), (23, 16), (u64::MAX, 16)] {
        let entry = parsed.keyframe_at(frame).expect("a keyframe at the start");
        let offset = entry.offset(start as u64).expect("inside the file") as usize;
        let found = parse_packet_header(&stream[offset..], &Limits::default()).expect("a packet");
        assert_eq!(found.map(|h| (h.frame_number, h.keyframe)), Some((keyframe, true)));
    }
    assert_eq!(parsed.entries[0].offset(start as u64), Some(1000));
    assert_eq!(parsed.entries[0].offset(99), None);
    assert_eq!(index_length(&[0; TAIL_BYTES]), None);
}

#[test]
fn a_lying_index_is_refused_or_harmless() {
    let packets = tiny_slab();
    let mut index = IndexWriter::new();
    packets.iter().for_each(|packet| index.push(packet));
    let packet = index.finish().expect("a short index").data;
    for bit in 0..packet.len() * 8 {
        let mut damaged = packet.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Index::from_packet(&damaged, &Limits::default()).is_err());
        if bit / 8 < 4 {
            continue;
        }
        repair(&mut damaged);
        if let Ok(index) = Index::from_packet(&damaged, &Limits::default()) {
            assert!(index.entries.iter().all(|e| e.offset(10).is_none_or(|offset| offset < 10)));
        }
    }
    let mut many = body(&packet).to_vec();
    many[..4].copy_from_slice(&u32::MAX.to_le_bytes());
    let error = Index::from_packet(&with_body(&packet, &many), &Limits::default());
    assert!(matches!(error, Err(ParseError::Length { field: "index", .. })));
}

#[test]
fn a_writer_refuses_what_no_parser_would_take() {
    let mesh = irregular_mesh(&small_params(4));
    let header = header_of(mesh.domain);
    let write = |mesh: &TetMesh| {
        let mut writer = SlabWriter::try_new(header, 0)?;
        writer.write_packet(mesh, true)
    };
    assert!(write(&mesh).is_ok());
    let no_width = SequenceHeader { width: 0, ..header };
    assert!(matches!(SlabWriter::try_new(no_width, 0), Err(WriteError::Header(ParseError::Field { .. }))));

    let other_box = TetMesh { domain: Domain { width: 65, ..mesh.domain }, ..mesh.clone() };
    assert!(matches!(write(&other_box), Err(WriteError::Domain { .. })));
    let mut inverted = mesh.clone();
    inverted.tets.iter_mut().for_each(|corners| corners.swap(0, 1));
    assert!(matches!(write(&inverted), Err(WriteError::Mesh(MeshFault::NotPositive { .. }))));
    let mut outside = mesh.clone();
    outside.positions[0] = glam::IVec3::splat(i32::MAX);
    assert!(matches!(write(&outside), Err(WriteError::Mesh(MeshFault::Outside { .. }))));
    let mut dangling = mesh.clone();
    dangling.wedges[0].vertex.0 = u32::MAX;
    assert!(matches!(write(&dangling), Err(WriteError::Tet(_))));
    let mut unpinned = mesh.clone();
    unpinned.pinned.pop();
    assert!(matches!(write(&unpinned), Err(WriteError::Pinned { .. })));
    let mut short = mesh.clone();
    short.domain.duration = 7;
    assert!(matches!(write(&short), Err(WriteError::Mesh(_))));

    let mut writer = SlabWriter::try_new(header, 0).expect("a header in range");
    for found in
        [ColorSteps { step: 0, size: 40 }, ColorSteps { step: 129, size: 40 }, ColorSteps { step: 1, size: 70 }]
    {
        assert_eq!(writer.set_color_steps(found), Err(WriteError::ColorSteps { found }));
    }
    writer.write_packet(&mesh, false).expect("a tiling");
    let found = ColorSteps::even(1);
    assert_eq!(writer.set_color_steps(found), Err(WriteError::ColorSteps { found }));
    let mut shrunk = mesh.clone();
    shrunk.tets.pop();
    assert!(matches!(writer.write_packet(&shrunk, false), Err(WriteError::NotAppended { .. })));
    let mut moved = mesh.clone();
    moved.pinned[0] ^= true;
    assert_eq!(writer.write_packet(&moved, false), Err(WriteError::Changed { vertex: 0 }));
    writer.write_packet(&mesh, true).expect("a tiling");
    assert!(matches!(writer.write_packet(&mesh, true), Err(WriteError::Ended)));
}

#[test]
fn the_stored_vector_is_written_and_parsed() {
    let mesh = vector::example_mesh();
    assert_eq!(validate(&mesh), Ok(()));
    let packets = write_slab(&mesh, 0, 1);
    let mut index = IndexWriter::new();
    index.push(&packets[0]);
    let stream = [packets[0].data.clone(), index.finish().expect("a short index").data].concat();
    let hex: Vec<String> = stream.iter().map(|byte| format!("{byte:02x}")).collect();
    let rows: Vec<String> = hex.chunks(24).map(|row| row.join(" ")).collect();
    let format = include_str!("../docs/format.md");
    let stored: Vec<&str> = format.lines().filter_map(|line| line.strip_prefix("    hex ")).collect();
    assert_eq!(rows, stored, "docs/format.md, section 10");
    let (parser, errors) = parse_all([&packets[0].data[..]], Limits::default());
    assert_eq!(errors, []);
    assert_same(parser.mesh().expect("a whole slab"), &mesh);
}
