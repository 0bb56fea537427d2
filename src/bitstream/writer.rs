//! The mesh of a slab to packets.
//!
//! In: the slab's committed mesh, once a packet. Out: packets, one a frame. Forbidden here: choosing keyframes, or
//! changing the mesh.

use super::colors::ColorSteps;
use super::framing::{PacketHeader, write_packet, write_payload};
use super::hops::rings;
use super::slab::{Slab, SlabParams};
use super::source::{Source, Writing};
use super::{Limits, Packet, SequenceHeader, WriteError};
use crate::mesh::{Domain, TetMesh};

/// Writes the packets of one slab.
#[derive(Debug)]
pub struct SlabWriter {
    header: SequenceHeader,
    first_frame: u64,
    color_steps: ColorSteps,
    packets: u32,
    ended: bool,
    source: Source,
    /// Made with the first packet, whose mesh decides the metric.
    slab: Option<Slab>,
}

impl SlabWriter {
    /// A writer for the slab whose first frame is number `first_frame` of the stream.
    ///
    /// # Errors
    /// A header that no parser would accept.
    pub fn try_new(header: SequenceHeader, first_frame: u64) -> Result<Self, WriteError> {
        header.check(&Limits::default()).map_err(WriteError::Header)?;
        Ok(Self {
            header,
            first_frame,
            color_steps: ColorSteps::default(),
            packets: 0,
            ended: false,
            source: Source::new(),
            slab: None,
        })
    }

    /// Quantises the slab's colours this coarsely; without, in steps of two levels.
    ///
    /// # Errors
    /// Numbers out of range, or after the first packet.
    pub fn set_color_steps(&mut self, color_steps: ColorSteps) -> Result<(), WriteError> {
        if self.slab.is_some() || !color_steps.is_valid() {
            return Err(WriteError::ColorSteps { found: color_steps });
        }
        self.color_steps = color_steps;
        Ok(())
    }

    /// Writes the packet of the slab's next frame k (0, 1, ...), after which [k, k + 1) can be rendered.
    ///
    /// `mesh` is the slab's committed mesh. Between calls it may only grow; positions and pins of vertices and colours
    /// of wedges that no packet has brought may still change. It must hold all tets with a vertex before t = k + 1,
    /// in streams with subdivision also those with one within two edges of these, and `mesh.domain.duration` must be final, or greater than every t in the mesh. With
    /// `last` it must be the whole slab with its final duration, and all that is left goes out.
    ///
    /// # Errors
    /// A mesh that does not fit this contract. The slab cannot be continued then.
    pub fn write_packet(&mut self, mesh: &TetMesh, last: bool) -> Result<Packet, WriteError> {
        if self.ended {
            return Err(WriteError::Ended);
        }
        self.check_domain(mesh)?;
        self.source.update(mesh)?;
        let mut body = Vec::new();
        if self.slab.is_none() {
            let header = self.header.to_bytes();
            body.extend_from_slice(&(header.len() as u16).to_le_bytes());
            body.extend_from_slice(&header);
            body.extend([self.color_steps.step, self.color_steps.size]);
        }
        let header = self.header;
        let slab = self.slab.get_or_insert_with(|| {
            Slab::new(SlabParams {
                domain: mesh.domain,
                max_duration: header.max_duration(&Limits::default()),
                color_steps: self.color_steps,
                rings: rings(header.subdivision_levels),
                limits: Limits::default(),
            })
        });
        let low_frames = if last {
            slab.end_at(mesh.domain.duration)?;
            body.extend_from_slice(&mesh.domain.duration.to_le_bytes());
            u32::MAX
        } else {
            self.packets + 1
        };
        let mut side = Writing::new(&mut self.source, mesh, low_frames);
        slab.code_packet(&mut side, low_frames)?;
        write_payload(&mut body, &side.finish());
        self.frame(&body, last)
    }

    /// Puts the frame around a body and counts the packet.
    fn frame(&mut self, body: &[u8], last: bool) -> Result<Packet, WriteError> {
        let frame_number = self.first_frame + u64::from(self.packets);
        let keyframe = self.packets == 0;
        let header = PacketHeader { length: 0, frame_number, keyframe, last, picture: true };
        let limit = Limits::default().max_packet_bytes as usize;
        let data = write_packet(header, body)
            .filter(|data| data.len() <= limit)
            .ok_or(WriteError::PacketBytes { limit, found: body.len() })?;
        self.packets += 1;
        self.ended = last;
        Ok(Packet { frame_number, keyframe, picture: true, data })
    }

    /// Whether every tet of the meshes seen has gone out.
    pub fn is_drained(&self) -> bool {
        self.source.is_drained()
    }

    /// What a parser holds after the last packet: the mesh in the order of the stream, with quantised colours.
    pub fn coded_mesh(&self) -> Option<&TetMesh> {
        self.slab.as_ref().map(Slab::mesh)
    }

    fn check_domain(&self, mesh: &TetMesh) -> Result<(), WriteError> {
        let SequenceHeader { width, height, subpixel_bits, .. } = self.header;
        let expected = Domain { width, height, subpixel_bits, ..mesh.domain };
        if mesh.domain == expected { Ok(()) } else { Err(WriteError::Domain { expected, found: mesh.domain }) }
    }
}
