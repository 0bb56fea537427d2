//! The hop rule: which vertices' stars a packet completes (docs/architecture.md, "Packets and time").
//!
//! In: vertices as they are coded, and the edges around those whose stars are complete. Out: the next vertex whose
//! star to complete. Forbidden here: coding.
//!
//! Low vertices have hop 0; the others their distance from the low ones in edges. Vertices come out in the order of
//! their hops, each with its star still to be completed, so that hops up to [`rings`] are exact when a packet ends.

use std::collections::{BTreeMap, VecDeque};

use crate::mesh::VertexId;

/// Most rings that a stream can have.
pub(crate) const MAX_RINGS: u8 = 2;

/// Rings around the low vertices whose tets a packet brings: those that the masks of so many levels of subdivision
/// reach. Without subdivision the stars of the low vertices are all that a slice cuts.
pub(crate) fn rings(subdivision_levels: u8) -> u8 {
    if subdivision_levels == 0 { 0 } else { MAX_RINGS }
}

/// Pixels along a side of the cells of [`place`], as a power of two.
const CELL_BITS: u8 = 3;

/// Where a point of the picture is along a curve of Z-order through cells of some pixels: numbers of points near each other
/// mostly are, too.
pub(super) fn place([x, y]: [i32; 2], subpixel_bits: u8) -> u32 {
    let cell = |coordinate: i32| (coordinate.unsigned_abs() >> (subpixel_bits + CELL_BITS)).min(u16::MAX.into());
    let spread = |mut bits: u32| {
        for (shift, mask) in [(8, 0x00ff_00ff), (4, 0x0f0f_0f0f), (2, 0x3333_3333), (1, 0x5555_5555)] {
            bits = (bits | bits << shift) & mask;
        }
        bits
    };
    spread(cell(x)) | spread(cell(y)) << 1
}

/// A vertex not known to be within the rings.
const FAR: u8 = u8::MAX;

/// Hops of all coded vertices, and what to do next.
#[derive(Debug, Clone)]
pub(super) struct Hops {
    hop: Vec<u8>,
    /// [`rings`] of the stream.
    rings: u8,
    /// Vertices to visit, by hop.
    queues: [VecDeque<VertexId>; MAX_RINGS as usize + 1],
    /// Vertices that will be low in later packets, with their places, by frame.
    later: BTreeMap<u32, Vec<(u32, VertexId)>>,
    /// Frames below which a vertex is low.
    low_frames: u32,
}

impl Hops {
    pub(super) fn new(rings: u8) -> Self {
        let rings = rings.min(MAX_RINGS);
        Self { hop: Vec::new(), rings, queues: Default::default(), later: BTreeMap::new(), low_frames: 0 }
    }

    /// From here on vertices before frame `low_frames` are low. Those that were not come out by their places, in whatever
    /// packets they were coded, so that what lies next to each other is in the caches together.
    pub(super) fn begin_packet(&mut self, low_frames: u32) {
        self.low_frames = low_frames;
        let still_later = self.later.split_off(&low_frames);
        let mut risen: Vec<_> = std::mem::replace(&mut self.later, still_later).into_values().flatten().collect();
        risen.sort_unstable();
        for (_, vertex) in risen {
            self.lower(vertex, 0);
        }
    }

    /// Adds the next vertex, which lies in the frame `frame`: at its time or before the next frame's; and at this [`place`].
    pub(super) fn push_vertex(&mut self, frame: u32, place: u32) {
        let vertex = VertexId(self.hop.len() as u32);
        self.hop.push(FAR);
        if frame < self.low_frames {
            self.lower(vertex, 0);
        } else {
            self.later.entry(frame).or_default().push((place, vertex));
        }
    }

    /// The next vertex to complete, and its hop.
    pub(super) fn next(&mut self) -> Option<(VertexId, u8)> {
        for hop in 0..=self.rings {
            while let Some(vertex) = self.queues[hop as usize].pop_front() {
                // Otherwise it was lowered since, and has been visited with the lower hop.
                if self.hop[vertex.index()] == hop {
                    return Some((vertex, hop));
                }
            }
        }
        None
    }

    /// Whether a vertex with this hop has neighbours to tell.
    pub(super) fn goes_on(&self, hop: u8) -> bool {
        hop < self.rings
    }

    /// Whether `vertex` is within the rings.
    pub(super) fn is_near(&self, vertex: VertexId) -> bool {
        self.hop[vertex.index()] <= self.rings
    }

    /// Notes that `vertex` is at most `hop` edges away.
    pub(super) fn lower(&mut self, vertex: VertexId, hop: u8) {
        if hop <= self.rings && hop < self.hop[vertex.index()] {
            self.hop[vertex.index()] = hop;
            self.queues[hop as usize].push_back(vertex);
        }
    }

    /// Visits `vertex` once more, if it is near: its star has grown.
    pub(super) fn revisit(&mut self, vertex: VertexId) {
        if self.is_near(vertex) {
            self.queues[self.hop[vertex.index()] as usize].push_back(vertex);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_come_in_the_order_of_hops() {
        let mut hops = Hops::new(2);
        hops.begin_packet(1);
        for (place, frame) in [3, 0, 1, 0].into_iter().enumerate() {
            hops.push_vertex(frame, 9 - place as u32);
        }
        assert_eq!(hops.next(), Some((VertexId(1), 0)));
        hops.lower(VertexId(2), 1);
        hops.lower(VertexId(0), 3);
        assert_eq!(hops.next(), Some((VertexId(3), 0)));
        assert_eq!(hops.next(), Some((VertexId(2), 1)));
        assert_eq!(hops.next(), None);
        assert!(!hops.is_near(VertexId(0)));
        hops.begin_packet(u32::MAX);
        assert_eq!(hops.next(), Some((VertexId(2), 0)));
        assert_eq!(hops.next(), Some((VertexId(0), 0)));
        assert_eq!(hops.next(), None);
    }

    #[test]
    fn places_follow_the_curve() {
        // In pixels, at 3 sub-pixel bits.
        let at = |x: i32, y: i32| place([8 * x, 8 * y], 3);
        assert_eq!([at(0, 7), at(8, 0), at(0, 8), at(15, 15), at(16, 0), at(0, 16)], [0, 1, 2, 3, 4, 8]);
        assert_eq!(place([1 << 19; 2], 0), u32::MAX);
    }

    #[test]
    fn a_vertex_lowered_while_it_waits_is_visited_once() {
        let mut hops = Hops::new(2);
        hops.begin_packet(1);
        hops.push_vertex(5, 0);
        hops.lower(VertexId(0), 2);
        hops.lower(VertexId(0), 1);
        assert_eq!(hops.next(), Some((VertexId(0), 1)));
        assert_eq!(hops.next(), None);
    }
}
