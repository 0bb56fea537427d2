//! The encoder's door: frames in, packets out. It knows the order of the stages and nothing of how they work.
//!
//! Frames are labelled as they come; every half window a step of `slab` builds lattice, simplifies, commits, fits
//! and writes (§VI). Slabs follow each other from keyframe to keyframe.

mod config;
mod observer;
mod proof;
mod quantize;
mod rate;
mod readiness;
mod runs;
mod slab;

use std::collections::VecDeque;
use std::sync::Arc;

use thiserror::Error;

pub use self::config::{EncoderConfig, ErrorMetric, LatticeKind, SpeedPreset, TopologyRule};
use self::observer::Observer;
pub use self::observer::{Event, Stage};
use self::rate::{ErrorControl, RateControl};
use self::slab::{ErrorModel, SlabEncoder, SlabEnd, WindowEncoder};
use crate::bitstream::{IndexWriter, Packet, SequenceHeader, WriteError};
use crate::vectorize::cleave::CleaveError;
use crate::vectorize::fit::FitError;
use crate::vectorize::lattice::LatticeError;
use crate::vectorize::segment::{SegmentParams, Segmenter};
use crate::vectorize::simplify::{ColorQuadric, DistanceQuadric};
use crate::video::Frame;

/// Most sides of pixels between labels by content over vertices: beyond it, as in moire, labels take time and show nothing. At 49
/// drawings still gain by theirs (docs/benchmarks.md).
const BORDER_A_VERTEX: f32 = 64.0;

/// Why the encoder refused.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum EncodeError {
    /// A setting is out of its range.
    #[error("{field}: expected {expected}, found {found}")]
    Setting {
        /// Name of the field of [`EncoderConfig`].
        field: &'static str,
        /// What would be accepted.
        expected: String,
        /// What was given.
        found: String,
    },
    /// A frame has another size than the encoder was made for.
    #[error("frame size: expected {expected:?}, found {found:?}")]
    FrameSize {
        /// Width and height configured.
        expected: (u32, u32),
        /// Width and height of the frame.
        found: (u32, u32),
    },
    /// `send_frame` after `finish`.
    #[error("send_frame: expected before finish, found after")]
    Finished,
    /// Pictures or labels do not make a lattice.
    #[error("lattice of the window: {0}")]
    Lattice(#[from] LatticeError),
    /// The window's lattice has too many elements; a shorter window has fewer.
    #[error("lattice of the window: {0}")]
    Cleave(#[from] CleaveError),
    /// The window's mesh could not be fitted.
    #[error("fit: {0}")]
    Fit(#[from] FitError),
    /// The slab cannot be drawn.
    #[error("proof: {0}")]
    Proof(#[from] crate::render::ViewportError),
    /// The slab's mesh could not be written.
    #[error("stream: {0}")]
    Write(#[from] WriteError),
    /// Worker threads could not be started.
    #[error("threads: {0}")]
    Threads(String),
}

/// Vectorises a video: [`Encoder::send_frame`] in, [`Encoder::receive_packet`] out, [`Encoder::finish`] at the end.
pub struct Encoder {
    config: EncoderConfig,
    /// The settings of the current slab: where bit rate or error decide, its ratio or its target are the slab's own.
    slab_config: EncoderConfig,
    rate: Option<RateControl>,
    error: Option<ErrorControl>,
    /// Bytes of the current slab so far.
    slab_bytes: u64,
    segmenter: Segmenter,
    slab: Option<Box<dyn WindowEncoder>>,
    next_frame: u64,
    ready: VecDeque<Packet>,
    index: IndexWriter,
    vertices: u64,
    error_model: ErrorModel,
    observer: Observer,
    finished: bool,
    #[cfg(feature = "threads")]
    pool: Option<rayon::ThreadPool>,
}

impl std::fmt::Debug for Encoder {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Encoder").field("config", &self.config).field("next_frame", &self.next_frame).finish()
    }
}

impl Encoder {
    /// Checks the settings and makes an encoder.
    ///
    /// # Errors
    /// [`EncodeError::Setting`] for a value out of range, [`EncodeError::Threads`] where no threads can be started.
    pub fn try_new(config: EncoderConfig) -> Result<Self, EncodeError> {
        config.validate()?;
        let most_border = BORDER_A_VERTEX * config.simplification_ratio as f32;
        let params = SegmentParams { most_border, ..SegmentParams::new(config.superpixels) };
        Ok(Self {
            segmenter: Segmenter::new(config.width, config.height, params),
            slab: None,
            next_frame: 0,
            ready: VecDeque::new(),
            index: IndexWriter::new(),
            vertices: 0,
            error_model: ErrorModel::default(),
            observer: Observer::default(),
            finished: false,
            slab_config: config.clone(),
            rate: RateControl::new(&config),
            error: ErrorControl::new(&config),
            slab_bytes: 0,
            #[cfg(feature = "threads")]
            pool: thread_pool(config.threads)?,
            config,
        })
    }

    /// Tells `observer` from now on what the encoder does.
    pub fn observe(&mut self, observer: impl FnMut(Event) + Send + 'static) {
        self.observer = Observer(Some(Box::new(observer)));
    }

    /// The settings.
    pub fn config(&self) -> &EncoderConfig {
        &self.config
    }

    /// The sequence header that every keyframe packet carries.
    pub fn header(&self) -> SequenceHeader {
        self.config.header()
    }

    /// Vertices of the control meshes of all slabs ended, a boundary vertex counted once.
    pub fn vertices(&self) -> u64 {
        self.vertices
    }

    /// Most frames that are held back before their packets come out.
    pub fn latency_frames(&self) -> u32 {
        slab::latency_frames(&self.config).min(self.config.slab_frames())
    }

    /// Takes the next frame; packets that became ready wait in [`Self::receive_packet`]. With `force_keyframe` a new
    /// slab starts at this frame.
    ///
    /// # Errors
    /// A frame of another size, or one after [`Self::finish`].
    pub fn send_frame(&mut self, frame: Frame, force_keyframe: bool) -> Result<(), EncodeError> {
        if self.finished {
            return Err(EncodeError::Finished);
        }
        let (expected, found) = ((self.config.width, self.config.height), (frame.width(), frame.height()));
        if expected != found {
            return Err(EncodeError::FrameSize { expected, found });
        }
        self.in_pool(|encoder| encoder.take_frame(Arc::new(frame), force_keyframe))
    }

    /// The next packet, if one is ready: one a frame, in order, then after [`Self::finish`] the index.
    pub fn receive_packet(&mut self) -> Option<Packet> {
        self.ready.pop_front()
    }

    /// Ends the stream: all frames' packets become ready, then one that holds the index.
    ///
    /// # Errors
    /// As [`Self::send_frame`]'s, from the frames still held.
    pub fn finish(&mut self) -> Result<(), EncodeError> {
        if std::mem::replace(&mut self.finished, true) {
            return Ok(());
        }
        self.in_pool(|encoder| encoder.end_slab(SlabEnd::Held))?;
        if self.next_frame > 0 {
            self.ready.push_back(self.index.finish()?);
        }
        Ok(())
    }

    fn take_frame(&mut self, frame: Arc<Frame>, force_keyframe: bool) -> Result<(), EncodeError> {
        if let Some(slab) = &self.slab {
            if self.segmenter.is_scene_cut(&frame) {
                self.end_slab(SlabEnd::Held)?;
            } else if force_keyframe || slab.planes() >= self.slab_config.slab_frames() {
                let labels = self.observer.stage(Stage::Segment, || self.segmenter.push(&frame));
                self.end_slab(SlabEnd::Joined(frame.clone(), labels))?;
            }
        }
        let is_new = self.slab.is_none();
        if is_new {
            self.segmenter.start_slab();
            if let Some(rate) = &self.rate {
                self.slab_config.simplification_ratio = rate.simplification_ratio();
            }
            if let Some(error) = &self.error {
                self.slab_config.target_error = error.target();
                self.slab_config.simplification_ratio = error.simplification_ratio();
            }
        }
        let labels = self.observer.stage(Stage::Segment, || self.segmenter.push(&frame));
        if is_new {
            self.slab = Some(self.new_slab(!labels.is_uniform())?);
        }
        self.next_frame += 1;
        if let Some(slab) = &mut self.slab {
            let packets = slab.push(frame, labels, &mut self.observer)?;
            self.queue(packets);
        }
        Ok(())
    }

    fn new_slab(&self, is_cut: bool) -> Result<Box<dyn WindowEncoder>, EncodeError> {
        let (config, header) = (&self.slab_config, self.slab_config.slab_header(is_cut));
        Ok(match config.error_metric {
            ErrorMetric::Color => {
                Box::new(SlabEncoder::<ColorQuadric>::try_new(config, header, self.next_frame, self.error_model)?)
            }
            ErrorMetric::Paper => {
                Box::new(SlabEncoder::<DistanceQuadric>::try_new(config, header, self.next_frame, self.error_model)?)
            }
        })
    }

    fn end_slab(&mut self, end: SlabEnd) -> Result<(), EncodeError> {
        if let Some(slab) = self.slab.take() {
            let frames = slab.planes();
            let finished = slab.finish(end, &mut self.observer)?;
            self.vertices += finished.vertices;
            self.error_model = finished.error_model;
            self.queue(finished.packets);
            let bytes = std::mem::take(&mut self.slab_bytes);
            if let Some(rate) = &mut self.rate {
                rate.end_slab(frames, finished.vertices, bytes);
            }
            if let (Some(control), Some(error)) = (&mut self.error, finished.error) {
                control.end_slab(frames, finished.vertices, error);
            }
        }
        Ok(())
    }

    fn queue(&mut self, packets: Vec<Packet>) {
        for packet in packets {
            self.index.push(&packet);
            self.slab_bytes += packet.data.len() as u64;
            self.ready.push_back(packet);
        }
    }

    #[cfg(feature = "threads")]
    fn in_pool<T: Send>(&mut self, work: impl FnOnce(&mut Self) -> T + Send) -> T {
        match self.pool.take() {
            Some(pool) => {
                let result = pool.install(|| work(self));
                self.pool = Some(pool);
                result
            }
            None => work(self),
        }
    }

    #[cfg(not(feature = "threads"))]
    fn in_pool<T>(&mut self, work: impl FnOnce(&mut Self) -> T) -> T {
        work(self)
    }
}

/// A pool of its own where the number of threads is given; the global one otherwise.
#[cfg(feature = "threads")]
fn thread_pool(threads: usize) -> Result<Option<rayon::ThreadPool>, EncodeError> {
    if threads == 0 {
        return Ok(None);
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Some).map_err(|error| EncodeError::Threads(error.to_string()))
}
