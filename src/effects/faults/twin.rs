//! Two channels that are one instrument but for jumps, as a raw logger beside its corrected values.

use super::reset::ChannelReset;
use super::trace::{Trace, extreme, resolution};

/// Fewer common samples show nothing.
const FEWEST: usize = 50;
/// Share of either channel's samples that the other must have too.
const COMMON: f64 = 0.8;
/// Share of the steps over which the difference must stay the same.
const SAME: f64 = 0.95;
/// Share of the steps in which the channels themselves must move, for their agreement to mean anything.
const MOVING: f64 = 0.5;
/// Rounding of both channels, in steps of the coarser resolution.
const ROUNDING: f64 = 1.5;
/// A jump of the difference under this many roundings is not distinguished from rounding.
const JUMP: f64 = 2.5;
/// Samples over which one jump may be spread: a mean taken over it.
const STRADDLES: usize = 2;

/// How two channels go together.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Twins {
    /// The jumps of `first` less `second`, as resets of the first: indices are the first's.
    pub of_first: Vec<ChannelReset>,
    /// The same, as resets of the second.
    pub of_second: Vec<ChannelReset>,
    /// Whether the first is the one that jumps.
    pub first_jumps: bool,
}

/// The jumps between two channels that otherwise give the same to the last digit; `None` where they
/// do not, or never differ.
pub(super) fn twins(first: &Trace, second: &Trace) -> Option<Twins> {
    let common = common_samples(first, second);
    let least = COMMON * first.len().max(second.len()) as f64;
    if common.len() < FEWEST || (common.len() as f64) < least {
        return None;
    }
    let differences: Vec<f64> = common
        .iter()
        .map(|&(a, b)| first.values[a] - second.values[b])
        .collect();
    let scale = extreme(&first.values).max(extreme(&second.values));
    let coarser = resolution(&first.values).max(resolution(&second.values));
    let rounding = ROUNDING * coarser.max(1e-9 * scale);
    let steps = |index: usize| differences[index] - differences[index - 1];
    let count = differences.len() - 1;
    let still = (1..=count)
        .filter(|&at| steps(at).abs() <= rounding)
        .count();
    let moving = common
        .windows(2)
        .filter(|pair| (first.values[pair[1].0] - first.values[pair[0].0]).abs() > rounding)
        .count();
    if (still as f64) < SAME * count as f64 || (moving as f64) < MOVING * count as f64 {
        return None;
    }
    let jumps = jumps(&differences, rounding);
    if jumps.is_empty() {
        return None;
    }
    let contrast = |trace: &Trace, index: fn(&(usize, usize)) -> usize| -> f64 {
        let of_jump = |jump: &(usize, usize, f64)| {
            contrast(trace, index(&common[jump.0]), index(&common[jump.1]))
        };
        jumps.iter().map(of_jump).sum()
    };
    let of = |index: fn(&(usize, usize)) -> usize, sign: f64| -> Vec<ChannelReset> {
        let reset = |&(from, settled, size): &(usize, usize, f64)| ChannelReset {
            from: index(&common[from]),
            settled: index(&common[settled]),
            size: sign * size,
        };
        jumps.iter().map(reset).collect()
    };
    Some(Twins {
        first_jumps: contrast(first, |pair| pair.0) >= contrast(second, |pair| pair.1),
        of_first: of(|pair| pair.0, 1.0),
        of_second: of(|pair| pair.1, -1.0),
    })
}

/// Indices into both of the samples taken at the same instant.
fn common_samples(first: &Trace, second: &Trace) -> Vec<(usize, usize)> {
    let of = |(index, time)| Some((index, second.times.binary_search(time).ok()?));
    first.times.iter().enumerate().filter_map(of).collect()
}

/// The stretches over which the difference changes: first sample off, first one settled, size.
fn jumps(differences: &[f64], rounding: f64) -> Vec<(usize, usize, f64)> {
    let mut jumps = Vec::new();
    let mut at = 1;
    while at < differences.len() {
        let mut settled = at;
        while settled + 1 < differences.len()
            && settled - at < STRADDLES
            && (differences[settled + 1] - differences[settled]).abs() > rounding
        {
            settled += 1;
        }
        let size = differences[settled] - differences[at - 1];
        let first = (differences[at] - differences[at - 1]).abs();
        if first > rounding && size.abs() > JUMP * rounding {
            jumps.push((at, settled, size));
            at = settled;
        }
        at += 1;
    }
    jumps
}

/// Square of the step over a jump, less the steps before and after it.
fn contrast(trace: &Trace, from: usize, settled: usize) -> f64 {
    let step = |from: usize, to: usize| match (trace.values.get(from), trace.values.get(to)) {
        (Some(a), Some(b)) => b - a,
        (None, _) | (_, None) => 0.0,
    };
    let before = step(from.saturating_sub(2), from.saturating_sub(1));
    let after = step(settled, settled + 1);
    let over = step(from.saturating_sub(1), settled);
    (over - 0.5 * (before + after) * (settled + 1 - from) as f64).powi(2)
}
