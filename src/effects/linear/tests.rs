//! What the linearised law says of a small change is what solving again shows.

use super::*;
use crate::effects::act::harmonics;
use crate::effects::fixture::{daily, generator, normals, series};
use crate::effects::kind::Kind;

const COUNT: usize = 240;
/// Parameters of the law about which it is linearised: speeding up, slowing down, near an unstable steady state.
const LAWS: [[f64; 5]; 3] = [
    [0.0, 0.5, 0.3, 0.2, 0.0],
    [0.7, -1.5, 1.0, -0.5, 0.0],
    [0.0, 0.1, 0.5, 0.4, 0.0],
];

fn problem(quantity: Quantity) -> Problem {
    let days = daily(COUNT);
    let noise = normals(&mut generator(1), COUNT);
    let values: Vec<f64> = match quantity {
        Quantity::Displacement => days.iter().zip(noise).map(|(t, e)| t + 0.1 * e).collect(),
        Quantity::Velocity => noise.iter().map(|e| 1.0 + 0.01 * e).collect(),
    };
    Problem::new(&series(quantity, &days, &values), &[]).unwrap()
}

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

fn wave(problem: &Problem, period: f64) -> Term {
    let columns = harmonics(&problem.nodes, &[period]);
    term(Kind::SEASONAL, Act::Load(columns))
}

/// The base of a test: one load already in the law.
fn base(problem: &Problem, law: &[f64]) -> (Vec<Term>, Vec<f64>) {
    let mut parameters = law[..law_parameters(problem)].to_vec();
    parameters.extend([0.2, 0.1]);
    (vec![wave(problem, 90.0)], parameters)
}

fn predicted(problem: &Problem, terms: &[Term], parameters: &[f64]) -> Vec<f64> {
    let mut scratch = Scratch::default();
    assert!(scratch.predict(problem, terms, parameters));
    scratch.prediction
}

/// The change of the readings by parameter `k`, by differences from `from` to `until` about where it is.
fn difference(
    problem: &Problem,
    (terms, parameters): (&[Term], &[f64]),
    k: usize,
    (from, until): (f64, f64),
) -> Vec<f64> {
    let at = |by: f64| {
        let mut moved = parameters.to_vec();
        moved[k] += by;
        predicted(problem, terms, &moved)
    };
    let (low, high) = (at(from), at(until));
    let both = high.iter().zip(&low);
    both.map(|(high, low)| (high - low) / (until - from))
        .collect()
}

/// Length of the difference over the length of what it should be.
fn off(got: &[f64], want: &[f64]) -> f64 {
    let square = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>();
    let gap = square(&mut got.iter().zip(want).map(|(a, b)| a - b));
    (gap / square(&mut want.iter().copied())).sqrt()
}

fn linear(problem: &Problem, (terms, parameters): (&[Term], &[f64])) -> Linear {
    let mut scratch = Scratch::default();
    assert!(scratch.predict(problem, terms, parameters));
    Linear::of(problem, (terms, parameters), &scratch.driven)
}

/// The largest misfit of the columns of `term` about each law, against differences.
fn worst(problem: &Problem, term: &Term, steps: (f64, f64)) -> f64 {
    let mut worst = 0.0_f64;
    for law in LAWS {
        let (terms, parameters) = base(problem, &law);
        let columns = linear(problem, (&terms, &parameters)).columns(problem, term);
        assert_eq!(columns.len(), term.coefficients());
        let (mut joined, mut longer) = (terms.clone(), parameters.clone());
        joined.push(term.clone());
        longer.extend(vec![0.0; term.coefficients()]);
        for (k, column) in columns.iter().enumerate() {
            let want = difference(problem, (&joined, &longer), parameters.len() + k, steps);
            worst = worst.max(off(column, &want));
        }
    }
    worst
}

const BOTH: (f64, f64) = (-1e-3, 1e-3);
/// Of what cannot be negative.
const ABOVE: (f64, f64) = (0.0, 1e-3);

fn quantities() -> [Problem; 2] {
    [Quantity::Displacement, Quantity::Velocity].map(problem)
}

#[test]
fn a_small_change_of_each_of_the_laws_own_parameters_does_what_solving_again_shows() {
    for problem in quantities() {
        for law in LAWS {
            let (terms, parameters) = base(&problem, &law);
            let columns = linear(&problem, (&terms, &parameters)).of_law(&problem);
            assert_eq!(columns.len(), law_parameters(&problem));
            for (k, column) in columns.iter().enumerate() {
                let want = difference(&problem, (&terms, &parameters), k, BOTH);
                let off = off(column, &want);
                assert!(off < 0.02, "{:?} {k}: {off}", problem.quantity);
            }
        }
    }
}

#[test]
fn a_small_load_does_what_solving_again_shows() {
    for problem in quantities() {
        let wave = wave(&problem, 40.0);
        let off = worst(&problem, &wave, BOTH);
        assert!(off < 0.02, "{:?} {off}", problem.quantity);
    }
}

#[test]
fn a_small_step_reset_and_change_of_friction_do_what_solving_again_shows() {
    for problem in quantities() {
        for (kind, act) in [
            (Kind::LOAD_STEP, Act::Step),
            (Kind::STATE_RESET, Act::Reset),
            (Kind::FRICTION_CHANGE, Act::Friction(3)),
        ] {
            let happened = Term {
                at: Some(COUNT / 3),
                ..term(kind, act)
            };
            let off = worst(&problem, &happened, BOTH);
            assert!(off < 0.03, "{:?} {kind} {off}", problem.quantity);
        }
    }
}

#[test]
fn a_small_rate_limit_and_a_small_flattening_do_what_solving_again_shows() {
    for problem in quantities() {
        for (kind, act) in [
            (Kind::RATE_LIMIT, Act::PerVelocity),
            (Kind::GEOMETRY, Act::PerSlip),
        ] {
            let off = worst(&problem, &term(kind, act), ABOVE);
            assert!(off < 0.03, "{:?} {kind} {off}", problem.quantity);
        }
    }
}

#[test]
fn a_column_of_the_reading_is_itself() {
    let problem = problem(Quantity::Displacement);
    let column: Vec<f64> = (0..COUNT).map(|i| f64::from(u8::from(i > 100))).collect();
    let off = worst(
        &problem,
        &term(Kind::OFFSET, Act::Reading(vec![column])),
        BOTH,
    );
    assert!(off < 1e-6, "{off}");
}

/// The column is that of the first spacing: a mean over `d` days delays by d / 2.
#[test]
fn a_mean_over_one_more_spacing_does_what_reading_again_shows() {
    let problem = problem(Quantity::Velocity);
    for law in LAWS {
        let (terms, parameters) = base(&problem, &law);
        let mean = term(Kind::INTERVAL_MEAN, Act::Averaging);
        let columns = linear(&problem, (&terms, &parameters)).columns(&problem, &mean);
        let (mut joined, mut longer) = (terms.clone(), parameters.clone());
        joined.push(mean);
        longer.push(0.0);
        let want = difference(&problem, (&joined, &longer), parameters.len(), (0.0, 1.0));
        let off = off(&columns[0][1..], &want[1..]);
        assert!(off < 0.03, "{off}");
    }
}

#[test]
fn where_velocities_are_means_a_change_of_the_law_does_what_reading_again_shows() {
    let problem = problem(Quantity::Velocity);
    for law in LAWS {
        let (mut terms, mut parameters) = base(&problem, &law);
        terms.push(term(Kind::INTERVAL_MEAN, Act::Averaging));
        parameters.push(12.0);
        let columns = linear(&problem, (&terms, &parameters)).of_law(&problem);
        for (k, column) in columns.iter().enumerate() {
            let want = difference(&problem, (&terms, &parameters), k, BOTH);
            let off = off(column, &want);
            assert!(off < 0.02, "{k}: {off}");
        }
    }
}
