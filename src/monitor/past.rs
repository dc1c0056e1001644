//! A first start on a site's history, or on that of one benchmark: the readings are taken at once, what is current is judged, and
//! the refits of the past are made after it, a few at a time.

use super::Input;
use super::Monitor;
use super::batches::count_refits;
use super::event::{Event, EventKind, since_by_key};
use super::notice::Notice;
use super::track::{PAST, PastReplay};
use crate::alert::Level;
use crate::reading::{BenchmarkId, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// Benchmarks that one [`Notice::Current`] judges at most, and refits that it makes.
const AT_ONCE: usize = 2048;
const MOST_REFITS: usize = 16;

/// What of the past is still to be done.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Past {
    /// The past is being read: readings are taken, and none is judged.
    is_open: bool,
    /// The same, of these benchmarks alone.
    #[serde(default, skip_serializing_if = "BTreeSet::is_empty")]
    of: BTreeSet<BenchmarkId>,
    /// Benchmarks whose newest reading is still to be judged.
    current: BTreeSet<BenchmarkId>,
    /// Those whose past is still to be judged, and the reading that was judged first.
    owed: BTreeMap<BenchmarkId, Timestamp>,
    /// The one whose past is being judged; a part of the memory by itself.
    #[serde(skip)]
    walk: Option<PastReplay>,
}

impl Past {
    /// Whether the past of all is being read.
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    /// From here on the past is read that `notice` says.
    pub(super) fn open(&mut self, notice: &Notice) {
        if let Notice::PastOf(benchmark) = notice {
            self.of.insert(benchmark.clone());
        } else {
            self.is_open = true;
        }
    }

    /// Whether the past of this benchmark is being read.
    pub(super) fn is_open_of(&self, benchmark: &BenchmarkId) -> bool {
        self.is_open || self.of.contains(benchmark)
    }

    pub(super) fn forget(&mut self, benchmark: &BenchmarkId) {
        self.of.remove(benchmark);
        self.current.remove(benchmark);
        self.owed.remove(benchmark);
        self.walk.take_if(|walk| walk.benchmark() == benchmark);
    }

    /// A reading of `benchmark`, of `time`, has been taken.
    pub(super) fn note(&mut self, benchmark: &BenchmarkId, time: Timestamp) {
        if let Some(walk) = &mut self.walk
            && walk.benchmark() == benchmark
        {
            walk.note(time);
        }
    }

    /// The past that is being judged.
    pub(super) fn walk(&self) -> Option<&PastReplay> {
        self.walk.as_ref()
    }

    /// The same, with this past being judged.
    pub(super) fn with_walk(self, walk: Option<PastReplay>) -> Self {
        Self { walk, ..self }
    }
}

impl Input {
    /// Whether an event that followed from this says what would have been said in the past: it changes nothing of the
    /// present, and nobody is notified.
    pub fn makes_up(&self, event: &Event) -> bool {
        let is_past = if let EventKind::Alert { level, rule, .. } = &event.kind {
            // The site's level follows from those of its benchmarks that are in force now, however they were called.
            *level != Level::Unknown && rule != PAST && event.benchmark.is_some()
        } else {
            matches!(event.kind, EventKind::Refit { .. }) || event.kind.is_of_the_record()
        };
        matches!(self, Self::Notice(Notice::Retrace)) && is_past
    }
}

impl Event {
    /// Since when the level is in force that it calls: one that was found in the past is since then, by its key.
    pub fn in_force_since(&self) -> Timestamp {
        let EventKind::Alert { key, rule, .. } = &self.kind else {
            return self.time;
        };
        let since = since_by_key(key).filter(|_| rule == PAST);
        since.unwrap_or(self.time)
    }
}

impl Monitor {
    /// Whether readings of some benchmark are taken without being judged, until [`Notice::Current`] says that the past has been
    /// read.
    pub fn reads_past(&self) -> bool {
        self.past.is_open || !self.past.of.is_empty()
    }

    /// Whether those of all benchmarks are.
    pub fn reads_all_past(&self) -> bool {
        self.past.is_open
    }

    /// The benchmarks of which the past alone is being read, where it is not that of all.
    pub fn past_is_read_of(&self) -> impl Iterator<Item = &BenchmarkId> {
        self.past.of.iter()
    }

    /// Whether there are benchmarks whose newest reading [`Notice::Current`] is to judge.
    pub fn owes_current(&self) -> bool {
        self.reads_past() || !self.past.current.is_empty()
    }

    /// Whether there are benchmarks whose past [`Notice::Retrace`] is to go through.
    pub fn owes_past(&self) -> bool {
        self.past.walk.is_some() || !self.past.owed.is_empty()
    }

    /// The past has been read: judges the newest reading of the next benchmarks.
    pub(super) fn judge_current(&mut self, now: Timestamp) -> Vec<Event> {
        if std::mem::take(&mut self.past.is_open) {
            self.past.current = self.benchmarks.all().keys().cloned().collect();
        }
        let read = std::mem::take(&mut self.past.of);
        self.past.current.extend(read);
        let (mut events, mut refits) = (Vec::new(), 0);
        for _ in 0..AT_ONCE {
            if refits >= MOST_REFITS {
                break;
            }
            let Some(id) = self.past.current.pop_first() else {
                break;
            };
            let mut newest = None;
            let judged = self.judged(&id, now, |track, policy, context| {
                newest = track.newest();
                let judge = |newest| track.judge_now(policy, newest, context);
                newest.map_or_else(Vec::new, judge)
            });
            refits += count_refits(&judged);
            events.extend(judged);
            if let Some(newest) = newest {
                self.past.owed.insert(id, newest);
            }
        }
        events
    }

    /// Goes on through the past of a benchmark.
    pub(super) fn retrace(&mut self, now: Timestamp) -> Vec<Event> {
        if self.past.walk.is_none()
            && let Some((id, until)) = self.past.owed.pop_first()
        {
            self.past.walk = self.benchmarks.get(&id).map(|track| track.past(until));
        }
        let Some(mut walk) = self.past.walk.take() else {
            return Vec::new();
        };
        let id = walk.benchmark().clone();
        let Some((track, policy, mut context)) = self.track_at(&id, now) else {
            return Vec::new();
        };
        (context.phase.is_past, context.phase.is_queue) = (false, false);
        let (mut events, has_more) = track.walk(&mut walk, policy, &context);
        if has_more {
            self.past.walk = Some(walk);
        } else {
            events.extend(track.go_on_from(policy, now, walk));
            self.benchmarks.note_changed(&id);
        }
        events
    }
}
