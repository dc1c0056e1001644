//! The law against 20-digit reference solutions (tests/reference, with the script that makes them).

#![expect(clippy::unwrap_used, reason = "a test fails by panicking")]

use slipwatch::model::{Accuracy, Law, Trajectory};

struct Row {
    m: f64,
    x_i: f64,
    t: f64,
    remaining: Option<f64>,
    x: f64,
    velocity: f64,
    displacement: f64,
    t_c: Option<f64>,
    condition_velocity: f64,
    condition_displacement: f64,
}

fn rows() -> Vec<Row> {
    let text = include_str!("reference/slider_block.csv");
    let number = |field: &str| field.parse::<f64>().ok();
    text.lines()
        .skip(1)
        .map(|line| {
            let f: Vec<&str> = line.split(',').collect();
            Row {
                m: number(f[0]).unwrap(),
                x_i: number(f[1]).unwrap(),
                t: number(f[2]).unwrap(),
                remaining: number(f[3]),
                x: number(f[4]).unwrap(),
                velocity: number(f[5]).unwrap(),
                displacement: number(f[6]).unwrap(),
                t_c: number(f[7]),
                condition_velocity: number(f[8]).unwrap(),
                condition_displacement: number(f[9]).unwrap(),
            }
        })
        .collect()
}

/// 1e-9 where the condition number is under 1e6, 8 * 2^-53 times it elsewhere.
fn tolerance(condition: f64) -> f64 {
    if condition < 1e6 {
        1e-9
    } else {
        8.0 * 0.5_f64.powi(53) * condition
    }
}

fn relative(got: f64, want: f64) -> f64 {
    (got / want - 1.0).abs()
}

fn solve(row: &Row) -> (Law, Trajectory) {
    let law = Law::from_paper(row.m, row.x_i, 1.0, 1.0).unwrap();
    let end = row.t_c.map_or(row.t, |t_c| 1.1 * t_c).max(row.t);
    (law, Trajectory::solve(&law, end, Accuracy::Full))
}

#[test]
fn every_reference_row_is_met_as_a_function_of_time() {
    let rows = rows();
    assert!(rows.len() > 150, "{} rows", rows.len());
    for row in &rows {
        let at = format!("m={} x_i={} t={}", row.m, row.x_i, row.t);
        if tolerance(row.condition_velocity) > 0.5 {
            continue; // t itself cannot tell this row from the singularity
        }
        let (law, trajectory) = solve(row);
        let motion = trajectory
            .at(row.t)
            .unwrap_or_else(|| panic!("{at}: no motion"));
        let velocity = relative(motion.velocity, row.velocity);
        assert!(
            velocity <= tolerance(row.condition_velocity),
            "{at}: velocity {velocity:e}"
        );
        let slip = relative(motion.displacement, row.displacement);
        assert!(
            slip <= tolerance(row.condition_displacement),
            "{at}: displacement {slip:e}"
        );
        let state = relative(law.state(motion.y).unwrap(), row.x);
        assert!(
            state <= tolerance(row.condition_velocity),
            "{at}: x {state:e}"
        );
    }
}

#[test]
fn every_reference_row_is_met_as_a_function_of_the_time_that_remains() {
    let mut seen = 0;
    for row in rows() {
        let (Some(remaining), Some(t_c)) = (row.remaining, row.t_c) else {
            continue;
        };
        let at = format!("m={} x_i={} t_c-t={remaining}", row.m, row.x_i);
        let (_, trajectory) = solve(&row);
        let failure = trajectory
            .failure_days()
            .unwrap_or_else(|| panic!("{at}: no failure"));
        assert!(
            relative(failure, t_c) < 1e-9,
            "{at}: t_c {failure} not {t_c}"
        );
        let motion = trajectory.before_failure(remaining).unwrap();
        let velocity = relative(motion.velocity, row.velocity);
        assert!(velocity < 1e-9, "{at}: velocity {velocity:e}");
        if row.condition_displacement < 1e6 || remaining < 1e-3 {
            let slip = relative(motion.displacement, row.displacement);
            assert!(slip < 1e-9, "{at}: displacement {slip:e}");
        }
        seen += 1;
    }
    assert!(seen > 50, "{seen} rows with a failure");
}

#[test]
fn at_m_of_one_inverse_velocity_is_a_straight_line() {
    let law = Law::at_unit_m(1.5, 2.0, 3.0).unwrap();
    let trajectory = Trajectory::solve(&law, 10.0, Accuracy::Full);
    assert!((trajectory.failure_days().unwrap() - 4.0).abs() < 1e-12);
    let motion = trajectory.at(1.0).unwrap();
    assert!((motion.velocity - 3.0 / 0.75).abs() < 1e-12);
    assert!((motion.displacement - -12.0 * 0.75_f64.ln()).abs() < 1e-11);
    let slowing = Law::at_unit_m(0.5, 2.0, 3.0).unwrap();
    let trajectory = Trajectory::solve(&slowing, 100.0, Accuracy::Full);
    assert_eq!(trajectory.failure_days(), None);
    let motion = trajectory.at(80.0).unwrap();
    assert!((motion.velocity - 3.0 / 21.0).abs() < 1e-12);
}

#[test]
fn displacement_and_velocity_keep_the_closed_relation() {
    for (m, x_i) in [
        (1.35, 0.6),
        (0.98, 39.0),
        (3.0, 1.5),
        (-1.0, 3.0),
        (0.5, 0.1),
    ] {
        let law = Law::from_paper(m, x_i, 2.0, 5.0).unwrap();
        let end = 1.5;
        let trajectory = Trajectory::solve(&law, end, Accuracy::Full);
        for step in 1..40 {
            let t = end * f64::from(step) / 40.0;
            let Some(motion) = trajectory.at(t) else {
                break;
            };
            let ratio = law.slope(motion.y) / -law.r;
            let slip = law.v_i / (law.r * law.p + law.kappa) * (ratio.ln() - law.p * motion.y.ln());
            assert!(relative(motion.displacement, slip) < 1e-9, "m={m} t={t}");
        }
    }
}
