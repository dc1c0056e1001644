//! What a channel measures, as far as that bears on what may be wrong with it.

use super::trace::Trace;
use crate::reading::{Channel, CovariateKind};

/// Zeros beyond this share are dry spells, whatever the channel is called.
const DRY_SHARE: f64 = 0.3;
/// Where more values than this stand outside the bounds, the channel counts in another way.
const OTHER_CONVENTION: f64 = 0.1;

/// What a channel measures, and what its values may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nature {
    kind: CovariateKind,
    /// The least and the greatest that can be.
    bounds: (f64, f64),
}

impl Nature {
    /// As its channel says, and where nobody states it rain also by its dry spells.
    pub(super) fn of(channel: &Channel) -> Self {
        let kind = match channel.stated {
            None if is_dry(channel) => CovariateKind::Rain,
            None | Some(_) => channel.kind(),
        };
        Self {
            kind,
            bounds: kind.bounds(channel.unit.as_deref()),
        }
    }

    /// Whether it stands at zero for long, and means it.
    pub(super) fn is_rain(self) -> bool {
        self.kind == CovariateKind::Rain
    }

    /// Whether one value far above all its neighbours is weather and no fault.
    pub(super) fn has_peaks(self) -> bool {
        matches!(self.kind, CovariateKind::Rain | CovariateKind::Flow)
    }

    /// Which values cannot be. None where many are so: a tidal river flows backwards too.
    pub(super) fn impossible(self, trace: &Trace) -> Vec<bool> {
        let (low, high) = self.bounds;
        let outside = |value: &f64| !(low..=high).contains(value);
        let wrong: Vec<bool> = trace.values.iter().map(outside).collect();
        let count = wrong.iter().filter(|wrong| **wrong).count();
        if count as f64 > OTHER_CONVENTION * trace.len() as f64 {
            return vec![false; trace.len()];
        }
        wrong
    }
}

fn is_dry(channel: &Channel) -> bool {
    let values = || channel.samples.iter().map(|sample| sample.value);
    let zeros = values().filter(|value| *value == 0.0).count();
    zeros as f64 > DRY_SHARE * channel.samples.len() as f64 && values().all(|value| value >= 0.0)
}
