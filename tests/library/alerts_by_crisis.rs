//! What alerts people get: on each archived crisis, and in a year in which nothing happens.

#![allow(
    clippy::unwrap_used,
    reason = "a helper that fails is a test that fails"
)]

use crate::crisis::{Crisis, policy, recording, series};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::alert::Level;
use slipwatch::monitor::{AlertState, Event, EventKind, LevelStretch, levels_in};
use slipwatch::reading::{BenchmarkId, Reading, Series, Timestamp, Unit};
use std::fmt::Write as _;
use std::path::Path;

/// Each recording, when its slope collapsed, and the hours that an evacuation takes.
const ARCHIVE: [(&str, Option<&str>, i64); 6] = [
    ("preonzo-2012.mcap", Some("2012-05-15T01:30:00Z"), 24),
    ("longjingcun-2019.mcap", Some("2019-02-16T21:53:00Z"), 24),
    ("century-mine-2013.mcap", None, 24),
    ("century-mine-2014-southwest.mcap", None, 24),
    (
        "vaiont-1963-reconstruction.mcap",
        Some("1963-10-09T21:39:00Z"),
        72,
    ),
    ("la-clapiere-1982-1995-reconstruction.mcap", None, 24),
];

const LEVELS: [Level; 4] = [Level::Yellow, Level::Orange, Level::Red, Level::Unknown];

/// How often a level was called.
fn called(events: &[Event], wanted: Level) -> usize {
    let is_one = |event: &&Event| matches!(&event.kind, EventKind::Alert { level, state: AlertState::Firing, .. } if *level == wanted);
    events.iter().filter(is_one).count()
}

/// Hours at a level, from the first reading to the last.
fn hours(stretches: &[LevelStretch], level: Level) -> f64 {
    let own = stretches.iter().filter(|one| one.level == level);
    let each = own.map(|one| one.to.duration_since(one.from).as_secs_f64() / 3600.0);
    // A sum of nothing is -0.
    each.fold(0.0, |sum, hours| sum + hours)
}

/// One benchmark's row.
fn row(file: &str, series: &Series, collapse: Option<Timestamp>, evacuation: i64) -> String {
    let crisis = Crisis::play(series, &policy(evacuation));
    let span = series.span().unwrap();
    let (levels, unknown) = levels_in(&crisis.events, Some(&series.benchmark), span);
    let counts = LEVELS.map(|level| called(&crisis.events, level).to_string());
    let lasted = LEVELS.map(|level| {
        let stretches = if level == Level::Unknown {
            &unknown
        } else {
            &levels
        };
        format!("{:.0}", hours(stretches, level))
    });
    let before = |level| {
        let (at, collapse) = (crisis.first(level)?, collapse?);
        Some(collapse.duration_since(at).as_secs_f64() / 86_400.0)
    };
    let shown = |days: Option<f64>| days.map_or("-".to_owned(), |days| format!("{days:.1}"));
    format!(
        "| `{file}` | {} | {} | {} | {} | {} |\n",
        series.benchmark,
        counts.join(", "),
        shown(before(Level::Orange)),
        shown(before(Level::Red)),
        lasted.join(", "),
    )
}

fn table() -> String {
    let mut text = "| recording | benchmark | alerts: yellow, orange, red, unknown | first orange, days before the collapse | first red, days before the collapse | hours at yellow, orange, red, unknown |\n|---|---|---|---|---|---|\n"
        .to_owned();
    for (file, collapse, evacuation) in ARCHIVE {
        let collapse = collapse.map(|at| at.parse().unwrap());
        for one in series(&recording(file), None) {
            let _ = write!(text, "{}", row(file, &one, collapse, evacuation));
        }
    }
    text
}

/// With `UPDATE_DOCS=1` the table is written instead.
#[test]
fn the_table_of_alerts_by_archived_crisis_in_the_docs_is_what_the_monitor_calls() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/alerts.md");
    let text = std::fs::read_to_string(&file).unwrap();
    let table = table();
    if text.contains(&table) {
        return;
    }
    assert!(
        std::env::var_os("UPDATE_DOCS").is_some(),
        "docs/alerts.md has another table; UPDATE_DOCS=1 writes this one:\n{table}"
    );
    let begin = text.find("| recording | benchmark |").unwrap();
    let end = begin + text[begin..].find("\n\n").unwrap() + 1;
    std::fs::write(&file, format!("{}{table}{}", &text[..begin], &text[end..])).unwrap();
}

const DAY: f64 = 24.0;

/// A year of a slope that creeps, read each three hours by an instrument with an annual and a daily wave, whose zero is set
/// anew twice and which fails three times for days. Nothing of it is declared.
fn quiet_year(seed: u64, mm_per_day: f64) -> Series {
    let mut random = Pcg64::seed_from_u64(seed);
    let start: Timestamp = "2021-01-01T00:00:00Z".parse().unwrap();
    let resets = [
        random.random_range(60.0..150.0) * DAY,
        random.random_range(200.0..320.0) * DAY,
    ];
    let gaps = [40.0, 170.0, 260.0].map(|day| {
        let begin = (day + random.random_range(0.0..20.0)) * DAY;
        (begin, begin + random.random_range(1.0..6.0) * DAY)
    });
    let mut readings = Vec::new();
    for step in 0..(365 * 8) {
        let hour = 3.0 * f64::from(step);
        let noise: f64 = random.sample(StandardNormal);
        if gaps.iter().any(|(from, to)| hour >= *from && hour < *to) {
            continue;
        }
        let wave =
            |amplitude: f64, hours: f64| amplitude * (std::f64::consts::TAU * hour / hours).sin();
        let reset: f64 = resets.iter().filter(|at| hour >= **at).map(|_| -40.0).sum();
        let value = mm_per_day * hour / DAY
            + wave(6.0, 365.25 * DAY)
            + wave(0.5, DAY)
            + reset
            + 0.4 * noise;
        readings.push(Reading {
            time: start + jiff::SignedDuration::from_secs_f64(hour * 3600.0),
            value,
            sigma: None,
        });
    }
    Series {
        benchmark: BenchmarkId::new("quiet"),
        unit: Unit::MM,
        averaging: None,
        readings,
    }
}

#[test]
fn a_quiet_year_with_seasons_resets_and_gaps_has_no_red_and_two_orange_at_most() {
    let mut orange = 0;
    for (seed, mm_per_day) in [(1, 0.0), (2, 0.2), (3, 1.5)] {
        let crisis = Crisis::play(&quiet_year(seed, mm_per_day), &policy(24));
        let alerts = |level| called(&crisis.events, level);
        assert_eq!(
            alerts(Level::Red),
            0,
            "{mm_per_day} mm/day: {:?}",
            crisis.levels()
        );
        orange += alerts(Level::Orange);
        assert!(alerts(Level::Unknown) >= 3, "the gaps are reported");
    }
    assert!(orange <= 2, "{orange} orange at three benchmarks");
}
