#![doc = "A video through the codec and back at any size, without GStreamer."]

use tetvec::{Decoder, DecoderConfig, Encoder, EncoderConfig, Frame, Surface};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut encoder = Encoder::try_new(EncoderConfig { simplification_ratio: 0.05, ..EncoderConfig::new(64, 48) })?;
    for k in 0..6 {
        encoder.send_frame(Frame::from_fn(64, 48, |x, y| [x as u8, 4 * y as u8, 40 * k])?, false)?;
    }
    encoder.finish()?;
    let mut decoder = Decoder::new(DecoderConfig::default());
    let mut picture = Frame::from_fn(1920, 1440, |_, _| [0; 3])?;
    while let Some(packet) = encoder.receive_packet() {
        let info = decoder.send_packet(&packet.data)?;
        decoder.render(info.frame_number as f64 + 0.5, None, &mut Surface::of_frame(&mut picture))?;
        println!("frame {}: {} bytes, middle {:?}", info.frame_number, packet.data.len(), picture.pixel(960, 720));
    }
    Ok(())
}
