//! Properties that are a choice of a few: the core's enumerations as GObject knows them.

use gst::glib;

/// Time spent against error reached.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, glib::Enum)]
#[enum_type(name = "GstTetvecEncSpeedPreset")]
#[repr(i32)]
pub enum SpeedPreset {
    /// A coarse lattice, short windows, positions not fitted.
    #[enum_value(name = "A coarse lattice, short windows, colours alone fitted", nick = "fast")]
    Fast = 0,
    /// Whole slabs, positions and colours fitted.
    #[default]
    #[enum_value(name = "Whole slabs, positions and colours fitted", nick = "medium")]
    Medium = 1,
    /// The same from a finer lattice, with more steps.
    #[enum_value(name = "The same from a finer lattice, with more steps", nick = "slow")]
    Slow = 2,
    /// The paper's choices.
    #[enum_value(name = "As in the paper: dense lattice, labels, strict topology, its metric", nick = "paper")]
    Paper = 3,
}

impl From<SpeedPreset> for tetvec::SpeedPreset {
    fn from(preset: SpeedPreset) -> Self {
        match preset {
            SpeedPreset::Fast => Self::Fast,
            SpeedPreset::Medium => Self::Medium,
            SpeedPreset::Slow => Self::Slow,
            SpeedPreset::Paper => Self::Paper,
        }
    }
}

/// What the mesh starts from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, glib::Enum)]
#[enum_type(name = "GstTetvecEncLattice")]
#[repr(i32)]
pub enum Lattice {
    /// Bisected where colours or labels ask for it.
    #[default]
    #[enum_value(name = "Bisected where colours or labels ask for it", nick = "adaptive")]
    Adaptive = 0,
    /// One vertex a pixel and frame.
    #[enum_value(name = "One vertex a pixel and frame, as in the paper", nick = "dense")]
    Dense = 1,
}

impl From<Lattice> for tetvec::LatticeKind {
    fn from(lattice: Lattice) -> Self {
        match lattice {
            Lattice::Adaptive => Self::Adaptive,
            Lattice::Dense => Self::Dense,
        }
    }
}

impl From<tetvec::LatticeKind> for Lattice {
    fn from(lattice: tetvec::LatticeKind) -> Self {
        match lattice {
            tetvec::LatticeKind::Adaptive => Self::Adaptive,
            tetvec::LatticeKind::Dense => Self::Dense,
        }
    }
}

/// How strictly labels' topology is kept.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, glib::Enum)]
#[enum_type(name = "GstTetvecEncTopology")]
#[repr(i32)]
pub enum Topology {
    /// Changes have their price.
    #[default]
    #[enum_value(name = "What changes it has its price", nick = "auto")]
    Auto = 0,
    /// Regions may merge and pinch.
    #[enum_value(name = "Regions may merge and pinch", nick = "free")]
    Free = 1,
    /// Regions stay as they were labelled.
    #[enum_value(name = "Regions and their borders stay connected as they are, as in the paper", nick = "strict")]
    Strict = 2,
}

impl From<Topology> for tetvec::TopologyRule {
    fn from(topology: Topology) -> Self {
        match topology {
            Topology::Auto => Self::Auto,
            Topology::Free => Self::Free,
            Topology::Strict => Self::Strict,
        }
    }
}

impl From<tetvec::TopologyRule> for Topology {
    fn from(topology: tetvec::TopologyRule) -> Self {
        match topology {
            tetvec::TopologyRule::Auto => Self::Auto,
            tetvec::TopologyRule::Free => Self::Free,
            tetvec::TopologyRule::Strict => Self::Strict,
        }
    }
}

/// What the simplification measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, glib::Enum)]
#[enum_type(name = "GstTetvecEncErrorMetric")]
#[repr(i32)]
pub enum ErrorMetric {
    /// Squared colour error at a fixed (x, y, t).
    #[default]
    #[enum_value(name = "Squared colour error at a fixed place and time", nick = "colour")]
    Color = 0,
    /// Squared distance in (x, y, t, r, g, b).
    #[enum_value(name = "Squared distance in space, time and colour, as in the paper", nick = "paper")]
    Paper = 1,
}

impl From<ErrorMetric> for tetvec::ErrorMetric {
    fn from(metric: ErrorMetric) -> Self {
        match metric {
            ErrorMetric::Color => Self::Color,
            ErrorMetric::Paper => Self::Paper,
        }
    }
}

impl From<tetvec::ErrorMetric> for ErrorMetric {
    fn from(metric: tetvec::ErrorMetric) -> Self {
        match metric {
            tetvec::ErrorMetric::Color => Self::Color,
            tetvec::ErrorMetric::Paper => Self::Paper,
        }
    }
}
