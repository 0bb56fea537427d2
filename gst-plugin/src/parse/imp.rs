//! The parser element: the base class feeds bytes and seeks; packets, times and caps are set here.

use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use gst::glib;
use gst::prelude::*;
use gst::subclass::prelude::*;
use gst_base::prelude::*;
use gst_base::subclass::prelude::*;
use tetvec::SequenceHeader;
use tetvec::bitstream::{Limits, PacketHeader, parse_sequence_header};

use super::CAT;
use super::cut::{Cut, cut};
use super::seek;
use super::timeline::{ReadAt, Timeline};
use super::times::Follower;
use crate::caps;

/// What players show as the codec's name.
const CODEC_NAME: &str = "tetvec vector video";

#[derive(Debug, Default)]
struct State {
    /// Header of the last keyframe, or of the caps from upstream.
    header: Option<SequenceHeader>,
    /// The file's keyframes, where it can be read anywhere.
    timeline: Option<Timeline>,
    /// Whether a timeline was looked for.
    looked: bool,
    follower: Follower,
    /// Upstream sends times of its own, which are left as they are.
    timed_upstream: bool,
}

#[derive(Debug, Default)]
pub struct TetvecParse {
    state: Mutex<State>,
}

/// The file behind a pad in pull mode.
struct PulledFile<'a>(&'a gst::Pad);

impl ReadAt for PulledFile<'_> {
    fn read_at(&mut self, offset: u64, length: usize) -> Option<Vec<u8>> {
        let buffer = self.0.pull_range(offset, u32::try_from(length).ok()?).ok()?;
        buffer.map_readable().ok().map(|map| map.to_vec())
    }
}

impl TetvecParse {
    fn lock_state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the timeline of a file that can be read anywhere; once.
    fn look_for_timeline(&self) {
        let obj = self.obj();
        let pad = obj.sink_pad();
        if std::mem::replace(&mut self.lock_state().looked, true) || pad.mode() != gst::PadMode::Pull {
            return;
        }
        let Some(size) = pad.peer_query_duration::<gst::format::Bytes>() else { return };
        let Some(timeline) = Timeline::read(&mut PulledFile(pad), *size, &Limits::default()) else { return };
        gst::debug!(CAT, imp = self, "{} keyframes, {}", timeline.keyframes().len(), timeline.duration());
        obj.set_duration(timeline.duration(), 0);
        for keyframe in timeline.keyframes() {
            obj.add_index_entry(keyframe.offset, keyframe.time, true, true);
        }
        self.lock_state().timeline = Some(timeline);
    }

    /// Takes the header of a keyframe; caps are sent if it is new.
    fn set_header(&self, header: SequenceHeader) {
        if self.lock_state().header.replace(header) == Some(header) && self.obj().src_pad().has_current_caps() {
            return;
        }
        let caps = caps::of_stream(&header);
        gst::debug!(CAT, imp = self, "Stream of {caps}");
        let mut tags = gst::TagList::new();
        tags.make_mut().add::<gst::tags::VideoCodec>(&CODEC_NAME, gst::TagMergeMode::Replace);
        self.obj().merge_tags(Some(&tags), gst::TagMergeMode::Replace);
        self.obj().src_pad().push_event(gst::event::Caps::new(&caps));
        if let Some(rate) = caps::from_core(header.frame_rate).filter(|rate| rate.numer() > 0) {
            self.obj().set_frame_rate(rate, 0, 0);
        }
    }

    /// The packet at the front of `frame`; else the bytes to skip, after asking for as many as it takes.
    fn find_packet(&self, frame: &gst_base::BaseParseFrame) -> Result<Result<PacketHeader, u32>, gst::FlowError> {
        let map = frame.buffer().and_then(|buffer| buffer.map_readable().ok()).ok_or(gst::FlowError::Error)?;
        match cut(&map, self.obj().is_draining(), &Limits::default()) {
            Cut::Packet(packet) => Ok(self.accept(packet, &map).then_some(packet).ok_or(packet.length as u32)),
            Cut::Skip(bytes) => {
                gst::debug!(CAT, imp = self, "Skipping {bytes} bytes at {}", frame.offset());
                Ok(Err(u32::try_from(bytes).unwrap_or(u32::MAX)))
            }
            Cut::Need(bytes) => {
                self.obj().set_min_frame_size(u32::try_from(bytes).unwrap_or(u32::MAX));
                Ok(Err(0))
            }
        }
    }

    /// Whether a packet can be sent: nothing before the first keyframe, nor a keyframe whose header is damaged.
    fn accept(&self, packet: PacketHeader, bytes: &[u8]) -> bool {
        if !packet.keyframe {
            return self.lock_state().header.is_some();
        }
        match parse_sequence_header(bytes, &Limits::default()) {
            Ok(header) => {
                self.look_for_timeline();
                self.set_header(header);
                true
            }
            Err(error) => {
                gst::warning!(CAT, imp = self, "A keyframe is damaged: {error}");
                false
            }
        }
    }

    /// Start and length of a packet's frame.
    fn time_packet(&self, packet: &PacketHeader, offset: u64) -> Option<(gst::ClockTime, gst::ClockTime)> {
        let mut state = self.lock_state();
        let header = state.header?;
        match &state.timeline {
            Some(timeline) => timeline.span_of(offset, packet),
            None => state.follower.follow(packet, &header),
        }
    }
}

#[glib::object_subclass]
impl ObjectSubclass for TetvecParse {
    const NAME: &'static str = "GstTetvecParse";
    type Type = super::TetvecParse;
    type ParentType = gst_base::BaseParse;
}

impl ObjectImpl for TetvecParse {}

impl GstObjectImpl for TetvecParse {}

impl ElementImpl for TetvecParse {
    fn metadata() -> Option<&'static gst::subclass::ElementMetadata> {
        static METADATA: LazyLock<gst::subclass::ElementMetadata> = LazyLock::new(|| {
            gst::subclass::ElementMetadata::new(
                "Vector video parser",
                "Codec/Parser/Video",
                "Cuts tetvec vector video into packets, times them and finds keyframes",
                "The tetvec developers",
            )
        });
        Some(&METADATA)
    }

    fn pad_templates() -> &'static [gst::PadTemplate] {
        static TEMPLATES: LazyLock<Vec<gst::PadTemplate>> = LazyLock::new(|| {
            let template = |name, direction, caps: &gst::Caps| {
                gst::PadTemplate::new(name, direction, gst::PadPresence::Always, caps).expect("a valid template")
            };
            vec![
                template("sink", gst::PadDirection::Sink, &gst::Caps::new_empty_simple(caps::MEDIA_TYPE)),
                template("src", gst::PadDirection::Src, &caps::packets().build()),
            ]
        });
        &TEMPLATES
    }
}

impl BaseParseImpl for TetvecParse {
    fn start(&self) -> Result<(), gst::ErrorMessage> {
        *self.lock_state() = State::default();
        self.obj().set_min_frame_size(1);
        Ok(())
    }

    fn stop(&self) -> Result<(), gst::ErrorMessage> {
        *self.lock_state() = State::default();
        Ok(())
    }

    fn set_sink_caps(&self, caps: &gst::Caps) -> Result<(), gst::LoggableError> {
        // Known at once where a container keeps it; else the first keyframe tells.
        if let Some(header) = caps::header_of(caps) {
            self.set_header(header);
        }
        Ok(())
    }

    fn handle_frame(&self, mut frame: gst_base::BaseParseFrame) -> Result<(gst::FlowSuccess, u32), gst::FlowError> {
        let packet = match self.find_packet(&frame)? {
            Ok(packet) => packet,
            Err(skip) => return Ok((gst::FlowSuccess::Ok, skip)),
        };
        self.obj().set_min_frame_size(1);
        let length = u32::try_from(packet.length).map_err(|_| gst::FlowError::Error)?;
        let Some((start, duration)) = self.time_packet(&packet, frame.offset()) else {
            gst::warning!(CAT, imp = self, "Frame number {} cannot be right, skipping", packet.frame_number);
            return Ok((gst::FlowSuccess::Ok, length));
        };
        let timed = self.lock_state().timed_upstream;
        let buffer = frame.buffer_mut().ok_or(gst::FlowError::Error)?;
        if !timed || buffer.pts().is_none() {
            buffer.set_pts(start);
            buffer.set_dts(start);
            buffer.set_duration(duration);
        }
        if packet.keyframe {
            buffer.unset_flags(gst::BufferFlags::DELTA_UNIT);
        } else {
            buffer.set_flags(gst::BufferFlags::DELTA_UNIT);
        }
        if !packet.picture {
            buffer.set_flags(gst::BufferFlags::HEADER);
            frame.set_flags(gst_base::BaseParseFrameFlags::NO_FRAME);
        }
        self.obj().finish_frame(frame, length)?;
        Ok((gst::FlowSuccess::Ok, 0))
    }

    fn sink_event(&self, event: gst::Event) -> bool {
        match event.view() {
            gst::EventView::Segment(segment) => {
                self.lock_state().timed_upstream = segment.segment().format() == gst::Format::Time;
            }
            gst::EventView::FlushStop(_) => self.lock_state().follower.jump(),
            gst::EventView::StreamStart(_) => self.lock_state().follower = Follower::default(),
            _ => (),
        }
        self.parent_sink_event(event)
    }

    fn src_event(&self, event: gst::Event) -> bool {
        let snapped = match (event.view(), &self.lock_state().timeline) {
            (gst::EventView::Seek(seek), Some(timeline)) => seek::snap(seek, event.seqnum(), timeline.keyframes()),
            _ => None,
        };
        self.parent_src_event(snapped.unwrap_or(event))
    }
}
