//! Draws a vector stream without GStreamer: `render in.tetv out/` writes every frame as PNG,
//! `render in.tetv out.png --time 12.5 --width 3840` a single picture between two frames.
//!
//! Files written one behind the other (`cat a.tetv b.tetv`) are numbered through. Damaged packets are reported, and
//! drawing goes on at the next keyframe.

mod command;
#[path = "render/stream.rs"]
mod stream;
#[path = "render/times.rs"]
mod times;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use image::RgbImage;
use indicatif::{ProgressBar, ProgressStyle};
use stream::Packets;
use tetvec::bitstream::ParseError;
use tetvec::{DecodeError, Decoder, DecoderConfig, PixelFormat, Plane, SequenceHeader, Surface, Viewport, YuvMatrix};
use times::{Times, parse_time, parse_viewport};

/// Draws pictures of a vector stream, of any size and at any time.
#[derive(Debug, Parser)]
struct Arguments {
    /// The .tetv file.
    input: PathBuf,
    /// A .png file for a single picture, or a folder.
    output: PathBuf,
    /// Width of the pictures; follows the height if that alone is given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    width: Option<u32>,
    /// Height of the pictures; follows the width if that alone is given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16384))]
    height: Option<u32>,
    /// A single time, in frames: 12.5 lies between two.
    #[arg(long, value_parser = parse_time, conflicts_with = "frames")]
    time: Option<f64>,
    /// Frames to draw: all, a..b (b left out), or a list as 1,5,7.25.
    #[arg(long, default_value = "all")]
    frames: Times,
    /// Levels of subdivision, 0 to 2; as the stream says if not given.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=2))]
    levels: Option<u8>,
    /// Leave edges between labels as stairs of pixels.
    #[arg(long)]
    no_antialias: bool,
    /// The part of the picture to draw, in its pixels: x,y,width,height.
    #[arg(long, value_parser = parse_viewport)]
    viewport: Option<Viewport>,
    /// Worker threads; 0: all cores.
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

fn main() -> ExitCode {
    command::run("render", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let bytes = std::fs::read(&arguments.input).map_err(|error| format!("{}: {error}", arguments.input.display()))?;
    let is_file = arguments.output.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("png"));
    let times = arguments.time.map_or_else(|| arguments.frames.clone(), |time| Times::At(vec![time]));
    if is_file && !matches!(&times, Times::At(times) if times.len() == 1) {
        return Err("output: expected a folder for more than one picture, found a .png file".into());
    }
    if !is_file {
        std::fs::create_dir_all(&arguments.output)?;
    }
    let length = match &times {
        Times::All => Packets::new(&bytes).count(),
        Times::At(times) => times.len(),
    };
    let progress = ProgressBar::new(length as u64);
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} pictures, {eta} left")?);
    let mut drawing = Drawing::new(arguments, &times, is_file, progress);
    let mut packets = Packets::new(&bytes);
    while let Some(packet) = packets.next() {
        match packet {
            Ok(packet) if drawing.take_packet(packet)? => {}
            Ok(_) => packets.distrust_last(),
            Err(damage) => drawing.report(&damage),
        }
    }
    drawing.finish()
}

/// The pictures asked for, on their way.
struct Drawing<'a> {
    arguments: &'a Arguments,
    times: &'a Times,
    is_file: bool,
    decoder: Decoder,
    progress: ProgressBar,
    /// What is added to the numbers of the present stream to number through all of the file.
    offset: i64,
    /// Number of the frame after the last.
    next_frame: i64,
    /// Times that are dealt with.
    passed: usize,
    drawn: usize,
    /// Packets that could not be decoded.
    lost: usize,
    /// Whether the last packet was one of them.
    waiting: bool,
}

impl<'a> Drawing<'a> {
    fn new(arguments: &'a Arguments, times: &'a Times, is_file: bool, progress: ProgressBar) -> Self {
        let config = DecoderConfig {
            subdivision_levels: arguments.levels,
            antialias: !arguments.no_antialias,
            threads: arguments.threads,
        };
        Self {
            arguments,
            times,
            is_file,
            decoder: Decoder::new(config),
            progress,
            offset: 0,
            next_frame: 0,
            passed: 0,
            drawn: 0,
            lost: 0,
            waiting: false,
        }
    }

    /// Decodes a packet and draws what it completes. False for damage that puts the packet's length in doubt.
    fn take_packet(&mut self, packet: &[u8]) -> Result<bool, Box<dyn Error>> {
        let info = match self.decoder.send_packet(packet) {
            Ok(info) => info,
            Err(error) => {
                // Once a stretch of lost packets, not for each of them.
                if error != DecodeError::NoKeyframe || !std::mem::replace(&mut self.waiting, true) {
                    self.report(&error);
                }
                self.waiting = true;
                self.lost += 1;
                return Ok(!matches!(error, DecodeError::Packet(ParseError::Crc { .. })));
            }
        };
        self.waiting = false;
        if !info.picture {
            return Ok(true);
        }
        let number = i64::try_from(info.frame_number)?;
        if number + self.offset < self.next_frame {
            self.offset = self.next_frame - number;
        }
        let frame = number + self.offset;
        self.next_frame = frame + 1;
        match self.times {
            Times::All => self.draw(frame as f64)?,
            Times::At(times) => {
                let due = times[self.passed..].iter().take_while(|&&time| time < (frame + 1) as f64);
                let due: Vec<f64> = due.copied().collect();
                self.passed += due.len();
                // Times before this frame fell into what was lost.
                due.into_iter().filter(|&time| time >= frame as f64).try_for_each(|time| self.draw(time))?;
            }
        }
        Ok(true)
    }

    fn draw(&mut self, time: f64) -> Result<(), Box<dyn Error>> {
        let header = self.decoder.header().ok_or("no header: expected a keyframe")?;
        let (width, height) = picture_size(self.arguments, header);
        let mut picture = RgbImage::new(width, height);
        let planes = vec![Plane { data: &mut picture, stride: 3 * width as usize }];
        let mut surface = Surface::try_new(PixelFormat::Rgb, YuvMatrix::default(), (width, height), planes)?;
        self.decoder.render(time - self.offset as f64, self.arguments.viewport, &mut surface)?;
        picture.save(self.path(time))?;
        self.drawn += 1;
        self.progress.inc(1);
        Ok(())
    }

    fn path(&self, time: f64) -> PathBuf {
        let output: &Path = &self.arguments.output;
        if self.is_file {
            output.to_path_buf()
        } else if time.fract() == 0.0 {
            output.join(format!("frame-{time:05}.png"))
        } else {
            output.join(format!("frame-{time:09.3}.png"))
        }
    }

    fn report(&self, error: &dyn Error) {
        self.progress.suspend(|| eprintln!("before frame {}: {error}", self.next_frame));
    }

    fn finish(self) -> Result<(), Box<dyn Error>> {
        self.progress.finish();
        println!("{} pictures, {} packets lost", self.drawn, self.lost);
        let expected = match self.times {
            Times::All => 1,
            Times::At(times) => times.len(),
        };
        if self.drawn < expected {
            let frames = self.next_frame;
            return Err(format!("pictures: expected {expected}, found {} in {frames} frames", self.drawn).into());
        }
        Ok(())
    }
}

/// The size asked for; a side left out follows the aspect of what is shown.
fn picture_size(arguments: &Arguments, header: &SequenceHeader) -> (u32, u32) {
    let (width, height) = match arguments.viewport {
        Some(viewport) => (viewport.width, viewport.height),
        None => (f64::from(header.width), f64::from(header.height)),
    };
    let side = |side: f64| side.round().clamp(1.0, 16384.0) as u32;
    match (arguments.width, arguments.height) {
        (Some(width), Some(height)) => (width, height),
        (Some(asked), None) => (asked, side(f64::from(asked) * height / width)),
        (None, Some(asked)) => (side(f64::from(asked) * width / height), asked),
        (None, None) => (side(width), side(height)),
    }
}
