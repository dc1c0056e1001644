//! One jump between two readings, before and after which a slope moves alike: a phase that a radar counted wrongly, an instrument that was
//! knocked, a single slip. It is no acceleration, and would look like one for as long as it is among the newest readings.

use super::past_event::median;
use crate::fit::{Observation, Observations, displacement_sigma};
use crate::reading::Quantity;
use std::borrow::Cow;

/// Among so many of the newest readings a jump is looked for.
const LOOKED_AT: usize = 128;
/// It is so many standard errors of a reading,
const AWAY: f64 = 6.0;
/// and so many times the next largest step: a slope that moves in slips jumps again and again.
const ABOVE_NEXT: f64 = 2.0;
/// So many readings after it, and before it, show how the slope moves; and the most that are looked at.
const FEWEST_AFTER: usize = 4;
const FEWEST_BEFORE: usize = 12;
const MOST: usize = 24;
/// Alike: after it the slope moved no farther than before, but for so many standard errors and this share of the jump.
const ALIKE: f64 = 5.0;
const SHARE: f64 = 0.4;

/// The observations without such a jump: those before it are moved by it.
pub(super) fn without_isolated_step(observations: Cow<'_, Observations>) -> Cow<'_, Observations> {
    let Some((at, jump)) = isolated_step(&observations) else {
        return observations;
    };
    let mut moved = observations.into_owned();
    for one in &mut moved.values[..at] {
        one.value += jump;
    }
    Cow::Owned(moved)
}

/// Before which reading the slope jumped, and how much of that, mm, is to be taken off.
fn isolated_step(observations: &Observations) -> Option<(usize, f64)> {
    let values = &observations.values;
    if observations.quantity != Quantity::Displacement {
        return None;
    }
    let first = values.len().saturating_sub(LOOKED_AT).max(1);
    let step = |at: usize| (values[at].value - values[at - 1].value).abs();
    let at = (first..values.len()).max_by(|a, b| step(*a).total_cmp(&step(*b)))?;
    if at < FEWEST_BEFORE || at + FEWEST_AFTER > values.len() {
        return None;
    }
    let others = (first..values.len()).filter(|other| *other != at);
    let next = others.map(step).fold(0.0, f64::max);
    let sigma = displacement_sigma(values);
    if step(at) <= (AWAY * sigma).max(ABOVE_NEXT * next) {
        return None;
    }
    let before = &values[at.saturating_sub(MOST)..at];
    let after = &values[at..values.len().min(at + MOST)];
    let usual = rate(before);
    let jump = values[at].value
        - values[at - 1].value
        - usual * (values[at].t_days - values[at - 1].t_days);
    let (first, last) = (after.first()?, after.last()?);
    let moved = last.value - first.value - usual * (last.t_days - first.t_days);
    let most = (ALIKE * std::f64::consts::SQRT_2 * sigma).min(SHARE * jump.abs());
    // From one reading to the next the chance should not come and go: less of a jump is taken off, the less alike the motion is.
    let share = (2.5 * (1.0 - moved.abs() / most)).min(1.0);
    (share > 0.0).then_some((at, share * jump))
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
        let left = without_isolated_step(Cow::Borrowed(observations));
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
        // It jumps again.
        let again = |hour: u32| jump(hour) + if hour >= 220 { 7.0 } else { 0.0 };
        assert!(moved_in_all(&creeping(240, again)) > 34.0);
        // The last readings of a collapse.
        let collapse = |hour: u32| 20.0 * (240.0 / (240.0 - f64::from(hour))).ln();
        let moved = moved_in_all(&creeping(240, collapse));
        assert!(
            (moved - creeping(240, collapse).values[239].value).abs() < 1.0,
            "{moved}"
        );
    }
}
