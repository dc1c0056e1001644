//! A slope that since some readings moves many times as fast as ever before. No simulated slope on which the network was trained did so and went on, but for
//! jumps, resets and changes of rate that end there; what it says of such a slope is no guide, and falls as the slope is faster. A faster slope is no
//! less likely to collapse than one that moves alike and slower, so that the same motion slowed down gives a bound. One or two such intervals may be a
//! jump of the instrument; then the slope moves as it did before, and that gives one.

use crate::fit::{Observation, Observations, displacement_sigma, velocity_sigma};
use crate::reading::Quantity;

/// How many times the highest velocity before the newest motion is, at least, and what it is slowed down to. Steps of 2 to 32 times were tried:
/// on daily readings that stay there the chance within 30 days was .92, .86, .68, .39 and .25 on the first day.
const FASTER: f64 = 4.0;
/// So many intervals in a row are motion; fewer may be a jump of the instrument.
const FEWEST_INTERVALS: usize = 3;
/// The newest intervals that are looked at.
const MOST_INTERVALS: usize = 128;
/// No interval of the newest motion is slower than this share of what is asked of three.
const SLOWEST: f64 = 0.5;
/// Standard errors by which the newest velocities stand out.
const CLEAR_ERRORS: f64 = 2.0;

/// The observations with the newest motion slowed down to [`FASTER`] times the highest velocity before, or, in its first intervals, to that velocity;
/// `None` where it is no faster.
pub(super) fn slowed(observations: &Observations) -> Option<Observations> {
    let values = &observations.values;
    let motion = SuddenMotion::of(observations)?;
    let (from, share) = motion.sudden().or_else(|| motion.first())?;
    let (before, newest) = values.split_at(from + 1);
    let last = before.last()?.value;
    let slower = |one: &Observation| Observation {
        value: match observations.quantity {
            Quantity::Displacement => last + share * (one.value - last),
            Quantity::Velocity => share * one.value,
        },
        ..*one
    };
    let values = before.iter().copied().chain(newest.iter().map(slower));
    Some(Observations {
        values: values.collect(),
        ..*observations
    })
}

/// Velocities over one interval and over [`FEWEST_INTERVALS`], by the reading at which they end; mm/day.
struct SuddenMotion {
    one: Vec<f64>,
    three: Vec<f64>,
    /// Standard error of the latter.
    error: Vec<f64>,
}

impl SuddenMotion {
    fn of(observations: &Observations) -> Option<Self> {
        let values = &observations.values;
        if values.len() <= 2 * FEWEST_INTERVALS {
            return None;
        }
        let (sigma, is_moved) = match observations.quantity {
            Quantity::Displacement => (displacement_sigma(values) * std::f64::consts::SQRT_2, true),
            Quantity::Velocity => (
                velocity_sigma(values) / (FEWEST_INTERVALS as f64).sqrt(),
                false,
            ),
        };
        let over = |at: usize, back: usize| {
            let before = &values[at.saturating_sub(back)];
            if is_moved {
                (values[at].value - before.value) / (values[at].t_days - before.t_days)
            } else {
                let some = &values[(at + 1).saturating_sub(back)..=at];
                some.iter().map(|one| one.value).sum::<f64>() / some.len() as f64
            }
        };
        let error = |at: usize| {
            if is_moved {
                sigma / (values[at].t_days - values[at.saturating_sub(FEWEST_INTERVALS)].t_days)
            } else {
                sigma
            }
        };
        let each = || 0..values.len();
        let known = |of: f64| if of.is_finite() { of } else { 0.0 };
        Some(Self {
            one: each().map(|at| known(over(at, 1))).collect(),
            three: each().map(|at| known(over(at, FEWEST_INTERVALS))).collect(),
            error: each().map(|at| known(error(at))).collect(),
        })
    }

    /// After which of the newest readings the slope moves so fast, one or two intervals long, and what share of that it moved by before.
    fn first(&self) -> Option<(usize, f64)> {
        let count = self.one.len();
        let steps = (1..FEWEST_INTERVALS).rev().map(|long| count - 1 - long);
        let mut found = steps.filter_map(|from| {
            let before = self.three[FEWEST_INTERVALS..=from]
                .iter()
                .copied()
                .fold(0.0, f64::max);
            let error = FEWEST_INTERVALS as f64 * CLEAR_ERRORS * self.error[from];
            let newest = self.one[from + 1..]
                .iter()
                .copied()
                .fold(f64::INFINITY, f64::min);
            (newest > FASTER * before.max(error)).then(|| (from, before / newest))
        });
        found.next()
    }

    /// After which reading the newest motion begins, of [`FEWEST_INTERVALS`] intervals or more, and what share of it is [`FASTER`] times as fast as all before;
    /// that by which it is fastest.
    fn sudden(&self) -> Option<(usize, f64)> {
        let count = self.one.len();
        let first = count.saturating_sub(MOST_INTERVALS).max(FEWEST_INTERVALS);
        let mut before = self.three[FEWEST_INTERVALS..=first]
            .iter()
            .copied()
            .fold(0.0, f64::max);
        // Backwards: the slowest of the newest motion from each reading on.
        let mut slowest = vec![(f64::INFINITY, f64::INFINITY); count + 1];
        for at in (first..count).rev() {
            let (one, three) = slowest[at + 1];
            slowest[at] = (
                one.min(self.one[at]),
                three.min(self.three[at] - CLEAR_ERRORS * self.error[at]),
            );
        }
        let mut most: Option<(usize, f64)> = None;
        for from in first..count - FEWEST_INTERVALS {
            before = before.max(self.three[from]);
            let base = before.max(CLEAR_ERRORS * self.error[from]);
            let (one, three) = (slowest[from + 1].0, slowest[from + FEWEST_INTERVALS].1);
            let faster = three / base;
            let is_even = one >= SLOWEST * FASTER * base;
            if base > 0.0 && faster > FASTER && is_even && most.is_none_or(|most| faster > most.1) {
                most = Some((from, faster));
            }
        }
        most.map(|(from, faster)| (from, FASTER / faster))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn daily(steps: &[f64]) -> Observations {
        let noise = |day: usize| 0.4 * ((day * 37 % 11) as f64 / 11.0 - 0.5);
        let mut sum = 0.0;
        let first = std::iter::once((0.0, 0.0));
        let each = steps.iter().enumerate().map(|(day, step)| {
            sum += step;
            (day as f64 + 1.0, sum + noise(day))
        });
        Observations::of_displacements(first.chain(each))
    }

    #[test]
    fn a_motion_that_is_a_hundred_times_as_fast_is_slowed_down_to_four_times_and_keeps_its_growth()
    {
        let steps = [vec![2.0; 40], vec![200.0, 240.0, 300.0, 400.0]].concat();
        let slower = slowed(&daily(&steps)).unwrap();
        let moved = |day: usize| slower.values[day].value - slower.values[day - 1].value;
        assert!((moved(40) - 2.0).abs() < 0.5, "{}", moved(40));
        let (first, last) = (moved(41), moved(44));
        assert!(first > 5.0 && first < 9.0, "{first}");
        assert!((last / first - 2.0).abs() < 0.02, "{last} {first}");
    }

    #[test]
    fn a_motion_of_one_or_two_intervals_is_slowed_down_to_what_was_before() {
        for newest in [vec![200.0], vec![200.0, 300.0]] {
            let long = newest.len();
            let slower = slowed(&daily(&[vec![2.0; 40], newest].concat())).unwrap();
            let moved = slower.values[41].value - slower.values[40].value;
            assert!((moved - 2.0).abs() < 0.5, "{long}: {moved}");
        }
    }

    #[test]
    fn one_jump_a_steady_slope_and_an_even_acceleration_are_left_as_they_are() {
        let jump = [vec![2.0; 40], vec![200.0, 2.0, 2.0, 2.0]].concat();
        let runs_up: Vec<f64> = (0..40).map(|day| 60.0 / (41.0 - f64::from(day))).collect();
        for steps in [jump, vec![2.0; 44], vec![0.0; 44], runs_up] {
            assert_eq!(slowed(&daily(&steps)), None, "{steps:?}");
        }
    }
}
