//! A jump of the instrument.

use crate::effects::definition::{EffectDefinition, EffectSize, LiesIn, SizeInWords, Trying};

pub(in crate::effects) static OFFSET: EffectDefinition = EffectDefinition {
    name: "offset",
    what: "The reading jumps and the slope does not: a prism reset, a bumped instrument.",
    title: "an offset of the readings",
    size_in_words: SizeInWords::Behind(", of "),
    trying: Trying::JumpOfReading,
    lies_in: LiesIn::Reading,
    may_be_a_slow_load: false,
    says_what_comes: false,
    size: |fitted| {
        EffectSize::measured(
            fitted.first() / fitted.unit.factor(),
            &fitted.unit.to_string(),
        )
    },
    ..EffectDefinition::PLAIN
};
