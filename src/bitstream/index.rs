//! The index that ends a stream: where its keyframes are.
//!
//! In: the packets of a stream as they are written; the last bytes of a stream. Out: the index packet; the table.
//! Forbidden here: reading what the index points to, and believing it.
//!
//! Entries count backwards from the index's own first byte, so that they hold wherever the stream lies in a file or
//! behind another stream. The body ends with the packet's length once more and a tag, so that the index is found from
//! the end; the first entry leads to the stream's start, before which another stream's index may end.

use super::framing::{CRC_BYTES, parse_packet, read_u32, read_u64};
use super::{Limits, ParseError};

/// Stands before the CRC of an index packet.
const FOOTER_TAG: [u8; 4] = *b"TVIX";
/// Bytes of the length and the tag.
const FOOTER_BYTES: usize = 8;
/// Bytes of an entry.
const ENTRY_BYTES: usize = 16;
/// Bytes of the number of entries.
const COUNT_BYTES: usize = 4;

/// Bytes to read from the end of a stream for [`index_length`].
pub const TAIL_BYTES: usize = FOOTER_BYTES + CRC_BYTES;

/// A keyframe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct IndexEntry {
    /// Its frame number.
    pub frame_number: u64,
    /// Bytes from its first byte to the first byte of the index packet.
    pub distance: u64,
}

/// The keyframes of a stream.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Index {
    /// Frames of the stream.
    pub frame_count: u64,
    /// Keyframes, ascending.
    pub entries: Vec<IndexEntry>,
}

impl Index {
    /// Parses an index packet.
    ///
    /// # Errors
    /// Damage, or entries out of order.
    pub fn from_packet(packet: &[u8], limits: &Limits) -> Result<Self, ParseError> {
        let (header, body) = parse_packet(packet, limits)?;
        let fixed = COUNT_BYTES + FOOTER_BYTES;
        let length = |expected| ParseError::Length { field: "index", expected, found: body.len() };
        if header.picture || body.len() < fixed {
            return Err(length(fixed));
        }
        let count = read_u32(body, 0) as usize;
        let expected = count.saturating_mul(ENTRY_BYTES).saturating_add(fixed);
        if body.len() != expected {
            return Err(length(expected));
        }
        let footer = &body[body.len() - FOOTER_BYTES..];
        if read_u32(footer, 0) as usize != packet.len() || footer[4..] != FOOTER_TAG {
            return Err(ParseError::Length { field: "index footer", expected: packet.len(), found: body.len() });
        }
        let entries: Vec<IndexEntry> = body[COUNT_BYTES..COUNT_BYTES + count * ENTRY_BYTES]
            .as_chunks::<ENTRY_BYTES>()
            .0
            .iter()
            .map(|entry| IndexEntry { frame_number: read_u64(entry, 0), distance: read_u64(entry, 8) })
            .collect();
        check_order(&entries, header.frame_number)?;
        Ok(Self { frame_count: header.frame_number, entries })
    }

    /// The last keyframe at or before a frame.
    pub fn keyframe_at(&self, frame_number: u64) -> Option<IndexEntry> {
        let after = self.entries.partition_point(|entry| entry.frame_number <= frame_number);
        after.checked_sub(1).map(|last| self.entries[last])
    }
}

impl IndexEntry {
    /// The keyframe's offset in a file where the index packet starts at `index_offset`; `None` if that lies before
    /// the file. Check what is there with [`super::parse_packet_header`]: a damaged index may point anywhere.
    pub fn offset(&self, index_offset: u64) -> Option<u64> {
        index_offset.checked_sub(self.distance)
    }
}

fn check_order(entries: &[IndexEntry], frame_count: u64) -> Result<(), ParseError> {
    let (mut frame, mut distance) = (None, u64::MAX);
    for (entry, found) in entries.iter().enumerate() {
        let ordered = frame < Some(found.frame_number) && found.frame_number < frame_count;
        if !ordered || found.distance >= distance || found.distance == 0 {
            return Err(ParseError::Index { entry });
        }
        (frame, distance) = (Some(found.frame_number), found.distance);
    }
    Ok(())
}

/// The length of the index packet that ends with `tail`, the last [`TAIL_BYTES`] of a stream; `None`: there is none.
pub fn index_length(tail: &[u8; TAIL_BYTES]) -> Option<usize> {
    (tail[4..FOOTER_BYTES] == FOOTER_TAG).then(|| read_u32(tail, 0) as usize)
}

/// Collects the index of a stream while it is written.
#[cfg(feature = "encode")]
#[derive(Debug, Clone, Default)]
pub struct IndexWriter {
    /// (frame number, offset) of the keyframes.
    keyframes: Vec<(u64, u64)>,
    bytes: u64,
    frame_count: u64,
}

#[cfg(feature = "encode")]
impl IndexWriter {
    /// An index without entries.
    pub fn new() -> Self {
        Self::default()
    }

    /// Takes note of the stream's next packet.
    pub fn push(&mut self, packet: &super::Packet) {
        if packet.keyframe {
            self.keyframes.push((packet.frame_number, self.bytes));
        }
        self.bytes += packet.data.len() as u64;
        self.frame_count = packet.frame_number + 1;
    }

    /// The index packet, to follow the last packet.
    ///
    /// # Errors
    /// More keyframes than a packet holds.
    pub fn finish(&self) -> Result<super::Packet, super::WriteError> {
        use super::framing::{PacketHeader, write_packet};
        let mut header =
            PacketHeader { length: 0, frame_number: self.frame_count, keyframe: false, last: false, picture: false };
        let body_bytes = COUNT_BYTES + self.keyframes.len() * ENTRY_BYTES + FOOTER_BYTES;
        header.length = header.header_bytes() + body_bytes + CRC_BYTES;
        let limit = Limits::default().max_packet_bytes as usize;
        let too_long = super::WriteError::PacketBytes { limit, found: body_bytes };
        if header.length > limit {
            return Err(too_long);
        }
        let mut body = Vec::with_capacity(body_bytes);
        body.extend_from_slice(&(self.keyframes.len() as u32).to_le_bytes());
        for &(frame_number, offset) in &self.keyframes {
            body.extend_from_slice(&frame_number.to_le_bytes());
            body.extend_from_slice(&(self.bytes - offset).to_le_bytes());
        }
        body.extend_from_slice(&(header.length as u32).to_le_bytes());
        body.extend_from_slice(&FOOTER_TAG);
        let data = write_packet(header, &body).ok_or(too_long)?;
        Ok(super::Packet { frame_number: self.frame_count, keyframe: false, picture: false, data })
    }
}
