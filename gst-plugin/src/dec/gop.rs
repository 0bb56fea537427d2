//! Packets gathered for reverse playback: they come group by group, each group in the order of decoding, and are shown
//! last to first once the group is whole. Pictures are never kept, only packets.

/// Most packets of one group: a keyframe cannot be further away in a stream that our encoder wrote.
const MAX_PACKETS: usize = *tetvec::EncoderConfig::KEY_INT_MAX.end() as usize;

/// Packets of one group.
#[derive(Debug, Default)]
pub(super) struct Gop {
    packets: Vec<gst::Buffer>,
}

impl Gop {
    /// Takes the next packet; hands out the group before, if this packet starts another.
    pub(super) fn push(&mut self, packet: gst::Buffer) -> Vec<gst::Buffer> {
        let keyframe = !packet.flags().contains(gst::BufferFlags::DELTA_UNIT);
        let done =
            if keyframe || packet.flags().contains(gst::BufferFlags::DISCONT) { self.take() } else { Vec::new() };
        // Without the keyframe that leads a group its packets cannot be decoded.
        let decodable = keyframe || !self.packets.is_empty();
        if decodable && self.packets.len() < MAX_PACKETS {
            self.packets.push(packet);
        }
        done
    }

    /// Hands out what is gathered.
    pub(super) fn take(&mut self) -> Vec<gst::Buffer> {
        std::mem::take(&mut self.packets)
    }
}

#[cfg(test)]
mod tests {
    use super::{Gop, MAX_PACKETS};

    fn packet(flags: gst::BufferFlags) -> gst::Buffer {
        gst::init().expect("GStreamer starts");
        let mut packet = gst::Buffer::new();
        packet.make_mut().set_flags(flags);
        packet
    }

    #[test]
    fn a_keyframe_or_a_discontinuity_ends_a_group() {
        let (key, delta) = (gst::BufferFlags::empty(), gst::BufferFlags::DELTA_UNIT);
        let mut gop = Gop::default();
        let sizes: Vec<usize> = [delta, key, delta, delta, key, delta, delta | gst::BufferFlags::DISCONT, delta, key]
            .map(|flags| gop.push(packet(flags)).len())
            .to_vec();
        assert_eq!(sizes, [0, 0, 0, 0, 3, 0, 2, 0, 0]);
        assert_eq!(gop.take().len(), 1);
    }

    #[test]
    fn a_group_without_end_is_bounded() {
        let mut gop = Gop::default();
        gop.push(packet(gst::BufferFlags::empty()));
        for _ in 0..2 * MAX_PACKETS {
            gop.push(packet(gst::BufferFlags::DELTA_UNIT));
        }
        assert_eq!(gop.take().len(), MAX_PACKETS);
    }
}
