//! How often the benchmarks of a site are measured, by what lies in its files now.

use super::clock;
use super::tail::Follower;
use crate::config::Config;
use crate::monitor::Input;
use crate::reading::{BenchmarkId, Timestamp};
use jiff::SignedDuration;
use std::collections::{BTreeMap, BTreeSet};

/// Readings of a benchmark that say how often it is measured, the latest.
const LATEST: usize = 200;
/// Values that are looked at, so that years of history cost a bounded time.
const MOST_VALUES: usize = 2_000_000;
/// So many readings must fall into the time that an evacuation takes: a fit that sees the
/// acceleration needs several, and the last of them must leave time to go.
const READINGS_AN_EVACUATION: i32 = 4;

/// What lies in the files of a site now.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Sampling {
    /// The median time between the latest readings of each benchmark.
    pub spacings: BTreeMap<BenchmarkId, SignedDuration>,
    /// Benchmarks of the config of which no file has a reading, where there are files.
    pub absent: Vec<BenchmarkId>,
}

/// Looks at the files.
pub fn sample(config: &Config) -> Sampling {
    let mut follower = Follower::new(&config.sources, &config.benchmarks, &[]);
    let mut times: BTreeMap<BenchmarkId, BTreeSet<Timestamp>> = BTreeMap::new();
    let mut values = 0;
    loop {
        let batch = follower.poll(clock::now());
        values += batch.arrivals.len();
        for arrival in &batch.arrivals {
            if let Input::Reading { benchmark, .. } = &arrival.input {
                let latest = times.entry(benchmark.clone()).or_default();
                latest.insert(arrival.time);
                if latest.len() > LATEST {
                    latest.pop_first();
                }
            }
        }
        if batch.caught_up || values > MOST_VALUES {
            break;
        }
    }
    let is_whole = values <= MOST_VALUES;
    let of_files: BTreeSet<&str> = config.sources.iter().map(|one| one.id.as_str()).collect();
    let mut absent: Vec<BenchmarkId> = Vec::new();
    for benchmark in &config.benchmarks {
        let has_files =
            of_files.contains(benchmark.source.as_str()) && follower.follows(&benchmark.source);
        if is_whole && has_files && !times.contains_key(&benchmark.id) {
            absent.push(benchmark.id.clone());
        }
    }
    let medians = times.into_iter().map(|(id, times)| (id, median(&times)));
    let spacings = medians.filter_map(|(id, median)| Some((id, median?)));
    Sampling {
        spacings: spacings.collect(),
        absent,
    }
}

fn median(times: &BTreeSet<Timestamp>) -> Option<SignedDuration> {
    let pairs = times.iter().zip(times.iter().skip(1));
    let mut gaps: Vec<SignedDuration> = pairs.map(|(a, b)| b.duration_since(*a)).collect();
    gaps.sort();
    gaps.get(gaps.len() / 2).copied()
}

/// A line for each benchmark that is measured too rarely for its evacuation time to mean anything, or not at all.
pub fn doubts(config: &Config) -> Vec<String> {
    let settings = &config.settings;
    let Sampling { spacings, absent } = sample(config);
    let absent = absent.into_iter().map(|id| {
        format!(
            "benchmark {:?}: the files that are there have no reading of it; are its column and its id right?",
            id.as_str()
        )
    });
    let lines = spacings.into_iter().filter_map(|(id, spacing)| {
        let policy = settings.benchmarks.get(&id).unwrap_or(&settings.policy);
        let evacuation = policy.evacuation_time;
        (spacing > evacuation / READINGS_AN_EVACUATION).then(|| {
            format!(
                "benchmark {:?}: measured every {spacing:#}, and evacuation_time is {evacuation:#}; \
                 a warning can come too late, measure {READINGS_AN_EVACUATION} times within it or more",
                id.as_str()
            )
        })
    });
    lines.chain(absent).collect()
}
