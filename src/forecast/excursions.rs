//! Displacements that leave the course and come back within a few readings: no slope does that, and each of them would look like
//! the end of a motion for as long as the record lasts.

use crate::fit::{Observation, Observations, displacement_sigma};
use crate::reading::Quantity;
use std::borrow::Cow;

/// Readings away from the course, at most.
const MOST_AWAY: usize = 3;
/// So many standard errors of a reading they are away, at least,
const AWAY: f64 = 6.0;
/// and farther than the slope moves meanwhile; each of them by this share of the farthest.
const ALIKE: f64 = 0.5;
/// Fewer readings show nothing.
const FEWEST_READINGS: usize = 10;

/// The observations without those that left the course and came back for two readings at least. The newest ones always stay: they may be the
/// first of a motion.
pub(super) fn without_excursions(observations: &Observations) -> Cow<'_, Observations> {
    let values = &observations.values;
    if observations.quantity != Quantity::Displacement || values.len() < FEWEST_READINGS {
        return Cow::Borrowed(observations);
    }
    let away = AWAY * displacement_sigma(values);
    let steps = values.windows(2).map(|w| (w[1].value - w[0].value).abs());
    if steps.fold(0.0, f64::max) <= away {
        return Cow::Borrowed(observations);
    }
    let mut kept: Vec<Observation> = Vec::with_capacity(values.len());
    let mut next = 0;
    while next < values.len() {
        if let Some(before) = kept.last() {
            next += excursion(before, &values[next..], away);
        }
        kept.push(values[next]);
        next += 1;
    }
    Cow::Owned(Observations {
        values: kept,
        ..*observations
    })
}

/// How many of the first of `later` left the straight line from `before` to the one after them: none or a few, and two at least are left.
fn excursion(before: &Observation, later: &[Observation], away: f64) -> usize {
    if (later[0].value - before.value).abs() <= away {
        return 0;
    }
    let comes_back = |count: &usize| {
        let back = &later[*count];
        let moved = back.value - before.value;
        let velocity = moved / (back.t_days - before.t_days);
        let off =
            |one: &Observation| one.value - before.value - velocity * (one.t_days - before.t_days);
        let farthest = later[..*count]
            .iter()
            .map(off)
            .fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        let share = |one: &Observation| off(one) / farthest;
        // One reading that is back may be the wrong one: the next has to be back as well.
        farthest.abs() > away.max(moved.abs())
            && later[..*count].iter().all(|one| share(one) >= ALIKE)
            && share(&later[*count + 1]).abs() < ALIKE
    };
    let most = MOST_AWAY.min(later.len().saturating_sub(2));
    (1..=most).find(comes_back).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn creeping(off: impl Fn(u32) -> f64) -> Observations {
        let noise = |day: u32| f64::from(day * 7 % 5) / 5.0 - 0.4;
        let at = |day: u32| (f64::from(day), 3.0 * f64::from(day) + noise(day) + off(day));
        Observations::of_displacements((0..60).map(at))
    }

    fn days_left_out(observations: &Observations) -> Vec<u32> {
        let kept = without_excursions(observations);
        let is_kept = |day: &u32| {
            let mut days = kept.values.iter().map(|one| one.t_days - f64::from(*day));
            days.any(|apart| apart.abs() < 0.5)
        };
        (0..60).filter(|day| !is_kept(day)).collect()
    }

    #[test]
    fn readings_that_come_back_are_left_out_and_a_slip_a_reset_and_the_newest_stay() {
        let within = |days: std::ops::Range<u32>, by: f64| {
            creeping(move |day| if days.contains(&day) { by } else { 0.0 })
        };
        assert_eq!(days_left_out(&within(30..32, 400.0)), [30, 31]);
        assert_eq!(days_left_out(&within(30..31, -150.0)), [30]);
        assert_eq!(days_left_out(&within(30..36, 400.0)), Vec::<u32>::new());
        assert_eq!(days_left_out(&within(30..60, 400.0)), Vec::<u32>::new());
        assert_eq!(days_left_out(&within(30..60, -400.0)), Vec::<u32>::new());
        assert_eq!(days_left_out(&within(57..58, 400.0)), [57]);
        assert_eq!(days_left_out(&within(58..59, 400.0)), Vec::<u32>::new());
        // A slip of which the third reading is wrong.
        let slip = creeping(|day| match day {
            30 | 32.. => 90.0,
            _ => 0.0,
        });
        assert_eq!(days_left_out(&slip), [31]);
        assert_eq!(days_left_out(&within(59..60, 400.0)), Vec::<u32>::new());
        assert_eq!(days_left_out(&within(0..1, 400.0)), Vec::<u32>::new());
    }
}
