//! The regime in force: entered at a high probability, kept until another one has it.

use super::Regime;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A regime must be at least this probable to be entered.
const ENTER: f64 = 0.8;
/// Refits in a row that must agree.
const AGREEING: usize = 2;

/// A change of the regime in force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Flip {
    /// The regime before; `Undetermined` at first.
    pub from: Regime,
    /// The regime now.
    pub to: Regime,
    /// Its probability.
    pub probability: f64,
}

/// Remembers the regime in force.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub struct Tracker {
    in_force: Option<Regime>,
    candidate: Option<(Regime, usize)>,
}

impl Tracker {
    /// Takes the probabilities of one refit; a flip is a crossing with hysteresis.
    pub fn update(&mut self, probabilities: &BTreeMap<Regime, f64>) -> Option<Flip> {
        let (leader, probability) = leader(probabilities)?;
        if probability < ENTER || self.in_force == Some(leader) {
            self.candidate = None;
            return None;
        }
        let agreeing = match self.candidate {
            Some((regime, count)) if regime == leader => count + 1,
            Some(_) | None => 1,
        };
        self.candidate = Some((leader, agreeing));
        if agreeing < AGREEING {
            return None;
        }
        let from = self.in_force.unwrap_or(Regime::Undetermined);
        self.in_force = Some(leader);
        self.candidate = None;
        Some(Flip {
            from,
            to: leader,
            probability,
        })
    }
}

/// The most probable regime.
pub fn leader(probabilities: &BTreeMap<Regime, f64>) -> Option<(Regime, f64)> {
    let best = probabilities.iter().max_by(|a, b| a.1.total_cmp(b.1))?;
    Some((*best.0, *best.1))
}

/// The label of a refit: the leader where it has more than six tenths, else undetermined.
pub fn label(probabilities: &BTreeMap<Regime, f64>) -> Regime {
    match leader(probabilities) {
        Some((regime, probability)) if probability > 0.6 => regime,
        Some(_) | None => Regime::Undetermined,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sure_of(regime: Regime, probability: f64) -> BTreeMap<Regime, f64> {
        BTreeMap::from([
            (regime, probability),
            (Regime::StableDecelerating, 1.0 - probability),
        ])
    }

    #[test]
    fn a_flip_needs_a_clear_and_repeated_majority() {
        let mut tracker = Tracker::default();
        let unstable = Regime::UnstableAccelerating;
        assert_eq!(tracker.update(&sure_of(unstable, 0.7)), None);
        assert_eq!(tracker.update(&sure_of(unstable, 0.9)), None);
        let flip = tracker.update(&sure_of(unstable, 0.9)).unwrap();
        assert_eq!((flip.from, flip.to), (Regime::Undetermined, unstable));
        assert_eq!(tracker.update(&sure_of(unstable, 0.55)), None);
        assert_eq!(
            tracker.update(&sure_of(unstable, 0.9)),
            None,
            "still in force"
        );
    }
}
