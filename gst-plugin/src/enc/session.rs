//! One encoding, from caps to caps or end: the core's encoder, which of GStreamer's frames its packets belong to, and how
//! far it is.
//!
//! Forbidden here: pads, pushes. What is ready is handed out, so that the caller can push it without a lock.

use std::collections::VecDeque;

use gst::ClockTime;
use gst_video::prelude::*;
use tetvec::bitstream::Fraction;
use tetvec::{EncodeError, Encoder, EncoderConfig, Packet};

use super::imp::CAT;
use super::picture::Copier;
use super::progress::Progress;
use crate::caps;

/// Rate that the latency is counted with where the stream has none.
const UNKNOWN_RATE: Fraction = Fraction { numerator: 25, denominator: 1 };

/// A packet that is ready to leave.
#[derive(Debug)]
pub(super) enum Ready {
    /// The packet of a picture, and its frame's system number.
    Picture { packet: Packet, frame_number: u32 },
    /// The index of the stream; it belongs at `time`, after all pictures.
    Index { packet: Packet, time: Option<ClockTime> },
}

/// What is ready, and what to tell the application behind it, if it is time to.
#[derive(Debug)]
pub(super) struct Batch {
    pub(super) packets: Vec<Ready>,
    pub(super) report: Option<gst::Structure>,
}

/// An encoder at work.
#[derive(Debug)]
pub(super) struct Session {
    copier: Copier,
    encoder: Encoder,
    progress: Progress,
    /// System numbers of the frames whose packets have not come yet, in order.
    pending: VecDeque<u32>,
    /// Where the last frame ended.
    end: Option<ClockTime>,
}

impl Session {
    /// Starts encoding pictures of `info`.
    pub(super) fn try_new(settings: EncoderConfig, info: &gst_video::VideoInfo) -> Result<Self, gst::LoggableError> {
        let mut encoder = Encoder::try_new(EncoderConfig {
            width: info.width(),
            height: info.height(),
            frame_rate: caps::to_core(info.fps(), Fraction { numerator: 0, denominator: 1 }),
            pixel_aspect_ratio: caps::to_core(info.par(), Fraction { numerator: 1, denominator: 1 }),
            ..settings
        })
        .map_err(|error| gst::loggable_error!(CAT, "{error}"))?;
        let progress = Progress::of(&mut encoder);
        Ok(Self { copier: Copier::try_new(info)?, encoder, progress, pending: VecDeque::new(), end: None })
    }

    /// Caps of the packets.
    pub(super) fn caps(&self) -> gst::Caps {
        caps::of_stream(&self.encoder.header())
    }

    /// The longest time that a picture waits.
    pub(super) fn latency(&self) -> ClockTime {
        let rate = match self.encoder.header().frame_rate {
            rate if rate.numerator > 0 => rate,
            _ => UNKNOWN_RATE,
        };
        let frames = u64::from(self.encoder.latency_frames());
        (ClockTime::SECOND * u64::from(rate.denominator))
            .mul_div_ceil(frames, u64::from(rate.numerator))
            .unwrap_or(ClockTime::ZERO)
    }

    /// Takes a frame. Its picture is copied here, so its memory is free again.
    pub(super) fn send(&mut self, frame: &gst_video::VideoCodecFrame<'_>) -> Result<(), gst::LoggableError> {
        let buffer = frame.input_buffer().ok_or_else(|| gst::loggable_error!(CAT, "A frame without a picture"))?;
        let picture = self.copier.copy(buffer)?;
        let force = frame.flags().contains(gst_video::VideoCodecFrameFlags::FORCE_KEYFRAME);
        self.encoder.send_frame(picture, force).map_err(|error| gst::loggable_error!(CAT, "{error}"))?;
        self.progress.count_frame();
        self.pending.push_back(frame.system_frame_number());
        self.end = frame.pts().and_then(|start| start.checked_add(frame.duration().unwrap_or(ClockTime::ZERO)));
        Ok(())
    }

    /// Ends the stream: all packets become ready, the index last.
    pub(super) fn finish(&mut self) -> Result<(), EncodeError> {
        self.encoder.finish()
    }

    /// The packets that are ready, in order. A report comes with some of them: not too often, and with the last.
    pub(super) fn take_batch(&mut self) -> Batch {
        let packets = self.take_ready();
        let ended = matches!(packets.last(), Some(Ready::Index { .. }));
        let due = ended || (!packets.is_empty() && self.progress.is_due());
        let report = due.then(|| self.progress.report(self.encoder.vertices()));
        Batch { packets, report }
    }

    fn take_ready(&mut self) -> Vec<Ready> {
        let mut ready = Vec::new();
        while let Some(packet) = self.encoder.receive_packet() {
            if !packet.picture {
                ready.push(Ready::Index { packet, time: self.end });
            } else if let Some(frame_number) = self.pending.pop_front() {
                self.progress.count_packet();
                ready.push(Ready::Picture { packet, frame_number });
            }
        }
        ready
    }
}
