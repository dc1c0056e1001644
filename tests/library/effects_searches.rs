//! Searches beside the monitor: what they find, and that nothing but the data decides when it takes effect.

#![allow(
    clippy::unwrap_used,
    clippy::wildcard_enum_match_arm,
    clippy::cast_precision_loss,
    dead_code,
    reason = "a helper that fails is a test that fails; a test looks for the kinds it names"
)]

use crate::loaded::{Measured, RESERVOIR, Slope, flood, restless, start};
use jiff::SignedDuration;
use slipwatch::config;
use slipwatch::effects::{Kind, Options, explain};
use slipwatch::monitor::{Event, EventKind, Explain, Settings, UndeclaredLoad};
use slipwatch::reading::{
    BenchmarkId, Channel, Reading, Recording, Sample, Series, Timestamp, Unit,
};
use slipwatch::runtime::progress::Progress;
use slipwatch::runtime::replay::{ReplayPace, ReplayPlan, replay};
use slipwatch::runtime::run::run;
use slipwatch::runtime::shutdown;
use slipwatch::store::Store;
use std::io::Write;
use std::path::Path;
use std::time::Duration;
use tokio::sync::{OnceCell, watch};

/// Half a year beside a reservoir, with a flood in it.
fn half_a_year() -> Measured {
    let slope = Slope {
        v: 5.0,
        life: f64::INFINITY,
        gain: 0.8,
    };
    slope.measured(190, |day| restless(day) + flood(day, 100.0, 1.5))
}

fn recording(measured: &Measured) -> Recording {
    Recording {
        series: vec![Series {
            benchmark: BenchmarkId::new("a"),
            unit: Unit::MM,
            averaging: None,
            readings: measured.readings.clone(),
        }],
        channels: vec![Channel {
            name: RESERVOIR.to_owned(),
            unit: Some("m".to_owned()),
            stated: None,
            samples: measured.samples.clone(),
        }],
        ..Recording::default()
    }
}

/// The events of a replay, one JSON object each, without the summary.
async fn said(explain: Explain, pace: ReplayPace, until: Option<Timestamp>) -> Vec<String> {
    let settings = Settings {
        explain,
        ..Settings::default()
    };
    let plan = ReplayPlan {
        site: "Toc",
        settings: &settings,
        hooks: &[],
        pace,
        until,
    };
    let (_trigger, shutdown) = shutdown::pair();
    let mut events = Vec::new();
    let mut each = |event: &Event| {
        events.push(serde_json::to_string(event)?);
        Ok(())
    };
    let recording = recording(&half_a_year());
    replay(&recording, &plan, shutdown, &mut each)
        .await
        .unwrap();
    events.pop();
    events
}

/// Of a replay with adoption, as fast as it goes: made once for all tests.
async fn adopted() -> &'static [String] {
    static ONCE: OnceCell<Vec<String>> = OnceCell::const_new();
    ONCE.get_or_init(|| said(Explain::Adopt, ReplayPace::Max, None))
        .await
}

/// The same from a daemon over a file, up to the last reading: after it, the clock is today's.
async fn said_by_a_daemon() -> Vec<String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("incoming")).unwrap();
    let measured = half_a_year();
    let rows = measured.samples.iter().zip(&measured.readings);
    let rows = rows
        .map(|(sample, reading)| format!("{},{},{}\n", sample.time, sample.value, reading.value));
    let rows: Vec<String> = rows.collect();
    let (past, live) = rows.split_at(rows.len() - LIVE);
    let text = format!("time,{RESERVOIR},a_displacement_mm\n{}", past.concat());
    let logger = folder.path().join("incoming/logger.csv");
    std::fs::write(&logger, text).unwrap();
    let site = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n\
                [[source]]\nid = \"logger\"\nkind = \"csv\"\npath = \"incoming/*.csv\"\n\
                [[hook]]\nrun = [\"/bin/true\"]\n";
    let file = folder.path().join("site.toml");
    std::fs::write(&file, site).unwrap();
    let config = config::load(&file).unwrap();
    let (trigger, shutdown) = shutdown::pair();
    let (sender, mut progress) = watch::channel(Progress::default());
    let own = config.clone();
    let task = tokio::spawn(async move {
        Box::pin(run(&own, shutdown, &sender, |event, _| {
            event.kind.name().to_owned()
        }))
        .await
    });
    let caught_up = progress.wait_for(|progress| progress.is_caught_up);
    tokio::time::timeout(Duration::from_secs(120), caught_up)
        .await
        .unwrap()
        .unwrap();
    // A search's answer takes effect at the first reading after it has come.
    let mut growing = std::fs::OpenOptions::new()
        .append(true)
        .open(&logger)
        .unwrap();
    for row in live {
        growing.write_all(row.as_bytes()).unwrap();
        tokio::time::sleep(Duration::from_secs(2)).await;
        let events = events_of(&config.site.state_dir);
        if events.iter().any(|line| line.contains("effect-found")) {
            break;
        }
    }
    trigger.request();
    task.await.unwrap().unwrap();
    let last = measured.readings.last().unwrap().time;
    let events = events_of(&config.site.state_dir).into_iter();
    let events = events.filter(|line| {
        let event: Event = serde_json::from_str(line).unwrap();
        // A replay without a config has no level of the whole site.
        event.time <= last && event.benchmark.is_some()
    });
    events.collect()
}

/// Readings that come after the first start, at most.
const LIVE: usize = 30;

/// The events of a daemon's state.
fn events_of(state: &Path) -> Vec<String> {
    let store = Store::look(state).unwrap();
    let mut events: Vec<(i64, String)> = Vec::new();
    loop {
        let after = events.last().map_or(0, |(seq, _)| *seq);
        let some = store.events(after, None, None).unwrap();
        if some.is_empty() {
            return events.into_iter().map(|(_, line)| line).collect();
        }
        events.extend(some);
    }
}

/// (day, kind, channel, adopted) of every effect found.
fn found(events: &[String]) -> Vec<(i64, Kind, Option<String>, bool)> {
    let one = |line: &String| match serde_json::from_str::<Event>(line).unwrap() {
        Event {
            time,
            kind:
                EventKind::EffectFound {
                    effect,
                    channel,
                    adopted,
                    ..
                },
            ..
        } => {
            let day = time.duration_since(start()).as_hours() / 24;
            Some((day, effect, channel, adopted))
        }
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

/// The load that nobody declared, of each effect found.
fn loads(events: &[String]) -> Vec<UndeclaredLoad> {
    let one = |line: &String| match serde_json::from_str::<Event>(line).unwrap().kind {
        EventKind::EffectFound {
            undeclared_load, ..
        } => undeclared_load.map(|load| *load),
        _ => None,
    };
    events.iter().filter_map(one).collect()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_search_finds_the_reservoir_and_its_answer_comes_at_one_time_of_the_data_at_any_pace() {
    let fast = adopted().await;
    let found = found(fast);
    let (day, kind, channel, adopted) = &found[0];
    assert_eq!(*kind, Kind::HYDROLOGICAL, "{found:?}");
    assert_eq!(channel.as_deref(), Some(RESERVOIR));
    assert!(*adopted);
    let load = loads(fast).remove(0);
    let mean_square =
        |load: &[f64]| load.iter().map(|one| one * one).sum::<f64>() / load.len() as f64;
    assert_eq!(load.times.len(), load.before.len());
    assert!(
        mean_square(&load.after) < 0.25 * mean_square(&load.before),
        "the reservoir takes half of the load that nobody declared: {load:?}"
    );
    // A day in 10 ms: the search takes longer than that, and is waited for.
    let slow = said(Explain::Adopt, ReplayPace::Times(8_640_000.0), None).await;
    assert!(fast == slow, "the pace changed the events");
    // What comes before the answer does not know of it.
    let until = start() + SignedDuration::from_hours(24 * (*day + 3));
    let beginning = said(Explain::Adopt, ReplayPace::Max, Some(until)).await;
    assert!(fast.starts_with(&beginning), "no beginning of the whole");
    assert!(
        beginning.len() < fast.len() && beginning.iter().any(|line| line.contains("is_explained"))
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_daemon_finds_what_a_replay_finds_though_its_search_holds_nothing_up() {
    let replayed = found(adopted().await);
    let daemon = said_by_a_daemon().await;
    // A daemon takes an answer when it has come; a replay waits for it where it is due.
    let kinds = |found: &[(i64, Kind, Option<String>, bool)]| {
        let each = found.iter();
        let each = each.map(|(_, kind, channel, adopted)| (*kind, channel.clone(), *adopted));
        each.collect::<Vec<_>>()
    };
    let daemon = found(&daemon);
    assert_eq!(kinds(&daemon)[0], kinds(&replayed)[0], "{daemon:?}");
    assert!(daemon[0].0 >= replayed[0].0, "{daemon:?} {replayed:?}");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_search_that_is_switched_off_finds_nothing_and_one_that_only_reports_adopts_nothing() {
    assert_eq!(found(&said(Explain::Off, ReplayPace::Max, None).await), []);
    let told = said(Explain::Report, ReplayPace::Max, None).await;
    let found = found(&told);
    assert!(
        !found.is_empty() && found.iter().all(|one| !one.3),
        "{found:?}"
    );
    assert!(!told.iter().any(|line| line.contains("is_explained")));
}

#[test]
fn the_load_that_forecasts_use_is_the_one_that_was_fitted() {
    let recording = recording(&half_a_year());
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    let said = explain(
        &recording.series[0],
        &recording.channels,
        &[],
        &options,
        &mut |_| {},
    );
    let channels: Vec<&Channel> = recording.channels.iter().collect();
    let told = said.known_load.log_load(&channels, &said.curves.times);
    assert!(!said.curves.log_loads.is_empty());
    for (index, told) in told.into_iter().enumerate() {
        let fitted: f64 = said.curves.log_loads.values().map(|load| load[index]).sum();
        assert!((told - fitted).abs() < 1e-6, "{index}: {told} {fitted}");
    }
}

/// A drawn slope that was unloaded in a moment on day 16, mm, and a river that has nothing to do with it, m³/s; one each a day.
const UNLOADED: [f64; 40] = [
    0.86, 1.74, 5.77, 4.64, 8.57, 9.39, 11.84, 15.00, 15.27, 18.10, 19.61, 21.81, 24.25, 25.25,
    27.54, 30.31, 33.16, 32.90, 33.48, 34.86, 36.90, 36.12, 37.88, 39.65, 39.87, 40.54, 41.15,
    40.31, 43.07, 44.78, 44.90, 44.36, 45.13, 45.58, 46.76, 49.91, 49.66, 48.62, 50.80, 50.88,
];
const RIVER: [f64; 40] = [
    20.0000, 15.7480, 25.4573, 26.6317, 22.2856, 24.3590, 28.5660, 38.1285, 28.7376, 27.7065,
    24.9266, 19.3631, 20.9043, 16.3959, 13.1655, 12.0414, 10.0454, 8.6152, 7.5904, 12.8940,
    15.6737, 14.0937, 11.5159, 9.6689, 8.3454, 18.7925, 32.0610, 28.6421, 27.8081, 23.2136,
    18.0506, 14.3512, 11.7004, 9.8011, 8.4401, 7.4649, 6.7662, 6.2655, 5.9068, 5.6498,
];

#[test]
fn an_event_that_so_few_later_readings_refuse_within_chance_is_not_put_on_the_channel_that_gains_less()
 {
    let day = |day: i64| start() + SignedDuration::from_hours(24 * day);
    let readings = (0..).zip(UNLOADED).map(|(index, value)| Reading {
        time: day(index),
        value,
        sigma: None,
    });
    let samples = (0..).zip(RIVER).map(|(index, value)| Sample {
        time: day(index),
        value,
    });
    let series = Series {
        benchmark: BenchmarkId::new("a"),
        unit: Unit::MM,
        averaging: None,
        readings: readings.collect(),
    };
    let river = Channel {
        name: "river_flow_m3_s".to_owned(),
        unit: Some("m3/s".to_owned()),
        stated: None,
        samples: samples.collect(),
    };
    let said = explain(&series, &[river], &[], &Options::default(), &mut |_| {});
    // The step gains more than the river, which shifted rivers equal: it is named, or nothing is claimed, and never the river alone.
    let is_step = |kind: &Kind| *kind == Kind::LOAD_STEP;
    let mut rivals = said.cannot_separate_from.iter();
    let is_named = is_step(&said.verdict.effect) || rivals.any(|rival| is_step(&rival.kind));
    assert!(
        is_named || said.verdict.channel.is_none(),
        "{:?}: {:?}",
        said.verdict,
        said.cannot_separate_from
    );
    let tried = said.candidates.iter();
    assert!(
        tried.map(|one| &one.effect).any(is_step),
        "{:?}",
        said.candidates
    );
}
