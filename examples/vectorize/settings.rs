//! The encoder's settings as options of a command line: a preset, and what is to differ from it.

use clap::{Args, ValueEnum};
use tetvec::{EncoderConfig, ErrorMetric, LatticeKind, SpeedPreset, TopologyRule};

/// Options of the encoder.
#[derive(Debug, Clone, Args)]
pub(crate) struct Settings {
    /// Time spent against error reached; the options below override what it sets.
    #[arg(long, value_enum, default_value_t = Preset::Medium)]
    preset: Preset,
    /// Vertices of the mesh over pixels of the source.
    #[arg(long, default_value_t = 0.01)]
    simplification_ratio: f64,
    /// Mean absolute error to simplify up to, in levels; 0: off.
    #[arg(long, default_value_t = 0.0)]
    target_error: f64,
    /// Kilobits a second; 0: off.
    #[arg(long, default_value_t = 0)]
    bitrate: u32,
    /// Most frames from one keyframe to the next.
    #[arg(long, default_value_t = 60)]
    key_int_max: u32,
    /// Length of the sliding window in frames.
    #[arg(long)]
    window: Option<u32>,
    /// Mean number of superpixels a frame; 0: chosen by content; 1: no discontinuities.
    #[arg(long)]
    superpixels: Option<u32>,
    /// Levels of subdivision that the stream is to be drawn with.
    #[arg(long)]
    subdivision_levels: Option<u8>,
    /// What the mesh starts from.
    #[arg(long, value_enum)]
    lattice: Option<Lattice>,
    /// Vertices that an adaptive lattice starts with for each that is to be left.
    #[arg(long)]
    lattice_density: Option<f64>,
    /// Steps of the position optimisation.
    #[arg(long)]
    position_steps: Option<u32>,
    /// Fits on the way to the goal.
    #[arg(long)]
    refits: Option<u32>,
    /// Use the paper's error metric.
    #[arg(long)]
    paper_metric: bool,
    /// How strictly the topology of labels is kept.
    #[arg(long, value_enum)]
    topology: Option<Topology>,
    /// Worker threads; 0: all cores.
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Topology {
    Auto,
    Free,
    Strict,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Preset {
    Fast,
    Medium,
    Slow,
    Paper,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum Lattice {
    Adaptive,
    Dense,
}

impl Settings {
    /// The configuration for pictures of this size.
    pub(crate) fn config(&self, width: u32, height: u32) -> EncoderConfig {
        let preset = match self.preset {
            Preset::Fast => SpeedPreset::Fast,
            Preset::Medium => SpeedPreset::Medium,
            Preset::Slow => SpeedPreset::Slow,
            Preset::Paper => SpeedPreset::Paper,
        };
        let base = EncoderConfig::new(width, height).with_preset(preset);
        let lattice = self.lattice.map(|lattice| match lattice {
            Lattice::Adaptive => LatticeKind::Adaptive,
            Lattice::Dense => LatticeKind::Dense,
        });
        let topology = self.topology.map(|topology| match topology {
            Topology::Auto => TopologyRule::Auto,
            Topology::Free => TopologyRule::Free,
            Topology::Strict => TopologyRule::Strict,
        });
        EncoderConfig {
            simplification_ratio: self.simplification_ratio,
            target_error: self.target_error,
            bitrate: self.bitrate,
            key_int_max: self.key_int_max,
            window: self.window.unwrap_or(base.window),
            superpixels: self.superpixels.unwrap_or(base.superpixels),
            subdivision_levels: self.subdivision_levels.unwrap_or(base.subdivision_levels),
            lattice: lattice.unwrap_or(base.lattice),
            lattice_density: self.lattice_density.unwrap_or(base.lattice_density),
            position_steps: self.position_steps.unwrap_or(base.position_steps),
            refits: self.refits.unwrap_or(base.refits),
            error_metric: if self.paper_metric { ErrorMetric::Paper } else { base.error_metric },
            topology: topology.unwrap_or(base.topology),
            threads: self.threads,
            ..base
        }
    }
}
