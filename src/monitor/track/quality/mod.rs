//! Whether what is read of a benchmark can be believed, and what makes it unknown where it cannot.

mod sensor;
mod suspicion;
mod unknown;

use super::record::BenchmarkRecord;
use crate::monitor::event::Event;
use crate::monitor::history::Taken;
use crate::reading::other_unit::OtherUnit;
use crate::reading::{Suspicion, Timestamp, whole_figure};
use serde::Serialize;
use std::collections::BTreeSet;
use unknown::Reason;

pub(super) use unknown::Unknown;

/// So many readings in a row with one value are a stuck sensor, or a resolution too coarse to show it.
const STUCK: usize = 24;

/// What the readings of one benchmark are worth.
#[derive(Debug, Default, Serialize)]
pub(super) struct DataQuality {
    /// What makes it unknown.
    unknown: Unknown,
    /// By how much its readings jump back and forth from one to the next, where they are spoilt.
    spoilt_by: Option<f64>,
    /// Readings of a second quantity in a row.
    others: u32,
    /// Whether a second quantity has been reported.
    #[serde(rename = "faulted")]
    is_second_reported: bool,
    /// Suspicions that people have looked into, and that do not hold.
    accepted: BTreeSet<Suspicion>,
    /// Since when its readings are in another unit than those before.
    #[serde(skip_serializing_if = "Option::is_none")]
    other_unit: Option<OtherUnit>,
}

impl DataQuality {
    pub(super) fn from_saved(
        unknown: Unknown,
        spoilt_by: Option<f64>,
        others: u32,
        is_second_reported: bool,
        accepted: BTreeSet<Suspicion>,
        other_unit: Option<OtherUnit>,
    ) -> Self {
        Self {
            unknown,
            spoilt_by,
            others,
            is_second_reported,
            accepted,
            other_unit,
        }
    }

    /// That of a benchmark of which nothing has been read, with the same accepted suspicions.
    pub(super) fn begun_again(&self) -> Self {
        Self {
            accepted: self.accepted.clone(),
            ..Self::default()
        }
    }

    /// Whether nothing can be said of the benchmark, though it may give readings.
    pub(super) fn is_unknown(&self) -> bool {
        self.unknown.is_in_force()
    }

    pub(super) fn is_stuck(&self) -> bool {
        self.unknown.has(Reason::Stuck)
    }

    /// Whether its times lie ahead of the clock.
    pub(super) fn is_ahead(&self) -> bool {
        self.unknown.has(Reason::Suspect(Suspicion::Ahead))
    }

    /// Whether the readings show how the slope moves: on others no level falls.
    pub(super) fn shows_motion(&self) -> bool {
        let says_nothing = [
            Reason::Spoilt,
            Reason::Suspect(Suspicion::Mark),
            Reason::Suspect(Suspicion::Fall),
        ];
        !self.is_in_other_unit() && !says_nothing.into_iter().any(|one| self.unknown.has(one))
    }

    /// Whether its readings are in another unit than those before, as enough of them show.
    pub(super) fn is_in_other_unit(&self) -> bool {
        let other = self.other_unit.as_ref();
        other.is_some_and(OtherUnit::is_confirmed)
    }

    /// Whether people have looked into this suspicion, and it does not hold.
    pub(super) fn is_accepted(&self, suspicion: Suspicion) -> bool {
        self.accepted.contains(&suspicion)
    }

    /// What is wrong with a reading, where something is.
    pub(super) fn complaint(
        &mut self,
        record: &BenchmarkRecord,
        taken: Taken,
        time: Timestamp,
    ) -> Option<Event> {
        let (benchmark, unit) = (record.benchmark(), record.unit());
        let (kind, text) = match taken {
            Taken::Newest if record.history().identical() == STUCK => {
                let text = format!("benchmark {benchmark}: {STUCK} readings in a row are the same");
                ("stuck", text)
            }
            Taken::Newest | Taken::Known => return None,
            Taken::Late => (
                "out-of-order",
                format!("the reading of {time} came after later ones"),
            ),
            Taken::Corrected(before) => {
                let text = format!(
                    "the reading of {time} was corrected; it was {} {unit}",
                    whole_figure(before)
                );
                ("corrected", text)
            }
            Taken::OutOfRange(value) => {
                let farthest = record.observations().quantity.farthest();
                let text = format!(
                    "the reading of {time} is {value:e} {unit}: beyond {farthest:e} {unit}, which no slope reaches; it is left out"
                );
                ("out-of-range", text)
            }
            Taken::OtherQuantity if self.is_second_reported => return None,
            Taken::OtherQuantity => {
                self.is_second_reported = true;
                let text = format!(
                    "benchmark {benchmark} gives a second quantity; only the first is monitored"
                );
                ("second-quantity", text)
            }
        };
        Some(record.fault(record.data_time(time), kind, text))
    }
}
