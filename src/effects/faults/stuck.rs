//! The same value over and over, where the instrument's own noise says that it should move.

use super::trace::{Trace, extreme, resolutions, symbols};
use crate::effects::quantiles::median;
use std::ops::Range;

/// Fewer equal values are never called stuck.
const SHORTEST: usize = 6;
/// Where more increments than this vanish outside long runs, the resolution is coarse.
const COARSE: f64 = 0.1;
/// The least chance taken for a vanishing increment: what stands still tends to go on so.
const CHANCE_OF_REST: f64 = 0.1;
/// A run this unlikely anywhere in the file is stuck.
const CHANCE: f64 = 1e-3;
/// The noise beside a run, in steps of the resolution, under which standing still is possible.
const NOISE_STEPS: f64 = 5.0;
/// The same where all steps beside it go one way: that is the ground's motion, which may pause.
const MOTION_STEPS: f64 = 50.0;
/// How many values before and after a run show the noise there.
const BESIDE: usize = 12;

/// The runs of equal values that are no measurements; in each the first value may be one.
pub(super) fn stuck_runs(trace: &Trace) -> Vec<Range<usize>> {
    let values = &trace.values;
    let runs = runs_of_equal(&symbols(values, extreme(values)));
    let long: Vec<Range<usize>> = runs.into_iter().filter(|r| r.len() >= SHORTEST).collect();
    if long.is_empty() {
        return long;
    }
    let resting = resting_share(values, &long);
    if resting > COARSE {
        return Vec::new();
    }
    let chance_of_rest = CHANCE_OF_REST.max(2.0 * resting);
    let steps = resolutions(values);
    let mut stuck = long;
    stuck.retain(|run| {
        let power = i32::try_from(run.len() - 1).unwrap_or(i32::MAX);
        let is_unlikely = values.len() as f64 * chance_of_rest.powi(power) < CHANCE;
        is_unlikely && is_among_noise(values, run, median(&steps))
    });
    stuck
}

fn runs_of_equal(symbols: &[u32]) -> Vec<Range<usize>> {
    let mut runs = Vec::new();
    let mut start = 0;
    for end in 1..=symbols.len() {
        if end == symbols.len() || symbols[end] != symbols[start] {
            runs.push(start..end);
            start = end;
        }
    }
    runs
}

/// The share of increments that vanish outside `runs`.
fn resting_share(values: &[f64], runs: &[Range<usize>]) -> f64 {
    let mut inside = vec![false; values.len()];
    for run in runs {
        inside[run.start + 1..run.end].fill(true);
    }
    let free: Vec<bool> = (1..values.len())
        .filter(|&index| !inside[index])
        .map(|index| (values[index] - values[index - 1]).abs() < f64::EPSILON)
        .collect();
    let rests = free.iter().filter(|rest| **rest).count();
    rests as f64 / free.len().max(1) as f64
}

/// Whether the values before the run, and after it where there are any, scatter by many steps of
/// the resolution: a coarse instrument on a slope that rests shows the same value too.
fn is_among_noise(values: &[f64], run: &Range<usize>, step: f64) -> bool {
    let before = &values[run.start.saturating_sub(BESIDE)..run.start];
    let after = &values[run.end..(run.end + BESIDE).min(values.len())];
    let is_noisy = |values: &[f64]| {
        let bends = values.windows(3).map(|v| (v[0] - 2.0 * v[1] + v[2]).abs());
        let moves = || values.windows(2).map(|pair| pair[1] - pair[0]);
        let goes_one_way = moves().all(|step| step >= 0.0) || moves().all(|step| step <= 0.0);
        let steps = if goes_one_way {
            MOTION_STEPS
        } else {
            NOISE_STEPS
        };
        median(&bends.collect::<Vec<f64>>()) >= steps * step
    };
    before.len() >= SHORTEST && is_noisy(before) && (after.len() < SHORTEST || is_noisy(after))
}
