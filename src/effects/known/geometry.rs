//! Motion that slows itself by its slip.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, Support, Trying};

pub(in crate::effects) static GEOMETRY: EffectDefinition = EffectDefinition {
    name: "geometry",
    what: "The load falls with the slip: the slope flattens under the block.",
    title: "a load that falls with the slip (the slope flattens under the block)",
    trying: Trying::AllAlong(|_| vec![Act::PerSlip]),
    support: Support::Nothing,
    size: |fitted| {
        let slip_mm = fitted.typical_mm_per_day * fitted.span_days;
        EffectSize::measured(fitted.first() / slip_mm, "1/mm")
    },
    ..EffectDefinition::PLAIN
};
