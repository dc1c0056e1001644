//! Several benchmarks explained together: do they part, and what does each show.

use super::explain::explain;
use super::explanation::{Candidate, Effect, Explained, Explanation};
use super::kind::Kind;
use super::options::Options;
use super::partition::partition;
use super::rival::Rival;
use crate::reading::{BenchmarkId, Channel, Quantity, Series};
use schemars::JsonSchema;
use serde::{Serialize, Serializer};
use std::collections::BTreeMap;

/// What benchmarks show together, key for key as scripts read it.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Together {
    /// Their names, in the order given.
    #[serde(rename = "benchmark", serialize_with = "joined")]
    #[schemars(with = "String")]
    pub benchmarks: Vec<BenchmarkId>,
    /// The partition, or none.
    pub verdict: Effect,
    /// Whether it accounts for all in which they differ.
    pub explained: Explained,
    /// Further effects that they have in common; each one's own stand in `each`.
    pub also: Vec<Effect>,
    /// What explains the same.
    pub cannot_separate_from: Vec<Rival>,
    /// What was tried on them together, with why it was refused.
    pub candidates: Vec<Candidate>,
    /// Each series alone, the others its neighbours.
    pub each: Vec<Explanation>,
}

fn joined<S: Serializer>(benchmarks: &[BenchmarkId], serializer: S) -> Result<S::Ok, S::Error> {
    let names: Vec<&str> = benchmarks.iter().map(BenchmarkId::as_str).collect();
    serializer.serialize_str(&names.join(", "))
}

/// Explains several series by what they show together and by what each shows; of a benchmark read as both
/// displacement and velocity, the displacement stands for it among the others. `progress` is called with the share
/// done, 0 to 1.
pub fn explain_together(
    all: &[&Series],
    channels: &[Channel],
    options: &Options,
    progress: &mut dyn FnMut(f64),
) -> Together {
    let slope = one_of_each(all);
    let (found, candidate) = partition(&slope, options);
    let explained = match &found {
        Some(found) if found.is_full => Explained::Full,
        Some(_) => Explained::Partly,
        None => Explained::None,
    };
    let count = all.len() as f64;
    let one = |(index, series): (usize, &&Series)| {
        let others = slope
            .iter()
            .copied()
            .filter(|other| other.benchmark != series.benchmark);
        let neighbours: Vec<&Series> = others.collect();
        let mut within = |share: f64| progress((index as f64 + share) / count);
        explain(series, channels, &neighbours, options, &mut within)
    };
    let each = all.iter().enumerate().map(one).collect();
    Together {
        benchmarks: slope
            .iter()
            .map(|series| series.benchmark.clone())
            .collect(),
        verdict: found.map_or(Effect::of(Kind::NONE), |found| found.effect()),
        explained,
        also: Vec::new(),
        cannot_separate_from: Vec::new(),
        candidates: vec![candidate],
        each,
    }
}

/// One series of each benchmark, in the order given.
fn one_of_each<'a>(all: &[&'a Series]) -> Vec<&'a Series> {
    let mut chosen: BTreeMap<&BenchmarkId, &Series> = BTreeMap::new();
    for series in all {
        let place = chosen.entry(&series.benchmark).or_insert(series);
        if series.quantity() == Quantity::Displacement {
            *place = series;
        }
    }
    let stands = |series: &&&Series| {
        chosen
            .get(&series.benchmark)
            .is_some_and(|one| std::ptr::eq(*one, **series))
    };
    all.iter().filter(stands).copied().collect()
}
