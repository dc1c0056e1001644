//! What the readings of one benchmark show of the sensor itself: that it stands still, jumps back and forth, or has no clock.

use super::history::History;
use crate::fit::Observation;
use crate::reading::{SECONDS_PER_DAY, Timestamp};
use jiff::{SignedDuration, civil::date, tz::TimeZone};
use std::ops::RangeInclusive;

/// Fewer equal readings in a row are chance.
const FEWEST_EQUAL: usize = 6;
/// Pairs of neighbours, before the equal ones, from which is learnt how often this sensor repeats a value.
const PAIRS: RangeInclusive<usize> = 8..=200;
/// A sensor that repeats more than this share of its values is too coarse to show that it is stuck.
const COARSE: f64 = 0.1;
/// The chance under which as many equal readings are no chance.
const NO_CHANCE: f64 = 1e-6;

/// Readings that stand at the end of a sensor's range, as many as are examined; and those of the motion before them.
const STANDING: usize = 6;
const MOVING: usize = 4;
/// They lie within this share of what the motion before them would have made of their time.
const JITTER: f64 = 0.005;

/// The readings that are examined for spikes.
const INSPECTED: RangeInclusive<usize> = 18..=36;
/// A spike stands out by so many times what its neighbours differ by,
const SPIKE: f64 = 20.0;
/// and by so many steps of the sensor's resolution.
const STEPS: f64 = 20.0;
/// The share of spikes from which on the readings are spoilt, and the least number of them. Of noise alone 3 % are.
const SPOILT: f64 = 0.26;
const FEWEST_SPIKES: usize = 5;

/// Days on which the clocks of loggers and receivers start when nobody has set them.
const FIRST_DAYS: [(i16, i8, i8); 5] = [
    (1970, 1, 1),
    (1980, 1, 1),
    (1980, 1, 6),
    (1990, 1, 1),
    (2000, 1, 1),
];
/// Readings from such a day are left out where no other lies so near, days,
const APART_DAYS: f64 = 365.0;
/// and where there are no more than so many.
const MOST_CLOCKLESS: usize = 24;

impl History {
    /// Whether the newest readings repeat one value as this sensor never did: how many, and the time of the first.
    pub(super) fn stuck(&self) -> Option<(usize, Timestamp)> {
        let count = self.identical();
        if count < FEWEST_EQUAL {
            return None;
        }
        let values = &self.observations.values;
        let first = values.len() - count;
        let before = &values[first.saturating_sub(*PAIRS.end())..=first];
        let pairs = before.len() - 1;
        if pairs < *PAIRS.start() {
            return None;
        }
        let equal = before
            .windows(2)
            .filter(|pair| are_equal(&pair[0], &pair[1]));
        let share = (equal.count() + 1) as f64 / (pairs + 2) as f64;
        let exponent = i32::try_from(count - 1).unwrap_or(i32::MAX);
        let is_stuck = share <= COARSE && share.powi(exponent) < NO_CHANCE;
        is_stuck.then(|| Some((count, self.time(values[first].t_days)?)))?
    }

    /// Whether the newest readings stand, but for a jitter, farther than any before them, while those just before them
    /// moved there, two hundred times as far in the same time or more: how many, the time of the first, and between which values.
    ///
    /// A slope that slows down has readings in between.
    pub(super) fn stands_at_the_end(&self) -> Option<(usize, Timestamp, (f64, f64))> {
        let values = &self.observations.values;
        let first = values.len().checked_sub(STANDING)?;
        let (before, standing) = values.split_at(first);
        let moving = &before[before.len().checked_sub(MOVING)?..];
        let velocity = |pair: &[Observation]| {
            (pair[1].value - pair[0].value) / (pair[1].t_days - pair[0].t_days)
        };
        let velocities = || moving.windows(2).map(velocity);
        let slowest = velocities().map(f64::abs).fold(f64::INFINITY, f64::min);
        let is_upwards = velocities().all(|velocity| velocity > 0.0);
        let is_downwards = velocities().all(|velocity| velocity < 0.0);
        let span = standing[STANDING - 1].t_days - standing[0].t_days;
        let extent = |of: &[Observation]| {
            let values = || of.iter().map(|one| one.value);
            (
                values().fold(f64::INFINITY, f64::min),
                values().fold(f64::NEG_INFINITY, f64::max),
            )
        };
        let ((low, high), (lowest, highest)) = (extent(standing), extent(before));
        let is_beyond = is_upwards && low >= highest || is_downwards && high <= lowest;
        let jitter = high - low;
        let stands = is_beyond && jitter > 0.0 && jitter <= JITTER * slowest * span;
        let around = (low - jitter, high + jitter);
        stands.then(|| Some((STANDING, self.time(standing[0].t_days)?, around)))?
    }

    /// Whether a reading of this value, as the monitor takes it, repeats the newest one.
    pub(super) fn repeats(&self, new: &Observation) -> bool {
        let stands =
            (self.range_end).is_some_and(|(low, high)| low <= new.value && new.value <= high);
        let newest = self.observations.values.last();
        newest
            .is_some_and(|newest| (stands || are_equal(newest, new)) && new.t_days > newest.t_days)
    }

    /// Of so many newest readings, that say nothing, only the first is left.
    pub(super) fn forget_repeats(&mut self, count: usize) {
        let kept = self.observations.values.len() + 1 - count.max(1);
        self.observations.values.truncate(kept);
    }

    /// Whether many of the newest readings lie far off both neighbours, which agree: by how much, in the middle.
    ///
    /// Where they were spoilt `before`, by so much, they are so until no more than a few lie a third of that off both
    /// neighbours: on a slope that grows fast the neighbours differ as well.
    pub(super) fn spoilt(&self, before: Option<f64>) -> Option<f64> {
        let values = &self.observations.values;
        let latest = &values[values.len().saturating_sub(*INSPECTED.end())..];
        if latest.len() < *INSPECTED.start() {
            return before;
        }
        let step = resolution(latest);
        let size_of = |three: &[Observation]| {
            let (rise, fall) = (
                three[1].value - three[0].value,
                three[2].value - three[1].value,
            );
            let size = rise.abs().min(fall.abs());
            let stands_out = match before {
                Some(before) => size > before / 3.0,
                None => size > SPIKE * (rise + fall).abs() && size > STEPS * step,
            };
            (rise * fall < 0.0 && stands_out).then_some(size)
        };
        let mut sizes: Vec<f64> = latest.windows(3).filter_map(size_of).collect();
        sizes.sort_by(f64::total_cmp);
        let least = (SPOILT * (latest.len() - 2) as f64).max(FEWEST_SPIKES as f64);
        let least = if before.is_some() { 0.5 * least } else { least };
        let middle = sizes.get(sizes.len() / 2).copied();
        if sizes.len() as f64 >= least {
            before.or(middle)
        } else {
            None
        }
    }

    /// Takes out the readings at the beginning that lie on a day on which unset clocks start, far from all others:
    /// the first and the last of them, and how many.
    pub(super) fn forget_clockless(&mut self) -> Option<(Timestamp, Timestamp, usize)> {
        let values = &self.observations.values;
        if values.last()?.t_days - values.first()?.t_days <= APART_DAYS {
            return None;
        }
        let looked_at = values.len().saturating_sub(1).min(MOST_CLOCKLESS);
        let count =
            (1..=looked_at).find(|at| values[*at].t_days - values[at - 1].t_days > APART_DAYS)?;
        let time = |index: usize| self.time(self.observations.values[index].t_days);
        let (from, to) = (time(0)?, time(count - 1)?);
        let all = (0..count).all(|index| time(index).is_some_and(is_first_day));
        if !all {
            return None;
        }
        self.observations.values.drain(..count);
        Some((from, to, count))
    }

    /// When the first reading was taken.
    pub(super) fn first(&self) -> Option<Timestamp> {
        self.time(self.observations.values.first()?.t_days)
    }
}

fn are_equal(one: &Observation, other: &Observation) -> bool {
    one.value.to_bits() == other.value.to_bits()
}

/// The least that a reading differs by from one of the next two, where it does.
fn resolution(values: &[Observation]) -> f64 {
    let next = values.windows(2).map(|pair| pair[1].value - pair[0].value);
    let after = values
        .windows(3)
        .map(|three| three[2].value - three[0].value);
    let steps = next.chain(after).map(f64::abs).filter(|step| *step > 0.0);
    steps.fold(f64::INFINITY, f64::min)
}

fn is_first_day(time: Timestamp) -> bool {
    let day = SignedDuration::from_secs_f64(SECONDS_PER_DAY);
    FIRST_DAYS.iter().any(|(year, month, number)| {
        let start = date(*year, *month, *number).to_zoned(TimeZone::UTC);
        start.is_ok_and(|start| {
            let since = time.duration_since(start.timestamp());
            // Days as a number of days are rounded.
            (-SignedDuration::from_mins(1)..day).contains(&since)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::super::history::MeasuredAs;
    use super::*;
    use crate::reading::{Reading, Unit};
    use jiff::ToSpan;

    fn history(values: impl IntoIterator<Item = f64>) -> History {
        let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
        let source = MeasuredAs {
            unit: Unit::MM,
            averaging: None,
        };
        let mut history = History::new(source, start);
        for (hour, value) in (0..).zip(values) {
            let reading = Reading {
                time: start + i64::from(hour).hours(),
                value,
                sigma: None,
            };
            history.take(source, &reading);
        }
        history
    }

    /// Between 0 and 1, the same each time.
    fn noise(seed: u32) -> f64 {
        let mixed = seed.wrapping_mul(2_654_435_761) ^ 0x9e37_79b9;
        f64::from(mixed.wrapping_mul(2_246_822_519) >> 8) / f64::from(1_u32 << 24)
    }

    #[test]
    fn a_fine_sensor_that_repeats_its_value_is_stuck_and_a_coarse_one_is_not() {
        let fine = (0..40).map(|hour| f64::from(hour) * 4.3 + noise(hour));
        assert_eq!(history(fine.clone()).stuck(), None);
        let last = fine.clone().next_back().unwrap();
        let stuck = history(fine.chain([last; 6])).stuck();
        assert_eq!(stuck.map(|(count, _)| count), Some(7));
        let coarse = (0..200).map(|hour| f64::from(hour / 4));
        assert_eq!(history(coarse.chain([49.0; 100])).stuck(), None);
        assert_eq!(
            history([1.0; 100]).stuck(),
            None,
            "it never gave anything else"
        );
    }

    #[test]
    fn a_jitter_where_a_fast_motion_ended_at_once_is_the_end_of_a_range_and_a_slope_that_slows_down_is_not()
     {
        let moving = |hour: u32| f64::from(hour) * 16.0 + noise(hour);
        let jitter = |hour: u32| 30.0 * 16.0 + 1.0 + 0.2 * noise(hour);
        let at_end = history((0..30).map(moving).chain((30..36).map(jitter)));
        let (count, _, (low, high)) = at_end.stands_at_the_end().unwrap();
        assert!(count == 6 && low < 481.1 && high > 481.1 && high - low < 0.7);
        let downwards = history(
            (0..30)
                .map(moving)
                .chain((30..36).map(jitter))
                .map(|value| -value),
        );
        assert!(downwards.stands_at_the_end().is_some());
        // As fast as the noise, nobody can say.
        let creeping = history((0..36).map(|hour| f64::from(hour.min(30)) * 0.2 + noise(hour)));
        assert!(creeping.stands_at_the_end().is_none());
        for per_hour in [0.2_f64, 0.5, 0.8, 0.95] {
            let slowing = |hour: i32| 480.0 + 16.0 * (1.0 - per_hour.powi(hour)) / (1.0 - per_hour);
            for end in 1..60 {
                let all = (0..30).map(moving).chain((0..end).map(slowing));
                assert!(
                    history(all).stands_at_the_end().is_none(),
                    "{per_hour}, {end}"
                );
            }
        }
        for end in 10..119 {
            let failing =
                |hour: u32| 200.0 * (120.0 / (120.0 - f64::from(hour))).ln() + noise(hour);
            assert!(history((0..end).map(failing)).stands_at_the_end().is_none());
        }
    }

    #[test]
    fn spikes_and_signs_that_alternate_are_spoilt_and_noise_and_acceleration_are_not() {
        let slope = |hour: u32| 200.0 * (120.0 / (120.0 - f64::from(hour))).ln() + noise(hour);
        let third = |hour: u32| if hour.is_multiple_of(3) { 300.0 } else { 0.0 };
        let sign = |hour: u32| if hour.is_multiple_of(2) { 1.0 } else { -1.0 };
        assert!(
            history((0..80).map(|hour| slope(hour) + third(hour)))
                .spoilt(None)
                .is_some()
        );
        assert!(
            history((40..80).map(|hour| slope(hour) * sign(hour)))
                .spoilt(None)
                .is_some()
        );
        // Near its end the slope itself moves as much from one reading to the next.
        let late = history((0..119).map(|hour| slope(hour) + third(hour)));
        assert!(late.spoilt(Some(300.0)).is_some());
        assert!(history((0..119).map(slope)).spoilt(Some(300.0)).is_none());
        for end in 18..119 {
            assert_eq!(history((0..end).map(slope)).spoilt(None), None, "{end}");
        }
        for end in 18..2000 {
            let latest = (end - 18..end).map(noise);
            assert_eq!(history(latest).spoilt(None), None, "{end}");
            let coarse = (end - 18..end).map(|hour| noise(hour).round());
            assert_eq!(history(coarse).spoilt(None), None, "{end}");
        }
    }

    #[test]
    fn what_an_unset_clock_gave_is_left_out_and_a_record_that_begins_there_is_not() {
        let start: Timestamp = "2000-01-01T00:00:00Z".parse().unwrap();
        let source = MeasuredAs {
            unit: Unit::MM,
            averaging: None,
        };
        let read = |times: &[Timestamp]| {
            let mut history = History::new(source, times[0]);
            for time in times {
                let reading = Reading {
                    time: *time,
                    value: 1.0,
                    sigma: None,
                };
                history.take(source, &reading);
            }
            history.forget_clockless().map(|(.., count)| count)
        };
        let later: Timestamp = "2026-03-01T00:00:00Z".parse().unwrap();
        assert_eq!(read(&[start, start + 1.hour(), later]), Some(2));
        assert_eq!(read(&[start, start + 1.hour(), start + 48.hours()]), None);
        let old: Timestamp = "1998-05-03T00:00:00Z".parse().unwrap();
        assert_eq!(
            read(&[old, later]),
            None,
            "a zero reading of long ago counts"
        );
    }
}
