//! The decoder element: pads, properties, states, and the way of a packet to its pictures.
//!
//! Two locks: `stream` belongs to the streaming thread, `output` is what other threads reach too (flush, QoS). Neither
//! is held over a push, a query or an event, and never one inside the other.

use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

use gst::glib;
use gst::prelude::*;
use gst::subclass::prelude::*;
use tetvec::{DecoderConfig, EncoderConfig};

use super::CAT;
use super::negotiate;
use super::output::Output;
use super::qos::Qos;
use super::stream::{Decoded, Stream};
use super::view::View;
use crate::{MAX_THREADS, caps};

/// `subdivision-levels`: as the stream says.
const LEVELS_OF_STREAM: i32 = -1;

#[derive(Debug, Clone, Copy)]
struct Settings {
    subdivision_levels: i32,
    antialias: bool,
    threads: u32,
    view: View,
}

impl Default for Settings {
    fn default() -> Self {
        Self { subdivision_levels: LEVELS_OF_STREAM, antialias: true, threads: 0, view: View::default() }
    }
}

impl Settings {
    fn decoder_config(self) -> DecoderConfig {
        DecoderConfig {
            subdivision_levels: u8::try_from(self.subdivision_levels).ok(),
            antialias: self.antialias,
            threads: usize::try_from(self.threads).unwrap_or(0),
        }
    }
}

/// What other threads than the streaming thread reach.
#[derive(Debug, Default)]
pub(super) struct Shared {
    flushing: bool,
    pub(super) output: Option<Output>,
    pub(super) qos: Qos,
}

#[derive(Debug)]
pub struct TetvecDec {
    pub(super) sink_pad: gst::Pad,
    pub(super) src_pad: gst::Pad,
    settings: Mutex<Settings>,
    stream: Mutex<Stream>,
    shared: Mutex<Shared>,
}

impl TetvecDec {
    pub(super) fn lock_stream(&self) -> MutexGuard<'_, Stream> {
        self.stream.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub(super) fn lock_output(&self) -> MutexGuard<'_, Shared> {
        self.shared.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// What of the picture is to be shown now.
    pub(super) fn view(&self) -> View {
        self.lock_settings().view
    }

    fn lock_settings(&self) -> MutexGuard<'_, Settings> {
        self.settings.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Makes the streaming thread stop where it is, or lets it go on.
    pub(super) fn set_flushing(&self, flushing: bool) {
        let pool = {
            let mut shared = self.lock_output();
            shared.flushing = flushing;
            shared.qos.reset();
            shared.output.as_ref().map(|output| output.pool.clone())
        };
        if let Some(pool) = pool {
            pool.set_flushing(flushing);
        }
    }

    pub(super) fn check_flow(&self) -> Result<(), gst::FlowError> {
        if self.lock_output().flushing { Err(gst::FlowError::Flushing) } else { Ok(()) }
    }

    fn chain(&self, packet: gst::Buffer) -> Result<gst::FlowSuccess, gst::FlowError> {
        gst::log!(CAT, imp = self, "Packet {packet:?}");
        self.check_flow()?;
        let (group, left) = {
            let mut stream = self.lock_stream();
            if stream.key_units_only() && packet.flags().contains(gst::BufferFlags::DELTA_UNIT) {
                return Ok(gst::FlowSuccess::Ok);
            }
            if stream.segment.rate() < 0.0 {
                (Some(stream.gather(packet)), 0)
            } else {
                let left = stream.may_wait(&packet);
                stream.queue(packet);
                (None, left)
            }
        };
        let result = match group {
            Some(group) => self.play_group(group),
            None => self.show_queued(left),
        };
        self.lock_stream().done_with_input();
        result
    }

    /// Decodes a group first to last and shows it last to first.
    pub(super) fn play_group(&self, group: Vec<gst::Buffer>) -> Result<gst::FlowSuccess, gst::FlowError> {
        let mut packets = Vec::with_capacity(group.len());
        group.into_iter().for_each(|packet| self.lock_stream().queue(packet));
        loop {
            self.check_flow()?;
            let Some((packet, decoded)) = self.lock_stream().receive(0) else { break };
            if let Decoded::Picture(number) = self.judge(&packet, decoded) {
                packets.push((packet, number));
            }
        }
        let spans = self.lock_stream().admit_group(&packets);
        for (&span, (_, number)) in spans.iter().zip(&packets).rev() {
            self.show_all(Some(*number), span)?;
        }
        Ok(gst::FlowSuccess::Ok)
    }

    /// Tells the application of a damaged packet, asks for a keyframe, and finds out whether the loss can be concealed.
    pub(super) fn judge(&self, packet: &gst::BufferRef, decoded: Decoded) -> Decoded {
        match &decoded {
            Decoded::Picture(_) => {
                let mut stream = self.lock_stream();
                stream.discont |= std::mem::take(&mut stream.after_loss);
                return decoded;
            }
            Decoded::Nothing | Decoded::Concealed => return decoded,
            Decoded::Waiting => gst::debug!(CAT, imp = self, "Skipping up to the next keyframe: {packet:?}"),
            Decoded::Damaged(reason) => {
                gst::element_imp_warning!(
                    self,
                    gst::StreamError::Decode,
                    ("A packet is damaged, going on at the next keyframe"),
                    ["{reason}, at {}", packet.pts().display()]
                );
            }
        }
        let (request, conceal) = {
            let mut stream = self.lock_stream();
            stream.discont |= !std::mem::replace(&mut stream.after_loss, true);
            (stream.wants_keyframe(), stream.can_conceal())
        };
        if request {
            self.sink_pad.push_event(gst_video::UpstreamForceKeyUnitEvent::builder().all_headers(true).build());
        }
        if conceal { Decoded::Concealed } else { decoded }
    }

    /// Negotiates if downstream asked for it, or the stream changed.
    pub(super) fn negotiate_if_needed(&self) -> Result<(), gst::FlowError> {
        let changed = std::mem::take(&mut self.lock_stream().renegotiate);
        let asked = self.src_pad.check_reconfigure();
        if !changed && !asked {
            return Ok(());
        }
        self.negotiate().map_err(|error| {
            self.src_pad.mark_reconfigure();
            if self.lock_output().flushing {
                return gst::FlowError::Flushing;
            }
            error.log_with_object(&*self.obj());
            gst::FlowError::NotNegotiated
        })
    }

    fn negotiate(&self) -> Result<(), gst::LoggableError> {
        let source = self.lock_stream().source.ok_or_else(|| gst::loggable_error!(CAT, "No size is known yet"))?;
        let peer = self.src_pad.peer_query_caps(None);
        // The peer's order counts, so its caps come first.
        let allowed = peer.intersect_with_mode(&self.src_pad.pad_template_caps(), gst::CapsIntersectMode::First);
        let caps = negotiate::candidates(&allowed, source)
            .find(|caps| self.src_pad.peer_query_accept_caps(caps) || !self.src_pad.is_linked())
            .ok_or_else(|| gst::loggable_error!(CAT, "Downstream takes none of our caps: {peer}"))?;
        gst::debug!(CAT, imp = self, "Rendering {source:?} to {caps}");
        if self.src_pad.current_caps().as_ref() != Some(&caps) {
            self.src_pad.push_event(gst::event::Caps::new(&caps));
        }
        let output = Output::try_new(&self.src_pad, &caps)?;
        self.lock_stream().set_output_rate(output.info.fps());
        self.install(Some(output));
        self.push_held();
        Ok(())
    }

    /// Puts `output` in place of the one before, whose pool is closed.
    fn install(&self, output: Option<Output>) {
        let old = {
            let mut shared = self.lock_output();
            if let Some(new) = output.as_ref().filter(|_| shared.flushing) {
                new.pool.set_flushing(true);
            }
            std::mem::replace(&mut shared.output, output)
        };
        if let Some(old) = old {
            let _ = old.pool.set_active(false);
        }
    }
}

#[glib::object_subclass]
impl ObjectSubclass for TetvecDec {
    const NAME: &'static str = "GstTetvecDec";
    type Type = super::TetvecDec;
    type ParentType = gst::Element;

    fn with_class(class: &Self::Class) -> Self {
        let templates = class.pad_template("sink").zip(class.pad_template("src"));
        let (sink, src) = templates.expect("the class has both templates");
        let sink_pad = gst::Pad::builder_from_template(&sink)
            .chain_function(|_, parent, packet| {
                Self::catch_panic_pad_function(parent, || Err(gst::FlowError::Error), |this| this.chain(packet))
            })
            .event_function(|pad, parent, event| {
                Self::catch_panic_pad_function(parent, || false, |this| this.sink_event(pad, event))
            })
            .flags(gst::PadFlags::ACCEPT_TEMPLATE)
            .build();
        let src_pad = gst::Pad::builder_from_template(&src)
            .event_function(|pad, parent, event| {
                Self::catch_panic_pad_function(parent, || false, |this| this.src_event(pad, event))
            })
            .build();
        Self {
            sink_pad,
            src_pad,
            settings: Mutex::default(),
            stream: Mutex::new(Stream::new(DecoderConfig::default())),
            shared: Mutex::default(),
        }
    }
}

impl ObjectImpl for TetvecDec {
    fn properties() -> &'static [glib::ParamSpec] {
        static PROPERTIES: LazyLock<Vec<glib::ParamSpec>> = LazyLock::new(|| {
            let default = Settings::default();
            let mut properties = View::properties();
            properties.extend([
                glib::ParamSpecInt::builder("subdivision-levels")
                    .nick("Subdivision levels")
                    .blurb(concat!(
                        "Levels of subdivision to draw with: more is smoother and slower (-1 = as the stream says); ",
                        "a stream made for 0 levels has no more"
                    ))
                    .minimum(LEVELS_OF_STREAM)
                    .maximum(i32::from(*EncoderConfig::SUBDIVISION_LEVELS.end()))
                    .default_value(default.subdivision_levels)
                    .mutable_ready()
                    .build(),
                glib::ParamSpecBoolean::builder("antialias")
                    .nick("Anti-aliasing")
                    .blurb("Draw edges between labels smooth; without, they are stairs of pixels")
                    .default_value(default.antialias)
                    .mutable_ready()
                    .build(),
                glib::ParamSpecUInt::builder("threads")
                    .nick("Threads")
                    .blurb("Worker threads; pictures do not depend on it (0 = all cores)")
                    .maximum(MAX_THREADS)
                    .default_value(default.threads)
                    .mutable_ready()
                    .build(),
            ]);
            properties
        });
        &PROPERTIES
    }

    fn set_property(&self, _id: usize, value: &glib::Value, pspec: &glib::ParamSpec) {
        let mut settings = self.lock_settings();
        match pspec.name() {
            "subdivision-levels" => settings.subdivision_levels = value.get().expect("checked by GObject"),
            "antialias" => settings.antialias = value.get().expect("checked by GObject"),
            "threads" => settings.threads = value.get().expect("checked by GObject"),
            name => assert!(settings.view.set(name, value), "no property {name}"),
        }
    }

    fn property(&self, _id: usize, pspec: &glib::ParamSpec) -> glib::Value {
        let settings = self.lock_settings();
        match pspec.name() {
            "subdivision-levels" => settings.subdivision_levels.to_value(),
            "antialias" => settings.antialias.to_value(),
            "threads" => settings.threads.to_value(),
            name => settings.view.get(name).unwrap_or_else(|| unreachable!("no property {name}")),
        }
    }

    fn constructed(&self) {
        self.parent_constructed();
        let obj = self.obj();
        obj.add_pad(&self.sink_pad).expect("a new element has no pads");
        obj.add_pad(&self.src_pad).expect("a new element has no pads");
    }
}

impl GstObjectImpl for TetvecDec {}

impl ElementImpl for TetvecDec {
    fn metadata() -> Option<&'static gst::subclass::ElementMetadata> {
        static METADATA: LazyLock<gst::subclass::ElementMetadata> = LazyLock::new(|| {
            gst::subclass::ElementMetadata::new(
                "Vector video decoder",
                "Codec/Decoder/Video",
                "Renders tetvec vector video at any size and frame rate",
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
                template("sink", gst::PadDirection::Sink, &caps::packets().build()),
                template("src", gst::PadDirection::Src, &caps::pictures(tetvec::video::MAX_SURFACE_SIDE)),
            ]
        });
        &TEMPLATES
    }

    fn change_state(&self, transition: gst::StateChange) -> Result<gst::StateChangeSuccess, gst::StateChangeError> {
        match transition {
            gst::StateChange::ReadyToPaused => {
                let config = self.lock_settings().decoder_config();
                *self.lock_stream() = Stream::new(config);
                *self.lock_output() = Shared::default();
            }
            gst::StateChange::PausedToReady => self.set_flushing(true),
            _ => (),
        }
        let success = self.parent_change_state(transition)?;
        if transition == gst::StateChange::PausedToReady {
            self.install(None);
            *self.lock_stream() = Stream::new(DecoderConfig::default());
        }
        Ok(success)
    }
}
