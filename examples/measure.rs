//! One clip through encoder and decoder, in figures: `measure frame*.png --preset fast`, or `measure in.y4m`.
//!
//! Prints one line: seconds a frame by the wall, in all and by stage, and behind a slash what all threads worked together;
//! collapses a second of the simplification's work, peak memory, simplification ratio, bytes, error against the source,
//! and how long decoding and drawing at the source's size take. `scripts/bench.sh` compares settings with it.

#[path = "measure/clock.rs"]
mod clock;
mod command;
#[path = "vectorize/settings.rs"]
mod settings;
#[path = "vectorize/source.rs"]
mod source;

use std::collections::HashMap;
use std::error::Error;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use clap::Parser;
use clock::{Clock, Spent};
use settings::Settings;
use tetvec::metrics::{Difference, simplification_ratio};
use tetvec::{Decoder, DecoderConfig, Encoder, EncoderConfig, Event, Frame, Packet, Stage, Surface};

/// Measures the codec on a clip.
#[derive(Debug, Parser)]
struct Arguments {
    /// A .y4m file (-: standard input) or PNG pictures in the order given.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    /// Stop after this many frames.
    #[arg(long)]
    frames: Option<usize>,
}

fn main() -> ExitCode {
    command::run("measure", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let source = source::open(&arguments.files)?;
    let config = EncoderConfig {
        frame_rate: source.frame_rate,
        pixel_aspect_ratio: source.pixel_aspect_ratio,
        ..arguments.settings.config(source.width, source.height)
    };
    let limit = arguments.frames.unwrap_or(usize::MAX);
    let frames = source.frames.take(limit).collect::<Result<Vec<Frame>, _>>()?;
    let count = frames.len().max(1) as f64;
    let before = peak_memory();
    let encoded = encode(&frames, config.clone())?;
    let memory = peak_memory();
    let (error, decoding) = decode(&frames, &encoded.packets)?;
    let bytes: usize = encoded.packets.iter().map(|packet| packet.data.len()).sum();
    let vertices = encoded.vertices;
    let print_spent = |name: &str, Spent { wall, work }| {
        print!("{name} {:.3}/{:.3}", wall.as_secs_f64() / count, work.as_secs_f64() / count);
    };
    print_spent("s/frame", encoded.time);
    for stage in Stage::ALL {
        print_spent(&format!(" {}", stage.name()), encoded.of(stage));
    }
    let (collapses, evaluations) = encoded.collapses;
    print!(" | {:.0} k collapses/s", collapses as f64 / encoded.of(Stage::Simplify).work.as_secs_f64() / 1e3);
    print!(" of {:.1} evaluations", evaluations as f64 / collapses.max(1) as f64);
    if let (Some(before), Some(memory)) = (before, memory) {
        print!(" | {:.0} MB, {:.0} MB without the source", memory, memory - before);
    }
    let ratio = simplification_ratio(vertices, config.width, config.height, frames.len() as u64);
    print!(" | S.R. {:.3} % {bytes} bytes {:.2} B/vertex", 100.0 * ratio, bytes as f64 / vertices.max(1) as f64);
    print!(" | RE {:.3} PSNR {:.2}", error.reconstruction_error(), error.psnr());
    println!(" | decoded in {:.1} ms/frame", 1e3 * decoding.as_secs_f64() / count);
    Ok(())
}

/// What encoding gave.
struct Encoded {
    packets: Vec<Packet>,
    vertices: u64,
    time: Spent,
    stages: HashMap<Stage, Spent>,
    /// Edges collapsed, and costs computed for that.
    collapses: (u64, u64),
}

impl Encoded {
    fn of(&self, stage: Stage) -> Spent {
        self.stages.get(&stage).copied().unwrap_or_default()
    }
}

fn encode(frames: &[Frame], config: EncoderConfig) -> Result<Encoded, Box<dyn Error>> {
    let mut encoder = Encoder::try_new(config)?;
    let figures = Arc::new(Mutex::new((HashMap::<Stage, Spent>::new(), (0, 0))));
    let mut began = None;
    let noted = figures.clone();
    encoder.observe(move |event| match event {
        Event::Began(stage) => began = Some((stage, Clock::start())),
        Event::Ended => {
            if let (Some((stage, clock)), Ok(mut figures)) = (began.take(), noted.lock()) {
                *figures.0.entry(stage).or_default() += clock.spent();
            }
        }
        Event::Simplified(report) => {
            if let Ok(mut figures) = noted.lock() {
                let (collapses, evaluations) = figures.1;
                figures.1 = (collapses + report.collapses, evaluations + report.evaluations);
            }
        }
        Event::Fitted(_) => {}
    });
    let mut packets = Vec::new();
    let clock = Clock::start();
    for frame in frames {
        encoder.send_frame(frame.clone(), false)?;
        packets.extend(std::iter::from_fn(|| encoder.receive_packet()));
    }
    encoder.finish()?;
    packets.extend(std::iter::from_fn(|| encoder.receive_packet()));
    let time = clock.spent();
    let (stages, collapses) = figures.lock().map_err(|error| error.to_string())?.clone();
    Ok(Encoded { packets, vertices: encoder.vertices(), time, stages, collapses })
}

fn decode(frames: &[Frame], packets: &[Packet]) -> Result<(Difference, Duration), Box<dyn Error>> {
    let mut decoder = Decoder::new(DecoderConfig::default());
    let mut error = Difference::default();
    let Some(first) = frames.first() else { return Ok((error, Duration::ZERO)) };
    let mut picture = first.clone();
    let mut time = Duration::ZERO;
    for (packet, frame) in packets.iter().zip(frames) {
        let start = Instant::now();
        let info = decoder.send_packet(&packet.data)?;
        decoder.render(info.frame_number as f64, None, &mut Surface::of_frame(&mut picture))?;
        time += start.elapsed();
        error.add(frame, &picture);
    }
    Ok((error, time))
}

/// Most memory that the process has held so far, in megabytes, where the system says.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix(" kB")?.trim().parse::<f64>().ok().map(|kilobytes| kilobytes / 1e3)
}
