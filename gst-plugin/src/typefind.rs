//! Recognizes files of vector video by their first bytes.

use gst::glib;
use tetvec::bitstream::MAGIC;

use crate::caps;

/// Ending of file names.
const EXTENSION: &str = "tetv";

pub(crate) fn register(plugin: &gst::Plugin) -> Result<(), glib::BoolError> {
    let stream = gst::Caps::new_empty_simple(caps::MEDIA_TYPE);
    let found = stream.clone();
    gst::TypeFind::register(
        Some(plugin),
        caps::MEDIA_TYPE,
        gst::Rank::PRIMARY,
        Some(EXTENSION),
        Some(&stream),
        move |find| {
            if find.peek(0, MAGIC.len() as u32) == Some(&MAGIC) {
                find.suggest(gst::TypeFindProbability::Maximum, &found);
            }
        },
    )
}
