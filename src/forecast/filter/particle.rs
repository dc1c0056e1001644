//! One particle: its state, its own parameters, how it moves and how it weighs a reading.

use super::has_zero;
use crate::fit::{FINEST_DAYS, Observation};
use crate::reading::Quantity;
use rand::{Rng, RngExt};
use rand_distr::StandardNormal;

/// How readings come about.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dynamics {
    pub(super) quantity: Quantity,
    pub(super) averaging_days: f64,
}

/// What the first readings say about where to start.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reset {
    quantity: Quantity,
    first_value: f64,
    velocity: f64,
    /// Sampling interval, days: the unit of time of every prior.
    pub(super) interval_days: f64,
}

impl Reset {
    pub(super) fn from_first(how: &Dynamics, first: &[Observation]) -> Self {
        let (start, end) = (first[0], first[first.len() - 1]);
        let days = (end.t_days - start.t_days).max(1e-6);
        let velocity = match how.quantity {
            Quantity::Displacement => (end.value - start.value).abs() / days,
            Quantity::Velocity => start.value.abs(),
        };
        Self {
            quantity: how.quantity,
            first_value: start.value,
            velocity: velocity.max(1e-3),
            interval_days: (days / (first.len() - 1) as f64)
                .max(0.5 * how.averaging_days)
                .max(FINEST_DAYS),
        }
    }
}

/// Past positions kept for trailing means.
const LAGS: usize = 4;
/// Nothing moves faster: a bound for particles that have failed, mm/day.
const FASTEST: f64 = 1e6;
/// Prior of a sudden load step: its chance, a reading, and its scale in ln v.
const STEP: (f64, f64) = (0.002, 0.7);
/// Share of particles that try the load step which the newest reading suggests, and their scatter about it.
const SUGGESTED: (f64, f64) = (0.04, 0.25);
/// A benchmark that still reads has not collapsed: nothing that reads moves faster, mm/day.
const COLLAPSED: f64 = 1e5;
/// Chance, a reading, that a displacement instrument was reset, and the scale of resets, mm.
const INSTRUMENT_RESET: (f64, f64) = (1e-3, 60.0);
/// Degrees of freedom of the reading noise.
const STUDENT: f64 = 4.0;
/// Jitter of ln parameters at resampling.
const JITTER: f64 = 0.05;
/// Chance, at resampling, of fresh parameters, and of a fresh slope.
const FRESH: f64 = 0.003;

struct Parameters {
    q: f64,
    eta: f64,
    sigma: f64,
    tau: f64,
    noise: f64,
}

impl Parameters {
    /// Log-uniform priors in units of the sampling interval, so that a slope watched by the minute and
    /// one watched by the month are met with the same open mind.
    fn draw(quantity: Quantity, interval_days: f64, generator: &mut impl Rng) -> Self {
        let noise = if has_zero(quantity) {
            log_uniform(generator, 0.05, 20.0)
        } else {
            log_uniform(generator, 0.01, 0.3)
        };
        Self {
            q: log_uniform(generator, 0.003, 0.15) / interval_days.sqrt(),
            eta: log_uniform(generator, 1e-6, 0.004) / interval_days.powf(1.5),
            sigma: log_uniform(generator, 0.02, 0.6),
            tau: log_uniform(generator, 2.0, 60.0) * interval_days,
            noise,
        }
    }
}

#[derive(Debug, Clone)]
pub(super) struct Particle {
    /// Inverse velocity of the law alone, day/mm.
    w: f64,
    /// Its slope, day/mm per day; positive: accelerating.
    s: f64,
    /// Log-load.
    f: f64,
    /// Displacement since the start, mm.
    x: f64,
    /// Zero of the displacement readings, mm.
    zero: f64,
    /// Days ago and displacement at the latest readings, newest first.
    past: [(f64, f64); LAGS],
    /// Relative noise of s, 1/sqrt(day).
    q: f64,
    /// Noise of s from rest, per day^1.5.
    eta: f64,
    /// Standard deviation of the load.
    sigma: f64,
    /// Memory of the load, days.
    tau: f64,
    /// Reading noise: mm for displacement, relative for velocity.
    noise: f64,
}

impl Particle {
    pub(super) fn draw(reset: &Reset, generator: &mut impl Rng) -> Self {
        let spread = if has_zero(reset.quantity) { 1.2 } else { 0.3 };
        let w = (spread * normal(generator)).exp() / reset.velocity;
        let sign = if generator.random::<bool>() {
            1.0
        } else {
            -1.0
        };
        let s = sign * w * fresh_slope(reset.interval_days, generator);
        let own = Parameters::draw(reset.quantity, reset.interval_days, generator);
        Self {
            w,
            s,
            f: own.sigma * normal(generator),
            x: 0.0,
            zero: if has_zero(reset.quantity) {
                reset.first_value + own.noise * normal(generator)
            } else {
                0.0
            },
            past: [(0.0, 0.0); LAGS],
            q: own.q,
            eta: own.eta,
            sigma: own.sigma,
            tau: own.tau,
            noise: own.noise,
        }
    }

    /// mm/day.
    pub(super) fn velocity(&self) -> f64 {
        self.f.exp() / self.w
    }

    /// Moves `days` on, in steps that resolve the acceleration. `suggested` is the velocity that the
    /// newest reading implies; returns the importance weight of having looked at it.
    pub(super) fn advance(&mut self, days: f64, suggested: f64, generator: &mut impl Rng) -> f64 {
        let weight = self.maybe_step(suggested, generator);
        let mut left = days;
        for _ in 0..12 {
            let to_failure = if self.s > 0.0 {
                self.w / (self.s * self.f.exp())
            } else {
                f64::INFINITY
            };
            let step = left
                .min((0.3 * to_failure).max(days / 8.0))
                .min((days / 2.0).max(1e-9));
            self.step(step, generator);
            left -= step;
            if left <= 1e-12 * days {
                break;
            }
        }
        if left > 1e-12 * days {
            self.step(left, generator);
        }
        self.past.rotate_right(1);
        self.past[0] = (days, self.x);
        if self.velocity() > COLLAPSED {
            0.0
        } else {
            weight
        }
    }

    /// A load step, proposed where the newest reading points and weighed by its prior.
    fn maybe_step(&mut self, suggested: f64, generator: &mut impl Rng) -> f64 {
        if suggested <= 0.0 || generator.random::<f64>() >= SUGGESTED.0 {
            return (1.0 - STEP.0) / (1.0 - SUGGESTED.0);
        }
        let z = normal(generator);
        let jump = (suggested / self.velocity()).ln() + SUGGESTED.1 * z;
        let prior = STEP.0 * student(jump / STEP.1) / STEP.1;
        // 0.3989 is the density of the standard normal at 0.
        let proposal = SUGGESTED.0 * 0.398_942 * (-0.5 * z * z).exp() / SUGGESTED.1;
        let shrink = (-jump).exp();
        self.w *= shrink;
        self.s *= shrink;
        prior / proposal
    }

    fn step(&mut self, days: f64, generator: &mut impl Rng) {
        let keep = (-days / self.tau).exp();
        let load_before = self.f;
        self.f = self.f * keep + self.sigma * (1.0 - keep * keep).sqrt() * normal(generator);
        let load = f64::midpoint(load_before, self.f).exp();
        let slope = self.s;
        self.s += (self.q * self.s.abs() + self.eta * self.w) * days.sqrt() * normal(generator);
        let fall = f64::midpoint(slope, self.s) * load * days;
        let after = (self.w - fall).max(1.0 / FASTEST);
        // The slip of a linear w: (ln w_0 - ln w_1) / (w_0 - w_1) times the load's time.
        let change = self.w - after;
        let mean_inverse = if change.abs() < 1e-9 * self.w {
            1.0 / self.w
        } else {
            (self.w / after).ln() / change
        };
        self.x += load * days * mean_inverse;
        self.w = after;
    }

    /// The density of a reading, and what the particle learns of its instrument's zero.
    pub(super) fn weigh(
        &mut self,
        how: &Dynamics,
        reading: &Observation,
        generator: &mut impl Rng,
    ) -> f64 {
        match how.quantity {
            Quantity::Velocity => {
                let predicted = if how.averaging_days > 0.0 {
                    self.trailing_mean(how.averaging_days)
                } else {
                    self.velocity()
                };
                let spread = (self.noise * predicted.max(1e-9)).hypot(reading.sigma.unwrap_or(0.0));
                // In the log where the reading is forward: the noise of a velocity is mostly relative.
                if reading.value > 0.0 && reading.sigma.is_none() {
                    student((reading.value / predicted).ln() / self.noise)
                        / (self.noise * reading.value)
                } else {
                    student((reading.value - predicted) / spread) / spread
                }
            }
            Quantity::Displacement => {
                // The stated error is often the instrument's alone.
                let spread = self.noise.hypot(reading.sigma.unwrap_or(0.0));
                let own = (1.0 - INSTRUMENT_RESET.0)
                    * student((reading.value - self.zero - self.x) / spread)
                    / spread;
                let reset = INSTRUMENT_RESET.0 / INSTRUMENT_RESET.1;
                if generator.random::<f64>() * (own + reset) < reset {
                    self.zero = reading.value - self.x + spread * normal(generator);
                }
                own + reset
            }
        }
    }

    /// Mean velocity over the trailing window, from the positions kept.
    fn trailing_mean(&self, window: f64) -> f64 {
        let mut ago = 0.0;
        let mut newer = (0.0, self.x);
        for index in 1..LAGS {
            ago += self.past[index - 1].0;
            let x = self.past[index].1;
            if ago >= window * 0.999 {
                let share = (window - newer.0) / (ago - newer.0);
                return (self.x - (newer.1 + share * (x - newer.1))) / window;
            }
            newer = (ago, x);
        }
        if newer.0 > 0.0 {
            (self.x - newer.1) / newer.0
        } else {
            self.velocity()
        }
    }

    /// Small moves of the particle's own parameters, and now and then a fresh draw: without it a cloud
    /// that has agreed on a wrong answer never leaves it.
    pub(super) fn jitter(&mut self, reset: &Reset, generator: &mut impl Rng) {
        for parameter in [
            &mut self.q,
            &mut self.eta,
            &mut self.sigma,
            &mut self.tau,
            &mut self.noise,
        ] {
            *parameter *= (JITTER * normal(generator)).exp();
        }
        if generator.random::<f64>() < FRESH {
            let own = Parameters::draw(reset.quantity, reset.interval_days, generator);
            (self.q, self.eta, self.sigma, self.tau, self.noise) =
                (own.q, own.eta, own.sigma, own.tau, own.noise);
        }
        if generator.random::<f64>() < FRESH {
            let sign = if generator.random::<bool>() {
                1.0
            } else {
                -1.0
            };
            self.s = sign * self.w * fresh_slope(reset.interval_days, generator);
        }
    }

    /// Days until the velocity passes `critical`, drawing the load and the slope's wander on the way.
    pub(super) fn days_to(
        &mut self,
        critical: f64,
        horizon: f64,
        generator: &mut impl Rng,
    ) -> Option<f64> {
        let mut days = 0.0;
        for _ in 0..400 {
            if self.velocity() >= critical {
                return Some(days);
            }
            if days >= horizon {
                return None;
            }
            let to_failure = if self.s > 0.0 {
                self.w / (self.s * self.f.exp())
            } else {
                f64::INFINITY
            };
            let step = (0.08 * days + 0.01)
                .min((0.2 * to_failure).max(1e-3))
                .min(horizon / 20.0);
            self.step(step, generator);
            days += step;
        }
        None
    }
}

/// |s| / w in 1/day: from what doubles the velocity in 70,000 intervals to what does in 35, and the
/// faster the rarer: few slopes are met in their last days.
fn fresh_slope(interval_days: f64, generator: &mut impl Rng) -> f64 {
    let (slowest, fastest) = (1e-5_f64, 0.02_f64);
    let share = generator.random::<f64>().powi(3);
    slowest * (fastest / slowest).powf(share) / interval_days
}

fn student(z: f64) -> f64 {
    // 3/8 is the density of Student's t with 4 degrees of freedom at 0.
    0.375 * (1.0 + z * z / STUDENT).powf(-0.5 * (STUDENT + 1.0))
}

fn normal(generator: &mut impl Rng) -> f64 {
    generator.sample(StandardNormal)
}

fn log_uniform(generator: &mut impl Rng, low: f64, high: f64) -> f64 {
    low * (high / low).powf(generator.random::<f64>())
}
