//! Chances of a collapse on slopes that fail and on slopes that do not.

use super::*;
use crate::fit::Observation;
use crate::reading::Quantity;

fn readings(count: u32, interval: f64, at: impl Fn(f64) -> f64) -> Observations {
    let values = (0..count).map(|index| {
        let t_days = interval * f64::from(index);
        Observation {
            t_days,
            value: at(t_days),
            sigma: None,
        }
    });
    Observations {
        quantity: Quantity::Displacement,
        averaging_days: 0.0,
        values: values.collect(),
    }
}

fn collapse(observations: &Observations) -> Collapse {
    let indicators = Indicators::of(observations).unwrap();
    indicators.collapse(&Members::of(observations))
}

#[test]
fn what_levels_may_not_reach_they_do_not_reach_however_sure_the_network_is() {
    let mut sure = Network::silent();
    sure.direct[0] = 100.0;
    let jitter = |t: f64| 0.3 * (t * 977.0).sin();
    let (mut ruled_out, mut open) = (0, 0);
    for growth in [0.0, 0.02, 0.05, 0.1, 0.2] {
        let slope = readings(300, 0.125, |t| t + (growth * t).exp() + jitter(t));
        let indicators = Indicators::of(&slope).unwrap();
        let chances = indicators.collapse_by(&sure, &Members::of(&slope)).sure;
        for days in [0.02, 0.3, 1.0, 2.0, 7.0, 30.0, 500.0] {
            for chance in [0.02, 0.05, 0.2, 0.5, 0.7] {
                if indicators.may_reach(days, chance) {
                    open += 1;
                } else {
                    ruled_out += 1;
                    assert!(
                        chances.chance_within(days) < chance,
                        "{growth} {days} {chance}"
                    );
                }
            }
        }
    }
    assert!(ruled_out > 20 && open > 20, "{ruled_out} {open}");
}

#[test]
fn every_input_has_its_place() {
    let indicators = Indicators::of(&readings(400, 0.25, |t| t)).unwrap();
    let all = indicators.listed(&Members::default(), 3, 2.0);
    assert_eq!(all.len(), INPUTS);
}

#[test]
fn a_line_in_inverse_velocity_collapses_about_where_it_meets_zero_and_a_straight_line_does_not() {
    let failing = readings(190, 0.5, |t| -60.0 * (1.0 - t / 100.0).ln());
    let found = collapse(&failing);
    let median = found.passage.quantile(0.5, 400.0).unwrap();
    assert!((2.5..11.0).contains(&median), "{median}");
    let steady = collapse(&readings(190, 0.5, |t| 12.0 * t));
    assert!(steady.sure.chance_within(30.0) < 0.1, "{steady:?}");
    assert!(steady.passage.chance_within(400.0) < 0.2, "{steady:?}");
    assert!(steady.sure.chance_within(1.0) < 0.02, "{steady:?}");
}

#[test]
fn levels_go_by_less_where_a_slope_moves_slower_than_any_that_was_seen_to_collapse() {
    let red = |size: f64| {
        let failing = readings(190, 0.5, |t| -size * (1.0 - t / 96.0).ln());
        let sure = collapse(&failing).sure;
        sure.chance_within(4.0)
    };
    // At the end 40 mm/day, and .06.
    assert!(red(60.0) > 0.3, "{}", red(60.0));
    assert!(red(0.08) < 0.1, "{}", red(0.08));
}

#[test]
fn an_earlier_surge_does_not_hide_the_end_of_a_slope() {
    let noise = |t: f64| 0.5 * (t * 977.0).sin();
    let end = |t: f64| -40.0 * (1.0 - t / 96.0).ln();
    let surge = |t: f64| 150.0 / (1.0 + (-(t - 50.0) / 1.5).exp());
    let without = collapse(&readings(380, 0.25, |t| t + end(t) + noise(t)));
    let with = collapse(&readings(380, 0.25, |t| t + end(t) + surge(t) + noise(t)));
    let chances = [&without, &with].map(|one| one.sure.chance_within(2.0));
    assert!(
        chances[0] > 0.4 && chances[1] > 0.5 * chances[0],
        "{chances:?}"
    );
}

#[test]
fn the_time_is_put_sooner_than_is_expected_and_the_expected_chances_grow_too() {
    // A slope that speeds up and then only creeps on: no line has its time for sure.
    let uneven = readings(190, 0.5, |t| {
        -60.0 * (1.0 - t / 140.0).ln() + 3.0 * (t * 0.3).sin()
    });
    let found = collapse(&uneven);
    let days = [1.0, 2.0, 7.0, 30.0, 100.0];
    let expected = days.map(|days| found.expected.chance_within(days));
    assert!(expected.is_sorted(), "{expected:?}");
    assert!(expected[4] > 0.2, "{expected:?}");
    for (days, expected) in days.into_iter().zip(expected) {
        let sooner = found.passage.chance_within(days);
        assert!(sooner >= expected, "{days} {sooner} {expected}");
    }
    assert!(found.passage.chance_within(30.0) > found.expected.chance_within(30.0) + 0.02);
}

#[test]
fn chances_grow_with_the_span_and_never_pass_one() {
    let failing = readings(190, 0.5, |t| -60.0 * (1.0 - t / 96.0).ln());
    let found = collapse(&failing);
    let chances = [0.5, 2.0, 8.0, 30.0].map(|days| found.passage.chance_within(days));
    assert!(
        chances.windows(2).all(|pair| pair[0] < pair[1]),
        "{chances:?}"
    );
    let all = found.passage.chance_within(f64::INFINITY);
    assert!(all > 0.5 && all <= 1.0, "{all}");
}

/// The first readings of `before` followed by those of `after` from the day on on which it begins.
fn then(before: &Observations, after: &Observations, day: f64) -> Observations {
    let early = before.values.iter().filter(|one| one.t_days < day);
    let late = after.values.iter().filter(|one| one.t_days >= day);
    Observations {
        values: early.chain(late).copied().collect(),
        ..before.clone()
    }
}

#[test]
fn a_slope_read_daily_since_the_crisis_began_is_called_like_one_always_read_daily() {
    for (rise, end) in [(40.0, 700.5), (80.0, 900.5)] {
        let jitter = |t: f64| 0.8 * (t * 977.0).sin();
        let fails = |t: f64| 0.1 * t - rise * (1.0 - t / end).ln() + jitter(t);
        let daily = readings(700 + 200 * u32::from(end > 800.0), 1.0, fails);
        let monthly = readings(24 + 7 * u32::from(end > 800.0), 30.0, fails);
        let newest = Observations {
            values: daily.values[daily.values.len() - 90..].to_vec(),
            ..daily.clone()
        };
        let dense = collapse(&newest).sure.chance_within(3.0);
        for days in [8.0, 14.0, 40.0] {
            let changed = then(&monthly, &daily, end - days);
            let indicators = Indicators::of(&changed).unwrap();
            assert!((indicators.to_next_days() - 1.0).abs() < 1e-9);
            let chance = collapse(&changed).sure.chance_within(3.0);
            assert!(chance > 0.5 * dense, "{rise} {days}: {chance} {dense}");
        }
    }
}

#[test]
fn steady_motion_read_more_seldom_from_now_on_is_not_called() {
    for step in 0..20 {
        // Errors that no two readings have alike.
        let jitter = |t: f64| 1.4 * (t * (977.0 + f64::from(step))).sin();
        let creep = |t: f64| 0.3 * t + jitter(t);
        let (hourly, daily) = (
            readings(24 * 20, 1.0 / 24.0, creep),
            readings(60, 1.0, creep),
        );
        // Three daily readings, and ever more of them.
        for day in 22..50 {
            let mut changed = then(&hourly, &daily, 20.0);
            changed
                .values
                .retain(|one| one.t_days < f64::from(day) + 0.5);
            let chance = collapse(&changed).sure.chance_within(3.0);
            // What calls red, unless the config has it otherwise.
            // What calls red, unless the config has it otherwise.
            assert!(chance < 0.27, "{step}, day {day}: {chance}");
        }
    }
}
