//! Packets taken apart and put together again with valid checks, as a fuzzer would.

/// Bytes of flags, length, frame number and header check.
const FIELD_BYTES: usize = 15;
const CRC_BYTES: usize = 4;

/// Bytes of a packet before its body.
pub(crate) fn header_bytes(packet: &[u8]) -> usize {
    FIELD_BYTES + if packet[2] == b'E' { 8 } else { 4 }
}

/// A packet's body.
pub(crate) fn body(packet: &[u8]) -> &[u8] {
    &packet[header_bytes(packet)..packet.len() - CRC_BYTES]
}

/// Makes length, header check and CRC of a damaged packet right. The first bytes decide how long its start code is.
pub(crate) fn repair(packet: &mut [u8]) {
    let check_at = header_bytes(packet) - 2;
    let crc_at = packet.len() - CRC_BYTES;
    let length = (packet.len() as u32).to_le_bytes();
    packet[check_at - 12..check_at - 8].copy_from_slice(&length);
    let check = crc32fast::hash(&packet[..check_at]) as u16;
    packet[check_at..check_at + 2].copy_from_slice(&check.to_le_bytes());
    let crc = crc32fast::hash(&packet[..crc_at]);
    packet[crc_at..].copy_from_slice(&crc.to_le_bytes());
}

/// The packet with another body.
pub(crate) fn with_body(packet: &[u8], body: &[u8]) -> Vec<u8> {
    let mut changed = packet[..header_bytes(packet)].to_vec();
    changed.extend_from_slice(body);
    changed.extend_from_slice(&[0; CRC_BYTES]);
    repair(&mut changed);
    changed
}
