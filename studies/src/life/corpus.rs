//! Two sets of simulated lives of the same mix and disjoint seeds: one to tune forecasts on, one to judge them by.

use super::{Fate, Life};
use std::ops::Range;

/// Simulated slopes, five failing to every two that stand: 1,000 and 400, the latter in equal shares of
/// [`Fate::STANDING`]. Every beginning of the corpus has the same mix.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corpus {
    first_seed: u64,
}

impl Corpus {
    /// Lives in a corpus.
    pub const LIVES: u64 = 1400;
    /// What weights, spreads and thresholds of forecasts may be fitted to: seeds 1,000,000 to 1,001,399.
    pub const TRAINING: Self = Self {
        first_seed: 1_000_000,
    };
    /// What forecasts are judged by: seeds 2,000,000 to 2,001,399. Nothing may be tuned on these, nor on what was
    /// found by looking at them; a change is chosen on [`Corpus::TRAINING`] and then measured here.
    pub const JUDGED: Self = Self {
        first_seed: 2_000_000,
    };

    /// One seed a life.
    pub fn seeds(self) -> Range<u64> {
        self.first_seed..self.first_seed + Self::LIVES
    }

    /// The fate of the life of that index, which may be any.
    pub fn fate(index: u64) -> Fate {
        let (round, place) = (index / 7, index % 7);
        if place < 5 {
            return Fate::Failing;
        }
        let standing = (2 * round + place - 5) % Fate::STANDING.len() as u64;
        Fate::STANDING
            .into_iter()
            .zip(0..)
            .find_map(|(fate, at)| (at == standing).then_some(fate))
            .unwrap_or(Fate::Steady)
    }

    /// The life of that index, below [`Corpus::LIVES`].
    pub fn life(self, index: u64) -> Life {
        Life::draw(Self::fate(index), self.first_seed + index)
    }

    /// All lives, in the order of their seeds, each drawn when it is asked for.
    pub fn lives(self) -> impl Iterator<Item = Life> {
        (0..Self::LIVES).map(move |index| self.life(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn count(fates: impl Iterator<Item = u64>, fate: Fate) -> usize {
        fates.filter(|index| Corpus::fate(*index) == fate).count()
    }

    #[test]
    fn a_corpus_has_a_thousand_failing_and_four_hundred_others_in_equal_shares() {
        assert_eq!(count(0..Corpus::LIVES, Fate::Failing), 1000);
        for fate in Fate::STANDING {
            let share = count(0..Corpus::LIVES, fate);
            assert!((57..=58).contains(&share), "{fate:?}: {share}");
        }
        assert_eq!(count(0..140, Fate::Failing), 100);
    }

    #[test]
    fn training_and_judgement_share_no_seed() {
        let (training, judged) = (Corpus::TRAINING.seeds(), Corpus::JUDGED.seeds());
        assert!(training.end <= judged.start);
        assert_eq!(judged.end - judged.start, Corpus::LIVES);
    }

    #[test]
    fn the_same_seed_gives_the_same_life_and_another_another() {
        for index in 0..21 {
            let life = Corpus::JUDGED.life(index);
            assert_eq!(life, Corpus::JUDGED.life(index));
            assert_ne!(life, Corpus::TRAINING.life(index));
        }
    }

    #[test]
    fn whoever_fails_in_the_corpus_is_said_to_and_nobody_else_is() {
        let mut failed = 0;
        for (index, life) in (0..).zip(Corpus::JUDGED.lives()) {
            assert_eq!(life.fate, Corpus::fate(index));
            assert_eq!(
                life.failure_days.is_some(),
                life.fate == Fate::Failing,
                "{index}"
            );
            failed += u32::from(life.failure_days.is_some());
        }
        assert_eq!(failed, 1000);
    }
}
