//! A search without any effect is judged by what other searches find without any effect.

use super::*;
use crate::effects::fixture::{channel, daily, generator, normals, series};
use crate::effects::{Kind, Options, explain};
use crate::reading::Quantity;
use rand_distr::StandardNormal;

/// The best of `tries` chi-square values, many times over.
fn gains(random: &mut rand_pcg::Pcg64, count: usize, tries: usize) -> Vec<f64> {
    let mut best = || {
        let each = (0..tries).map(|_| random.sample::<f64, _>(StandardNormal).powi(2));
        each.fold(0.0, f64::max)
    };
    (0..count).map(|_| best()).collect()
}

fn null_gains(gains: Vec<f64>) -> NullGains {
    NullGains {
        gains,
        largest: Vec::new(),
    }
}

#[test]
fn a_larger_gain_never_has_a_larger_p_value() {
    for seed in 0..20 {
        let null_gains = null_gains(gains(&mut generator(seed), 99, 30));
        let p: Vec<f64> = (0..4000)
            .map(|k| null_gains.p_value(f64::from(k) * 0.01))
            .collect();
        assert!(p.windows(2).all(|pair| pair[1] <= pair[0]), "{seed}");
        assert!(p.iter().all(|p| (LEAST_P..=1.0).contains(p)), "{seed}");
        assert!(p[3999] < 1e-4, "{}", p[3999]);
    }
}

#[test]
fn where_many_searches_in_vain_gain_as_much_the_p_value_is_the_rank() {
    let null_gains = null_gains((0..99).map(f64::from).collect());
    assert!((null_gains.p_value(50.0) - 0.5).abs() < 1e-12);
    assert!((null_gains.p_value(94.0) - 0.06).abs() < 1e-12);
    assert!((null_gains.p_value(-1.0) - 1.0).abs() < 1e-12);
    assert!(NullGains::default().p_value(1e9) >= 1.0);
}

#[test]
fn one_more_search_in_vain_has_a_p_value_as_small_as_chance_has_it() {
    let mut random = generator(7);
    let mut p: Vec<f64> = Vec::new();
    for _ in 0..2000 {
        let null_gains = null_gains(gains(&mut random, 99, 30));
        p.push(null_gains.p_value(gains(&mut random, 1, 30)[0]));
    }
    let share = |most: f64| p.iter().filter(|p| **p <= most).count() as f64 / 2000.0;
    for most in [0.5, 0.2, 0.1, 0.05] {
        // Four standard errors.
        let slack = 4.0 * (most * (1.0 - most) / 2000.0_f64).sqrt();
        assert!(
            (share(most) - most).abs() < slack + 0.01,
            "{most} {}",
            share(most)
        );
    }
    assert!(share(0.01) <= 0.02, "{}", share(0.01));
}

#[test]
fn gains_that_full_refits_show_to_be_larger_make_a_find_less_rare() {
    let plain = null_gains(gains(&mut generator(8), 99, 30));
    assert!(plain.clone().amplified(1.5).p_value(12.0) > 1.5 * plain.p_value(12.0));
}

/// A series of white noise about a steady motion, with two covariates that have nothing to do with it.
fn finds_something(seed: u64) -> bool {
    const COUNT: usize = 90;
    let mut random = generator(seed);
    let noise = normals(&mut random, COUNT);
    let values: Vec<f64> = (0..COUNT)
        .map(|day| 0.4 * day as f64 + noise[day])
        .collect();
    let decoys = ["lake_level_m", "rain_mm"].map(|name| {
        let mut state = 0.0;
        let steps = normals(&mut random, COUNT).into_iter();
        let walk: Vec<f64> = steps
            .map(|step| {
                state = 0.9 * state + step;
                state
            })
            .collect();
        channel(name, &daily(COUNT), &walk)
    });
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    let series = series(Quantity::Displacement, &daily(COUNT), &values);
    let found = explain(&series, &decoys, &[], &options, &mut |_| {});
    found.verdict.effect != Kind::NONE
}

#[test]
fn of_40_series_of_white_noise_with_two_decoys_two_at_most_lead_to_a_find() {
    let found: Vec<u64> = (0..40).filter(|seed| finds_something(*seed)).collect();
    assert!(found.len() <= 2, "{found:?}");
}

#[test]
fn a_jump_of_the_reading_in_a_walk_is_found_though_it_is_one_step_of_the_walk() {
    const COUNT: usize = 120;
    let mut walk = 0.0;
    let steps = normals(&mut generator(3), COUNT);
    let values = steps.iter().enumerate().map(|(day, step)| {
        walk += step;
        let jump = if day < 60 { 0.0 } else { -25.0 };
        0.4 * day as f64 + walk + jump
    });
    let values: Vec<f64> = values.collect();
    let series = series(Quantity::Displacement, &daily(COUNT), &values);
    let found = explain(&series, &[], &[], &Options::default(), &mut |_| {});
    assert_eq!(found.verdict.effect, Kind::OFFSET, "{:?}", found.candidates);
    assert!((found.verdict.size.unwrap() + 25.0).abs() < 4.0);
}
