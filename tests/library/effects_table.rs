//! The table of the effects: an effect is one definition and one row, and everything else follows from it.

use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use slipwatch::cli::explanation_in_words;
use slipwatch::effects::{
    Act, Cause, EFFECTS, EffectDefinition, EffectSize, Explained, Explanation, Kind, Options, Part,
    Rival, SearchedRecord, SizeInWords, Support, Trying, explain, explain_given,
};
use slipwatch::reading::{
    BenchmarkId, LengthUnit, Reading, Series, Timestamp, Unit, after_days, days_since,
};
use std::collections::BTreeSet;

/// An effect of the test's own: what is dumped on the slope on working days, and hauled away before the next week.
static WORKING_WEEK: EffectDefinition = EffectDefinition {
    name: "working-week",
    what: "The log-load grows from Monday on, and falls back with the next one.",
    title: "a load that grows from Monday to Sunday",
    size_in_words: SizeInWords::Behind(", by a factor of "),
    trying: Trying::AllAlong(weeks),
    size: |fitted| EffectSize::number((fitted.first() * 12.0_f64.sqrt()).exp()),
    ..EffectDefinition::PLAIN
};

/// Another: the fortnight of spring and neap tides, which a forecast can go by.
static SPRING_AND_NEAP: EffectDefinition = EffectDefinition {
    name: "spring-and-neap",
    what: "A wave of half a lunar month in the log-load.",
    title: "a load that comes and goes with spring and neap tides",
    trying: Trying::AllAlong(|record| vec![record.waves(&FORTNIGHT)]),
    support: Support::Astronomy,
    may_be_a_slow_load: false,
    wave_periods: &FORTNIGHT,
    size: |fitted| EffectSize::of_waves(fitted, &FORTNIGHT),
    ..EffectDefinition::PLAIN
};

/// A third, which happens once.
static UNDERCUT: EffectDefinition = EffectDefinition {
    name: "undercut",
    what: "The toe is cut away, and the log-load steps.",
    title: "a toe that was cut away",
    size_in_words: SizeInWords::JumpOfVelocity,
    trying: Trying::Once(&[Act::Step]),
    support: Support::Nothing,
    size: |fitted| EffectSize::number(fitted.first()),
    ..EffectDefinition::PLAIN
};

/// Days.
const FORTNIGHT: [f64; 1] = [14.765];
/// Readings, four a day.
const COUNT: u32 = 280;
const SPACING_DAYS: f64 = 0.25;
/// mm.
const NOISE: f64 = 0.03;

fn weeks(record: &SearchedRecord<'_>) -> Vec<Act> {
    if record.span_days < 28.0 || record.spacing_days > 1.0 {
        return Vec::new();
    }
    let load = record.load(|day| share_of_the_week(after_days(record.epoch, day).unwrap()));
    load.into_iter().collect()
}

/// How much of the week has passed since Monday, 0 to 1.
fn share_of_the_week(time: Timestamp) -> f64 {
    let a_monday = "2001-01-01T00:00:00Z".parse().unwrap();
    (days_since(a_monday, time) / 7.0).rem_euclid(1.0)
}

/// A Thursday.
fn epoch() -> Timestamp {
    "2009-10-01T09:00:00Z".parse().unwrap()
}

fn at(day: f64) -> Timestamp {
    after_days(epoch(), day).unwrap()
}

/// A slope that moves by 1 mm/day where the log-load is 0.
fn slope(log_load: impl Fn(f64) -> f64) -> Series {
    let mut generator = Pcg64::seed_from_u64(7);
    let mut moved_mm = 0.0;
    let readings = (0..COUNT).map(|index| {
        let day = SPACING_DAYS * f64::from(index);
        let parts = (0..8).map(|part| day - SPACING_DAYS * (f64::from(part) + 0.5) / 8.0);
        moved_mm += parts
            .map(|day| log_load(day).exp() * SPACING_DAYS / 8.0)
            .sum::<f64>();
        let noise: f64 = generator.sample(StandardNormal);
        Reading {
            time: at(day),
            value: moved_mm + NOISE * noise,
            sigma: None,
        }
    });
    Series {
        benchmark: BenchmarkId::new("heap"),
        unit: Unit::Length(LengthUnit::Millimetre),
        averaging: None,
        readings: readings.collect(),
    }
}

/// From 0.6 e-folds under the usual velocity on Monday to 0.6 above it on Sunday night.
fn loaded_by_the_week() -> Series {
    slope(|day| 1.2 * (share_of_the_week(at(day)) - 0.5))
}

/// The usual table with a row more.
fn with(one: &'static EffectDefinition) -> Options {
    let mut effects = EFFECTS.to_vec();
    effects.push(one);
    Options {
        effects: effects.leak(),
        surrogates: 99,
        ..Options::default()
    }
}

fn explained(series: &Series, options: &Options) -> Explanation {
    explain(series, &[], &[], options, &mut |_| {})
}

fn kinds(explanation: &Explanation) -> Vec<&'static str> {
    let all = std::iter::once(&explanation.verdict).chain(&explanation.also);
    all.map(|effect| effect.effect.name()).collect()
}

#[test]
fn a_row_more_in_the_table_is_an_effect_more_that_is_found_named_and_put_in_words() {
    let series = loaded_by_the_week();
    let said = explained(&series, &with(&WORKING_WEEK));
    let found = &said.verdict;
    assert_eq!(
        found.effect,
        Kind::of(&WORKING_WEEK),
        "{:?}",
        said.candidates
    );
    let (size, truth) = (found.size.unwrap(), 1.2_f64.exp());
    assert!((size / truth - 1.0).abs() < 0.1, "{size}, {truth}");
    assert_eq!(said.explained, Explained::Full);
    let errors = said.error.fit;
    assert!(
        errors.after.unwrap() < 0.3 * errors.before.unwrap(),
        "{errors:?}"
    );

    let json = serde_json::to_value(&said).unwrap();
    assert_eq!(json["verdict"]["effect"], "working-week");
    assert!(said.curves.log_loads.contains_key("working-week"));
    let words = explanation_in_words(&said);
    let first = words.lines().next().unwrap();
    let sentence =
        "heap: consistent with a load that grows from Monday to Sunday, by a factor of 3.";
    assert!(first.starts_with(sentence), "{first}");
}

#[test]
fn without_the_row_nothing_has_that_name() {
    let series = loaded_by_the_week();
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    let said = explained(&series, &options);
    let mut tried = said.candidates.iter();
    assert!(tried.all(|one| one.effect.name() != "working-week"));
    assert_ne!(said.explained, Explained::Full, "{:?}", kinds(&said));
}

#[test]
fn an_effect_of_the_table_can_be_declared_and_is_judged() {
    let series = loaded_by_the_week();
    let cause = Cause {
        kind: Kind::of(&WORKING_WEEK),
        channel: None,
        at: None,
    };
    let said = explain_given(&series, &[], &[cause], &with(&WORKING_WEEK), &mut |_| {});
    assert_eq!(kinds(&said), ["working-week"]);
    assert_eq!(said.given[0].declared, "working-week");
    assert_eq!(said.given[0].rejected_because, None);
}

#[test]
fn forecasts_go_by_an_effect_that_is_made_of_waves() {
    let load = |day: f64| 0.5 * (std::f64::consts::TAU * day / FORTNIGHT[0]).sin();
    let said = explained(&slope(load), &with(&SPRING_AND_NEAP));
    assert_eq!(kinds(&said), ["spring-and-neap"], "{:?}", said.candidates);
    assert!((said.verdict.size.unwrap() - 0.5).abs() < 0.05);
    assert_eq!(said.verdict.period_days, Some(FORTNIGHT[0]));
    let [part] = said.known_load.parts.as_slice() else {
        panic!("{:?}", said.known_load);
    };
    assert_eq!(part.kind(), Kind::of(&SPRING_AND_NEAP));
    // Beyond the record, which ends on day 70.
    let to_come = [80.0, 84.0, 88.0];
    let known = said.known_load.log_load(&[], &to_come.map(at));
    for (known, truth) in known.iter().zip(to_come.map(load)) {
        assert!((known - truth).abs() < 0.1, "{known} {truth}");
    }
}

#[test]
fn what_happens_once_has_its_own_name_in_the_words_and_in_the_known_load() {
    let series = slope(|day| if day < 40.0 { 0.0 } else { 1.0 });
    // Beside a step of the load it could not be distinguished.
    let options = Options {
        effects: [&UNDERCUT].to_vec().leak(),
        surrogates: 99,
        ..Options::default()
    };
    let said = explained(&series, &options);
    assert_eq!(kinds(&said), ["undercut"], "{:?}", said.candidates);
    assert!(days_since(at(40.0), said.verdict.at.unwrap()).abs() < 1.0);
    let words = explanation_in_words(&said);
    assert!(
        words.starts_with("heap: consistent with a toe that was cut away at 2009-11-"),
        "{words}"
    );
    let mut parts = said.known_load.parts.iter();
    assert!(parts.all(|part| part.kind() == Kind::of(&UNDERCUT) && part.is_step()));
    assert!(matches!(said.known_load.parts[..], [Part::Other { .. }]));
}

#[test]
fn every_row_is_written_and_read_back_by_a_name_of_its_own() {
    let names: Vec<&str> = Kind::all().map(Kind::name).collect();
    assert_eq!(
        names,
        [
            "hydrological",
            "seasonal",
            "tide",
            "load-step",
            "state-reset",
            "friction-change",
            "rate-limit",
            "geometry",
            "partition",
            "offset",
            "thermal",
            "seasonal-reading",
            "interval-mean",
            "correlated-noise",
            "unexplained",
            "none",
        ]
    );
    for kind in Kind::all() {
        let text = serde_json::to_string(&kind).unwrap();
        assert_eq!(text, format!("\"{}\"", kind.name()));
        assert_eq!(serde_json::from_str::<Kind>(&text).unwrap(), kind);
        let packed = rmp_serde::to_vec_named(&kind).unwrap();
        assert_eq!(rmp_serde::from_slice::<Kind>(&packed).unwrap(), kind);
        assert_eq!(Rival::from(kind).to_string(), kind.name());
    }
    assert!(serde_json::from_str::<Kind>("\"working-week\"").is_err());
}

#[test]
fn every_row_says_what_it_is_and_how() {
    let titles: BTreeSet<&str> = EFFECTS.iter().map(|one| one.title).collect();
    assert_eq!(titles.len(), EFFECTS.len());
    for one in EFFECTS {
        let kind = Kind::of(one);
        assert!(one.what.ends_with('.') && !one.title.is_empty(), "{kind}");
        assert!(one.wave_periods.iter().all(|days| *days > 0.0), "{kind}");
        let is_tried = !matches!(one.trying, Trying::Elsewhere);
        assert_eq!(kind.can_be_declared(), is_tried, "{kind}");
        assert!(!(kind.is_an_end() && is_tried), "{kind}");
    }
    assert_eq!(Kind::all().filter(|kind| kind.is_an_end()).count(), 2);
}
