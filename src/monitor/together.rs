//! Benchmarks in alarm that share one failure time, as far as their newest forecasts agree about it.
//!
//! Only benchmarks at orange or above are compared, a bounded number of them, so that a quiet site costs nothing. What is
//! reported here calls no level and lowers none: a neighbour that is noisy, halted or silent takes nothing from the
//! benchmark that accelerates to failure.

use super::Monitor;
use super::event::{Event, EventKind, FailureTime, SharedFailure};
use super::in_force::LevelsInForce;
use super::kept::KeptForecast;
use super::track::Track;
use crate::alert::{Level, Policy};
use crate::fit::Rate;
use crate::forecast::{Dependence, Group, HORIZON_DAYS, Snapshot, groups};
use crate::reading::{BenchmarkId, Timestamp, after_days, days_of, days_since};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Benchmarks that are compared, at most: those of the highest levels.
const MOST_COMPARED: usize = 12;
/// Comparisons that are remembered: an agreement is judged over those of late.
const MOST_KEPT: usize = 6;
/// Between two comparisons, unless a level changes, in evacuation times.
const APART_EVACUATIONS: f64 = 0.125;
/// A forecast older than so many evacuation times says nothing of now.
const STALE: f64 = 2.0;
/// A median is reported again when it has moved by this share of the time that was left.
const MOVED: f64 = 0.25;
/// A benchmark is reported with others from this probability on that it fails with them.
const BELONGS: f64 = 0.8;

/// What has been compared and reported.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct FailureComparisons {
    /// Forecasts at the newest comparisons, oldest first.
    kept: Vec<(Timestamp, BTreeMap<BenchmarkId, KeptForecast>)>,
    reported: Vec<SharedFailure>,
}

impl FailureComparisons {
    /// Takes the newest forecasts; says which benchmarks share a failure time where that is other than last reported.
    pub(super) fn update(
        &mut self,
        now: Timestamp,
        policy: &Policy,
        tracks: &BTreeMap<BenchmarkId, Track>,
        in_force: &LevelsInForce,
        has_changed: bool,
    ) -> Option<Event> {
        let evacuation_days = days_of(policy.evacuation_time);
        let newest = self.kept.last().map(|(time, _)| days_since(*time, now));
        if !has_changed && newest.is_some_and(|ago| ago < APART_EVACUATIONS * evacuation_days) {
            return None;
        }
        let compared = compared(in_force, tracks, now, STALE * evacuation_days);
        if compared.len() < 2 {
            self.kept.clear();
            return self.report(now, Vec::new());
        }
        let forecasts = compared.iter().filter_map(|id| {
            let forecast = tracks.get(*id)?.kept_forecast()?.clone();
            Some(((*id).clone(), forecast))
        });
        let forecasts = forecasts.collect();
        // Of what changes at one moment the newest is kept: an agreement is judged over the forecasts of some time.
        if newest.is_some_and(|ago| ago < APART_EVACUATIONS * evacuation_days) {
            self.kept.pop();
        }
        self.kept.push((now, forecasts));
        let excess = self.kept.len().saturating_sub(MOST_KEPT);
        self.kept.drain(..excess);
        let found = self.shared(now, &compared, tracks);
        let shared = found
            .iter()
            .filter_map(|group| shared_failure(now, group, &compared, evacuation_days));
        let shared = shared.collect();
        self.report(now, shared)
    }

    fn shared(
        &self,
        now: Timestamp,
        compared: &[&BenchmarkId],
        tracks: &BTreeMap<BenchmarkId, Track>,
    ) -> Vec<Group> {
        let left = |time: Timestamp, forecasts: &BTreeMap<BenchmarkId, KeptForecast>| {
            let medians = forecasts.values().filter_map(|one| one.left_days(time));
            medians.fold(HORIZON_DAYS, f64::min).max(0.0)
        };
        let snapshots: Vec<Snapshot> = self
            .kept
            .iter()
            .map(|(time, forecasts)| Snapshot {
                left_days: left(*time, forecasts),
                likelihoods: compared
                    .iter()
                    .map(|id| forecasts.get(*id).map(|one| one.likelihood(*time)))
                    .collect(),
            })
            .collect();
        let rates: Vec<(Vec<Rate>, f64)> = compared
            .iter()
            .filter_map(|id| Some(tracks.get(*id)?.rates_at(now)))
            .collect();
        let rates: Vec<(&[Rate], f64)> = rates.iter().map(|(rates, at)| (&**rates, *at)).collect();
        groups(&snapshots, &Dependence::measured(&rates))
    }

    fn report(&mut self, now: Timestamp, shared: Vec<SharedFailure>) -> Option<Event> {
        let is_known = shared.len() == self.reported.len()
            && shared
                .iter()
                .zip(&self.reported)
                .all(|(new, old)| is_the_same(now, new, old));
        if is_known {
            return None;
        }
        self.reported.clone_from(&shared);
        Some(Event {
            time: now,
            benchmark: None,
            kind: EventKind::Together { groups: shared },
        })
    }
}

impl Monitor {
    /// Which benchmarks share a failure time, after `events`: asked when a forecast or a level is new.
    pub(super) fn compare(&mut self, now: Timestamp, events: &[Event]) -> Option<Event> {
        let has_changed = events
            .iter()
            .any(|event| matches!(event.kind, EventKind::Alert { .. }));
        let is_new = |event: &Event| {
            let track = event
                .benchmark
                .as_ref()
                .and_then(|id| self.benchmarks.get(id));
            matches!(event.kind, EventKind::Refit { .. })
                && track.is_some_and(|track| track.level() > Level::Green)
        };
        if !has_changed && !events.iter().any(is_new) {
            return None;
        }
        let policy = &self.settings.policy;
        let (tracks, in_force) = (self.benchmarks.all(), self.benchmarks.in_force());
        let together = &mut self.together;
        together.update(now, policy, tracks, in_force, has_changed)
    }
}

/// Those in alarm of which something can be said now, the highest levels first.
fn compared<'a>(
    in_force: &'a LevelsInForce,
    tracks: &BTreeMap<BenchmarkId, Track>,
    now: Timestamp,
    oldest_days: f64,
) -> Vec<&'a BenchmarkId> {
    let is_recent = |id: &&BenchmarkId| {
        let kept = tracks.get(*id).and_then(Track::kept_forecast);
        kept.is_some_and(|one| days_since(one.time(), now) <= oldest_days)
    };
    let recent = in_force.compared().filter(is_recent);
    let mut ids: Vec<&BenchmarkId> = recent.take(MOST_COMPARED).collect();
    ids.sort();
    ids
}

/// `None` where fewer than two belong to the group for sure.
fn shared_failure(
    now: Timestamp,
    group: &Group,
    compared: &[&BenchmarkId],
    evacuation_days: f64,
) -> Option<SharedFailure> {
    let passage = &group.passage;
    let quantile = |share| after_days(now, passage.quantile(share, HORIZON_DAYS)?);
    let members = group.members.iter().zip(&group.probabilities);
    let (benchmarks, probabilities): (Vec<BenchmarkId>, Vec<f64>) = members
        .filter(|(_, probability)| **probability >= BELONGS)
        .map(|(member, probability)| (compared[*member].clone(), *probability))
        .unzip();
    (benchmarks.len() > 1).then(|| SharedFailure {
        benchmarks,
        probabilities,
        failure_time: FailureTime {
            low: quantile(0.05),
            median: quantile(0.5),
            high: quantile(0.95),
            probability: passage.chance_within(HORIZON_DAYS),
            horizon_days: HORIZON_DAYS,
        },
        chance_within_evacuation_time: passage.chance_within(evacuation_days),
    })
}

/// Whether nobody would act otherwise on the new one.
fn is_the_same(now: Timestamp, new: &SharedFailure, old: &SharedFailure) -> bool {
    let medians = (new.failure_time.median, old.failure_time.median);
    let near = match medians {
        (Some(new), Some(old)) => {
            let left = days_since(now, old).max(0.0);
            days_since(old, new).abs() <= MOVED * left.max(f64::MIN_POSITIVE)
        }
        (None, None) => true,
        (Some(_), None) | (None, Some(_)) => false,
    };
    new.benchmarks == old.benchmarks && near
}
