//! On white noise the tests of a residual claim what they find by chance no more often than they say.

use super::*;
use crate::effects::fixture::{daily, generator, normals, steady, with_gaps};

const COUNT: usize = 300;
const SERIES: u64 = 400;

fn problems() -> [Problem; 2] {
    [daily(COUNT), with_gaps(COUNT, 17, 5)].map(|t| steady(Quantity::Displacement, &t, 1))
}

/// The p-values of many series of noise in which each value keeps `memory` of the one a day before.
fn p_values(problem: &Problem, memory: f64, test: fn(&Problem, &[f64]) -> Option<f64>) -> Vec<f64> {
    let of = |seed: u64| {
        let mut state = 0.0;
        let mut values = normals(&mut generator(seed), COUNT);
        for (i, value) in values.iter_mut().enumerate() {
            let days = problem.t[i] - problem.t[i.saturating_sub(1)];
            let left: f64 = if i > 0 { memory.powf(days) } else { 0.0 };
            state = left * state + (1.0 - left * left).sqrt() * *value;
            *value = state;
        }
        test(problem, &values).unwrap()
    };
    (0..SERIES).map(of).collect()
}

fn of_runs(_: &Problem, innovations: &[f64]) -> Option<f64> {
    runs(innovations, 0.0)
}

/// The p-value of the runs of readings of a slope that creeps by a standard deviation of the noise in 100 days, rounded to `step` of these.
fn of_rounded(step: f64) -> (f64, Option<f64>) {
    let creep = |day: usize| 0.01 * day as f64;
    let noise = normals(&mut generator(3), 800);
    let left = noise.iter().enumerate().map(|(day, noise)| {
        let read = ((creep(day) + noise) / step).round() * step;
        read - creep(day)
    });
    let left: Vec<f64> = left.collect();
    (runs(&left, 0.0).unwrap(), runs(&left, step))
}

#[test]
fn readings_on_one_step_of_their_resolution_that_the_law_moves_past_have_no_sign() {
    let (as_read, coarse) = of_rounded(2.5);
    assert!(as_read < 1e-6 && coarse.is_none(), "{as_read} {coarse:?}");
    let (_, fine) = of_rounded(0.5);
    assert!(fine.unwrap() > 0.01, "{fine:?}");
}

/// The largest distance of their distribution from the uniform one (Kolmogorov).
fn distance(mut p: Vec<f64>) -> f64 {
    p.sort_by(f64::total_cmp);
    let n = p.len() as f64;
    let each = p.iter().enumerate();
    each.map(|(k, p)| (p - (k as f64 + 0.5) / n).abs())
        .fold(0.0, f64::max)
}

#[test]
fn p_values_of_white_noise_are_uniform_with_and_without_gaps() {
    for problem in problems() {
        for test in [of_runs, stoffer_toloi] {
            let p = p_values(&problem, 0.0, test);
            let rare = p.iter().filter(|p| **p < 0.05).count() as f64 / p.len() as f64;
            assert!((0.02..0.09).contains(&rare), "{rare}");
            let distance = distance(p);
            assert!(distance < 0.1, "{distance}");
        }
    }
}

#[test]
fn noise_that_remembers_is_told_from_white_noise_with_and_without_gaps() {
    for problem in problems() {
        for (test, power) in [
            (of_runs as fn(&Problem, &[f64]) -> Option<f64>, 0.9),
            (stoffer_toloi, 0.95),
        ] {
            let p = p_values(&problem, 0.4, test);
            let rejected = p.iter().filter(|p| **p < 0.05).count() as f64 / p.len() as f64;
            assert!(rejected > power, "{rejected}");
        }
    }
}

#[test]
fn readings_on_either_side_of_a_gap_are_correlated_at_their_own_distance() {
    // Pairs one day apart, and six days from pair to pair: alike within a pair, alone otherwise.
    let days: Vec<f64> = (0..COUNT).map(|i| (i / 2 * 6 + i % 2) as f64).collect();
    let mut problem = steady(Quantity::Displacement, &days, 1);
    problem.spacing = 1.0;
    let draws = normals(&mut generator(5), COUNT / 2);
    let values: Vec<f64> = (0..COUNT).map(|i| draws[i / 2]).collect();
    let r = autocorrelation(&problem, &values);
    assert!(
        (r[0] - 1.0).abs() < 1e-9 && (r[1] - 1.0).abs() < 0.1,
        "{r:?}"
    );
    assert!(
        r[2..5].iter().all(|r| *r == 0.0) && r[6].abs() < 0.25,
        "{r:?}"
    );
}

#[test]
fn too_few_readings_are_not_tested() {
    let problem = steady(Quantity::Displacement, &daily(20), 1);
    let values = normals(&mut generator(6), 12);
    assert!(runs(&values, 0.0).is_none());
    assert!(stoffer_toloi(&problem, &values).is_none());
}

#[test]
fn the_tails_are_those_of_the_normal_and_chi_square_distributions() {
    for (z, p) in [
        (0.0, 1.0),
        (1.0, 0.317_311),
        (1.959_964, 0.05),
        (3.0, 0.002_699_796_063_260_189),
        (8.0, 1.244_192_114_854_356_8e-15),
    ] {
        assert!(
            (two_sided(z) / p - 1.0).abs() < 1e-5,
            "{z} {}",
            two_sided(z)
        );
    }
    for (x, p) in [
        (10.851, 0.95),
        (19.337, 0.5),
        (31.410, 0.05),
        (37.566, 0.01),
        (100.0, 1.259_608_459_166_090_7e-12),
    ] {
        let tail = chi_square_tail(x, 20.0);
        assert!((tail / p - 1.0).abs() < 1e-3, "{x} {tail}");
    }
}
