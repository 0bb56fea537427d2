//! Why bytes could not be parsed, or a mesh not be written.

use thiserror::Error;

#[cfg(feature = "encode")]
use super::colors::ColorSteps;

/// A mesh that no slab may have. Found in bytes it means damage; found while writing, a fault of the caller's mesh.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum MeshFault {
    /// A tet is flat or inverted.
    #[error("tet {tet}: expected positive volume, found {volume6}/6")]
    NotPositive {
        /// Number of the tet in the order of the stream.
        tet: u32,
        /// Six times its signed volume, in cubic lattice units.
        volume6: i64,
    },
    /// A vertex lies outside the box.
    #[error("vertex {vertex}: expected inside the box, found {position:?}")]
    Outside {
        /// Number of the vertex in the order of the stream.
        vertex: u32,
        /// (x, y, t) in lattice units.
        position: [i32; 3],
    },
    /// Two tets lie on one side of a face.
    #[error("face {face:?}: expected one tet on each side, found two on one side")]
    DuplicateFace {
        /// Vertices of the face in the order of the stream.
        face: [u32; 3],
    },
    /// A face is declared to lie on t = duration, but cannot.
    #[error("end of the slab: expected t = {expected} lattice units, found {found}")]
    Top {
        /// A t that the end may have: that of all the slab knows.
        expected: i32,
        /// The t found.
        found: i32,
    },
    /// A reference to a vertex or a label that does not exist yet.
    #[error("{field}: expected less than {expected}, found {found}")]
    Reference {
        /// What is referred to.
        field: &'static str,
        /// How many there are.
        expected: u32,
        /// The reference.
        found: u32,
    },
    /// A value outside its range.
    #[error("{field}: expected {low} to {high}, found {found}")]
    Range {
        /// What the value is.
        field: &'static str,
        /// Least value allowed.
        low: i64,
        /// Largest value allowed.
        high: i64,
        /// The value.
        found: i64,
    },
    /// More of something than the limits allow.
    #[error("{field}: expected at most {limit}")]
    TooMany {
        /// What is counted.
        field: &'static str,
        /// The limit.
        limit: u32,
    },
    /// The entropy-coded payload ends before the mesh does.
    #[error("payload: expected more bytes")]
    PayloadEnd,
}

/// Why bytes could not be parsed. After any of these a [`super::SlabParser`] waits for the next keyframe.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum ParseError {
    /// The bytes do not start a packet: look for the next start with [`super::find_packet`].
    #[error("start of packet: expected the magic or a sync word, found {found:02x?}")]
    Start {
        /// The first bytes found.
        found: [u8; 4],
    },
    /// Another version of the format.
    #[error("version: expected {expected}, found {found}")]
    Version {
        /// The version that this parser reads.
        expected: u8,
        /// The version found.
        found: u8,
    },
    /// The packet header's checksum or flags are wrong: damage, or a start code by chance.
    #[error("packet header: expected check {expected:#06x}, found {found:#06x} with flags {flags:#04x}")]
    PacketHeader {
        /// The check over the bytes found.
        expected: u16,
        /// The check stored.
        found: u16,
        /// The flags found.
        flags: u8,
    },
    /// The packet's checksum is wrong.
    #[error("packet: expected CRC {expected:#010x}, found {found:#010x}")]
    Crc {
        /// The CRC of the bytes found.
        expected: u32,
        /// The CRC stored.
        found: u32,
    },
    /// More or fewer bytes than the syntax needs.
    #[error("{field}: expected {expected} bytes, found {found}")]
    Length {
        /// What is too short or too long.
        field: &'static str,
        /// Bytes needed.
        expected: usize,
        /// Bytes there.
        found: usize,
    },
    /// Something is larger than the [`super::Limits`].
    #[error("{field}: expected at most {limit}, found {found}")]
    TooLarge {
        /// What is too large.
        field: &'static str,
        /// The limit.
        limit: u64,
        /// The size found.
        found: u64,
    },
    /// A field of the sequence header or of the slab's parameters is out of its range.
    #[error("{field}: expected {expected}, found {found}")]
    Field {
        /// Name of the field.
        field: &'static str,
        /// What would be accepted.
        expected: String,
        /// What was found.
        found: String,
    },
    /// No keyframe has been parsed since the start or the last error.
    #[error("no keyframe yet: expected a keyframe packet first")]
    NoKeyframe,
    /// A packet is missing, or one too many.
    #[error("frame number: expected {expected}, found {found}")]
    FrameNumber {
        /// The number of the slab's next frame.
        expected: u64,
        /// The packet's number.
        found: u64,
    },
    /// The slab's last packet has been parsed already.
    #[error("slab: expected a keyframe after the last packet, found frame {found}")]
    AfterLast {
        /// The packet's number.
        found: u64,
    },
    /// The index is not in order, or points outside the stream.
    #[error("index entry {entry}: expected frames ascending and distances descending")]
    Index {
        /// Number of the entry.
        entry: usize,
    },
    /// The packet's mesh is no tiling.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
}

/// Why a slab could not be written. It cannot be continued then.
#[cfg(feature = "encode")]
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum WriteError {
    /// The sequence header is one that no parser would accept.
    #[error("sequence header: {0}")]
    Header(#[source] ParseError),
    /// The colours' steps are out of their range, or set after the first packet.
    #[error("color steps: expected a step of 1 to 128 and a size up to 63 before the first packet, found {found:?}")]
    ColorSteps {
        /// The steps.
        found: ColorSteps,
    },
    /// The mesh's box or lattice is not the header's.
    #[error("domain: expected {expected:?}, found {found:?}")]
    Domain {
        /// What the header says.
        expected: crate::mesh::Domain,
        /// The mesh's.
        found: crate::mesh::Domain,
    },
    /// The mesh has lost tets or vertices since the packet before.
    #[error("committed mesh: expected at least {expected} tets, found {found}")]
    NotAppended {
        /// Tets that there were.
        expected: usize,
        /// Tets that there are.
        found: usize,
    },
    /// A vertex has changed its place or its pin since a packet brought it.
    #[error("vertex {vertex}: expected it as sent, found it changed")]
    Changed {
        /// Number of the vertex in the mesh.
        vertex: u32,
    },
    /// The mesh's pins are not as many as its vertices.
    #[error("pins: expected {expected}, found {found}")]
    Pinned {
        /// Number of vertices.
        expected: usize,
        /// Number of pins.
        found: usize,
    },
    /// A tet's references or labels are wrong.
    #[error(transparent)]
    Tet(#[from] crate::mesh::MeshError),
    /// The mesh cannot be coded.
    #[error(transparent)]
    Mesh(#[from] MeshFault),
    /// The packet is longer than parsers accept.
    #[error("packet: expected at most {limit} bytes, found a body of {found}")]
    PacketBytes {
        /// The limit, framing included.
        limit: usize,
        /// Bytes of the body.
        found: usize,
    },
    /// A packet after the slab's last.
    #[error("slab: expected no packet after the last")]
    Ended,
}
