//! What each packet brings, by itself: so the mesh that is drawn need not be the one that is being parsed.

use crate::bitstream::{Limits, PacketHeader, ParseError, SequenceHeader, SlabParser};
use crate::mesh::{MeshCounts, TetMesh};

/// What a packet brought.
#[derive(Debug)]
pub(super) struct Parsed {
    pub(super) packet: Result<PacketHeader, ParseError>,
    /// Of a picture's packet that is sound.
    pub(super) growth: Option<Growth>,
}

/// How a slab grew.
#[derive(Debug)]
pub(super) struct Growth {
    /// Of the slab.
    pub(super) header: SequenceHeader,
    /// Number of the slab's first frame, counted from the start of the stream.
    pub(super) first_frame: u64,
    /// Frames of the slab that the mesh is complete for.
    pub(super) frames: u32,
    /// Whether this is the slab's last packet.
    pub(super) is_last: bool,
    /// The ends of the mesh's arrays.
    pub(super) tail: TetMesh,
}

impl Parsed {
    /// Bytes of the mesh in it.
    pub(super) fn bytes(&self) -> usize {
        self.growth.as_ref().map_or(0, |growth| {
            let TetMesh { positions, pinned, wedges, tets, .. } = &growth.tail;
            size_of_val(&positions[..]) + size_of_val(&pinned[..]) + size_of_val(&wedges[..]) + size_of_val(&tets[..])
        })
    }
}

/// A parser, and how much of its mesh was handed out.
#[derive(Debug)]
pub(super) struct Reader {
    parser: SlabParser,
    known: MeshCounts,
}

impl Reader {
    /// Waits for a keyframe.
    pub(super) fn new() -> Self {
        Self { parser: SlabParser::new(Limits::default()), known: MeshCounts::default() }
    }

    /// Parses a packet.
    pub(super) fn read(&mut self, packet: &[u8]) -> Parsed {
        let packet = self.parser.parse_packet(packet);
        let growth = packet.as_ref().ok().filter(|packet| packet.picture).and_then(|packet| self.growth(packet));
        Parsed { packet, growth }
    }

    fn growth(&mut self, packet: &PacketHeader) -> Option<Growth> {
        if packet.keyframe {
            self.known = MeshCounts::default();
        }
        let (mesh, header) = (self.parser.mesh()?, *self.parser.header()?);
        let tail = mesh.tail(self.known).to_mesh();
        self.known = mesh.counts();
        Some(Growth {
            header,
            first_frame: self.parser.first_frame()?,
            frames: self.parser.frames_complete(),
            is_last: self.parser.is_ended(),
            tail,
        })
    }
}
