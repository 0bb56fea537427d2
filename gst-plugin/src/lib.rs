//! GStreamer elements for tetvec vector video: `tetvecenc`, `tetvecdec`, `tetvecparse` and a typefinder.
//!
//! The elements map buffers and caps to the core's types, call its doors and hand results on. No knowledge of the
//! format, of meshes or of pixels lives here; what an element needs to know of a packet it asks the core.
#![expect(missing_docs, reason = "`plugin_define!` makes public items that cannot be documented here")]

use gst::glib;

mod caps;
mod dec;
mod enc;
mod parse;
mod typefind;

/// Keeps memory level over long clips (docs/benchmarks.md); what GStreamer allocates is not its business.
#[cfg(not(target_env = "msvc"))]
#[global_allocator]
static ALLOCATOR: tikv_jemallocator::Jemalloc = tikv_jemallocator::Jemalloc;

/// Most worker threads that an element can be told to start: a slip of the keyboard must not start thousands.
const MAX_THREADS: u32 = 1024;

fn plugin_init(plugin: &gst::Plugin) -> Result<(), glib::BoolError> {
    typefind::register(plugin)?;
    enc::register(plugin)?;
    parse::register(plugin)?;
    dec::register(plugin)
}

gst::plugin_define!(
    tetvec,
    env!("CARGO_PKG_DESCRIPTION"),
    plugin_init,
    env!("CARGO_PKG_VERSION"),
    "MPL-2.0",
    "tetvec",
    env!("CARGO_PKG_NAME"),
    env!("CARGO_PKG_NAME")
);
