//! Loggers whose clock is set back while the site is watched.

use super::Site;
use crate::monitor::{Event, Input, Notice};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::tail::Arrival;
use jiff::SignedDuration;
use std::collections::BTreeMap;

/// Readings that came so soon after they were measured agree with the host's clock, and one that is known lies ahead of it by more than this: together
/// they say that the clock of the logger was wrong, and not that of the host.
const SOON: SignedDuration = SignedDuration::from_mins(30);
const AHEAD: SignedDuration = SignedDuration::from_mins(10);
/// A clock may be read so much too early.
const BEFORE: SignedDuration = SignedDuration::from_mins(1);
/// So many in a row say so: one may come from a buffer.
const AGREEING: u32 = 3;

/// Of each benchmark, how many readings in a row agree with the host's clock though later ones are known, and the time of the last of
/// them. Each goes forward in time: of an upload whose newest reading comes first, each lies before the last.
pub(super) type Agreeing = BTreeMap<BenchmarkId, (u32, Timestamp)>;

impl Site {
    /// After a reading that was taken when the host's clock said `host_time`: where it is the third in a row that agrees with that clock, while readings are
    /// known that lie ahead of it, those are left out.
    pub(super) fn note_set_back(&mut self, arrival: &Arrival, host_time: Timestamp) -> Vec<Event> {
        let Input::Reading { benchmark, .. } = &arrival.input else {
            return Vec::new();
        };
        let newest = self.read.newest(benchmark);
        let lies_ahead = newest.is_some_and(|newest| newest.duration_since(host_time) > AHEAD);
        let since = host_time.duration_since(arrival.time);
        if self.sinks.store.is_none() || !lies_ahead || !(-BEFORE..=SOON).contains(&since) {
            self.agreeing.remove(benchmark);
            return Vec::new();
        }
        let (count, last) = (self.agreeing.entry(benchmark.clone())).or_insert((0, arrival.time));
        let goes_on = *count == 0 || arrival.time > *last;
        *count = if goes_on { count.saturating_add(1) } else { 1 };
        *last = arrival.time;
        if *count != AGREEING {
            return Vec::new();
        }
        let (benchmark, time) = (benchmark.clone(), arrival.time);
        self.step(
            self.data_now(),
            &Input::Notice(Notice::SetBack { benchmark, time }),
        )
    }
}
