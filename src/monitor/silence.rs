//! How long a benchmark may be silent: silence is not safety.

use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Spacings remembered.
const REMEMBERED: usize = 9;
/// A benchmark may skip this many of its usual readings.
const MAY_SKIP: i32 = 4;
/// A benchmark with a single reading is called silent after this time: it may be one that is read once a week.
const FIRST: SignedDuration = SignedDuration::from_hours(8 * 24);
/// No benchmark is called silent within this time.
const LEAST: SignedDuration = SignedDuration::from_mins(30);

/// Watches the spacing of one benchmark's readings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Silence {
    newest: Option<Timestamp>,
    spacings: VecDeque<SignedDuration>,
    silent: bool,
    /// What time it was when a reading came that was measured long before.
    #[serde(default)]
    behind: Option<Timestamp>,
}

impl Silence {
    /// Notes a reading; when it ends a silence, the reading before which that one began. One of a backlog, by which the
    /// benchmark would still be silent, ends none.
    pub(super) fn broken_by(&mut self, time: Timestamp) -> Option<Timestamp> {
        if let Some(newest) = self.newest
            && time > newest
        {
            // A silence says little of the usual spacing: after one of months the next would be reported months late. Where
            // the benchmark is read more seldom from now on, a few readings are enough to learn it.
            let spacing = time.duration_since(newest);
            let most = self
                .allowed()
                .and_then(|allowed| allowed.checked_mul(MAY_SKIP));
            let most = most.filter(|_| self.silent).unwrap_or(spacing);
            self.spacings.push_back(spacing.min(most));
            if self.spacings.len() > REMEMBERED {
                self.spacings.pop_front();
            }
        }
        self.broken_after_maintenance_by(time)
    }

    /// As [`Silence::broken_by`]; how long that took says nothing of the usual spacing.
    pub(super) fn broken_after_maintenance_by(&mut self, time: Timestamp) -> Option<Timestamp> {
        if self.newest.is_some_and(|newest| time <= newest) {
            return None;
        }
        let before = self.newest.replace(time).or(Some(time));
        if !self.silent || self.due().is_some_and(|due| Some(due) <= self.behind) {
            return None;
        }
        (self.silent, self.behind) = (false, None);
        before
    }

    /// The only reading does not count for now. A silence goes on, and ends with a reading as others do.
    pub(super) fn begin_again(&mut self) {
        self.spacings.clear();
        self.newest = None;
    }

    /// What time it was when a reading came that was measured long before; `None` where none has.
    pub(super) fn behind(&self) -> Option<Timestamp> {
        self.behind
    }

    /// What comes now was measured before `time`, which it is by the clock.
    pub(super) fn is_behind(&mut self, time: Timestamp) {
        self.behind = Some(time);
    }

    /// Whether it is silent.
    pub(super) fn is_silent(&self) -> bool {
        self.silent
    }

    /// The usual spacing as far as it is known: from two readings on.
    pub(super) fn median(&self) -> Option<SignedDuration> {
        let mut sorted: Vec<SignedDuration> = self.spacings.iter().copied().collect();
        sorted.sort_unstable();
        sorted.get(sorted.len() / 2).copied()
    }

    /// The longest of the spacings was none.
    pub(super) fn forget_gap(&mut self) {
        if let Some(longest) = self.spacings.iter().max().copied() {
            self.spacings.retain(|one| *one < longest);
        }
    }

    /// Notes a reading during maintenance: it ends no silence.
    pub(super) fn continues(&mut self, time: Timestamp) {
        if !self.silent {
            self.newest = self.newest.max(Some(time));
        }
    }

    /// When the last reading was.
    pub(super) fn newest(&self) -> Option<Timestamp> {
        self.newest
    }

    /// When silence becomes a fault; `None` when it already is one.
    pub(super) fn deadline(&self) -> Option<Timestamp> {
        if self.silent { None } else { self.due() }
    }

    fn due(&self) -> Option<Timestamp> {
        self.newest?.checked_add(self.allowed()?).ok()
    }

    /// For how long it may be silent.
    fn allowed(&self) -> Option<SignedDuration> {
        let longest = self.spacings.iter().max().copied();
        let allowed = match longest {
            None => FIRST,
            // Two or three readings say little of how often there are some.
            Some(longest) if self.spacings.len() < 3 => longest.checked_mul(MAY_SKIP)?,
            // The longest gap seen lately is no silence either.
            Some(longest) => self.median()?.checked_mul(MAY_SKIP)?.max(longest),
        };
        Some(allowed.max(LEAST))
    }

    /// Ends the silence that there is; the reading before which it began.
    pub(super) fn end(&mut self) -> Option<Timestamp> {
        self.newest.filter(|_| std::mem::take(&mut self.silent))
    }

    /// It is silent from now on; the time of the last reading.
    pub(super) fn begins(&mut self) -> Option<Timestamp> {
        self.silent = true;
        self.newest
    }
}
