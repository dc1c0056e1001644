//! An instrument that reads a mean and does not say so.

use crate::effects::act::Act;
use crate::effects::definition::{
    EffectDefinition, EffectSize, LiesIn, SearchedRecord, SizeInWords, Trying,
};
use crate::reading::Quantity;

pub(in crate::effects) static INTERVAL_MEAN: EffectDefinition = EffectDefinition {
    name: "interval-mean",
    what: "Velocity readings are means over an interval.",
    title: "velocities that are means over an interval",
    size_in_words: SizeInWords::Behind(" of "),
    trying: Trying::AllAlong(acts),
    lies_in: LiesIn::Reading,
    // The blur of a mean says nothing of what comes.
    says_what_comes: false,
    size: |fitted| EffectSize::measured(fitted.first() * fitted.spacing_days, "day"),
    ..EffectDefinition::PLAIN
};

/// Velocities that are not known to be means.
fn acts(record: &SearchedRecord) -> Vec<Act> {
    if record.quantity == Quantity::Velocity && record.averaging_days <= 0.0 {
        vec![Act::Averaging]
    } else {
        Vec::new()
    }
}
