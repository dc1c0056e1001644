//! The plain law is as near to the readings as its inversion is, and a failure that it accounts for is no noise.

use super::super::explain::explain;
use super::super::explanation::Explanation;
use super::super::fixture::{channel, daily, generator, normals, series};
use super::super::kind::Form;
use super::*;
use crate::fit::{ConstantLoad, Exponent, PointReadings};
use crate::reading::Quantity;

/// Longjingcun until the day of its collapse (CC BY 4.0, Ma et al., IEEE Access 13, 2025, digitised), mm.
const LONGJINGCUN: [f64; 21] = [
    61.0, 71.5, 92.3, 113.2, 126.6, 148.9, 169.7, 187.6, 202.5, 223.3, 242.7, 263.5, 279.9, 303.7,
    327.5, 354.3, 388.6, 422.8, 463.0, 531.5, 1085.4,
];

fn said_of(values: &[f64]) -> Explanation {
    let series = series(Quantity::Displacement, &daily(values.len()), values);
    explain(&series, &[], &[], &Options::default(), &mut |_| {})
}

/// The rms of the plain law, and of the best law of the inversion.
fn plain_and_inverted(days: &[f64], values: &[f64]) -> (f64, f64) {
    let series = series(Quantity::Displacement, days, values);
    let problem = Problem::new(&series, &[]).unwrap();
    let plain = plain(&problem, &mut Scratch::default()).unwrap();
    let pairs = days.iter().copied().zip(values.iter().copied());
    let readings = PointReadings::new(Quantity::Displacement, pairs);
    let inverted = ConstantLoad::fit(&readings, Exponent::Free);
    (
        plain.rms(&problem, 0..days.len()),
        inverted.best().unwrap().rms,
    )
}

#[test]
fn the_plain_law_of_longjingcun_is_that_which_its_inversion_finds() {
    let (plain, inverted) = plain_and_inverted(&daily(21), &LONGJINGCUN);
    assert!(inverted < 2.5, "{inverted}");
    assert!(plain < 1.1 * inverted, "{plain} {inverted}");
}

/// The displacement of a law that fails soon after the last of `count` daily readings, with noise of 1 mm.
fn to_failure(seed: u64, count: usize) -> Vec<f64> {
    let days = daily(count);
    let fails = days[count - 1] + 0.02 + 0.1 * seed as f64;
    let noise = normals(&mut generator(seed), count);
    let both = days.iter().zip(noise);
    both.map(|(day, noise)| 3.0 * day - 60.0 * (1.0 - day / fails).ln() + noise)
        .collect()
}

#[test]
fn the_plain_law_of_a_slope_that_fails_is_that_which_its_inversion_finds() {
    for (seed, count) in [(1, 25), (2, 40), (3, 80), (4, 200)] {
        let values = to_failure(seed, count);
        let (plain, inverted) = plain_and_inverted(&daily(count), &values);
        // The prior and the rougher solution take their share of a few readings.
        assert!(plain < 1.25 * inverted, "{seed}: {plain} {inverted}");
    }
}

#[test]
fn an_acceleration_to_failure_is_not_called_noise() {
    let said = said_of(&LONGJINGCUN);
    let effects = std::iter::once(&said.verdict).chain(&said.also);
    let mut noise = effects.filter(|one| one.effect == Kind::CORRELATED_NOISE);
    assert!(noise.next().is_none(), "{:?}", said.verdict);
}

/// Daily displacements of a slope whose velocity follows rain through an exponential memory of half a day, with noise of 0.5 mm.
fn driven_by_rain(seed: u64) -> (Vec<f64>, Vec<f64>) {
    const PARTS: usize = 48;
    const MEMORY_DAYS: f64 = 0.5;
    let mut random = generator(seed);
    let sizes = normals(&mut random, 400);
    let noise = normals(&mut random, 400);
    // Of three days in ten, none on the others.
    let rain: Vec<f64> = sizes.iter().map(|u| 20.0 * (u - 0.52).max(0.0)).collect();
    let (mut stored, mut moved) = (3.6, 0.0);
    let mut values = vec![noise[0]];
    for (pair, noise) in rain.windows(2).zip(&noise[1..]) {
        for part in 0..PARTS {
            let share = (part as f64 + 0.5) / PARTS as f64;
            let falls = pair[0] + share * (pair[1] - pair[0]);
            stored -= (falls - stored) * (-1.0 / PARTS as f64 / MEMORY_DAYS).exp_m1();
            moved += (0.04 * (stored - 3.6)).exp() / PARTS as f64;
        }
        values.push(moved + 0.5 * noise);
    }
    (values, rain)
}

#[test]
fn a_memory_shorter_than_the_sampling_is_not_said_to_be_none() {
    for seed in 1..=3 {
        let (values, rain) = driven_by_rain(seed);
        let series = series(Quantity::Displacement, &daily(400), &values);
        let rain = channel("rain_mm", &daily(400), &rain);
        let said = explain(&series, &[rain], &[], &Options::default(), &mut |_| {});
        assert_eq!(said.verdict.effect, Kind::HYDROLOGICAL, "{seed}");
        let mut each = said.candidates.iter();
        let by_level = each.find(|one| one.form == Some(Form::Level)).unwrap();
        let days = by_level.lag_days.unwrap();
        assert!(days > 0.0 && days < 1.0, "{seed}: {days}");
    }
}
