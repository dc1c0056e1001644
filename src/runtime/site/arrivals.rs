//! What becomes of a value that arrives: it is taken, known already, held while the host's clock is wrong, or set aside.

use super::{BEFORE_ALL, MOST_UNWRITTEN, Site};
use crate::monitor::{Event, Input, Notice};
use crate::reading::{BenchmarkId, Timestamp, suspicion};
use crate::runtime::clock::{self, Stopwatch};
use crate::runtime::log::is_logged;
use crate::runtime::tail::Arrival;
use crate::runtime::workers::AllCores;
use crate::store::{Presence, StoreError};
use jiff::SignedDuration;
use std::time::Duration;

/// No clock is taken to be behind by more than this because a logger's time goes on steadily: that of a logger whose year is wrong does so too.
const MOST_BEHIND: SignedDuration = SignedDuration::from_hours(400 * 24);
/// The first day of 1970, UTC: where a logger starts whose clock is not set. No reading of a site that is watched now
/// was measured then; a replay of an archive takes it.
const CLOCKLESS: std::ops::Range<Timestamp> =
    Timestamp::UNIX_EPOCH..Timestamp::constant(24 * 60 * 60, 0);
/// A reading so near to the time at the site has not leapt ahead.
const NEAR: SignedDuration = SignedDuration::from_hours(24);
/// A reading that lies further behind is one of a backlog; how late that comes is noted again after this time.
const NOTED_FOR: SignedDuration = SignedDuration::from_mins(30);
/// For so long what came late waits at most until all that came with it has been read.
const LONGEST_BATCH: Duration = Duration::from_secs(60);
/// Calls of [`Site::judge_current`] before the first start counts as caught up; what is left is judged when nothing
/// else waits.
const MOST_JUDGED: usize = 8;

/// Why a daemon does not take a value, by its time alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(in crate::runtime) enum Untimely {
    /// It lies ahead of the clock.
    Future,
    /// Before 1678, where nothing was measured.
    BeforeAll,
    /// On the first day of 1970.
    WithoutClock,
}

/// Whether, and why, a value of `time` is not taken while it is `latest`.
pub(in crate::runtime) fn untimely(time: Timestamp, latest: Timestamp) -> Option<Untimely> {
    if time.duration_since(latest) > clock::TOLERANCE {
        Some(Untimely::Future)
    } else if time < BEFORE_ALL {
        Some(Untimely::BeforeAll)
    } else if CLOCKLESS.contains(&time) {
        Some(Untimely::WithoutClock)
    } else {
        None
    }
}

/// What to do where readings say that it is `now`, and the host's clock says `host_time`.
fn clock_wrong(now: Timestamp, host_time: Timestamp) -> String {
    let hint = suspicion::like_a_zone(now.duration_since(host_time));
    let hint = hint.map_or_else(String::new, |hint| {
        format!(". Or is the clock right? {hint}")
    });
    format!(
        "the host's clock says {host_time}, and there are readings of {now}: set it; what lies ahead of it waits{hint}"
    )
}

/// What to do where the host's clock says `host_time`, and it is `now` by the readings and the time that ran since.
fn clock_leapt(now: Timestamp, host_time: Timestamp) -> String {
    format!(
        "the host's clock says {host_time}, and by the newest readings and the time that ran since it is {now}: the host was suspended, \
         or its clock is wrong and has to be set. Until a reading agrees with it, silences are counted in the time that ran"
    )
}

impl Site {
    /// Takes one value. What was taken before, or lies ahead of the clock, changes nothing; while the host's clock is
    /// earlier than readings that are known, what lies ahead of it is held. A replay waits for the answer of a search
    /// that is due at a reading; a daemon takes it with the first reading after it has come.
    ///
    /// # Errors
    /// When the state cannot be asked whether the value is known.
    pub fn take(
        &mut self,
        arrival: &Arrival,
        host_time: Timestamp,
    ) -> Result<Vec<Event>, StoreError> {
        if matches!(arrival.input, Input::Trouble { .. }) {
            return Ok(self.step(self.data_now(), &arrival.input));
        }
        if let Input::Reading { benchmark, .. } = &arrival.input {
            self.waiting.remove_up_to(benchmark, arrival.time);
        }
        if self.is_set_aside(arrival, host_time) {
            return Ok(Vec::new());
        }
        let known = self.presence(arrival)?;
        if known == Presence::Corrected && self.returned.waits(arrival) {
            self.counts.repeated += 1;
            return Ok(Vec::new());
        }
        self.returned.comes(arrival);
        if known == Presence::Yes {
            self.counts.repeated += 1;
            return Ok(Vec::new());
        }
        Ok(self.take_new(arrival, host_time))
    }

    /// Computes what the first of `next` lead to on all cores; of how many of them, at least one. Changes no event: an arrival
    /// that leads to something else when it is taken is computed then.
    pub fn prepare<'a>(&mut self, next: impl IntoIterator<Item = &'a Arrival>) -> usize {
        let inputs = next.into_iter().map(|arrival| &arrival.input);
        self.monitor.prepare(inputs, &AllCores)
    }

    /// Takes a value that has not been taken, or is the last of its time again.
    pub(super) fn take_new(&mut self, arrival: &Arrival, host_time: Timestamp) -> Vec<Event> {
        self.counts.taken += 1;
        if let Some(now) = self.now
            && self.has_leapt(arrival, now, host_time)
        {
            return self.step(now, &arrival.input);
        }
        let mut events = self.doubt_first(arrival, host_time);
        self.keep_time(arrival, host_time);
        events.extend(self.pass_by(arrival.time, self.clock(host_time)));
        let now = self.now.map_or(arrival.time, |now| now.max(arrival.time));
        if let Input::Reading { benchmark, .. } = &arrival.input
            && let Some(finding) = self.answer(benchmark, arrival.time)
        {
            events.extend(self.step(now, &Input::Found(finding)));
        }
        self.begin_past(arrival, host_time);
        events.extend(self.step(now, &arrival.input));
        events.extend(self.compare_with_clock(arrival, now, host_time));
        events.extend(self.note_set_back(arrival, host_time));
        for job in self.monitor.searches() {
            self.searches.start(job);
        }
        events
    }

    /// What time it is at the site while the host's clock says `host_time`; a replay has no clock but its readings.
    fn clock(&self, host_time: Timestamp) -> Option<Timestamp> {
        let is_watched = self.sinks.store.is_some();
        is_watched.then(|| self.keeper.now(host_time))
    }

    fn answer(
        &mut self,
        benchmark: &BenchmarkId,
        time: Timestamp,
    ) -> Option<crate::monitor::SearchFinding> {
        if self.sinks.store.is_some() {
            self.searches.answered(benchmark, time)
        } else {
            self.searches.due(benchmark, time)
        }
    }

    /// Whether the value is not to be taken now: it is from the future, or no clock gives its time.
    fn is_set_aside(&mut self, arrival: &Arrival, host_time: Timestamp) -> bool {
        let latest = self.keeper.now(host_time).max(host_time);
        let Some(why) = untimely(arrival.time, latest) else {
            return false;
        };
        if why == Untimely::Future {
            if self.sinks.store.is_some()
                && (self.keeper.is_behind(host_time) || self.may_prove_it(arrival))
            {
                return self.hold(arrival, host_time);
            }
            self.set_aside(arrival);
            return true;
        }
        if self.sinks.store.is_none() {
            return false;
        }
        self.counts.without_clock += 1;
        let (time, total) = (arrival.time, self.counts.without_clock);
        if !is_logged(total) {
        } else if why == Untimely::BeforeAll {
            tracing::warn!(%time, what = arrival.input.series_name(), "measured before 1678: quarantined");
        } else {
            tracing::warn!(%time, what = arrival.input.series_name(), total, "measured on the first day of 1970, as by a logger whose clock is not set: quarantined");
        }
        true
    }

    /// Holds a value until the host's clock is right; `false` where the loggers' time has proved right by now.
    fn hold(&mut self, arrival: &Arrival, host_time: Timestamp) -> bool {
        if let Input::Reading { benchmark, .. } = &arrival.input
            && self.is_newest(arrival)
            && arrival.time.duration_since(self.keeper.now(host_time)) <= MOST_BEHIND
            && self.keeper.holds(benchmark.as_str(), arrival.time)
        {
            tracing::warn!(%benchmark, time = %arrival.time, "the loggers' time goes on steadily: it counts, and the host's clock does not");
            return false;
        }
        self.held.push_back(arrival.clone());
        true
    }

    /// Takes what was held, as far as the clock allows it by now.
    ///
    /// # Errors
    /// As [`Site::take`].
    pub fn release(&mut self, host_time: Timestamp) -> Result<Vec<Event>, StoreError> {
        let mut events = Vec::new();
        if self.held.is_empty() {
            return Ok(events);
        }
        // Where nothing more is taken in the past is never read to its end. What stands in the files comes by time: what is known by now decides.
        if self.holds_too_many() && !self.unproven.is_over() {
            self.prove(host_time);
        }
        let latest = self.keeper.now(host_time).max(host_time);
        let is_right = self.unproven.is_over() && !self.keeper.is_behind(host_time);
        for arrival in std::mem::take(&mut self.held) {
            if is_right || arrival.time.duration_since(latest) <= clock::TOLERANCE {
                events.extend(self.take(&arrival, host_time)?);
            } else {
                self.held.push_back(arrival);
            }
        }
        if self.held.is_empty() {
            self.keeper.releases();
        }
        Ok(events)
    }

    /// Values that wait, unacknowledged, for the clock.
    pub fn held(&self) -> usize {
        self.held.len()
    }

    /// Whether so many wait for the clock that nothing more is to be taken in.
    pub(super) fn holds_too_many(&self) -> bool {
        self.held.len() >= MOST_UNWRITTEN
    }

    /// Whether the time of a reading lies far ahead of everything that is known, and of the clock.
    fn has_leapt(&self, arrival: &Arrival, now: Timestamp, host_time: Timestamp) -> bool {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return false;
        };
        let is_near = |time: Timestamp| arrival.time.duration_since(time).abs() <= NEAR;
        self.sinks.store.is_some()
            && arrival.time > now
            && !is_near(now)
            && !is_near(self.keeper.now(host_time))
            && self.monitor.leaps(benchmark, arrival.time)
    }

    /// Has the only reading of a benchmark wait where this one, its second, lies far before it, and neither the time at the site
    /// nor another benchmark is near to the first: with one wrong time stamp all true readings would be late.
    fn doubt_first(&mut self, arrival: &Arrival, host_time: Timestamp) -> Vec<Event> {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return Vec::new();
        };
        let Some(now) = self.now.filter(|_| self.sinks.store.is_some()) else {
            return Vec::new();
        };
        let Some(first) = self.monitor.first_ahead_of(benchmark, arrival.time) else {
            return Vec::new();
        };
        let is_near = |time: Timestamp| first.duration_since(time).abs() <= NEAR;
        let is_other =
            |(one, newest): (&BenchmarkId, Timestamp)| one != benchmark && is_near(newest);
        if is_near(self.keeper.now(host_time)) || self.read.each().any(is_other) {
            return Vec::new();
        }
        let (benchmark, time) = (benchmark.clone(), arrival.time);
        self.step(now, &Input::Notice(Notice::FirstAhead { benchmark, time }))
    }

    /// Learns from a reading what time it is, and notes where it is one of a backlog.
    fn keep_time(&mut self, arrival: &Arrival, host_time: Timestamp) {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return;
        };
        if self.sinks.store.is_none() || !self.is_newest(arrival) {
            return;
        }
        self.unproven.comes(benchmark, arrival.time);
        let is_live = self.read.is_live(benchmark);
        self.keeper.knows(arrival.time, is_live);
        if is_live {
            self.keeper
                .comes(benchmark.as_str(), arrival.time, host_time);
        }
        let time = self.keeper.latest(host_time);
        let noted = self.monitor.behind(benchmark);
        let is_noted = noted.is_some_and(|noted| time.duration_since(noted).abs() < NOTED_FOR);
        let is_late = time.duration_since(arrival.time) > NOTED_FOR;
        // Where the time that was noted proves wrong, the reading is none of a backlog.
        let in_batches = self.monitor.comes_in_batches(benchmark);
        let is_news = !is_noted && (is_late || noted.is_some() || in_batches);
        if is_live && is_news && (in_batches || self.monitor.is_silent(benchmark)) {
            let benchmark = benchmark.clone();
            let now = self.now.map_or(arrival.time, |now| now.max(arrival.time));
            self.step(now, &Input::Notice(Notice::Behind { benchmark, time }));
        }
    }

    /// Notes where readings come with a time ahead of the host's clock, and where they no longer do.
    fn compare_with_clock(
        &mut self,
        arrival: &Arrival,
        now: Timestamp,
        host_time: Timestamp,
    ) -> Vec<Event> {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return Vec::new();
        };
        let is_newest = self.read.newest(benchmark) == Some(arrival.time);
        let clock = self.keeper.now(host_time).max(host_time);
        let is_ahead = suspicion::ahead(arrival.time, clock).is_some();
        if self.sinks.store.is_none() || !is_newest || is_ahead == self.monitor.is_ahead(benchmark)
        {
            return Vec::new();
        }
        let came = Notice::Came {
            benchmark: benchmark.clone(),
            time: arrival.time,
            clock,
        };
        self.step(now, &Input::Notice(came))
    }

    /// Whether nothing as late as this reading of its benchmark has been taken: it cannot be known then.
    pub(super) fn is_latest(&self, arrival: &Arrival) -> bool {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return false;
        };
        self.read.is_latest(benchmark, arrival.time)
    }

    /// Whether the benchmark has given no reading as late as this one, of those that do not wait for another one.
    fn is_newest(&self, arrival: &Arrival) -> bool {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return false;
        };
        self.read.is_newest(benchmark, arrival.time)
    }

    /// What the monitor is to know before anything arrives.
    pub fn begin(&mut self) {
        for (_, time) in self.read.each() {
            self.keeper.knows(time, false);
        }
        if !self.monitor.takes_batches() {
            self.step(self.data_now(), &Input::Notice(Notice::InBatches));
        }
        if self.read.count() == 0 && !self.monitor.reads_past() {
            self.step(self.data_now(), &Input::Notice(Notice::Past));
        }
    }

    /// Everything there is has been read: what comes from now on is live, and what has given no reading is unknown.
    pub(super) fn rest(&mut self, host_time: Timestamp) -> Vec<Event> {
        self.read.rest();
        self.prove(host_time);
        let mut events = Vec::new();
        // Before the first reading there is no past that could be over.
        let is_read = self.read.count() > 0 && !self.is_short_burst();
        for _ in 0..MOST_JUDGED {
            if is_read && self.monitor.owes_current() {
                events.extend(self.judge_current());
            }
        }
        if self.sinks.store.is_none() || !self.monitor.misses_some() {
            return events;
        }
        let now = self.now.unwrap_or_else(|| self.keeper.now(host_time));
        events.extend(self.step(now, &Input::Notice(Notice::Watching)));
        events
    }

    /// Judges the newest readings of benchmarks of which only the past has been read.
    pub(super) fn judge_current(&mut self) -> Vec<Event> {
        let now = self.data_now();
        let events = self.step(now, &Input::Notice(Notice::Current));
        for job in self.monitor.searches() {
            self.searches.start(job);
        }
        events
    }

    /// Lets data time pass, as far as time has passed at the site while the host's clock says `host_time`, and says where
    /// that clock is wrong.
    pub fn live(&mut self, host_time: Timestamp) -> Vec<Event> {
        let now = self.keeper.now(host_time);
        let mut events = self.pass_by(now, self.clock(host_time));
        if let Some(pause) = self.keeper.in_doubt(host_time) {
            events.extend(self.judge_by(host_time, pause));
        }
        events.extend(self.end_silences(now));
        let (is_behind, has_leapt) = (
            self.keeper.is_behind(host_time),
            self.keeper.has_leapt(host_time),
        );
        let notice = match (is_behind || has_leapt, self.monitor.clock_wrong()) {
            (true, None) => {
                let held = self.held.len();
                let text = if is_behind {
                    clock_wrong(now, host_time)
                } else {
                    clock_leapt(now, host_time)
                };
                tracing::error!(%host_time, site_time = %now, held, "{text}");
                Notice::ClockWrong { text }
            }
            (false, Some(_)) => {
                tracing::warn!(%host_time, "the host's clock is right again");
                let text = "the host's clock is right again".to_owned();
                Notice::ClockRight { text }
            }
            (true, Some(_)) | (false, None) => return events,
        };
        let now = self.now.unwrap_or(now);
        events.extend(self.step(now, &Input::Notice(notice)));
        events
    }

    /// Whether the host's clock is earlier than readings that are known.
    pub fn is_clock_wrong(&self) -> bool {
        self.monitor.clock_wrong().is_some()
    }

    /// A batch has been taken: judges what of it came late, once, and the next of what queued; to be repeated while [`Site::queues`]. Where it
    /// is not the last of what came together, what came late waits, a minute at most: until all of a file that was issued
    /// again has been read, its record is half as it was and half corrected.
    pub fn end_batch(&mut self, is_last: bool) -> Vec<Event> {
        let (comes_late, queues) = (self.monitor.late().is_some(), self.monitor.queues());
        let Some(now) = self.now.filter(|_| comes_late || queues) else {
            return Vec::new();
        };
        let waits = comes_late && !is_last && {
            let since = self.batch_goes_on.get_or_insert_with(Stopwatch::start);
            since.elapsed() < LONGEST_BATCH
        };
        if !waits {
            self.batch_goes_on = None;
        } else if !queues {
            return Vec::new();
        }
        self.monitor.prepare_queued(&AllCores);
        let notice = if waits {
            Notice::BatchGoesOn
        } else {
            Notice::BatchEnd
        };
        let events = self.step(now, &Input::Notice(notice));
        for job in self.monitor.searches() {
            self.searches.start(job);
        }
        events
    }

    /// Whether values that came faster than they can be judged are still to be.
    pub fn queues(&self) -> bool {
        self.monitor.queues()
    }

    /// Whether something is still to be looked back on: what came late, or the past before a first start.
    pub fn has_review_pending(&self) -> bool {
        let is_late = self.monitor.late().is_some() && self.batch_goes_on.is_none();
        is_late || self.owes_past()
    }

    /// Whether the past before a first start has been read and is still to be judged.
    pub fn owes_past(&self) -> bool {
        let owes_past = self.monitor.owes_current() || self.monitor.owes_past();
        owes_past && !self.monitor.reads_past()
    }

    /// Looks back on what came late at one benchmark, or goes on through the past. What follows for the present.
    pub fn look_back(&mut self) -> Vec<Event> {
        let Some(now) = self.now else {
            return Vec::new();
        };
        if let Some(benchmark) = self.monitor.late().cloned() {
            return self.step(now, &Input::Notice(Notice::LookBack(benchmark)));
        }
        if self.monitor.owes_current() {
            return self.judge_current();
        }
        let further = Input::Notice(Notice::Retrace);
        let mut events = self.step(now, &further);
        events.retain(|event| !further.makes_up(event));
        events
    }
}
