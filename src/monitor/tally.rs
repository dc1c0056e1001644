//! What was taken in and said so far, and when the last of it was.

use super::event::{Event, EventKind, Summary};
use crate::reading::Timestamp;
use serde::{Deserialize, Serialize};

/// The counts, and the time of the last step.
#[derive(Debug, Default, Serialize, Deserialize)]
pub(super) struct Tally {
    summary: Summary,
    last_time: Option<Timestamp>,
}

impl Tally {
    /// A step is made at `now`.
    pub(super) fn begin_step(&mut self, now: Timestamp) {
        self.last_time = Some(now);
    }

    pub(super) fn count_reading(&mut self) {
        self.summary.readings += 1;
    }

    pub(super) fn count(&mut self, events: &[Event]) {
        for event in events {
            self.summary.count(event);
        }
    }

    /// When the last step was made.
    pub(super) fn last_time(&self) -> Option<Timestamp> {
        self.last_time
    }

    /// The last line of a replay; `None` before the first step.
    pub(super) fn event(&self) -> Option<Event> {
        Some(Event {
            time: self.last_time?,
            benchmark: None,
            kind: EventKind::Summary(self.summary),
        })
    }
}
