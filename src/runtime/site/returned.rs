//! Values that come again although another one of their time was taken after them.
//!
//! Either a file is read again from its start, which has the correction too, further on; or the value was corrected back.
//! Which of both it is shows when all that came together has been seen.

use super::Site;
use crate::monitor::{Event, Measured};
use crate::reading::{Quantity, Timestamp};
use crate::runtime::mqtt::ReceivedMessage;
use crate::runtime::tail::Arrival;
use crate::store::{Presence, StoreError};
use std::collections::BTreeMap;

/// So many wait at most; those beyond it count at once.
const MOST: usize = 10_000;

/// What a value is of, and when it was measured.
type ValueName = (String, Option<Quantity>, Timestamp);

/// The values that wait, by their place.
#[derive(Debug, Default)]
pub(super) struct Returned(BTreeMap<ValueName, Arrival>);

fn place(arrival: &Arrival) -> ValueName {
    let quantity = match arrival.input.measured() {
        Some(Measured::Reading { unit, .. }) => Some(unit.quantity()),
        Some(Measured::Sample { .. }) | None => None,
    };
    let name = arrival.input.series_name().to_owned();
    (name, quantity, arrival.time)
}

impl Returned {
    /// A value came whose correction is known; whether it waits.
    pub(super) fn waits(&mut self, arrival: &Arrival) -> bool {
        let has_room = self.0.len() < MOST;
        if has_room {
            self.0.insert(place(arrival), arrival.clone());
        }
        has_room
    }

    /// A value came that is the last of its time: whatever waited there has been corrected again.
    pub(super) fn comes(&mut self, arrival: &Arrival) {
        if !self.0.is_empty() {
            self.0.remove(&place(arrival));
        }
    }
}

impl Site {
    /// The values of a message that are to be taken: not those that have been corrected since the broker began to keep it for whoever
    /// subscribes.
    ///
    /// # Errors
    /// When the state cannot be asked whether a value is known.
    pub fn not_outdated<'a>(
        &mut self,
        message: &'a ReceivedMessage,
    ) -> Result<Vec<&'a Arrival>, StoreError> {
        let mut values = Vec::with_capacity(message.arrivals.len());
        for arrival in &message.arrivals {
            if message.is_retained && self.presence(arrival)? == Presence::Corrected {
                self.counts.repeated += 1;
            } else {
                values.push(arrival);
            }
        }
        Ok(values)
    }

    /// Whether a value of a time that is not the latest is known.
    pub(super) fn presence(&self, arrival: &Arrival) -> Result<Presence, StoreError> {
        match &self.sinks.store {
            Some(store) if !self.is_latest(arrival) => {
                let anew_after = self.read.anew_after(arrival.input.read_benchmark());
                store.has(&self.batch, &arrival.input, anew_after)
            }
            Some(_) | None => Ok(Presence::No),
        }
    }

    /// Whether it is still to be seen what some values are.
    pub fn is_undecided(&self) -> bool {
        !self.returned.0.is_empty()
    }

    /// All that came together has been seen: what is left was corrected back.
    pub fn decide(&mut self, host_time: Timestamp) -> Vec<Event> {
        let mut events = Vec::new();
        for arrival in std::mem::take(&mut self.returned.0).into_values() {
            self.counts.repeated = self.counts.repeated.saturating_sub(1);
            events.extend(self.take_new(&arrival, host_time));
        }
        events
    }
}
