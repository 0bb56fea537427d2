//! `tetvecdec`: packets in, pictures out, at the size and the frame rate that downstream asks for.
//!
//! A plain element with its own segment, flush, QoS and caps handling: one packet may give no picture, one or many, and
//! in reverse a whole group of packets is kept, never its pictures. Forbidden here: knowledge of packets' contents.
use std::sync::LazyLock;

use gst::glib;
use gst::prelude::*;

mod events;
mod gop;
mod imp;
mod negotiate;
mod output;
mod qos;
mod show;
mod stream;
mod timing;
mod view;

static CAT: LazyLock<gst::DebugCategory> =
    LazyLock::new(|| gst::DebugCategory::new("tetvecdec", gst::DebugColorFlags::empty(), Some("Vector video decoder")));

glib::wrapper! {
    /// Renders vector video.
    pub struct TetvecDec(ObjectSubclass<imp::TetvecDec>) @extends gst::Element, gst::Object;
}

pub(crate) fn register(plugin: &gst::Plugin) -> Result<(), glib::BoolError> {
    gst::Element::register(Some(plugin), "tetvecdec", gst::Rank::PRIMARY, TetvecDec::static_type())
}
