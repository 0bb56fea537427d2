//! Runs a fuzz target on stable, without coverage: `drive TARGET SECONDS [SEED]`, or `drive TARGET FILE...` for given inputs.
//!
//! Seeds are the conformance vectors and what lies in `corpus/TARGET`. An input that panics, or takes longer than a minute, is
//! kept in `artifacts` and ends the run.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use tetvec_fuzz::{TARGETS, Target};

/// Longest input.
const MAX_BYTES: usize = 1 << 14;
/// An input that takes longer is a finding.
const PATIENCE: Duration = Duration::from_secs(60);

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let target = arguments.first().and_then(|name| TARGETS.into_iter().find(|(known, _)| known == name));
    let (Some(target), Some(what)) = (target, arguments.get(1)) else {
        eprintln!("usage: drive {{{}}} SECONDS [SEED] | FILE...", TARGETS.map(|(name, _)| name).join(","));
        return ExitCode::FAILURE;
    };
    if let Ok(seconds) = what.parse() {
        let seed = arguments.get(2).and_then(|seed| seed.parse().ok()).unwrap_or(1);
        return drive(target, Duration::from_secs(seconds), seed);
    }
    for file in &arguments[1..] {
        (target.1)(&std::fs::read(file).expect("a readable file"));
    }
    ExitCode::SUCCESS
}

fn drive((name, target): Target, time: Duration, seed: u64) -> ExitCode {
    let seeds = seeds(name);
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let start = Instant::now();
    let (mut runs, mut longest) = (0u64, Duration::ZERO);
    std::panic::set_hook(Box::new(|panic| eprintln!("{panic}")));
    while start.elapsed() < time {
        let input = if runs < seeds.len() as u64 { seeds[runs as usize].clone() } else { mutate(&seeds, &mut random) };
        let began = Instant::now();
        let result = catch_unwind(AssertUnwindSafe(|| target(&input)));
        let took = began.elapsed();
        runs += 1;
        longest = longest.max(took);
        if result.is_err() || took > PATIENCE {
            let path = root().join("artifacts").join(format!("{name}-{seed}-{runs}"));
            std::fs::create_dir_all(root().join("artifacts")).expect("a folder");
            std::fs::write(&path, &input).expect("a file");
            eprintln!("{name}: finding after {runs} runs, {took:?}: {}", path.display());
            return ExitCode::FAILURE;
        }
    }
    println!("{name}: {runs} runs in {} s, the longest {longest:?}, no finding", time.as_secs());
    ExitCode::SUCCESS
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// The conformance vectors of all versions, and the target's corpus.
fn seeds(name: &str) -> Vec<Vec<u8>> {
    let mut seeds = Vec::new();
    collect(&root().join("../tests/bitstream/vectors"), &mut seeds);
    collect(&root().join("corpus").join(name), &mut seeds);
    seeds
}

fn collect(folder: &Path, seeds: &mut Vec<Vec<u8>>) {
    let Ok(entries) = std::fs::read_dir(folder) else { return };
    let mut paths: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    paths.sort_unstable();
    for path in paths {
        if path.is_dir() {
            collect(&path, seeds);
        } else if path.extension().is_none_or(|extension| extension != "txt") {
            seeds.extend(std::fs::read(path));
        }
    }
}

/// One of the seeds with some damage.
fn mutate(seeds: &[Vec<u8>], random: &mut Random) -> Vec<u8> {
    let mut input = seeds[random.below(seeds.len())].clone();
    for _ in 0..=random.below(6) {
        let at = random.below(input.len() + 1);
        let most = [2, 8, 64, 512][random.below(4)];
        let count = random.below(1 + most).min(input.len() - at);
        let any = random.below(256) as u8;
        let fixed = [0, 1, 0x7f, 0x80, 0xff, any][random.below(6)];
        match random.below(8) {
            0 | 1 if at < input.len() => input[at] ^= 1 << random.below(8),
            2 if at < input.len() => input[at] = fixed,
            3 => drop(input.drain(at..at + count)),
            4 => drop(input.splice(at..at, std::iter::repeat_n(fixed, count).collect::<Vec<_>>())),
            5 => input[at..at + count].iter_mut().for_each(|byte| *byte = random.below(256) as u8),
            6 => {
                let again = input[at..at + count].to_vec();
                let to = random.below(input.len() + 1);
                drop(input.splice(to..to, again));
            }
            _ => {
                let other = &seeds[random.below(seeds.len())];
                let from = random.below(other.len() + 1);
                input.truncate(at);
                input.extend_from_slice(&other[from..]);
            }
        }
    }
    input.truncate(MAX_BYTES);
    input
}

/// A small generator of pseudo-random numbers (xorshift).
struct Random(u64);

impl Random {
    /// Uniform in [0, bound).
    fn below(&mut self, bound: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        ((u128::from(self.0) * bound as u128) >> 64) as usize
    }
}
