//! A load that changes over a while is no event, and a step of the load is none that changes over a while.

use crate::effects::explanation::Explanation;
use crate::effects::fixture::{daily, generator, normals, series};
use crate::effects::{Kind, Options, explain};
use crate::reading::Quantity;

const DAYS: usize = 300;
/// mm.
const NOISE: f64 = 0.2;

/// What is said of a slope that moves by 1 mm/day under no load, and by e to the load times as much under one.
fn under(log_load: impl Fn(f64) -> f64, seed: u64) -> Explanation {
    under_and_set_back(log_load, seed, f64::INFINITY)
}

/// The same of an instrument that is set back by 20 mm on that day.
fn under_and_set_back(log_load: impl Fn(f64) -> f64, seed: u64, at: f64) -> Explanation {
    let days = daily(DAYS);
    let noise = normals(&mut generator(seed), DAYS);
    let mut moved = 0.0;
    let values = days.iter().zip(noise).map(|(day, noise)| {
        moved += log_load(*day).exp();
        let set_back = if *day >= at { 20.0 } else { 0.0 };
        moved + NOISE * noise - set_back
    });
    let values: Vec<f64> = values.collect();
    let series = series(Quantity::Displacement, &days, &values);
    explain(&series, &[], &[], &Options::default(), &mut |_| {})
}

#[test]
fn a_load_that_grew_for_three_months_is_not_called_a_change_of_the_friction() {
    for seed in [1, 2] {
        let said = under(|day| ((day - 100.0) / 90.0).clamp(0.0, 1.0), seed);
        assert_eq!(said.verdict.effect, Kind::UNEXPLAINED, "seed {seed}");
        let slow = said.candidates.iter();
        let mut slow = slow.filter(|one| one.effect == Kind::UNEXPLAINED);
        let slow = slow.next().unwrap();
        assert!(slow.bic_gain > 50.0, "{slow:?}");
    }
}

#[test]
fn a_load_that_stepped_up_is_called_an_event_of_its_date() {
    let said = under(|day| f64::from(u8::from(day >= 140.0)), 1);
    let at = said.verdict.at.unwrap();
    assert!(
        said.verdict.effect.is_event_of_the_ground(),
        "{:?}",
        said.verdict
    );
    let first = crate::effects::fixture::epoch();
    let day = crate::reading::days_since(first, at);
    assert!((day - 140.0).abs() < 2.0, "{day}");
}

#[test]
fn a_jump_of_the_reading_is_found_beside_a_load_that_nothing_measures() {
    let said = under_and_set_back(|day| ((day - 100.0) / 90.0).clamp(0.0, 1.0), 1, 220.0);
    assert_eq!(said.verdict.effect, Kind::OFFSET, "{:?}", said.verdict);
    let size = said.verdict.size.unwrap();
    assert!((size + 20.0).abs() < 1.0, "{size}");
}
