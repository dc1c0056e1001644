//! The linear filter of ln v less the law, from the present into the past: how much each rate moves it.
//!
//! The state is the load f, the level l of ln v about the law, and two things of today that stay: ln v and
//! f. Variances do not depend on what is read, so a table of gains serves every shape.

use super::DRIFT;

/// The rates as the filter sees them.
#[derive(Debug, Clone)]
pub(super) struct RateRecord {
    /// ln of the velocity less `centre`, oldest first, and its standard error.
    pub(super) ln_velocity: Vec<f64>,
    pub(super) error: Vec<f64>,
    /// Days before the present: middle, start and end of each rate.
    pub(super) middle: Vec<f64>,
    pub(super) from: Vec<f64>,
    pub(super) to: Vec<f64>,
    pub(super) centre: f64,
    /// Weight of each rate, 1 but for outliers.
    pub(super) trust: Vec<f64>,
}

/// One guess at the load and at the scatter of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct LoadNoise {
    pub(super) scatter: f64,
    pub(super) sigma: f64,
    /// LoadMemory of the load, days.
    pub(super) tau: f64,
    pub(super) ln_evidence: f64,
}

/// Prior variance of a level of ln v.
pub(super) const LEVEL_VARIANCE: f64 = 4.0;

/// What one rate moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gain {
    /// The share of the load that is left from the rate after it.
    pub(super) keep: f64,
    pub(super) load: f64,
    pub(super) level: f64,
    pub(super) velocity_now: f64,
    pub(super) load_now: f64,
    /// One over the variance of the innovation.
    pub(super) precision: f64,
}

/// Gains for every rate, newest first.
#[derive(Debug, Clone)]
pub(super) struct Gains {
    pub(super) steps: Vec<Gain>,
    /// Sum of -ln(variance)/2 up to each rate.
    pub(super) ln_normaliser: Vec<f64>,
    /// Variances of ln v and f of today, and their covariance, after each rate.
    pub(super) today: Vec<[f64; 3]>,
}

impl RateRecord {
    /// The variance of a rate's error.
    pub(super) fn variance(&self, index: usize, scatter: f64) -> f64 {
        (self.error[index].powi(2) + scatter * scatter) / self.trust[index]
    }
}

/// What a noise makes of the times of a record, whatever the law: newest rate first.
#[derive(Debug, Clone)]
pub(super) struct LoadMemory {
    noise: LoadNoise,
    /// The share of the load that is left from the rate after it.
    keep: Vec<f64>,
    /// What the load's variance loses in the mean over each rate.
    smoothed: Vec<f64>,
}

impl LoadMemory {
    pub(super) fn new(record: &RateRecord, noise: &LoadNoise) -> Self {
        let variance = noise.sigma * noise.sigma;
        let mut ago = 0.0;
        let (mut keep, mut smoothed) = (Vec::new(), Vec::new());
        for index in (0..record.middle.len()).rev() {
            let days = (record.middle[index] - ago).max(0.0);
            ago = record.middle[index];
            keep.push((-days / noise.tau).exp());
            let width = (record.from[index] - record.to[index]) / noise.tau;
            smoothed.push(variance * (1.0 - variance_of_mean(width)));
        }
        Self {
            noise: *noise,
            keep,
            smoothed,
        }
    }
}

impl Gains {
    /// `u`: ln(1 + |r| t) at the middle of each rate, oldest first.
    pub(super) fn new(record: &RateRecord, memory: &LoadMemory, u: &[f64]) -> Self {
        let noise = &memory.noise;
        let count = record.middle.len();
        let variance = noise.sigma * noise.sigma;
        // Load, level, velocity of today, load of today.
        let (f, l) = (variance, LEVEL_VARIANCE);
        let mut p = [
            [f, 0.0, f, f],
            [0.0, l, l, 0.0],
            [f, l, l + f, f],
            [f, 0.0, f, f],
        ];
        let mut gains = Self {
            steps: Vec::with_capacity(count),
            ln_normaliser: Vec::with_capacity(count),
            today: Vec::with_capacity(count),
        };
        let (mut u_before, mut normaliser) = (0.0, 0.0);
        let of_time = memory.keep.iter().zip(&memory.smoothed);
        for (index, (keep, smoothed)) in (0..count).rev().zip(of_time) {
            let keep = *keep;
            let e_folds = (u[index] - u_before).max(0.0);
            u_before = u[index];
            for slot in &mut p[0] {
                *slot *= keep;
            }
            p[0][0] = keep * p[0][0] + variance * (1.0 - keep * keep);
            (p[1][0], p[2][0], p[3][0]) = (p[0][1], p[0][2], p[0][3]);
            p[1][1] += DRIFT * DRIFT * e_folds;
            let error = record.variance(index, noise.scatter);
            let h: [f64; 4] = std::array::from_fn(|i| p[0][i] + p[1][i]);
            let s = (h[0] + h[1] + error - smoothed).max(error).max(1e-12);
            normaliser -= 0.5 * s.ln();
            gains.steps.push(Gain {
                keep,
                load: h[0] / s,
                level: h[1] / s,
                velocity_now: h[2] / s,
                load_now: h[3] / s,
                precision: 1.0 / s,
            });
            gains.ln_normaliser.push(normaliser);
            for (i, row) in p.iter_mut().enumerate() {
                for (j, slot) in row.iter_mut().enumerate() {
                    *slot -= h[i] * h[j] / s;
                }
            }
            gains.today.push([p[2][2], p[3][3], p[2][3]]);
        }
        gains
    }
}

/// The variance of the mean of an Ornstein-Uhlenbeck process over `width` memories, over its variance.
fn variance_of_mean(width: f64) -> f64 {
    if width > 1e-3 {
        2.0 * (width - 1.0 + (-width).exp()) / (width * width)
    } else {
        1.0
    }
}
