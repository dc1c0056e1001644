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
        },
        failure_time,
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
    let told: Vec<(Level, Timestamp, Timestamp)> = levels
        .iter()
        .map(|stretch| (stretch.level, stretch.from, stretch.to))
        .collect();
    let expected = [
        (Level::Green, at(0), at(10)),
        (Level::Yellow, at(10), at(20)),
        (Level::Red, at(20), at(30)),
        (Level::Green, at(30), at(40)),
    ];
    assert_eq!(told, expected);
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
        ">chance 0.50 in 400 days<",
        "no median, 5 % by 02-10",
        "median 02-19, 5 to 95 % 02-10 to 03-02",
        "Benchmark &lt;a&gt;",
        "green",
        ">collapse<",
    ] {
        assert!(svg.contains(text), "{text}: {svg}");
    }
    for svg in [svg, replayed.forecasts()] {
        assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    }
}

#[test]
fn the_line_is_drawn_where_the_readings_give_the_one_that_was_told_and_not_elsewhere() {
    let series = series();
    let forecast = forecast(Some(40), Some(49), Some(60));
    let lines = |zero: Timestamp| {
        let events = [refit(30, forecast, Some(zero))];
        let svg = replayed(&series, &events).inverse_velocity(&[at(30)]);
        svg.matches("line through the newest").count()
    };
    let mut rates = replayed(&series, &[]).rates(at(30));
    rates = crate::monitor::recent(&rates).to_vec();
    let zero = crate::forecast::InverseVelocityLine::fit(&rates).unwrap();
    let zero = after_days(Timestamp::UNIX_EPOCH, zero.intercept_days.unwrap()).unwrap();
    assert!((day(zero) - 50.0).abs() < 0.5);
    assert_eq!(lines(zero), 1);
    assert_eq!(lines(at(47)), 0);
}
