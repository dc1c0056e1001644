//! The end of an explanation that finds noise alone.

use crate::effects::definition::{EffectDefinition, LiesIn};

pub(in crate::effects) static NONE: EffectDefinition = EffectDefinition {
    name: "none",
    what: "The residual cannot be distinguished from noise.",
    title: "noise",
    lies_in: LiesIn::Nothing,
    ..EffectDefinition::PLAIN
};
