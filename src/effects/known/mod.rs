//! The effects that are known, a file each, and the table of them.

mod correlated_noise;
mod friction_change;
mod geometry;
mod hydrological;
mod interval_mean;
mod load_step;
mod none;
mod offset;
mod partition;
mod rate_limit;
mod seasonal;
mod seasonal_reading;
mod state_reset;
mod thermal;
mod tide;
mod unexplained;

use super::definition::EffectDefinition;
pub(super) use correlated_noise::CORRELATED_NOISE;
pub(super) use friction_change::FRICTION_CHANGE;
pub(super) use geometry::GEOMETRY;
pub(super) use hydrological::HYDROLOGICAL;
pub(super) use interval_mean::INTERVAL_MEAN;
pub(super) use load_step::LOAD_STEP;
pub(super) use none::NONE;
pub(super) use offset::OFFSET;
pub(super) use partition::PARTITION;
pub(super) use rate_limit::RATE_LIMIT;
pub(super) use seasonal::SEASONAL;
pub(super) use seasonal_reading::SEASONAL_READING;
pub(super) use state_reset::STATE_RESET;
pub(super) use thermal::THERMAL;
pub(super) use tide::TIDE;
pub(super) use unexplained::UNEXPLAINED;

/// All of them, in the order in which a search tries them.
pub static EFFECTS: &[&EffectDefinition] = &[
    &HYDROLOGICAL,
    &SEASONAL,
    &TIDE,
    &LOAD_STEP,
    &STATE_RESET,
    &FRICTION_CHANGE,
    &RATE_LIMIT,
    &GEOMETRY,
    &PARTITION,
    &OFFSET,
    &THERMAL,
    &SEASONAL_READING,
    &INTERVAL_MEAN,
    &CORRELATED_NOISE,
    &UNEXPLAINED,
    &NONE,
];
