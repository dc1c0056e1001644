//! The instruments that read simulated slopes: sampling, noise, waves, resolution, gaps, resets and loss.

use super::Family;
use super::onward::WorldPath;
use crate::random::{happens, log_uniform, normal, uniform};
use rand::{Rng, RngExt};
use std::f64::consts::TAU;

const MINUTE: f64 = 1.0 / 1440.0;
/// Satellites repeat themselves after this, days.
const SIDEREAL: f64 = 0.997_27;

/// What reads a slope.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum GaugeKind {
    /// Ground-based radar: minutes, correlated by the air, tenths or whole mm.
    Radar,
    /// Satellite positions of whole days: flicker and a yearly wave.
    GnssDaily,
    /// Of minutes to hours: flicker and a sidereal wave.
    GnssHourly,
    /// Hours to a day: a daily and a yearly wave.
    TotalStation,
    /// Minutes to hours, thermal.
    Crackmeter,
    /// Minutes to a day, thermal, coarse.
    Extensometer,
    /// By hand: days to a month, irregular.
    Survey,
    /// White or heavy-tailed noise of any size, each minute to ten days.
    Plain,
    /// Mean velocities.
    VelocityColumn,
}

impl GaugeKind {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Radar,
        Self::GnssDaily,
        Self::GnssHourly,
        Self::TotalStation,
        Self::Crackmeter,
        Self::Extensometer,
        Self::Survey,
        Self::Plain,
        Self::VelocityColumn,
    ];
}

/// One instrument; lengths in mm, times in days.
#[derive(Debug)]
pub(super) struct Gauge {
    pub(super) kind: GaugeKind,
    pub(super) interval: f64,
    white: f64,
    /// Whether the white noise has the tails of Student's t with 2 degrees of freedom.
    is_heavy: bool,
    /// Standard deviation and memory of the correlated noise.
    air: (f64, f64),
    flicker: f64,
    daily: f64,
    yearly: f64,
    /// Resolution; 0 for none.
    step: f64,
    outliers: f64,
    gaps: f64,
    resets: f64,
    pub(super) averaging: f64,
}

/// The share of instruments at their best (corrected for the weather, near the slope, on good mounts), and how small their
/// errors get.
const FINE: (f64, f64) = (0.5, 0.1);

/// What moves within the instrument, from reading to reading.
#[derive(Default)]
struct Moving {
    air: f64,
    slow: f64,
    slower: f64,
    /// How strong the daily wave is today.
    sun: f64,
}

/// What is drawn once for a record.
struct GaugeRecord {
    gaps: Vec<(f64, f64)>,
    resets: Vec<(f64, f64)>,
    phase: f64,
    yearly_phase: f64,
    second_wave: f64,
}

impl Gauge {
    pub(super) fn draw(family: Family, generator: &mut impl Rng) -> Self {
        let kind = GaugeKind::ALL[generator.random_range(0..GaugeKind::ALL.len())];
        let mut gauge = Self {
            kind,
            interval: 1.0,
            white: 1.0,
            is_heavy: false,
            air: (0.0, 0.1),
            flicker: 0.0,
            daily: 0.0,
            yearly: 0.0,
            step: 0.0,
            outliers: 0.0,
            gaps: 0.3,
            resets: 0.1,
            averaging: 0.0,
        };
        match kind {
            GaugeKind::Radar | GaugeKind::Crackmeter | GaugeKind::Extensometer => {
                gauge.on_the_ground(generator);
            }
            GaugeKind::GnssDaily | GaugeKind::GnssHourly => gauge.by_satellite(generator),
            GaugeKind::TotalStation | GaugeKind::Survey => gauge.by_eye(generator),
            GaugeKind::Plain | GaugeKind::VelocityColumn => gauge.of_any_kind(generator),
        }
        if family == Family::Resets {
            gauge.resets = 0.8;
        }
        if happens(generator, FINE.0) {
            gauge.finer(log_uniform(generator, FINE.1, 1.0));
        }
        gauge
    }

    /// The same instrument read each `interval` days; `None` where its kind is not read so often or so seldom.
    pub(super) fn read_each(mut self, interval: f64) -> Option<Self> {
        const ROUNDING: f64 = 1e-9;
        let (shortest, longest) = match self.kind {
            GaugeKind::Radar => (4.0 * MINUTE, 30.0 * MINUTE),
            GaugeKind::GnssDaily => (1.0, 1.0),
            GaugeKind::GnssHourly => (10.0 * MINUTE, 0.25),
            GaugeKind::TotalStation => (1.0 / 24.0, 1.0),
            GaugeKind::Crackmeter => (5.0 * MINUTE, 0.25),
            GaugeKind::Extensometer => (10.0 * MINUTE, 1.0),
            GaugeKind::Survey => (1.0, 30.0),
            GaugeKind::Plain => (MINUTE, 10.0),
            GaugeKind::VelocityColumn => (5.0 * MINUTE, 1.0),
        };
        self.averaging *= interval / self.interval;
        self.interval = interval;
        (shortest - ROUNDING..=longest + ROUNDING)
            .contains(&interval)
            .then_some(self)
    }

    /// The same instrument at its best: every error so many times as large.
    fn finer(&mut self, share: f64) {
        let errors = [
            &mut self.white,
            &mut self.air.0,
            &mut self.flicker,
            &mut self.daily,
            &mut self.yearly,
            &mut self.step,
        ];
        for error in errors {
            *error *= share;
        }
    }

    fn on_the_ground(&mut self, generator: &mut impl Rng) {
        if self.kind == GaugeKind::Radar {
            self.interval = log_uniform(generator, 4.0 * MINUTE, 30.0 * MINUTE);
            self.white = log_uniform(generator, 0.1, 1.0);
            let size = log_uniform(generator, 0.2, 2.0);
            self.air = (size, log_uniform(generator, 0.04, 0.5));
            self.step = if happens(generator, 0.4) { 1.0 } else { 0.1 };
            if happens(generator, 0.5) {
                self.daily = log_uniform(generator, 0.2, 2.0);
            }
        } else if self.kind == GaugeKind::Crackmeter {
            self.interval = log_uniform(generator, 5.0 * MINUTE, 0.25);
            self.white = log_uniform(generator, 0.005, 0.1);
            self.daily = log_uniform(generator, 0.01, 0.5);
            self.yearly = log_uniform(generator, 0.05, 1.0);
            self.step = log_uniform(generator, 0.005, 0.1);
        } else {
            self.interval = log_uniform(generator, 10.0 * MINUTE, 1.0);
            self.white = log_uniform(generator, 0.05, 1.0);
            if happens(generator, 0.6) {
                self.daily = log_uniform(generator, 0.05, 2.0);
            }
            if happens(generator, 0.4) {
                self.step = log_uniform(generator, 0.05, 1.0);
            }
        }
    }

    fn by_satellite(&mut self, generator: &mut impl Rng) {
        self.flicker = log_uniform(generator, 0.3, 2.0);
        self.yearly = log_uniform(generator, 0.5, 5.0);
        self.outliers = 0.01;
        if self.kind == GaugeKind::GnssDaily {
            self.white = log_uniform(generator, 0.7, 5.0);
        } else {
            self.interval = log_uniform(generator, 10.0 * MINUTE, 0.25);
            self.white = log_uniform(generator, 2.0, 8.0);
            self.daily = log_uniform(generator, 1.0, 10.0);
        }
    }

    fn by_eye(&mut self, generator: &mut impl Rng) {
        if self.kind == GaugeKind::TotalStation {
            self.interval = log_uniform(generator, 1.0 / 24.0, 1.0);
            self.white = log_uniform(generator, 0.5, 3.0);
            self.daily = log_uniform(generator, 0.5, 8.0);
            self.yearly = log_uniform(generator, 0.5, 5.0);
            self.outliers = 0.01;
        } else {
            self.interval = log_uniform(generator, 1.0, 30.0);
            self.white = log_uniform(generator, 0.5, 5.0);
            self.gaps = 0.6;
        }
    }

    fn of_any_kind(&mut self, generator: &mut impl Rng) {
        if self.kind == GaugeKind::Plain {
            self.interval = log_uniform(generator, MINUTE, 10.0);
            self.white = log_uniform(generator, 0.01, 5.0);
            self.is_heavy = happens(generator, 0.2);
            if happens(generator, 0.2) {
                self.step = log_uniform(generator, 0.05, 2.0);
            }
            self.resets = 0.0;
        } else {
            self.interval = log_uniform(generator, 5.0 * MINUTE, 1.0);
            self.white = log_uniform(generator, 0.02, 2.0);
            let windows = if happens(generator, 0.5) {
                1.0
            } else {
                uniform(generator, 1.0, 6.0)
            };
            self.averaging = self.interval * windows;
            if happens(generator, 0.3) {
                self.step = log_uniform(generator, 0.01, 0.5);
            }
        }
    }

    /// Its largest kind of error, mm.
    pub(super) fn error(&self) -> f64 {
        let largest = self.white.max(self.daily).max(self.air.0);
        largest.max(0.5 * self.step)
    }

    /// (days, mm or mm/day) of the readings of a path; of one that collapses the sensor is lost early now and then.
    pub(super) fn read(
        &self,
        path: &WorldPath,
        family: Family,
        generator: &mut impl Rng,
    ) -> Vec<(f64, f64)> {
        let end = path.end();
        let record = self.record(end, generator);
        let mut moving = Moving {
            air: self.air.0 * normal(generator),
            sun: 1.0,
            ..Moving::default()
        };
        let start = generator.random::<f64>() * self.interval;
        let mut readings = Vec::new();
        let mut at = start;
        while at < end {
            let irregular = if self.kind == GaugeKind::Survey {
                uniform(generator, -0.2, 0.2) * self.interval
            } else {
                0.0
            };
            let days = at + irregular;
            at += self.interval;
            moving.on(self, generator);
            let is_lost = record.gaps.iter().any(|gap| days > gap.0 && days < gap.1);
            if is_lost || days < 0.0 || days >= end {
                continue;
            }
            let value = if self.averaging > 0.0 {
                self.velocity(path, days, generator)
            } else {
                path.at(days) + record.zero(days) + self.off(&record, &moving, days, generator)
            };
            readings.push((days, self.resolved(value)));
        }
        if family.fails() && readings.len() > 60 && happens(generator, 0.08) {
            let lost = readings.len() as f64 * log_uniform(generator, 0.003, 0.05);
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a share of a length"
            )]
            readings.truncate(readings.len() - lost as usize);
        }
        readings
    }

    fn record(&self, end: f64, generator: &mut impl Rng) -> GaugeRecord {
        let mut gaps = Vec::new();
        while happens(generator, self.gaps) {
            let from = uniform(generator, 0.0, end);
            gaps.push((
                from,
                from + self.interval * log_uniform(generator, 3.0, 40.0),
            ));
        }
        let mut resets = Vec::new();
        while resets.len() < 8 && happens(generator, self.resets) {
            let at = uniform(generator, 0.0, end);
            let size = log_uniform(generator, 5.0, 1000.0) * self.white.max(0.05);
            let sign = if happens(generator, 0.5) { 1.0 } else { -1.0 };
            resets.push((at, sign * size));
        }
        GaugeRecord {
            gaps,
            resets,
            phase: uniform(generator, 0.0, TAU),
            yearly_phase: uniform(generator, 0.0, TAU),
            second_wave: uniform(generator, 0.0, 0.5),
        }
    }

    /// The error of one displacement, mm.
    fn off(
        &self,
        record: &GaugeRecord,
        moving: &Moving,
        days: f64,
        generator: &mut impl Rng,
    ) -> f64 {
        let period = if self.kind == GaugeKind::GnssHourly {
            SIDEREAL
        } else {
            1.0
        };
        let turn = TAU * days / period + record.phase;
        let shape = turn.sin() + record.second_wave * (2.0 * turn + 1.0).sin();
        let daily = 0.5 * self.daily * moving.sun.clamp(0.0, 2.5) * shape;
        let yearly = self.yearly * (TAU * days / 365.25 + record.yearly_phase).sin();
        let z = if self.is_heavy {
            let square = normal(generator).powi(2) + normal(generator).powi(2);
            normal(generator) / (0.5 * square).max(1e-3).sqrt()
        } else {
            normal(generator)
        };
        let mut error = self.white * z + moving.air + moving.slow + moving.slower + daily + yearly;
        if happens(generator, self.outliers) {
            let tail = (1.0 - generator.random::<f64>()).sqrt().max(0.05);
            error += 5.0 * self.white * normal(generator) / tail;
        }
        error
    }

    fn velocity(&self, path: &WorldPath, days: f64, generator: &mut impl Rng) -> f64 {
        let before = (days - self.averaging).max(0.0);
        let error = 0.5 * self.white * normal(generator);
        (path.at(days) - path.at(before) + error) / self.averaging
    }

    fn resolved(&self, value: f64) -> f64 {
        if self.step > 0.0 {
            (value / self.step).round() * self.step
        } else {
            value
        }
    }
}

impl GaugeRecord {
    /// What resets have added by `days`, mm.
    fn zero(&self, days: f64) -> f64 {
        let done = self.resets.iter().filter(|(at, _)| *at <= days);
        done.map(|(_, size)| size).sum()
    }
}

impl Moving {
    /// One interval on. Flicker is the sum of two memories, of 10 and 100 days.
    fn on(&mut self, gauge: &Gauge, generator: &mut impl Rng) {
        let mut go = |value: f64, size: f64, memory: f64| {
            let keep = (-gauge.interval / memory).exp();
            value * keep + size * (1.0 - keep * keep).max(0.0).sqrt() * normal(generator)
        };
        self.air = go(self.air, gauge.air.0, gauge.air.1);
        self.slow = go(self.slow, gauge.flicker, 10.0);
        self.slower = go(self.slower, 1.5 * gauge.flicker, 100.0);
        self.sun = 1.0 + go(self.sun - 1.0, 0.5, 5.0);
    }
}
