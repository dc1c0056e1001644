//! What a channel measures, as far as that bears on what may be wrong with it.

use super::trace::Trace;
use crate::reading::Channel;

/// Zeros beyond this share are dry spells, whatever the channel is called.
const DRY_SHARE: f64 = 0.3;
/// Where more values than this stand outside the bounds, the channel counts in another way.
const OTHER_CONVENTION: f64 = 0.1;

/// What a channel measures.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Nature {
    /// Comes and goes, never below zero: rain, snow.
    Rain,
    /// A discharge: peaks are its way.
    Flow,
    /// A share of a hundred.
    Humidity,
    /// In degrees Celsius.
    Celsius,
    /// In degrees Fahrenheit.
    Fahrenheit,
    /// Anything else: levels, pressures, tilts.
    Other,
}

impl Nature {
    /// By its name and unit, and rain also by its dry spells.
    pub(super) fn of(channel: &Channel) -> Self {
        let name = channel.name.to_ascii_lowercase();
        let unit = channel.unit.as_deref().unwrap_or("").to_ascii_lowercase();
        let says = |words: &[&str]| words.iter().any(|word| name.contains(word));
        if says(&["rain", "precip", "snowfall"]) || is_dry(channel) {
            Self::Rain
        } else if ["m3_s", "m3_per_s", "l_s", "l_per_s", "cfs"].contains(&unit.as_str())
            || says(&["flow", "discharge", "runoff"])
        {
            Self::Flow
        } else if says(&["humid"]) {
            Self::Humidity
        } else if ["c", "degc", "deg_c"].contains(&unit.as_str()) {
            Self::Celsius
        } else if ["f", "degf", "deg_f"].contains(&unit.as_str()) {
            Self::Fahrenheit
        } else {
            Self::Other
        }
    }

    /// Whether one value far above all its neighbours is weather and no fault.
    pub(super) fn has_peaks(self) -> bool {
        matches!(self, Self::Rain | Self::Flow)
    }

    /// What the values may be, both ends included. Humidity has the slack that sensors need.
    fn bounds(self) -> (f64, f64) {
        match self {
            Self::Rain | Self::Flow => (0.0, f64::INFINITY),
            Self::Humidity => (-2.0, 105.0),
            Self::Celsius => (-90.0, 100.0),
            Self::Fahrenheit => (-130.0, 212.0),
            Self::Other => (f64::NEG_INFINITY, f64::INFINITY),
        }
    }

    /// Which values cannot be. None where many are so: a tidal river flows backwards too.
    pub(super) fn impossible(self, trace: &Trace) -> Vec<bool> {
        let (low, high) = self.bounds();
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
