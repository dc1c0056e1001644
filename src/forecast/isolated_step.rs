//! Jumps between two readings, before and after which a slope moves alike: a phase that a radar counted wrongly, an instrument that was
//! knocked, a single slip. Such a jump is no acceleration, and would look like one for as long as it is among the newest readings.

use super::past_event::median;
use crate::fit::{Observation, Observations, displacement_sigma};
use crate::reading::Quantity;
use std::borrow::Cow;

/// Most jumps of a record, each so many times the largest step that is none: a slope that moves in slips jumps again and again.
const MOST_JUMPS: usize = 3;
const ABOVE_OTHERS: f64 = 2.0;
/// Jumps of which one is so many times that before it are slips that grow.
const GROWN: f64 = 1.5;
/// A jump is so many standard errors of a reading.
const LEAST: f64 = 6.0;
/// Between readings that are further apart than so many usual intervals a step may be motion that nobody saw: it has to be over for longer.
const GAP: f64 = 3.0;
/// So many readings after it, and before it (and after it in a gap), show how the slope moves; and the most that are looked at.
const FEWEST_AFTER: usize = 4;
const FEWEST_BEFORE: usize = 12;
const MOST_BESIDE: usize = 24;
/// The drift after it that is nothing at all: so many of its own standard errors, and this share of the jump; of half as much more nothing is
/// taken off.
const DRIFT: f64 = 3.0;
const SHARE: f64 = 0.15;
/// Of normal numbers the median has so many times the standard error of the mean.
const OF_THE_MEDIAN: f64 = 1.25;

/// The observations without such jumps: those before one are moved by it.
pub(super) fn without_isolated_steps(observations: Cow<'_, Observations>) -> Cow<'_, Observations> {
    let jumps = isolated_steps(&observations);
    if jumps.is_empty() {
        return observations;
    }
    let mut moved = observations.into_owned();
    for (at, jump) in jumps {
        for one in &mut moved.values[..at] {
            one.value += jump;
        }
    }
    Cow::Owned(moved)
}

/// Before which readings the slope jumped, and how much of that, mm, is to be taken off.
fn isolated_steps(observations: &Observations) -> Vec<(usize, f64)> {
    let values = &observations.values;
    if observations.quantity != Quantity::Displacement || values.len() < FEWEST_BEFORE {
        return Vec::new();
    }
    let mut spans: Vec<f64> = values
        .windows(2)
        .map(|two| two[1].t_days - two[0].t_days)
        .collect();
    let longest = GAP * median(&mut spans);
    let is_seen = |at: usize| values[at].t_days - values[at - 1].t_days <= longest;
    let size = |at: usize| (values[at].value - values[at - 1].value).abs();
    let mut largest: Vec<usize> = (1..values.len()).collect();
    let by_size = |a: &usize, b: &usize| size(*b).total_cmp(&size(*a));
    // All steps of a long record need not be in order to know the largest.
    largest.select_nth_unstable_by(MOST_JUMPS, by_size);
    largest.truncate(MOST_JUMPS + 1);
    largest.sort_unstable_by(by_size);
    let is_apart = |two: &[usize]| size(two[0]) > ABOVE_OTHERS * size(two[1]);
    let Some(last) = largest.windows(2).rposition(is_apart) else {
        return Vec::new();
    };
    let sigma = displacement_sigma(values);
    let mut jumps = largest[..=last].to_vec();
    jumps.retain(|at| size(*at) > LEAST * sigma);
    jumps.sort_unstable();
    let grow = |two: &[usize]| size(two[1]) > GROWN * size(two[0]);
    if jumps.windows(2).any(grow) {
        return Vec::new();
    }
    let each = jumps.iter().enumerate().filter_map(|(place, &at)| {
        // Other jumps are no part of how the slope moves beside this one.
        let from = place.checked_sub(1).map_or(0, |before| jumps[before]);
        let until = jumps.get(place + 1).copied().unwrap_or(values.len());
        let (before, after) = (&values[from..at], &values[at..until]);
        let fewest = if is_seen(at) {
            FEWEST_AFTER
        } else {
            FEWEST_BEFORE
        };
        let is_known = before.len() >= FEWEST_BEFORE && after.len() >= fewest;
        let jump = is_known.then(|| to_take_off(before, after, sigma))??;
        Some((at, jump))
    });
    each.collect()
}

/// How much, mm, of the jump between these readings `before` and `after` it is taken off; `None` where the slope moves otherwise after it.
fn to_take_off(before: &[Observation], after: &[Observation], sigma: f64) -> Option<f64> {
    let before = &before[before.len().saturating_sub(MOST_BESIDE)..];
    let after = &after[..after.len().min(MOST_BESIDE)];
    let (usual, newest) = (rate(before), before.last()?);
    let off = |one: &Observation| one.value - newest.value - usual * (one.t_days - newest.t_days);
    let middle = |some: &[Observation]| median(&mut some.iter().map(off).collect::<Vec<f64>>());
    let (first, last) = after.split_at(after.len() / 2);
    let jump = middle(first) - middle(&before[before.len() - FEWEST_AFTER..]);
    let drift = (middle(last) - middle(first)).abs();
    let error = OF_THE_MEDIAN * sigma * (2.0 / first.len() as f64).sqrt();
    let most = (DRIFT * error).max(SHARE * jump.abs());
    // From one reading to the next the chance should not come and go: less is taken off, the less alike the motion is.
    let share = (3.0 - 2.0 * drift / most).clamp(0.0, 1.0);
    (share > 0.0).then_some(share * jump)
}

/// The velocity of some readings, mm/day: the median of those over half of them.
fn rate(values: &[Observation]) -> f64 {
    let half = values.len() / 2;
    let pairs = values.iter().zip(&values[half..]);
    let mut rates: Vec<f64> = pairs
        .map(|(from, to)| (to.value - from.value) / (to.t_days - from.t_days))
        .collect();
    median(&mut rates)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hourly readings of a slope of 2 mm/day, read to .5 mm, which moves by so much more.
    fn creeping(count: u32, more: impl Fn(u32) -> f64) -> Observations {
        let noise = |hour: u32| f64::from(hour * 7 % 5) / 5.0 - 0.4;
        let at = |hour: u32| {
            (
                f64::from(hour) / 24.0,
                f64::from(hour) / 12.0 + noise(hour) + more(hour),
            )
        };
        Observations::of_displacements((0..count).map(at))
    }

    fn moved_in_all(observations: &Observations) -> f64 {
        let left = without_isolated_steps(Cow::Borrowed(observations));
        left.values[left.values.len() - 1].value - left.values[0].value
    }

    #[test]
    fn a_jump_before_and_after_which_a_slope_moves_alike_is_taken_off_and_a_motion_is_not() {
        let jump = |hour: u32| if hour >= 200 { 8.6 } else { 0.0 };
        let left = moved_in_all(&creeping(240, jump));
        assert!((left - 20.0).abs() < 2.0, "{left}");
        // Two readings later it may be the first of a motion.
        assert!(moved_in_all(&creeping(202, jump)) > 24.0);
        // It goes on ten times as fast.
        let goes_on = |hour: u32| jump(hour) + 0.8 * f64::from(hour.saturating_sub(200));
        assert!(moved_in_all(&creeping(240, goes_on)) > 58.0);
        // Weeks later it is none either, and another one beside it.
        assert!((moved_in_all(&creeping(800, jump)) - 800.0 / 12.0).abs() < 2.0);
        let again = |hour: u32| jump(hour) + if hour >= 420 { 7.0 } else { 0.0 };
        assert!((moved_in_all(&creeping(480, again)) - 40.0).abs() < 2.0);
        // Slips that grow are motion, and so are many.
        let growing = |hour: u32| match hour {
            0..100 => 0.0,
            100..150 => 4.0,
            150..200 => 14.0,
            _ => 39.0,
        };
        assert!(moved_in_all(&creeping(240, growing)) > 58.0);
        let slips = |hour: u32| 7.0 * f64::from(hour / 40);
        assert!(moved_in_all(&creeping(240, slips)) > 54.0);
        // The last readings of a collapse.
        let collapse = |hour: u32| 20.0 * (240.0 / (240.0 - f64::from(hour))).ln();
        let moved = moved_in_all(&creeping(240, collapse));
        assert!(
            (moved - creeping(240, collapse).values[239].value).abs() < 1.0,
            "{moved}"
        );
    }

    #[test]
    fn a_gap_neither_hides_a_jump_nor_is_one() {
        let steady = creeping(800, |hour| {
            0.4 * f64::from(hour) + if hour >= 700 { 20.0 } else { 0.0 }
        });
        let mut gap = steady.clone();
        gap.values.drain(620..680);
        assert!(
            (moved_in_all(&gap) - moved_in_all(&steady)).abs() < 1.0,
            "{}",
            moved_in_all(&gap)
        );
        let moved = steady.values[799].value - steady.values[0].value;
        assert!(
            (moved - moved_in_all(&gap) - 20.0).abs() < 2.0,
            "{}",
            moved_in_all(&gap)
        );
    }
}
