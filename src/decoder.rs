//! The decoder's door: packets in, pictures out.
//!
//! ```text
//! packets -> ahead: reader -> growth -> slab -> pictures
//! ```
//!
//! Forbidden here: files, clocks; the decoder also runs where there are none.

mod ahead;
mod reader;
mod slab;

use thiserror::Error;

use self::ahead::Ahead;
use self::reader::{Brought, Parsed};
use self::slab::Slab;
use crate::bitstream::{ParseError, SequenceHeader};
pub use crate::render::Viewport;
use crate::render::ViewportError;
use crate::video::Surface;

/// How a [`Decoder`] works.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecoderConfig {
    /// Levels of subdivision to draw with; `None`: as the stream says. A stream made for level 0 is always drawn so.
    pub subdivision_levels: Option<u8>,
    /// Whether edges between labels are drawn smooth; without, they are stairs of pixels.
    pub antialias: bool,
    /// Worker threads; 0: all cores. Pixels do not depend on it.
    pub threads: usize,
}

impl Default for DecoderConfig {
    fn default() -> Self {
        Self { subdivision_levels: None, antialias: true, threads: 0 }
    }
}

/// What a packet brought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PacketInfo {
    /// Number of the frame, counted from the start of the stream.
    pub frame_number: u64,
    /// Whether a new slab starts here.
    pub keyframe: bool,
    /// False for the index at the end of a stream.
    pub picture: bool,
}

/// Why a packet could not be decoded or a picture not be drawn.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum DecodeError {
    /// No keyframe has been seen since the start, a flush or a damaged packet: send packets until one is a keyframe.
    #[error("no keyframe yet: expected a keyframe packet first")]
    NoKeyframe,
    /// The packet is damaged, out of order or beyond the limits: go on with the next keyframe.
    #[error(transparent)]
    Packet(ParseError),
    /// The viewport cannot be drawn.
    #[error(transparent)]
    Viewport(#[from] ViewportError),
}

impl From<ParseError> for DecodeError {
    fn from(error: ParseError) -> Self {
        if error == ParseError::NoKeyframe { Self::NoKeyframe } else { Self::Packet(error) }
    }
}

/// Decodes packets of one stream and draws pictures at any size and time.
///
/// Packets are decoded where they are sent ([`Self::send_packet`]), or ahead: queued ([`Self::queue_packet`]), they are
/// decoded by threads that have nothing else to do, also while pictures are drawn, and taken one by one
/// ([`Self::receive_packet`]).
#[derive(Debug)]
pub struct Decoder {
    config: DecoderConfig,
    ahead: Ahead,
    header: Option<SequenceHeader>,
    /// What can be drawn.
    slab: Option<Slab>,
    /// What could be drawn before a flush, in case that its packets come again.
    flushed: Option<Slab>,
    /// Threads of our own; `None`: those of whoever calls.
    #[cfg(feature = "threads")]
    pool: ahead::Pool,
}

/// Which picture to draw.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct RenderParams {
    /// Frame number counted from the start of the stream; fractions lie between frames. It is clamped to the current
    /// slab, and to the frames whose packets have come.
    pub frame: f64,
    /// The part of the picture to draw; `None`: the whole.
    pub viewport: Option<Viewport>,
    /// Whether the control mesh's cross-section is drawn over the picture.
    pub mesh: bool,
}

impl Decoder {
    /// A decoder that waits for a keyframe.
    pub fn new(config: DecoderConfig) -> Self {
        Self {
            #[cfg(feature = "threads")]
            pool: thread_pool(config.threads),
            config,
            ahead: Ahead::new(),
            header: None,
            slab: None,
            flushed: None,
        }
    }

    /// The header of the last keyframe decoded.
    pub fn header(&self) -> Option<&SequenceHeader> {
        self.header.as_ref()
    }

    /// Decodes one packet. After an error every packet is refused with [`DecodeError::NoKeyframe`] until the next
    /// keyframe; pictures of what was decoded before can still be drawn. Packets that are queued are decoded and taken
    /// before, and their errors passed over.
    ///
    /// # Errors
    /// Damaged, missing or oversized data.
    pub fn send_packet(&mut self, data: &[u8]) -> Result<PacketInfo, DecodeError> {
        self.take_queued();
        let parsed = self.ahead.parse_now(data);
        self.take(parsed)
    }

    /// Queues a packet to be decoded behind those already queued, by the next thread that is free. What can be drawn
    /// stays as it is until the packet is taken with [`Self::receive_packet`].
    ///
    /// The queue has no end: how far ahead packets are queued is the caller's choice. Few are enough: a keyframe takes
    /// as long to decode as about ten others. Meshes of up to 64 MB (and one packet more) are decoded ahead.
    pub fn queue_packet(&mut self, data: Vec<u8>) {
        self.ahead.push(data);
        #[cfg(feature = "threads")]
        self.ahead.hurry(&self.pool);
    }

    /// Takes the oldest packet queued, once it is decoded: from then on its pictures can be drawn. `None` if none is
    /// queued.
    ///
    /// # Errors
    /// As of [`Self::send_packet`].
    pub fn receive_packet(&mut self) -> Option<Result<PacketInfo, DecodeError>> {
        let parsed = self.ahead.next()?;
        #[cfg(feature = "threads")]
        self.ahead.hurry(&self.pool);
        Some(self.take(parsed))
    }

    fn take_queued(&mut self) {
        while let Some(parsed) = self.ahead.next() {
            // Whoever wants to know receives it.
            let _ = self.take(parsed);
        }
    }

    /// Notes what a packet brought.
    fn take(&mut self, Parsed { packet, brought }: Parsed) -> Result<PacketInfo, DecodeError> {
        let packet = packet?;
        match brought {
            Some(Brought::Growth(growth)) => {
                self.flushed = None;
                let over = self.slab.take_if(|_| growth.is_whole);
                let slab = || Slab::new(growth.header, growth.first_frame, growth.tail.domain, over);
                self.slab.get_or_insert_with(slab).grow(growth);
            }
            Some(Brought::Again(progress)) => {
                if self.slab.is_none() {
                    self.slab = self.flushed.take();
                }
                if let Some(slab) = &mut self.slab {
                    slab.come_to(progress);
                }
            }
            None => (),
        }
        self.header = self.slab.as_ref().map(Slab::header);
        Ok(PacketInfo { frame_number: packet.frame_number, keyframe: packet.keyframe, picture: packet.picture })
    }

    /// Draws the picture at time `frame` (as of [`RenderParams::frame`]). `viewport` `None`: the whole picture.
    ///
    /// # Errors
    /// Nothing decoded yet, or an unusable viewport.
    pub fn render(
        &mut self,
        frame: f64,
        viewport: Option<Viewport>,
        surface: &mut Surface<'_>,
    ) -> Result<(), DecodeError> {
        self.render_with(&RenderParams { frame, viewport, mesh: false }, surface)
    }

    /// Draws a picture.
    ///
    /// # Errors
    /// Nothing decoded yet, or an unusable viewport.
    pub fn render_with(&mut self, params: &RenderParams, surface: &mut Surface<'_>) -> Result<(), DecodeError> {
        let slab = self.slab.as_mut().ok_or(DecodeError::NoKeyframe)?;
        let at = slab.prepare(&self.config, params);
        #[cfg(feature = "threads")]
        if let Some(pool) = &self.pool {
            return pool.install(|| slab.draw(&at, surface));
        }
        slab.draw(&at, surface)
    }

    /// Forgets what can be drawn and packets that are queued, and waits for a keyframe, and for a packet that is being
    /// decoded. If the keyframe is the one before the flush again, it and the packets behind it that were decoded before
    /// cost nothing: a seek back costs as much as drawing.
    pub fn flush(&mut self) {
        for parsed in self.ahead.flush() {
            // What it brought is part of what is flushed.
            let _ = self.take(parsed);
        }
        self.header = None;
        self.flushed = self.slab.take().or(self.flushed.take());
    }
}

/// A pool of so many threads; with 0, or where none can be made, the global one, which has a thread a core.
#[cfg(feature = "threads")]
fn thread_pool(threads: usize) -> ahead::Pool {
    if threads == 0 {
        return None;
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()
}
