//! From readings to mean velocities over intervals, each with its standard error.
//!
//! Displacement differences over short intervals are noise; intervals are merged, newest first,
//! until the slip in them stands clear of it, so that slow creep and fast sliding are both resolved.

use crate::reading::{
    NORMAL_MEDIAN, Quantity, SECONDS_PER_DAY, Series, days_since, rounding_error, upper_median,
};
use serde::{Deserialize, Serialize};
use std::ops::Range;

/// One reading in the science's units: days and mm, or mm/day.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Days since the epoch of the series.
    pub t_days: f64,
    /// mm or mm/day.
    pub value: f64,
    /// Standard error in the same unit, where the source gives one.
    pub sigma: Option<f64>,
}

/// The readings of one benchmark, in the science's units, time strictly increasing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Observations {
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// For velocities: the span, in days, before each time over which it is the mean; 0: a point value.
    pub averaging_days: f64,
    /// The readings.
    pub values: Vec<Observation>,
}

/// A mean velocity over an interval.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rate {
    /// Start, days.
    pub from: f64,
    /// End, days; equal to `from` for a point value.
    pub to: f64,
    /// mm/day.
    pub velocity: f64,
    /// Standard error from the reading's noise, mm/day; the scatter of the motion itself is not in it.
    pub sigma: f64,
    /// How many readings' motion it is the mean of.
    pub readings: u32,
    /// Where the standard error comes from.
    pub error: ReadingError,
}

/// Where the standard error of a rate comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReadingError {
    /// The rate's own, independent of its neighbours'.
    Own,
    /// From the displacements read at its two ends, each shared with the neighbour.
    OfEnds,
}

impl Rate {
    /// The middle of the interval, days.
    pub fn middle(&self) -> f64 {
        f64::midpoint(self.from, self.to)
    }
}

/// Bounds on the work that follows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RateOptions {
    /// At most this many rates; older ones are merged in pairs beyond it.
    pub most: usize,
}

impl Default for RateOptions {
    fn default() -> Self {
        Self { most: 96 }
    }
}

/// Nothing is resolved in less than half an hour: readings closer together are one, and what fails
/// sooner than that nobody can be brought away from.
pub const FINEST_DAYS: f64 = 1.0 / 48.0;

/// Slip that stands clear of the noise, in standard errors of a difference.
const CLEAR_OF_NOISE: f64 = 6.0;

/// No merged interval is longer than this share of the record, so that a slow slope keeps some.
const LONGEST_SHARE: f64 = 1.0 / 16.0;

/// Noise floor of a displacement series without scatter, mm.
const LEAST_DISPLACEMENT_SIGMA_MM: f64 = 1e-3;
/// The share of a velocity that is its own roughness.
const ROUGH: f64 = 0.1;
/// Fewest velocities whose scatter is known.
const FEWEST_VELOCITIES: usize = 8;
/// Readings have a resolution that shows where at least this share of the steps between them is none, and where of the others at least
/// this share are multiples of the shortest one.
const WITHOUT_STEP: f64 = 1.0 / 3.0;
const MULTIPLES: f64 = 0.9;
/// So near to a multiple of the shortest step.
const NEAR_MULTIPLE: f64 = 1e-3;
/// Steps smaller than this are rounding of the arithmetic, mm.
const NO_STEP_MM: f64 = 1e-6;
/// Fewest steps by which a resolution shows.
const FEWEST_STEPS: usize = 5;

impl Observations {
    /// Displacements, mm, at times in days, without stated errors.
    pub fn of_displacements(points: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let values = points.into_iter().map(|(t_days, value)| Observation {
            t_days,
            value,
            sigma: None,
        });
        Self {
            quantity: Quantity::Displacement,
            averaging_days: 0.0,
            values: values.collect(),
        }
    }

    /// The readings of a series, in days from its first.
    pub fn of(series: &Series) -> Self {
        let factor = series.unit.factor();
        let epoch = series.readings.first().map(|reading| reading.time);
        let values = series.readings.iter().map(|reading| Observation {
            t_days: epoch.map_or(0.0, |epoch| days_since(epoch, reading.time)),
            value: reading.value * factor,
            sigma: reading.sigma.map(|sigma| sigma * factor),
        });
        let seconds = series.averaging.map_or(0.0, |span| span.as_secs_f64());
        Self {
            quantity: series.quantity(),
            averaging_days: seconds / SECONDS_PER_DAY,
            values: values.collect(),
        }
    }

    /// The rates in all readings, oldest first; at most as many as [`RateOptions`] has by itself.
    pub fn all_rates(&self) -> Vec<Rate> {
        self.rates(0..self.values.len(), RateOptions::default())
    }

    /// The rates in the readings of `range`, oldest first.
    pub fn rates(&self, range: Range<usize>, options: RateOptions) -> Vec<Rate> {
        let Some(values) = self.values.get(range) else {
            return Vec::new();
        };
        let rates = match self.quantity {
            Quantity::Velocity => self.velocity_rates(values),
            Quantity::Displacement => displacement_rates(values),
        };
        halve_until(rates, options.most)
    }

    /// Readings at least this far apart, days, count as different ones: half a window of a trailing
    /// mean, and [`FINEST_DAYS`].
    pub fn spacing_days(&self) -> f64 {
        (0.5 * self.averaging_days).max(FINEST_DAYS)
    }

    /// The first readings that count as different ones, `most` of them at most.
    pub fn spaced(&self, most: usize) -> Vec<Observation> {
        let mut spaced: Vec<Observation> = Vec::new();
        for value in &self.values {
            let apart = spaced
                .last()
                .is_none_or(|last| value.t_days - last.t_days >= 0.999 * self.spacing_days());
            if apart {
                spaced.push(*value);
            }
            if spaced.len() == most {
                break;
            }
        }
        spaced
    }

    /// Overlapping windows repeat each other: readings are kept half a window apart at least. Those without a stated error have that of
    /// their scatter about the line between their neighbours.
    fn velocity_rates(&self, values: &[Observation]) -> Vec<Rate> {
        let spacing = self.spacing_days();
        let mut kept: Vec<Observation> = Vec::new();
        for value in values.iter().rev() {
            let apart = kept
                .last()
                .is_none_or(|later| later.t_days - value.t_days >= spacing * 0.999);
            if apart {
                kept.push(*value);
            }
        }
        kept.reverse();
        let scatter = if kept.iter().all(|value| value.sigma.is_some()) {
            0.0
        } else {
            velocity_sigma(&kept)
        };
        let rates = kept.iter().map(|value| Rate {
            from: value.t_days - self.averaging_days,
            to: value.t_days,
            velocity: value.value,
            sigma: value.sigma.unwrap_or(scatter),
            readings: 1,
            error: ReadingError::Own,
        });
        rates.collect()
    }
}

/// The standard error that the resolution of displacements has by itself, mm: they are rounded to multiples of it. 0 where none shows.
fn resolution_sigma(values: &[Observation]) -> f64 {
    let steps = values
        .windows(2)
        .map(|pair| (pair[1].value - pair[0].value).abs());
    let moved: Vec<f64> = steps.filter(|step| *step > NO_STEP_MM).collect();
    let count = values.len().saturating_sub(1) as f64;
    let Some(shortest) = moved.iter().copied().reduce(f64::min) else {
        return 0.0;
    };
    let multiples = moved.iter().filter(|step| {
        let times = **step / shortest;
        (times - times.round()).abs() < NEAR_MULTIPLE * times
    });
    let shows = moved.len() >= FEWEST_STEPS
        && moved.len() as f64 <= (1.0 - WITHOUT_STEP) * count
        && multiples.count() as f64 >= MULTIPLES * moved.len() as f64;
    if shows { rounding_error(shortest) } else { 0.0 }
}

/// The standard error of one displacement reading, mm: from how far each stands from the line between
/// its neighbours, by the median, so that neither steps nor acceleration raise it; no less than rounding makes it.
pub(crate) fn displacement_sigma(values: &[Observation]) -> f64 {
    let mut misfits: Vec<f64> = values.windows(3).map(misfit).collect();
    let least = LEAST_DISPLACEMENT_SIGMA_MM;
    if misfits.is_empty() {
        return least;
    }
    of_median(&mut misfits)
        .max(resolution_sigma(values))
        .max(least)
}

/// The same of one velocity reading, mm/day; 0 where the readings scatter no more than motion does, and with fewer than eight. Motion that is fast is rough: only the
/// slower half shows the instrument, and of that not what is a small share of its velocity, for which the law's own scatter accounts. (How far
/// the middle one of three stands from its neighbours does not depend on the mean of the three.)
pub(crate) fn velocity_sigma(values: &[Observation]) -> f64 {
    if values.len() < FEWEST_VELOCITIES {
        return 0.0;
    }
    let mean = |three: &[Observation]| three.iter().map(|one| one.value).sum::<f64>().abs() / 3.0;
    let mut threes: Vec<(f64, f64)> = (values.windows(3))
        .map(|three| (mean(three), misfit(three)))
        .collect();
    let half = threes.len() / 2;
    threes.select_nth_unstable_by(half, |a, b| a.0.total_cmp(&b.0));
    threes.truncate(half + 1);
    let (_, usual, _) = threes.select_nth_unstable_by(half / 2, |a, b| a.0.total_cmp(&b.0));
    let rough = ROUGH * usual.0;
    let mut slower: Vec<f64> = threes.iter().map(|three| three.1).collect();
    let scatter = of_median(&mut slower).max(resolution_sigma(values));
    (scatter * scatter - rough * rough).max(0.0).sqrt()
}

/// How far the middle one of three readings stands from the line between the others, over what that is for readings of error 1.
fn misfit(w: &[Observation]) -> f64 {
    let share = (w[1].t_days - w[0].t_days) / (w[2].t_days - w[0].t_days);
    let line = w[0].value + share * (w[2].value - w[0].value);
    let size = (1.0 + share * share + (1.0 - share) * (1.0 - share)).sqrt();
    (w[1].value - line).abs() / size
}

/// The standard deviation of normal variables of these sizes; of none no number.
fn of_median(sizes: &mut [f64]) -> f64 {
    upper_median(sizes).unwrap_or(f64::NAN) / NORMAL_MEDIAN
}

/// Readings that are one: their mean, and how far it may be off.
#[derive(Debug, Clone, Copy)]
struct RatePlace {
    t_days: f64,
    value: f64,
    /// Standard error, mm.
    error: f64,
    readings: u32,
}

/// Displacements at times that are distinguished, counted back from the newest: where readings are closer together than
/// [`FINEST_DAYS`] their mean, which their noise moves far less than any one of them.
fn places(values: &[Observation]) -> Vec<RatePlace> {
    let common = displacement_sigma(values);
    let mut places = Vec::new();
    let mut means = Vec::new();
    let mut left = values;
    while let Some(newest) = left.last() {
        let is_apart = |value: &Observation| newest.t_days - value.t_days >= 0.999 * FINEST_DAYS;
        let one = left.iter().rposition(is_apart).map_or(0, |last| last + 1);
        let (before, own) = left.split_at(one);
        let count = own.len() as f64;
        // A stated error is often the instrument's alone: the scatter seen is the least there is.
        let error = |value: &Observation| value.sigma.map_or(common, |sigma| sigma.max(common));
        let squares: f64 = own.iter().map(|value| error(value).powi(2)).sum();
        let mean = |of: fn(&Observation) -> f64| own.iter().map(of).sum::<f64>() / count;
        let (t_days, value) = match own {
            [alone] => (alone.t_days, alone.value),
            _ => (mean(|one| one.t_days), mean(|one| one.value)),
        };
        places.push(RatePlace {
            t_days,
            value,
            error: squares.sqrt() / count,
            readings: u32::try_from(own.len()).unwrap_or(u32::MAX),
        });
        means.push(Observation {
            t_days,
            value,
            sigma: None,
        });
        left = before;
    }
    places.reverse();
    means.reverse();
    // Noise that lasts, as of the air or of satellites, shows between the means alone.
    let scatter = displacement_sigma(&means);
    for place in &mut places {
        place.error = place.error.max(scatter);
    }
    places
}

fn displacement_rates(values: &[Observation]) -> Vec<Rate> {
    let places = places(values);
    let (Some(first), Some(last)) = (places.first(), places.last()) else {
        return Vec::new();
    };
    let longest = (last.t_days - first.t_days) * LONGEST_SHARE;
    let between = |earlier: &RatePlace, later: &RatePlace| {
        let span = later.t_days - earlier.t_days;
        Rate {
            from: earlier.t_days,
            to: later.t_days,
            velocity: (later.value - earlier.value) / span,
            sigma: later.error.hypot(earlier.error) / span,
            readings: 1,
            error: ReadingError::OfEnds,
        }
    };
    let mut rates = Vec::new();
    let mut end = places.len() - 1;
    for start in (0..places.len() - 1).rev() {
        let rate = between(&places[start], &places[end]);
        // Judged over twice the readings: an interval that ended where its own noise was high would be fast.
        let twice = between(&places[start.saturating_sub(end - start)], &places[end]);
        let clear = twice.velocity > CLEAR_OF_NOISE * rate.sigma;
        // A step just before must not be smeared over the stillness after it.
        let breaks = start > 0 && {
            let next = between(&places[start - 1], &places[start]);
            (next.velocity - rate.velocity).abs() > CLEAR_OF_NOISE * next.sigma.hypot(rate.sigma)
        };
        let long_enough = rate.to - rate.from >= 0.999 * FINEST_DAYS;
        if long_enough && (clear || breaks || rate.to - rate.from >= longest) {
            let own = places[start + 1..=end].iter();
            let readings = own.fold(0_u32, |sum, place| sum.saturating_add(place.readings));
            rates.push(Rate { readings, ..rate });
            end = start;
        }
    }
    rates.reverse();
    rates
}

/// Merges the older half in neighbouring pairs until there are no more than `most`.
fn halve_until(mut rates: Vec<Rate>, most: usize) -> Vec<Rate> {
    while rates.len() > most.max(2) {
        let older = rates.len() / 2;
        let merged: Vec<Rate> = rates[..older].chunks(2).map(merge).collect();
        rates.splice(..older, merged);
    }
    rates
}

/// Widens each rate that point velocities were merged into by half of the spacing of its readings, and no further than to the middle
/// between its own and its neighbour's: the mean of points is that of the velocity over as much, to a second order of the spacing of one reading. Over the
/// time from the first of them to the last it is not: a slope that slows down over the time of a merged rate is then read too fast
/// by several per cent.
pub(crate) fn widen_merged(rates: &mut [Rate]) {
    let ends: Vec<(f64, f64)> = rates.iter().map(|rate| (rate.from, rate.to)).collect();
    for (index, rate) in rates.iter_mut().enumerate() {
        if rate.readings < 2 || rate.to <= rate.from {
            continue;
        }
        let half = 0.5 * (rate.to - rate.from) / f64::from(rate.readings - 1);
        let before = index.checked_sub(1).and_then(|before| ends.get(before));
        let after = ends.get(index + 1);
        rate.from -= before.map_or(half, |(_, to)| half.min(0.5 * (rate.from - to).max(0.0)));
        rate.to += after.map_or(half, |(from, _)| half.min(0.5 * (from - rate.to).max(0.0)));
    }
}

fn merge(pair: &[Rate]) -> Rate {
    let [earlier, later] = pair else {
        return pair[0];
    };
    let weight = |rate: &Rate| (rate.to - rate.from).max(1e-12);
    let total = weight(earlier) + weight(later);
    let errors = (weight(earlier) * earlier.sigma).hypot(weight(later) * later.sigma);
    // The error of the displacement between the two is in neither end of the whole.
    let kept = match earlier.error {
        ReadingError::Own => 1.0,
        ReadingError::OfEnds => std::f64::consts::FRAC_1_SQRT_2,
    };
    Rate {
        from: earlier.from,
        to: later.to,
        velocity: (weight(earlier) * earlier.velocity + weight(later) * later.velocity) / total,
        sigma: errors * kept / total,
        readings: earlier.readings.saturating_add(later.readings),
        error: earlier.error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn displacement(values: &[(f64, f64)]) -> Observations {
        Observations::of_displacements(values.iter().copied())
    }

    #[test]
    fn velocities_have_the_error_of_their_scatter_and_none_where_it_is_a_small_share_of_them() {
        let of = |noise: f64, velocity: fn(f64) -> f64| {
            let values = (0..300_u32).map(|hour| Observation {
                t_days: f64::from(hour) / 24.0,
                value: velocity(f64::from(hour))
                    + noise * (f64::from(hour * 37 % 101) / 50.0 - 1.0),
                sigma: None,
            });
            let read = Observations {
                quantity: Quantity::Velocity,
                averaging_days: 0.0,
                values: values.collect(),
            };
            read.rates(0..300, RateOptions::default())[95].sigma
        };
        let steady = |_| 2.0;
        let fails = |hour: f64| 400.0 / (301.0 - hour);
        // Uniform within 3, each on the other side of the one before: a standard deviation of 1.7, and of 3 about the neighbours.
        for velocity in [steady, fails] {
            let sigma = of(3.0, velocity);
            assert!((1.0..=4.0).contains(&sigma), "{sigma}");
            assert_eq!(of(0.05, velocity).to_bits(), 0.0_f64.to_bits());
        }
    }

    #[test]
    fn creep_under_the_noise_is_merged_until_it_stands_clear() {
        let noise = [0.6, -0.9, 0.2, 1.1, -0.4, -0.7, 0.8, -0.1];
        let values: Vec<(f64, f64)> = (0..400_u32)
            .map(|i| (f64::from(i), 0.1 * f64::from(i) + noise[i as usize % 8]))
            .collect();
        let rates = displacement(&values).rates(0..400, RateOptions::default());
        assert!(rates.len() >= 8, "{}", rates.len());
        for rate in &rates {
            assert!((rate.velocity - 0.1).abs() < 4.0 * rate.sigma, "{rate:?}");
        }
    }

    /// Centimetres of a slope that moves less between two readings: most steps are none, and the others are no scatter.
    #[test]
    fn readings_of_a_coarse_resolution_scatter_by_it() {
        let coarse = |t: f64, resolution: f64| (10.0 * t / resolution).round() * resolution;
        let values = |resolution: f64| {
            let values = (0..400_u32).map(|hour| f64::from(hour) / 24.0);
            displacement(
                &values
                    .map(|t| (t, coarse(t, resolution)))
                    .collect::<Vec<_>>(),
            )
        };
        let expected = rounding_error(10.0);
        let found = displacement_sigma(&values(10.0).values);
        assert!((found / expected - 1.0).abs() < 0.01, "{found}");
        let rates = values(10.0).rates(0..400, RateOptions::default());
        assert!(rates.iter().all(|rate| rate.velocity < 30.0), "{rates:?}");
        // Smooth motion and a single step of a slope at rest have none.
        assert!(displacement_sigma(&values(1e-6).values) < 0.01);
        let step: Vec<(f64, f64)> = (0..50_u32)
            .map(|i| (f64::from(i), if i < 25 { 0.0 } else { 10.0 }))
            .collect();
        assert!(displacement_sigma(&displacement(&step).values) < 0.01);
    }

    #[test]
    fn fast_sliding_keeps_every_reading() {
        let values: Vec<(f64, f64)> = (0..30_u32)
            .map(|i| (f64::from(i), 100.0 * f64::from(i)))
            .collect();
        assert_eq!(
            displacement(&values)
                .rates(0..30, RateOptions::default())
                .len(),
            29
        );
    }

    #[test]
    fn readings_too_close_to_be_distinguished_are_averaged_and_noise_that_lasts_is_not_averaged_away()
     {
        // A tenth of a mm up or down each minute, and the same for an hour each.
        let minutes = 1440_u32;
        let at = |noise: &dyn Fn(u32) -> f64| {
            let values: Vec<(f64, f64)> = (0..minutes)
                .map(|i| (f64::from(i) / 1440.0, f64::from(i) / 60.0 + noise(i)))
                .collect();
            displacement(&values).rates(0..values.len(), RateOptions::default())
        };
        let sign = |odd: u32| if odd.is_multiple_of(2) { 0.1 } else { -0.1 };
        let quick = at(&|i| sign(i / 7 + i / 3));
        assert!(quick.len() >= 40, "{}", quick.len());
        for rate in &quick {
            assert!((rate.velocity - 24.0).abs() < 2.5, "{rate:?}");
            assert!(rate.sigma < 3.0, "{rate:?}");
        }
        let lasting = at(&|i| sign(i / 60));
        for rate in &lasting {
            assert!((rate.velocity - 24.0).abs() < 4.0 * rate.sigma, "{rate:?}");
        }
    }

    #[test]
    fn overlapping_windows_are_counted_once() {
        let values = (0..13).map(|i| Observation {
            t_days: f64::from(i) / 288.0,
            value: 1.0,
            sigma: None,
        });
        let hourly = Observations {
            quantity: Quantity::Velocity,
            averaging_days: 1.0 / 24.0,
            values: values.collect(),
        };
        assert_eq!(hourly.rates(0..13, RateOptions::default()).len(), 3);
    }
}
