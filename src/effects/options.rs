//! What is asked of a search.

use super::definition::EffectDefinition;
use super::known::EFFECTS;

/// What is asked of a search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Passing this velocity is failure, mm/day.
    pub critical_velocity_mm_per_day: f64,
    /// Of the surrogates.
    pub seed: u64,
    /// How many surrogates judge a gain.
    pub surrogates: usize,
    /// The fall of the BIC that an effect must bring.
    pub bic_margin: f64,
    /// The share of the record held out at its end.
    pub held_out_share: f64,
    /// The effects that are tried.
    pub effects: &'static [&'static EffectDefinition],
}

impl Default for Options {
    fn default() -> Self {
        Self {
            critical_velocity_mm_per_day: 1000.0,
            seed: 1,
            surrogates: 399,
            bic_margin: 10.0,
            held_out_share: 1.0 / 3.0,
            effects: EFFECTS,
        }
    }
}
