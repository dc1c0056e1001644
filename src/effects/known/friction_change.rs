//! Another friction than before.

use crate::effects::act::Act;
use crate::effects::definition::{EffectDefinition, Support, Trying};

pub(in crate::effects) static FRICTION_CHANGE: EffectDefinition = EffectDefinition {
    name: "friction-change",
    what: "The friction's parameters change.",
    title: "a change of the friction's parameters",
    trying: Trying::Once(&[Act::Friction(1), Act::Friction(3)]),
    support: Support::Nothing,
    ..EffectDefinition::PLAIN
};
