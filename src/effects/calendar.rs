//! Columns that only say when a reading was made: no covariates.

use crate::reading::{Channel, LineFit, Timestamp, days_since};
use jiff::civil::DateTime;
use jiff::tz::{Offset, TimeZone};
use std::collections::BTreeSet;

/// Fewest values that show it.
const FEWEST: usize = 12;
/// So many values are looked at.
const MOST: usize = 400;
/// Of the values so many are what the clock has.
const AGREEING: f64 = 0.98;
/// What a straight line in time leaves of the variance of a count of days.
const STRAIGHT: f64 = 1e-9;
/// Fewest values of a part of the calendar that show it.
const DIFFERENT: usize = 3;
/// The widest offsets of zones, hours.
const OFFSETS: std::ops::RangeInclusive<i8> = -12..=14;

/// Whether the values of a channel are a part of its times, or count them.
pub(super) fn is_of_the_calendar(channel: &Channel) -> bool {
    let samples = &channel.samples;
    if samples.len() < FEWEST {
        return false;
    }
    let every = samples.len().div_ceil(MOST);
    let values: Vec<(Timestamp, f64)> = samples
        .iter()
        .step_by(every)
        .map(|one| (one.time, one.value))
        .collect();
    let is_constant = values.windows(2).all(|w| w[0].1.total_cmp(&w[1].1).is_eq());
    !is_constant && (counts(channel) || is_straight(&values) || is_a_part(&values))
}

/// Whether each value is one more than the one before it.
fn counts(channel: &Channel) -> bool {
    let mut pairs = channel.samples.windows(2);
    pairs.all(|pair| (pair[1].value - pair[0].value - 1.0).abs() < 1e-9)
}

/// Whether the values lie on a straight line in time.
fn is_straight(values: &[(Timestamp, f64)]) -> bool {
    let pairs = values.iter();
    let pairs: Vec<(f64, f64)> = pairs
        .map(|(time, value)| (days_since(values[0].0, *time), *value))
        .collect();
    on_one_line(&pairs, STRAIGHT)
}

/// Whether a straight line of the one by the other leaves less than this share of its variance; neither is constant then.
pub(super) fn on_one_line(pairs: &[(f64, f64)], left: f64) -> bool {
    let Some(line) = LineFit::through(pairs) else {
        return false;
    };
    let of_one = |sum: f64| sum / line.weight;
    let (own, theirs, both) = (of_one(line.xx), of_one(line.yy), of_one(line.xy));
    own * theirs > 0.0 && own * theirs - both * both < left * own * theirs
}

/// Whether they are the year, the month, the day of the month or of the year, the hour or the minute of one time zone.
fn is_a_part(values: &[(Timestamp, f64)]) -> bool {
    let parts: [fn(DateTime) -> i16; 6] = [
        DateTime::year,
        |at| i16::from(at.month()),
        |at| i16::from(at.day()),
        DateTime::day_of_year,
        |at| i16::from(at.hour()),
        |at| i16::from(at.minute()),
    ];
    if values.iter().any(|one| one.1.fract() != 0.0) {
        return false;
    }
    OFFSETS.into_iter().any(|hours| {
        let zone = TimeZone::fixed(Offset::constant(hours));
        let civil: Vec<DateTime> = values.iter().map(|one| zone.to_datetime(one.0)).collect();
        parts.iter().any(|part| {
            // What hardly changes agrees with what is mostly nothing.
            let different: BTreeSet<i16> = civil.iter().map(|at| part(*at)).collect();
            let agree = civil.iter().zip(values);
            let agree =
                agree.filter(|(at, (_, value))| f64::from(part(**at)).total_cmp(value).is_eq());
            different.len() >= DIFFERENT && agree.count() as f64 >= AGREEING * values.len() as f64
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::fixture::{channel, daily};
    use super::is_of_the_calendar;

    #[test]
    fn a_date_is_no_covariate_and_a_level_and_whole_degrees_are() {
        let days = daily(200);
        let of = |value: fn(usize) -> f64| {
            let values: Vec<f64> = (0..days.len()).map(value).collect();
            is_of_the_calendar(&channel("one", &days, &values))
        };
        assert!(of(|row| row as f64));
        assert!(of(|row| 2011.0 + row as f64 / 365.25));
        assert!(!of(|_| 4.0));
        // Rain on few days.
        assert!(!of(|row| if row % 67 == 3 { 12.0 } else { 0.0 }));
        assert!(!of(|row| (row % 24) as f64));
        assert!(!of(|row| 300.0 + (row as f64 / 20.0).sin()));
        let made = channel("one", &days, &vec![0.0; days.len()]);
        let mut month = made.clone();
        for sample in &mut month.samples {
            let at = sample
                .time
                .to_zoned(jiff::tz::TimeZone::fixed(jiff::tz::offset(9)));
            sample.value = f64::from(at.day());
        }
        assert!(is_of_the_calendar(&month));
    }
}
