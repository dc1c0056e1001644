//! The reading of a slope: its benchmark and the benchmarks beside it, with noise and instruments' effects.

use super::instrument::SceneInstrument;
use super::scene::Scene;
use super::slope::{Path, SlopeEffect, path};
use rand_pcg::Pcg64;
use slipwatch::reading::{BenchmarkId, Quantity, Reading, Series, Unit};
use studies::random::{count, happens, log_uniform_by_exp, normal, one_of};

/// A path with its size and noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SceneSlope<'a> {
    /// Its schedule is that of what is read.
    pub(crate) scene: &'a Scene,
    /// At each of `days`.
    pub(crate) seen: &'a Path,
    pub(crate) days: &'a [f64],
    /// Slip where the path slips 1.
    pub(crate) mm: f64,
    /// White noise: mm, or a share of the velocity.
    pub(crate) noise: f64,
}

/// The path with velocities that are means over `window` days before each; those of the first days, which
/// would reach before the record, are instantaneous and not for reading.
pub(crate) fn means(scene: &Scene, effects: &[SlopeEffect], window: f64) -> Option<Path> {
    let days = &scene.schedule.days;
    let mut all: Vec<f64> = days
        .iter()
        .flat_map(|day| [*day, (day - window).max(0.0)])
        .collect();
    all.sort_by(f64::total_cmp);
    all.dedup();
    let path = path(&scene.law, effects, &all)?;
    let at = |day: f64| {
        path.displacement
            .get(all.partition_point(|one| *one < day))
            .copied()
    };
    let mut seen = Path::default();
    for day in days {
        let place = all.partition_point(|one| one < day);
        let velocity = if *day >= window && window > 0.0 {
            (at(*day)? - at((day - window).max(0.0))?) / window
        } else {
            path.velocity[place]
        };
        seen.velocity.push(velocity);
        seen.displacement.push(path.displacement[place]);
    }
    Some(seen)
}

impl SceneSlope<'_> {
    /// The benchmark's readings, and what they would be without noise.
    pub(crate) fn read<'b>(
        &self,
        rng: &mut Pcg64,
        instruments: impl Iterator<Item = &'b SceneInstrument>,
    ) -> Option<(Series, Vec<f64>)> {
        let days = &self.scene.schedule.days;
        let mut noiseless = self.values(self.seen);
        let mut scatter: Vec<f64> = days.iter().map(|_| normal(rng)).collect();
        for instrument in instruments {
            let Some(added) = instrument.adds(rng, days) else {
                continue;
            };
            let into = if instrument.is_noise() {
                &mut scatter
            } else {
                &mut noiseless
            };
            let unit = if instrument.is_noise() {
                1.0
            } else {
                self.noise
            };
            for (value, one) in into.iter_mut().zip(added) {
                *value += unit * one;
            }
        }
        let values = self.scattered(&noiseless, &scatter);
        Some((self.series("a", &values)?, noiseless))
    }

    /// A path's values at the times of the readings.
    fn values(&self, path: &Path) -> Vec<f64> {
        let of_quantity = match self.scene.quantity {
            Quantity::Displacement => &path.displacement,
            Quantity::Velocity => &path.velocity,
        };
        let first = self.scene.schedule.days.first().copied().unwrap_or(0.0);
        let kept = self
            .days
            .iter()
            .zip(of_quantity)
            .filter(|(day, _)| **day >= first);
        kept.map(|(_, value)| value * self.mm).collect()
    }

    fn scattered(&self, noiseless: &[f64], scatter: &[f64]) -> Vec<f64> {
        let pairs = noiseless.iter().zip(scatter);
        match self.scene.quantity {
            Quantity::Displacement => pairs.map(|(value, one)| value + self.noise * one).collect(),
            Quantity::Velocity => pairs
                .map(|(value, one)| value * (1.0 + (self.noise * one).max(-0.95)))
                .collect(),
        }
    }

    fn series(&self, name: &str, values: &[f64]) -> Option<Series> {
        let rows = self
            .scene
            .schedule
            .days
            .iter()
            .zip(values)
            .map(|(day, value)| {
                Some(Reading {
                    time: self.scene.time(*day)?,
                    value: *value,
                    sigma: None,
                })
            });
        Some(Series {
            benchmark: BenchmarkId::new(name),
            unit: match self.scene.quantity {
                Quantity::Displacement => Unit::MM,
                Quantity::Velocity => Unit::MM_PER_DAY,
            },
            averaging: None,
            readings: rows.collect::<Option<_>>()?,
        })
    }
}

/// The names of the benchmarks that move as one, group by group.
pub(crate) type Groups = Vec<Vec<String>>;

/// Benchmarks that move in proportion, on some slopes; where the slope has parted, some of them with the
/// law alone and without what moves the others. The groups then, the explained benchmark's own first.
pub(crate) fn neighbours(
    rng: &mut Pcg64,
    slope: &SceneSlope,
    is_parted: bool,
) -> Option<(Vec<Series>, Option<Groups>)> {
    let wanted = if is_parted {
        count(rng, 1, 4)
    } else if happens(rng, 0.25) {
        count(rng, 1, 3)
    } else {
        0
    };
    let alone = path(&slope.scene.law, &[], slope.days);
    let (mut own, mut other) = (vec!["a".to_owned()], Vec::new());
    let mut series = Vec::new();
    for name in ["b", "c", "d", "e"].into_iter().take(wanted) {
        // The first always stays behind, so that there are two groups.
        let stays = is_parted && (other.is_empty() || one_of(rng, &[(0.5, true), (0.5, false)]));
        let path = if stays { alone.as_ref()? } else { slope.seen };
        let share = log_uniform_by_exp(rng, 0.3, 3.0);
        let noiseless: Vec<f64> = slope
            .values(path)
            .iter()
            .map(|value| share * value)
            .collect();
        let scatter: Vec<f64> = noiseless.iter().map(|_| normal(rng)).collect();
        series.push(slope.series(name, &slope.scattered(&noiseless, &scatter))?);
        if stays { &mut other } else { &mut own }.push(name.to_owned());
    }
    Some((series, is_parted.then(|| vec![own, other])))
}
