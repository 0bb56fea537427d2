//! Small videos that are drawn here, and the way through the codec and back.

use tetvec::bitstream::Index;
use tetvec::bitstream::Limits;
use tetvec::metrics::Difference;
use tetvec::{Decoder, DecoderConfig, Encoder, EncoderConfig, Frame, Packet, Surface};

/// A disc that moves over a gradient, anti-aliased as a camera would; frames count from `first`.
pub(crate) fn disc((width, height): (u32, u32), first: u32, count: u32) -> Vec<Frame> {
    let picture = |k: u32| {
        let (w, h) = (f64::from(width), f64::from(height));
        let (x0, y0) = (w * 0.3 + 0.7 * f64::from(k), h * 0.5);
        let radius = h * 0.3;
        let color = |x: u32, y: u32| {
            let (x, y) = (f64::from(x) + 0.5, f64::from(y) + 0.5);
            let inside = (radius + 0.5 - (x - x0).hypot(y - y0)).clamp(0.0, 1.0);
            let back = [40.0 + 100.0 * x / w, 60.0 + 80.0 * y / h, 160.0 - 60.0 * x / w];
            [0, 1, 2].map(|c| (back[c] + inside * ([235.0, 205.0, 60.0][c] - back[c])).round() as u8)
        };
        Frame::from_fn(width, height, color).expect("a size within the limits")
    };
    (first..first + count).map(picture).collect()
}

/// Another scene of the same size: dark bars.
pub(crate) fn bars((width, height): (u32, u32), count: u32) -> Vec<Frame> {
    let bar = |x: u32| if (x * 4 / width).is_multiple_of(2) { [12, 24, 18] } else { [40, 10, 90] };
    (0..count).map(|_| Frame::from_fn(width, height, |x, _| bar(x)).expect("a size within the limits")).collect()
}

/// Rings that run outwards from two places over each other: more than a sparse mesh can hold.
pub(crate) fn waves((width, height): (u32, u32), count: u32) -> Vec<Frame> {
    let ring = |x: f64, y: f64, k: u32| (0.8 * x.hypot(y) - 0.4 * f64::from(k)).sin();
    let picture = |k: u32| {
        let color = |x: u32, y: u32| {
            let (x, y) = (f64::from(x), f64::from(y));
            let sum = ring(x - 20.0, y - 15.0, k) + ring(x - 70.0, y - 40.0, 2 * k);
            [1.0, 0.8, -0.6].map(|part| (128.0 + 55.0 * part * sum).round() as u8)
        };
        Frame::from_fn(width, height, color).expect("a size within the limits")
    };
    (0..count).map(picture).collect()
}

/// Settings for quick tests: short windows, a mesh dense enough for a small picture.
pub(crate) fn config((width, height): (u32, u32)) -> EncoderConfig {
    EncoderConfig { window: 4, simplification_ratio: 0.1, ..EncoderConfig::new(width, height) }
}

/// What an encoder wrote.
pub(crate) struct Stream {
    pub packets: Vec<Packet>,
    pub vertices: u64,
}

impl Stream {
    /// Numbers of the keyframes.
    pub(crate) fn keyframes(&self) -> Vec<u64> {
        self.packets.iter().filter(|packet| packet.keyframe).map(|packet| packet.frame_number).collect()
    }

    /// All bytes, as in a file.
    pub(crate) fn bytes(&self) -> Vec<u8> {
        self.packets.iter().flat_map(|packet| packet.data.iter().copied()).collect()
    }

    /// Checks the order and the numbers of the packets, and the index that ends them.
    pub(crate) fn check_framing(&self, frames: u64) {
        assert_eq!(self.packets.len() as u64, frames + 1, "a packet a frame and the index");
        for (k, packet) in (0..).zip(&self.packets) {
            assert_eq!((packet.frame_number, packet.picture), (k, k < frames), "packet {k} of {frames}");
        }
        assert!(self.packets[0].keyframe, "the first packet starts a slab");
        let index = Index::from_packet(&self.packets[frames as usize].data, &Limits::default()).expect("an index");
        assert_eq!(index.frame_count, frames);
        let index_offset = self.bytes().len() - self.packets[frames as usize].data.len();
        let indexed: Vec<u64> = index.entries.iter().map(|entry| entry.frame_number).collect();
        assert_eq!(indexed, self.keyframes(), "keyframes of the index");
        for entry in &index.entries {
            let offset = entry.offset(index_offset as u64).expect("an offset within the file") as usize;
            let data = &self.packets[entry.frame_number as usize].data;
            assert_eq!(&self.bytes()[offset..offset + data.len()], &data[..], "keyframe {}", entry.frame_number);
        }
    }
}

/// Encodes `frames`; those numbered in `forced` are asked to be keyframes.
pub(crate) fn encode(frames: &[Frame], config: EncoderConfig, forced: &[usize]) -> Stream {
    let mut encoder = Encoder::try_new(config).expect("settings in range");
    let mut packets = Vec::new();
    for (k, frame) in frames.iter().enumerate() {
        encoder.send_frame(frame.clone(), forced.contains(&k)).expect("a good frame");
        packets.extend(std::iter::from_fn(|| encoder.receive_packet()));
        let held = k + 1 - packets.len();
        assert!(held <= encoder.latency_frames() as usize, "{held} frames held back after frame {k}");
    }
    encoder.finish().expect("a stream");
    packets.extend(std::iter::from_fn(|| encoder.receive_packet()));
    Stream { packets, vertices: encoder.vertices() }
}

/// Draws the present picture of `decoder`.
pub(crate) fn picture(decoder: &mut Decoder, frame: f64, (width, height): (u32, u32)) -> Frame {
    let mut picture = Frame::from_fn(width, height, |_, _| [1, 2, 3]).expect("a size within the limits");
    decoder.render(frame, None, &mut Surface::of_frame(&mut picture)).expect("a picture");
    picture
}

/// Decodes packets and draws each frame as it comes.
pub(crate) fn decode(packets: &[Packet], size: (u32, u32), config: DecoderConfig) -> Vec<Frame> {
    let mut decoder = Decoder::new(config);
    let mut frames = Vec::new();
    for packet in packets {
        let info = decoder.send_packet(&packet.data).expect("a good packet");
        assert_eq!((info.frame_number, info.picture), (packet.frame_number, packet.picture));
        if info.picture {
            frames.push(picture(&mut decoder, info.frame_number as f64, size));
        }
    }
    frames
}

/// The difference over all frames.
pub(crate) fn difference(reference: &[Frame], test: &[Frame]) -> Difference {
    assert_eq!(reference.len(), test.len(), "as many pictures as went in");
    let mut difference = Difference::default();
    reference.iter().zip(test).for_each(|(a, b)| difference.add(a, b));
    difference
}

/// PSNR over all frames, in dB.
pub(crate) fn psnr(reference: &[Frame], test: &[Frame]) -> f64 {
    difference(reference, test).psnr()
}
