//! Which pictures to draw.

use std::str::FromStr;

/// Times to draw at, in frames.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Times {
    /// Every frame that the stream has.
    All,
    /// These, ascending.
    At(Vec<f64>),
}

/// Most pictures that are asked for by number.
const MAX_PICTURES: u64 = 1_000_000;

impl FromStr for Times {
    type Err = String;

    /// `all`, or ranges `a..b` (b left out) and single times, which may lie between frames, separated by commas.
    fn from_str(text: &str) -> Result<Self, String> {
        if text == "all" {
            return Ok(Self::All);
        }
        let mut times = Vec::new();
        for word in text.split(',') {
            match word.split_once("..") {
                Some((first, end)) => {
                    let bound = |bound: &str| bound.parse::<u64>().map_err(|error| format!("{word}: {error}"));
                    let (first, end) = (bound(first)?, bound(end)?);
                    if first >= end || end - first > MAX_PICTURES {
                        return Err(format!("{word}: expected 1 to {MAX_PICTURES} frames"));
                    }
                    times.extend((first..end).map(|frame| frame as f64));
                }
                None => times.push(parse_time(word)?),
            }
        }
        times.sort_by(f64::total_cmp);
        times.dedup();
        Ok(Self::At(times))
    }
}

/// A time of at least 0, in frames.
pub(crate) fn parse_time(word: &str) -> Result<f64, String> {
    let time: f64 = word.parse().map_err(|error| format!("{word}: {error}"))?;
    if time.is_finite() && time >= 0.0 { Ok(time) } else { Err(format!("{word}: expected a time of at least 0")) }
}

/// Four numbers separated by commas.
pub(crate) fn parse_viewport(text: &str) -> Result<tetvec::Viewport, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(str::parse).collect();
    match numbers.map_err(|error| format!("{text}: {error}"))?[..] {
        [x, y, width, height] => {
            let viewport = tetvec::Viewport { x, y, width, height };
            viewport.check().map(|()| viewport).map_err(|error| error.to_string())
        }
        _ => Err(format!("{text}: expected x,y,width,height")),
    }
}
