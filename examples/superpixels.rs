//! A clip's temporal superpixels to look at and to measure: `superpixels frame*.png out/ --superpixels 400`.
//!
//! Writes into the folder, a frame each, the picture with the labels' boundaries (`0000.png`), or with `--means` every
//! label in its mean colour, and the labels (`0000.labels`: an unsigned 32-bit little-endian number a pixel, row by
//! row). Prints the figures of `segment`'s own metrics and the time it took. `scripts/compare_superpixels.py` sets the
//! labels beside those of other methods.

mod command;
#[path = "vectorize/source.rs"]
mod source;

use std::collections::BTreeMap;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use clap::Parser;
use tetvec::Frame;
use tetvec::vectorize::segment::{SegmentParams, Segmenter, explained_variation, mean_duration};
use tetvec::video::{Label, LabelPlane};

/// Colour of boundaries.
const BOUNDARY: [u8; 3] = [255, 220, 0];

/// Divides a clip into temporal superpixels.
#[derive(Debug, Parser)]
struct Arguments {
    /// A .y4m file (-: standard input) or PNG pictures in the order given, then the folder to write to.
    #[arg(required = true, num_args = 2..)]
    files: Vec<PathBuf>,
    /// Mean number of superpixels a frame; 0: labels by content.
    #[arg(long, default_value_t = 400)]
    superpixels: u32,
    /// Stop after this many frames.
    #[arg(long)]
    frames: Option<usize>,
    /// Draw every label in its mean colour, without boundaries.
    #[arg(long)]
    means: bool,
    /// Write no files: figures and time alone.
    #[arg(long)]
    dry: bool,
}

fn main() -> ExitCode {
    command::run("superpixels", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let (folder, inputs) = arguments.files.split_last().ok_or("no files")?;
    let source = source::open(inputs)?;
    let limit = arguments.frames.unwrap_or(usize::MAX);
    let frames = source.frames.take(limit).collect::<Result<Vec<Frame>, _>>()?;
    let mut segmenter = Segmenter::new(source.width, source.height, SegmentParams::new(arguments.superpixels));
    let (mut first, mut steady) = (Duration::ZERO, Duration::ZERO);
    let mut planes = Vec::with_capacity(frames.len());
    for (k, frame) in frames.iter().enumerate() {
        let start = Instant::now();
        planes.push(segmenter.segment(frame).labels);
        *(if k == 0 { &mut first } else { &mut steady }) += start.elapsed();
    }
    if !arguments.dry {
        fs::create_dir_all(folder)?;
        for (k, (frame, plane)) in frames.iter().zip(&planes).enumerate() {
            write(folder, k, frame, plane, arguments.means)?;
        }
    }
    let pixels = f64::from(source.width) * f64::from(source.height);
    let speed = pixels * frames.len().saturating_sub(1) as f64 / steady.as_secs_f64().max(1e-9) / 1e6;
    println!(
        "{} frames, {:.1} labels a frame, explained variation {:.4}, mean duration {:.2} frames, \
         first frame {:.3} s, then {speed:.2} Mpixel/s",
        frames.len(),
        planes.iter().map(label_count).sum::<usize>() as f64 / planes.len().max(1) as f64,
        explained_variation(&frames, &planes),
        mean_duration(&planes),
        first.as_secs_f64(),
    );
    Ok(())
}

fn label_count(plane: &LabelPlane) -> usize {
    let mut labels = plane.labels().to_vec();
    labels.sort_unstable();
    labels.dedup();
    labels.len()
}

fn write(folder: &Path, k: usize, frame: &Frame, plane: &LabelPlane, means: bool) -> Result<(), Box<dyn Error>> {
    let picture = if means { in_means(frame, plane) } else { with_boundaries(frame, plane) };
    let bytes: Vec<u8> = picture.into_iter().flatten().collect();
    let path = folder.join(format!("{k:04}.png"));
    image::save_buffer(path, &bytes, frame.width(), frame.height(), image::ColorType::Rgb8)?;
    let labels: Vec<u8> = plane.labels().iter().flat_map(|label| label.0.to_le_bytes()).collect();
    fs::write(folder.join(format!("{k:04}.labels")), labels)?;
    Ok(())
}

/// The picture, pixels with another label at the right or below in one colour.
fn with_boundaries(frame: &Frame, plane: &LabelPlane) -> Vec<[u8; 3]> {
    let (width, height) = (frame.width(), frame.height());
    let is_boundary = |x: u32, y: u32| {
        let here = plane.label(x, y);
        (x + 1 < width && plane.label(x + 1, y) != here) || (y + 1 < height && plane.label(x, y + 1) != here)
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    places.zip(frame.pixels()).map(|((x, y), &color)| if is_boundary(x, y) { BOUNDARY } else { color }).collect()
}

/// Every pixel in the mean colour of its label in this frame.
fn in_means(frame: &Frame, plane: &LabelPlane) -> Vec<[u8; 3]> {
    let mut sums: BTreeMap<Label, ([u64; 3], u64)> = BTreeMap::new();
    for (&color, &label) in frame.pixels().iter().zip(plane.labels()) {
        let (sum, count) = sums.entry(label).or_default();
        *count += 1;
        sum.iter_mut().zip(color).for_each(|(sum, level)| *sum += u64::from(level));
    }
    plane.labels().iter().map(|label| sums[label].0.map(|sum| (sum / sums[label].1) as u8)).collect()
}
