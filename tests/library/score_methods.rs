//! The methods that are scored know the past alone, and no record breaks them.

use slipwatch::fit::{Observation, Observations};
use slipwatch::forecast::Passage;
use slipwatch::reading::{Quantity, after_days, days_since};
use slipwatch::runtime::ingest::{ReadOptions, read_files};
use slipwatch::score::{METHODS, Method, Truth, WholeRecord, card};
use std::path::Path;
use studies::{Fate, Life};

/// Where a record is looked at, tenths of its readings.
const LOOKS: [usize; 3] = [2, 6, 9];
/// Readings kept of a recording: what is shown does not need more.
const MOST_READINGS: usize = 240;

fn of_life(fate: Fate, seed: u64) -> WholeRecord {
    let life = Life::draw(fate, seed);
    let observations = life.known(f64::INFINITY);
    let flow = (0..2000).map(|day| {
        let days = f64::from(day);
        (days, 12.0 + 9.0 * (days / 29.0).sin())
    });
    WholeRecord {
        observations,
        flow: flow.collect(),
        critical_mm_per_day: Life::CRITICAL_MM_PER_DAY,
    }
}

/// Every series of a recording, with its first channel as the flow.
fn recorded(name: &str) -> Vec<WholeRecord> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("recordings");
    let (recording, _) = read_files(&[folder.join(name)], &ReadOptions::default()).unwrap();
    let series = recording.series.iter().map(|series| {
        let epoch = series.readings[0].time;
        let mut observations = Observations::of(series);
        observations.values.truncate(MOST_READINGS);
        let samples = recording.channels.first().map(|channel| &channel.samples);
        let flow = samples.into_iter().flatten();
        WholeRecord {
            observations,
            flow: flow
                .map(|sample| (days_since(epoch, sample.time), sample.value))
                .collect(),
            critical_mm_per_day: 1000.0,
        }
    });
    series.collect()
}

fn histories() -> Vec<WholeRecord> {
    let lives = [
        (Fate::Failing, 3),
        (Fate::Failing, 7),
        (Fate::Saturating, 1),
        (Fate::Settling, 2),
    ];
    let mut histories: Vec<WholeRecord> = lives.map(|(fate, seed)| of_life(fate, seed)).into();
    histories.extend(recorded("century-mine-2013.mcap"));
    histories.extend(recorded("vaiont-1963-reconstruction.mcap"));
    histories.extend(recorded("la-clapiere-1982-1995-reconstruction.mcap"));
    histories
}

fn forecasts(history: &WholeRecord, days: f64) -> Vec<(&'static str, Option<Passage>)> {
    let known = history.at(days).unwrap();
    METHODS
        .iter()
        .map(|method| (method.name, (method.forecast)(&known)))
        .collect()
}

/// The record as it stood at `days`, and then whatever `future` makes of what is to come.
fn with_future(history: &WholeRecord, days: f64, future: impl Fn(f64) -> f64) -> WholeRecord {
    let mut other = history.clone();
    other
        .observations
        .values
        .retain(|value| value.t_days <= days);
    other.flow.retain(|(at, _)| *at <= days);
    for step in 1..60 {
        let t_days = days + 0.7 * f64::from(step);
        let value = future(f64::from(step));
        let sigma = None;
        other.observations.values.push(Observation {
            t_days,
            value,
            sigma,
        });
        other.flow.push((t_days, value));
    }
    other
}

#[test]
fn nothing_that_is_read_later_changes_a_forecast_made_before() {
    let mut made = 0;
    for (index, history) in histories().iter().enumerate() {
        let values = &history.observations.values;
        for tenths in LOOKS {
            let days = values[values.len() * tenths / 10].t_days;
            let before = forecasts(history, days);
            made += before.iter().filter(|(_, said)| said.is_some()).count();
            let futures: [fn(f64) -> f64; 4] = [
                |_| 0.0,
                |step| 1e6 * step.exp(),
                |step| -1e9 * step,
                |step| if step > 30.0 { f64::NAN } else { step },
            ];
            for future in futures {
                let after = forecasts(&with_future(history, days, future), days);
                assert_eq!(before, after, "record {index}, day {days}");
            }
        }
    }
    assert!(made > 100, "{made} forecasts");
}

#[test]
fn every_method_has_something_to_say_of_slopes_that_fail() {
    let mut said = vec![false; METHODS.len()];
    for seed in 0..6 {
        let history = of_life(Fate::Failing, seed);
        let values = &history.observations.values;
        let days = values[values.len() / 2].t_days;
        for (said, (_, forecast)) in said.iter_mut().zip(forecasts(&history, days)) {
            *said |= forecast.is_some();
        }
    }
    for (method, said) in METHODS.iter().zip(said) {
        assert!(said, "{}", method.name);
    }
}

#[test]
fn the_names_are_all_different_and_so_are_the_sources_given() {
    for (index, method) in METHODS.iter().enumerate() {
        assert!(!method.source.is_empty(), "{}", method.name);
        let is_new = |other: &Method| other.name != method.name;
        assert!(METHODS[..index].iter().all(is_new), "{}", method.name);
    }
}

/// Numbers without pattern, from -1 to 1.
fn scatter(index: u32) -> f64 {
    let mixed = index.wrapping_mul(2_654_435_761).rotate_left(13) ^ index.wrapping_mul(40_503);
    f64::from(mixed.wrapping_mul(2_246_822_519)) / f64::from(u32::MAX) * 2.0 - 1.0
}

/// A name and the value of each reading.
type Hostile = (&'static str, fn(u32) -> f64);

const HOSTILE: [Hostile; 12] = [
    ("constant", |_| 7.0),
    ("zero", |_| 0.0),
    ("noise", scatter),
    ("creep in noise", |i| 0.1 * f64::from(i) + scatter(i)),
    ("huge", |i| 1e150 * f64::from(i * i)),
    ("at the end of numbers", |i| {
        if i % 2 == 0 { f64::MAX } else { f64::MIN }
    }),
    ("tiny", |i| 5e-324 * f64::from(i)),
    ("falling", |i| -3.0 * f64::from(i)),
    ("a step", |i| if i > 20 { 1e5 } else { 0.0 }),
    ("exponential", |i| (0.7 * f64::from(i)).exp()),
    ("singular", |i| 1000.0 / (80.001 - f64::from(i.min(80)))),
    ("back and forth", |i| f64::from(i % 2) * 1e4),
];

#[test]
fn no_record_makes_a_method_panic_or_say_what_is_no_time() {
    let counts = [1, 2, 3, 4, 6, 8, 12, 17, 40, 81];
    for (what, value) in HOSTILE {
        for quantity in [Quantity::Displacement, Quantity::Velocity] {
            for count in counts {
                let days = |index: u32| 0.5 * f64::from(index);
                let values = (0..count).map(|index| Observation {
                    t_days: days(index),
                    value: value(index),
                    sigma: (index % 3 == 0).then_some(0.0),
                });
                let flow = (0..count).map(|index| (days(index), value(index)));
                let history = WholeRecord {
                    observations: Observations {
                        quantity,
                        averaging_days: 0.0,
                        values: values.collect(),
                    },
                    flow: flow.collect(),
                    critical_mm_per_day: 1000.0,
                };
                for (name, said) in forecasts(&history, 1e9) {
                    let said = said.unwrap_or_default();
                    let are_times = said.times().iter().all(|(days, share)| {
                        days.is_finite() && *days >= 0.0 && (0.0..=1.0 + 1e-9).contains(share)
                    });
                    assert!(are_times, "{name}: {count} of {what}: {said:?}");
                }
            }
        }
    }
}

#[test]
fn nothing_is_known_before_the_first_reading() {
    let history = of_life(Fate::Failing, 3);
    assert_eq!(history.at(-1.0), None);
}

#[test]
fn a_row_more_in_the_table_is_a_rival_more_on_the_scorecard() {
    let tomorrow = Method {
        name: "tomorrow",
        source: "this test",
        needs_flow: false,
        forecast: |_| Some(Passage::from_times(vec![(1.0, 1.0)])),
    };
    let methods = [METHODS[0], tomorrow];
    // A straight line in inverse velocity that meets zero on day 60; read daily.
    let fall = |day: f64| (day, -100.0 * (1.0 - day / 60.0).ln());
    let history = WholeRecord {
        observations: Observations::of_displacements((0..60_u32).map(|day| fall(day.into()))),
        flow: Vec::new(),
        critical_mm_per_day: 1000.0,
    };
    let epoch = "2020-01-01T00:00:00Z".parse().unwrap();
    let failure = after_days(epoch, 60.0).unwrap();
    let card = card(
        &history,
        epoch,
        Truth::Failed(failure),
        &methods,
        &mut |_, _| (),
    );
    assert_eq!(card.methods, ["panel", "tomorrow"]);
    assert!(card.leads.len() > 3);
    for lead in &card.leads {
        let score = &lead.scores["tomorrow"];
        let early = lead.remaining_days - 1.0;
        assert!((score.error_days.unwrap() + early).abs() < 1e-9);
        assert!((score.crps_days - early).abs() < 1e-9);
        assert!(lead.scores["panel"].said);
    }
}
