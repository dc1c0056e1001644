//! Motion that slows itself by its velocity.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, Support, Trying};

pub(in crate::effects) static RATE_LIMIT: EffectDefinition = EffectDefinition {
    name: "rate-limit",
    what: "The load falls with the velocity: radiation damping, inertia.",
    title: "a load that falls with the velocity (damping or inertia)",
    trying: Trying::AllAlong(|_| vec![Act::PerVelocity]),
    support: Support::Nothing,
    size: |fitted| {
        EffectSize::measured(
            fitted.first().max(0.0) / fitted.typical_mm_per_day,
            "day/mm",
        )
    },
    ..EffectDefinition::PLAIN
};
