//! The year in the load.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, SearchedRecord, Trying};

/// One year, days.
const YEAR: f64 = 365.25;
/// A year and half a year, days.
const PERIODS: [f64; 2] = [YEAR, 0.5 * YEAR];

pub(in crate::effects) static SEASONAL: EffectDefinition = EffectDefinition {
    name: "seasonal",
    what: "Harmonics of one year in the log-load.",
    title: "a load that comes and goes with the year",
    trying: Trying::AllAlong(acts),
    wave_periods: &PERIODS,
    size: |fitted| EffectSize::of_waves(fitted, &PERIODS),
    ..EffectDefinition::PLAIN
};

/// One wave and two, where two cycles have been seen.
fn acts(record: &SearchedRecord) -> Vec<Act> {
    if record.span_days < 1.95 * YEAR || record.spacing_days > 0.2 * YEAR {
        return Vec::new();
    }
    vec![record.waves(&PERIODS[..1]), record.waves(&PERIODS)]
}
