//! Benchmarks that part: seen in the proportions of their motion, by `partition` and `own_event`.

use crate::effects::definition::EffectDefinition;

pub(in crate::effects) static PARTITION: EffectDefinition = EffectDefinition {
    name: "partition",
    what: "Benchmarks that moved as one move as groups.",
    title: "benchmarks that move as groups from then on",
    ..EffectDefinition::PLAIN
};
