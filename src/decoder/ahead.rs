//! Packets on the way to the decoder: those that wait, and those that are parsed ahead of the pictures before them.
//!
//! In: packets, in order. Out: what each brought, in the same order. One thread at a time parses: a worker of the pool,
//! or whoever waits for a packet that nobody is at. So nobody waits for a worker that others keep busy, and without
//! threads all is done when it is asked for.

use std::any::Any;
use std::collections::VecDeque;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};

use super::reader::{Parsed, Reader};

/// Bytes of meshes that are parsed and not yet taken; beyond it nothing more is parsed ahead.
#[cfg(feature = "threads")]
const MOST_BYTES: usize = 64 << 20;

/// What parsing gave, or what it panicked with.
type Outcome = Result<Parsed, Box<dyn Any + Send>>;

/// The threads that parse.
#[cfg(feature = "threads")]
pub(super) type Pool = Option<rayon::ThreadPool>;

/// Packets before and after parsing.
#[derive(Debug)]
pub(super) struct Ahead {
    shared: Arc<Shared>,
}

#[derive(Debug)]
struct Shared {
    state: Mutex<State>,
    /// Somebody has parsed a packet.
    parsed: Condvar,
}

#[derive(Debug)]
struct State {
    /// `None` while a thread parses with it.
    reader: Option<Box<Reader>>,
    waiting: VecDeque<Vec<u8>>,
    parsed: VecDeque<Outcome>,
    /// Of the meshes in `parsed`.
    bytes: usize,
    /// A worker is at it, or will be.
    #[cfg(feature = "threads")]
    has_worker: bool,
}

impl State {
    /// What a thread needs to parse the next packet.
    fn begin(&mut self) -> Option<(Box<Reader>, Vec<u8>)> {
        if self.waiting.is_empty() {
            return None;
        }
        Some((self.reader.take()?, self.waiting.pop_front()?))
    }

    #[cfg(feature = "threads")]
    fn is_full(&self) -> bool {
        self.bytes >= MOST_BYTES
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Parses a packet, without the lock, and notes what it brought.
    fn parse<'a>(
        &'a self,
        state: MutexGuard<'a, State>,
        (mut reader, packet): (Box<Reader>, Vec<u8>),
    ) -> MutexGuard<'a, State> {
        drop(state);
        let outcome = catch_unwind(AssertUnwindSafe(|| reader.read(packet)));
        if outcome.is_err() {
            *reader = Reader::new();
        }
        let mut state = self.lock();
        state.bytes += bytes(&outcome);
        state.parsed.push_back(outcome);
        state.reader = Some(reader);
        self.parsed.notify_all();
        state
    }

    /// Parses as long as there is something to parse and room for it.
    #[cfg(feature = "threads")]
    fn work(&self) {
        let mut state = self.lock();
        while !state.is_full() {
            let Some(task) = state.begin() else { break };
            state = self.parse(state, task);
        }
        state.has_worker = false;
    }
}

fn bytes(outcome: &Outcome) -> usize {
    outcome.as_ref().map_or(0, Parsed::bytes)
}

impl Ahead {
    pub(super) fn new() -> Self {
        let state = State {
            reader: Some(Box::new(Reader::new())),
            waiting: VecDeque::new(),
            parsed: VecDeque::new(),
            bytes: 0,
            #[cfg(feature = "threads")]
            has_worker: false,
        };
        Self { shared: Arc::new(Shared { state: Mutex::new(state), parsed: Condvar::new() }) }
    }

    /// Takes a packet.
    pub(super) fn push(&self, packet: Vec<u8>) {
        self.shared.lock().waiting.push_back(packet);
    }

    /// Sees to it that a worker parses what waits.
    #[cfg(feature = "threads")]
    pub(super) fn hurry(&self, pool: &Pool) {
        {
            let mut state = self.shared.lock();
            if state.has_worker || state.waiting.is_empty() || state.is_full() {
                return;
            }
            state.has_worker = true;
        }
        let shared = Arc::clone(&self.shared);
        match pool {
            Some(pool) => pool.spawn(move || shared.work()),
            None => rayon::spawn(move || shared.work()),
        }
    }

    /// What the oldest packet brought; `None` if there is none.
    pub(super) fn next(&self) -> Option<Parsed> {
        let mut state = self.shared.lock();
        loop {
            if let Some(outcome) = state.parsed.pop_front() {
                state.bytes -= bytes(&outcome);
                drop(state);
                return Some(outcome.unwrap_or_else(|panic| resume_unwind(panic)));
            }
            if let Some(task) = state.begin() {
                state = self.shared.parse(state, task);
            } else if state.reader.is_some() {
                return None;
            } else {
                state = self.shared.parsed.wait(state).unwrap_or_else(PoisonError::into_inner);
            }
        }
    }

    /// Parses a packet here and now. There must be no other packets: [`Self::next`] has said so.
    pub(super) fn parse_now(&self, packet: &[u8]) -> Parsed {
        // Another stands in, in case that this one panics.
        let reader = self.shared.lock().reader.replace(Box::new(Reader::new()));
        let mut reader = reader.unwrap_or_else(|| Box::new(Reader::new()));
        let parsed = reader.read(packet.to_vec());
        self.shared.lock().reader = Some(reader);
        parsed
    }

    /// Forgets the packets that wait. Hands out what those brought that were parsed, once it is known what the one brings
    /// that is being parsed: packets that are the same need not be parsed again.
    pub(super) fn flush(&self) -> Vec<Parsed> {
        let mut state = self.shared.lock();
        state.waiting.clear();
        while state.reader.is_none() {
            state = self.shared.parsed.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        if let Some(reader) = &mut state.reader {
            reader.flush();
        }
        state.bytes = 0;
        // After a panic nothing is known.
        state.parsed.drain(..).filter_map(Result::ok).collect()
    }
}

impl Drop for Ahead {
    /// A worker that is at a packet ends after it.
    fn drop(&mut self) {
        self.shared.lock().waiting.clear();
    }
}
