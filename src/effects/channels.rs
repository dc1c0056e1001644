//! Which covariates count as evidence: each once, and only those that cover the record.

use super::problem::Problem;
use super::response::Driver;
use crate::reading::Channel;

/// A covariate must cover this share of the record.
const LEAST_COVERAGE: f64 = 0.8;

/// The channels, each once: of two that hold the same values the one without faults stays.
pub(super) fn distinct(channels: Vec<Channel>, faulty: &[String]) -> Vec<Channel> {
    let mut kept: Vec<Channel> = Vec::new();
    let (second, first): (Vec<Channel>, Vec<Channel>) = channels
        .into_iter()
        .partition(|channel| faulty.contains(&channel.name));
    for channel in first.into_iter().chain(second) {
        if !kept.iter().any(|known| same_values(known, &channel)) {
            kept.push(channel);
        }
    }
    kept.sort_by(|a, b| a.name.cmp(&b.name));
    kept
}

/// Whether two channels differ by a constant only, within a hundredth of their deviation, where both have values.
fn same_values(one: &Channel, other: &Channel) -> bool {
    let mut theirs = other.samples.iter().peekable();
    let mut pairs = Vec::new();
    for sample in &one.samples {
        while theirs.next_if(|their| their.time < sample.time).is_some() {}
        if let Some(their) = theirs.next_if(|their| their.time == sample.time) {
            pairs.push((sample.value, their.value));
        }
    }
    let n = pairs.len() as f64;
    if n < 0.5 * one.samples.len() as f64 || n < 10.0 {
        return false;
    }
    let spread = |of: &dyn Fn(&(f64, f64)) -> f64| {
        let mean = pairs.iter().map(of).sum::<f64>() / n;
        let squares = pairs.iter().map(|pair| (of(pair) - mean).powi(2));
        squares.sum::<f64>()
    };
    spread(&|pair| pair.0 - pair.1) < 1e-4 * spread(&|pair| pair.0)
}

/// The covariates that cover the record; the others are reported to the reader.
pub(super) fn drivers(
    problem: &Problem,
    channels: &[Channel],
    remarks: &mut Vec<String>,
) -> Vec<Driver> {
    let mut drivers = Vec::new();
    for (index, channel) in channels.iter().enumerate() {
        let Some(driver) = Driver::new(index, channel, problem.epoch) else {
            continue;
        };
        let share = driver.coverage(&problem.nodes);
        if share < LEAST_COVERAGE {
            remarks.push(format!(
                "{} was left out: it covers {:.0} % of the readings' time.",
                channel.name,
                100.0 * share
            ));
            continue;
        }
        drivers.push(driver);
    }
    drivers
}
