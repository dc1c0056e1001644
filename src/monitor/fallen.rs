//! A displacement that falls back at once and goes on from there: the instrument has another zero, for no slope moves
//! upslope like that.

use super::history::History;
use super::motion::settled;
use crate::fit::{Observation, RateOptions};
use crate::reading::suspicion::scatter_of;
use crate::reading::{Quantity, Timestamp};

/// So many readings after a fall show that it was no spike, and as many before it that nothing else was.
const CONFIRMING: usize = 4;
/// The readings, the newest, from which the usual step is learnt; fewer than the least show nothing.
const INSPECTED: usize = 200;
const FEWEST_READINGS: usize = 16;
/// A fall is larger than so many times the usual scatter of a step. Of normal noise none is in a lifetime of readings.
const LEAP: f64 = 12.0;
/// The readings on either side lie within this share of the fall of one another.
const APART_SHARE: f64 = 0.25;
/// What was taken for a reset may come back within this time, days; later a jump as large is motion,
const LONGEST_OFFSET_DAYS: f64 = 30.0;
/// and so it is where the readings before it moved by more than this share of it.
const STILL: f64 = 0.25;

impl History {
    /// Since which reading the displacement stands lower, and by what it jumped there, mm (negative), where the newest reading
    /// is the last of those that confirm it.
    pub(super) fn fallen_back(&self) -> Option<(Timestamp, f64)> {
        let values = &self.observations.values;
        let at = values.len().checked_sub(CONFIRMING)?;
        if self.observations.quantity != Quantity::Displacement || at < FEWEST_READINGS {
            return None;
        }
        let from = at.saturating_sub(INSPECTED);
        let (before, after) = (&values[at - CONFIRMING..at], &values[at..]);
        let fall = before[CONFIRMING - 1].value - after[0].value;
        // The whole window is sorted only for a fall that stands out among its neighbours.
        let is_near = |pair: &[Observation]| (pair[1].value - pair[0].value).abs() * 2.0 < fall;
        if !before.windows(2).all(is_near) || !after.windows(2).all(is_near) {
            return None;
        }
        let steps = values[from..at]
            .windows(2)
            .map(|pair| pair[1].value - pair[0].value);
        let (_, scatter) = scatter_of(&steps.collect::<Vec<f64>>())?;
        let has_come_forward = values[at - 1].value - values[from].value >= -LEAP * scatter;
        let is_level = |of: &[Observation]| spread(of) <= APART_SHARE * fall;
        if fall < LEAP * scatter || !has_come_forward || !is_level(before) || !is_level(after) {
            return None;
        }
        let rates = self.observations.rates(from..at, RateOptions::default());
        let velocity = settled(&rates).unwrap_or(0.0);
        let jumps = before.iter().zip(after).map(|(before, after)| {
            after.value - before.value - velocity * (after.t_days - before.t_days)
        });
        let jump = jumps.sum::<f64>() / CONFIRMING as f64;
        Some((self.time(after[0].t_days)?, jump))
    }
}

impl History {
    /// Whether the newest reading has come back by what a reset found at `time`, of this jump, has taken off: it was none, but
    /// an offset that has passed. So it is only where the readings before it stood still beside that, and no longer after.
    pub(super) fn has_come_back(&self, (time, jump): (Timestamp, f64)) -> bool {
        let values = &self.observations.values;
        let Some(from) = values.len().checked_sub(CONFIRMING + 1) else {
            return false;
        };
        let (newest, before) = (&values[values.len() - 1], &values[from..values.len() - 1]);
        let step = newest.value - before[CONFIRMING - 1].value;
        let is_still = spread(before) <= STILL * step;
        let age = newest.t_days - self.days(time);
        is_still && (step + jump).abs() <= APART_SHARE * jump.abs() && age <= LONGEST_OFFSET_DAYS
    }
}

/// The largest less the least value.
fn spread(of: &[Observation]) -> f64 {
    let values = || of.iter().map(|one| one.value);
    values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
}
