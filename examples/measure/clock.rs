//! Time in two ways: by the wall, and what the process's threads worked, which other programs on the machine do not change.

use std::ops::AddAssign;
use std::time::{Duration, Instant};

/// A span of time.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Spent {
    /// By the wall.
    pub(crate) wall: Duration,
    /// Work of all threads; nothing where the system does not say.
    pub(crate) work: Duration,
}

impl AddAssign for Spent {
    fn add_assign(&mut self, other: Self) {
        self.wall += other.wall;
        self.work += other.work;
    }
}

/// A moment to measure from.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Clock {
    start: Instant,
    work: Duration,
}

impl Clock {
    /// Starts now.
    pub(crate) fn start() -> Self {
        Self { start: Instant::now(), work: work().unwrap_or_default() }
    }

    /// Since the start.
    pub(crate) fn spent(&self) -> Spent {
        Spent { wall: self.start.elapsed(), work: work().unwrap_or_default().saturating_sub(self.work) }
    }
}

/// Work of the process so far: user and system time of /proc/self/stat, in hundredths of a second (proc(5)).
fn work() -> Option<Duration> {
    const TICK: Duration = Duration::from_millis(10);
    let stat = std::fs::read_to_string("/proc/self/stat").ok()?;
    // The program's name, in brackets, may hold spaces.
    let (_, fields) = stat.rsplit_once(") ")?;
    let mut times = fields.split(' ').skip(11).map_while(|field| field.parse::<u32>().ok());
    Some(TICK * times.next()?.checked_add(times.next()?)?)
}
