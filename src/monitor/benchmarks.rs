//! The benchmarks that have given readings: what is known of each, what is in force, when each is due, and what is to be saved.

use super::Input;
use super::deadlines::Deadlines;
use super::event::{Event, EventKind};
use super::in_force::LevelsInForce;
use super::track::Track;
use crate::reading::{BenchmarkId, Timestamp};
use std::collections::{BTreeMap, BTreeSet};

/// The tracks, with what follows from them.
#[derive(Debug, Default)]
pub(super) struct Benchmarks {
    tracks: BTreeMap<BenchmarkId, Track>,
    /// Whose memory is another than when it was last saved.
    changed: BTreeSet<BenchmarkId>,
    /// When each becomes silent, or red without a reading, of those that are not yet.
    deadlines: Deadlines,
    in_force: LevelsInForce,
}

impl Benchmarks {
    /// Those that were saved.
    pub(super) fn restored(tracks: BTreeMap<BenchmarkId, Track>) -> Self {
        let mut deadlines = Deadlines::default();
        for (id, track) in &tracks {
            deadlines.set(id, track.deadline());
        }
        Self {
            in_force: LevelsInForce::of(&tracks),
            tracks,
            changed: BTreeSet::new(),
            deadlines,
        }
    }

    pub(super) fn all(&self) -> &BTreeMap<BenchmarkId, Track> {
        &self.tracks
    }

    pub(super) fn get(&self, id: &BenchmarkId) -> Option<&Track> {
        self.tracks.get(id)
    }

    pub(super) fn get_mut(&mut self, id: &BenchmarkId) -> Option<&mut Track> {
        self.tracks.get_mut(id)
    }

    pub(super) fn each_mut(&mut self) -> impl Iterator<Item = (&BenchmarkId, &mut Track)> {
        self.tracks.iter_mut()
    }

    /// The track of this benchmark; a `new` one with its first reading.
    pub(super) fn get_or_begin(
        &mut self,
        id: &BenchmarkId,
        new: impl FnOnce() -> Track,
    ) -> &mut Track {
        self.tracks.entry(id.clone()).or_insert_with(new)
    }

    pub(super) fn remove(&mut self, id: &BenchmarkId) -> Option<Track> {
        self.tracks.remove(id)
    }

    /// What is known of a benchmark is other than before: it is to be saved, and may be due at another time.
    pub(super) fn note_changed(&mut self, id: &BenchmarkId) {
        let due = self.get(id).and_then(Track::deadline);
        self.deadlines.set(id, due);
        if !self.changed.contains(id) {
            self.changed.insert(id.clone());
        }
    }

    /// Those that have changed since they were last saved; without a track where it is no longer known.
    pub(super) fn changed(&self) -> impl Iterator<Item = (&BenchmarkId, Option<&Track>)> {
        self.changed.iter().map(|id| (id, self.get(id)))
    }

    /// All that has changed is saved.
    pub(super) fn mark_saved(&mut self) {
        self.changed.clear();
    }

    /// Those to be judged at `now` although no reading comes, by name.
    pub(super) fn due(&self, now: Timestamp) -> BTreeSet<BenchmarkId> {
        self.deadlines.due(now)
    }

    /// The next time at which one is to be judged.
    pub(super) fn next_deadline(&self) -> Option<Timestamp> {
        self.deadlines.next()
    }

    /// The levels in force, as of the newest events.
    pub(super) fn in_force(&self) -> &LevelsInForce {
        &self.in_force
    }

    /// What `input` has led to: of one benchmark the events name it, else every one may have changed.
    pub(super) fn note_levels(&mut self, input: &Input, events: &[Event]) {
        match input {
            Input::Settings(_) => self.in_force = LevelsInForce::of(&self.tracks),
            Input::Notice(_) | Input::Order(_) if !events.is_empty() => {
                self.in_force = LevelsInForce::of(&self.tracks);
            }
            Input::Reading { .. }
            | Input::Missing { .. }
            | Input::Trouble { .. }
            | Input::Sample { .. }
            | Input::Found(_)
            | Input::Notice(_)
            | Input::Order(_)
            | Input::Tick => {
                let is_of_level = |event: &&Event| {
                    matches!(
                        event.kind,
                        EventKind::Alert { .. } | EventKind::Refit { .. }
                    )
                };
                for event in events.iter().filter(is_of_level) {
                    if let Some(id) = &event.benchmark {
                        self.in_force.note(id, self.tracks.get(id));
                    }
                }
            }
        }
        debug_assert!(self.in_force.is_true(&self.tracks), "{input:?} {events:?}");
    }
}
