//! Packets to the mesh of a slab.
//!
//! In: whole packets, in order. Out: the slab's mesh, growing. Forbidden here: rendering, and anything that bytes could
//! bring to panic, to loop or to allocate beyond the [`Limits`].

use glam::IVec3;

use super::bits::Tally;
use super::colors::{ColorSteps, Grains};
use super::connectivity::Apex;
use super::framing::{PacketHeader, parse_packet, parse_payload, read_u16, read_u32};
use super::header::check_field;
use super::hops::rings;
use super::models::{BitModel, SymbolModel};
use super::range_coder::{BitCoder, RangeDecoder};
use super::slab::{Side, Slab, SlabParams};
use super::{BitCounts, Limits, MeshFault, ParseError, Part, SequenceHeader};
use crate::mesh::{Domain, TetMesh, VertexId};

/// Parses the packets of a stream, one slab at a time.
#[derive(Debug)]
pub struct SlabParser {
    limits: Limits,
    state: State,
    /// Bits so far, if they are counted.
    bits: Option<BitCounts>,
}

#[derive(Debug)]
enum State {
    /// No keyframe yet.
    Empty,
    /// Within a slab.
    Open(Box<OpenSlab>),
    /// An error: what was complete before it is still there.
    Broken(Box<BrokenSlab>),
}

#[derive(Debug)]
struct OpenSlab {
    header: SequenceHeader,
    first_frame: u64,
    packets: u32,
    ended: bool,
    slab: Slab,
}

#[derive(Debug)]
struct BrokenSlab {
    header: SequenceHeader,
    first_frame: u64,
    packets: u32,
    mesh: TetMesh,
}

/// Bytes of the slab's duration in its last packet.
const DURATION_BYTES: usize = 4;

impl SlabParser {
    /// A parser that waits for a keyframe.
    pub fn new(limits: Limits) -> Self {
        Self { limits, state: State::Empty, bits: None }
    }

    /// Counts from now on where the bits of undamaged packets go; parsing takes a little longer.
    pub fn count_bits(&mut self) {
        self.bits.get_or_insert_default();
    }

    /// Bits of the packets parsed since [`Self::count_bits`].
    pub fn bits(&self) -> BitCounts {
        self.bits.unwrap_or_default()
    }

    /// Parses one whole packet. A keyframe starts a new slab; an index changes nothing.
    ///
    /// # Errors
    /// Damage, a missing packet, or more than the limits allow. From then on packets are refused with
    /// [`ParseError::NoKeyframe`] until a keyframe; [`Self::mesh`] keeps what was complete.
    pub fn parse_packet(&mut self, packet: &[u8]) -> Result<PacketHeader, ParseError> {
        let before = self.bits;
        let result = self.parse(packet);
        if result.is_err() {
            self.abandon();
            self.bits = before;
        } else if let (Some(before), Some(counts)) = (before, &mut self.bits) {
            let coded = counts.total() - before.total();
            counts.add(Part::Framing, 8.0 * packet.len() as f64 - coded);
        }
        result
    }

    fn parse(&mut self, packet: &[u8]) -> Result<PacketHeader, ParseError> {
        let (header, body) = parse_packet(packet, &self.limits)?;
        if header.keyframe {
            let (mut open, body) = OpenSlab::from_keyframe(&header, body, self.limits)?;
            if let Some(mesh) = self.mesh() {
                open.slab.reserve(mesh.counts());
            }
            open.parse_payload(&header, body, &self.limits, self.bits.as_mut())?;
            self.state = State::Open(Box::new(open));
        } else if header.picture {
            let State::Open(open) = &mut self.state else { return Err(ParseError::NoKeyframe) };
            let expected = open.first_frame.saturating_add(open.packets.into());
            if open.ended {
                return Err(ParseError::AfterLast { found: header.frame_number });
            }
            if header.frame_number != expected {
                return Err(ParseError::FrameNumber { expected, found: header.frame_number });
            }
            open.parse_payload(&header, body, &self.limits, self.bits.as_mut())?;
        }
        Ok(header)
    }

    /// Keeps only what is complete.
    fn abandon(&mut self) {
        self.state = match std::mem::replace(&mut self.state, State::Empty) {
            State::Open(open) => {
                let OpenSlab { header, first_frame, packets, slab, .. } = *open;
                State::Broken(Box::new(BrokenSlab { header, first_frame, packets, mesh: slab.into_complete_mesh() }))
            }
            other => other,
        };
    }

    /// The current slab's mesh, append-only from packet to packet. Its duration is provisional until the end of the
    /// slab is near, which is known before it matters to [`Self::frames_complete`]: the least that exceeds every t.
    pub fn mesh(&self) -> Option<&TetMesh> {
        match &self.state {
            State::Empty => None,
            State::Open(open) => Some(open.slab.mesh()),
            State::Broken(broken) => Some(&broken.mesh),
        }
    }

    /// The header of the current slab's keyframe.
    pub fn header(&self) -> Option<&SequenceHeader> {
        match &self.state {
            State::Empty => None,
            State::Open(open) => Some(&open.header),
            State::Broken(broken) => Some(&broken.header),
        }
    }

    /// How coarse the current slab's colours are; unknown after damage.
    pub fn color_steps(&self) -> Option<ColorSteps> {
        match &self.state {
            State::Open(open) => Some(open.slab.color_steps()),
            State::Empty | State::Broken(_) => None,
        }
    }

    /// Number of the current slab's first frame, counted from the start of the stream.
    pub fn first_frame(&self) -> Option<u64> {
        match &self.state {
            State::Empty => None,
            State::Open(open) => Some(open.first_frame),
            State::Broken(broken) => Some(broken.first_frame),
        }
    }

    /// Frames n of the current slab that the mesh is complete for: any t in [0, n) can be rendered, and any t at all
    /// once [`Self::is_ended`].
    pub fn frames_complete(&self) -> u32 {
        match &self.state {
            State::Empty => 0,
            State::Open(open) => open.packets,
            State::Broken(broken) => broken.packets,
        }
    }

    /// Whether the slab's last packet has been parsed: its mesh tiles the whole box, and its duration is final.
    pub fn is_ended(&self) -> bool {
        matches!(&self.state, State::Open(open) if open.ended)
    }

    /// Whether the slab's duration is known: from the first tet at its end, or from its last packet.
    pub fn is_duration_known(&self) -> bool {
        matches!(&self.state, State::Open(open) if open.slab.is_duration_known())
    }

    /// Forgets everything and waits for a keyframe.
    pub fn flush(&mut self) {
        self.state = State::Empty;
    }
}

impl OpenSlab {
    /// Parses what a keyframe's body begins with. Returns the rest, too.
    fn from_keyframe<'a>(
        packet: &PacketHeader,
        body: &'a [u8],
        limits: Limits,
    ) -> Result<(Self, &'a [u8]), ParseError> {
        let length = |expected| ParseError::Length { field: "keyframe", expected, found: body.len() };
        if body.len() < 2 {
            return Err(length(2));
        }
        let header_end = 2 + usize::from(read_u16(body, 0));
        let Some(&[step, size]) = body.get(header_end..header_end + 2) else { return Err(length(header_end + 2)) };
        let header = SequenceHeader::from_bytes(&body[2..header_end], &limits)?;
        for (field, found, [low, high]) in
            [("color step", step, ColorSteps::STEPS), ("color size", size, ColorSteps::SIZES)]
        {
            check_field(field, found.into(), low.into()..=high.into())?;
        }
        let slab = Slab::new(SlabParams {
            domain: Domain {
                width: header.width,
                height: header.height,
                duration: 1,
                subpixel_bits: header.subpixel_bits,
            },
            max_duration: header.max_duration(&limits),
            color_steps: ColorSteps { step, size },
            rings: rings(header.subdivision_levels),
            limits,
        });
        let open = Self { header, first_frame: packet.frame_number, packets: 0, ended: false, slab };
        Ok((open, &body[header_end + 2..]))
    }

    /// Parses the part of the body that every packet of a slab has.
    fn parse_payload(
        &mut self,
        packet: &PacketHeader,
        body: &[u8],
        limits: &Limits,
        counts: Option<&mut BitCounts>,
    ) -> Result<(), ParseError> {
        let mut payload = body;
        if packet.last {
            let Some((duration, rest)) = body.split_at_checked(DURATION_BYTES) else {
                let found = body.len();
                return Err(ParseError::Length { field: "duration", expected: DURATION_BYTES, found });
            };
            self.slab.end_at(read_u32(duration, 0))?;
            payload = rest;
        }
        if self.packets >= self.header.max_duration(limits) {
            let limit = self.header.max_duration(limits).into();
            return Err(ParseError::TooLarge { field: "frames in a slab", limit, found: u64::from(self.packets) + 1 });
        }
        let mut side = Parsing { decoder: RangeDecoder::new(parse_payload(payload)?), tally: counts.map(Tally::new) };
        self.slab.code_packet(&mut side, if packet.last { u32::MAX } else { self.packets + 1 })?;
        side.enter(Part::Connectivity);
        let unread = side.decoder.unread();
        if unread > 0 {
            let (expected, found) = (payload.len() - unread, payload.len());
            return Err(ParseError::Length { field: "payload", expected, found });
        }
        self.slab.keep();
        self.packets += 1;
        self.ended = packet.last;
        Ok(())
    }
}

/// The parser's side of the syntax: decisions come from bytes, and nothing is known beforehand.
struct Parsing<'a> {
    decoder: RangeDecoder<'a>,
    tally: Option<Tally<'a>>,
}

impl BitCoder for Parsing<'_> {
    #[inline]
    fn bit(&mut self, model: &mut BitModel, bit: bool) -> bool {
        self.decoder.bit(model, bit)
    }

    #[inline]
    fn symbol(&mut self, model: &mut SymbolModel, symbol: usize) -> usize {
        self.decoder.symbol(model, symbol)
    }

    #[inline]
    fn raw(&mut self, count: u32, value: u32) -> u32 {
        self.decoder.raw(count, value)
    }

    fn enter(&mut self, part: Part) {
        if let Some(tally) = &mut self.tally {
            tally.enter(part, self.decoder.position());
        }
    }
}

impl Side for Parsing<'_> {
    fn seed(&mut self) -> bool {
        false
    }

    fn behind(&mut self, _: u32, _: VertexId, _: [VertexId; 3]) -> Apex {
        Apex::New
    }

    fn seed_corner(&mut self, _: usize) -> Option<VertexId> {
        None
    }

    fn new_vertex(&self) -> Option<(IVec3, bool)> {
        None
    }

    fn vertex_coded(&mut self, _: VertexId) {}

    fn is_uniform(&self) -> bool {
        false
    }

    fn has_pins(&self) -> bool {
        false
    }

    fn label(&mut self, _: u32) -> u32 {
        0
    }

    fn wedge_made(&mut self, _: VertexId) {}

    fn color(&self, _: usize, _: i32) -> Grains {
        [0; 3]
    }

    fn tet_coded(&mut self) {}

    fn check(&self) -> Result<(), MeshFault> {
        if self.decoder.is_exhausted() { Err(MeshFault::PayloadEnd) } else { Ok(()) }
    }
}
