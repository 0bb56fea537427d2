//! Where the bits of streams go: `inspect in.tetv ...`.
//!
//! Prints a row a stream: vertices, tets and wedges a vertex, bytes a vertex, bits a tet of connectivity, and bits a
//! vertex of each part.

mod command;

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use tetvec::bitstream::{BitCounts, Limits, Part, SlabParser, find_packet, parse_packet_header};

/// Tells where the bits of streams go.
#[derive(Debug, Parser)]
struct Arguments {
    /// .tetv files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
}

fn main() -> ExitCode {
    command::run("inspect", run)
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn Error>> {
    print!("| stream | frames | vertices | tets / wedges a vertex | bytes a vertex | connectivity a tet |");
    Part::ALL.iter().for_each(|part| print!(" {} |", part.name()));
    println!("\n|{}", "---|".repeat(6 + Part::ALL.len()));
    for file in &arguments.files {
        let contents = Contents::of(&std::fs::read(file)?)?;
        contents.print(file);
    }
    Ok(())
}

/// What a stream holds.
#[derive(Debug, Default)]
struct Contents {
    frames: u64,
    vertices: usize,
    wedges: usize,
    tets: usize,
    bits: BitCounts,
}

impl Contents {
    /// Counts a stream's slabs; bytes that are no packet are passed over.
    fn of(stream: &[u8]) -> Result<Self, Box<dyn Error>> {
        let limits = Limits::default();
        let mut parser = SlabParser::new(limits);
        parser.count_bits();
        let mut contents = Self::default();
        let mut at = 0;
        loop {
            at += find_packet(&stream[at..], &limits);
            let Some(header) = parse_packet_header(&stream[at..], &limits).ok().flatten() else { break };
            let packet = stream.get(at..at + header.length).ok_or("the last packet is cut off")?;
            if header.keyframe {
                contents.add_slab(&parser);
            }
            parser.parse_packet(packet)?;
            contents.frames += u64::from(header.picture);
            at += header.length;
        }
        contents.add_slab(&parser);
        contents.bits = parser.bits();
        Ok(contents)
    }

    /// Adds what the parser holds.
    fn add_slab(&mut self, parser: &SlabParser) {
        if let Some(mesh) = parser.mesh() {
            self.vertices += mesh.positions.len();
            self.wedges += mesh.wedges.len();
            self.tets += mesh.tets.len();
        }
    }

    fn print(&self, file: &Path) {
        let vertices = self.vertices.max(1) as f64;
        let tets = self.tets.max(1) as f64;
        print!("| {} | {} | {} |", file.display(), self.frames, self.vertices);
        print!(" {:.2} / {:.2} |", self.tets as f64 / vertices, self.wedges as f64 / vertices);
        print!(" {:.3} | {:.3} |", self.bits.total() / 8.0 / vertices, self.bits.bits(Part::Connectivity) / tets);
        Part::ALL.iter().for_each(|&part| print!(" {:.2} |", self.bits.bits(part) / vertices));
        println!();
    }
}
