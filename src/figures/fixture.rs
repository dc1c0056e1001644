//! Explanations made by hand, for the tests of what is said and drawn of them.

use crate::effects::{
    Candidate, Change, Curves, Effect, ErrorChange, Explained, Explanation, Fault, FaultKind,
    ForecastChange, Form, Kind, NoiseReport, ResidualTests, SettingsReport, Structure,
};
use crate::reading::{BenchmarkId, Quantity, Timestamp, Unit};

const READINGS: u32 = 360;

pub(crate) fn time(text: &str) -> Timestamp {
    text.parse().unwrap()
}

fn some<T>(before: T, after: T) -> Change<Option<T>> {
    Change {
        before: Some(before),
        after: Some(after),
    }
}

/// A slope beside a lake, explained in part by its level.
pub(crate) fn lake() -> Explanation {
    let day = |index: u32| jiff::SignedDuration::from_hours(24 * i64::from(index));
    let first = time("2017-01-10T00:00:00Z");
    let times: Vec<Timestamp> = (0..READINGS).map(|index| first + day(index)).collect();
    Explanation {
        benchmark: BenchmarkId::new("BLKM"),
        quantity: Quantity::Displacement,
        unit: Unit::MM,
        readings: times.len(),
        first: times.first().copied(),
        last: times.last().copied(),
        verdict: by_the_lake(),
        explained: Explained::Partly,
        also: vec![an_offset()],
        given: Vec::new(),
        cannot_separate_from: vec![Kind::SEASONAL.into()],
        faults: vec![a_reset()],
        error: ErrorChange {
            unit: Unit::MM,
            fit: some(7.89, 3.31),
            held_out: some(20.9, 11.3),
            held_out_step: some(5.1, 3.4),
            held_out_from: times.get(240).copied(),
            caveat: None,
        },
        forecast: ForecastChange {
            probability_unstable: some(0.82, 0.31),
            probability_of_failure: some(0.12, 0.03),
            failure_time: Change::default(),
        },
        candidates: candidates(),
        flags: vec!["covariate-reset".to_owned()],
        remarks: vec![
            "Two annual cycles are few: rain & season may stand in for the lake.".to_owned(),
        ],
        residual: ResidualTests {
            runs: some(0.0004, 0.21),
            stoffer_toloi: some(0.0, 0.03),
            undeclared_load_bic_gain: some(212.0, 14.0),
            undeclared_load_sd: some(0.42, 0.11),
            structure: vec![Structure {
                from: time("2017-06-01T00:00:00Z"),
                until: time("2017-06-20T00:00:00Z"),
                log_load: 0.33,
                z: 4.2,
            }],
        },
        noise: NoiseReport {
            white: 1.1,
            correlated: 2.4,
            memory_days: Some(9.0),
        },
        settings: SettingsReport {
            version: "0.1.0".to_owned(),
            seed: 1,
            surrogates: 199,
            bic_margin: 10.0,
            data_hash: "a1b2c3d4e5f60718".to_owned(),
        },
        curves: curves(times),
        known_load: crate::effects::KnownLoad::default(),
    }
}

fn by_the_lake() -> Effect {
    Effect {
        channel: Some("lake_level_m".to_owned()),
        form: Some(Form::Level),
        p_value: Some(0.005),
        lag_days: Some(12.0),
        memory_days: Some(36.0),
        gain_per_sd: Some(0.875),
        gain_interval: Some([0.7, 1.05]),
        bic_gain: 612.0,
        contribution_rms: Some(6.1),
        ..Effect::of(Kind::HYDROLOGICAL)
    }
}

pub(crate) fn an_offset() -> Effect {
    Effect {
        at: Some(time("2017-09-10T00:00:00Z")),
        at_interval: Some([time("2017-09-09T00:00:00Z"), time("2017-09-11T00:00:00Z")]),
        size: Some(-74.0),
        unit: Some("mm".to_owned()),
        p_value: Some(0.005),
        bic_gain: 84.0,
        contribution_rms: Some(31.0),
        ..Effect::of(Kind::OFFSET)
    }
}

fn a_reset() -> Fault {
    Fault {
        kind: FaultKind::Reset,
        channel: Some("lake_sensor_raw_m".to_owned()),
        at: time("2017-06-06T17:00:00Z"),
        until: None,
        size: Some(0.68),
        unit: Some("m".to_owned()),
        values: 1,
        copy_of: None,
    }
}

fn candidates() -> Vec<Candidate> {
    let one = |effect, channel: Option<&str>, bic_gain, held_out, why: Option<&str>| Candidate {
        effect,
        channel: channel.map(str::to_owned),
        form: channel.map(|_| Form::Level),
        at: None,
        lag_days: channel.map(|_| 12.0),
        bic_gain,
        p_value: why.is_none().then_some(0.005),
        held_out: Some(held_out),
        rejected_because: why.map(str::to_owned),
    };
    let margin = "within the margin of the one accepted, and it needs a year that the record has hardly seen twice";
    let mut tried = vec![
        one(Kind::HYDROLOGICAL, Some("lake_level_m"), 612.0, 0.54, None),
        one(Kind::SEASONAL, None, 192.0, 0.96, Some(margin)),
        one(
            Kind::HYDROLOGICAL,
            Some("creek_stage_m"),
            120.0,
            1.61,
            Some("held-out error rises"),
        ),
        one(
            Kind::HYDROLOGICAL,
            Some("air_temperature_c"),
            72.0,
            1.2,
            Some("held-out error rises"),
        ),
        one(Kind::OFFSET, None, 84.0, 0.9, None),
        one(
            Kind::GEOMETRY,
            None,
            -4.0,
            1.0,
            Some("BIC gains less than 10"),
        ),
        one(
            Kind::RATE_LIMIT,
            None,
            -412.0,
            3.0,
            Some("BIC gains less than 10"),
        ),
    ];
    tried[4].at = an_offset().at;
    tried
}

fn curves(times: Vec<Timestamp>) -> Curves {
    let of = |f: fn(f64) -> f64| (0..READINGS).map(|index| f(f64::from(index))).collect();
    let noise: Vec<f64> = of(|t| (7.3 * t).sin() + (12.9898 * t).sin());
    let known_load: Vec<f64> = of(|t| 1.4 * t + 22.0 * (t / 58.0).sin());
    let sum = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a + b).collect::<Vec<f64>>();
    let decays = |half: f64| {
        (0..30)
            .map(|lag| 0.5_f64.powf(f64::from(lag) / half))
            .collect()
    };
    Curves {
        times,
        readings: sum(&known_load, &noise),
        before: of(|t| 1.4 * t + 5.0),
        after: known_load.clone(),
        before_held_out: of(|t| 1.6 * t - 10.0 + 0.001 * t * t),
        after_held_out: of(|t| 1.42 * t + 21.0 * (t / 58.0).sin()),
        load_before: of(|t| 0.5 * (t / 58.0).cos())
            .into_iter()
            .map(|f: f64| (f, 0.15))
            .collect(),
        load_after: of(|t| 0.05 * (t / 20.0).cos())
            .into_iter()
            .map(|f: f64| (f, 0.1))
            .collect(),
        autocorrelation: Change {
            before: decays(4.0),
            after: decays(0.4),
        },
        lag_days: 1.0,
        contributions: [
            (
                "hydrological lake_level_m".to_owned(),
                of(|t| 22.0 * (t / 58.0).sin()),
            ),
            (
                "offset 2017-09-10".to_owned(),
                of(|t| if t < 243.0 { 0.0 } else { -74.0 }),
            ),
        ]
        .into(),
        log_loads: [(
            "hydrological lake_level_m".to_owned(),
            of(|t| 0.4 * (t / 58.0).cos()),
        )]
        .into(),
    }
}

/// A slope of which nothing can be said.
pub(crate) fn bare(kind: Kind) -> Explanation {
    let full = lake();
    Explanation {
        verdict: Effect::of(kind),
        explained: Explained::None,
        also: Vec::new(),
        given: Vec::new(),
        cannot_separate_from: Vec::new(),
        faults: Vec::new(),
        error: ErrorChange {
            fit: Change::default(),
            held_out: Change::default(),
            held_out_step: Change::default(),
            held_out_from: None,
            ..full.error
        },
        forecast: ForecastChange::default(),
        candidates: Vec::new(),
        flags: Vec::new(),
        remarks: Vec::new(),
        curves: Curves::default(),
        ..full
    }
}
