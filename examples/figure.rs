//! One picture of a frame, as in Fig. 9 of the paper: `figure in.y4m in.tetv out.png --frame 12`.
//!
//! ```text
//! original           | control mesh, by label | reconstruction          | difference, enlarged
//! zoom, nearest      | zoom, Lanczos          | zoom, drawn at its size | control mesh there
//! ```

mod command;
#[path = "figure/panels.rs"]
mod panels;
#[path = "figure/section.rs"]
mod section;
#[path = "vectorize/source.rs"]
mod source;
#[path = "render/stream.rs"]
mod stream;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use image::RgbImage;
use panels::{Region, Sheet};
use source::Source;
use stream::Packets;
use tetvec::bitstream::{Limits, ParseError, SlabParser};
use tetvec::mesh::TetMesh;
use tetvec::metrics::Difference;
use tetvec::render::{DrawParams, cross_section, draw};
use tetvec::{Frame, Surface, Viewport};

/// Draws a frame beside its vectorised form.
#[derive(Debug, Parser)]
struct Arguments {
    /// What was vectorised (a .y4m file, or PNG pictures in order), then the .tetv file, then the .png to write.
    #[arg(required = true, num_args = 3..)]
    files: Vec<PathBuf>,
    /// Number of the frame.
    #[arg(long, default_value_t = 0)]
    frame: u32,
    /// Enlargement of the lower row.
    #[arg(long, default_value_t = 8, value_parser = clap::value_parser!(u32).range(2..=64))]
    zoom: u32,
    /// Middle of the region to enlarge, in pixels: x,y. Where edges are strongest if not given.
    #[arg(long, value_parser = parse_point)]
    region: Option<(u32, u32)>,
    /// Enlargement of the upper row; as makes a panel about 320 pixels wide if not given.
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=16))]
    scale: Option<u32>,
    /// Factor of the difference.
    #[arg(long, default_value_t = 4)]
    gain: u32,
    /// Levels of subdivision, 0 to 2; as the stream says if not given.
    #[arg(long, value_parser = clap::value_parser!(u8).range(0..=2))]
    levels: Option<u8>,
}

/// Width that a panel has about, in pixels.
const PANEL_WIDTH: u32 = 320;

fn main() -> ExitCode {
    command::run("figure", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    let [inputs @ .., stream, output] = &arguments.files[..] else { return Err("files: expected three".into()) };
    let source = source::open(inputs)?;
    println!("{source}");
    let original = read_frame(source, arguments.frame)?;
    let slab = read_slab(stream, arguments.frame)?;
    let size = (original.width(), original.height());
    if size != (slab.mesh.domain.width, slab.mesh.domain.height) {
        return Err(format!("{}: another size than the original's {}x{}", stream.display(), size.0, size.1).into());
    }
    let levels = arguments.levels.unwrap_or(slab.levels);
    let mut ours = original.clone();
    let params = DrawParams { levels, antialias: true, viewport: None, mesh: false };
    draw(&slab.mesh, slab.time, &params, &mut Surface::of_frame(&mut ours))?;

    let scale = arguments.scale.unwrap_or((PANEL_WIDTH / size.0).max(1));
    let panel = (size.0 * scale, size.1 * scale);
    let region = Region::new(&original, (panel.0 / arguments.zoom, panel.1 / arguments.zoom), arguments.region);
    let whole = Viewport::whole(&slab.mesh.domain);
    let polygons = cross_section(&slab.mesh, slab.time, 0);
    let mut sheet = Sheet::new(panel);
    sheet.place(0, 0, &panels::enlarge(&original, scale));
    sheet.place(1, 0, &section::draw_section(&polygons, whole, panel));
    sheet.place(2, 0, &panels::enlarge(&ours, scale));
    sheet.place(3, 0, &panels::enlarge(&panels::difference(&original, &ours, arguments.gain), scale));
    sheet.place(0, 1, &region.nearest(&original, arguments.zoom));
    sheet.place(1, 1, &region.lanczos(&original, arguments.zoom));
    sheet.place(2, 1, &zoomed(&slab, levels, region, arguments.zoom)?);
    sheet.place(3, 1, &section::draw_section(&polygons, region.viewport(), region.size(arguments.zoom)));
    sheet.save(output)?;
    print_legend(arguments, region, &original, &ours);
    Ok(())
}

fn print_legend(arguments: &Arguments, region: Region, original: &Frame, ours: &Frame) {
    let mut difference = Difference::default();
    difference.add(original, ours);
    let (gain, zoom) = (arguments.gain, arguments.zoom);
    println!("above: original | control mesh by label | reconstruction | difference x {gain}");
    println!("below, {region} at {zoom}x: nearest | Lanczos | ours | control mesh");
    println!("frame {}: RE {:.2}, {:.2} dB", arguments.frame, difference.reconstruction_error(), difference.psnr());
}

/// Frame number `number` of the original.
fn read_frame(source: Source, number: u32) -> Result<Frame, Box<dyn Error>> {
    let mut count = 0;
    for frame in source.frames {
        let frame = frame?;
        if count == number {
            return Ok(frame);
        }
        count += 1;
    }
    Err(format!("original: expected frame {number}, found {count} frames").into())
}

/// A frame's mesh.
struct Slab {
    mesh: TetMesh,
    /// Time of the frame since the slab's first.
    time: f64,
    /// Levels of subdivision that the stream asks for.
    levels: u8,
}

/// Reads the slab of frame number `frame` as far as it is needed; what damage leaves is used.
fn read_slab(path: &Path, frame: u32) -> Result<Slab, Box<dyn Error>> {
    let bytes = std::fs::read(path).map_err(|error| format!("{}: {error}", path.display()))?;
    let mut parser = SlabParser::new(Limits::default());
    let mut packets = Packets::new(&bytes);
    while let Some(packet) = packets.next() {
        let packet = match packet {
            Ok(packet) => packet,
            Err(damage) => {
                eprintln!("{}: {damage}", path.display());
                continue;
            }
        };
        match parser.parse_packet(packet) {
            Ok(packet) if packet.picture && packet.frame_number == u64::from(frame) => {
                let (Some(mesh), Some(first), Some(header)) = (parser.mesh(), parser.first_frame(), parser.header())
                else {
                    break;
                };
                let time = (u64::from(frame) - first) as f64;
                return Ok(Slab { mesh: mesh.clone(), time, levels: header.subdivision_levels });
            }
            Ok(_) | Err(ParseError::NoKeyframe) => {}
            Err(error) => {
                eprintln!("{}: {error}", path.display());
                if matches!(error, ParseError::Crc { .. }) {
                    packets.distrust_last();
                }
            }
        }
    }
    Err(format!("{}: expected frame {frame}, found none", path.display()).into())
}

/// The region drawn from the mesh at its enlarged size.
fn zoomed(slab: &Slab, levels: u8, region: Region, zoom: u32) -> Result<RgbImage, Box<dyn Error>> {
    let (width, height) = region.size(zoom);
    let mut picture = Frame::from_fn(width, height, |_, _| [0; 3])?;
    let params = DrawParams { levels, antialias: true, viewport: Some(region.viewport()), mesh: false };
    draw(&slab.mesh, slab.time, &params, &mut Surface::of_frame(&mut picture))?;
    Ok(panels::enlarge(&picture, 1))
}

fn parse_point(text: &str) -> Result<(u32, u32), String> {
    let (x, y) = text.split_once(',').ok_or_else(|| format!("{text}: expected x,y"))?;
    let number = |word: &str| word.parse::<u32>().map_err(|error| format!("{word}: {error}"));
    Ok((number(x)?, number(y)?))
}
