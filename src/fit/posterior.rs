//! The posterior of the law from a window of rates, as a weighted, quasi-random sample.
//!
//! The coordinates are those of the present: velocity, slope r and curvature kappa of the inverse
//! velocity at the window's last reading. The law runs backwards from there through the readings, so
//! no sample has failed already, and a forecast starts where the slope is now. Priors: flat in ln v and
//! r, but r times the newest sampling interval normal with standard deviation 0.25 (what would be over
//! within one interval rests on one reading); kappa, times the window's length, Cauchy with scale 3; given the sign of kappa, p uniform in
//! (0, 0.6) (m from 1 to 2.5) or (-1, 0) (m from 0.5 to 1). Readings scatter by a relative error c
//! beside their own sigma, Student t with 6 degrees of freedom; correlation between neighbours lowers
//! the weight of the whole likelihood.

use super::least_squares;
use super::quasi_random::{halton, normal_quantile};
use super::rates::Rate;
use crate::model::{Accuracy, Law, Trajectory};
use nalgebra::{Matrix3, SMatrix, Vector3};

/// Whether the curvature of the inverse velocity is fitted or held at zero (the straight line).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Curvature {
    /// The full law.
    Free,
    /// kappa = 0: the line through inverse velocity.
    Zero,
}

/// One law out of the posterior, with t = 0 at the present.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// The law.
    pub law: Law,
    /// Its share of the probability.
    pub weight: f64,
}

/// A weighted sample of laws that agree with the readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    /// The present: the time of the last reading used, days.
    pub now_days: f64,
    /// The laws; their weights sum to 1.
    pub samples: Vec<Sample>,
    /// Relative scatter of a rate about the law.
    pub scatter: f64,
}

/// The posterior and how it came about.
#[derive(Debug, Clone, PartialEq)]
pub struct Posterior {
    /// The laws.
    pub ensemble: Ensemble,
    /// Start of the first rate used, days.
    pub from_days: f64,
    /// Solutions of the law that were computed.
    pub evaluations: usize,
    mode: [f64; 3],
}

/// Degrees of freedom of the reading errors: tails that an outlier can live in.
const STUDENT: f64 = 6.0;
/// Scale of the prior on kappa times the window's length.
const KAPPA_SCALE: f64 = 3.0;
/// Standard deviation of the prior on r times the newest sampling interval.
const SLOPE_PER_INTERVAL: f64 = 0.25;
/// Prior relative scatter, and the number of readings it counts for.
const PRIOR_SCATTER: (f64, f64) = (0.1, 3.0);
/// The most that the likelihood is trusted: parameters are not constant over years, as the law has them.
const MOST_TRUST: f64 = 0.35;
/// The prior of p spans this, m from 0.5 to 2.5.
pub const P_PRIOR: (f64, f64) = (-1.0, 0.6);
/// The mode is where a proposal is centred: this share of the cost is fine enough.
const MODE_GAIN: f64 = 1e-5;
/// Samples drawn.
const SAMPLES: u32 = 96;
/// Proposal widths: the Laplace approximation's own, and twice it, in equal parts.
const WIDTHS: [f64; 2] = [1.0, 2.2];

impl Posterior {
    /// Fits `rates`; `warm` is an earlier posterior of the same benchmark to start from.
    /// `None` when there are too few rates or none of them moves.
    pub fn fit(rates: &[Rate], curvature: Curvature, warm: Option<&Self>) -> Option<Self> {
        let unknowns = if curvature == Curvature::Free { 3 } else { 2 };
        if rates.len() < unknowns + 2 {
            return None;
        }
        let mut problem = Problem::new(rates, curvature)?;
        let mut evaluations = 0;
        let mut mode = None;
        let starts = problem.starts(warm);
        let rounds = if warm.is_some() { 2 } else { 3 };
        for _ in 0..rounds {
            let from: Vec<Vector3<f64>> = mode.map_or_else(|| starts.clone(), |m: Mode| vec![m.at]);
            let found = from.iter().filter_map(|start| problem.mode(start));
            let best = found
                .inspect(|m| evaluations += m.evaluations)
                .min_by(|a, b| a.cost.total_cmp(&b.cost))?;
            problem.learn_noise(&best.at);
            mode = Some(best);
        }
        let mode = mode?;
        let samples = problem.sample(&mode);
        evaluations += samples.len();
        if samples.is_empty() {
            return None;
        }
        Some(Self {
            ensemble: Ensemble {
                now_days: problem.now,
                samples,
                scatter: problem.scatter,
            },
            from_days: rates.first()?.from,
            evaluations,
            mode: [
                mode.at[0],
                mode.at[1] / problem.length,
                mode.at[2] / problem.length,
            ],
        })
    }
}

struct Problem<'a> {
    rates: &'a [Rate],
    curvature: Curvature,
    now: f64,
    length: f64,
    interval: f64,
    scatter: f64,
    temper: f64,
    robust: Vec<f64>,
}

#[derive(Clone, Copy)]
struct Mode {
    at: Vector3<f64>,
    cost: f64,
    information: Matrix3<f64>,
    evaluations: usize,
}

impl<'a> Problem<'a> {
    fn new(rates: &'a [Rate], curvature: Curvature) -> Option<Self> {
        let (first, last) = (rates.first()?, rates.last()?);
        let length = last.to - first.from;
        let moves = rates.iter().any(|rate| rate.velocity > 0.0);
        (length > 0.0 && moves).then(|| Self {
            rates,
            curvature,
            now: last.to,
            length,
            interval: newest_interval(rates),
            scatter: PRIOR_SCATTER.0,
            temper: 1.0,
            robust: vec![1.0; rates.len()],
        })
    }

    /// Where to look from: the mode found last time, and a line through the recent and the older velocity.
    fn starts(&self, warm: Option<&Posterior>) -> Vec<Vector3<f64>> {
        let mean = |rates: &[Rate]| {
            let velocities = rates.iter().map(|rate| rate.velocity.max(0.0));
            velocities.sum::<f64>() / rates.len().max(1) as f64
        };
        let count = self.rates.len();
        let all = mean(self.rates).max(1e-6);
        let recent = mean(&self.rates[count - (count / 6).max(1)..]).max(0.05 * all);
        let older = mean(&self.rates[..(count / 3).max(1)]).max(0.02 * all);
        let slope = (recent / older - 1.0).clamp(-0.7, 50.0);
        let mut starts: Vec<Vector3<f64>> = vec![Vector3::new(recent.ln(), slope, 0.0)];
        match warm {
            Some(warm) => starts.push(Vector3::new(
                warm.mode[0],
                warm.mode[1] * self.length,
                warm.mode[2] * self.length,
            )),
            None => starts.push(Vector3::new(all.ln(), 0.0, 0.0)),
        }
        starts
    }

    fn law(&self, at: &Vector3<f64>, p: f64) -> Law {
        let kappa = if self.curvature == Curvature::Free {
            at[2] / self.length
        } else {
            0.0
        };
        Law::from_fit(at[0].exp(), at[1] / self.length, kappa, p)
    }

    /// Predicted rates, or false where the law had an infinite velocity within the window.
    fn predict(&self, law: &Law, out: &mut [f64]) -> bool {
        let span = self.now - self.rates[0].from;
        let past = Trajectory::solve(&law.reversed(), span, Accuracy::Fit);
        for (slot, rate) in out.iter_mut().zip(self.rates) {
            let ago = (self.now - rate.from, self.now - rate.to);
            let Some(start) = past.at(ago.0) else {
                return false;
            };
            *slot = if ago.0 > ago.1 {
                let Some(end) = past.at(ago.1) else {
                    return false;
                };
                (start.displacement - end.displacement) / (ago.0 - ago.1)
            } else {
                start.velocity
            };
            if !slot.is_finite() {
                return false;
            }
        }
        true
    }

    fn spread(&self, rate: &Rate, predicted: f64) -> f64 {
        rate.sigma
            .hypot(self.scatter * predicted)
            .max(1e-9 * rate.velocity.abs())
            .max(1e-300)
    }

    /// Residuals in the log where a rate stands clear of its noise would favour neither side of an
    /// acceleration; scaled by the predicted spread they would reward a fast model: so the spread is
    /// taken at the geometric middle of reading and prediction.
    fn residual(&self, rate: &Rate, predicted: f64) -> f64 {
        let scale = if rate.velocity > 0.0 {
            (rate.velocity * predicted).sqrt()
        } else {
            predicted
        };
        (rate.velocity - predicted) / self.spread(rate, scale)
    }

    /// How far the present slope r outruns the sampling, in prior standard deviations: an acceleration
    /// that would be over within the newest interval rests on one reading.
    fn unresolved(&self, r_length: f64) -> f64 {
        r_length / self.length * self.interval / SLOPE_PER_INTERVAL
    }

    fn mode(&self, start: &Vector3<f64>) -> Option<Mode> {
        match self.curvature {
            Curvature::Free => self.search::<3>(start),
            Curvature::Zero => self.search::<2>(start),
        }
    }

    fn search<const N: usize>(&self, start: &Vector3<f64>) -> Option<Mode> {
        let widen = |at: &nalgebra::SVector<f64, N>| {
            Vector3::from_fn(|i, _| if i < N { at[i] } else { 0.0 })
        };
        let count = self.rates.len();
        let mut predicted = vec![0.0; count];
        let optimum = least_squares::minimise(
            nalgebra::SVector::<f64, N>::from_fn(|i, _| start[i]),
            count + 2,
            &least_squares::Limits::evaluations(60).to_gain(MODE_GAIN),
            |at, out| {
                let at = widen(at);
                if !self.predict(&self.law(&at, 0.0), &mut predicted) {
                    return false;
                }
                for (i, rate) in self.rates.iter().enumerate() {
                    out[i] = self.robust[i].sqrt() * self.residual(rate, predicted[i]);
                }
                // The Cauchy prior as one more residual.
                out[count] = (2.0 * (at[2] / KAPPA_SCALE).powi(2).ln_1p()).sqrt();
                out[count + 1] = self.unresolved(at[1]);
                true
            },
        )?;
        let mut information = Matrix3::identity();
        information
            .view_mut((0, 0), (N, N))
            .copy_from(&optimum.information);
        let evaluations = optimum.evaluations;
        Some(Mode {
            at: widen(&optimum.at),
            cost: optimum.cost,
            information,
            evaluations,
        })
    }

    /// Re-estimates the relative scatter, the weights of outliers and the correlation from the residuals.
    fn learn_noise(&mut self, at: &Vector3<f64>) {
        let mut predicted = vec![0.0; self.rates.len()];
        if !self.predict(&self.law(at, 0.0), &mut predicted) {
            return;
        }
        let residuals: Vec<f64> = self
            .rates
            .iter()
            .zip(&predicted)
            .map(|(rate, p)| self.residual(rate, *p))
            .collect();
        self.robust = residuals
            .iter()
            .map(|z| (STUDENT + 1.0) / (STUDENT + z * z))
            .collect();
        let mut excess = PRIOR_SCATTER.0.powi(2) * PRIOR_SCATTER.1;
        let mut count = PRIOR_SCATTER.1;
        for ((rate, p), weight) in self.rates.iter().zip(&predicted).zip(&self.robust) {
            let scale = (rate.velocity.max(0.0) * p).sqrt().max(0.1 * p);
            let relative = ((rate.velocity - p).powi(2) * weight - rate.sigma.powi(2)).max(0.0)
                / scale.powi(2);
            // A rate that is mostly reading noise says little about the scatter of the motion.
            let tells = (scale / (scale + 3.0 * rate.sigma)).powi(2);
            excess += tells * relative.min(4.0);
            count += tells;
        }
        self.scatter = (excess / count).sqrt().max(0.01);
        self.temper = temper(&residuals);
    }

    fn log_likelihood(&self, law: &Law, predicted: &mut [f64]) -> Option<f64> {
        if !self.predict(law, predicted) {
            return None;
        }
        let one = |(rate, p): (&Rate, &f64)| {
            let z = self.residual(rate, *p);
            -0.5 * (STUDENT + 1.0) * (z * z / STUDENT).ln_1p()
        };
        Some(self.rates.iter().zip(predicted.iter()).map(one).sum())
    }

    /// Importance sampling about the mode.
    fn sample(&self, mode: &Mode) -> Vec<Sample> {
        let dimensions = if self.curvature == Curvature::Free {
            3
        } else {
            2
        };
        let Some(root) = proposal_root(&mode.information, self.temper, dimensions) else {
            return Vec::new();
        };
        let mut predicted = vec![0.0; self.rates.len()];
        let mut drawn: Vec<(Law, f64)> = Vec::new();
        for index in 0..SAMPLES {
            let u = halton(index);
            let width = WIDTHS[index as usize % 2];
            let z = Vector3::from_fn(|i, _| {
                if i < dimensions {
                    normal_quantile(u[i]) * width
                } else {
                    0.0
                }
            });
            let at = mode.at + root * z;
            let p = match self.curvature {
                Curvature::Zero => 0.0,
                Curvature::Free if at[2] > 0.0 => P_PRIOR.1 * u[3],
                Curvature::Free => P_PRIOR.0 * u[3],
            };
            let law = self.law(&at, p);
            // b and m have one sign: where the law would need S < 0 there is none.
            if p != 0.0 && law.a + law.r <= 0.0 {
                continue;
            }
            let Some(log_likelihood) = self.log_likelihood(&law, &mut predicted) else {
                continue;
            };
            let prior =
                -(at[2] / KAPPA_SCALE).powi(2).ln_1p() - 0.5 * self.unresolved(at[1]).powi(2);
            let log_weight =
                self.temper * log_likelihood + prior - log_proposal(z.norm_squared(), dimensions);
            drawn.push((law, log_weight));
        }
        normalise(drawn)
    }
}

/// The longest of the last three spacings between rates, days.
fn newest_interval(rates: &[Rate]) -> f64 {
    let newest = &rates[rates.len().saturating_sub(4)..];
    newest
        .windows(2)
        .map(|pair| pair[1].to - pair[0].to)
        .fold(0.0, f64::max)
}

/// The share of the likelihood that correlated residuals are worth: (1 - rho) / (1 + rho).
fn temper(residuals: &[f64]) -> f64 {
    let squares: f64 = residuals.iter().map(|z| z.clamp(-4.0, 4.0).powi(2)).sum();
    let products: f64 = residuals
        .windows(2)
        .map(|w| w[0].clamp(-4.0, 4.0) * w[1].clamp(-4.0, 4.0))
        .sum();
    if squares <= 0.0 {
        return 1.0;
    }
    let rho = (products / squares).clamp(0.0, 0.95);
    MOST_TRUST.min((1.0 - rho) / (1.0 + rho))
}

/// A square root of the proposal's covariance.
fn proposal_root(
    information: &Matrix3<f64>,
    temper: f64,
    dimensions: usize,
) -> Option<Matrix3<f64>> {
    let mut ridge = *information * temper;
    for i in 0..3 {
        ridge[(i, i)] += if i < dimensions { 1e-3 } else { 1.0 };
    }
    let covariance: SMatrix<f64, 3, 3> = ridge.try_inverse()?;
    covariance.cholesky().map(|cholesky| cholesky.l())
}

/// ln of the proposal density, up to a constant, at squared radius `z2` in units of the root.
fn log_proposal(z2: f64, dimensions: usize) -> f64 {
    let n = f64::from(u32::try_from(dimensions).unwrap_or(3));
    let mixture: f64 = WIDTHS
        .iter()
        .map(|w| (-0.5 * z2 / (w * w)).exp() / w.powf(n))
        .sum();
    mixture.max(1e-300).ln()
}

fn normalise(drawn: Vec<(Law, f64)>) -> Vec<Sample> {
    let highest = drawn
        .iter()
        .map(|(_, w)| *w)
        .fold(f64::NEG_INFINITY, f64::max);
    if !highest.is_finite() {
        return Vec::new();
    }
    let total: f64 = drawn.iter().map(|(_, w)| (w - highest).exp()).sum();
    let weigh = |(law, w): (Law, f64)| Sample {
        law,
        weight: (w - highest).exp() / total,
    };
    drawn
        .into_iter()
        .map(weigh)
        .filter(|sample| sample.weight > 1e-9)
        .collect()
}
