//! What the newest rates show by themselves.

use crate::alert::AlertEvidence;
use crate::fit::{Observation, Observations, Rate, displacement_sigma, velocity_sigma};
use crate::forecast::FEWEST_READINGS;
use crate::reading::{Quantity, Timestamp, upper_median};

/// Rates whose median is the settled velocity.
const SETTLED: usize = 5;
/// Readings are looked at no further back than this for how they scatter.
const LOOKED_AT: usize = 512;
/// A mean that stands clear of zero does so by so many standard errors.
const CLEAR_ERRORS: f64 = 4.0;
/// The error that the first three readings may have, mm, and how many times that is taken off their motion.
const FIRST_ERROR_MM: f64 = 20.0;
const FIRST_ERRORS: f64 = 6.0;
/// More of them show by themselves how they scatter, the less surely the fewer there are; but an instrument that has just been set up may drift by so
/// much, mm, before it is steady (satellite positions by carrier phase converge over an hour or so).
const FIRST_DRIFT_MM: f64 = 50.0;
const KNOWN_FROM: usize = 4;
/// Before rates are known the velocity is looked for over so many steps.
const LAST_STEPS: usize = 12;
/// Last decimal places of displacements, mm, the coarsest first: of metres, centimetres and millimetres, of feet and of inches; and how far, in
/// units of it, what is written in it may lie beside.
const DIGITS_MM: [f64; 11] = [
    10.0, 3.048, 2.54, 1.0, 0.3048, 0.254, 0.1, 0.03048, 0.0254, 0.01, 0.001,
];
const NO_DIGIT: f64 = 1e-3;
/// A settled velocity is a new highest from this factor on.
const HIGHER: f64 = 1.25;
/// A reading has fallen that lies so many standard errors under the one before it, and the next one is back where it lies off that one by this
/// share of the fall at most.
const FALLEN_ERRORS: f64 = 10.0;
const BACK: f64 = 0.25;

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
    let latest = rates.iter().rev().take(SETTLED);
    upper_median(&mut latest.map(|rate| rate.velocity).collect::<Vec<f64>>())
}

/// The standard error of the median of the latest rates, mm/day.
fn settled_error(rates: &[Rate]) -> f64 {
    // Of a normal variable that of the median is 1.25 times that of the mean.
    const OF_THE_MEDIAN: f64 = 1.25;
    let latest = &rates[rates.len().saturating_sub(SETTLED)..];
    let mut errors: Vec<f64> = latest.iter().map(|rate| rate.sigma).collect();
    let error = upper_median(&mut errors).unwrap_or(0.0);
    OF_THE_MEDIAN * error / (SETTLED as f64).sqrt()
}

/// What the slope has moved at least in the mean over the last `days`, mm/day: 0 where that does not stand clear of its error, and in a
/// record that is shorter.
fn moved_at_least(observations: &Observations, days: f64) -> f64 {
    let values = &observations.values;
    let Some(newest) = values.last() else {
        return 0.0;
    };
    let before = values.partition_point(|one| one.t_days <= newest.t_days - days);
    // Where fewer are read, the settled velocity is of a longer time.
    let is_often = values.len() - before >= SETTLED;
    let Some(from) = before.checked_sub(1).filter(|_| is_often) else {
        return 0.0;
    };
    let looked_at = &values[values.len().saturating_sub(LOOKED_AT)..];
    let (mean, error) = match observations.quantity {
        Quantity::Displacement => {
            let span = newest.t_days - values[from].t_days;
            let moved = newest.value - values[from].value;
            let noise = displacement_sigma(looked_at) * std::f64::consts::SQRT_2;
            (moved / span, noise / span)
        }
        Quantity::Velocity => {
            let own = &values[before..];
            let count = own.len() as f64;
            let sum: f64 = own.iter().map(|one| one.value).sum();
            (sum / count, velocity_sigma(looked_at) / count.sqrt())
        }
    };
    (mean.abs() - CLEAR_ERRORS * error).max(0.0)
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

/// What `observations` up to `now` and their rates show of the motion, the newest ones and over an evacuation time.
pub(super) fn observed(
    observations: &Observations,
    rates: &[Rate],
    now: Timestamp,
    evacuation_days: f64,
) -> AlertEvidence {
    let newest = rates.last().map(|rate| rate.velocity);
    let velocity = newest.or_else(|| newest_velocity(observations));
    let since_a_fall = back_from_a_fall(observations);
    AlertEvidence {
        now,
        velocity_mm_per_day: velocity
            .map(|velocity| since_a_fall.map_or(velocity, |since| velocity.min(since))),
        settled_velocity_mm_per_day: if are_first(observations) {
            from_the_first(observations)
        } else {
            settled(rates)
        },
        settled_error_mm_per_day: settled_error(rates),
        // Without rates only thresholds are asked, at each reading.
        moved_at_least_mm_per_day: if rates.is_empty() {
            0.0
        } else {
            moved_at_least(observations, evacuation_days)
        },
        displacement_mm: displacement_mm(observations),
        acceleration_mm_per_day2: acceleration(rates),
        ..AlertEvidence::default()
    }
}

/// Whether the readings are too few for a forecast.
pub(super) fn are_first(observations: &Observations) -> bool {
    observations.spaced(FEWEST_READINGS).len() < FEWEST_READINGS
}

/// The velocity, mm/day, that the first readings, three or more, show beyond doubt where they are too few for a forecast: each step is as fast, and what
/// is left of the mean of all after an error that no instrument is likely to have. One reading gone wrong makes one step.
fn from_the_first(observations: &Observations) -> Option<f64> {
    let values = observations.spaced(FEWEST_READINGS);
    let [first, _, .., newest] = values.as_slice() else {
        return None;
    };
    let by_each = match observations.quantity {
        Quantity::Displacement => {
            let steps = values.windows(2);
            let each = steps.map(|w| (w[1].value - w[0].value) / (w[1].t_days - w[0].t_days));
            let least = each.fold(f64::INFINITY, f64::min);
            let moved = newest.value - first.value - first_error(&values);
            least.min(moved / (newest.t_days - first.t_days))
        }
        Quantity::Velocity => {
            let each = values
                .iter()
                .map(|one| one.value - FIRST_ERRORS * one.sigma.unwrap_or(0.0));
            let (least, most) = each
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| {
                    (low.min(one), high.max(one))
                });
            // What scatters by more than its size may be noise.
            if most - least < least { least } else { 0.0 }
        }
    };
    (by_each > 0.0).then_some(by_each)
}

/// How far the first displacements may lie off each other though nothing has moved, mm.
fn first_error(values: &[Observation]) -> f64 {
    let own = displacement_sigma(values);
    let times = FIRST_ERRORS * std::f64::consts::SQRT_2;
    let unknown = times * own.max(FIRST_ERROR_MM);
    if values.len() < KNOWN_FROM {
        return unknown;
    }
    let unsure = 1.0 + 4.0 / (values.len() - 2) as f64;
    (times * unsure * own).max(FIRST_DRIFT_MM).min(unknown)
}

/// The velocity, mm/day, where the newest displacement is back from one wrong reading that lay far under the others: since the one before that. The
/// rise from the wrong one is no motion.
fn back_from_a_fall(observations: &Observations) -> Option<f64> {
    let values = &observations.values;
    let [.., before, fallen, newest] = values.as_slice() else {
        return None;
    };
    let fall = before.value - fallen.value;
    let moved = newest.value - before.value;
    let is_back =
        observations.quantity == Quantity::Displacement && fall > 0.0 && moved.abs() < BACK * fall;
    let looked_at = || &values[values.len().saturating_sub(LOOKED_AT)..];
    let is_far = is_back && fall > FALLEN_ERRORS * displacement_sigma(looked_at());
    is_far.then(|| moved / (newest.t_days - before.t_days))
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
            let (newest, before) = values.split_last()?;
            let digit = last_digit_mm(values);
            let since = |one: &Observation| {
                let step = newest.value - one.value;
                let beyond = (step.abs() - digit).max(0.0);
                beyond.copysign(step) / (newest.t_days - one.t_days)
            };
            // Over more readings the last digit takes less off what really moves.
            let each = before.iter().rev().take(LAST_STEPS).map(since);
            each.max_by(|a, b| a.abs().total_cmp(&b.abs()))
        }
    }
}

/// The unit of the last decimal place in which the newest displacements are written, mm: no reading is known better. They may be written in
/// millimetres, centimetres, metres, inches or feet.
fn last_digit_mm(values: &[Observation]) -> f64 {
    let newest = &values[values.len().saturating_sub(SETTLED)..];
    let is_written_in = |digit: &f64| {
        newest.iter().all(|value| {
            let units = value.value / digit;
            (units - units.round()).abs() <= NO_DIGIT
        })
    };
    let coarsest = DIGITS_MM.into_iter().find(is_written_in);
    coarsest.unwrap_or(DIGITS_MM[DIGITS_MM.len() - 1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::RateOptions;
    use rand::{RngExt, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_pcg::Pcg64;

    #[test]
    fn the_return_from_one_reading_far_below_the_others_is_no_velocity() {
        let noise = |hour: u32| 0.1 * f64::from(hour * 37 % 23) / 23.0;
        let velocity = |last: [f64; 2]| {
            let steady = (0..40).map(|hour| f64::from(hour) / 24.0 + noise(hour));
            let values = steady.chain(last.map(|off| 40.0 / 24.0 + off));
            let at = |(hour, value): (usize, f64)| (hour as f64 / 24.0, value);
            let read = Observations::of_displacements(values.enumerate().map(at));
            let rates = read.rates(0..read.values.len(), RateOptions::default());
            let now = Timestamp::UNIX_EPOCH;
            let seen = observed(&read, &rates, now, 1.0);
            seen.velocity_mm_per_day.unwrap()
        };
        assert!(velocity([-20.0, 0.0]).abs() < 5.0);
        // Where more than that has moved since, all of it counts, and so does a rise that no fall came before.
        assert!(velocity([-20.0, 15.0]) > 100.0);
        assert!(velocity([0.0, 20.0]) > 100.0);
    }

    #[test]
    fn one_step_of_a_radar_that_gives_whole_millimetres_is_no_velocity_and_two_are_half() {
        let newest = |values: &[f64]| {
            let at = |(index, value): (usize, &f64)| (index as f64 / 144.0, *value);
            let read = Observations::of_displacements(values.iter().enumerate().map(at));
            newest_velocity(&read).unwrap()
        };
        assert!(newest(&[12.0, 13.0]).abs() < 1e-9 && newest(&[13.0, 12.0]).abs() < 1e-9);
        assert!((newest(&[12.0, 14.0]) - 144.0).abs() < 1e-6);
        // A millimetre each time is 144 mm/day, of which three quarters are sure after four steps.
        assert!((newest(&[12.0, 13.0, 14.0, 15.0, 16.0]) - 108.0).abs() < 1e-6);
        assert!((newest(&[12.31, 13.31]) - 0.99 * 144.0).abs() < 1e-6);
        // A hundredth of a foot, a tenth of an inch and a centimetre are no velocity either.
        for digit in [3.048, 2.54, 10.0] {
            let step = newest(&[7.0 * digit, 8.0 * digit]);
            assert!(step.abs() < 1e-9, "{step} of {digit}");
        }
    }

    /// Slips of 6 mm each 12 hours, read by the hour: 12 mm/day.
    #[test]
    fn a_slope_that_moves_in_slips_moves_in_the_mean_as_well() {
        let noise = |hour: u32| 0.3 * f64::from(hour * 37 % 11) / 11.0;
        let read = |hour: u32| {
            (
                f64::from(hour) / 24.0,
                6.0 * f64::from(hour / 12) + noise(hour),
            )
        };
        let slips = Observations::of_displacements((0..240).map(read));
        let rates = slips.rates(0..240, RateOptions::default());
        let least = observed(&slips, &rates, Timestamp::UNIX_EPOCH, 1.0).moved_at_least_mm_per_day;
        assert!(least > 5.0 && least <= 12.0, "{least}");
        let read = |hour: u32| (f64::from(hour) / 24.0, noise(hour));
        let at_rest = Observations::of_displacements((0..240).map(read));
        assert!(moved_at_least(&at_rest, 1.0).abs() < 1e-9);
    }

    #[test]
    fn the_third_reading_of_a_slope_that_moves_by_metres_a_day_shows_it_and_noise_does_not() {
        let shown = |values: &[f64], interval: f64| {
            let at = |(index, value): (usize, &f64)| (interval * index as f64, *value);
            from_the_first(&Observations::of_displacements(
                values.iter().enumerate().map(at),
            ))
        };
        assert_eq!(shown(&[0.0, 2400.0], 1.0), None);
        assert!(shown(&[0.0, 2400.0, 4900.0], 1.0).unwrap() > 2000.0);
        // One reading gone wrong, and an hour's noise of a satellite receiver.
        let one_wrong = shown(&[0.0, 12_000.0, 12_001.0, 12_002.0], 1.0);
        assert!(one_wrong.is_none_or(|velocity| velocity < 1.5));
        assert_eq!(shown(&[0.0, 30.0, 60.0, 75.0], 1.0 / 24.0), None);
        // Two metres a day read each half hour, and a receiver that drifts by 50 mm until it is steady.
        let two_metres = [0.0, 41.9, 83.2, 125.1];
        assert!(shown(&two_metres, 1.0 / 48.0).unwrap() > 1000.0);
        assert!(shown(&two_metres[..3], 1.0 / 48.0).is_none_or(|velocity| velocity < 1000.0));
        let steady = (0..9).map(|reading| 50.0 * (1.0 - f64::powi(0.4, reading)));
        let steady: Vec<f64> = steady.collect();
        for count in 3..=9 {
            assert_eq!(shown(&steady[..count], 1.0 / 48.0), None, "{count}");
        }
    }

    #[test]
    fn the_first_readings_of_a_slope_at_rest_never_pass_the_critical_velocity_by_their_noise() {
        let mut random = Pcg64::seed_from_u64(5);
        for series in 0..20_000 {
            let size = [1.0, 5.0, 20.0][series % 3];
            let mut noise = |index: usize| {
                let z: f64 = random.sample(StandardNormal);
                (index as f64 / 48.0, size * z)
            };
            let values: Vec<(f64, f64)> = (0..9).map(&mut noise).collect();
            for count in 3..=9 {
                let read = Observations::of_displacements(values[..count].to_vec());
                let shown = from_the_first(&read);
                assert!(
                    shown.is_none_or(|velocity| velocity < 1000.0),
                    "{series} {count}"
                );
            }
        }
    }

    /// Velocities of an instrument that states no error.
    #[test]
    fn velocities_that_scatter_about_zero_do_not_move_backwards_and_their_error_shows() {
        let mut state = 7_u64;
        let mut random = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1);
            (state >> 32) as f64 / f64::from(u32::MAX >> 1) - 1.0
        };
        let mut rates = |from: f64, size: f64| {
            let values = (0..2000).map(|hour| Observation {
                t_days: f64::from(hour) / 24.0,
                value: from + size * random(),
                sigma: None,
            });
            let read = Observations {
                quantity: Quantity::Velocity,
                averaging_days: 1.0 / 24.0,
                values: values.collect(),
            };
            read.rates(0..2000, RateOptions { most: 2000 })
        };
        let noise = rates(0.0, 17.0);
        for count in 100..noise.len() {
            assert!(!moves_backwards(&noise[count - 96..count]), "{count}");
        }
        let error = settled_error(&noise[..96]);
        assert!(error > 2.0 && error < 15.0, "{error}");
        let back = rates(-20.0, 1.0);
        assert!(moves_backwards(&back));
    }
}
