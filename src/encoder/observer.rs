//! What an encoder tells about its work while it works. It knows no clock: who wants times takes them.

use crate::vectorize::fit::FitReport;
use crate::vectorize::simplify::SimplifyReport;

/// A stage of the encoder, in the order of the flow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// Labels of a frame.
    Segment,
    /// Lattice of a run of frames, split between labels.
    Lattice,
    /// Edge collapse.
    Simplify,
    /// Surfaces, positions, colours.
    Fit,
    /// Packets.
    Write,
}

impl Stage {
    /// All stages.
    pub const ALL: [Self; 5] = [Self::Segment, Self::Lattice, Self::Simplify, Self::Fit, Self::Write];

    /// Its name, in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Segment => "segment",
            Self::Lattice => "lattice",
            Self::Simplify => "simplify",
            Self::Fit => "fit",
            Self::Write => "write",
        }
    }
}

/// What happened.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Event {
    /// A stage began; the one before, if any, has ended.
    Began(Stage),
    /// The stage that began last has ended.
    Ended,
    /// Edges were collapsed.
    Simplified(SimplifyReport),
    /// Vertices were fitted.
    Fitted(FitReport),
}

/// Who is told.
#[derive(Default)]
pub(super) struct Observer(pub(super) Option<Box<dyn FnMut(Event) + Send>>);

impl Observer {
    pub(super) fn tell(&mut self, event: Event) {
        if let Some(told) = &mut self.0 {
            told(event);
        }
    }

    /// Does the work of a stage.
    pub(super) fn stage<T>(&mut self, stage: Stage, work: impl FnOnce() -> T) -> T {
        self.tell(Event::Began(stage));
        let result = work();
        self.tell(Event::Ended);
        result
    }
}
