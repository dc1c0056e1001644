//! Rain that is logged after what it did is no explanation, nor is what would be found in its place.

use super::super::explain::explain;
use super::super::explanation::{Explained, Explanation};
use super::super::fixture::{channel, daily, generator, normals, series};
use super::super::options::Options;
use super::*;
use crate::reading::Quantity;

const COUNT: usize = 400;
/// Days between two nodes of the rain's first and last day beside the readings.
const BEFORE: f64 = 60.0;

/// A slope whose velocity follows rain with a mean delay of five days, its gauge being late by so many days.
fn beside_a_gauge(late_days: f64, seed: u64) -> Explanation {
    let mut random = generator(seed);
    let sizes = normals(&mut random, COUNT + 60);
    let rain: Vec<f64> = sizes.iter().map(|u| 20.0 * (u - 0.8).max(0.0)).collect();
    let noise = normals(&mut random, COUNT);
    let (mut stored, mut moved) = (2.0, 0.0);
    let stores = rain.iter().map(|falls| {
        stored += (falls - stored) * -(-0.2_f64).exp_m1();
        stored
    });
    let stores: Vec<f64> = stores.collect();
    let values = stores[60..].iter().zip(noise).map(|(stored, noise)| {
        moved += (0.3 * (stored - 2.0)).exp();
        moved + 0.5 * noise
    });
    let values: Vec<f64> = values.collect();
    let moving = series(Quantity::Displacement, &daily(COUNT), &values);
    let logged: Vec<f64> = daily(COUNT + 60)
        .iter()
        .map(|day| day - BEFORE + late_days)
        .collect();
    let rain = channel("rain_mm", &logged, &rain);
    explain(&moving, &[rain], &[], &Options::default(), &mut |_| {})
}

#[test]
fn rain_that_is_logged_after_what_it_did_explains_nothing_and_is_said_to_be_late() {
    let said = beside_a_gauge(10.0, 1);
    assert_eq!(said.verdict.effect, Kind::UNEXPLAINED);
    assert_eq!(said.explained, Explained::None);
    let mut each = said.candidates.iter();
    let is_late = each.any(|one| {
        let why = one.rejected_because.as_deref().unwrap_or_default();
        one.channel.as_deref() == Some("rain_mm") && why.contains("days earlier")
    });
    assert!(is_late, "{:?}", said.candidates);
}

#[test]
fn rain_that_is_logged_in_time_is_found() {
    let said = beside_a_gauge(0.0, 1);
    assert_eq!(said.verdict.effect, Kind::HYDROLOGICAL);
}

#[test]
fn a_covariate_is_brought_forward_by_days_within_bounds() {
    let days = earlier_by(1.0, 40.0);
    assert_eq!(days.len(), TIMES);
    assert!((days[0] - 2.0).abs() < 1e-9 && (days[TIMES - 1] - 40.0).abs() < 1e-9);
    assert!(earlier_by(1.0, 1.5).is_empty());
}
