//! The frame around a packet: start code, header, CRC; finding packets in any bytes.
//!
//! In: bytes from anywhere in a stream. Out: checked packet headers and bodies. Forbidden here: what a body means.
//!
//! ```text
//! start code 8 (keyframe) or 4 | flags 1 | length 4 | frame number 8 | header check 2 | body | CRC-32 4
//! ```
//!
//! A body may contain a start code by chance, so a start is believed only with its header check, which needs no more
//! bytes than the header, and a packet only with its CRC.

use super::header::MAX_HEADER_BYTES;
use super::{Limits, ParseError, SequenceHeader};

/// Version of the format, the last byte of [`MAGIC`].
pub const VERSION: u8 = 5;

/// First bytes of a keyframe packet, and so of a file. The first byte is no ASCII and the line end would not survive a
/// transfer as text, as in PNG.
pub const MAGIC: [u8; 8] = [0x89, b'T', b'E', b'T', b'V', b'\r', b'\n', VERSION];

/// First bytes of every other packet.
pub const SYNC: [u8; 4] = [0x89, b'T', b'V', b'P'];

/// Decoding can start here.
const FLAG_KEYFRAME: u8 = 1;
/// The slab's last packet.
const FLAG_LAST: u8 = 2;
/// An index: no picture.
const FLAG_INDEX: u8 = 4;

/// Bytes of flags, length, frame number and header check.
const FIELD_BYTES: usize = 15;
/// Bytes of the CRC at a packet's end.
pub(super) const CRC_BYTES: usize = 4;

/// First bytes of lengths that have two or four more.
const LONG: u8 = 251;
/// See [`LONG`].
const LONGER: u8 = 252;

/// What stands before a packet's body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketHeader {
    /// Bytes from the start code to the CRC, both included.
    pub length: usize,
    /// Number of the frame that the packet completes, from the start of the stream; in an index one past the last.
    pub frame_number: u64,
    /// Whether decoding can start here.
    pub keyframe: bool,
    /// Whether this is the slab's last packet.
    pub last: bool,
    /// False for an index.
    pub picture: bool,
}

impl PacketHeader {
    fn start_code(&self) -> &'static [u8] {
        if self.keyframe { &MAGIC } else { &SYNC }
    }

    /// Bytes before the body.
    pub(super) fn header_bytes(&self) -> usize {
        self.start_code().len() + FIELD_BYTES
    }

    fn flags(&self) -> u8 {
        let bit = |on: bool, flag: u8| if on { flag } else { 0 };
        bit(self.keyframe, FLAG_KEYFRAME) | bit(self.last, FLAG_LAST) | bit(!self.picture, FLAG_INDEX)
    }
}

/// Low half of a CRC-32, the check of a packet header.
fn header_check(bytes: &[u8]) -> u16 {
    crc32fast::hash(bytes) as u16
}

/// Frames `body`; `header.length` is set by what is framed. `None` if it is too long for the length field.
#[cfg(feature = "encode")]
pub(super) fn write_packet(mut header: PacketHeader, body: &[u8]) -> Option<Vec<u8>> {
    header.length = header.header_bytes() + body.len() + CRC_BYTES;
    let length = u32::try_from(header.length).ok()?;
    let mut data = Vec::with_capacity(header.length);
    data.extend_from_slice(header.start_code());
    data.push(header.flags());
    data.extend_from_slice(&length.to_le_bytes());
    data.extend_from_slice(&header.frame_number.to_le_bytes());
    data.extend_from_slice(&header_check(&data).to_le_bytes());
    data.extend_from_slice(body);
    data.extend_from_slice(&crc32fast::hash(&data).to_le_bytes());
    Some(data)
}

/// Appends a payload: the length of its raw bits in the variable-length code of the sequence header, these, then the coded
/// bytes.
#[cfg(feature = "encode")]
pub(super) fn write_payload(body: &mut Vec<u8>, [coded, raw]: &[Vec<u8>; 2]) {
    let length = raw.len() as u32;
    match (u8::try_from(length).ok().filter(|&byte| byte < LONG), u16::try_from(length)) {
        (Some(byte), _) => body.push(byte),
        (None, Ok(word)) => {
            body.push(LONG);
            body.extend_from_slice(&word.to_le_bytes());
        }
        (None, Err(_)) => {
            body.push(LONGER);
            body.extend_from_slice(&length.to_le_bytes());
        }
    }
    body.extend_from_slice(raw);
    body.extend_from_slice(coded);
}

/// The coded bytes of a payload, and those of its raw bits.
///
/// # Errors
/// A payload that ends before its raw bits do.
pub(super) fn parse_payload(payload: &[u8]) -> Result<[&[u8]; 2], ParseError> {
    let (length, start) = match *payload {
        [byte, ..] if byte < LONG => (usize::from(byte), 1),
        [LONG, low, high, ..] => (usize::from(u16::from_le_bytes([low, high])), 3),
        [LONGER, a, b, c, d, ..] => (u32::from_le_bytes([a, b, c, d]) as usize, 5),
        _ => (1, payload.len()),
    };
    let parts = payload[start..].split_at_checked(length);
    let cut_off =
        || ParseError::Length { field: "raw bits", expected: start.saturating_add(length), found: payload.len() };
    parts.map(|(raw, coded)| [coded, raw]).ok_or_else(cut_off)
}

/// Parses the packet header at the start of `bytes`; `None` if it is cut off and more bytes are needed. The CRC is not
/// looked at.
///
/// # Errors
/// No start code, another version, a wrong header check, or a length beyond the limits.
pub fn parse_packet_header(bytes: &[u8], limits: &Limits) -> Result<Option<PacketHeader>, ParseError> {
    let Some(keyframe) = parse_start(bytes)? else { return Ok(None) };
    let fields = if keyframe { MAGIC.len() } else { SYNC.len() };
    let Some(header) = bytes.get(..fields + FIELD_BYTES) else { return Ok(None) };
    let flags = header[fields];
    let length = read_u32(header, fields + 1);
    let frame_number = read_u64(header, fields + 5);
    let (expected, found) = (header_check(&header[..fields + 13]), read_u16(header, fields + 13));
    let parsed = PacketHeader {
        length: length as usize,
        frame_number,
        keyframe,
        last: flags & FLAG_LAST != 0,
        picture: flags & FLAG_INDEX == 0,
    };
    // The index is neither a keyframe nor part of a slab; unknown flags do not come back from `flags()`.
    if expected != found || flags != parsed.flags() || (!parsed.picture && flags != FLAG_INDEX) {
        return Err(ParseError::PacketHeader { expected, found, flags });
    }
    if length > limits.max_packet_bytes {
        return Err(ParseError::TooLarge {
            field: "packet",
            limit: limits.max_packet_bytes.into(),
            found: length.into(),
        });
    }
    let least = parsed.header_bytes() + CRC_BYTES;
    if parsed.length < least {
        return Err(ParseError::Length { field: "packet", expected: least, found: parsed.length });
    }
    Ok(Some(parsed))
}

/// First bytes of a keyframe packet that surely hold the sequence header.
pub const SEQUENCE_HEADER_BYTES: usize = MAGIC.len() + FIELD_BYTES + 2 + MAX_HEADER_BYTES;

/// Parses the sequence header in the first bytes of a keyframe packet, [`SEQUENCE_HEADER_BYTES`] of them or all. The
/// CRC is not looked at.
///
/// # Errors
/// No keyframe packet, or a header that is cut off, damaged or beyond the limits.
pub fn parse_sequence_header(bytes: &[u8], limits: &Limits) -> Result<SequenceHeader, ParseError> {
    let length = |expected| ParseError::Length { field: "keyframe", expected, found: bytes.len() };
    let packet = parse_packet_header(bytes, limits)?.filter(|packet| packet.keyframe);
    let start = packet.ok_or_else(|| length(SEQUENCE_HEADER_BYTES))?.header_bytes() + 2;
    let Some(size) = bytes.get(start - 2..start) else { return Err(length(start)) };
    let end = start + usize::from(read_u16(size, 0));
    SequenceHeader::from_bytes(bytes.get(start..end).ok_or_else(|| length(end))?, limits)
}

/// Whether `bytes` start a keyframe packet or another; `None` if too few bytes are there to tell.
fn parse_start(bytes: &[u8]) -> Result<Option<bool>, ParseError> {
    let common = |code: &[u8]| bytes.iter().zip(code).take_while(|(a, b)| a == b).count();
    if common(&SYNC) == SYNC.len() {
        return Ok(Some(false));
    }
    let matching = common(&MAGIC);
    if matching == MAGIC.len() {
        return Ok(Some(true));
    }
    if matching == bytes.len() || common(&SYNC) == bytes.len() {
        return Ok(None);
    }
    if matching == MAGIC.len() - 1 {
        return Err(ParseError::Version { expected: VERSION, found: bytes[MAGIC.len() - 1] });
    }
    let mut found = [0; 4];
    for (to, from) in found.iter_mut().zip(bytes) {
        *to = *from;
    }
    Err(ParseError::Start { found })
}

/// The number of bytes of `bytes` to skip to the first place where a packet may start: a header that passes all of
/// [`parse_packet_header`], or one that is cut off by the end of `bytes`. All of them if there is none.
pub fn find_packet(bytes: &[u8], limits: &Limits) -> usize {
    (0..bytes.len())
        .filter(|&at| bytes[at] == MAGIC[0])
        .find(|&at| parse_packet_header(&bytes[at..], limits).is_ok())
        .unwrap_or(bytes.len())
}

/// Parses the header of the one whole packet in `bytes`, checks length and CRC, and returns the body too.
pub(super) fn parse_packet<'a>(bytes: &'a [u8], limits: &Limits) -> Result<(PacketHeader, &'a [u8]), ParseError> {
    let found = bytes.len();
    let Some(header) = parse_packet_header(bytes, limits)? else {
        let expected = MAGIC.len() + FIELD_BYTES + CRC_BYTES;
        return Err(ParseError::Length { field: "packet", expected, found });
    };
    if header.length != found {
        return Err(ParseError::Length { field: "packet", expected: header.length, found });
    }
    let (checked, stored) = bytes.split_at(found - CRC_BYTES);
    let (expected, found) = (crc32fast::hash(checked), read_u32(stored, 0));
    if expected != found {
        return Err(ParseError::Crc { expected, found });
    }
    Ok((header, &checked[header.header_bytes()..]))
}

/// Little-endian integers at `at`; the caller has checked that they are there.
pub(super) fn read_u16(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

/// See [`read_u16`].
pub(super) fn read_u32(bytes: &[u8], at: usize) -> u32 {
    u32::from(read_u16(bytes, at)) | u32::from(read_u16(bytes, at + 2)) << 16
}

/// See [`read_u16`].
pub(super) fn read_u64(bytes: &[u8], at: usize) -> u64 {
    u64::from(read_u32(bytes, at)) | u64::from(read_u32(bytes, at + 4)) << 32
}
