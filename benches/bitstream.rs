//! A slab to packets and back: `cargo bench --bench bitstream`. Items are vertices.

use divan::{Bencher, counter::ItemsCount};
use tetvec::bitstream::{Limits, SlabParser, SlabWriter};
use tetvec::mesh::TetMesh;
use tetvec::{EncoderConfig, Packet};

mod clip;

use clip::Clip;

fn main() {
    divan::main();
}

fn mesh() -> TetMesh {
    Clip::new(640, 360, 9).simplified(0.01)
}

fn write(mesh: &TetMesh) -> Vec<Packet> {
    let header = EncoderConfig::new(mesh.domain.width, mesh.domain.height).header();
    let mut writer = SlabWriter::try_new(header, 0).expect("a header");
    let frames = mesh.domain.duration + 1;
    (1..=frames).map(|frame| writer.write_packet(mesh, frame == frames).expect("a packet")).collect()
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn write_640x360(bencher: Bencher<'_, '_>) {
    let mesh = mesh();
    bencher.counter(ItemsCount::new(mesh.positions.len())).bench(|| write(&mesh));
}

#[divan::bench(sample_count = 10, sample_size = 1)]
fn parse_640x360(bencher: Bencher<'_, '_>) {
    let mesh = mesh();
    let packets = write(&mesh);
    bencher.counter(ItemsCount::new(mesh.positions.len())).bench(|| {
        let mut parser = SlabParser::new(Limits::default());
        for packet in &packets {
            parser.parse_packet(&packet.data).expect("what was written");
        }
        parser
    });
}
