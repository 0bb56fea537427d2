//! `tetvecparse`: bytes from anywhere in a stream in, whole packets with times and flags out.
//!
//! What a packet is, the core says; here it is only asked. Forbidden here: knowledge of packets' contents, decoding.
use std::sync::LazyLock;

use gst::glib;
use gst::prelude::*;

mod cut;
mod imp;
mod seek;
mod timeline;
mod times;

static CAT: LazyLock<gst::DebugCategory> = LazyLock::new(|| {
    gst::DebugCategory::new("tetvecparse", gst::DebugColorFlags::empty(), Some("Vector video parser"))
});

glib::wrapper! {
    /// Cuts a stream of vector video into packets.
    pub struct TetvecParse(ObjectSubclass<imp::TetvecParse>) @extends gst_base::BaseParse, gst::Element, gst::Object;
}

pub(crate) fn register(plugin: &gst::Plugin) -> Result<(), glib::BoolError> {
    gst::Element::register(Some(plugin), "tetvecparse", gst::Rank::PRIMARY, TetvecParse::static_type())
}
