//! What the streaming thread knows between two buffers: the segment, the decoder, the schedule, and events that wait for
//! caps. Every operation is short and calls no pad, so that its lock is never held over a push, a query or an event.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

use gst::ClockTime;
use gst::prelude::*;
use tetvec::{DecodeError, Decoder, DecoderConfig, PacketInfo, RenderParams, SequenceHeader, Surface};

use super::gop::Gop;
use super::negotiate::Source;
use super::timing::{Direction, Picture, Schedule, Span};

/// What became of a packet.
#[derive(Debug)]
pub(super) enum Decoded {
    /// The picture of this frame number can be drawn.
    Picture(u64),
    /// Lost; instead of its picture the last one before the loss can be shown.
    Concealed,
    /// No picture belongs to this packet.
    Nothing,
    /// Skipped: no keyframe has come since the start, a flush or a damaged packet.
    Waiting,
    /// Not decodable; packets are skipped up to the next keyframe.
    Damaged(String),
}

/// Packets that wait for their turn to be shown, and are decoded meanwhile. A keyframe's packet takes as long as seven
/// to ten others: so many are decoded ahead of it while the pictures before it are drawn.
const AHEAD: usize = 12;

/// What keeps its place in the stream.
#[derive(Debug)]
enum Queued {
    /// Which the decoder has queued, too.
    Packet(gst::Buffer),
    Event(gst::Event),
}

/// If upstream takes longer than this for its next packet, it has none in store.
const IN_STORE: Duration = Duration::from_millis(5);

/// Why pictures should not wait for packets that come after theirs.
#[derive(Debug, Clone, Copy)]
pub(super) struct Urgency {
    /// Upstream is live: the next packet comes when its time has come.
    pub(super) live: bool,
    /// None has been shown since the start or a seek.
    pub(super) first: bool,
    /// When the last packet or event was done with.
    pub(super) asked: Option<Instant>,
}

impl Default for Urgency {
    fn default() -> Self {
        Self { live: false, first: true, asked: None }
    }
}

/// The state of one stream.
#[derive(Debug)]
pub(super) struct Stream {
    pub(super) segment: gst::FormattedSegment<ClockTime>,
    /// What caps or headers say; `None` before either came.
    pub(super) source: Option<Source>,
    /// Caps that must be negotiated anew before the next picture.
    pub(super) renegotiate: bool,
    /// The next picture follows a gap.
    pub(super) discont: bool,
    /// Packets were lost since the last picture that was decoded.
    pub(super) after_loss: bool,
    /// Pictures leave at once: packets come when they are made, or none has left since the start or a seek.
    pub(super) urgent: Urgency,
    /// Packets that wait, and events between them.
    queued: VecDeque<Queued>,
    /// A keyframe has been asked for since the last one came.
    keyframe_requested: bool,
    /// Packets that should have given a picture since the start or a flush.
    packets: u64,
    /// Packets that gave one.
    decoded: u64,
    decoder: Decoder,
    header: Option<SequenceHeader>,
    schedule: Schedule,
    gop: Gop,
    held: Vec<gst::Event>,
}

impl Stream {
    /// A stream that has not begun.
    pub(super) fn new(config: DecoderConfig) -> Self {
        Self {
            segment: gst::FormattedSegment::new(),
            source: None,
            renegotiate: true,
            discont: true,
            after_loss: false,
            urgent: Urgency::default(),
            queued: VecDeque::new(),
            keyframe_requested: false,
            packets: 0,
            decoded: 0,
            decoder: Decoder::new(config),
            header: None,
            schedule: Schedule::default(),
            gop: Gop::default(),
            held: Vec::new(),
        }
    }

    /// Forgets all that a flush ends: packets, pictures, the segment, and events of them that still wait. Hands out events that
    /// waited between packets, which are of the stream.
    pub(super) fn flush(&mut self) -> Vec<gst::Event> {
        self.segment = gst::FormattedSegment::new();
        self.discont = true;
        self.after_loss = false;
        self.urgent.first = true;
        let queued = std::mem::take(&mut self.queued);
        self.keyframe_requested = false;
        (self.packets, self.decoded) = (0, 0);
        self.decoder.flush();
        self.schedule.reset();
        self.gop.take();
        self.held.retain(|event| !matches!(event.type_(), gst::EventType::Segment | gst::EventType::Eos));
        let event = |queued| if let Queued::Event(event) = queued { Some(event) } else { None };
        queued.into_iter().filter_map(event).collect()
    }

    /// Takes new caps.
    pub(super) fn set_caps(&mut self, caps: &gst::CapsRef) {
        if let Some(source) = Source::from_caps(caps) {
            self.source = Some(source);
        }
        self.header = None;
        self.renegotiate = true;
    }

    /// Starts a new segment.
    pub(super) fn set_segment(&mut self, segment: gst::FormattedSegment<ClockTime>) {
        // A segment that goes on in the same direction continues its timeline (a loop without flush starts it anew).
        self.schedule.reset();
        self.segment = segment;
        self.urgent.first = true;
    }

    /// Sets the rate of the output.
    pub(super) fn set_output_rate(&mut self, framerate: gst::Fraction) {
        if let Some(source) = self.source {
            self.schedule.set_rates(source.framerate, framerate);
        }
    }

    pub(super) fn direction(&self) -> Direction {
        if self.segment.rate() < 0.0 { Direction::Reverse } else { Direction::Forward }
    }

    /// Whether only keyframes are wanted.
    pub(super) fn key_units_only(&self) -> bool {
        self.segment.flags().contains(gst::SegmentFlags::TRICKMODE_KEY_UNITS)
    }

    /// Keeps a packet for reverse playback; hands out the group that it ends.
    pub(super) fn gather(&mut self, packet: gst::Buffer) -> Vec<gst::Buffer> {
        self.gop.push(packet)
    }

    /// Hands out the packets gathered.
    pub(super) fn take_gathered(&mut self) -> Vec<gst::Buffer> {
        self.gop.take()
    }

    /// Queues a packet.
    pub(super) fn queue(&mut self, packet: gst::Buffer) {
        // What cannot be read is a packet without bytes, which is damaged.
        let data = packet.map_readable().map_or_else(|_| Vec::new(), |map| map.to_vec());
        self.decoder.queue_packet(data);
        self.queued.push_back(Queued::Packet(packet));
    }

    /// Queues an event behind the packets that wait.
    pub(super) fn queue_event(&mut self, event: gst::Event) {
        self.queued.push_back(Queued::Event(event));
    }

    /// The next event before which no packet waits.
    pub(super) fn next_event(&mut self) -> Option<gst::Event> {
        match self.queued.pop_front()? {
            Queued::Event(event) => Some(event),
            packet => {
                self.queued.push_front(packet);
                None
            }
        }
    }

    /// The oldest packet if more than `left` are queued, and what became of it. Events before it are passed over.
    pub(super) fn receive(&mut self, left: usize) -> Option<(gst::Buffer, Decoded)> {
        let packets = self.queued.iter().filter(|queued| matches!(queued, Queued::Packet(_))).count();
        if packets <= left {
            return None;
        }
        let packet = loop {
            if let Queued::Packet(packet) = self.queued.pop_front()? {
                break packet;
            }
        };
        let result = self.decoder.receive_packet()?;
        Some((packet, self.take(result)))
    }

    /// How many packets may wait behind `packet`, which has just come: none where its picture is waited for.
    pub(super) fn may_wait(&self, packet: &gst::BufferRef) -> usize {
        let Urgency { live, first, asked } = self.urgent;
        let end = packet.pts().and_then(|pts| pts.checked_add(packet.duration().unwrap_or(ClockTime::ZERO)));
        let is_before = matches!((end, self.segment.start()), (Some(end), Some(start)) if end <= start);
        let in_store = asked.is_some_and(|asked| asked.elapsed() <= IN_STORE);
        if live || (first && !is_before) || !in_store { 0 } else { AHEAD }
    }

    /// Notes that upstream is to go on.
    pub(super) fn done_with_input(&mut self) {
        self.urgent.asked = Some(Instant::now());
    }

    /// What the decoder made of a packet.
    fn take(&mut self, result: Result<PacketInfo, DecodeError>) -> Decoded {
        if !matches!(&result, Ok(info) if !info.picture) {
            self.packets += 1;
        }
        let waiting = matches!(result, Err(DecodeError::NoKeyframe));
        match result {
            Ok(info) if info.picture => {
                self.decoded += 1;
                if info.keyframe {
                    self.keyframe_requested = false;
                    self.follow_header();
                }
                Decoded::Picture(info.frame_number)
            }
            Ok(_) => Decoded::Nothing,
            Err(_) if waiting => Decoded::Waiting,
            Err(error) => Decoded::Damaged(error.to_string()),
        }
    }

    /// Whether there is a picture to show in place of a lost one: the stream goes forward, picture by picture, and one
    /// of this timeline was decoded.
    pub(super) fn can_conceal(&self) -> bool {
        self.decoded > 0 && self.direction() == Direction::Forward && !self.key_units_only()
    }

    /// Caps are believed before headers, as a container may know better; a header that changes in the middle, as where
    /// files were joined, is believed before old caps.
    fn follow_header(&mut self) {
        let header = self.decoder.header().copied();
        if header == self.header {
            return;
        }
        let joined = self.header.is_some();
        self.header = header;
        if joined || self.source.is_none() {
            self.source = header.as_ref().and_then(Source::from_header).or(self.source);
            self.renegotiate = true;
        }
    }

    /// Whether packets came but none could be decoded.
    pub(super) fn nothing_decoded(&self) -> bool {
        self.packets > 0 && self.decoded == 0
    }

    /// Whether a keyframe should be asked for; true once until one comes.
    pub(super) fn wants_keyframe(&mut self) -> bool {
        !std::mem::replace(&mut self.keyframe_requested, true)
    }

    /// Start and duration of a packet. Where it carries no stamps they follow from its frame number and the rate, or
    /// from the packet before where the number was lost.
    fn packet_time(&self, packet: &gst::BufferRef, frame_number: Option<u64>) -> (ClockTime, Option<ClockTime>) {
        let rate = self.source.map(|source| source.framerate).filter(|rate| rate.numer() > 0);
        let time_of = |frames: u64| {
            let rate = rate?;
            let unit = ClockTime::SECOND.nseconds().checked_mul(u64::try_from(rate.denom()).ok()?)?;
            let time = frames.mul_div_floor(unit, u64::try_from(rate.numer()).ok()?)?;
            (time < u64::MAX).then_some(ClockTime::from_nseconds(time))
        };
        let start = packet
            .pts()
            .or_else(|| time_of(frame_number?))
            .or_else(|| self.schedule.end())
            .or(self.segment.start())
            .unwrap_or(ClockTime::ZERO);
        (start, packet.duration().or_else(|| time_of(1)))
    }

    /// The time that a decoded packet covers.
    pub(super) fn admit(&mut self, packet: &gst::BufferRef, frame_number: Option<u64>) -> Span {
        let (start, duration) = self.packet_time(packet, frame_number);
        self.schedule.admit(start, duration, packet.flags().contains(gst::BufferFlags::DISCONT))
    }

    /// The times that the decoded packets of a group cover, which is shown backwards.
    pub(super) fn admit_group(&mut self, packets: &[(gst::Buffer, u64)]) -> Vec<Span> {
        let times: Vec<_> = packets.iter().map(|(packet, number)| self.packet_time(packet, Some(*number))).collect();
        self.schedule.admit_group(&times)
    }

    /// The next picture of a packet.
    pub(super) fn next_picture(&mut self, span: Span) -> Option<Picture> {
        let (direction, single) = (self.direction(), self.key_units_only());
        self.schedule.next(span, direction, single)
    }

    /// Draws a picture.
    pub(super) fn render(&mut self, params: &RenderParams, surface: &mut Surface<'_>) -> Result<(), DecodeError> {
        self.decoder.render_with(params, surface)
    }

    /// Keeps an event back until caps are sent.
    pub(super) fn hold(&mut self, event: gst::Event) {
        self.held.push(event);
    }

    /// Hands out the events kept back, in order.
    pub(super) fn take_held(&mut self) -> Vec<gst::Event> {
        std::mem::take(&mut self.held)
    }
}
