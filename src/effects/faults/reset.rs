//! A covariate's zero jumps: its sensor was moved or set again. Found by quiet before and after.

use super::nature::Nature;
use super::trace::{Trace, extreme, resolution};
use crate::effects::quantiles::{median, robust_deviation};
use crate::reading::RunningTotal;

/// Samples on either side whose steps a jump is measured against.
const BESIDE: usize = 6;
/// Samples there must be on either side.
const LEAST_BESIDE: usize = 4;
/// A jump over the largest step about it.
const OUT_OF_STEPS: f64 = 8.0;
/// The same where another channel is reset within a sample: both loggers were in hand.
const OUT_OF_STEPS_TOGETHER: f64 = 4.0;
/// A jump over the robust deviation of all steps.
const OUT_OF_SCATTER: f64 = 10.0;
/// The same beside another channel's reset.
const OUT_OF_SCATTER_TOGETHER: f64 = 6.0;
/// How far the median level must follow the jump, and how far it may overshoot it.
const LEVEL_FOLLOWS: (f64, f64) = (0.6, 1.6);
/// A rise this many samples before a fall at most, within so many steps and of this share of it,
/// makes both a flood.
const PULSE_BEFORE: usize = 12;
const PULSE_STEPS: usize = 3;
const PULSE_SHARE: f64 = 0.6;
/// Samples after in which the old level must not return, and how near to it.
const RETURN_AFTER: usize = 20;
const RETURN_NEAR: f64 = 0.5;
/// A gap longer than this many usual intervals hides whether anything jumped.
const GAP: f64 = 3.0;
/// The straddling sample of a mean taken over the reset shows this share of it at least.
const STRADDLES: f64 = 0.15;
/// More jumps than this are the channel's way.
const MOST: usize = 6;
/// Jumps as large as this are expected in the channel's own tail this often, at most.
const CHANCE: f64 = 0.02;

/// A jump of a channel's zero.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ChannelReset {
    /// The first sample that is off.
    pub from: usize,
    /// The first one wholly on the new zero; those between straddle the reset.
    pub settled: usize,
    /// New zero less old, in the channel's unit.
    pub size: f64,
}

/// The resets that one channel shows by itself, in time order.
pub(super) fn resets(trace: &Trace, nature: Nature) -> Vec<ChannelReset> {
    if nature.is_rain() {
        return set_back(trace);
    }
    if nature.has_peaks() {
        return Vec::new();
    }
    let scatter = scatter(trace);
    let mut jumps = peaks(trace, scatter);
    jumps.sort_by(|a, b| b.prominence.total_cmp(&a.prominence));
    let count = standing_alone(&jumps);
    let mut found: Vec<ChannelReset> = jumps[..count]
        .iter()
        .filter(|jump| jump.reset.size.abs() > OUT_OF_SCATTER * scatter)
        .filter(|jump| persists(trace, &jump.reset))
        .map(|jump| jump.reset)
        .collect();
    found.sort_by_key(|reset| reset.from);
    found
}

/// Where a running total of rain is set back: what it was counts on.
fn set_back(trace: &Trace) -> Vec<ChannelReset> {
    let total = RunningTotal::of(&trace.values);
    let set_back = total.map_or_else(Vec::new, |total| total.set_back);
    let resets = set_back.into_iter().map(|from| ChannelReset {
        from,
        settled: from,
        size: -trace.values[from - 1],
    });
    resets.collect()
}

/// The largest jump of `trace` that begins within one sampling interval of `days` (on the trace's
/// own clock), held to less: for channels beside one that was reset then.
pub(super) fn reset_near(trace: &Trace, nature: Nature, days: f64) -> Option<ChannelReset> {
    if nature.has_peaks() {
        return None;
    }
    let interval = median(&trace.intervals());
    let scatter = scatter(trace);
    let near = trace
        .days
        .partition_point(|day| *day < days - 1.01 * interval)
        ..trace
            .days
            .partition_point(|day| *day <= days + 1.01 * interval);
    near.filter_map(|from| jump_at(trace, from, scatter, interval))
        .filter(|jump| jump.prominence > OUT_OF_STEPS_TOGETHER)
        .filter(|jump| jump.reset.size.abs() > OUT_OF_SCATTER_TOGETHER * scatter)
        .max_by(|a, b| a.prominence.total_cmp(&b.prominence))
        .map(|jump| jump.reset)
}

/// Takes the jumps out: what follows is shifted back, and the samples that straddle a reset, which
/// belong to neither zero, are marked.
pub(super) fn corrected(values: &[f64], resets: &[ChannelReset]) -> (Vec<f64>, Vec<bool>) {
    let mut values = values.to_vec();
    let mut straddles = vec![false; values.len()];
    for reset in resets {
        straddles[reset.from..reset.settled].fill(true);
        for value in &mut values[reset.settled..] {
            *value -= reset.size;
        }
    }
    (values, straddles)
}

/// The usual step from sample to sample, one of the resolution at least.
fn scatter(trace: &Trace) -> f64 {
    robust_deviation(&trace.increments()).max(resolution(&trace.values))
}

/// A reset and how far it stands above the steps about it.
#[derive(Debug, Clone, Copy)]
struct Jump {
    reset: ChannelReset,
    prominence: f64,
}

/// The locally most prominent jumps.
fn peaks(trace: &Trace, scatter: f64) -> Vec<Jump> {
    let interval = median(&trace.intervals());
    let jumps: Vec<Option<Jump>> = (0..trace.len())
        .map(|from| jump_at(trace, from, scatter, interval))
        .collect();
    let prominence = |at: usize| jumps[at].map_or(0.0, |jump| jump.prominence);
    let is_peak = |at: &usize| {
        let around = at.saturating_sub(BESIDE)..(at + BESIDE + 1).min(jumps.len());
        around
            .filter(|other| other != at)
            .all(|other| (prominence(other), other) < (prominence(*at), *at))
    };
    (0..jumps.len())
        .filter(is_peak)
        .filter_map(|at| jumps[at])
        .collect()
}

/// The jump whose first sample is `from`: from one sample to the next, or with one between that
/// straddles it.
fn jump_at(trace: &Trace, from: usize, scatter: f64, interval: f64) -> Option<Jump> {
    let straddled = measured(trace, from, from + 1, scatter, interval).filter(|jump| {
        let first = trace.values[from] - trace.values[from - 1];
        let share = first / jump.reset.size;
        (STRADDLES..=1.0 - STRADDLES).contains(&share)
    });
    let clean = measured(trace, from, from, scatter, interval);
    [straddled, clean]
        .into_iter()
        .flatten()
        .max_by(|a, b| a.prominence.total_cmp(&b.prominence))
}

fn measured(
    trace: &Trace,
    from: usize,
    settled: usize,
    scatter: f64,
    interval: f64,
) -> Option<Jump> {
    let low = from.saturating_sub(BESIDE);
    let high = (settled + BESIDE).min(trace.len());
    let is_short = from - low < LEAST_BESIDE || high < settled + LEAST_BESIDE;
    if is_short || has_gap(&trace.days[low..high], interval) {
        return None;
    }
    let values = &trace.values;
    let steps = |range: std::ops::Range<usize>| {
        let pairs = values[range].windows(2);
        pairs.map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>()
    };
    let mut beside = steps(low..from);
    beside.extend(steps(settled..high));
    let drift = median(&beside);
    let deviations: Vec<f64> = beside.iter().map(|step| step - drift).collect();
    let size = values[settled] - values[from - 1] - drift * (settled + 1 - from) as f64;
    // Steps smaller than half the usual scatter are no quieter than those.
    let largest = extreme(&deviations).max(0.5 * scatter);
    let middles = 0.5 * (settled + high) as f64 - 0.5 * (low + from) as f64;
    let shift = median(&values[settled..high]) - median(&values[low..from]) - drift * middles;
    let follows = shift / size;
    let prominence = if (LEVEL_FOLLOWS.0..=LEVEL_FOLLOWS.1).contains(&follows) {
        size.abs() / largest
    } else {
        0.0
    };
    let reset = ChannelReset {
        from,
        settled,
        size,
    };
    Some(Jump { reset, prominence })
}

fn has_gap(days: &[f64], interval: f64) -> bool {
    days.windows(2)
        .any(|pair| pair[1] - pair[0] > GAP * interval)
}

/// How many of the most prominent jumps are none of the channel's own: each passes the threshold,
/// and the tail of those below it (Hill's estimate of a power law) hardly reaches so far.
fn standing_alone(jumps: &[Jump]) -> usize {
    let prominence: Vec<f64> = jumps.iter().map(|jump| jump.prominence.max(0.1)).collect();
    let passing = prominence.iter().take_while(|p| **p > OUT_OF_STEPS).count();
    (1..=passing.min(MOST))
        .rev()
        .find(|&count| {
            let rest = &prominence[count..];
            let tail = (rest.len() / 20).max(8).min(rest.len().saturating_sub(1));
            if tail < 3 {
                return false;
            }
            let threshold = rest[tail];
            let excess: f64 = rest[..tail].iter().map(|p| (p / threshold).ln()).sum();
            let reach = (prominence[count - 1] / threshold).ln();
            let expected = tail as f64 * (-reach * tail as f64 / excess.max(1e-9)).exp();
            expected < CHANCE
        })
        .unwrap_or(0)
}

/// Whether the new level stays, and is no return from a short flood.
fn persists(trace: &Trace, reset: &ChannelReset) -> bool {
    let values = &trace.values;
    let (size, sign) = (reset.size.abs(), reset.size.signum());
    let earlier = &values[reset.from.saturating_sub(PULSE_BEFORE)..reset.from];
    let is_end_of_pulse = (1..=PULSE_STEPS).any(|steps| {
        let rises = earlier.iter().zip(earlier.iter().skip(steps));
        rises
            .map(|(from, to)| (from - to) * sign)
            .any(|opposite| opposite > PULSE_SHARE * size)
    });
    let before = median(&values[reset.from.saturating_sub(LEAST_BESIDE)..reset.from]);
    // A lake that fell before goes on to fall; a flood does not go on to rise.
    let steps = values[reset.from.saturating_sub(BESIDE)..reset.from].windows(2);
    let drift = median(&steps.map(|pair| pair[1] - pair[0]).collect::<Vec<f64>>());
    let later = &values[reset.settled..(reset.settled + RETURN_AFTER).min(values.len())];
    let returns = (0..).map(f64::from).zip(later).any(|(steps, value)| {
        let off = |drift: f64| (value - before - drift * (steps + 1.0)) * sign;
        off(drift).max(off(0.0)) < RETURN_NEAR * size
    });
    !is_end_of_pulse && !returns
}
