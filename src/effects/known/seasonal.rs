//! The year in the load.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, SearchedRecord, Trying};
use crate::reading::DAYS_PER_YEAR;

/// A year and half a year, days.
pub(super) const YEARLY: [f64; 2] = [DAYS_PER_YEAR, 0.5 * DAYS_PER_YEAR];

pub(in crate::effects) static SEASONAL: EffectDefinition = EffectDefinition {
    name: "seasonal",
    what: "Harmonics of one year in the log-load.",
    title: "a load that comes and goes with the year",
    trying: Trying::AllAlong(acts),
    wave_periods: &YEARLY,
    size: |fitted| EffectSize::of_waves(fitted, &YEARLY),
    ..EffectDefinition::PLAIN
};

/// One wave and two, where two cycles have been seen.
fn acts(record: &SearchedRecord) -> Vec<Act> {
    if !record.shows_the_year() {
        return Vec::new();
    }
    vec![record.waves(&YEARLY[..1]), record.waves(&YEARLY)]
}
