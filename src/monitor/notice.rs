//! What the runtime knows of the watch and of its clock: kept among the steps, so that a replay knows it too.

use super::Monitor;
use super::event::{AlertState, Event, EventKind};
use super::track::Track;
use crate::alert::Level;
use crate::reading::{BenchmarkId, Quantity, Timestamp};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The rule of the alert that says that the host's clock is wrong.
pub const CLOCK_FAULT: &str = "clock-fault";

/// Something that is no reading and concerns how the watch goes on.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Notice {
    /// The past has been read: a benchmark of the config that has given no reading is unknown from now on.
    Watching,
    /// The past is about to be read: readings are taken, and judged once it has been.
    Past,
    /// The same of this benchmark alone, of which nothing has been read, while others are watched already.
    PastOf(BenchmarkId),
    /// The past has been read: the newest readings of the next benchmarks are judged.
    Current,
    /// The past of a benchmark is judged a little further.
    Retrace,
    /// What came late or was corrected is judged only at [`Notice::BatchEnd`], and not reading by reading.
    #[serde(rename = "settles")]
    InBatches,
    /// Readings come faster than they can be judged one by one: each benchmark is judged for its newest at
    /// [`Notice::BatchEnd`], and at least once in an evacuation time of its readings where a forecast may call orange.
    Queue,
    /// Everything that came together has been taken: what came late is judged now, once, and so are the next of the
    /// benchmarks whose readings queued.
    #[serde(rename = "settle")]
    BatchEnd,
    /// More of what came together is still to be read: of what queued the benchmarks are judged of which nothing came late.
    BatchGoesOn,
    /// Whether late readings of this benchmark would have called another level is looked into now.
    LookBack(BenchmarkId),
    /// The readings of a silent benchmark that come now were measured long before `time`, which it is: a backlog.
    Behind {
        /// Whose.
        benchmark: BenchmarkId,
        /// What time it is.
        time: Timestamp,
    },
    /// A reading of this benchmark, of `time`, has been read by `until` and waits for earlier ones: its silence counts from there.
    Waits {
        /// Whose.
        benchmark: BenchmarkId,
        /// When it was measured.
        time: Timestamp,
        /// What time it is.
        until: Timestamp,
    },
    /// The only reading of this benchmark lies far ahead of the next one, of `time`, of the time that it is, and of all other
    /// benchmarks: it waits until another one confirms it.
    FirstAhead {
        /// Whose.
        benchmark: BenchmarkId,
        /// When the next reading was measured.
        time: Timestamp,
    },
    /// Readings of this benchmark, the last one of `time`, agree with the host's clock, and earlier ones of it lie ahead of that: the clock of their
    /// logger has been set back.
    SetBack {
        /// Whose.
        benchmark: BenchmarkId,
        /// When the last of those that agree was measured.
        time: Timestamp,
    },
    /// The newest reading of a benchmark, of `time`, came while the host's clock said `clock`: perhaps ahead of it.
    Came {
        /// Whose.
        benchmark: BenchmarkId,
        /// When it was measured.
        time: Timestamp,
        /// What the clock said.
        clock: Timestamp,
    },
    /// Time has passed as far as `until`, and data time lies ahead of that, by readings of a logger whose clock is ahead: which
    /// other benchmarks are silent goes by `until`.
    Passed {
        /// What time it is.
        until: Timestamp,
        /// Whether nothing else is judged than which benchmarks are silent.
        #[serde(default)]
        silences_alone: bool,
    },
    /// The host's clock is wrong: readings that are known lie after it, or it has gone ahead of the time that ran since.
    ClockWrong {
        /// One line for a person.
        text: String,
    },
    /// The host's clock is right again.
    ClockRight {
        /// One line for a person.
        text: String,
    },
}

impl Monitor {
    /// What `how` does with what is known of a benchmark, which is to be saved then; nothing without it.
    fn at_track(
        &mut self,
        benchmark: &BenchmarkId,
        how: impl FnOnce(&mut Track) -> Vec<Event>,
    ) -> Vec<Event> {
        let Some(track) = self.benchmarks.get_mut(benchmark) else {
            return Vec::new();
        };
        let events = how(track);
        self.benchmarks.note_changed(benchmark);
        events
    }

    pub(super) fn take_notice(&mut self, now: Timestamp, notice: &Notice) -> Vec<Event> {
        match notice {
            Notice::Watching => self.await_unread(now),
            Notice::InBatches => {
                self.batches.begin();
                Vec::new()
            }
            Notice::Past | Notice::PastOf(_) => {
                self.past.open(notice);
                Vec::new()
            }
            Notice::Current => self.judge_current(now),
            Notice::Retrace => self.retrace(now),
            Notice::Queue => {
                self.batches.open_queue();
                Vec::new()
            }
            Notice::BatchEnd => self.end_batch(now),
            Notice::BatchGoesOn => self.go_on_with_batch(now),
            Notice::LookBack(benchmark) => self.look_back(now, benchmark),
            Notice::Behind { benchmark, time } => self.at_track(benchmark, |track| {
                track.fall_behind(*time);
                Vec::new()
            }),
            Notice::Waits {
                benchmark,
                time,
                until,
            } => self.at_track(benchmark, |track| track.note_waiting(now, *time, *until)),
            Notice::FirstAhead { benchmark, time } => self.at_track(benchmark, |track| {
                track.put_first_aside(now, *time).into_iter().collect()
            }),
            Notice::SetBack { benchmark, time } => self.at_track(benchmark, |track| {
                track.leave_out_after(*time).into_iter().collect()
            }),
            Notice::Came {
                benchmark,
                time,
                clock,
            } => self.at_track(benchmark, |track| track.suspect_ahead(now, *time, *clock)),
            Notice::Passed {
                until,
                silences_alone,
            } => self.pass(now, *until, *silences_alone),
            Notice::ClockWrong { text } => {
                let since = self.outages.begin_clock_wrong(now);
                clock_fault(now, since, AlertState::Firing, text)
            }
            Notice::ClockRight { text } => self
                .outages
                .end_clock_wrong()
                .map_or_else(Vec::new, |since| {
                    clock_fault(now, since, AlertState::Resolved, text)
                }),
        }
    }

    fn await_unread(&mut self, now: Timestamp) -> Vec<Event> {
        let unread = self.never_read();
        let each = unread.iter().map(|id| self.outages.begin_awaiting(now, id));
        each.flatten().collect()
    }

    fn never_read(&self) -> Vec<BenchmarkId> {
        let named = self.settings.watched.named.iter();
        named
            .filter(|id| self.benchmarks.get(id).is_none())
            .cloned()
            .collect()
    }

    /// Whether benchmarks of the config have given no reading, and nobody has been notified.
    pub fn misses_some(&self) -> bool {
        let awaited: BTreeSet<&BenchmarkId> = self.outages.awaited().map(|(id, _)| id).collect();
        self.never_read().iter().any(|id| !awaited.contains(id))
    }

    /// Whether a reading of `time` lies so far after all others of its benchmark that its time may be wrong.
    pub fn leaps(&self, benchmark: &BenchmarkId, time: Timestamp) -> bool {
        let track = self.benchmarks.get(benchmark);
        track.is_some_and(|track| track.leaps(time))
    }

    /// When the only reading of a benchmark was measured, where one of `time`, which comes after it, lies far before it.
    pub fn first_ahead_of(&self, benchmark: &BenchmarkId, time: Timestamp) -> Option<Timestamp> {
        let track = self.benchmarks.get(benchmark)?;
        track.first_ahead_of(time)
    }

    /// What time it was when a reading of a silent benchmark came that was measured long before; `None` where none has.
    pub fn behind(&self, benchmark: &BenchmarkId) -> Option<Timestamp> {
        self.benchmarks.get(benchmark)?.behind()
    }

    /// Whether nothing can be said of a benchmark now: of one of the config also before its first reading.
    pub fn is_unknown(&self, benchmark: &BenchmarkId) -> bool {
        match self.benchmarks.get(benchmark) {
            Some(track) => track.is_unknown(),
            None => self.settings.watched.named.contains(benchmark),
        }
    }

    /// Whether a benchmark that has given readings is silent.
    pub fn is_silent(&self, benchmark: &BenchmarkId) -> bool {
        let track = self.benchmarks.get(benchmark);
        track.is_some_and(Track::is_silent)
    }

    /// Whether its readings come many together, long after they were measured.
    pub fn comes_in_batches(&self, benchmark: &BenchmarkId) -> bool {
        let track = self.benchmarks.get(benchmark);
        track.is_some_and(Track::comes_in_batches)
    }

    /// The benchmarks that are to be judged by `until` although no reading comes.
    pub fn due_by(&self, until: Timestamp) -> BTreeSet<BenchmarkId> {
        self.benchmarks.due(until)
    }

    /// Whether this is the quantity of the benchmark that is watched; also before its first reading.
    pub fn watches(&self, benchmark: &BenchmarkId, quantity: Quantity) -> bool {
        let track = self.benchmarks.get(benchmark);
        track.is_none_or(|track| track.quantity() == quantity)
    }

    /// When the newest reading of a benchmark was measured from which its silence counts, of those that wait for earlier ones too.
    pub fn counted_from(&self, benchmark: &BenchmarkId) -> Option<Timestamp> {
        self.benchmarks.get(benchmark)?.counted_from()
    }

    /// Whether the times of a benchmark's readings lie ahead of the clock.
    pub fn is_ahead(&self, benchmark: &BenchmarkId) -> bool {
        let track = self.benchmarks.get(benchmark);
        track.is_some_and(Track::is_ahead)
    }

    /// Since when the host's clock is wrong.
    pub fn clock_wrong(&self) -> Option<Timestamp> {
        self.outages.clock_wrong()
    }
}

/// That the clock is wrong since `since`, or no longer is.
fn clock_fault(time: Timestamp, since: Timestamp, state: AlertState, text: &str) -> Vec<Event> {
    let event = |kind| Event {
        time,
        kind,
        benchmark: None,
    };
    let alert = event(EventKind::Alert {
        level: Level::Unknown,
        state,
        key: format!("site/{}/clock/{since}", Level::Unknown),
        rule: CLOCK_FAULT.to_owned(),
        text: text.to_owned(),
    });
    let fault = event(EventKind::Fault {
        kind: CLOCK_FAULT.to_owned(),
        text: text.to_owned(),
    });
    match state {
        AlertState::Firing => vec![fault, alert],
        AlertState::Resolved => vec![alert],
    }
}
