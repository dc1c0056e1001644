//! Every archived crisis, lived through reading by reading: what was called when, against what happened.

use crate::crisis::{Crisis, days_before, policy, recording, series};
use crate::measured::measured;
use jiff::SignedDuration;
use slipwatch::alert::Level;
use slipwatch::reading::Timestamp;

const VAIONT: &str = "vaiont-1963-reconstruction.mcap";
const LA_CLAPIERE: &str = "la-clapiere-1982-1995-reconstruction.mcap";

/// Where the line through 1/v meets zero in the paper: day 69.5.
fn vaiont_intercept() -> Timestamp {
    "1963-10-10T12:00:00+01:00".parse().unwrap()
}

/// 22:39 local, from chronicles.
fn vaiont_collapse() -> Timestamp {
    "1963-10-09T22:39:00+01:00".parse().unwrap()
}

fn vaiont(id: &str) -> Crisis {
    Crisis::of(&recording(VAIONT), id, &policy(72))
}

#[test]
fn vaiont_reconstruction_5_and_63_are_never_called_surely_stable() {
    for id in ["5", "63"] {
        for refit in vaiont(id).refits() {
            assert!(refit.stable_accelerating <= 0.9, "{id}: {refit:?}");
        }
    }
}

#[test]
fn vaiont_reconstruction_5_and_63_have_their_median_within_three_days_of_the_collapse_from_ten_days_before()
 {
    for id in ["5", "63"] {
        let mut seen = 0;
        for refit in vaiont(id).refits() {
            if days_before(vaiont_collapse(), refit.time) > 10.0 {
                continue;
            }
            let median = refit
                .median
                .unwrap_or_else(|| panic!("{id}: no failure at {}", refit.time));
            let error = days_before(vaiont_collapse(), median);
            assert!(
                error.abs() <= 3.0,
                "{id} at {}: {median}, {error:.2} d early",
                refit.time
            );
            seen += 1;
        }
        assert!(seen >= 7, "{id}: {seen} refits in the last ten days");
    }
}

#[test]
fn vaiont_reconstruction_5_and_63_are_orange_ten_days_before_and_red_before_the_end() {
    for id in ["5", "63"] {
        let crisis = vaiont(id);
        let orange = crisis.first(Level::Orange).unwrap();
        assert!(
            days_before(vaiont_intercept(), orange) >= 10.0,
            "{id}: orange only at {orange}"
        );
        let red = crisis
            .first(Level::Red)
            .unwrap_or_else(|| panic!("{id}: never red"));
        assert!(days_before(vaiont_intercept(), red) > 0.0, "{id}: {red}");
        assert_eq!(crisis.last_level(), Level::Red, "{id}");
    }
}

#[test]
fn vaiont_reconstruction_67_and_50_have_their_intercept_within_three_days_by_the_last_week() {
    for id in ["67", "50"] {
        let mut seen = 0;
        for refit in vaiont(id).refits() {
            if days_before(vaiont_intercept(), refit.time) > 7.0 {
                continue;
            }
            let intercept = refit
                .intercept
                .unwrap_or_else(|| panic!("{id}: no line at {}", refit.time));
            let error = days_before(vaiont_intercept(), intercept);
            assert!(
                error.abs() <= 3.0,
                "{id} at {}: {intercept}, {error:.2} d early",
                refit.time
            );
            seen += 1;
        }
        assert!(seen >= 4, "{id}: {seen} refits in the last week");
    }
}

#[test]
fn la_clapiere_reconstruction_is_never_red() {
    let crisis = Crisis::of(&recording(LA_CLAPIERE), "10", &policy(24));
    assert!(crisis.refits().len() > 100);
    assert_eq!(crisis.first(Level::Red), None, "{:?}", crisis.levels());
}

#[test]
fn century_40_1938_steps_by_231_mm_in_a_day_and_is_never_red() {
    let crisis = Crisis::of(&recording("century-mine-2013.mcap"), "40-1938", &policy(24));
    assert!(crisis.refits().len() > 50);
    assert_eq!(crisis.first(Level::Red), None, "{:?}", crisis.levels());
}

#[test]
fn no_century_south_west_prism_is_ever_red() {
    let all = series(&recording("century-mine-2014-southwest.mcap"), None);
    assert_eq!(all.len(), 11);
    for prism in &all {
        let crisis = Crisis::play(prism, &policy(24));
        assert_eq!(
            crisis.first(Level::Red),
            None,
            "{}: {:?}",
            prism.benchmark,
            crisis.levels()
        );
    }
}

#[test]
#[cfg_attr(not(measured_data), ignore = "no measured data here")]
fn lanzada_f1_turns_red_between_48_and_6_hours_before_the_collapse_and_stays_red() {
    let path = measured("lanzada_2025_f1.csv");
    let collapse: Timestamp = "2025-11-11T08:15:00+01:00".parse().unwrap();
    let all = series(&path, Some(SignedDuration::from_hours(1)));
    let crisis = Crisis::play(&all[0], &policy(12));
    let red = crisis.first(Level::Red).expect("never red");
    let hours = 24.0 * days_before(collapse, red);
    assert!((6.0..=48.0).contains(&hours), "red {hours:.1} h before");
    assert_eq!(crisis.last_level(), Level::Red);
}

const PREONZO: [&str; 5] = ["E1", "E2", "E3", "E4", "E5"];

fn preonzo(id: &str) -> Crisis {
    Crisis::of(&recording("preonzo-2012.mcap"), id, &policy(24))
}

/// In the early hours of 15 May 2012.
fn preonzo_collapse() -> Timestamp {
    "2012-05-15T01:30:00Z".parse().unwrap()
}

#[test]
fn preonzo_is_red_at_each_extensometer_days_before_its_collapse_and_stays_so_through_the_pause() {
    for id in PREONZO {
        let crisis = preonzo(id);
        let red = crisis.first(Level::Red);
        let red = red.unwrap_or_else(|| panic!("{id}: never red"));
        assert!(days_before(preonzo_collapse(), red) >= 2.0, "{id}: {red}");
        assert_eq!(crisis.last_level(), Level::Red, "{id}");
    }
}

#[test]
fn preonzo_is_never_called_impossible_in_its_last_ten_days() {
    for id in PREONZO {
        let mut seen = 0;
        for refit in preonzo(id).refits() {
            if days_before(preonzo_collapse(), refit.time) > 10.0 {
                continue;
            }
            assert!(refit.chance_within_outlook >= 0.05, "{id}: {refit:?}");
            seen += 1;
        }
        assert!(seen >= 7, "{id}: {seen} refits");
    }
}
