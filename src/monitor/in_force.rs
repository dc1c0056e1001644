//! Which benchmarks are at a level, which are unknown, and which can be compared: an alert at one of ten thousand benchmarks
//! looks at no other.

use super::track::Track;
use crate::alert::Level;
use crate::reading::BenchmarkId;
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet};

/// Benchmarks under this level are not compared: forecasts that expect little agree with all others.
const LEAST_COMPARED: Level = Level::Orange;
/// With more benchmarks than this a debug build does not compare the levels with the tracks at each step.
const MANY: usize = 64;

/// The levels in force, as of the newest events. It follows from the tracks and is not saved.
#[derive(Debug, Default)]
pub(super) struct LevelsInForce {
    raised: BTreeMap<BenchmarkId, Level>,
    by_level: BTreeMap<Level, usize>,
    unknown: BTreeSet<BenchmarkId>,
    /// Those in alarm with a forecast, the highest level first.
    compared: BTreeSet<(Reverse<Level>, BenchmarkId)>,
}

impl LevelsInForce {
    /// Of all of `tracks`.
    pub(super) fn of(tracks: &BTreeMap<BenchmarkId, Track>) -> Self {
        let mut all = Self::default();
        for (id, track) in tracks {
            all.note(id, Some(track));
        }
        all
    }

    /// Whether no level has changed unnoticed; of many benchmarks it is not asked.
    pub(super) fn is_true(&self, tracks: &BTreeMap<BenchmarkId, Track>) -> bool {
        if tracks.len() > MANY {
            return true;
        }
        let all = Self::of(tracks);
        (&self.raised, &self.unknown) == (&all.raised, &all.unknown)
    }

    /// A benchmark's track may have changed; `None`: it is gone.
    pub(super) fn note(&mut self, id: &BenchmarkId, track: Option<&Track>) {
        let level = track.map(Track::level);
        let raised = level.filter(|level| (Level::Yellow..=Level::Red).contains(level));
        let before = match raised {
            Some(level) => self.raised.insert(id.clone(), level),
            None => self.raised.remove(id),
        };
        if let Some(count) = before.and_then(|level| self.by_level.get_mut(&level)) {
            *count -= 1;
        }
        if let Some(level) = raised {
            *self.by_level.entry(level).or_default() += 1;
        }
        let is_unknown = track.is_some_and(Track::is_unknown);
        if is_unknown {
            self.unknown.insert(id.clone());
        } else {
            self.unknown.remove(id);
        }
        if let Some(level) = before {
            self.compared.remove(&(Reverse(level), id.clone()));
        }
        let has_forecast = track.is_some_and(|track| track.kept_forecast().is_some());
        let is_alarm = raised.filter(|level| *level >= LEAST_COMPARED);
        if let Some(level) = is_alarm.filter(|_| has_forecast && !is_unknown) {
            self.compared.insert((Reverse(level), id.clone()));
        }
    }

    /// The highest level that so many benchmarks reach.
    pub(super) fn reached_by(&self, needed: usize) -> Option<Level> {
        let mut reach = 0;
        let mut levels = self.by_level.iter().rev();
        levels.find_map(|(level, count)| {
            reach += count;
            (reach >= needed).then_some(*level)
        })
    }

    /// Those at `least` or above, the highest level first.
    pub(super) fn at_least(&self, least: Level) -> Vec<&BenchmarkId> {
        let reach = self.raised.iter().filter(|(_, level)| **level >= least);
        let mut reach: Vec<(&BenchmarkId, Level)> = reach.map(|(id, level)| (id, *level)).collect();
        reach.sort_by_key(|(_, level)| Reverse(*level));
        reach.into_iter().map(|(id, _)| id).collect()
    }

    /// Those of which nothing can be said.
    pub(super) fn unknown(&self) -> &BTreeSet<BenchmarkId> {
        &self.unknown
    }

    /// Those whose forecasts are compared, the highest level first.
    pub(super) fn compared(&self) -> impl Iterator<Item = &BenchmarkId> {
        self.compared.iter().map(|(_, id)| id)
    }
}
