//! How much a stream may ask for.

/// Upper bounds on what is taken from a stream, checked before anything is allocated. The defaults hold a parsed slab
/// well under 1 GB and admit every stream that the encoder's default settings write up to 3840x2160.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Largest width in pixels.
    pub max_width: u32,
    /// Largest height in pixels.
    pub max_height: u32,
    /// Longest slab in frames.
    pub max_duration: u32,
    /// Vertices in a slab.
    pub max_vertices: u32,
    /// Wedges in a slab.
    pub max_wedges: u32,
    /// Tets in a slab.
    pub max_tets: u32,
    /// Labels in a slab.
    pub max_labels: u32,
    /// Bytes in a packet, framing included.
    pub max_packet_bytes: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_width: 16_384,
            max_height: 16_384,
            max_duration: 3_600,
            max_vertices: 3 << 19,
            max_wedges: 1 << 22,
            max_tets: 8 << 20,
            max_labels: 1 << 17,
            max_packet_bytes: 1 << 26,
        }
    }
}
