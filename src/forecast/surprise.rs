//! Whether a reading is one that nobody expected: structure, or a fault, that the law does not know.

use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

/// Readings that say what is usual.
const REMEMBERED: usize = 24;
const FEWEST_READINGS: usize = 8;
/// A reading this much less likely than the usual one stands out: once in some thousand readings by chance.
const STANDS_OUT_NATS: f64 = 7.0;
/// And by so many times what the most surprising of the latest ones did: where noise is as large as the motion, a velocity's logarithm
/// is off again and again.
const ABOVE_LARGEST: f64 = 1.5;

/// Remembers how likely the latest readings were.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(super) struct Surprise {
    log_densities: VecDeque<f64>,
}

impl Surprise {
    /// Takes ln of the predictive density of a reading; says by how much it falls short of the median
    /// of the latest ones, where that stands out.
    pub(super) fn of(&mut self, log_density: f64) -> Option<f64> {
        let mut usual: Vec<f64> = self.log_densities.iter().copied().collect();
        usual.sort_by(f64::total_cmp);
        self.log_densities.push_back(log_density);
        if self.log_densities.len() > REMEMBERED {
            self.log_densities.pop_front();
        }
        if usual.len() < FEWEST_READINGS {
            return None;
        }
        let median = usual[usual.len() / 2];
        let (surprise, largest) = (median - log_density, median - usual[0]);
        let stands_out = surprise > STANDS_OUT_NATS.max(ABOVE_LARGEST * largest);
        stands_out.then_some(surprise.min(1e3))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_a_reading_far_from_all_others_stands_out() {
        let mut surprise = Surprise::default();
        for index in 0..30 {
            assert_eq!(surprise.of(-1.0 - 0.1 * f64::from(index % 5)), None);
        }
        assert!(surprise.of(-12.0).is_some());
        assert_eq!(surprise.of(-1.0), None);
        // What comes again and again is usual.
        assert_eq!(surprise.of(-14.0), None);
        assert!(surprise.of(-30.0).is_some());
    }
}
