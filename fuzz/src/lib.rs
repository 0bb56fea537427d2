//! What must hold for any bytes, one function a fuzz target.
//!
//! Inputs are streams, whole or damaged. Checksums would stop nearly all of them at the door, so [`slab`], [`render`] and
//! [`round_trip`] make those right first.

use tetvec::bitstream::{
    Index, Limits, MAGIC, SYNC, SlabParser, SlabWriter, TAIL_BYTES, find_packet, index_length, parse_packet_header,
    parse_sequence_header,
};
use tetvec::mesh::{TetMesh, volume6};
use tetvec::{Decoder, DecoderConfig, Frame, Surface, Viewport};

/// A target by its name.
pub type Target = (&'static str, fn(&[u8]));

/// All targets.
pub const TARGETS: [Target; 5] =
    [("packets", packets), ("slab", slab), ("render", render), ("round_trip", round_trip), ("feed", feed)];

/// Bytes of flags, length, frame number and header check.
const FIELD_BYTES: usize = 15;
const CRC_BYTES: usize = 4;

/// Bounds that keep a run short.
fn small_limits() -> Limits {
    Limits { max_vertices: 1 << 14, max_wedges: 1 << 15, max_tets: 1 << 16, max_duration: 64, ..Limits::default() }
}

/// Packet headers, sequence headers and indexes.
pub fn packets(data: &[u8]) {
    let limits = Limits::default();
    let skipped = find_packet(data, &limits);
    assert!(skipped <= data.len());
    for rest in [data, &data[skipped..]] {
        if let Ok(Some(header)) = parse_packet_header(rest, &limits) {
            assert!(header.length <= limits.max_packet_bytes as usize);
        }
        if let Ok(header) = parse_sequence_header(rest, &limits) {
            assert!(header.check(&limits).is_ok());
        }
        let _ = Index::from_packet(rest, &limits);
        let _ = SlabParser::new(limits).parse_packet(rest);
    }
    for packet in repaired(data) {
        if let Ok(index) = Index::from_packet(&packet, &limits) {
            assert!(index.entries.iter().all(|entry| entry.offset(10).is_none_or(|offset| offset < 10)));
        }
    }
    if let Some(tail) = data.last_chunk::<TAIL_BYTES>() {
        let _ = index_length(tail);
    }
}

/// A slab from packets with right checksums.
pub fn slab(data: &[u8]) {
    let mut parser = SlabParser::new(small_limits());
    for packet in repaired(data) {
        let _ = parser.parse_packet(&packet);
        if let Some(mesh) = parser.mesh() {
            assert_sound(mesh);
        }
    }
}

/// Pictures of whatever was decoded, at several sizes, times and levels.
pub fn render(data: &[u8]) {
    let packets = repaired(data);
    let mut picture = Frame::from_fn(24, 18, |_, _| [0; 3]).expect("a small picture");
    for levels in [None, Some(0), Some(2)] {
        let config = DecoderConfig { subdivision_levels: levels, threads: 1, ..DecoderConfig::default() };
        let mut decoder = Decoder::new(config);
        for (k, packet) in packets.iter().enumerate() {
            let frame = decoder.send_packet(packet).map_or(k as f64, |info| info.frame_number as f64);
            let close = Viewport { x: -1.5, y: 2.25, width: 9.0, height: 30.0 };
            for (time, viewport) in [(frame, None), (frame + 0.3, Some(close)), (f64::NAN, None), (-1e300, None)] {
                let _ = decoder.render(time, viewport, &mut Surface::of_frame(&mut picture));
            }
        }
    }
}

/// What was parsed can be written, and comes back.
pub fn round_trip(data: &[u8]) {
    let mut parser = SlabParser::new(small_limits());
    for packet in repaired(data) {
        let _ = parser.parse_packet(&packet);
    }
    let (Some(mesh), Some(header)) = (parser.mesh().cloned(), parser.header().copied()) else { return };
    let mut writer = SlabWriter::try_new(header, 7).expect("a header that was parsed");
    if let Some(steps) = parser.color_steps() {
        writer.set_color_steps(steps).expect("steps that were parsed");
    }
    // Faces that meet as no tiling's do may be refused, but only while writing.
    let Ok(packet) = writer.write_packet(&mesh, true) else { return };
    let mut again = SlabParser::new(Limits::default());
    again.parse_packet(&packet.data).expect("what was written");
    let back = again.mesh().expect("a slab");
    assert_eq!(Some(back), writer.coded_mesh());
    assert_eq!(back.tets.len(), mesh.tets.len());
    assert_sound(back);
}

/// Packets found in a stream do not depend on how it is cut up on its way.
pub fn feed(data: &[u8]) {
    let whole = cut(data, &[data.len()]);
    let step = 1 + data.first().map_or(0, |&byte| usize::from(byte) % 61);
    let pieces: Vec<usize> = (0..data.len()).step_by(step).chain([data.len()]).collect();
    assert_eq!(whole, cut(data, &pieces));
}

/// Packets of a stream that arrives up to these ends, one after the other.
fn cut(data: &[u8], ends: &[usize]) -> Vec<(usize, usize)> {
    let limits = Limits::default();
    let mut found = Vec::new();
    let mut at = 0;
    for &end in ends {
        let arrived = &data[..end];
        loop {
            at += find_packet(&arrived[at..], &limits);
            let Ok(Some(header)) = parse_packet_header(&arrived[at..], &limits) else { break };
            let Some(packet) = arrived.get(at..at + header.length) else { break };
            let crc = u32::from_le_bytes(packet[packet.len() - CRC_BYTES..].try_into().expect("four bytes"));
            if crc32fast::hash(&packet[..packet.len() - CRC_BYTES]) == crc {
                found.push((at, header.length));
                at += header.length;
            } else {
                at += 1;
            }
        }
    }
    found
}

/// The packets that start codes in `data` begin, with lengths and checksums made right.
fn repaired(data: &[u8]) -> Vec<Vec<u8>> {
    let is_start = |at: &usize| data[*at..].starts_with(&MAGIC) || data[*at..].starts_with(&SYNC);
    let starts: Vec<usize> = (0..data.len()).filter(is_start).chain([data.len()]).collect();
    starts.windows(2).filter_map(|ends| repair(&data[ends[0]..ends[1]])).collect()
}

fn repair(packet: &[u8]) -> Option<Vec<u8>> {
    let code = if packet.starts_with(&MAGIC) { MAGIC.len() } else { SYNC.len() };
    if packet.len() < code + FIELD_BYTES + CRC_BYTES {
        return None;
    }
    let mut packet = packet.to_vec();
    let length = u32::try_from(packet.len()).ok()?.to_le_bytes();
    packet[code + 1..code + 5].copy_from_slice(&length);
    let check_at = code + FIELD_BYTES - 2;
    let check = crc32fast::hash(&packet[..check_at]) as u16;
    packet[check_at..check_at + 2].copy_from_slice(&check.to_le_bytes());
    let crc_at = packet.len() - CRC_BYTES;
    let crc = crc32fast::hash(&packet[..crc_at]);
    packet[crc_at..].copy_from_slice(&crc.to_le_bytes());
    Some(packet)
}

/// What the parser promises of any bytes.
fn assert_sound(mesh: &TetMesh) {
    let extent = mesh.domain.extent();
    assert!(mesh.positions.iter().all(|p| p.min_element() >= 0 && p.cmple(extent).all()));
    assert_eq!(mesh.positions.len(), mesh.pinned.len());
    for tet in 0..mesh.tets.len() {
        let [a, b, c, d] = mesh.tet_positions(tet);
        assert!(volume6(a, b, c, d) > 0);
        assert!(mesh.tets[tet].iter().all(|w| mesh.wedges[w.index()].label == mesh.tet_label(tet)));
    }
}
