//! Derivatives of the solution, against 20-digit references and against differences of solutions.

use slipwatch::model::{Accuracy, Gradient, Law, Sensitivities, Trajectory};

/// r, kappa, p, t, y, slip, then y and slip each by r, kappa and p; `None` for the slip of a failure.
fn rows() -> Vec<[Option<f64>; 12]> {
    let text = include_str!("../reference/sensitivities.csv");
    let cells = |line: &str| {
        let mut cells = line.split(',').map(|cell| cell.parse().ok());
        std::array::from_fn(|_| cells.next().unwrap())
    };
    text.lines().skip(1).map(cells).collect()
}

/// Relative, and absolute where the derivative is 0.
fn off(got: f64, want: f64) -> f64 {
    if want == 0.0 {
        got.abs()
    } else {
        (got / want - 1.0).abs()
    }
}

fn parts(gradient: &Gradient) -> [f64; 3] {
    [gradient.r, gradient.kappa, gradient.p]
}

#[test]
fn every_reference_derivative_is_met() {
    let rows = rows();
    assert!(rows.len() > 60, "{} rows", rows.len());
    for row in rows {
        let known = |at: usize| row[at].unwrap();
        let law = Law::from_fit(3.0, known(0), known(1), known(2));
        let at = format!("{law:?} y={}", known(4));
        if known(4) == 0.0 {
            let failure = law.failure_with_gradient().unwrap();
            assert!(off(failure.days, known(3)) < 1e-13, "{at}");
            for (k, got) in parts(&failure.gradient).iter().enumerate() {
                assert!(off(*got, known(6 + k)) < 1e-12, "{at}: failure by {k}");
            }
            continue;
        }
        for (accuracy, tolerance) in [(Accuracy::Full, 1e-11), (Accuracy::Fit, 1e-8)] {
            let solution = Sensitivities::solve(&law, known(3), accuracy);
            let Some(found) = solution.at(known(3)) else {
                assert!(accuracy == Accuracy::Fit && known(4) > 1e5, "{at}");
                continue;
            };
            assert!(off(found.motion.y, known(4)) < 1e-10, "{at}");
            for k in 0..3 {
                let by_y = -parts(&found.ln_velocity)[k] * found.motion.y;
                assert!(off(by_y, known(6 + k)) < tolerance, "{at}: y by {k}");
                let by_slip = parts(&found.displacement)[k] / 3.0;
                assert!(off(by_slip, known(9 + k)) < tolerance, "{at}: slip by {k}");
            }
        }
    }
}

#[test]
fn derivatives_are_those_that_differences_of_solutions_show() {
    let laws = [
        (0.5, 0.25, 0.25),
        (0.5, -0.25, -0.25),
        (-0.4, -1.0, 1.5),
        (-0.5, 0.25, 0.3),
        // m = 1, and beside it; a steady state, and beside it.
        (0.5, 0.0, 0.0),
        (0.5, 1e-9, 1e-9),
        (0.0, 0.25, 0.25),
        (1e-7, -0.5, -1.0),
    ];
    for (r, kappa, p) in laws {
        let law = |d: [f64; 4]| Law::from_fit(2.0 + d[3], r + d[0], kappa + d[1], p + d[2]);
        let solution = Sensitivities::solve(&law([0.0; 4]), 1.4, Accuracy::Full);
        for t in [0.1, 0.7, 1.4] {
            let found = solution.at(t).unwrap();
            for k in 0..4 {
                let nudged = |h: f64| {
                    let mut d = [0.0; 4];
                    d[k] = h;
                    let motion = Trajectory::solve(&law(d), t, Accuracy::Full).at(t).unwrap();
                    [motion.velocity.ln(), motion.displacement]
                };
                let (up, down) = (nudged(1e-5), nudged(-1e-5));
                let gradients = [found.ln_velocity, found.displacement];
                for (which, gradient) in gradients.iter().enumerate() {
                    let [r, kappa, p] = parts(gradient);
                    let exact = [r, kappa, p, gradient.v_i][k];
                    let shown = (up[which] - down[which]) / 2e-5;
                    let bound = 1e-8 + 1e-7 * exact.abs();
                    assert!(
                        (exact - shown).abs() < bound,
                        "{r} {kappa} {p} t={t} parameter {k}, output {which}: {exact} not {shown}"
                    );
                }
            }
        }
    }
}

#[test]
fn a_passage_answers_to_the_parameters_as_differences_show() {
    for (r, kappa, p) in [(0.5, 0.25, 0.25), (0.5, -0.25, -0.25), (0.5, 0.0, 0.0)] {
        let law = |d: [f64; 4]| Law::from_fit(2.0 + d[3], r + d[0], kappa + d[1], p + d[2]);
        let found = law([0.0; 4]).days_to_velocity_with_gradient(7.0).unwrap();
        let [by_r, by_kappa, by_p] = parts(&found.gradient);
        for (k, exact) in [by_r, by_kappa, by_p, found.gradient.v_i]
            .iter()
            .enumerate()
        {
            let nudged = |h: f64| {
                let mut d = [0.0; 4];
                d[k] = h;
                law(d).days_to_velocity(7.0).unwrap()
            };
            let shown = (nudged(1e-5) - nudged(-1e-5)) / 2e-5;
            assert!(
                (exact - shown).abs() < 1e-7 * exact.abs() + 1e-9,
                "{k}: {exact} not {shown}"
            );
        }
    }
    let slowing = Law::from_fit(2.0, -0.5, 0.25, 0.25);
    assert_eq!(slowing.days_to_velocity_with_gradient(7.0), None);
    assert_eq!(slowing.failure_with_gradient(), None);
}
