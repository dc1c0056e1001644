//! The year in the reading: satellite receivers, mounts and the air come and go with it, and the ground does not.

use super::seasonal::YEARLY;
use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, LiesIn, SearchedRecord, Trying};
use crate::reading::Quantity;

pub(in crate::effects) static SEASONAL_READING: EffectDefinition = EffectDefinition {
    name: "seasonal-reading",
    what: "Harmonics of one year in the reading: an instrument or its mount, or the air, that comes and goes with the year.",
    title: "readings that come and go with the year",
    trying: Trying::AllAlong(acts),
    lies_in: LiesIn::Reading,
    wave_periods: &YEARLY,
    size: |fitted| {
        let waves = EffectSize::of_waves(fitted, &YEARLY);
        let size = waves.size.map(|size| size / fitted.unit.factor());
        EffectSize {
            size,
            unit: Some(fitted.unit.to_string()),
            ..waves
        }
    },
    ..EffectDefinition::PLAIN
};

/// As of the load; of displacements only, because the errors of velocities that are taken from them are smaller than the other errors of these.
fn acts(record: &SearchedRecord) -> Vec<Act> {
    if record.quantity == Quantity::Velocity || !record.shows_the_year() {
        return Vec::new();
    }
    vec![
        record.waves_in_reading(&YEARLY[..1]),
        record.waves_in_reading(&YEARLY),
    ]
}
