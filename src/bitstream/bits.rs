//! Where the bits of a stream go.
//!
//! In: how far the range coder is, whenever a part of the mesh begins. Out: bits by part. Forbidden here: influence on
//! what is coded.

/// A part of the mesh that bits are spent on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Part {
    /// Which vertices make up tets.
    Connectivity,
    /// x and y of vertices, and pins.
    Space,
    /// t of vertices.
    Time,
    /// Labels of tets.
    Labels,
    /// Luma of wedges.
    Luma,
    /// Chroma of wedges.
    Chroma,
    /// Start codes, packet and sequence headers, checks, and what range coders lose at their ends.
    Framing,
}

impl Part {
    /// All parts, in the order in which [`BitCounts`] has them.
    pub const ALL: [Self; 7] =
        [Self::Connectivity, Self::Space, Self::Time, Self::Labels, Self::Luma, Self::Chroma, Self::Framing];

    /// What to print for it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Connectivity => "connectivity",
            Self::Space => "x, y, pins",
            Self::Time => "t",
            Self::Labels => "labels",
            Self::Luma => "luma",
            Self::Chroma => "chroma",
            Self::Framing => "framing",
        }
    }
}

/// Bits spent on each part; their sum is eight times the bytes counted.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct BitCounts([f64; Part::ALL.len()]);

impl BitCounts {
    /// Bits of one part: the information of its decisions, so fractions of a bit count.
    pub fn bits(&self, part: Part) -> f64 {
        self.0[part as usize]
    }

    /// All bits.
    pub fn total(&self) -> f64 {
        self.0.iter().sum()
    }

    pub(super) fn add(&mut self, part: Part, bits: f64) {
        self.0[part as usize] += bits;
    }
}

/// Counts the bits of one payload.
#[derive(Debug)]
pub(super) struct Tally<'a> {
    counts: &'a mut BitCounts,
    part: Part,
    since: f64,
}

impl<'a> Tally<'a> {
    pub(super) fn new(counts: &'a mut BitCounts) -> Self {
        Self { counts, part: Part::Connectivity, since: 0.0 }
    }

    /// `part` begins where the coder has spent `position` bits.
    pub(super) fn enter(&mut self, part: Part, position: f64) {
        self.counts.add(self.part, position - self.since);
        (self.part, self.since) = (part, position);
    }
}
