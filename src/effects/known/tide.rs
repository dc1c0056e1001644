//! The tide in the load.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, SearchedRecord, Support, Trying};

/// The tide's strongest periods, days: M2, S2, K1, O1.
const PERIODS: [f64; 4] = [
    12.420_6 / 24.0,
    12.0 / 24.0,
    23.934_5 / 24.0,
    25.819_3 / 24.0,
];

pub(in crate::effects) static TIDE: EffectDefinition = EffectDefinition {
    name: "tide",
    what: "Harmonics of the tide's periods in the log-load.",
    title: "tidal forcing",
    trying: Trying::AllAlong(acts),
    support: Support::Astronomy,
    // Nothing slow comes and goes with the moon.
    may_be_a_slow_load: false,
    wave_periods: &PERIODS,
    size: |fitted| EffectSize::of_waves(fitted, &PERIODS),
    ..EffectDefinition::PLAIN
};

/// The strongest alone, and all of them, where the sampling resolves the periods and the record distinguishes them.
fn acts(record: &SearchedRecord) -> Vec<Act> {
    if record.spacing_days > 0.2 || record.span_days < 2.0 {
        return Vec::new();
    }
    let mut acts = vec![record.waves(&PERIODS[..1])];
    if record.span_days > 14.0 {
        acts.push(record.waves(&PERIODS));
    }
    acts
}
