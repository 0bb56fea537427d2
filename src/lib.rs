//! Vector video: raster frames in, a sparse tetrahedral mesh over (x, y, t) out, and back to raster at any size.
//!
//! ```text
//! frames -> segment -> lattice -> cleave -> simplify -> fit -> bitstream::write -> packet
//! packet -> bitstream::parse -> subdivide -> slice -> fill -> frames
//! ```
//!
//! The two doors, [`encoder`] and [`decoder`], alone know the order of the stages; stages never call each other. A
//! video through both (`examples/ten_lines.rs`):
//!
#![cfg_attr(feature = "encode", doc = "```")]
#![cfg_attr(not(feature = "encode"), doc = "```ignore")]
#![doc = include_str!("../examples/ten_lines.rs")]
//! ```
#![deny(unsafe_code)]

pub mod bitstream;
pub mod decoder;
#[cfg(feature = "encode")]
pub mod encoder;
pub mod mesh;
pub mod metrics;
pub mod render;
#[cfg(feature = "encode")]
pub mod vectorize;
pub mod video;

pub use bitstream::{Packet, SequenceHeader};
pub use decoder::{DecodeError, Decoder, DecoderConfig, PacketInfo, RenderParams, Viewport};
#[cfg(feature = "encode")]
pub use encoder::{
    EncodeError, Encoder, EncoderConfig, ErrorMetric, Event, LatticeKind, SpeedPreset, Stage, TopologyRule,
};
pub use video::{Frame, PixelFormat, Plane, Surface, YuvMatrix};
