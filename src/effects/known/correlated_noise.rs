//! Noise that remembers: seen by `verdict` in what all else leaves.

use crate::effects::definition::{EffectDefinition, LiesIn};

pub(in crate::effects) static CORRELATED_NOISE: EffectDefinition = EffectDefinition {
    name: "correlated-noise",
    what: "Noise of the reading that remembers: AR(1), or a monument's random walk.",
    title: "noise of the readings that remembers",
    lies_in: LiesIn::Reading,
    ..EffectDefinition::PLAIN
};
