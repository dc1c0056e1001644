//! What comes faster than it can be judged: many messages at once, which are a broker's backlog, and what files have got while the daemon was not
//! running (on a first start they belong to the past, later they are judged together), and the history of a benchmark that begins while others are watched.

use super::Site;
use crate::monitor::{Event, Input, Notice};
use crate::reading::Timestamp;
use crate::runtime::clock::Stopwatch;
use crate::runtime::tail::Arrival;
use jiff::SignedDuration;
use std::time::Duration;

/// So many messages within [`WINDOW`] come faster than each can be judged.
const MANY: usize = 100;
const WINDOW: Duration = Duration::from_secs(1);
/// However long messages come so fast, the past that came is judged after so long.
const LONGEST: Duration = Duration::from_secs(60);
/// So long a queue is judged while more come: as long as an alert that people are to be notified of at once may wait for
/// others.
const LONGEST_QUEUE: Duration = Duration::from_secs(2);
/// So many values that queued are judged sooner. In [`LONGEST_QUEUE`] some 100,000 are taken; each judgement in between refits
/// every benchmark once more.
const MOST_QUEUED: u64 = 131_072;

/// A benchmark whose first reading is older than this has a history.
const HISTORY: SignedDuration = SignedDuration::from_hours(24);

/// How fast messages came of late.
#[derive(Debug, Default)]
pub(super) struct MessageBurst {
    /// Since when they are counted, and how many came since then.
    counted: Option<(Stopwatch, usize)>,
    /// When so many came for the first time and for the last.
    came: Option<(Stopwatch, Stopwatch)>,
    /// Since when the past is being read without what is current being judged.
    reads_past: Option<Stopwatch>,
    /// Since when values queue, and how many had been taken then.
    queues: Option<(Stopwatch, u64)>,
}

impl Site {
    /// A message is about to be taken, and so many wait behind it.
    pub fn messages_come(&mut self, waiting: usize) {
        let now = Stopwatch::start();
        let counted = self.burst.counted;
        let (since, before) = counted
            .filter(|(since, _)| since.elapsed() <= WINDOW)
            .unwrap_or((now, 0));
        let count = before + 1;
        self.burst.counted = Some((since, count));
        if count + waiting >= MANY {
            let first = self.burst.came.map_or(now, |(first, _)| first);
            self.burst.came = Some((first, now));
        }
    }

    /// Where messages come faster than they can be judged, what they hold from here on is judged at [`Site::end_batch`].
    pub fn queue(&mut self) {
        if self.is_burst() {
            self.begin_queue();
        }
    }

    /// So many values of files have come together while the daemon was not running: where they are many, they are judged at [`Site::end_batch`].
    pub fn queue_backlog(&mut self, values: usize) {
        if values >= MANY {
            self.begin_queue();
        }
    }

    fn begin_queue(&mut self) {
        if self.monitor.queues() || self.monitor.reads_all_past() {
            return;
        }
        self.burst.queues = Some((Stopwatch::start(), self.counts.taken));
        self.step(self.data_now(), &Input::Notice(Notice::Queue));
    }

    /// Whether values have queued and may queue further.
    pub fn may_queue_on(&self) -> bool {
        let queues = self.burst.queues.filter(|_| self.monitor.queues());
        queues.is_some_and(|(since, taken)| {
            since.elapsed() < LONGEST_QUEUE && self.counts.taken - taken < MOST_QUEUED
        })
    }

    fn is_burst(&self) -> bool {
        let came = self.burst.came;
        came.is_some_and(|(_, last)| last.elapsed() <= WINDOW)
    }

    /// While the past is still being read: judges what is current now and then, however long that takes.
    pub fn judge_meanwhile(&mut self) -> Vec<Event> {
        let mut events = Vec::new();
        if !self.monitor.reads_past() {
            self.burst.reads_past = None;
            return events;
        }
        let since = *self.burst.reads_past.get_or_insert_with(Stopwatch::start);
        if since.elapsed() < LONGEST {
            return events;
        }
        let of: Vec<_> = self.monitor.past_is_read_of().cloned().collect();
        let is_of_all = self.monitor.reads_all_past();
        while self.monitor.owes_current() {
            events.extend(self.judge_current());
        }
        self.burst.reads_past = None;
        let now = self.data_now();
        let again = if is_of_all {
            vec![Notice::Past]
        } else {
            of.into_iter().map(Notice::PastOf).collect()
        };
        for notice in again {
            self.step(now, &Input::Notice(notice));
        }
        events
    }

    /// The first reading of a benchmark that belongs to a history, or the first again: this is taken as on a first start, without the others, which
    /// are judged as before, having to wait until each of its readings has been judged.
    pub(super) fn begin_past(&mut self, arrival: &Arrival, host_time: Timestamp) {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return;
        };
        if self.sinks.store.is_none()
            || self.monitor.reads_all_past()
            || (self.monitor.level(benchmark).is_some() && !self.monitor.begins_anew(benchmark))
            || self.keeper.now(host_time).duration_since(arrival.time) <= HISTORY
        {
            return;
        }
        let notice = Notice::PastOf(benchmark.clone());
        self.step(self.data_now(), &Input::Notice(notice));
    }

    /// Whether more are to be expected at once.
    pub(super) fn is_short_burst(&self) -> bool {
        let came = self.burst.came;
        self.is_burst() && came.is_some_and(|(first, _)| first.elapsed() <= LONGEST)
    }
}
