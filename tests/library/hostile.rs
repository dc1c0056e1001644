//! Readings that make no sense end in a name: never in a panic, never in a number that nobody measured.

use jiff::SignedDuration;
use proptest::prelude::*;
use slipwatch::fit::{ConstantLoad, Exponent, FitOutcome, Lattice, PointReadings};
use slipwatch::inversion::{FitReport, Inversion, InversionOptions};
use slipwatch::monitor::{Input, Monitor, Settings};
use slipwatch::reading::{BenchmarkId, Quantity, Reading, Series, Timestamp, Unit};
use slipwatch::regime::Regime;

fn start() -> Timestamp {
    "2001-01-01T00:00:00Z".parse().unwrap()
}

/// (seconds from the start, value), as they come.
fn series(unit: Unit, pairs: &[(i64, f64)]) -> Series {
    let reading = |(seconds, value): &(i64, f64)| Reading {
        time: start() + SignedDuration::from_secs(*seconds),
        value: *value,
        sigma: None,
    };
    Series {
        benchmark: BenchmarkId::new("5"),
        unit,
        averaging: None,
        readings: pairs.iter().map(reading).collect(),
    }
}

fn daily(values: &[f64]) -> Vec<(i64, f64)> {
    (0..)
        .map(|day| 86_400 * day)
        .zip(values.iter().copied())
        .collect()
}

fn report(unit: Unit, pairs: &[(i64, f64)], exponent: Exponent) -> FitReport {
    let options = InversionOptions {
        exponent,
        ..InversionOptions::default()
    };
    let inversion = Inversion::new(&series(unit, pairs), &options);
    inversion.report(&inversion.least_squares(), 0.0)
}

/// What a report must be, whatever the readings were.
fn check(report: &FitReport) -> Result<(), TestCaseError> {
    let p = &report.parameters;
    let estimates = [
        p.m,
        p.x_i,
        p.t_unit_days,
        p.d,
        p.d_c,
        p.s_theta_i,
        p.v_i,
        p.r_per_day,
        p.kappa_per_day,
    ];
    for estimate in estimates {
        for value in [estimate.best, estimate.low, estimate.high] {
            prop_assert!(value.is_none_or(f64::is_finite), "{report:?}");
        }
    }
    prop_assert!(!report.termination.is_empty());
    prop_assert_eq!(report.rms.is_some(), !report.alternatives.0.is_empty());
    prop_assert!(report.rms.is_none_or(|rms| rms.is_finite() && rms >= 0.0));
    let said = ["converged", "m at its bound", "stopped"];
    let has_result = said.iter().any(|word| report.termination.starts_with(word));
    prop_assert_eq!(report.rms.is_some(), has_result, "{}", report.termination);
    if report.rms.is_none() {
        prop_assert_eq!(report.parameters.m.best, None);
        prop_assert_eq!(report.parameters.v_i.best, None);
        prop_assert_eq!(report.transition_time, None);
    }
    Ok(())
}

#[test]
fn what_cannot_be_inverted_says_why_and_gives_no_number() {
    let many = |value: f64| daily(&[value; 20]);
    let twice: Vec<(i64, f64)> = [0, 0, 1, 1, 2, 2].iter().map(|t| (*t, *t as f64)).collect();
    let cases = [
        ("none", vec![], "too few readings: 0, at least 5 needed"),
        (
            "one",
            daily(&[1.0]),
            "too few readings: 1, at least 5 needed",
        ),
        (
            "four",
            daily(&[1.0, 2.0, 4.0, 8.0]),
            "too few readings: 4, at least 5 needed",
        ),
        (
            "at three times",
            twice,
            "too few readings: 3, at least 5 needed",
        ),
        (
            "at one time",
            vec![(7, 1.0); 30],
            "too few readings: 1, at least 5 needed",
        ),
        (
            "no numbers",
            many(f64::NAN),
            "too few readings: 0, at least 5 needed",
        ),
        (
            "all infinite",
            many(f64::INFINITY),
            "too few readings: 0, at least 5 needed",
        ),
        ("all zero", many(0.0), "all readings are equal"),
        ("all one number", many(7.5), "all readings are equal"),
    ];
    for (name, pairs, termination) in cases {
        let report = report(Unit::MM_PER_DAY, &pairs, Exponent::Free);
        assert_eq!(report.termination, termination, "{name}");
        assert_eq!(report.regime.label, Regime::Undetermined, "{name}");
        check(&report).unwrap();
    }
}

#[test]
fn a_slope_that_only_moves_backwards_has_no_law() {
    let values: Vec<f64> = (1..30).map(|day| -f64::from(day).sqrt()).collect();
    let report = report(Unit::MM_PER_DAY, &daily(&values), Exponent::Free);
    assert_eq!(report.termination, "no forward motion");
    check(&report).unwrap();
}

#[test]
fn a_slope_that_only_slows_down_is_fitted_by_a_law_that_does() {
    for unit in [Unit::MM_PER_DAY, Unit::MM] {
        let values: Vec<f64> = (0..40)
            .map(|day| match unit.quantity() {
                Quantity::Velocity => 20.0 / (3.0 + f64::from(day)),
                Quantity::Displacement => 20.0 * (1.0 + f64::from(day) / 3.0).ln(),
            })
            .collect();
        let report = report(unit, &daily(&values), Exponent::Free);
        assert_eq!(report.transition_time, None);
        assert_eq!(
            report.regime.probability_accelerating.map(|p| p > 0.05),
            Some(false)
        );
        assert!(
            report.parameters.r_per_day.best.unwrap() < 0.0,
            "{report:?}"
        );
    }
}

#[test]
fn an_m_that_runs_to_its_bound_is_said_to() {
    // An exponential is the law of infinite m.
    let values: Vec<f64> = (0..40).map(|day| (0.1 * f64::from(day)).exp()).collect();
    let bound = report(Unit::MM_PER_DAY, &daily(&values), Exponent::Free);
    assert!(
        bound.termination.starts_with("m at its bound: "),
        "{bound:?}"
    );
    let m = bound.parameters.m.best.unwrap();
    assert!((m - 29.0).abs() < 1e-6 || (m + 20.0).abs() < 1e-6, "{m}");
}

#[test]
fn an_m_that_is_no_law_cannot_be_fixed() {
    let pairs = daily(&[1.0, 2.0, 3.0, 5.0, 8.0, 13.0]);
    for m in [0.0, 40.0, -30.0, f64::NAN, f64::INFINITY] {
        let report = report(Unit::MM_PER_DAY, &pairs, Exponent::Fixed(m));
        assert!(report.termination.contains("cannot be fixed"), "{report:?}");
        check(&report).unwrap();
    }
}

#[test]
fn five_readings_are_enough_for_an_answer_and_four_are_not() {
    let of = |count: usize| {
        let pairs = (0..count).map(|day| (day as f64, 10.0 / (12.0 - day as f64)));
        ConstantLoad::fit(
            &PointReadings::new(Quantity::Velocity, pairs),
            Exponent::Free,
        )
    };
    assert_eq!(
        of(4).outcome,
        FitOutcome::TooFew {
            given: 4,
            needed: 5
        }
    );
    assert!(of(5).best().unwrap().rms < 1e-3);
}

fn value() -> impl Strategy<Value = f64> {
    prop_oneof![
        6 => -1e3..1e3_f64,
        2 => Just(0.0),
        1 => Just(-0.0),
        1 => Just(1e300),
        1 => Just(-1e300),
        1 => Just(f64::MAX),
        1 => Just(f64::MIN_POSITIVE),
        1 => Just(5e-324),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
        1 => Just(f64::NEG_INFINITY),
    ]
}

/// Times that repeat, go back, crowd and jump.
fn pairs() -> impl Strategy<Value = Vec<(i64, f64)>> {
    let time = prop_oneof![
        4 => 0..40 * 86_400_i64,
        2 => 0..3_i64,
        1 => Just(0_i64),
        1 => 0..4_000_000_000_i64,
    ];
    prop::collection::vec((time, value()), 0..40)
}

/// A smooth record of any size, with a few spikes, the kind of thing a bad logger sends.
fn spoilt() -> impl Strategy<Value = Vec<(i64, f64)>> {
    let spikes = prop::collection::vec((0..40_usize, value()), 0..4);
    (5..40_usize, -280..280_i32, -3.0..3.0_f64, spikes).prop_map(|(count, size, bend, spikes)| {
        let scale = 10_f64.powi(size);
        let smooth = (0..count).map(|day| scale * (bend * day as f64 / 20.0).exp());
        let mut values: Vec<f64> = smooth.collect();
        for (at, value) in spikes {
            if let Some(slot) = values.get_mut(at) {
                *slot = value;
            }
        }
        daily(&values)
    })
}

fn readings() -> impl Strategy<Value = Vec<(i64, f64)>> {
    prop_oneof![pairs(), spoilt()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_readings_make_an_inversion_panic_or_lie(
        pairs in readings(),
        displacement in any::<bool>(),
        m in prop_oneof![Just(None), Just(Some(1.0)), Just(Some(1.5)), Just(Some(-0.5)), Just(Some(0.3))],
    ) {
        let unit = if displacement { Unit::MM } else { Unit::MM_PER_DAY };
        check(&report(unit, &pairs, m.map_or(Exponent::Free, Exponent::Fixed)))?;
    }

    #[test]
    fn no_search_from_any_place_gives_a_number_that_is_none(
        pairs in readings(),
        displacement in any::<bool>(),
        number in any::<u32>(),
    ) {
        let quantity = if displacement { Quantity::Displacement } else { Quantity::Velocity };
        let days = pairs.iter().map(|(seconds, value)| (*seconds as f64 / 86_400.0, *value));
        let readings = PointReadings::new(quantity, days);
        let fit = ConstantLoad::fit_on(&readings, Exponent::Free, Lattice::Shifted(number));
        for one in &fit.minima {
            let law = &one.law;
            prop_assert!(one.rms >= 0.0 && law.v_i >= 0.0, "{one:?}");
            prop_assert!(law.r.is_finite() && law.p.is_finite(), "{one:?}");
        }
    }

    #[test]
    fn no_readings_make_the_monitor_panic(
        pairs in readings(),
        displacement in any::<bool>(),
    ) {
        let unit = if displacement { Unit::MM } else { Unit::MM_PER_DAY };
        let series = series(unit, &pairs);
        let mut monitor = Monitor::new(Settings::default());
        let mut now = start();
        for reading in &series.readings {
            now = now.max(reading.time);
            let input = Input::Reading {
                benchmark: series.benchmark.clone(),
                unit,
                averaging: None,
                reading: *reading,
            };
            for event in monitor.step(now, &input) {
                prop_assert!(serde_json::to_string(&event).is_ok(), "{event:?}");
            }
        }
    }
}
