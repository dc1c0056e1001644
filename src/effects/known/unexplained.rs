//! The end of an explanation that finds structure and no effect.

use crate::effects::definition::{EffectDefinition, LiesIn};

pub(in crate::effects) static UNEXPLAINED: EffectDefinition = EffectDefinition {
    name: "unexplained",
    what: "Structure is there, and nothing known explains it.",
    title: "nothing that was tried",
    lies_in: LiesIn::Nothing,
    ..EffectDefinition::PLAIN
};
