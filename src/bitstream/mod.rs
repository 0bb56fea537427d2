//! The `.tetv` stream: headers, packets, entropy-coded meshes; `write_x` beside `parse_x` (docs/format.md).
//!
//! In: a slab's committed mesh (write), bytes (parse). Out: packets, meshes. Forbidden here: pixels, files, clocks,
//! threads, and any panic, unbounded allocation or endless loop that bytes could cause.

mod bits;
mod colors;
mod connectivity;
mod error;
mod extents;
mod framing;
mod front;
mod gate;
mod header;
mod hops;
mod index;
mod labels;
mod limits;
mod models;
mod near;
mod neighbours;
mod normals;
mod parser;
mod positions;
mod range_coder;
mod slab;
#[cfg(feature = "encode")]
mod source;
mod stars;
mod symbols;
mod vertices;
#[cfg(feature = "encode")]
mod writer;

pub use bits::{BitCounts, Part};
pub use colors::ColorSteps;
#[cfg(feature = "encode")]
pub use error::WriteError;
pub use error::{MeshFault, ParseError};
#[cfg(feature = "encode")]
pub(crate) use extents::{PARTS as EXTENT_PARTS, size_of};
pub use framing::{
    MAGIC, PacketHeader, SEQUENCE_HEADER_BYTES, SYNC, VERSION, find_packet, parse_packet_header, parse_sequence_header,
};
pub use header::{Fraction, SequenceHeader};
#[cfg(feature = "encode")]
pub(crate) use hops::{MAX_RINGS, rings};
#[cfg(feature = "encode")]
pub use index::IndexWriter;
pub use index::{Index, IndexEntry, TAIL_BYTES, index_length};
pub use limits::Limits;
pub use parser::SlabParser;
#[cfg(feature = "encode")]
pub use writer::SlabWriter;

/// One coded packet, framed, as it is stored and sent.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Packet {
    /// Number of the frame whose picture this packet completes, counted from the start of the stream. The index
    /// packet that ends a stream carries the number one past the last frame.
    pub frame_number: u64,
    /// Whether decoding can start here.
    pub keyframe: bool,
    /// False for the index that ends a stream: no picture belongs to it.
    pub picture: bool,
    /// Sync word to CRC.
    pub data: Vec<u8>,
}
