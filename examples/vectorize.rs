//! Vectorises a video without GStreamer: `vectorize in.y4m out.tetv`, or `vectorize frame*.png out.tetv`.
//!
//! Any video becomes y4m with `ffmpeg -i in.mp4 -pix_fmt yuv420p in.y4m`.

mod command;
#[path = "vectorize/settings.rs"]
mod settings;
#[path = "vectorize/source.rs"]
mod source;

use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use settings::Settings;
use tetvec::metrics::simplification_ratio;
use tetvec::{Encoder, EncoderConfig};

/// Turns raster video into a vector stream.
#[derive(Debug, Parser)]
struct Arguments {
    /// A .y4m file (-: standard input) or PNG pictures in the order given, then the .tetv file to write.
    #[arg(required = true, num_args = 2..)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    settings: Settings,
    /// Stop after this many frames.
    #[arg(long)]
    frames: Option<usize>,
}

fn main() -> ExitCode {
    command::run("vectorize", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let (output, inputs) = arguments.files.split_last().ok_or("no files")?;
    let source = source::open(inputs)?;
    println!("{source}");
    let mut encoder = Encoder::try_new(EncoderConfig {
        frame_rate: source.frame_rate,
        pixel_aspect_ratio: source.pixel_aspect_ratio,
        ..arguments.settings.config(source.width, source.height)
    })?;
    let mut file = BufWriter::new(File::create(output)?);
    let length = source.length.map(|length| length.min(arguments.frames.unwrap_or(usize::MAX)) as u64);
    let progress = match length {
        Some(length) => ProgressBar::new(length),
        None => ProgressBar::new_spinner(),
    };
    progress.set_style(ProgressStyle::with_template("{bar:40} {pos}/{len} frames, {eta} left, {msg}")?);
    let (mut bytes, mut frames) = (0, 0);
    for frame in source.frames.take(arguments.frames.unwrap_or(usize::MAX)) {
        encoder.send_frame(frame?, false)?;
        frames += 1;
        bytes += write_packets(&mut encoder, &mut file)?;
        progress.inc(1);
        progress.set_message(format!("{} kB", bytes / 1000));
    }
    encoder.finish()?;
    bytes += write_packets(&mut encoder, &mut file)?;
    file.flush()?;
    progress.finish();
    let vertices = encoder.vertices();
    let ratio = simplification_ratio(vertices, encoder.config().width, encoder.config().height, frames);
    println!(
        "{}: {frames} frames, {vertices} vertices (S.R. {:.3} %), {bytes} bytes, {:.2} bytes a vertex",
        output.display(),
        100.0 * ratio,
        bytes as f64 / vertices.max(1) as f64
    );
    Ok(())
}

fn write_packets(encoder: &mut Encoder, file: &mut impl Write) -> std::io::Result<u64> {
    let mut bytes = 0;
    while let Some(packet) = encoder.receive_packet() {
        file.write_all(&packet.data)?;
        bytes += packet.data.len() as u64;
    }
    Ok(bytes)
}
