//! A neighbour that had not the event of a benchmark has parted from it, and one that had it too has not.

use super::*;
use crate::effects::fixture::{daily, epoch, generator, normals, series};
use crate::reading::after_days;
use std::collections::BTreeMap;

const DAYS: usize = 200;
const AT: f64 = 99.5;

/// Twice as fast from the event on, or not.
fn course(has_event: bool) -> Vec<f64> {
    let late = |day: &f64| if has_event { (day - AT).max(0.0) } else { 0.0 };
    daily(DAYS).iter().map(|day| day + late(day)).collect()
}

fn neighbour(name: &str, path: &[f64], seed: u64) -> Series {
    let noise = normals(&mut generator(seed), DAYS);
    let values: Vec<f64> = path.iter().zip(noise).map(|(x, e)| 0.6 * x + e).collect();
    Series {
        benchmark: BenchmarkId::new(name),
        ..series(Quantity::Displacement, &daily(DAYS), &values)
    }
}

/// The groups into which one benchmark with an event parts from these.
fn groups(neighbours: &[Series]) -> Option<Vec<Vec<BenchmarkId>>> {
    let after = course(true);
    let added: Vec<f64> = after
        .iter()
        .zip(course(false))
        .map(|(a, b)| a - b)
        .collect();
    let times = daily(DAYS)
        .into_iter()
        .filter_map(|day| after_days(epoch(), day));
    let curves = Curves {
        times: times.collect(),
        after: after.clone(),
        contributions: BTreeMap::from([(Kind::LOAD_STEP.to_string(), added)]),
        ..Curves::default()
    };
    let event = Effect {
        at: after_days(epoch(), AT),
        ..Effect::of(Kind::LOAD_STEP)
    };
    let own = series(Quantity::Displacement, &daily(DAYS), &after);
    let others: Vec<&Series> = neighbours.iter().collect();
    let (partition, _) = parted_by(&own, &others, (&[&event], &curves), 10.0)?;
    assert_eq!(partition.at, event.at);
    partition.groups
}

#[test]
fn a_neighbour_without_the_event_has_parted_and_one_with_it_stays() {
    let all = [
        neighbour("with", &course(true), 1),
        neighbour("without", &course(false), 2),
    ];
    let names = |group: &[&str]| group.iter().map(|one| BenchmarkId::new(*one)).collect();
    let expected: Vec<Vec<BenchmarkId>> = vec![names(&["made up", "with"]), names(&["without"])];
    assert_eq!(groups(&all), Some(expected));
}

#[test]
fn neighbours_that_had_the_event_too_part_from_nothing() {
    let all = [1, 2].map(|seed| neighbour(&format!("with {seed}"), &course(true), seed));
    assert_eq!(groups(&all), None);
}

#[test]
fn a_neighbour_that_moves_differently_is_no_evidence() {
    let there_and_back: Vec<f64> = daily(DAYS)
        .iter()
        .map(|day| 60.0 * (day / 25.0).sin())
        .collect();
    assert_eq!(groups(&[neighbour("own way", &there_and_back, 3)]), None);
}
