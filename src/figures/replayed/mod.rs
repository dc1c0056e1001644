//! One benchmark's replay in figures: its readings, the forecasts as they were made, the levels as they were called.

mod forecast;
mod inverse_velocity;
mod levels;
mod regime;

use crate::figures::day;
use crate::fit::{Observations, Rate, RateOptions};
use crate::monitor::{Event, EventKind, FailureTime, LevelChance};
use crate::plot::{Axis, BLACK, Mark};
use crate::reading::{Series, TimeSpan, Timestamp, after_days};

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
struct ReplayedRefit {
    time: Timestamp,
    failure_time: FailureTime,
    /// Where the line through inverse velocity meets zero.
    intercept: Option<Timestamp>,
    /// The probability of kappa above 0, and of r above 0.
    unstable: f64,
    accelerating: f64,
    /// The chances of a collapse by which red and orange are called; in states of old versions those within the evacuation time
    /// and the outlook.
    for_red: f64,
    for_orange: f64,
    /// By what they are called; `None` in states of old versions.
    called_by: Option<(LevelChance, LevelChance)>,
}

/// Width of the sheets.
const WIDTH: f64 = 900.0;
/// What lies after the last reading and the collapse, as a share of what lies before.
const AHEAD: f64 = 0.14;
/// Dates are chosen in the last half of the record, at so many equal steps.
const STEPS: f64 = 4.0;
/// Of a record shorter than this, days, times are reported to the minute.
const SHORT_RECORD_DAYS: f64 = 14.0;

impl<'a> Replayed<'a> {
    /// Three dates, evenly placed in the last half of the time to the collapse or the record's end.
    pub fn three_dates(&self) -> Vec<Timestamp> {
        let Some(TimeSpan { from, to }) = self.span() else {
            return Vec::new();
        };
        let end = self.collapse.map_or(to, |collapse| collapse.min(to));
        let half = 0.5 * (day(end) - day(from));
        let steps = [1.0, 2.0, 3.0].into_iter();
        let dates = steps.filter_map(|step| after_days(end, half * (step / STEPS - 1.0)));
        dates.collect()
    }

    /// The first and the last reading.
    pub fn span(&self) -> Option<TimeSpan> {
        self.series.span()
    }

    /// The last reading or the collapse, whichever is later, in days since 1970.
    fn end(&self) -> f64 {
        let last = self.span().map(|span| day(span.to));
        let collapse = self.collapse.map(day);
        let later = last.into_iter().chain(collapse).reduce(f64::max);
        later.unwrap_or(0.0)
    }

    fn start(&self) -> f64 {
        self.span().map_or(0.0, |span| day(span.from))
    }

    /// All forecasts, in the order in which they were made.
    fn refits(&self) -> impl DoubleEndedIterator<Item = ReplayedRefit> + 'a {
        let id = &self.series.benchmark;
        let ours = self
            .events
            .iter()
            .filter(move |event| event.benchmark.as_ref() == Some(id));
        ours.filter_map(|event| {
            let EventKind::Refit {
                failure_time,
                inverse_velocity,
                regime,
                chance_within_evacuation_time,
                chance_within_outlook,
                called,
                ..
            } = &event.kind
            else {
                return None;
            };
            Some(ReplayedRefit {
                time: event.time,
                failure_time: *failure_time,
                intercept: inverse_velocity.failure_time,
                unstable: regime.probability_unstable,
                accelerating: regime.probability_accelerating,
                for_red: (called.as_ref())
                    .map_or(*chance_within_evacuation_time, |called| called.red.chance),
                for_orange: (called.as_ref())
                    .map_or(*chance_within_outlook, |called| called.orange.chance),
                called_by: called.as_ref().map(|called| (called.red, called.orange)),
            })
        })
    }

    /// The newest forecast made until then.
    fn refit_at(&self, time: Timestamp) -> Option<ReplayedRefit> {
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
        let last = self.span().map_or(time, |span| span.to);
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
mod tests {
    use super::levels::stretches;
    use super::*;
    use crate::alert::Level;
    use crate::monitor::{AlertState, InverseVelocity, RegimeReport};
    use crate::reading::{BenchmarkId, Reading, Unit};
    use crate::regime::Regime;
    use std::collections::BTreeMap;

    fn at(day: i64) -> Timestamp {
        Timestamp::from_second(86_400 * day).unwrap()
    }

    /// Forty days on which 1/v falls in a straight line to zero at day 50.
    fn series() -> Series {
        let reading = |day: i64| Reading {
            time: at(day),
            value: -100.0 * (1.0 - day as f64 / 50.0).ln(),
            sigma: Some(0.01),
        };
        Series {
            benchmark: BenchmarkId::new("<a>"),
            unit: Unit::MM,
            averaging: None,
            readings: (0..=40).map(reading).collect(),
        }
    }

    fn event(day: i64, kind: EventKind) -> Event {
        Event {
            time: at(day),
            kind,
            benchmark: Some(BenchmarkId::new("<a>")),
        }
    }

    fn alert(day: i64, level: Level, state: AlertState) -> Event {
        let kind = EventKind::Alert {
            level,
            state,
            key: String::new(),
            rule: String::new(),
            text: String::new(),
        };
        event(day, kind)
    }

    fn refit(day: i64, failure_time: FailureTime, zero: Option<Timestamp>) -> Event {
        let kind = EventKind::Refit {
            t_max: at(day),
            regime: RegimeReport {
                label: Regime::Undetermined,
                probability_unstable: 0.5,
                probability_accelerating: 0.5,
                probabilities: BTreeMap::new(),
                r_per_day: None,
                kappa_per_day: None,
            },
            failure_time,
            chances_of_collapse: None,
            critical_velocity_time: Box::default(),
            probability_of_acceleration: 0.5,
            inverse_velocity: InverseVelocity {
                failure_time: zero,
                r_squared: None,
            },
            transition_time: None,
            velocity_mm_per_day: Some(5.0),
            chance_within_evacuation_time: 0.0,
            chance_within_outlook: 0.0,
            called: None,
            plain: None,
        };
        event(day, kind)
    }

    fn forecast(low: Option<i64>, median: Option<i64>, high: Option<i64>) -> FailureTime {
        FailureTime {
            low: low.map(at),
            median: median.map(at),
            high: high.map(at),
            probability: 0.5,
            horizon_days: 400.0,
        }
    }

    fn replayed<'a>(series: &'a Series, events: &'a [Event]) -> Replayed<'a> {
        Replayed {
            series,
            events,
            collapse: Some(at(50)),
        }
    }

    #[test]
    fn a_level_holds_until_another_is_entered_and_unknown_stands_beside_it() {
        let series = series();
        let events = [
            alert(10, Level::Yellow, AlertState::Firing),
            alert(15, Level::Unknown, AlertState::Firing),
            alert(20, Level::Red, AlertState::Firing),
            alert(20, Level::Yellow, AlertState::Resolved),
            alert(22, Level::Unknown, AlertState::Resolved),
            alert(30, Level::Red, AlertState::Resolved),
        ];
        let (levels, unknown) = stretches(&replayed(&series, &events));
        let described: Vec<(Level, Timestamp, Timestamp)> = levels
            .iter()
            .map(|stretch| (stretch.level, stretch.from, stretch.to))
            .collect();
        let expected = [
            (Level::Green, at(0), at(10)),
            (Level::Yellow, at(10), at(20)),
            (Level::Red, at(20), at(30)),
            (Level::Green, at(30), at(40)),
        ];
        assert_eq!(described, expected);
        assert_eq!(unknown.len(), 1);
        assert_eq!((unknown[0].from, unknown[0].to), (at(15), at(22)));
    }

    #[test]
    fn the_dates_lie_in_the_last_half_and_the_forecast_at_one_is_the_newest_until_then() {
        let series = series();
        let none = forecast(None, None, None);
        let events = [refit(20, none, None), refit(30, none, None)];
        let replayed = replayed(&series, &events);
        assert_eq!(replayed.three_dates(), [at(25), at(30), at(35)]);
        let found = |day: i64| replayed.refit_at(at(day)).map(|refit| refit.time);
        assert_eq!(
            [found(19), found(29), found(30)],
            [None, Some(at(20)), Some(at(30))]
        );
    }

    #[test]
    fn what_is_never_reached_is_said_and_every_number_drawn_is_one() {
        let series = series();
        let events = [
            refit(20, forecast(None, None, None), None),
            refit(25, forecast(Some(40), None, None), None),
            refit(30, forecast(Some(40), Some(49), Some(60)), Some(at(50))),
        ];
        let replayed = replayed(&series, &events);
        let svg = replayed.inverse_velocity(&[at(5), at(20), at(25), at(30)]);
        for text in [
            "no forecast yet",
            ">chance 0.50<",
            "5 % 02-10, median later, 95 % later; chance 0.50",
            "5 % 02-10, median 02-19, 95 % 03-02; chance 0.50",
            "Benchmark &lt;a&gt;",
            "green",
            ">collapse<",
        ] {
            assert!(svg.contains(text), "{text}: {svg}");
        }
        let regimes = replayed.regimes();
        assert!(regimes.contains("unstable: kappa &gt; 0"), "{regimes}");
        for svg in [svg, replayed.forecasts(), regimes] {
            assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        }
    }

    #[test]
    fn the_line_is_drawn_where_the_readings_give_the_one_that_was_reported_and_not_elsewhere() {
        let series = series();
        let forecast = forecast(Some(40), Some(49), Some(60));
        let lines = |zero: Timestamp| {
            let events = [refit(30, forecast, Some(zero))];
            let svg = replayed(&series, &events).inverse_velocity(&[at(30)]);
            svg.matches("line through the newest").count()
        };
        let mut rates = replayed(&series, &[]).rates(at(30));
        rates = crate::forecast::InverseVelocityLine::newest(&rates).to_vec();
        let zero = crate::forecast::InverseVelocityLine::fit(&rates).unwrap();
        let zero = after_days(Timestamp::UNIX_EPOCH, zero.intercept_days.unwrap()).unwrap();
        assert!((day(zero) - 50.0).abs() < 0.5);
        assert_eq!(lines(zero), 1);
        assert_eq!(lines(at(47)), 0);
    }

    #[test]
    fn a_record_of_before_1970_ends_where_it_ends() {
        let mut series = series();
        for reading in &mut series.readings {
            reading.time -= jiff::SignedDuration::from_hours(24 * 10_000);
        }
        let replayed = Replayed {
            collapse: None,
            ..replayed(&series, &[])
        };
        assert!((replayed.end() + 9960.0).abs() < 1e-9);
    }
}
