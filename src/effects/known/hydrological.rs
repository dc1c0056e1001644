//! Water, or what stands for it, as a load.

use crate::effects::definition::{EffectDefinition, EffectSize, Support, Trying};

pub(in crate::effects) static HYDROLOGICAL: EffectDefinition = EffectDefinition {
    name: "hydrological",
    what: "A covariate's delayed response in the log-load: water, rain, a reservoir.",
    title: "hydrological forcing",
    trying: Trying::CovariateInLoad(|_| true),
    support: Support::Covariate,
    size: |fitted| EffectSize {
        gain_per_sd: Some(fitted.first()),
        ..EffectSize::default()
    },
    ..EffectDefinition::PLAIN
};
