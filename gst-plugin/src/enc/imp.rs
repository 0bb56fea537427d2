//! The encoder element: pads, properties, and the way of frames to the core and of packets to the pad.

use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use gst::glib;
use gst::prelude::*;
use gst::subclass::prelude::*;
use gst_video::prelude::*;
use gst_video::subclass::prelude::*;

use super::picture;
use super::session::{Batch, Ready, Session};
use super::settings::Settings;
use crate::caps;

pub(super) static CAT: LazyLock<gst::DebugCategory> =
    LazyLock::new(|| gst::DebugCategory::new("tetvecenc", gst::DebugColorFlags::empty(), Some("Vector video encoder")));

#[derive(Debug, Default)]
struct State {
    /// What pictures look like, since the last caps.
    info: Option<gst_video::VideoInfo>,
    /// The encoding at work; after a drain or a flush the next frame starts another.
    session: Option<Session>,
}

#[derive(Debug, Default)]
pub struct TetvecEnc {
    settings: Mutex<Settings>,
    state: Mutex<State>,
}

impl TetvecEnc {
    fn lock_settings(&self) -> MutexGuard<'_, Settings> {
        self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn lock_state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn start_session(&self, info: &gst_video::VideoInfo) -> Result<Session, gst::LoggableError> {
        let config = self.lock_settings().config();
        Session::try_new(config, info)
    }

    /// Hands a frame to the encoding at work, or to a new one, and takes what became ready.
    fn encode(&self, frame: &gst_video::VideoCodecFrame<'_>) -> Result<Batch, gst::LoggableError> {
        let mut state = self.lock_state();
        let mut session = match (state.session.take(), &state.info) {
            (Some(session), _) => session,
            (None, Some(info)) => self.start_session(info)?,
            (None, None) => return Err(gst::loggable_error!(CAT, "A frame before caps")),
        };
        session.send(frame)?;
        let batch = session.take_batch();
        state.session = Some(session);
        Ok(batch)
    }

    /// Ends the encoding at work, if any, and sends all that it still holds.
    fn drain(&self) -> Result<gst::FlowSuccess, gst::FlowError> {
        let Some(mut session) = self.lock_state().session.take() else { return Ok(gst::FlowSuccess::Ok) };
        session.finish().map_err(|error| {
            gst::element_imp_error!(self, gst::StreamError::Encode, ("Cannot end the stream"), ["{error}"]);
            gst::FlowError::Error
        })?;
        self.push(session.take_batch())
    }

    /// Sends packets and the report behind them; no lock may be held here.
    fn push(&self, batch: Batch) -> Result<gst::FlowSuccess, gst::FlowError> {
        for ready in batch.packets {
            match ready {
                Ready::Picture { packet, frame_number } => self.push_picture(packet, frame_number)?,
                Ready::Index { packet, time } => self.push_index(packet, time)?,
            };
        }
        if let Some(report) = batch.report {
            self.tell(report);
        }
        Ok(gst::FlowSuccess::Ok)
    }

    /// Tells the log and the application how far the encoding is.
    fn tell(&self, report: gst::Structure) {
        gst::info!(CAT, imp = self, "{report}");
        let obj = self.obj();
        let _ = obj.post_message(gst::message::Element::builder(report).src(&*obj).build());
    }

    fn push_picture(&self, packet: tetvec::Packet, frame_number: u32) -> Result<gst::FlowSuccess, gst::FlowError> {
        let obj = self.obj();
        let number = i32::try_from(frame_number).map_err(|_| gst::FlowError::Error)?;
        let Some(mut frame) = obj.frame(number) else {
            gst::warning!(CAT, imp = self, "Frame {frame_number} is gone, its packet is dropped");
            return Ok(gst::FlowSuccess::Ok);
        };
        if packet.keyframe {
            frame.set_flags(gst_video::VideoCodecFrameFlags::SYNC_POINT);
        }
        frame.set_output_buffer(gst::Buffer::from_mut_slice(packet.data));
        obj.finish_frame(frame)
    }

    /// Sends the index behind the last picture. It belongs to no frame, so the base class does not know of it.
    fn push_index(
        &self,
        packet: tetvec::Packet,
        time: Option<gst::ClockTime>,
    ) -> Result<gst::FlowSuccess, gst::FlowError> {
        let mut buffer = gst::Buffer::from_mut_slice(packet.data);
        let header = buffer.make_mut();
        header.set_pts(time);
        header.set_dts(time);
        header.set_flags(gst::BufferFlags::HEADER | gst::BufferFlags::DELTA_UNIT);
        self.obj().src_pad().push(buffer)
    }

    /// Puts an empty buffer with the same stamps and metas in place of a frame's picture, which has been copied: held
    /// for a window and more it would starve the pools of cameras and GPUs.
    fn release_picture(frame: &mut gst_video::VideoCodecFrame<'_>) {
        use gst::glib::translate::ToGlibPtr;
        let Some(input) = frame.input_buffer() else { return };
        let flags = gst::BufferCopyFlags::FLAGS | gst::BufferCopyFlags::TIMESTAMPS | gst::BufferCopyFlags::META;
        let Ok(empty) = input.copy_region(flags, ..0) else { return };
        let raw: *mut gst_video::ffi::GstVideoCodecFrame = frame.to_glib_none().0;
        // SAFETY: `frame` is borrowed exclusively and keeps `raw` valid; no reference into the old buffer lives on.
        // `gst_buffer_replace` gives up the reference to the old buffer and takes one of its own to the new.
        unsafe {
            gst::ffi::gst_buffer_replace(&raw mut (*raw).input_buffer, empty.as_mut_ptr());
        }
    }
}

#[glib::object_subclass]
impl ObjectSubclass for TetvecEnc {
    const NAME: &'static str = "GstTetvecEnc";
    type Type = super::TetvecEnc;
    type ParentType = gst_video::VideoEncoder;
    type Interfaces = (gst::Preset,);
}

impl ObjectImpl for TetvecEnc {
    fn properties() -> &'static [glib::ParamSpec] {
        static PROPERTIES: LazyLock<Vec<glib::ParamSpec>> = LazyLock::new(Settings::properties);
        &PROPERTIES
    }

    fn set_property(&self, _id: usize, value: &glib::Value, pspec: &glib::ParamSpec) {
        self.lock_settings().set(pspec.name(), value);
    }

    fn property(&self, _id: usize, pspec: &glib::ParamSpec) -> glib::Value {
        self.lock_settings().get(pspec.name())
    }
}

impl GstObjectImpl for TetvecEnc {}

impl PresetImpl for TetvecEnc {}

impl ElementImpl for TetvecEnc {
    fn metadata() -> Option<&'static gst::subclass::ElementMetadata> {
        static METADATA: LazyLock<gst::subclass::ElementMetadata> = LazyLock::new(|| {
            gst::subclass::ElementMetadata::new(
                "Vector video encoder",
                "Codec/Encoder/Video",
                "Vectorizes video to tetvec: a sparse mesh over space and time",
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
            let side = 1..=i32::try_from(tetvec::video::MAX_FRAME_SIDE).unwrap_or(i32::MAX);
            let sink = gst_video::VideoCapsBuilder::new()
                .format_list(picture::FORMATS)
                .width_range(side.clone())
                .height_range(side)
                .build();
            vec![
                template("sink", gst::PadDirection::Sink, &sink),
                template("src", gst::PadDirection::Src, &caps::packets().build()),
            ]
        });
        &TEMPLATES
    }
}

impl VideoEncoderImpl for TetvecEnc {
    fn stop(&self) -> Result<(), gst::ErrorMessage> {
        *self.lock_state() = State::default();
        Ok(())
    }

    fn set_format(
        &self,
        state: &gst_video::VideoCodecState<'static, gst_video::video_codec_state::Readable>,
    ) -> Result<(), gst::LoggableError> {
        // The base class does not drain at new caps.
        self.drain().map_err(|error| gst::loggable_error!(CAT, "Cannot drain: {error:?}"))?;
        let session = self.start_session(state.info())?;
        let (latency, caps) = (session.latency(), session.caps());
        *self.lock_state() = State { info: Some(state.info().clone()), session: Some(session) };

        let obj = self.obj();
        obj.set_latency(latency, latency);
        let output = obj
            .set_output_state(caps, Some(state))
            .map_err(|error| gst::loggable_error!(CAT, "Cannot set the output's caps: {error:?}"))?;
        obj.negotiate(output).map_err(|error| gst::loggable_error!(CAT, "Cannot negotiate: {error:?}"))
    }

    fn handle_frame(&self, mut frame: gst_video::VideoCodecFrame) -> Result<gst::FlowSuccess, gst::FlowError> {
        let batch = self.encode(&frame).map_err(|error| {
            gst::element_imp_error!(self, gst::StreamError::Encode, ("Cannot encode a frame"), ["{error:?}"]);
            gst::FlowError::Error
        })?;
        Self::release_picture(&mut frame);
        drop(frame);
        self.push(batch)
    }

    fn finish(&self) -> Result<gst::FlowSuccess, gst::FlowError> {
        self.drain()
    }

    fn flush(&self) -> bool {
        // What the core holds is lost; the next frame starts with a keyframe.
        self.lock_state().session = None;
        true
    }

    fn propose_allocation(&self, query: &mut gst::query::Allocation) -> Result<(), gst::LoggableError> {
        query.add_allocation_meta::<gst_video::VideoMeta>(None);
        self.parent_propose_allocation(query)
    }
}
