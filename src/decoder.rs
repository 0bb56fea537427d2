//! The decoder's door: packets in, pictures out.
//!
//! Forbidden here: files, clocks; the decoder also runs where there are none.

use thiserror::Error;

use crate::bitstream::{Limits, PacketHeader, ParseError, SequenceHeader, SlabParser};
pub use crate::render::Viewport;
use crate::render::{DrawParams, Scene, ViewportError};
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

/// The slab that is drawn.
#[derive(Debug)]
struct Slab {
    scene: Scene,
    /// Whether the mesh has grown since the scene took it in: packets on the way to a picture cost no more than parsing.
    is_behind: bool,
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
        let parsed = self.parser.parse_packet(data);
        self.take_packet(parsed)
    }

    fn take_packet(&mut self, parsed: Result<PacketHeader, ParseError>) -> Result<PacketInfo, DecodeError> {
        let packet = parsed?;
        if packet.picture {
            self.take_mesh(packet.keyframe);
        }
        Ok(PacketInfo { frame_number: packet.frame_number, keyframe: packet.keyframe, picture: packet.picture })
    }

    /// Notes what the last packet brought.
    fn take_mesh(&mut self, keyframe: bool) {
        let (Some(mesh), Some(first_frame)) = (self.parser.mesh(), self.parser.first_frame()) else { return };
        if keyframe {
            self.slab = None;
        }
        let slab = self.slab.get_or_insert_with(|| Slab {
            scene: Scene::new(mesh.domain),
            is_behind: true,
            first_frame,
            last_frame: 0.0,
        });
        slab.is_behind = true;
        slab.last_frame = if self.parser.is_ended() {
            f64::from(mesh.domain.duration)
        } else {
            f64::from(self.parser.frames_complete()) - slab.scene.time_step()
        };
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
        let (slab, params) = drawing(&self.config, &self.parser, &mut self.slab, params)?;
        #[cfg(feature = "threads")]
        if let Some(pool) = &self.pool {
            return pool.install(|| slab.draw(&params, surface));
        }
        slab.draw(&params, surface)
    }

    /// [`Self::render_with`], and at the same time, on another thread where there is one, [`Self::send_packet`] with the
    /// packet that comes next: the picture is one of before it.
    ///
    /// Returns what both would have returned.
    pub fn render_and_send(
        &mut self,
        params: &RenderParams,
        surface: &mut Surface<'_>,
        data: &[u8],
    ) -> (Result<(), DecodeError>, Result<PacketInfo, DecodeError>) {
        let (drawn, parsed) = match drawing(&self.config, &self.parser, &mut self.slab, params) {
            Err(error) => (Err(error), self.parser.parse_packet(data)),
            Ok((slab, params)) => {
                let (draw, parse) = (|| slab.draw(&params, surface), || self.parser.parse_packet(data));
                #[cfg(feature = "threads")]
                let both = match &self.pool {
                    Some(pool) => pool.install(|| rayon::join(draw, parse)),
                    None => rayon::join(draw, parse),
                };
                #[cfg(not(feature = "threads"))]
                let both = one_by_one(draw, parse);
                both
            }
        };
        (drawn, self.take_packet(parsed))
    }

    /// Forgets everything and waits for a keyframe.
    pub fn flush(&mut self) {
        self.parser.flush();
        self.slab = None;
    }
}

/// What is drawn of which slab; its scene is brought up to the mesh.
fn drawing<'a>(
    config: &DecoderConfig,
    parser: &SlabParser,
    slab: &'a mut Option<Slab>,
    params: &RenderParams,
) -> Result<(&'a mut Slab, DrawingAt), DecodeError> {
    let (Some(slab), Some(header), Some(mesh)) = (slab, parser.header(), parser.mesh()) else {
        return Err(DecodeError::NoKeyframe);
    };
    if std::mem::take(&mut slab.is_behind) {
        slab.scene.extend(mesh);
    }
    let levels = match (header.subdivision_levels, config.subdivision_levels) {
        // Its packets do not bring the stars that masks need.
        (0, _) => 0,
        (of_stream, wanted) => wanted.unwrap_or(of_stream).min(MAX_LEVELS),
    };
    let frame = (params.frame - slab.first_frame as f64).min(slab.last_frame);
    let RenderParams { viewport, mesh, .. } = *params;
    Ok((slab, DrawingAt { frame, params: DrawParams { levels, antialias: config.antialias, viewport, mesh } }))
}

/// A picture of a slab.
struct DrawingAt {
    /// Frames since the slab's first.
    frame: f64,
    params: DrawParams,
}

impl Slab {
    fn draw(&mut self, at: &DrawingAt, surface: &mut Surface<'_>) -> Result<(), DecodeError> {
        Ok(self.scene.draw(at.frame, &at.params, surface)?)
    }
}

#[cfg(not(feature = "threads"))]
fn one_by_one<A, B>(first: impl FnOnce() -> A, second: impl FnOnce() -> B) -> (A, B) {
    (first(), second())
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
