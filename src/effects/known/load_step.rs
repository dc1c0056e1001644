//! A load that changes at once.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, SizeInWords, Support, Trying};

pub(in crate::effects) static LOAD_STEP: EffectDefinition = EffectDefinition {
    name: "load-step",
    what: "The log-load steps, and stays.",
    title: "a step of the load",
    size_in_words: SizeInWords::JumpOfVelocity,
    trying: Trying::Once(&[Act::Step]),
    support: Support::Nothing,
    size: |fitted| EffectSize::number(fitted.first()),
    ..EffectDefinition::PLAIN
};
