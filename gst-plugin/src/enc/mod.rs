//! `tetvecenc`: raw pictures in, packets of vector video out.
//!
//! Pictures are copied on arrival, as they wait for a whole window. Forbidden here: knowledge of packets' contents.
use gst::glib;
use gst::prelude::*;

mod choices;
mod imp;
mod picture;
mod progress;
mod session;
mod settings;

use choices::{ErrorMetric, Lattice, SpeedPreset, Topology};

glib::wrapper! {
    /// Vectorizes video.
    pub struct TetvecEnc(ObjectSubclass<imp::TetvecEnc>) @extends gst_video::VideoEncoder, gst::Element, gst::Object, @implements gst::Preset;
}

pub(crate) fn register(plugin: &gst::Plugin) -> Result<(), glib::BoolError> {
    for choice in
        [SpeedPreset::static_type(), ErrorMetric::static_type(), Lattice::static_type(), Topology::static_type()]
    {
        choice.mark_as_plugin_api(gst::PluginAPIFlags::empty());
    }
    gst::Element::register(Some(plugin), "tetvecenc", gst::Rank::PRIMARY, TetvecEnc::static_type())
}
