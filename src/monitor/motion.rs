//! What the newest rates show by themselves.

use crate::alert::AlertEvidence;
use crate::fit::{Observations, Rate};
use crate::reading::{Quantity, Timestamp};

/// The line goes through this share of the rates, newest last, and no fewer than [`FEWEST_IN_LINE`].
const LINE_SHARE: f64 = 0.25;
const FEWEST_IN_LINE: usize = 8;
/// Rates whose median is the settled velocity.
const SETTLED: usize = 5;
/// A settled velocity is a new highest from this factor on.
const HIGHER: f64 = 1.25;

/// The newest rates, through which the line goes.
pub(crate) fn recent(rates: &[Rate]) -> &[Rate] {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a count within the slice"
    )]
    let share = (rates.len() as f64 * LINE_SHARE).round() as usize;
    &rates[rates.len().saturating_sub(share.max(FEWEST_IN_LINE))..]
}

/// Whether all of the latest rates stand clear of their noise on the wrong side of zero.
pub(super) fn moves_backwards(rates: &[Rate]) -> bool {
    let latest = &rates[rates.len().saturating_sub(SETTLED)..];
    latest.len() == SETTLED
        && latest
            .iter()
            .all(|rate| rate.velocity < -3.0 * rate.sigma && rate.velocity < 0.0)
}

/// The median of the latest rates, mm/day.
pub(super) fn settled(rates: &[Rate]) -> Option<f64> {
    let mut latest: Vec<f64> = rates
        .iter()
        .rev()
        .take(SETTLED)
        .map(|rate| rate.velocity)
        .collect();
    latest.sort_by(f64::total_cmp);
    latest.get(latest.len() / 2).copied()
}

/// The standard error of the median of the latest rates, mm/day.
fn settled_error(rates: &[Rate]) -> f64 {
    // Of a normal variable that of the median is 1.25 times that of the mean.
    const OF_THE_MEDIAN: f64 = 1.25;
    let latest = &rates[rates.len().saturating_sub(SETTLED)..];
    let mut errors: Vec<f64> = latest.iter().map(|rate| rate.sigma).collect();
    errors.sort_by(f64::total_cmp);
    let middle = errors.get(errors.len() / 2).copied().unwrap_or(0.0);
    OF_THE_MEDIAN * middle / (SETTLED as f64).sqrt()
}

/// The highest settled velocity, mm/day.
pub(super) fn fastest(rates: &[Rate]) -> Option<f64> {
    let windows = rates.windows(SETTLED);
    windows.filter_map(settled).reduce(f64::max)
}

/// Whether the settled velocity is higher than ever before by more than chance would have it; so it is, too,
/// with too few rates to know.
pub(super) fn is_new_highest(rates: &[Rate]) -> bool {
    let Some(earlier) = rates.len().checked_sub(SETTLED) else {
        return true;
    };
    match (fastest(&rates[..earlier]), settled(rates)) {
        (Some(highest), Some(now)) => now > HIGHER * highest,
        (None, _) | (_, None) => true,
    }
}

/// What `observations` up to `now` and their rates show of the motion.
pub(super) fn observed(
    observations: &Observations,
    rates: &[Rate],
    now: Timestamp,
) -> AlertEvidence {
    let newest = rates.last().map(|rate| rate.velocity);
    AlertEvidence {
        now,
        velocity_mm_per_day: newest.or_else(|| newest_velocity(observations)),
        settled_velocity_mm_per_day: settled(rates),
        settled_error_mm_per_day: settled_error(rates),
        displacement_mm: displacement_mm(observations),
        acceleration_mm_per_day2: acceleration(rates),
        ..AlertEvidence::default()
    }
}

fn acceleration(rates: &[Rate]) -> Option<f64> {
    let [.., before, newest] = rates else {
        return None;
    };
    let span = newest.middle() - before.middle();
    (span > 0.0).then(|| (newest.velocity - before.velocity) / span)
}

/// Displacement since the first reading, mm, where displacement is what is measured.
fn displacement_mm(observations: &Observations) -> Option<f64> {
    let [first, .., newest] = observations.values.as_slice() else {
        return Some(0.0).filter(|_| observations.quantity == Quantity::Displacement);
    };
    (observations.quantity == Quantity::Displacement).then_some(newest.value - first.value)
}

/// The velocity that the newest readings show by themselves, mm/day.
fn newest_velocity(observations: &Observations) -> Option<f64> {
    let values = &observations.values;
    match observations.quantity {
        Quantity::Velocity => values.last().map(|newest| newest.value),
        Quantity::Displacement => {
            let [.., before, newest] = values.as_slice() else {
                return None;
            };
            Some((newest.value - before.value) / (newest.t_days - before.t_days))
        }
    }
}
