//! One benchmark's replay in figures: its readings, the forecasts as they were made, the levels as they were called.

mod forecast;
mod inverse_velocity;
mod levels;

use crate::figures::day;
use crate::fit::{Observations, Rate, RateOptions};
use crate::monitor::{Event, EventKind, FailureTime};
use crate::plot::{Axis, BLACK, Mark};
use crate::reading::{Series, Timestamp, after_days};

/// A replayed benchmark.
#[derive(Debug, Clone, Copy)]
pub struct Replayed<'a> {
    /// Its readings as far as they were played, one at least.
    pub series: &'a Series,
    /// What the monitor said of them.
    pub events: &'a [Event],
    /// When the slope collapsed, where it did.
    pub collapse: Option<Timestamp>,
}

/// One forecast as it was made.
#[derive(Debug, Clone, Copy)]
struct Refit {
    time: Timestamp,
    failure_time: FailureTime,
    velocity_mm_per_day: Option<f64>,
    /// Where the line through inverse velocity meets zero.
    intercept: Option<Timestamp>,
}

/// Width of the sheets.
const WIDTH: f64 = 900.0;
/// What lies after the last reading and the collapse, as a share of what lies before.
const AHEAD: f64 = 0.14;
/// Dates are chosen in the last half of the record, at so many equal steps.
const STEPS: f64 = 4.0;
/// Of a record shorter than this, days, times are told to the minute.
const SHORT_RECORD_DAYS: f64 = 14.0;

impl<'a> Replayed<'a> {
    /// Three dates, evenly placed in the last half of the time to the collapse or the record's end.
    pub fn three_dates(&self) -> Vec<Timestamp> {
        let Some((first, last)) = self.span() else {
            return Vec::new();
        };
        let end = self.collapse.map_or(last, |collapse| collapse.min(last));
        let half = 0.5 * (day(end) - day(first));
        let steps = [1.0, 2.0, 3.0].into_iter();
        let dates = steps.filter_map(|step| after_days(end, half * (step / STEPS - 1.0)));
        dates.collect()
    }

    /// The first and the last reading.
    pub fn span(&self) -> Option<(Timestamp, Timestamp)> {
        let readings = &self.series.readings;
        Some((readings.first()?.time, readings.last()?.time))
    }

    /// The last reading or the collapse, whichever is later, in days since 1970.
    fn end(&self) -> f64 {
        let last = self.span().map(|(_, last)| day(last));
        let collapse = self.collapse.map(day);
        last.into_iter().chain(collapse).fold(0.0, f64::max)
    }

    fn start(&self) -> f64 {
        self.span().map_or(0.0, |(first, _)| day(first))
    }

    /// All forecasts, in the order in which they were made.
    fn refits(&self) -> impl DoubleEndedIterator<Item = Refit> + 'a {
        let id = &self.series.benchmark;
        let ours = self
            .events
            .iter()
            .filter(move |event| event.benchmark.as_ref() == Some(id));
        ours.filter_map(|event| {
            let EventKind::Refit {
                failure_time,
                velocity_mm_per_day,
                inverse_velocity,
                ..
            } = &event.kind
            else {
                return None;
            };
            Some(Refit {
                time: event.time,
                failure_time: *failure_time,
                velocity_mm_per_day: *velocity_mm_per_day,
                intercept: inverse_velocity.failure_time,
            })
        })
    }

    /// The newest forecast made until then.
    fn refit_at(&self, time: Timestamp) -> Option<Refit> {
        self.refits().rev().find(|refit| refit.time <= time)
    }

    /// Velocities in the readings until then; days are those since 1970.
    fn rates(&self, until: Timestamp) -> Vec<Rate> {
        let mut series = self.series.clone();
        series.readings.retain(|reading| reading.time <= until);
        let observations = Observations::of(&series);
        let all = 0..observations.values.len();
        let mut rates = observations.rates(all, RateOptions::default());
        let start = self.start();
        for rate in &mut rates {
            rate.from += start;
            rate.to += start;
        }
        rates
    }

    /// The axis of time, with some room after the end.
    fn dates(&self, label: &str) -> Axis {
        let (from, end) = (self.start(), self.end());
        // One reading alone has no span.
        let span = (end - from).max(1e-3);
        Axis::dates(label, from - 0.01 * span, end + AHEAD * span)
    }

    /// An upright line at the collapse.
    fn collapse_line(&self) -> Option<(String, Mark)> {
        let line = Mark::Uprights {
            at: vec![day(self.collapse?)],
            colour: BLACK,
            dash: "",
        };
        Some((String::new(), line))
    }

    /// A time as short as the others beside it allow.
    fn short(&self, time: Timestamp) -> String {
        let (_, last) = self.span().unwrap_or((time, time));
        let end = self.collapse.unwrap_or(last);
        let pattern = if end.strftime("%Y").to_string() != time.strftime("%Y").to_string() {
            "%Y-%m-%d"
        } else if self.end() - self.start() < SHORT_RECORD_DAYS {
            "%m-%d %H:%MZ"
        } else {
            "%m-%d"
        };
        time.strftime(pattern).to_string()
    }

    fn title(&self, what: &str) -> String {
        let collapse = self.collapse.map_or_else(String::new, |time| {
            format!("; collapse {}", time.strftime("%Y-%m-%d %H:%MZ"))
        });
        format!("Benchmark {}: {what}{collapse}", self.series.benchmark)
    }
}

#[cfg(test)]
mod tests;
