//! How long a benchmark may be silent: silence is not safety.

use crate::reading::Timestamp;
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Spacings remembered.
const REMEMBERED: usize = 9;
/// A benchmark may skip this many of its usual readings.
const MAY_SKIP: i32 = 4;
/// No benchmark is called silent within this time.
const LEAST: SignedDuration = SignedDuration::from_mins(30);

/// Watches the spacing of one benchmark's readings.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Silence {
    newest: Option<Timestamp>,
    spacings: VecDeque<SignedDuration>,
    silent: bool,
}

impl Silence {
    /// Notes a reading; when it ends a silence, the reading before which that one began.
    pub(super) fn broken_by(&mut self, time: Timestamp) -> Option<Timestamp> {
        if let Some(newest) = self.newest
            && time > newest
        {
            self.spacings.push_back(time.duration_since(newest));
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
        let before = self.newest.replace(time);
        before.filter(|_| std::mem::take(&mut self.silent))
    }

    /// Notes a reading during maintenance: it ends no silence.
    pub(super) fn goes_on(&mut self, time: Timestamp) {
        if !self.silent {
            self.newest = self.newest.max(Some(time));
        }
    }

    /// When the last reading was.
    pub(super) fn newest(&self) -> Option<Timestamp> {
        self.newest
    }

    /// When silence becomes a fault; `None` while the usual spacing is unknown, or when it already is one.
    pub(super) fn deadline(&self) -> Option<Timestamp> {
        if self.silent || self.spacings.len() < 3 {
            return None;
        }
        let mut sorted: Vec<SignedDuration> = self.spacings.iter().copied().collect();
        sorted.sort_unstable();
        let allowed = sorted[sorted.len() / 2].checked_mul(MAY_SKIP)?.max(LEAST);
        // The longest gap seen lately is no silence either.
        self.newest?.checked_add(allowed.max(*sorted.last()?)).ok()
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
