//! The effects that the law of one benchmark lacks: the search that is asked for, and what it came to.

use super::{StepContext, Track};
use crate::monitor::event::Event;
use crate::monitor::search::{SearchFinding, SearchJob};
use crate::reading::Timestamp;

impl Track {
    /// The search that is to be made after this reading, where one is.
    pub(in crate::monitor) fn search(
        &mut self,
        critical: f64,
        context: &StepContext<'_>,
    ) -> Option<SearchJob> {
        self.forecaster.search(&self.record, critical, context)
    }

    /// Takes what a search came to.
    pub(in crate::monitor) fn found(
        &mut self,
        critical: f64,
        time: Timestamp,
        finding: &SearchFinding,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let record = &self.record;
        (self.forecaster).found(record, critical, time, finding, context)
    }

    /// From here on levels go by the law without effects.
    pub(in crate::monitor) fn give_up_effects(&mut self, time: Timestamp) -> Vec<Event> {
        self.forecaster.give_up_effects(&self.record, time)
    }
}
