//! Readings that lie ahead of the clock of a daemon that has just started: is the clock behind, or a logger ahead?
//!
//! A machine without a battery starts with the time at which it stopped. The newest reading that it knows is older
//! than that, so nothing proves the clock wrong; but the files go on beyond it. What goes on from known readings without a
//! leap is held until the past has been read. By then either some benchmark has shown that its readings end where the
//! clock is, or the clock is behind.

use super::Site;
use crate::monitor::Input;
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock::TOLERANCE;
use crate::runtime::log::is_logged;
use crate::runtime::tail::Arrival;
use jiff::SignedDuration;
use std::collections::BTreeMap;

/// So many readings of one benchmark ahead of the clock, each going on from the one before, are no slip.
const FEWEST: usize = 4;
/// A reading goes on from one that is no older than this.
const GOES_ON: SignedDuration = SignedDuration::from_hours(48);
/// A benchmark whose readings end so near before is evidence for the clock.
const NEAR: SignedDuration = SignedDuration::from_hours(6);

/// What came before the past had been read.
#[derive(Debug, Default)]
pub(in crate::runtime) struct Unproven {
    is_over: bool,
    /// The newest readings that came, by benchmark, as far as the clock allows them.
    came: BTreeMap<BenchmarkId, Timestamp>,
    /// The newest that lie ahead of the clock, and how many.
    ahead: BTreeMap<BenchmarkId, (Timestamp, usize)>,
}

impl Unproven {
    /// Whether the past has been read.
    pub(super) fn is_over(&self) -> bool {
        self.is_over
    }

    /// A reading was taken.
    pub(in crate::runtime) fn comes(&mut self, benchmark: &BenchmarkId, time: Timestamp) {
        if !self.is_over {
            let newest = self.came.entry(benchmark.clone()).or_insert(time);
            *newest = time.max(*newest);
        }
    }

    /// Whether a reading ahead of the clock goes on from what is known, as far as `newest`.
    pub(in crate::runtime) fn continues(
        &mut self,
        benchmark: &BenchmarkId,
        time: Timestamp,
        newest: Timestamp,
    ) -> bool {
        let (last, count) = self.ahead.get(benchmark).copied().unwrap_or((newest, 0));
        let continues = !self.is_over && time.duration_since(last) <= GOES_ON;
        if continues {
            let next = (time.max(last), count + 1);
            self.ahead.insert(benchmark.clone(), next);
        }
        continues
    }

    /// The past has been read: how late it is at least, where the clock is behind. `None` the next time.
    pub(in crate::runtime) fn proven(&mut self, host_time: Timestamp) -> Option<Timestamp> {
        let speaks_for_it = |(benchmark, newest): (&BenchmarkId, &Timestamp)| {
            !self.ahead.contains_key(benchmark) && host_time.duration_since(*newest) <= NEAR
        };
        let is_right = self.came.iter().any(speaks_for_it);
        let many = self.ahead.values().filter(|(_, count)| *count >= FEWEST);
        let latest = many.map(|(last, _)| *last).max();
        *self = Self {
            is_over: true,
            ..Self::default()
        };
        latest.filter(|_| !is_right)
    }
}

impl Site {
    /// Whether a value that lies ahead of the clock may be one that proves it wrong.
    pub(super) fn may_prove_it(&mut self, arrival: &Arrival) -> bool {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            // Rain and levels of lakes prove nothing, and are needed with the readings beside them.
            return matches!(arrival.input, Input::Sample { .. }) && !self.unproven.is_over();
        };
        let newest = self.read.newest(benchmark);
        newest.is_some_and(|newest| self.unproven.continues(benchmark, arrival.time, newest))
    }

    /// The past has been read: what lies ahead of the clock is held on where the clock is behind, and set aside else.
    pub(super) fn prove(&mut self, host_time: Timestamp) {
        let is_behind = self.keeper.is_behind(host_time);
        if let Some(latest) = self.unproven.proven(host_time) {
            tracing::warn!(%host_time, %latest, "readings go on beyond the host's clock: they count, and the clock does not");
            self.keeper.knows(latest, false);
            return;
        }
        if is_behind {
            return;
        }
        let (ahead, rest) = std::mem::take(&mut self.held)
            .into_iter()
            .partition(|one: &Arrival| one.time.duration_since(host_time) > TOLERANCE);
        self.held = rest;
        for arrival in ahead {
            self.set_aside(&arrival);
        }
    }

    /// It is from the future.
    pub(super) fn set_aside(&mut self, arrival: &Arrival) {
        self.counts.from_the_future += 1;
        let (time, total) = (arrival.time, self.counts.from_the_future);
        if is_logged(total) {
            tracing::warn!(%time, what = arrival.input.series_name(), total, "measured in the future: quarantined");
        }
    }
}
