//! What an encoding has done so far, as the application is told: times of the stages, counts, memory. In: the core's
//! events. Out: structures for the bus.
//!
//! Forbidden here: the bus itself, frames, packets' contents.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use gst::prelude::*;
use tetvec::vectorize::simplify::{Refusal, RefusalCounts};
use tetvec::{Encoder, Event, Stage};

/// Least time from one report to the next, the last one excepted.
const INTERVAL: Duration = Duration::from_secs(1);

/// What the core's events add up to.
#[derive(Debug, Default)]
struct Work {
    /// The stage at work and when it began.
    began: Option<(Stage, Instant)>,
    /// Time spent in each stage, in the order of [`Stage::ALL`].
    times: [Duration; Stage::ALL.len()],
    collapses: u64,
    evaluations: u64,
    refusals: RefusalCounts,
    /// What the last fit reached.
    fit_rms: Option<f64>,
}

impl Work {
    /// Adds what happened at `now`.
    fn note(&mut self, event: Event, now: Instant) {
        match event {
            Event::Began(stage) => self.began = Some((stage, now)),
            Event::Ended => {
                if let Some((stage, began)) = self.began.take() {
                    self.times[stage as usize] += now.saturating_duration_since(began);
                }
            }
            Event::Simplified(report) => {
                self.collapses += report.collapses;
                self.evaluations += report.evaluations;
                self.refusals.add(&report.refusals);
            }
            Event::Fitted(report) => self.fit_rms = Some(report.rms_after),
        }
    }

    fn time(&self, stage: Stage) -> u64 {
        u64::try_from(self.times[stage as usize].as_nanos()).unwrap_or(u64::MAX)
    }

    fn refusals(&self) -> gst::Structure {
        let counts = Refusal::ALL.map(|refusal| (name_of(refusal), self.refusals.count(refusal).to_send_value()));
        gst::Structure::from_iter("refusals", counts)
    }
}

/// Follows one encoding.
#[derive(Debug)]
pub(super) struct Progress {
    work: Arc<Mutex<Work>>,
    frames_in: u64,
    packets_out: u64,
    reported: Option<Instant>,
}

impl Progress {
    /// Follows what `encoder` does from now on.
    pub(super) fn of(encoder: &mut Encoder) -> Self {
        let work = Arc::new(Mutex::new(Work::default()));
        let noted = Arc::clone(&work);
        encoder.observe(move |event| lock(&noted).note(event, Instant::now()));
        Self { work, frames_in: 0, packets_out: 0, reported: None }
    }

    /// Counts a frame that the encoder took.
    pub(super) fn count_frame(&mut self) {
        self.frames_in += 1;
    }

    /// Counts a picture's packet that the encoder gave.
    pub(super) fn count_packet(&mut self) {
        self.packets_out += 1;
    }

    /// Whether the last report is old.
    pub(super) fn is_due(&self) -> bool {
        self.reported.is_none_or(|reported| reported.elapsed() >= INTERVAL)
    }

    /// What to tell the application; `vertices` are those of the slabs that have ended.
    pub(super) fn report(&mut self, vertices: u64) -> gst::Structure {
        self.reported = Some(Instant::now());
        let work = lock(&self.work);
        let structure = gst::Structure::builder("tetvecenc-progress")
            .field("frames-in", self.frames_in)
            .field("packets-out", self.packets_out)
            .field("vertices", vertices);
        Stage::ALL
            .into_iter()
            .fold(structure, |structure, stage| structure.field(format!("time-{}", stage.name()), work.time(stage)))
            .field("collapses", work.collapses)
            .field("evaluations", work.evaluations)
            .field("refusals", work.refusals())
            .field_if_some("fit-rms", work.fit_rms)
            .field_if_some("memory", peak_memory())
            .build()
    }
}

fn lock(work: &Mutex<Work>) -> MutexGuard<'_, Work> {
    work.lock().unwrap_or_else(PoisonError::into_inner)
}

fn name_of(refusal: Refusal) -> &'static str {
    match refusal {
        Refusal::Frozen => "frozen",
        Refusal::Sides => "sides",
        Refusal::Labels => "labels",
        Refusal::Link => "link",
        Refusal::Flip => "flip",
        Refusal::Sliver => "sliver",
        Refusal::Extent => "extent",
    }
}

/// Most bytes that the process has had resident so far, where the system says (Linux).
fn peak_memory() -> Option<u64> {
    peak_in(&std::fs::read_to_string("/proc/self/status").ok()?)
}

/// The peak that the text of `/proc/self/status` names; its kB are 1024 bytes.
fn peak_in(status: &str) -> Option<u64> {
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = peak.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    use super::{Work, peak_in};
    use std::time::{Duration, Instant};
    use tetvec::vectorize::fit::FitReport;
    use tetvec::vectorize::simplify::SimplifyReport;
    use tetvec::{Event, Stage};

    #[test]
    fn stages_are_timed_apart_and_added_up() {
        let (mut work, start) = (Work::default(), Instant::now());
        for (event, second) in [
            (Event::Began(Stage::Lattice), 0),
            (Event::Ended, 2),
            (Event::Began(Stage::Fit), 5),
            (Event::Ended, 6),
            (Event::Began(Stage::Lattice), 7),
            (Event::Ended, 10),
            (Event::Began(Stage::Write), 10),
        ] {
            work.note(event, start + Duration::from_secs(second));
        }
        let seconds = Stage::ALL.map(|stage| work.time(stage) / 1_000_000_000);
        assert_eq!(seconds, [0, 5, 0, 1, 0]);
    }

    #[test]
    fn collapses_add_up_and_the_last_fit_counts() {
        let (mut work, now) = (Work::default(), Instant::now());
        assert_eq!(work.fit_rms, None);
        for rms_after in [3.0, 2.0] {
            work.note(Event::Simplified(SimplifyReport { collapses: 4, evaluations: 9, ..Default::default() }), now);
            work.note(Event::Fitted(FitReport { rms_after, ..Default::default() }), now);
        }
        assert_eq!((work.collapses, work.evaluations, work.fit_rms), (8, 18, Some(2.0)));
    }

    #[test]
    fn the_peak_is_read_where_it_is_said() {
        assert_eq!(peak_in("VmPeak:\t   9 kB\nVmHWM:\t    1234 kB\nVmRSS:\t 7 kB\n"), Some(1234 * 1024));
        assert_eq!(peak_in("Name:\ttest\n"), None);
        assert_eq!(peak_in("VmHWM:\t18446744073709551615 kB\n"), None);
    }
}
