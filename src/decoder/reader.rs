//! What each packet brings, by itself: so the mesh that is drawn need not be the one that is being parsed.
//!
//! In: packets, in order. Out: what is new of the mesh with each. A slab whose packets come again after a flush, as in a
//! seek, is not parsed again: as far as they are the same bytes, all that they bring is known.

use crate::bitstream::{Limits, PacketHeader, ParseError, SequenceHeader, SlabParser, parse_packet_header};
use crate::mesh::{MeshCounts, TetMesh};

/// Bytes of a slab's packets that are kept, to know them again; of a longer slab none are.
const MOST_BYTES: usize = 16 << 20;

/// What a packet brought.
#[derive(Debug)]
pub(super) struct Parsed {
    pub(super) packet: Result<PacketHeader, ParseError>,
    /// Of a picture's packet that is sound.
    pub(super) brought: Option<Brought>,
}

/// What is new with a packet.
#[derive(Debug)]
pub(super) enum Brought {
    /// A part of the mesh.
    Growth(Growth),
    /// Nothing: the packet came before, and its slab is the one whose growth was handed out last.
    Again(Progress),
}

/// How far a slab has come.
#[derive(Debug, Clone, Copy)]
pub(super) struct Progress {
    /// Frames that the mesh is complete for.
    pub(super) frames: u32,
    /// The slab's duration in frames, with its last packet.
    pub(super) ended: Option<u32>,
}

/// How a slab grew.
#[derive(Debug)]
pub(super) struct Growth {
    /// Of the slab.
    pub(super) header: SequenceHeader,
    /// Number of the slab's first frame, counted from the start of the stream.
    pub(super) first_frame: u64,
    pub(super) progress: Progress,
    /// The ends of the mesh's arrays.
    pub(super) tail: TetMesh,
    /// Whether these are the whole arrays: a mesh begins.
    pub(super) is_whole: bool,
}

impl Parsed {
    /// Bytes of the mesh in it.
    pub(super) fn bytes(&self) -> usize {
        let Some(Brought::Growth(growth)) = &self.brought else { return 0 };
        let TetMesh { positions, pinned, wedges, tets, .. } = &growth.tail;
        size_of_val(&positions[..]) + size_of_val(&pinned[..]) + size_of_val(&wedges[..]) + size_of_val(&tets[..])
    }
}

/// A parser, and how much of its mesh was handed out.
#[derive(Debug)]
pub(super) struct Reader {
    parser: SlabParser,
    known: MeshCounts,
    /// The slab's packets so far; none after an error.
    packets: Vec<(Vec<u8>, PacketHeader)>,
    /// Of `packets`.
    bytes: usize,
    /// How many of them have come again, where the parser is ahead of what comes.
    again: Option<usize>,
}

impl Reader {
    /// Waits for a keyframe.
    pub(super) fn new() -> Self {
        Self {
            parser: SlabParser::new(Limits::default()),
            known: MeshCounts::default(),
            packets: Vec::new(),
            bytes: 0,
            again: None,
        }
    }

    /// From now on waits for a keyframe, which may be one that is known.
    pub(super) fn flush(&mut self) {
        if self.packets.is_empty() {
            self.go_back(0);
        } else {
            self.again = Some(0);
        }
    }

    /// Parses a packet, unless it is known.
    pub(super) fn read(&mut self, packet: Vec<u8>) -> Parsed {
        let Some(next) = self.again else { return self.parse(packet) };
        if let Some((bytes, header)) = self.packets.get(next)
            && *bytes == packet
        {
            let packet = *header;
            self.again = Some(next + 1).filter(|&next| next < self.packets.len());
            let ended = packet.last.then(|| self.parser.mesh().map_or(1, |mesh| mesh.domain.duration));
            let progress = Progress { frames: next as u32 + 1, ended };
            return Parsed { packet: Ok(packet), brought: Some(Brought::Again(progress)) };
        }
        if !is_index(&packet) {
            self.go_back(next);
        }
        self.parse(packet)
    }

    /// Takes the parser, which is ahead of what comes, back to where so many packets have come.
    fn go_back(&mut self, count: usize) {
        self.parser.flush();
        self.again = None;
        self.packets.truncate(count);
        for (packet, _) in &self.packets {
            // It was sound before.
            let _ = self.parser.parse_packet(packet);
        }
        // What comes next is part of another mesh than the one that was handed out.
        self.known = MeshCounts::default();
    }

    fn parse(&mut self, packet: Vec<u8>) -> Parsed {
        let result = self.parser.parse_packet(&packet);
        match &result {
            Ok(header) if header.picture => {
                if header.keyframe {
                    self.packets.clear();
                    self.bytes = 0;
                }
                let brought = self.growth(header).map(Brought::Growth);
                self.keep(packet, *header);
                Parsed { packet: result, brought }
            }
            Ok(_) => Parsed { packet: result, brought: None },
            Err(_) => {
                self.packets.clear();
                self.again = None;
                Parsed { packet: result, brought: None }
            }
        }
    }

    fn growth(&mut self, packet: &PacketHeader) -> Option<Growth> {
        if packet.keyframe {
            self.known = MeshCounts::default();
        }
        let (mesh, header) = (self.parser.mesh()?, *self.parser.header()?);
        let is_whole = self.known == MeshCounts::default();
        let tail = mesh.tail(self.known).to_mesh();
        self.known = mesh.counts();
        let ended = self.parser.is_ended().then_some(mesh.domain.duration);
        let progress = Progress { frames: self.parser.frames_complete(), ended };
        Some(Growth { header, first_frame: self.parser.first_frame()?, progress, tail, is_whole })
    }

    /// Keeps a packet, so that it is known when it comes again.
    fn keep(&mut self, packet: Vec<u8>, header: PacketHeader) {
        if self.packets.is_empty() && !header.keyframe {
            return;
        }
        self.bytes += packet.len();
        if self.bytes > MOST_BYTES {
            self.packets.clear();
        } else {
            self.packets.push((packet, header));
        }
    }
}

/// Whether a packet says that it is an index, which changes nothing.
fn is_index(packet: &[u8]) -> bool {
    matches!(parse_packet_header(packet, &Limits::default()), Ok(Some(header)) if !header.picture)
}
