//! Contacts that are renewed, or shaken.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, EffectSize, SizeInWords, Support, Trying};

pub(in crate::effects) static STATE_RESET: EffectDefinition = EffectDefinition {
    name: "state-reset",
    what: "The contacts' state is multiplied by a factor: a new sliding surface, an earthquake.",
    title: "a reset of the contacts' state",
    size_in_words: SizeInWords::Behind(", by a factor of "),
    trying: Trying::Once(&[Act::Reset]),
    support: Support::Nothing,
    size: |fitted| EffectSize::number(fitted.first().exp()),
    ..EffectDefinition::PLAIN
};
