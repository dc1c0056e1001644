//! Which benchmarks are watched, and what becomes of them when the config says something else of them.

use super::event::Event;
use super::track::Track;
use super::{Monitor, Notice, trouble};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Stands before how the files of a source are written, in what decides which numbers its readings are.
pub(crate) const WRITTEN: &str = "; written ";

/// Whether readings mean the same now as `before`. Earlier versions did not keep how the files are written.
pub(crate) fn means_the_same(before: &str, now: &str) -> bool {
    let of_earlier_versions = now.split(WRITTEN).next();
    before == now || !before.contains(WRITTEN) && Some(before) == of_earlier_versions
}

/// The benchmarks that are watched.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Watched {
    /// Those that have a name in the config.
    pub named: BTreeSet<BenchmarkId>,
    /// Whether whatever else comes is watched too.
    pub is_open: bool,
    /// What decides which numbers the readings of each are; none in a state of older versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub read_as: BTreeMap<BenchmarkId, String>,
    /// The source that each named one is read from; none in a state of older versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub sources: BTreeMap<BenchmarkId, String>,
    /// The sources from which whatever comes is taken, and what decides which numbers that is; none in a state of older versions.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub open: BTreeMap<String, String>,
}

/// Whatever comes.
impl Default for Watched {
    fn default() -> Self {
        Self {
            named: BTreeSet::new(),
            is_open: true,
            read_as: BTreeMap::new(),
            sources: BTreeMap::new(),
            open: BTreeMap::new(),
        }
    }
}

impl Watched {
    /// Whether `benchmark` is watched where a source gives it.
    pub fn includes(&self, benchmark: &BenchmarkId) -> bool {
        self.is_open || self.named.contains(benchmark)
    }

    /// Whether `benchmark`, watched under `former`, no longer is: it was named and is not any more, or was not and
    /// nothing else than what is named is watched from now on, or nothing else of its source.
    fn drops(&self, benchmark: &BenchmarkId, former: &Self) -> bool {
        let was_named = former.named.contains(benchmark);
        if self.goes_on_unnamed(benchmark, former) {
            return false;
        }
        !self.named.contains(benchmark) && (was_named || !self.is_open)
    }

    /// Whether `benchmark` is read without a name as it was with one, from the same source.
    fn goes_on_unnamed(&self, benchmark: &BenchmarkId, former: &Self) -> bool {
        let source = former.sources.get(benchmark);
        let read_as = source.and_then(|source| self.open.get(source));
        let before = former.read_as.get(benchmark);
        read_as
            .zip(before)
            .is_some_and(|(now, before)| means_the_same(before, now))
    }

    /// What the readings of `benchmark` are read as, where that is something else than under `former`.
    fn changed(&self, benchmark: &BenchmarkId, former: &Self) -> Option<String> {
        let now = self.read_as.get(benchmark)?;
        let before = former.read_as.get(benchmark)?;
        let source = self.sources.get(benchmark);
        let former_source = former.sources.get(benchmark);
        match (source, former_source) {
            // Another instrument has another zero.
            (Some(source), Some(former)) if source != former => {
                Some(format!("source {source:?} {now}").trim_end().to_owned())
            }
            _ => (!means_the_same(before, now)).then(|| now.clone()),
        }
    }

    /// Whether what is known of `benchmark` ends when this follows on `former`.
    pub(crate) fn ends(&self, benchmark: &BenchmarkId, former: &Self) -> bool {
        self.drops(benchmark, former) || self.changed(benchmark, former).is_some()
    }
}

impl Monitor {
    /// Ends what is known of benchmarks that are no longer watched.
    pub(super) fn unwatch(&mut self, now: Timestamp, former: &Watched) -> Vec<Event> {
        let watched = &self.settings.watched;
        let dropped = |id: &&BenchmarkId| watched.drops(id, former);
        let gone: Vec<BenchmarkId> =
            (self.benchmarks.all().keys().filter(dropped).cloned()).collect();
        let mut events = Vec::new();
        let awaited = self.outages.awaited().map(|(id, _)| id.clone());
        let awaited: Vec<BenchmarkId> = awaited.collect();
        for id in awaited {
            if !self.settings.watched.named.contains(&id) {
                events.extend(self.outages.end_awaiting(now, &id, "is no longer watched"));
            }
        }
        for id in gone {
            self.anew.remove(&id);
            if let Some(mut track) = self.benchmarks.remove(&id) {
                let why = format!("benchmark {id} is no longer watched");
                events.extend(track.close(now, &why));
            }
            self.note_dropped(&id);
        }
        events
    }

    /// Benchmarks whose readings mean something else from here on. The sources give what the files hold anew; until the first of it
    /// comes, and none may where there is no file, what is known goes on to count.
    pub(super) fn reread(&mut self, now: Timestamp, former: &Watched) -> Vec<Event> {
        let watched = &self.settings.watched;
        let changed: Vec<(BenchmarkId, String)> = (self.benchmarks.all().keys())
            .filter_map(|id| {
                let read_as = watched.changed(id, former)?;
                let read_as = match read_as.trim_start_matches("; ") {
                    "" | "written as usual" => "the files themselves say",
                    read_as => read_as,
                };
                let why = format!(
                    "benchmark {id} is read as {read_as} from here on: its readings are read again; a level in force stays until \
                     they, or people, end it"
                );
                Some((id.clone(), why))
            })
            .collect();
        let mut events = Vec::new();
        for (id, why) in changed {
            events.push(Event {
                benchmark: Some(id.clone()),
                ..trouble(now, "read-anew", &why)
            });
            self.anew.insert(id, why);
        }
        events
    }

    /// What was known of `benchmark`, where this reading of it is the first that means something else, and why it does.
    pub(super) fn begin_anew(&mut self, benchmark: &BenchmarkId) -> Option<(Track, String)> {
        let why = self.anew.remove(benchmark)?;
        let former = self.benchmarks.remove(benchmark)?;
        let is_past = self.past.is_open_of(benchmark);
        // The key of an alert that stays in force must not change; one that begins later has another beginning.
        if former.level() == Level::Green {
            self.note_dropped(benchmark);
        } else {
            self.forget_work(benchmark);
        }
        if is_past {
            self.past.open(&Notice::PastOf(benchmark.clone()));
        }
        Some((former, why))
    }

    /// Whether the next reading of the benchmark is the first that means something else than those before.
    pub fn begins_anew(&self, benchmark: &BenchmarkId) -> bool {
        self.anew.contains_key(benchmark)
    }

    fn note_dropped(&mut self, id: &BenchmarkId) {
        let times = self.dropped.entry(id.clone()).or_default();
        *times = times.saturating_add(1);
        self.forget_work(id);
    }

    /// What is still to be done for `id` is not.
    fn forget_work(&mut self, id: &BenchmarkId) {
        self.searches.retain(|job| job.benchmark != *id);
        self.past.forget(id);
        self.batches.forget(id);
        self.benchmarks.note_changed(id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_loses_its_name_is_dropped_and_what_never_had_one_only_where_nothing_else_is_watched() {
        let five = BenchmarkId::new("5");
        let watched = |named: &[&str], is_open| Watched {
            named: named.iter().copied().map(BenchmarkId::new).collect(),
            is_open,
            ..Watched::default()
        };
        for (former, now, is_dropped) in [
            (watched(&["4", "5"], true), watched(&["4"], true), true),
            (watched(&["4"], true), watched(&["4"], true), false),
            (watched(&["4"], true), watched(&[], true), false),
            (watched(&["4"], true), watched(&["4"], false), true),
            (watched(&["4"], true), watched(&["5"], false), false),
            (Watched::default(), watched(&[], false), true),
        ] {
            assert_eq!(now.drops(&five, &former), is_dropped, "{former:?} {now:?}");
        }
    }

    #[test]
    fn without_its_name_one_goes_on_where_its_source_is_open_and_read_alike_and_another_source_is_another_instrument()
     {
        let five = BenchmarkId::new("5");
        let named = |source: &str, read_as: &str| Watched {
            named: BTreeSet::from([five.clone()]),
            read_as: BTreeMap::from([(five.clone(), read_as.to_owned())]),
            sources: BTreeMap::from([(five.clone(), source.to_owned())]),
            ..Watched::default()
        };
        let open = |source: &str, read_as: &str| Watched {
            open: BTreeMap::from([(source.to_owned(), read_as.to_owned())]),
            ..Watched::default()
        };
        let former = named("logger", "");
        for (now, is_dropped) in [
            (open("logger", ""), false),
            (open("logger", "time zone Europe/Rome"), true),
            (open("radio", ""), true),
        ] {
            assert_eq!(now.ends(&five, &former), is_dropped, "{now:?}");
        }
        assert!(open("logger", "").ends(&five, &named("logger", "unit m")));
        assert!(named("radio", "").ends(&five, &former));
        assert!(!named("logger", "").ends(&five, &former));
        // An older state does not say which source it was.
        let older = Watched {
            sources: BTreeMap::new(),
            ..former
        };
        assert!(!named("radio", "").ends(&five, &older));
    }
}
