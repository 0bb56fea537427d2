//! Ids into the flat arrays of a mesh.

/// A vertex: one position, however many labels meet there.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct VertexId(pub u32);

/// A wedge: one label's share of a vertex, with a colour of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct WedgeId(pub u32);

impl VertexId {
    /// As an array index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}

impl WedgeId {
    /// As an array index.
    pub fn index(self) -> usize {
        self.0 as usize
    }
}
