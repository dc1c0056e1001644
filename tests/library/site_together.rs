//! Which benchmarks of a site share a failure time, as the monitor reports it while they are in alarm.

use crate::crisis::{days_before, policy, recording, series};
use slipwatch::monitor::{Event, EventKind, Input, Monitor, Settings, SharedFailure};
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit};

/// All readings of `series` in order of time, to one monitor.
fn watch(series: &[Series]) -> Vec<Event> {
    let mut monitor = Monitor::new(Settings {
        policy: policy(24),
        ..Settings::default()
    });
    let mut readings: Vec<(&Series, &Reading)> = series
        .iter()
        .flat_map(|one| one.readings.iter().map(move |reading| (one, reading)))
        .collect();
    readings.sort_by_key(|(_, reading)| reading.time);
    let steps = readings.into_iter().flat_map(|(series, reading)| {
        let input = Input::Reading {
            benchmark: series.benchmark.clone(),
            unit: series.unit,
            averaging: series.averaging,
            reading: *reading,
        };
        monitor.step(reading.time, &input)
    });
    steps.collect()
}

fn shared(events: &[Event]) -> Vec<(Timestamp, Vec<SharedFailure>)> {
    let together = events.iter().filter_map(|event| {
        if let EventKind::Together { groups } = &event.kind {
            Some((event.time, groups.clone()))
        } else {
            None
        }
    });
    together.collect()
}

#[test]
fn the_five_extensometers_of_preonzo_share_one_failure_time_whose_interval_holds_the_collapse_in_its_last_week()
 {
    let collapse: Timestamp = "2012-05-15T00:00:00Z".parse().unwrap();
    let reported = shared(&watch(&series(&recording("preonzo-2012.mcap"), None)));
    let late: Vec<_> = reported
        .iter()
        .filter(|(time, _)| (0.0..7.0).contains(&days_before(collapse, *time)))
        .collect();
    assert!(late.len() >= 3, "{}", late.len());
    for (time, groups) in late {
        assert_eq!(groups.len(), 1, "{time}: {groups:?}");
        assert_eq!(groups[0].benchmarks.len(), 5, "{time}");
        let failure = groups[0].failure_time;
        // The collapse came in the night after the last reading.
        assert!(failure.low.unwrap() <= "2012-05-15T04:00:00Z".parse().unwrap());
        assert!(failure.high.is_none_or(|high| high >= collapse), "{time}");
    }
    let (_, last) = reported.last().unwrap();
    let median = last[0].failure_time.median.unwrap();
    assert!(days_before(collapse, median).abs() < 2.0, "{median}");
}

fn hourly(name: &str, count: u32, at: impl Fn(f64) -> f64) -> Series {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let readings = (0..count).map(|hour| Reading {
        time: start + jiff::SignedDuration::from_hours(i64::from(hour)),
        value: at(f64::from(hour) / 24.0),
        sigma: None,
    });
    Series {
        benchmark: BenchmarkId::new(name),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    }
}

/// Between -1 and 1, the same in every run.
fn scatter(days: f64) -> f64 {
    (days * 24.0 * 12.989_8).sin() * 43_758.545_3 % 1.0
}

#[test]
fn a_noisy_neighbour_changes_nothing_at_the_benchmark_that_runs_away_and_is_not_reported_with_it() {
    let fails = hourly("fails", 475, |t| {
        -40.0 * (1.0 - t / 20.0).ln() + 0.1 * scatter(t)
    });
    // A slope that stands, read by an instrument that jumps.
    let noisy = hourly("noisy", 475, |t| {
        2.0 * t + if (t * 24.0) % 97.0 < 48.0 { 0.0 } else { 30.0 } + 5.0 * scatter(t + 0.3)
    });
    let alone = watch(std::slice::from_ref(&fails));
    let beside = watch(&[fails, noisy]);
    let own = |events: &[Event]| -> Vec<Event> {
        let is_own =
            |event: &&Event| event.benchmark.as_ref().map(BenchmarkId::as_str) == Some("fails");
        events.iter().filter(is_own).cloned().collect()
    };
    assert!(
        own(&alone)
            .iter()
            .any(|event| matches!(event.kind, EventKind::Alert { .. }))
    );
    assert_eq!(own(&alone), own(&beside));
    assert!(shared(&beside).is_empty(), "{:?}", shared(&beside));
}

#[test]
fn two_that_fail_at_one_time_are_reported_together_and_one_with_another_time_is_not_among_them() {
    let log = |end: f64, scale: f64| move |t: f64| -scale * (1.0 - t / end).ln();
    let all = [
        hourly("a", 470, log(20.0, 40.0)),
        hourly("b", 470, log(20.0, 25.0)),
        hourly("c", 470, log(60.0, 400.0)),
    ];
    let reported = shared(&watch(&all));
    let (_, last) = reported.last().unwrap();
    let names: Vec<Vec<&str>> = last
        .iter()
        .map(|group| group.benchmarks.iter().map(BenchmarkId::as_str).collect())
        .collect();
    assert_eq!(names, [["a", "b"]]);
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    let median = last[0].failure_time.median.unwrap();
    assert!((days_before(median, start) - 20.0).abs() < 0.5, "{median}");
}
