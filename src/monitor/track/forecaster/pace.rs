//! Which readings lead to a refit: by data time and the readings alone, so that a replay refits where the daemon did.

use super::Forecaster;
use crate::alert::Policy;
use crate::fit::Observations;
use crate::monitor::history::Taken;
use crate::reading::Timestamp;
use serde::{Deserialize, Serialize};

/// A record of no more readings than this is young: each of them leads to a refit.
const YOUNG: u64 = 1000;
/// An older one is refitted so many times an evacuation time, and in between where a reading was not predicted.
const REFITS_AN_EVACUATION: i32 = 96;

/// Where the last refits were.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Pace {
    /// The newest reading as of the last refit.
    newest: Option<Timestamp>,
    /// Since then: the reading in the past that last led to one.
    past: Option<Timestamp>,
}

impl Forecaster {
    /// Whether this reading, after which `observations` are those that count, leads to a refit; if not, it is part of the record
    /// that the next one rests on.
    pub(in crate::monitor::track) fn is_refit_due(
        &mut self,
        policy: &Policy,
        observations: &Observations,
        taken: Taken,
        time: Timestamp,
    ) -> bool {
        let is_young = self.watch.taken() <= YOUNG;
        if taken == Taken::Newest {
            let is_due = self.awaits_refit(policy, time, observations);
            if is_due {
                (self.pace.newest, self.pace.past) = (Some(time), None);
            }
            return is_due;
        }
        let is_due = is_young || is_far(policy, self.pace.past, time);
        if is_due {
            self.pace.past = Some(time);
        }
        is_due
    }

    /// Whether a newest reading of `time` leads to a refit, where `observations` end with it.
    pub(in crate::monitor::track) fn awaits_refit(
        &self,
        policy: &Policy,
        time: Timestamp,
        observations: &Observations,
    ) -> bool {
        self.watch.taken() <= YOUNG
            || is_far(policy, self.pace.newest, time)
            || !self.panel.predicts(observations)
    }
}

/// Whether the last refit is so far from `time` that the next one is due.
fn is_far(policy: &Policy, last: Option<Timestamp>, time: Timestamp) -> bool {
    let least = policy.evacuation_time / REFITS_AN_EVACUATION;
    last.is_none_or(|last| time.duration_since(last).abs() >= least)
}
