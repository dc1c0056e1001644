//! A particle filter of the law under an undeclared load: one bounded update a reading.
//!
//! With constant parameters the law grows sure of whatever its oldest readings say. Here each particle
//! carries the inverse velocity w of the law alone, its slope s, and a log-load f that nobody declared:
//!
//! ```text
//! dX/dt = e^f / w     dw/dt = -s e^f     ds = (q |s| + eta w) dW     f: Ornstein-Uhlenbeck (sigma, tau)
//! ```
//!
//! and its own q, eta, sigma, tau and reading noise, drawn from broad log-uniform priors. A particle may
//! also take a sudden load step, or explain a jump of a displacement reading as a reset of the
//! instrument. The generator is seeded and part of the state, so a replay draws the same numbers.

mod particle;

use super::Passage;
use crate::fit::{Observation, Observations};
use crate::reading::Quantity;
use particle::{Dynamics, Particle, Reset};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Particles carried.
const PARTICLES: usize = 2000;
/// Particles run forward for a forecast.
const FORECAST_PARTICLES: usize = 400;
/// Readings that set the scale of the priors before the first update.
const READINGS_FOR_PRIOR: usize = 3;
/// Resample when the effective number falls below this share.
const RESAMPLE_BELOW: f64 = 0.5;

/// The filter of one benchmark.
#[derive(Debug, Clone)]
pub(super) struct Filter {
    particles: Vec<Particle>,
    weights: Vec<f64>,
    generator: Pcg64,
    reset: Option<Reset>,
    now_days: f64,
}

impl Filter {
    /// A filter that has seen nothing; equal seeds draw equal numbers.
    pub(super) fn new(seed: u64) -> Self {
        Self {
            particles: Vec::new(),
            weights: Vec::new(),
            generator: Pcg64::seed_from_u64(seed),
            reset: None,
            now_days: 0.0,
        }
    }

    /// Takes in the readings that are new and returns ln of the predictive density of the newest, in
    /// the reading's own unit; `None` until the priors are set, or where nothing is new.
    pub(super) fn update(&mut self, observations: &Observations) -> Option<f64> {
        if self.particles.is_empty() {
            let first = observations.spaced(READINGS_FOR_PRIOR);
            if first.len() < READINGS_FOR_PRIOR {
                return None;
            }
            self.start(observations, &first);
        }
        let mut log_density = None;
        let new = observations
            .values
            .partition_point(|value| value.t_days <= self.now_days);
        for index in new..observations.values.len() {
            let apart = observations.values[index].t_days - self.now_days;
            if apart >= 0.999 * observations.spacing_days() {
                log_density = Some(self.take(observations, index));
            }
        }
        log_density
    }

    fn start(&mut self, observations: &Observations, first: &[Observation]) {
        let reset = Reset::from_first(&how(observations), first);
        self.particles = (0..PARTICLES)
            .map(|_| Particle::draw(&reset, &mut self.generator))
            .collect();
        self.weights = vec![1.0 / PARTICLES as f64; PARTICLES];
        self.reset = Some(reset);
        self.now_days = first[0].t_days;
    }

    fn take(&mut self, observations: &Observations, index: usize) -> f64 {
        let newest = &observations.values[index];
        let dynamics = how(observations);
        let days = newest.t_days - self.now_days;
        let suggested = suggested(observations, self.now_days, newest);
        let mut total = 0.0;
        for (particle, weight) in self.particles.iter_mut().zip(&mut self.weights) {
            *weight *= particle.advance(days, suggested, &mut self.generator);
            *weight *= particle.weigh(&dynamics, newest, &mut self.generator);
            if !weight.is_finite() {
                *weight = 0.0;
            }
            total += *weight;
        }
        self.now_days = newest.t_days;
        if total <= 0.0 {
            // No particle can explain it: begin again from here.
            let from = index.saturating_sub(READINGS_FOR_PRIOR - 1);
            self.start(observations, &observations.values[from..=index]);
            self.now_days = newest.t_days;
            return f64::NEG_INFINITY;
        }
        for weight in &mut self.weights {
            *weight /= total;
        }
        let effective = 1.0 / self.weights.iter().map(|w| w * w).sum::<f64>();
        if effective < RESAMPLE_BELOW * PARTICLES as f64 {
            self.resample();
        }
        total.ln()
    }

    /// Systematic resampling; the copies' parameters are jittered a little so that they stay apart.
    fn resample(&mut self) {
        let Some(reset) = self.reset else { return };
        let picked = self.systematic(PARTICLES);
        self.particles = picked
            .into_iter()
            .map(|index| self.particles[index].clone())
            .collect();
        for particle in &mut self.particles {
            particle.jitter(&reset, &mut self.generator);
        }
        self.weights.fill(1.0 / PARTICLES as f64);
    }

    fn systematic(&mut self, count: usize) -> Vec<usize> {
        let mut position: f64 = self.generator.random::<f64>() / count as f64;
        let (mut picked, mut reached) = (Vec::with_capacity(count), 0.0);
        for (index, weight) in self.weights.iter().enumerate() {
            reached += weight;
            while position < reached && picked.len() < count {
                picked.push(index);
                position += 1.0 / count as f64;
            }
        }
        picked.resize(count, self.weights.len() - 1);
        picked
    }

    /// Runs particles on until they pass `critical` mm/day or `horizon_days` are over; days from `now_days`.
    pub(super) fn passage(&mut self, critical: f64, horizon_days: f64, now_days: f64) -> Passage {
        if self.particles.is_empty() {
            return Passage::default();
        }
        let picked = self.systematic(FORECAST_PARTICLES);
        // Forecasts draw from a copy: how often one asks must not change what comes next.
        let mut generator = self.generator.clone();
        let share = 1.0 / FORECAST_PARTICLES as f64;
        let later = now_days - self.now_days;
        let times = picked.into_iter().filter_map(|index| {
            let mut particle = self.particles[index].clone();
            particle
                .days_to(critical, horizon_days, &mut generator)
                .map(|days| ((days - later).max(0.0), share))
        });
        Passage::from_times(times.collect())
    }
}

fn how(observations: &Observations) -> Dynamics {
    Dynamics {
        quantity: observations.quantity,
        averaging_days: observations.averaging_days,
    }
}

/// The velocity that a reading implies by itself, mm/day.
fn suggested(observations: &Observations, since_days: f64, newest: &Observation) -> f64 {
    match observations.quantity {
        Quantity::Velocity => newest.value,
        Quantity::Displacement => {
            let after = observations
                .values
                .partition_point(|value| value.t_days <= since_days);
            let before = after
                .checked_sub(1)
                .and_then(|before| observations.values.get(before));
            before.map_or(0.0, |before| {
                (newest.value - before.value) / (newest.t_days - before.t_days)
            })
        }
    }
}

/// Whether a quantity is read as an absolute position, whose zero a reset moves.
pub(super) fn has_zero(quantity: Quantity) -> bool {
    quantity == Quantity::Displacement
}
