//! What the physics do not allow is objected to, and what they do allow is not.

use super::*;
use crate::effects::fixture::{channel, daily, epoch, generator, normals, steady};
use crate::effects::kind::Kind;
use crate::effects::noise::Noise;
use crate::effects::response::Response;
use crate::effects::slip_alike::may_be_slip;
use crate::reading::Quantity;

const COUNT: usize = 300;

fn term(kind: Kind, act: Act) -> Term {
    Term {
        kind,
        channel: None,
        response: None,
        at: None,
        share: 0.5,
        act,
    }
}

fn fitted(term: Term, own: &[f64]) -> Fitted {
    Fitted {
        parameters: [&[0.0, 0.0, -1.0, 0.0, 0.0], own].concat(),
        terms: vec![term],
        noise: Noise::WHITE,
        prediction: Vec::new(),
        velocity: Vec::new(),
        deviance: 0.0,
        sigma: 1.0,
    }
}

fn driver(name: &str, values: &[f64]) -> Driver {
    Driver::new(0, &channel(name, &daily(values.len()), values), epoch()).unwrap()
}

/// What is said of a channel's response with this gain and mean delay.
fn of_channel(name: &str, form: Form, mean_days: f64, gain: f64) -> Option<String> {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let drivers = [driver(name, &normals(&mut generator(2), COUNT))];
    let response = Response {
        form,
        stages: 1,
        mean_days,
        before: 0.0,
    };
    let load = Act::Load(vec![vec![0.0; problem.nodes.len()]]);
    let term = Term {
        channel: Some(0),
        response: Some(response),
        ..term(Kind::HYDROLOGICAL, load)
    };
    objection(&problem, &fitted(term, &[gain]), &drivers)
}

#[test]
fn more_water_may_not_slow_a_slope_but_a_reservoir_or_its_rate_may() {
    for name in [
        "rain_mm",
        "river_flow_m3_s",
        "streamflow_m3_s",
        "pore_pressure_kpa",
        "Snowmelt_mm",
    ] {
        let said = of_channel(name, Form::Level, 5.0, -0.5).unwrap();
        assert!(said.contains("sign"), "{name}: {said}");
        assert_eq!(of_channel(name, Form::Level, 5.0, 0.5), None, "{name}");
        // A falling water table may speed a slope up; rain that begins does not slow one.
        let by_rate = of_channel(name, Form::Rate, 5.0, -0.5);
        assert_eq!(by_rate.is_some(), name == "rain_mm", "{name}: {by_rate:?}");
    }
    assert_eq!(
        of_channel("reservoir_level_m", Form::Level, 5.0, -0.5),
        None
    );
}

#[test]
fn a_strain_or_a_terrain_is_no_rain() {
    for name in [
        "strain_ue",
        "fibre_strain",
        "terrain_height_m",
        "drain_temperature_c",
    ] {
        assert_eq!(of_channel(name, Form::Level, 5.0, -0.5), None, "{name}");
    }
}

#[test]
fn a_memory_of_over_half_the_record_and_a_gain_on_its_bound_are_objected_to() {
    let said = of_channel("reservoir_level_m", Form::Level, 51.0, 0.5).unwrap();
    assert!(said.contains("memory of 153 days"), "{said}");
    assert_eq!(
        of_channel("reservoir_level_m", Form::Level, 49.0, 0.5),
        None
    );
    let said = of_channel("reservoir_level_m", Form::Level, 5.0, -4.6).unwrap();
    assert!(said.contains("bound"), "{said}");
}

#[test]
fn a_load_may_not_grow_with_the_motion_and_a_mean_is_over_more_than_its_spacing() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let said =
        |kind: Kind, act: Act, own: f64| objection(&problem, &fitted(term(kind, act), &[own]), &[]);
    for own in [0.0, -0.2] {
        assert!(said(Kind::RATE_LIMIT, Act::PerVelocity, own).is_some());
        assert!(said(Kind::GEOMETRY, Act::PerSlip, own).is_some());
    }
    assert!(said(Kind::INTERVAL_MEAN, Act::Averaging, 0.4).is_some());
    assert_eq!(said(Kind::RATE_LIMIT, Act::PerVelocity, 0.2), None);
    assert_eq!(said(Kind::GEOMETRY, Act::PerSlip, 0.2), None);
    assert_eq!(said(Kind::INTERVAL_MEAN, Act::Averaging, 2.0), None);
}

/// What is said of a jump by `size` at reading 100, `days` after the reading before, with these covariates.
fn of_jump(size: f64, days: f64, back: f64, drivers: &[Driver]) -> Option<String> {
    let mut problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    for i in 100..COUNT {
        problem.t[i] += days - 1.0;
        problem.y[i] += size - if i >= 200 { back } else { 0.0 };
    }
    let offset = Term {
        at: Some(100),
        ..term(Kind::OFFSET, Act::Reading(vec![vec![0.0; COUNT]]))
    };
    may_be_slip(&problem, &fitted(offset, &[size]), drivers)
}

#[test]
fn a_jump_forwards_in_a_long_gap_may_be_slip_unless_it_comes_back() {
    let said = of_jump(60.0, 10.0, 0.0, &[]).unwrap();
    assert!(said.contains("10 days"), "{said}");
    assert_eq!(of_jump(60.0, 10.0, 60.0, &[]), None);
    assert_eq!(of_jump(-60.0, 10.0, 0.0, &[]), None);
    assert_eq!(of_jump(60.0, 1.0, 0.0, &[]), None);
}

#[test]
fn a_jump_forwards_just_after_the_wettest_days_may_be_slip() {
    let wet_on = |day: usize| {
        let mut values = vec![0.0; COUNT];
        for (k, value) in values.iter_mut().enumerate().skip(day).take(3) {
            *value = 10.0 + k as f64;
        }
        [driver("rain_mm", &values)]
    };
    let said = of_jump(60.0, 1.0, 0.0, &wet_on(98)).unwrap();
    assert!(said.contains("rain_mm"), "{said}");
    assert_eq!(of_jump(60.0, 1.0, 0.0, &wet_on(150)), None);
    assert_eq!(of_jump(60.0, 1.0, 60.0, &wet_on(98)), None);
}

#[test]
fn the_later_block_is_the_last_share_or_what_follows_a_late_event() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let event = |at: usize| Term {
        at: Some(at),
        ..term(Kind::LOAD_STEP, Act::Step)
    };
    assert_eq!(block(&problem, &[], 0.25), Some(225));
    assert_eq!(block(&problem, &[event(100)], 0.25), Some(225));
    assert_eq!(block(&problem, &[event(260)], 0.25), Some(280));
    assert_eq!(block(&problem, &[event(295)], 0.25), None);
}

/// A fit that predicts so much at each reading, moving at 1 mm/day.
fn predicting(prediction: Vec<f64>) -> Fitted {
    Fitted {
        velocity: vec![1.0; prediction.len()],
        prediction,
        ..fitted(term(Kind::LOAD_STEP, Act::Step), &[0.0])
    }
}

#[test]
fn what_a_law_has_drifted_by_counts_once_from_reading_to_reading() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let shifted: Vec<f64> = problem.y.iter().map(|y| y + 7.0).collect();
    let held = HeldOut {
        from: 200,
        before: predicting(problem.y.clone()),
        after: predicting(shifted),
    };
    assert!((held.errors(&problem).1 - 7.0).abs() < 1e-9);
    assert!(held.errors_of_changes(&problem).1 < 1e-9);
    assert!(held.errors_of_changes(&problem).0 < 1e-9);
}

#[test]
fn a_load_that_grows_with_the_velocity_is_judged_once_it_has_shown() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let mut limited = fitted(term(Kind::RATE_LIMIT, Act::PerVelocity), &[0.5]);
    limited.velocity = (0..COUNT)
        .map(|i| if i < 240 { 1.0 } else { 10.0 })
        .collect();
    assert_eq!(block_once_shown(&problem, &limited), Some(270));
    limited.velocity = (0..COUNT)
        .map(|i| if i < 298 { 1.0 } else { 10.0 })
        .collect();
    assert_eq!(block_once_shown(&problem, &limited), Some(295));
    let other = fitted(term(Kind::LOAD_STEP, Act::Step), &[0.5]);
    assert_eq!(block_once_shown(&problem, &other), None);
}

#[test]
fn what_moves_half_of_its_way_between_two_readings_may_be_a_jump_of_the_reading() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let path = |jump: f64| -> Vec<f64> {
        let days = daily(COUNT).into_iter();
        days.map(|day| if day < 150.0 { day } else { day + jump })
            .collect()
    };
    assert!(jumps_at_once(&problem, &predicting(path(400.0))));
    assert!(!jumps_at_once(&problem, &predicting(path(100.0))));
}

#[test]
fn no_event_is_judged_where_a_covariate_in_the_law_has_no_values() {
    let problem = steady(Quantity::Displacement, &daily(COUNT), 1);
    let noise = normals(&mut generator(2), COUNT);
    let with_values = |day: &usize| !(101..130).contains(day);
    let days: Vec<f64> = (0..COUNT)
        .filter(with_values)
        .map(|day| day as f64)
        .collect();
    let values: Vec<f64> = (0..COUNT)
        .filter(with_values)
        .map(|day| noise[day])
        .collect();
    let level = channel("reservoir_level_m", &days, &values);
    let drivers = [Driver::new(0, &level, epoch()).unwrap()];
    let response = Response {
        form: Form::Level,
        stages: 1,
        mean_days: 5.0,
        before: 0.0,
    };
    let through = Term {
        channel: Some(0),
        response: Some(response),
        ..term(
            Kind::HYDROLOGICAL,
            Act::Load(vec![vec![0.0; problem.nodes.len()]]),
        )
    };
    for (at, is_known) in [(60, true), (115, false), (132, false), (200, true)] {
        let event = Term {
            at: Some(at),
            ..term(Kind::STATE_RESET, Act::Reset)
        };
        let mut both = fitted(through.clone(), &[0.5, 0.2]);
        both.terms.push(event);
        both.prediction.clone_from(&problem.y);
        both.velocity = vec![1.0; problem.t.len()];
        let said = within_a_gap(&problem, &both, &drivers);
        assert_eq!(said.is_none(), is_known, "{at}: {said:?}");
        if let Some(said) = said {
            assert!(said.starts_with("reservoir_level_m"), "{said}");
        }
    }
}
