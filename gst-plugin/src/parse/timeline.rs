//! The keyframes of a whole file, over all streams joined in it. In: a file that can be read anywhere. Out: times and
//! offsets of its keyframes, and its duration. Forbidden here: pads, events; belief in anything not checked.
//!
//! Each stream ends with an index, which leads to its start, before which the next index may end. Where there is none,
//! or it is not true, the rest of the file is read from the front, packet header by packet header.

use gst::ClockTime;
use tetvec::SequenceHeader;
use tetvec::bitstream::{
    Index, Limits, PacketHeader, SEQUENCE_HEADER_BYTES, TAIL_BYTES, index_length, parse_packet_header,
    parse_sequence_header,
};

use super::cut::{Cut, cut};
use super::times::Origin;

/// Bytes read at once while looking for the next packet in damaged data.
const SEARCH_BYTES: usize = 64 * 1024;

/// A file. Reads may come out short at its end only; `None` where nothing can be read.
pub(super) trait ReadAt {
    /// Reads up to `length` bytes at `offset`.
    fn read_at(&mut self, offset: u64, length: usize) -> Option<Vec<u8>>;
}

/// A keyframe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Keyframe {
    /// Where its packet starts.
    pub(super) offset: u64,
    /// When its picture is shown.
    pub(super) time: ClockTime,
}

/// One of the streams joined in a file.
#[derive(Debug, Clone)]
struct Part {
    /// Where its first keyframe starts.
    start: u64,
    header: SequenceHeader,
    /// Number one past its last frame.
    frame_count: u64,
    /// (frame number, offset), ascending, not empty.
    keyframes: Vec<(u64, u64)>,
}

/// All keyframes of a file.
#[derive(Debug, Clone, Default)]
pub(super) struct Timeline {
    /// Where each stream starts, and how its frames are timed; ascending.
    origins: Vec<(u64, Origin)>,
    keyframes: Vec<Keyframe>,
    duration: ClockTime,
}

impl Timeline {
    /// Reads the timeline of a file of `size` bytes; `None` if no keyframe is found.
    pub(super) fn read(file: &mut dyn ReadAt, size: u64, limits: &Limits) -> Option<Self> {
        let mut parts = Vec::new();
        let mut end = size;
        while let Some(part) = read_indexed(file, end, limits) {
            end = part.start;
            parts.push(part);
        }
        parts.reverse();
        let mut all = scan(file, end, limits);
        all.append(&mut parts);
        Self::join(&all)
    }

    fn join(parts: &[Part]) -> Option<Self> {
        let mut timeline = Self::default();
        for part in parts {
            let (first_frame, _) = part.keyframes.first()?;
            let origin = Origin::new(timeline.duration, *first_frame, &part.header);
            for &(number, offset) in &part.keyframes {
                timeline.keyframes.push(Keyframe { offset, time: origin.time_of(number)? });
            }
            timeline.origins.push((part.start, origin));
            timeline.duration = origin.time_of(part.frame_count)?;
        }
        (!timeline.keyframes.is_empty()).then_some(timeline)
    }

    /// The whole length.
    pub(super) fn duration(&self) -> ClockTime {
        self.duration
    }

    /// All keyframes, ascending.
    pub(super) fn keyframes(&self) -> &[Keyframe] {
        &self.keyframes
    }

    /// Start and length of the frame whose packet starts at `offset`.
    pub(super) fn span_of(&self, offset: u64, packet: &PacketHeader) -> Option<(ClockTime, ClockTime)> {
        let after = self.origins.partition_point(|&(start, _)| start <= offset);
        let (_, origin) = self.origins[after.checked_sub(1)?];
        if packet.picture {
            let (start, length) = origin.span_of(packet.frame_number)?;
            return (start < self.duration).then_some((start, length));
        }
        Some((origin.time_of(packet.frame_number)?, ClockTime::ZERO))
    }
}

/// The stream whose index ends at `end`; `None` where there is no index or it does not hold.
fn read_indexed(file: &mut dyn ReadAt, end: u64, limits: &Limits) -> Option<Part> {
    let tail = read_exact(file, end.checked_sub(TAIL_BYTES as u64)?, TAIL_BYTES)?;
    let length = index_length(tail.first_chunk()?)?;
    if length > limits.max_packet_bytes as usize {
        return None;
    }
    let index_start = end.checked_sub(length as u64)?;
    let index = Index::from_packet(&read_exact(file, index_start, length)?, limits).ok()?;
    let mut keyframes = Vec::with_capacity(index.entries.len());
    for entry in &index.entries {
        let offset = entry.offset(index_start)?;
        let packet = parse_packet_header(&file.read_at(offset, SEQUENCE_HEADER_BYTES)?, limits).ok()??;
        if !packet.keyframe || packet.frame_number != entry.frame_number {
            return None;
        }
        keyframes.push((packet.frame_number, offset));
    }
    let &(first_frame, start) = keyframes.first()?;
    // No frame without a byte: a count beyond that is not true.
    (index.frame_count.checked_sub(first_frame)? <= index_start - start).then_some(())?;
    let header = read_header(file, start, limits)?;
    Some(Part { start, header, frame_count: index.frame_count, keyframes })
}

/// The streams in the first `end` bytes, found packet by packet. A packet that is cut off counts for nothing.
fn scan(file: &mut dyn ReadAt, end: u64, limits: &Limits) -> Vec<Part> {
    let mut parts: Vec<Part> = Vec::new();
    let (mut offset, mut ended) = (0, false);
    while offset < end {
        let Some((at, packet)) = next_packet(file, offset, end, limits) else { break };
        offset = at + packet.length as u64;
        if !packet.picture {
            ended = true;
            continue;
        }
        let number = packet.frame_number;
        let open = parts.last_mut().filter(|part| !ended && (!packet.keyframe || number >= part.frame_count));
        match open {
            Some(part) => {
                // Numbers far ahead of the packets are damage.
                if number - number.min(part.frame_count) > u64::from(limits.max_duration) {
                    continue;
                }
                part.frame_count = part.frame_count.max(number.saturating_add(1));
                if packet.keyframe {
                    part.keyframes.push((number, at));
                }
            }
            None if packet.keyframe => {
                let Some(header) = read_header(file, at, limits) else { continue };
                let frame_count = number.saturating_add(1);
                parts.push(Part { start: at, header, frame_count, keyframes: vec![(number, at)] });
                ended = false;
            }
            None => (),
        }
    }
    parts
}

/// The next whole packet at or after `offset`, and where it starts.
fn next_packet(file: &mut dyn ReadAt, offset: u64, end: u64, limits: &Limits) -> Option<(u64, PacketHeader)> {
    let mut at = offset;
    let mut wanted = SEQUENCE_HEADER_BYTES;
    while at < end {
        let available = usize::try_from(end - at).unwrap_or(usize::MAX);
        let bytes = file.read_at(at, wanted.min(available)).filter(|bytes| !bytes.is_empty())?;
        if let Ok(Some(packet)) = parse_packet_header(&bytes, limits)
            && packet.length <= available
        {
            return Some((at, packet));
        }
        match cut(&bytes, true, limits) {
            Cut::Packet(packet) => return Some((at, packet)),
            Cut::Skip(bytes) | Cut::Need(bytes) => at = at.saturating_add(bytes as u64),
        }
        wanted = SEARCH_BYTES;
    }
    None
}

fn read_header(file: &mut dyn ReadAt, offset: u64, limits: &Limits) -> Option<SequenceHeader> {
    parse_sequence_header(&file.read_at(offset, SEQUENCE_HEADER_BYTES)?, limits).ok()
}

fn read_exact(file: &mut dyn ReadAt, offset: u64, length: usize) -> Option<Vec<u8>> {
    file.read_at(offset, length).filter(|bytes| bytes.len() == length)
}
