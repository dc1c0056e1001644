//! The readings as the refits see them keep their times, their number's bounds and their weights.

use super::*;
use crate::effects::fixture::{channel, daily, generator, normals, series, steady, with_gaps};
use rand::RngExt;

/// Days of `count` readings at irregular times, some far apart.
fn irregular(count: usize, seed: u64) -> Vec<f64> {
    let mut random = generator(seed);
    let mut day = 0.0;
    let one = |_| {
        let gap: f64 = random.random_range(-3.0_f64..3.0).exp();
        day += gap.max(0.01);
        day
    };
    (0..count).map(one).collect()
}

#[test]
fn every_reading_stands_on_a_node_and_nodes_increase() {
    for seed in 0..20 {
        let days = irregular(300, seed);
        let hourly: Vec<f64> = (0..20_000).map(|hour| f64::from(hour) / 24.0).collect();
        let values = normals(&mut generator(seed), hourly.len());
        let fine = channel("rain_mm", &hourly, &values);
        let readings = series(Quantity::Displacement, &days, &days);
        let problem = Problem::new(&readings, &[fine]).unwrap();
        assert!(problem.nodes.windows(2).all(|pair| pair[0] < pair[1]));
        for (t, &node) in problem.t.iter().zip(&problem.node_of) {
            assert!(problem.nodes[node].total_cmp(t).is_eq());
        }
        assert_eq!(problem.t.len(), days.len());
    }
}

#[test]
fn a_finer_channel_brings_finer_nodes_within_bounds() {
    let days: Vec<f64> = (0..200).map(|k| 10.0 * f64::from(k)).collect();
    let readings = series(Quantity::Displacement, &days, &days);
    let alone = Problem::new(&readings, &[]).unwrap();
    assert_eq!(alone.nodes.len(), 200);
    let each_day = channel("rain_mm", &daily(2000), &normals(&mut generator(1), 2000));
    let beside = Problem::new(&readings, &[each_day]).unwrap();
    assert!(
        (600..=1000).contains(&beside.nodes.len()),
        "{}",
        beside.nodes.len()
    );
}

/// Monthly readings of six years, as those of the Three Gorges.
#[test]
fn few_readings_are_solved_on_the_same_nodes_beside_any_channel() {
    let days: Vec<f64> = (0..73).map(|k| 30.4 * f64::from(k)).collect();
    let readings = series(Quantity::Displacement, &days, &days);
    let alone = Problem::new(&readings, &[]).unwrap();
    assert!(
        (280..=300).contains(&alone.nodes.len()),
        "{}",
        alone.nodes.len()
    );
    let each_day = channel("counter", &daily(2200), &normals(&mut generator(1), 2200));
    let beside = Problem::new(&readings, &[each_day]).unwrap();
    assert_eq!(beside.nodes, alone.nodes);
}

#[test]
fn of_50_000_readings_no_more_than_3_000_blocks_are_kept_and_they_keep_the_motion() {
    let days: Vec<f64> = (0..50_000).map(|hour| f64::from(hour) / 24.0).collect();
    let noise = normals(&mut generator(2), days.len());
    let values: Vec<f64> = days
        .iter()
        .zip(noise)
        .map(|(day, e)| 0.5 * day + e)
        .collect();
    let problem = Problem::new(&series(Quantity::Displacement, &days, &values), &[]).unwrap();
    let count = problem.t.len();
    assert!(
        (MOST_READINGS / 2..=MOST_READINGS).contains(&count),
        "{count}"
    );
    assert!(
        problem.nodes.len() < 3 * MOST_READINGS,
        "{}",
        problem.nodes.len()
    );
    assert!((problem.typical_velocity() - 0.5).abs() < 0.002);
    // Means of 17 readings of 1 mm.
    assert!(
        (problem.scatter * 17.0_f64.sqrt() - 1.0).abs() < 0.1,
        "{}",
        problem.scatter
    );
}

#[test]
fn velocities_over_decades_with_a_relative_error_weigh_by_their_size() {
    let noise = normals(&mut generator(3), 400);
    let size = |day: f64| 0.1 * (day / 58.0).exp();
    let values: Vec<f64> = (0..400)
        .map(|k| size(k as f64) * (1.0 + 0.08 * noise[k]))
        .collect();
    let problem = Problem::new(&series(Quantity::Velocity, &daily(400), &values), &[]).unwrap();
    let usual = problem.weight[200];
    assert!(
        (0.04..0.06).contains(&(problem.weight[0] / usual)),
        "no less than a twentieth"
    );
    for k in 45..390 {
        let ratio = problem.weight[k] / problem.weight[200] * size(200.0) / size(k as f64);
        assert!((0.8..1.25).contains(&ratio), "{k} {ratio}");
    }
}

#[test]
fn velocities_with_an_absolute_error_and_displacements_weigh_alike() {
    let noise = normals(&mut generator(4), 400);
    let values: Vec<f64> = (0..400)
        .map(|k| 1.0 + 0.01 * k as f64 + 0.3 * noise[k])
        .collect();
    for quantity in [Quantity::Velocity, Quantity::Displacement] {
        let problem = Problem::new(&series(quantity, &daily(400), &values), &[]).unwrap();
        assert!(
            problem
                .weight
                .iter()
                .all(|weight| (*weight - 1.0).abs() < 1e-12),
            "{quantity:?}"
        );
    }
}

#[test]
fn the_scatter_of_a_reading_is_found_beside_any_motion_and_gaps() {
    for days in [daily(500), with_gaps(500, 20, 30)] {
        let problem = steady(Quantity::Displacement, &days, 5);
        assert!((problem.scatter - 1.0).abs() < 0.15, "{}", problem.scatter);
    }
}

#[test]
fn the_load_is_seen_at_no_less_than_a_tenth_of_the_usual_velocity() {
    let mut problem = steady(Quantity::Displacement, &daily(10), 6);
    problem.see(&[1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 5.0, 0.0, -3.0, 0.05]);
    assert_eq!(problem.seen[6..], [5.0, 0.1, 0.1, 0.1]);
}

#[test]
fn fewer_than_eight_readings_are_no_problem_to_solve() {
    let few = series(Quantity::Displacement, &daily(7), &daily(7));
    assert!(Problem::new(&few, &[]).is_none());
}
