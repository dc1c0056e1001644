//! An alert that people end: they know why it was called, and that it is over.

use super::Alarm;
use crate::alert::Level;
use crate::monitor::event::{AlertState, Event, EventKind};
use crate::monitor::given::Given;
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::Timestamp;

/// The rule of an alert that people have ended.
const BY_PEOPLE: &str = "resolved-by-people";

impl Alarm {
    /// Ends the level in force. What is known of the slope stays, so that the next reading calls the level again, as a new
    /// alert, if it still calls for it. What cannot be said (`unknown`) is no level and stays, and so does a level that was
    /// called after the order was given.
    pub(in crate::monitor::track) fn resolve(
        &mut self,
        record: &BenchmarkRecord,
        now: Timestamp,
        given: &Given,
    ) -> Option<Event> {
        let (level, since) = self.latch.in_force()?;
        let key = record.alert_key(level, since);
        if given.called_since.contains(&key) {
            return None;
        }
        self.latch.resolve(now);
        self.levels.note(now, &self.latch);
        if level == Level::Red {
            self.levels.void();
        }
        (self.attention_until, self.kept, self.overdue) = (None, None, None);
        self.occurrences.end();
        let by = given.by.as_deref().unwrap_or("somebody");
        let why = (given.why.as_ref()).map_or_else(String::new, |why| format!(": {why}"));
        let text = format!(
            "benchmark {}: {level} ends ({BY_PEOPLE}); resolved by {by}{why}; the next reading calls it again if it still \
             calls for it",
            record.benchmark()
        );
        let kind = EventKind::Alert {
            level,
            state: AlertState::Resolved,
            key,
            rule: BY_PEOPLE.to_owned(),
            text,
        };
        Some(record.event(now, kind))
    }
}
