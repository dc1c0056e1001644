//! The instrument that reads a simulated slope: its noise, gaps, resets and bumps.

use super::{Fate, sign};
use crate::random::{log_uniform, normal};
use rand::{Rng, RngExt};

/// Days between readings, and all that stands between the motion and what is read of it.
pub(super) struct Instrument {
    interval: f64,
    /// Standard deviation of each reading by itself, mm.
    noise: f64,
    /// (from, to), days.
    gaps: Vec<(f64, f64)>,
    displaced: Vec<Displaced>,
    monument: Option<Monument>,
}

/// A reset, or a bump that it recovers from.
struct Displaced {
    at: f64,
    /// mm.
    size: f64,
    /// Days over which it comes back; `None`: it stays.
    recovers: Option<f64>,
}

/// What the instrument stands on, and moves by itself; now and then it is hit.
struct Monument {
    /// Standard deviation of the part whose correlation ends, mm, and its correlation time, days.
    drift: f64,
    memory: f64,
    /// Of the part whose correlation does not end, mm/√day.
    walk: f64,
    /// Share of readings that are outliers.
    outliers: f64,
}

/// Where the monument has moved to, mm.
#[derive(Default)]
struct Moved {
    drift: f64,
    walk: f64,
}

/// The largest outlier, in standard deviations of the noise.
const FARTHEST_OUTLIER: f64 = 100.0;

impl Instrument {
    /// For a slope that is read until `end` days and has moved by `slip` mm then.
    pub(super) fn draw(fate: Fate, (end, slip): (f64, f64), generator: &mut impl Rng) -> Self {
        let interval = log_uniform(generator, 0.25, 3.0);
        let noise = log_uniform(generator, 0.3, 2.0);
        let mut gaps: Vec<(f64, f64)> = Vec::new();
        while generator.random::<f64>() < 0.6 {
            let start = generator.random_range(0.0..end);
            gaps.push((start, start + interval * generator.random_range(3.0..20.0)));
        }
        let reset = (generator.random::<f64>() < 1.0 / 7.0).then(|| {
            let size = generator.random_range(20.0..100.0);
            let sign = sign(generator);
            Displaced {
                at: generator.random_range(0.0..end),
                size: sign * size,
                recovers: None,
            }
        });
        let mut instrument = Self {
            interval,
            noise,
            gaps,
            displaced: reset.into_iter().collect(),
            monument: None,
        };
        match fate {
            Fate::Reset => instrument.tamper(end, generator),
            Fate::Noisy => instrument.unsettle((end, slip), generator),
            Fate::Failing
            | Fate::Saturating
            | Fate::Steady
            | Fate::Settling
            | Fate::Seasonal
            | Fate::Stepped => {}
        }
        instrument
    }

    /// Several resets, and bumps.
    fn tamper(&mut self, end: f64, generator: &mut impl Rng) {
        for _ in 0..generator.random_range(2..=6) {
            self.displaced.push(Displaced {
                at: generator.random_range(0.0..end),
                size: sign(generator) * log_uniform(generator, 5.0, 500.0),
                recovers: None,
            });
        }
        for _ in 0..generator.random_range(1..=3) {
            self.displaced.push(Displaced {
                at: generator.random_range(0.0..end),
                size: sign(generator) * log_uniform(generator, 5.0, 200.0),
                recovers: Some(log_uniform(generator, 0.5, 20.0)),
            });
        }
    }

    /// Noise of 5 to 20 times the creep between two readings, on a monument that moves, and long gaps.
    fn unsettle(&mut self, (end, slip): (f64, f64), generator: &mut impl Rng) {
        self.noise = slip / end * self.interval * log_uniform(generator, 5.0, 20.0);
        self.monument = Some(Monument {
            drift: self.noise * generator.random_range(0.3..1.0),
            memory: log_uniform(generator, 1.0, 50.0),
            walk: self.noise * log_uniform(generator, 0.02, 0.2),
            outliers: generator.random_range(0.01..0.05),
        });
        for _ in 0..generator.random_range(1..=3) {
            let start = end * generator.random_range(0.1..0.8);
            let length = self.interval * generator.random_range(20.0..100.0);
            self.gaps.push((start, start + length.min(0.2 * end)));
        }
    }

    /// The readings of a path of (days, mm): (days, mm).
    pub(super) fn read(&self, path: &[(f64, f64)], generator: &mut impl Rng) -> Vec<(f64, f64)> {
        let end = path[path.len() - 1].0;
        let mut readings = Vec::new();
        let mut moved = Moved::default();
        let mut index = 0_u32;
        loop {
            let days = self.interval * f64::from(index);
            if days >= end {
                return readings;
            }
            index += 1;
            let mut error = self.noise * normal(generator);
            if let Some(monument) = &self.monument {
                error += self.unsettled(monument, &mut moved, generator);
            }
            if self.gaps.iter().any(|gap| days > gap.0 && days < gap.1) {
                continue;
            }
            let after = path.partition_point(|(t, _)| *t <= days);
            let ((t0, x0), (t1, x1)) = (path[after - 1], path[after]);
            let at = x0 + (x1 - x0) * (days - t0) / (t1 - t0);
            let zero: f64 = self.displaced.iter().map(|one| one.at(days)).sum();
            readings.push((days, at + error + zero));
        }
    }

    /// What the monument adds to the next reading, mm.
    fn unsettled(&self, monument: &Monument, moved: &mut Moved, generator: &mut impl Rng) -> f64 {
        let keep = f64::exp(-self.interval / monument.memory);
        let fresh = monument.drift * f64::sqrt(1.0 - keep * keep);
        moved.drift = moved.drift * keep + fresh * normal(generator);
        moved.walk += monument.walk * self.interval.sqrt() * normal(generator);
        let mut error = moved.drift + moved.walk;
        if generator.random::<f64>() < monument.outliers {
            // A tail of index 2: the variance is infinite but for the cap.
            let far = 5.0 / f64::sqrt(1.0 - generator.random::<f64>());
            error += sign(generator) * self.noise * far.min(FARTHEST_OUTLIER);
        }
        error
    }
}

impl Displaced {
    /// mm at `days`.
    fn at(&self, days: f64) -> f64 {
        if days < self.at {
            return 0.0;
        }
        let left = |over: f64| f64::exp((self.at - days) / over);
        self.size * self.recovers.map_or(1.0, left)
    }
}
