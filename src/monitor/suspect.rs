//! What the readings of one benchmark show of the sensor itself: that it stands still, or has no clock.

use super::history::History;
use crate::fit::Observation;
use crate::reading::{Quantity, SECONDS_PER_DAY, Timestamp};
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

/// How many of the newest readings are examined for standing at the end of a sensor's range, and the fewest of the motion before
/// them: as many as stand, where there are so many.
const STANDING: [usize; 4] = [6, 12, 24, 48];
const MOVING: usize = 4;
/// They lie within this share of what the motion before them would have made in their time. Readings at the top of a daily wave
/// lie within a sixth.
const JITTER: f64 = 0.1;
/// That is so many times as far as a reading of the motion was off the straight line from its first to its last: between readings that
/// scatter as much, some lie together by chance.
const SHOWN: f64 = 4.0;
/// They have no trend of so many standard errors.
const TREND: f64 = 3.0;

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

    /// Whether the newest readings stand, but for a jitter, where those just before them moved to, ten times as far in the same
    /// time or more: how many, the time of the first, and between which values.
    ///
    /// A slope that slows down has readings in between. A velocity that stays where it rose to is motion.
    pub(super) fn stands_at_the_end(&self) -> Option<(usize, Timestamp, (f64, f64))> {
        if self.observations.quantity == Quantity::Velocity {
            return None;
        }
        STANDING.iter().find_map(|count| self.stands_for(*count))
    }

    fn stands_for(&self, count: usize) -> Option<(usize, Timestamp, (f64, f64))> {
        let values = &self.observations.values;
        let (before, standing) = values.split_at(values.len().checked_sub(count)?);
        let moving = &before[before.len().saturating_sub(count)..];
        if moving.len() < MOVING {
            return None;
        }
        let slower = mean_velocity(moving).abs();
        let slower = slower.min(mean_velocity(&moving[moving.len() / 2 - 1..]).abs());
        let is_upwards = mean_velocity(moving) > 0.0;
        let span = standing[count - 1].t_days - standing[0].t_days;
        let ((low, high), (lowest, highest)) = (extent(standing), extent(before));
        let jitter = high - low;
        let is_beyond = if is_upwards {
            low + jitter >= highest
        } else {
            high - jitter <= lowest
        };
        let stands = is_beyond
            && jitter > 0.0
            && jitter <= JITTER * slower * span
            && slower * span >= SHOWN * off_the_chord(moving)
            && goes_to_and_fro(standing);
        let around = (low - jitter, high + jitter);
        stands.then(|| Some((count, self.time(standing[0].t_days)?, around)))?
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

/// From the first of `values` to the last, a day.
fn mean_velocity(values: &[Observation]) -> f64 {
    match values {
        [first, .., last] => (last.value - first.value) / (last.t_days - first.t_days),
        _ => 0.0,
    }
}

/// How far one of `values` is at most off the straight line from the first to the last.
fn off_the_chord(values: &[Observation]) -> f64 {
    let Some(first) = values.first() else {
        return 0.0;
    };
    let velocity = mean_velocity(values);
    let off = |one: &Observation| one.value - first.value - velocity * (one.t_days - first.t_days);
    values.iter().map(|one| off(one).abs()).fold(0.0, f64::max)
}

/// The lowest and the highest of `values`.
fn extent(values: &[Observation]) -> (f64, f64) {
    let each = || values.iter().map(|one| one.value);
    (
        each().fold(f64::INFINITY, f64::min),
        each().fold(f64::NEG_INFINITY, f64::max),
    )
}

/// Whether `values` go both ways, without a trend of [`TREND`] standard errors.
fn goes_to_and_fro(values: &[Observation]) -> bool {
    let (mut is_rising, mut is_falling) = (true, true);
    for pair in values.windows(2) {
        is_rising &= pair[1].value >= pair[0].value;
        is_falling &= pair[1].value <= pair[0].value;
    }
    let count = values.len() as f64;
    let mean = |of: fn(&Observation) -> f64| values.iter().map(of).sum::<f64>() / count;
    let (middle, level) = (mean(|one| one.t_days), mean(|one| one.value));
    let sum = |of: &dyn Fn(f64, f64) -> f64| {
        let each = values.iter();
        each.map(|one| of(one.t_days - middle, one.value - level))
            .sum::<f64>()
    };
    let spread = sum(&|days, _| days * days);
    let slope = sum(&|days, value| days * value) / spread;
    let scatter = sum(&|days, value| (value - slope * days).powi(2)) / (count - 2.0);
    !is_rising && !is_falling && slope * slope * spread <= TREND * TREND * scatter
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
    use super::super::fixture::{history, history_of, noise};
    use super::super::history::MeasuredAs;
    use super::*;
    use crate::reading::{Reading, Unit};
    use jiff::ToSpan;
    use std::f64::consts::TAU;

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
        let risen = (0..30).map(moving).chain((30..36).map(jitter));
        let velocity = history_of(Unit::MM_PER_DAY, risen);
        assert_eq!(velocity.stands_at_the_end(), None, "it is motion");
        // Ten millimetres a day each hour, and each ten minutes: what one interval moves is the noise.
        for (step, jitter, stand) in [(0.42, 0.1, 6..=12), (0.07, 0.04, 6..=48)] {
            let moving = move |hour: u32| f64::from(hour) * step + jitter * noise(hour);
            let end = move |hour: u32| 60.0 * step + jitter * (0.5 + noise(hour));
            let all = |count: usize| (0..60).map(moving).chain((60..).map(end)).take(60 + count);
            let found = (1..=48).find(|count| history(all(*count)).stands_at_the_end().is_some());
            assert!(
                found.is_some_and(|count| stand.contains(&count)),
                "{found:?}"
            );
        }
        // The top of a wave is none, however little the noise.
        for jitter in [0.0, 0.01, 0.05, 0.3] {
            for end in 40..400 {
                let wave = |at: u32| 2.0 * (f64::from(at) * TAU / 144.0).sin() + jitter * noise(at);
                assert!(
                    history((0..end).map(wave)).stands_at_the_end().is_none(),
                    "{end}"
                );
            }
        }
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
    fn readings_that_scatter_as_far_as_the_motion_before_them_and_lie_together_by_chance_do_not_stand()
     {
        // 4 mm a day, hourly, off by up to .5 mm: six in a row within .02 mm.
        let scatter = [0.0, -0.5, 0.4, -0.3, 0.5, -0.45];
        let read = |hour: u32| f64::from(hour) / 6.0 + scatter[hour as usize % 6];
        let together = |hour: u32| 29.0 / 6.0 + 0.6 + 0.02 * noise(hour);
        let readings = history((0..30).map(read).chain((30..36).map(together)));
        assert_eq!(readings.stands_at_the_end(), None);
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
