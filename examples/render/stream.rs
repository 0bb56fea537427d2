//! A .tetv file as packets.
//!
//! In: a file's bytes. Out: its packets, and what damage lies between them. Forbidden here: decoding.

use tetvec::bitstream::{Limits, ParseError, find_packet, parse_packet_header};
use thiserror::Error;

/// Bytes that are no packet.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("bytes {start} to {end} skipped: {error}")]
pub(crate) struct Damage {
    /// Offset of the first of them.
    pub start: usize,
    /// Offset of the next packet, or of the end.
    pub end: usize,
    /// What is wrong at `start`.
    pub error: ParseError,
}

/// The packets of a stream, or of several written one behind the other. Their contents are not looked at: damage
/// inside of a packet is found by whoever decodes it.
pub(crate) struct Packets<'a> {
    bytes: &'a [u8],
    /// Offset of what was given out last.
    last: usize,
    /// Offset of what comes next.
    at: usize,
    limits: Limits,
}

impl<'a> Packets<'a> {
    /// Packets of all of `bytes`.
    pub(crate) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes, last: 0, at: 0, limits: Limits::default() }
    }

    /// To be called when the packet given out last turns out to be damaged: its length may be wrong too, as where a
    /// file was cut off and another one follows, so the next packet is looked for inside of it.
    pub(crate) fn distrust_last(&mut self) {
        self.at = self.search(self.last + 1);
    }

    /// Offset of the first packet from `start` on, or of the end.
    fn search(&self, start: usize) -> usize {
        let start = start.min(self.bytes.len());
        start + find_packet(&self.bytes[start..], &self.limits)
    }

    fn whole_packet(&self) -> Result<&'a [u8], ParseError> {
        let rest = &self.bytes[self.at..];
        let cut_off = |expected| ParseError::Length { field: "packet", expected, found: rest.len() };
        let header = parse_packet_header(rest, &self.limits)?.ok_or_else(|| cut_off(rest.len() + 1))?;
        rest.get(..header.length).ok_or_else(|| cut_off(header.length))
    }
}

impl<'a> Iterator for Packets<'a> {
    type Item = Result<&'a [u8], Damage>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.at >= self.bytes.len() {
            return None;
        }
        let start = self.at;
        let packet = self.whole_packet();
        self.last = start;
        self.at = match &packet {
            Ok(packet) => start + packet.len(),
            Err(_) => self.search(start + 1),
        };
        Some(packet.map_err(|error| Damage { start, end: self.at, error }))
    }
}
