//! The decoder's door: packets in, pictures out.
//!
//! Forbidden here: files, clocks; the decoder also runs where there are none.

use thiserror::Error;

use crate::bitstream::{Limits, ParseError, SequenceHeader, SlabParser};
pub use crate::render::Viewport;
use crate::render::{DrawParams, Scene, ViewportError};
use crate::video::Surface;

/// How a [`Decoder`] works.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DecoderConfig {
    /// Levels of subdivision to draw with; `None`: as the stream says.
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
#[derive(Debug)]
pub struct Decoder {
    config: DecoderConfig,
    parser: SlabParser,
    /// What of the parser's slab can be drawn.
    slab: Option<Slab>,
    /// Threads of our own; `None`: those of whoever calls.
    #[cfg(feature = "threads")]
    pool: Option<rayon::ThreadPool>,
}

/// The slab that is drawn.
#[derive(Debug)]
struct Slab {
    scene: Scene,
    /// Number of its first frame, counted from the start of the stream.
    first_frame: u64,
    /// The last time to draw, in frames since the slab's first: beyond it the mesh has not come yet.
    last_frame: f64,
}

impl Decoder {
    /// A decoder that waits for a keyframe.
    pub fn new(config: DecoderConfig) -> Self {
        Self {
            #[cfg(feature = "threads")]
            pool: thread_pool(config.threads),
            config,
            parser: SlabParser::new(Limits::default()),
            slab: None,
        }
    }

    /// The header of the last keyframe decoded.
    pub fn header(&self) -> Option<&SequenceHeader> {
        self.parser.header()
    }

    /// Decodes one packet. After an error every packet is refused with [`DecodeError::NoKeyframe`] until the next
    /// keyframe; pictures of what was decoded before can still be drawn.
    ///
    /// # Errors
    /// Damaged, missing or oversized data.
    pub fn send_packet(&mut self, data: &[u8]) -> Result<PacketInfo, DecodeError> {
        let packet = self.parser.parse_packet(data)?;
        if packet.picture {
            self.take_mesh(packet.keyframe);
        }
        Ok(PacketInfo { frame_number: packet.frame_number, keyframe: packet.keyframe, picture: packet.picture })
    }

    /// Lets the scene grow by what the last packet brought.
    fn take_mesh(&mut self, keyframe: bool) {
        let (Some(mesh), Some(first_frame)) = (self.parser.mesh(), self.parser.first_frame()) else { return };
        if keyframe {
            self.slab = None;
        }
        let slab =
            self.slab.get_or_insert_with(|| Slab { scene: Scene::new(mesh.domain), first_frame, last_frame: 0.0 });
        slab.scene.extend(mesh);
        slab.last_frame = if self.parser.is_ended() {
            f64::from(mesh.domain.duration)
        } else {
            f64::from(self.parser.frames_complete()) - slab.scene.time_step()
        };
    }

    /// Draws the picture at time `frame` (frame number counted from the start of the stream, fractions lie between
    /// frames) of the current slab; `frame` is clamped to the slab, and to the frames whose packets have come.
    /// `viewport` `None`: the whole picture.
    ///
    /// # Errors
    /// Nothing decoded yet, or an unusable viewport.
    pub fn render(
        &mut self,
        frame: f64,
        viewport: Option<Viewport>,
        surface: &mut Surface<'_>,
    ) -> Result<(), DecodeError> {
        let (Some(slab), Some(header)) = (&mut self.slab, self.parser.header()) else {
            return Err(DecodeError::NoKeyframe);
        };
        let levels = self.config.subdivision_levels.unwrap_or(header.subdivision_levels).min(MAX_LEVELS);
        let params = DrawParams { levels, antialias: self.config.antialias, viewport };
        let frame = (frame - slab.first_frame as f64).min(slab.last_frame);
        #[cfg(feature = "threads")]
        if let Some(pool) = &self.pool {
            return Ok(pool.install(|| slab.scene.draw(frame, &params, surface))?);
        }
        Ok(slab.scene.draw(frame, &params, surface)?)
    }

    /// Forgets everything and waits for a keyframe.
    pub fn flush(&mut self) {
        self.parser.flush();
        self.slab = None;
    }
}

/// Deepest subdivision drawn, as in the stream's header.
const MAX_LEVELS: u8 = 2;

/// A pool of so many threads; with 0, or where none can be made, the global one, which has a thread a core.
#[cfg(feature = "threads")]
fn thread_pool(threads: usize) -> Option<rayon::ThreadPool> {
    if threads == 0 {
        return None;
    }
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().ok()
}
