//! Time-correlated noise of the readings: seen by `verdict` in what all else leaves.

use crate::effects::definition::{EffectDefinition, LiesIn};

pub(in crate::effects) static CORRELATED_NOISE: EffectDefinition = EffectDefinition {
    name: "correlated-noise",
    what: "Time-correlated noise of the readings: AR(1), or a monument's random walk.",
    title: "time-correlated noise of the readings",
    lies_in: LiesIn::Reading,
    ..EffectDefinition::PLAIN
};
