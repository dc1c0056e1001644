//! Simulated lives of slopes, drawn broadly, with their end known: what forecasts are calibrated and judged on.
//!
//! A block creeps, then follows the law with m, time and slip of its own, under a load that nobody declares
//! (Ornstein-Uhlenbeck, and a season on every second slope); its displacement is read with noise, gaps and
//! now and then a reset. Some that stand are the ones that forecasts trip over: strong seasons, steps of the
//! load, instruments that are reset, and noise that hides the creep.

mod corpus;
mod instrument;
mod load;
mod slope;

pub use corpus::Corpus;

use crate::random::log_uniform;
use instrument::Instrument;
use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::fit::Observations;
use slipwatch::model::Law;
use slope::{DisplacementPath, Slope};

/// How a life goes, and ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    /// Passes the critical velocity.
    Failing,
    /// Accelerates to a velocity that it keeps.
    Saturating,
    /// Creeps at one velocity.
    Steady,
    /// Slows down to a velocity that it keeps.
    Settling,
    /// Creeps under a strong yearly load: the velocity, as means of 30 days, swings by a factor of 2 to 10, with
    /// peaks that rise in days and fall in weeks, as snow melt's do.
    Seasonal,
    /// Creeps, and is loaded by steps: the velocity jumps to 3 to 30 times the creep for days.
    Stepped,
    /// Creeps, and its instrument is reset several times, by up to hundreds of mm, and bumped, and recovers.
    Reset,
    /// Creeps under noise some ten times what it moves between two readings: correlated, with outliers and long gaps.
    Noisy,
}

impl Fate {
    /// Those that never pass the critical velocity.
    pub const STANDING: [Self; 7] = [
        Self::Saturating,
        Self::Steady,
        Self::Settling,
        Self::Seasonal,
        Self::Stepped,
        Self::Reset,
        Self::Noisy,
    ];
}

/// One simulated slope and its readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Life {
    /// How it ends.
    pub fate: Fate,
    /// (days, mm), with noise, gaps and resets.
    pub readings: Vec<(f64, f64)>,
    /// When [`Life::CRITICAL_MM_PER_DAY`] was passed, days.
    pub failure_days: Option<f64>,
}

impl Life {
    /// Passing this velocity is failure, mm/day.
    pub const CRITICAL_MM_PER_DAY: f64 = 1000.0;

    /// What a monitor has of this slope by `now_days`.
    pub fn known(&self, now_days: f64) -> Observations {
        let known = self.readings.iter().filter(|(days, _)| *days <= now_days);
        Observations::of_displacements(known.copied())
    }

    /// The life that `seed` gives; a slope that its load brings to another end, or down in less than 0.4 of
    /// its time, is drawn again.
    pub fn draw(fate: Fate, seed: u64) -> Self {
        Self::draw_with_path(fate, seed).0
    }

    fn draw_with_path(fate: Fate, seed: u64) -> (Self, DisplacementPath) {
        let mut generator = Pcg64::seed_from_u64(seed);
        loop {
            if let Some(drawn) = Self::attempt(fate, &mut generator) {
                return drawn;
            }
        }
    }

    /// `count` benchmarks of one failing mass: one onset, one time to failure and one load, but each its own
    /// m, slip and readings. Under the load their failure times come to lie apart by what their m make of it.
    pub fn draw_together(count: usize, seed: u64) -> Vec<Self> {
        let mut generator = Pcg64::seed_from_u64(seed);
        loop {
            let duration = log_uniform(&mut generator, 60.0, 700.0);
            let onset = duration * generator.random_range(0.0..2.0);
            let knots = load::undeclared(onset + 1.5 * duration, &mut generator);
            let together: Option<Vec<Self>> = (0..count)
                .map(|_| {
                    let law = slope::law(Fate::Failing, duration, &mut generator);
                    let drawn = Self::of(
                        Fate::Failing,
                        law,
                        (onset, duration),
                        &knots,
                        &mut generator,
                    );
                    drawn.map(|(life, _)| life)
                })
                .collect();
            if let Some(together) = together {
                return together;
            }
        }
    }

    fn attempt(fate: Fate, generator: &mut impl Rng) -> Option<(Self, DisplacementPath)> {
        let (onset, duration) = slope::span(fate, generator);
        let law = slope::law(fate, duration, generator);
        let knots = load::of(fate, onset + 1.5 * duration, generator);
        Self::of(fate, law, (onset, duration), &knots, generator)
    }

    fn of(
        fate: Fate,
        law: Law,
        (onset, duration): (f64, f64),
        knots: &[(f64, f64)],
        generator: &mut impl Rng,
    ) -> Option<(Self, DisplacementPath)> {
        let end = onset + 1.5 * duration;
        let (path, failure_days) = Slope { law, onset, end }.path(knots)?;
        let ends_as_it_should = match (fate, failure_days) {
            (Fate::Failing, Some(days)) => days > onset + 0.4 * duration,
            (Fate::Failing, None) => false,
            (_, passed) => passed.is_none() && slope::moves_as(fate, &path),
        };
        ends_as_it_should.then(|| {
            let instrument = Instrument::draw(fate, path[path.len() - 1], generator);
            let life = Self {
                fate,
                readings: instrument.read(&path, generator),
                failure_days,
            };
            (life, path)
        })
    }
}

fn sign(generator: &mut impl Rng) -> f64 {
    if generator.random::<bool>() {
        1.0
    } else {
        -1.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Tests and published figures rest on these seeds: (fate, seed, readings, sum of days and mm, failure).
    const AS_EVER: [(Fate, u64, usize, f64, Option<f64>); 5] = [
        (
            Fate::Failing,
            0,
            35,
            47_282.544_772_894_704,
            Some(101.057_557_241_438_43),
        ),
        (
            Fate::Failing,
            20_003,
            612,
            326_408.299_289_178_86,
            Some(479.606_253_784_133_34),
        ),
        (Fate::Saturating, 5000, 3809, 23_579_687.316_089_84, None),
        (Fate::Steady, 5001, 403, 243_925.859_458_5, None),
        (Fate::Settling, 5002, 332, 119_085.473_652_529_56, None),
    ];

    fn sum(life: &Life) -> f64 {
        life.readings.iter().map(|(days, value)| days + value).sum()
    }

    fn close(a: f64, b: f64) -> bool {
        (a / b - 1.0).abs() < 1e-9
    }

    #[test]
    fn the_lives_of_old_seeds_are_as_ever() {
        for (fate, seed, readings, total, failure) in AS_EVER {
            let life = Life::draw(fate, seed);
            assert_eq!(life.readings.len(), readings, "{fate:?} {seed}");
            assert!(close(sum(&life), total), "{fate:?} {seed}: {}", sum(&life));
            match (life.failure_days, failure) {
                (Some(is), Some(was)) => assert!(close(is, was), "{fate:?} {seed}: {is}"),
                (is, was) => assert_eq!(is, was, "{fate:?} {seed}"),
            }
        }
        // Some of these were reset.
        let many: f64 = (0..30)
            .map(|seed| sum(&Life::draw(Fate::Failing, seed)))
            .sum();
        assert!(close(many, 25_710_788.358_339_06), "{many:?}");
        let together = Life::draw_together(3, 90_000);
        let counts: Vec<usize> = together.iter().map(|life| life.readings.len()).collect();
        assert_eq!(counts, [1707, 650, 1514]);
        assert!(close(sum(&together[2]), 3_293_794.497_349_192));
    }

    /// Means of the true velocity over windows of `days`, mm/day.
    fn velocities(path: &[(f64, f64)], days: f64) -> Vec<f64> {
        let mut means = Vec::new();
        let mut start = path[0];
        for at in path {
            if at.0 - start.0 >= days - 1e-6 {
                means.push((at.1 - start.1) / (at.0 - start.0));
                start = *at;
            }
        }
        means
    }

    fn greatest(values: &[f64]) -> f64 {
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
    }

    #[test]
    fn no_standing_slope_truly_passes_the_critical_velocity_and_every_failing_one_does() {
        for fate in Fate::STANDING {
            for seed in 0..12 {
                let (life, path) = Life::draw_with_path(fate, 700_000 + seed);
                let fastest = greatest(&velocities(&path, 0.1));
                assert!(
                    fastest < Life::CRITICAL_MM_PER_DAY,
                    "{fate:?} {seed}: {fastest}"
                );
                assert_eq!(life.failure_days, None);
            }
        }
        for seed in 0..40 {
            let (life, path) = Life::draw_with_path(Fate::Failing, 700_000 + seed);
            let failure = life.failure_days.unwrap();
            let last = velocities(&path, 0.1).pop().unwrap();
            assert!(
                last > 0.2 * Life::CRITICAL_MM_PER_DAY,
                "{seed}: {last} just before {failure}"
            );
            assert!(life.readings.iter().all(|(days, _)| *days < failure));
        }
    }

    #[test]
    fn a_season_swings_the_velocity_and_rises_faster_than_it_falls() {
        let mut lopsided = 0;
        for seed in 0..20 {
            let (_, path) = Life::draw_with_path(Fate::Seasonal, 710_000 + seed);
            let months = velocities(&path, 30.0);
            let least = months.iter().copied().fold(f64::INFINITY, f64::min);
            let swing = greatest(&months) / least;
            assert!((2.0..=10.0).contains(&swing), "{seed}: {swing}");
            let weeks = velocities(&path, 10.0);
            let rises: Vec<f64> = weeks.windows(2).map(|pair| pair[1] / pair[0]).collect();
            let falls: Vec<f64> = rises.iter().map(|rise| 1.0 / rise).collect();
            lopsided += u32::from(greatest(&rises) > greatest(&falls));
        }
        assert!(
            lopsided >= 15,
            "{lopsided} of 20 rise faster than they fall"
        );
    }

    #[test]
    fn a_step_of_the_load_jumps_the_velocity_3_to_30_fold_and_it_comes_back() {
        for seed in 0..20 {
            let (_, path) = Life::draw_with_path(Fate::Stepped, 720_000 + seed);
            let mut days = velocities(&path, 1.0);
            let most = greatest(&days);
            days.sort_by(f64::total_cmp);
            let jump = most / days[days.len() / 2];
            assert!((3.0..=30.0).contains(&jump), "{seed}: {jump}");
            let fast = days.iter().filter(|day| **day > 0.5 * most).count();
            assert!(
                fast < days.len() / 2,
                "{seed}: {fast} of {} days",
                days.len()
            );
        }
    }

    /// Differences of neighbouring readings from the true motion's, mm.
    fn strays(life: &Life, path: &[(f64, f64)]) -> Vec<f64> {
        let truth = |days: f64| {
            let after = path.partition_point(|(t, _)| *t <= days);
            path[after.min(path.len() - 1)].1
        };
        let errors: Vec<f64> = life.readings.iter().map(|(t, x)| x - truth(*t)).collect();
        errors
            .windows(2)
            .map(|pair| (pair[1] - pair[0]).abs())
            .collect()
    }

    #[test]
    fn an_instrument_is_reset_more_than_once_and_noise_hides_the_creep() {
        let (mut far, mut lives) = (0, 0);
        for seed in 0..20 {
            let (life, path) = Life::draw_with_path(Fate::Reset, 730_000 + seed);
            let jumps = strays(&life, &path);
            lives += usize::from(jumps.iter().filter(|jump| **jump > 15.0).count() >= 2);
            far += jumps.iter().filter(|jump| **jump > 100.0).count();
        }
        assert!(lives >= 14 && far >= 10, "{lives} lives, {far} jumps");
        for seed in 0..20 {
            let (life, path) = Life::draw_with_path(Fate::Noisy, 740_000 + seed);
            let mut noise = strays(&life, &path);
            noise.sort_by(f64::total_cmp);
            let spacing: Vec<f64> = life.readings.windows(2).map(|w| w[1].0 - w[0].0).collect();
            let interval = spacing.iter().copied().fold(f64::INFINITY, f64::min);
            let (end, moved) = path[path.len() - 1];
            let creep = moved / end * interval;
            assert!(
                noise[noise.len() / 2] > 2.0 * creep,
                "{seed}: {} against {creep} mm",
                noise[noise.len() / 2]
            );
            assert!(greatest(&spacing) > 10.0 * interval, "{seed}: no long gap");
        }
    }
}
