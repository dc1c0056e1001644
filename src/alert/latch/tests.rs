//! A level rises with the evidence, and falls where motion that was measured and what is called both allow it.

use super::super::Threshold;
use super::*;
use jiff::ToSpan;

fn evidence(hours: i64, chance: f64, velocity: f64) -> AlertEvidence {
    let start: Timestamp = "2020-01-01T00:00:00Z".parse().unwrap();
    AlertEvidence {
        now: start + hours.hours(),
        chance_for_red: Some(chance),
        chance_within_outlook: Some(chance),
        velocity_mm_per_day: Some(velocity),
        settled_velocity_mm_per_day: Some(velocity),
        ..AlertEvidence::default()
    }
}

fn red_at_hundred() -> (Policy, Latch) {
    let (policy, mut latch) = (Policy::default(), Latch::default());
    assert_eq!(
        latch.update(&policy, &evidence(0, 0.3, 100.0))[0].level,
        Level::Red
    );
    (policy, latch)
}

#[test]
fn what_was_measured_before_a_level_was_called_does_not_end_it_and_other_units_do_not_hold_it() {
    let (policy, latch) = red_at_hundred();
    assert!(!latch.has_ended(Level::Red));
    // As where the readings were metres taken for millimetres, and all come again.
    let mut latch = latch.measured_otherwise();
    for hours in -200..0 {
        let events = latch.update(&policy, &evidence(hours, 0.0, 0.1));
        assert_eq!((latch.level(), events.len()), (Level::Red, 0), "{hours} h");
    }
    let ended = (0..200).find(|hours| {
        let events = latch.update(&policy, &evidence(*hours, 0.0, 0.1));
        !events.is_empty()
    });
    // No sooner than motion without a gain ends a level, and no later.
    let steady = policy.steady_for.as_hours();
    assert_eq!((ended, latch.level()), (Some(steady), Level::Green));
    assert!(latch.has_ended(Level::Red) && latch.has_ended(Level::Orange));
}

#[test]
fn a_level_that_is_called_again_at_the_time_of_an_ended_one_is_another_alert_whatever_stood_between()
 {
    let (_, mut latch) = red_at_hundred();
    let red = latch.in_force().unwrap().1;
    latch.resolve(evidence(0, 0.0, 0.0).now);
    let call = |level| Call {
        level,
        rule: "displacement".into(),
    };
    let mut seen = vec![red];
    for level in [Level::Orange, Level::Red, Level::Red] {
        let entered = latch.enter(&evidence(0, 0.0, 50.0), &call(level));
        if level == Level::Red {
            assert!(!seen.contains(&entered.since), "{seen:?} {entered:?}");
            seen.push(entered.since);
            let kept: Latch =
                serde_json::from_value(serde_json::to_value(&latch).unwrap()).unwrap();
            latch = kept;
            latch.resolve(evidence(0, 0.0, 0.0).now);
            latch.enter(&evidence(0, 0.0, 50.0), &call(Level::Orange));
        }
    }
    // A later one begins when it does.
    let later = latch.enter(&evidence(1, 0.0, 50.0), &call(Level::Red));
    assert_eq!(later.since, evidence(1, 0.0, 0.0).now);
}

#[test]
fn a_forecast_that_changes_its_mind_does_not_lower_a_level() {
    let (policy, mut latch) = red_at_hundred();
    for hour in 1..24 * 6 {
        let velocity = 100.0 + f64::from(i32::try_from(hour).unwrap());
        latch.update(&policy, &evidence(hour, 0.0, velocity));
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
}

#[test]
fn observed_deceleration_lowers_it_after_an_evacuation_time() {
    let (policy, mut latch) = red_at_hundred();
    for hour in 1..=24 {
        assert!(
            latch.update(&policy, &evidence(hour, 0.0, 30.0)).is_empty(),
            "hour {hour}"
        );
    }
    let fall = latch.update(&policy, &evidence(25, 0.0, 30.0));
    assert_eq!((fall[0].level, &*fall[0].rule), (Level::Red, "decelerated"));
    assert_eq!(latch.level(), Level::Green);
}

#[test]
fn a_pause_does_not_end_red_while_the_chance_within_the_outlook_calls_orange() {
    let (policy, mut latch) = red_at_hundred();
    let pausing = |hour: i64, outlook: f64| AlertEvidence {
        chance_within_outlook: Some(outlook),
        ..evidence(hour, 0.1, 20.0)
    };
    for hour in 1..=5 * 24 {
        latch.update(&policy, &pausing(hour, 0.8));
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
    for hour in 5 * 24 + 1..=6 * 24 + 2 {
        latch.update(&policy, &pausing(hour, 0.4));
    }
    assert_eq!(latch.level(), Level::Yellow);
}

#[test]
fn a_chance_that_is_reported_and_hardly_counts_is_yellow_and_never_green() {
    let (policy, mut latch) = (Policy::default(), Latch::default());
    let reported = |hours: i64, chance: f64| AlertEvidence {
        reported_within_outlook: Some(chance),
        ..evidence(hours, 0.01, 0.1)
    };
    assert!(latch.update(&policy, &reported(0, 0.69)).is_empty());
    let called = latch.update(&policy, &reported(1, 0.7));
    assert_eq!(
        (called[0].level, &*called[0].rule),
        (Level::Yellow, "reported-chance")
    );
    // What counts goes before it.
    let both = AlertEvidence {
        chance_within_outlook: Some(0.4),
        ..reported(2, 0.9)
    };
    assert_eq!(policy.call(&both).rule, "chance-within-outlook");
}

#[test]
fn one_slow_reading_or_a_backward_one_lowers_nothing() {
    let (policy, mut latch) = red_at_hundred();
    for hour in 1..24 * 6 {
        let velocity = if hour % 30 == 0 {
            -60.0
        } else {
            100.0 + 2.0 * f64::from(i32::try_from(hour).unwrap())
        };
        latch.update(&policy, &evidence(hour, 0.0, velocity));
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
}

#[test]
fn a_steady_velocity_lowers_it_after_the_stated_time() {
    let (policy, mut latch) = red_at_hundred();
    for hour in 1..=7 * 24 {
        assert!(
            latch.update(&policy, &evidence(hour, 0.0, 95.0)).is_empty(),
            "hour {hour}"
        );
    }
    let fall = latch.update(&policy, &evidence(7 * 24 + 1, 0.0, 95.0));
    assert_eq!(fall[0].rule, "steady");
}

#[test]
fn a_slope_that_is_twice_as_fast_as_at_the_call_is_over_it_only_where_nothing_is_called_or_in_red_no_more_than_yellow()
 {
    let (policy, latch) = red_at_hundred();
    let after = |first: Level, chance: f64| {
        let mut latch = latch.clone();
        latch.level = first;
        for hour in 1..20 * 24 {
            let creeps = 200.0 + 0.1 * f64::from(u8::try_from(hour / 24).unwrap());
            let outlook = AlertEvidence {
                chance_within_outlook: Some(chance),
                ..evidence(hour, 0.0, creeps)
            };
            latch.update(&policy, &outlook);
        }
        latch.level()
    };
    assert_eq!(after(Level::Red, 0.75), Level::Red);
    assert_eq!(after(Level::Red, 0.5), Level::Yellow);
    assert_eq!(after(Level::Orange, 0.5), Level::Orange);
    assert_eq!(after(Level::Orange, 0.0), Level::Green);
    assert_eq!(after(Level::Red, 0.0), Level::Green);
}

#[test]
fn a_surge_that_slows_down_is_over_once_it_has_been_at_half_of_its_peak_for_the_stated_time() {
    let (policy, latch) = red_at_hundred();
    let days = |first: Level, chance: f64, slow: f64| {
        let mut latch = latch.clone();
        latch.level = first;
        let level = |hour: i64| {
            let velocity = if hour < 5 * 24 { 400.0 } else { slow };
            let outlook = AlertEvidence {
                chance_within_outlook: Some(chance),
                ..evidence(hour, 0.0, velocity)
            };
            latch.update(&policy, &outlook);
            latch.level()
        };
        let levels = (1..20 * 24).map(level);
        levels.filter(|level| *level == first).count() / 24
    };
    assert_eq!(days(Level::Orange, 0.5, 150.0), 11);
    // It is no slower than half, or the outlook calls orange.
    assert_eq!(days(Level::Orange, 0.5, 250.0), 19);
    assert_eq!(days(Level::Orange, 0.75, 150.0), 19);
    // Red is over sooner: it has not gained for the stated time, and no more than yellow is called.
    assert_eq!(days(Level::Red, 0.5, 250.0), 7);
    assert_eq!(days(Level::Red, 0.75, 150.0), 19);
}

#[test]
fn a_gap_in_the_readings_is_no_steady_motion() {
    let (policy, mut latch) = red_at_hundred();
    for hour in (1..=24).chain(12 * 24..15 * 24) {
        latch.update(&policy, &evidence(hour, 0.0, 95.0));
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
    for hour in 15 * 24..24 * 24 {
        latch.update(&policy, &evidence(hour, 0.0, 95.0));
    }
    assert_eq!(latch.level(), Level::Green);
}

#[test]
fn a_plain_threshold_is_a_floor_beside_the_model() {
    let mut policy = Policy::default();
    policy.thresholds.push(Threshold {
        level: Level::Orange,
        velocity_mm_per_day: Some(50.0),
        displacement_mm: None,
        acceleration_mm_per_day2: None,
    });
    let mut latch = Latch::default();
    let rise = latch.update(&policy, &evidence(0, 0.0, 60.0));
    assert_eq!(
        (rise[0].level, &*rise[0].rule),
        (Level::Orange, "velocity-threshold")
    );
    assert_eq!(
        latch.update(&policy, &evidence(1, 0.3, 60.0))[0].level,
        Level::Red
    );
}

#[test]
fn what_goes_on_after_a_part_has_failed_faster_than_at_the_call_has_not_slowed_down() {
    let (policy, mut latch) = (Policy::default(), Latch::default());
    latch.update(&policy, &evidence(0, 0.3, 10.0));
    latch.update(&policy, &evidence(1, 0.3, 120.0));
    for hour in 2..=7 * 24 {
        latch.update(&policy, &evidence(hour, 0.0, 25.0));
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
    let mut slower = latch.clone();
    for hour in 0..=25 {
        slower.update(&policy, &evidence(7 * 24 + hour, 0.0, 8.0));
    }
    assert_eq!(slower.level(), Level::Green);
}

#[test]
fn readings_that_are_spoilt_raise_no_peak_from_which_motion_seems_to_slow_down() {
    let (policy, mut latch) = red_at_hundred();
    for hour in 1..7 * 24 {
        let wild = [9000.0, -4000.0, 300.0, -2000.0][usize::try_from(hour % 4).unwrap()];
        let spoilt = AlertEvidence {
            settled_error_mm_per_day: if hour < 12 { 3000.0 } else { 300.0 },
            ..evidence(hour, 0.0, if hour < 40 { wild } else { wild / 4.0 })
        };
        latch.update(&policy, &spoilt);
        assert_eq!(latch.level(), Level::Red, "hour {hour}");
    }
}

#[test]
fn noise_neither_breaks_a_deceleration_nor_is_it_motion_that_has_to_slow_down() {
    let (policy, mut latch) = red_at_hundred();
    let noisy = |hour: i64, chance, velocity: f64| AlertEvidence {
        settled_error_mm_per_day: 1.0,
        ..evidence(
            hour,
            chance,
            velocity + 1.5 * f64::from(u8::from(hour % 3 == 0)),
        )
    };
    let mut fallen = None;
    for hour in 1..60 {
        let left = latch.update(&policy, &noisy(hour, 0.0, 2.0));
        if fallen.is_none() && !left.is_empty() {
            fallen = Some(hour);
        }
    }
    assert_eq!(fallen, Some(25));
    let mut latch = Latch::default();
    latch.update(&policy, &noisy(0, 0.3, 0.5));
    assert_eq!(latch.level(), Level::Red);
    for hour in 1..30 {
        latch.update(&policy, &noisy(hour, 0.0, 0.5));
    }
    assert_eq!(latch.level(), Level::Green);
}
