//! A wave of the sun's day is no tide, and one of the moon's is.

use super::super::explain::explain;
use super::super::explanation::Explanation;
use super::super::fixture::{generator, normals, series};
use super::super::options::Options;
use super::*;
use crate::reading::Quantity;

/// Hourly velocities about 1 mm/day over so many days under waves of these amplitudes, e-folds, and periods, hours.
fn under(waves: &[(f64, f64)], days: usize) -> Explanation {
    let hours: Vec<f64> = (0..24 * days).map(|hour| hour as f64).collect();
    let noise = normals(&mut generator(5), hours.len());
    let each = hours.iter().zip(noise);
    let values = each.map(|(hour, noise)| {
        let wave =
            |(size, period): &(f64, f64)| size * (std::f64::consts::TAU * hour / period).sin();
        waves.iter().map(wave).sum::<f64>().exp() + 0.05 * noise
    });
    let values: Vec<f64> = values.collect();
    let days: Vec<f64> = hours.iter().map(|hour| hour / 24.0).collect();
    let series = series(Quantity::Velocity, &days, &values);
    let options = Options {
        surrogates: 99,
        ..Options::default()
    };
    explain(&series, &[], &[], &options, &mut |_| ())
}

fn has_remark(explanation: &Explanation) -> bool {
    let is_one = |one: &String| one == REMARK || one.starts_with(OF_BOTH);
    explanation.remarks.iter().any(is_one)
}

#[test]
fn a_wave_of_the_sun_s_day_is_no_tide() {
    for waves in [&[(0.3, 24.0)][..], &[(0.3, 24.0), (0.1, 12.0)]] {
        let found = under(waves, 20);
        let effects = std::iter::once(&found.verdict).chain(&found.also);
        assert!(
            effects.clone().all(|one| one.effect != Kind::TIDE),
            "{:?}",
            found.verdict
        );
        assert_eq!(found.verdict.effect, Kind::UNEXPLAINED);
        for rival in rivals() {
            assert!(found.cannot_separate_from.contains(&rival));
        }
        assert!(has_remark(&found));
    }
}

#[test]
fn a_wave_of_the_moon_s_day_is_a_tide() {
    let found = under(&[(0.3, 12.420_6)], 20);
    assert_eq!(found.verdict.effect, Kind::TIDE);
    assert!(
        found.cannot_separate_from.is_empty(),
        "{:?}",
        found.cannot_separate_from
    );
    assert!(!has_remark(&found));
}

#[test]
fn a_tide_under_a_stronger_wave_of_the_day_says_that_it_may_be_both() {
    let found = under(&[(0.1, 12.420_6), (0.3, 24.0)], 20);
    assert_eq!(found.verdict.effect, Kind::TIDE);
    for rival in rivals() {
        assert!(found.cannot_separate_from.contains(&rival));
    }
    // A daily cycle by itself explains less.
    assert!(found.remarks.contains(&of_both(&[])), "{:?}", found.remarks);
}

#[test]
fn in_a_few_days_a_wave_of_the_moon_s_is_a_tide_that_may_be_the_sun_s() {
    let found = under(&[(0.3, 12.420_6)], 5);
    assert_eq!(found.verdict.effect, Kind::TIDE);
    for rival in rivals() {
        assert!(found.cannot_separate_from.contains(&rival));
    }
}
