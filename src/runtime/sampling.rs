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

/// The median time between the latest readings of each benchmark.
pub fn spacings(config: &Config) -> BTreeMap<BenchmarkId, SignedDuration> {
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
    let medians = times.into_iter().map(|(id, times)| (id, median(&times)));
    medians
        .filter_map(|(id, median)| Some((id, median?)))
        .collect()
}

fn median(times: &BTreeSet<Timestamp>) -> Option<SignedDuration> {
    let pairs = times.iter().zip(times.iter().skip(1));
    let mut gaps: Vec<SignedDuration> = pairs.map(|(a, b)| b.duration_since(*a)).collect();
    gaps.sort();
    gaps.get(gaps.len() / 2).copied()
}

/// A line for each benchmark that is measured too rarely for its evacuation time to mean anything.
pub fn too_slow(config: &Config) -> Vec<String> {
    let settings = &config.settings;
    let lines = spacings(config).into_iter().filter_map(|(id, spacing)| {
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
    lines.collect()
}
