//! An instrument, or its mount, that the temperature moves.

use crate::effects::definition::{EffectDefinition, EffectSize, LiesIn, Support, Trying};
use crate::reading::CovariateKind;

pub(in crate::effects) static THERMAL: EffectDefinition = EffectDefinition {
    name: "thermal",
    what: "Temperature in the reading.",
    title: "temperature in the readings",
    trying: Trying::CovariateInReading(|kind| kind == CovariateKind::Temperature),
    support: Support::Covariate,
    lies_in: LiesIn::Reading,
    may_be_a_slow_load: false,
    size: |fitted| EffectSize {
        gain_per_sd: Some(fitted.first() / fitted.unit.factor()),
        unit: Some(fitted.unit.to_string()),
        ..EffectSize::default()
    },
    ..EffectDefinition::PLAIN
};
