//! Whether a residual can be distinguished from noise: runs, autocorrelation with gaps, and the undeclared load that is left in it.

use super::frame::Frame;
use super::noise::{Memory, Whitener};
use super::problem::Problem;
use super::refit::{Fitted, jacobian};
use super::term::Scratch;
use crate::reading::{NORMAL_MEDIAN, Quantity};
use statrs::function::erf::erfc;
use statrs::function::gamma::checked_gamma_ur;

/// An undeclared load this many of its standard errors from nothing is structure.
const CLEAR: f64 = 3.0;
/// The newest innovations that are looked at together, at most.
const NEWEST: usize = 3;
/// A resolution of more than so many standard deviations is coarse.
const COARSE: f64 = 1.0;
/// Lags of the autocorrelation.
pub(super) const LAGS: usize = 20;

/// p-value of the runs test of signs about the median (Wald and Wolfowitz); `None` with too few of either sign. `step` is that of the readings' resolution, in
/// standard deviations: what lies within half of it from the median has no sign, and where it is more than one, all signs are those of the law's own slow motion
/// past the steps.
pub(super) fn runs(innovations: &[f64], step: f64) -> Option<f64> {
    if step > COARSE {
        return None;
    }
    let middle = super::quantiles::upper_median(innovations.to_vec());
    let signs: Vec<bool> = innovations
        .iter()
        .filter(|u| (**u - middle).abs() > 0.5 * step)
        .map(|u| *u > middle)
        .collect();
    let above = signs.iter().filter(|up| **up).count() as f64;
    let below = signs.len() as f64 - above;
    let n = above + below;
    if above < 8.0 || below < 8.0 {
        return None;
    }
    let runs = 1.0 + signs.windows(2).filter(|pair| pair[0] != pair[1]).count() as f64;
    let mean = 1.0 + 2.0 * above * below / n;
    let variance = (mean - 1.0) * (mean - 2.0) / (n - 1.0);
    Some(two_sided((runs - mean) / variance.sqrt()))
}

/// Autocorrelation by lags of the median spacing, from 0; pairs of readings count where they are that far apart.
pub(super) fn autocorrelation(problem: &Problem, innovations: &[f64]) -> Vec<f64> {
    products(problem, innovations)
        .into_iter()
        .map(|(r, _)| r)
        .collect()
}

/// p-value of the test of Stoffer and Toloi (1992): Ljung and Box's with each lag weighed by the pairs there are.
pub(super) fn stoffer_toloi(problem: &Problem, innovations: &[f64]) -> Option<f64> {
    if innovations.len() < 3 * LAGS {
        return None;
    }
    let n = innovations.len() as f64;
    let each = products(problem, innovations);
    let sum: f64 = each[1..]
        .iter()
        .map(|(r, pairs)| {
            if *pairs > 0.0 {
                r * r * (n + 2.0) * n / pairs.max(1.0) * (pairs / n).powi(2)
            } else {
                0.0
            }
        })
        .sum();
    Some(chi_square_tail(sum, LAGS as f64))
}

/// (correlation, pairs) by lag.
fn products(problem: &Problem, innovations: &[f64]) -> Vec<(f64, f64)> {
    let n = innovations.len();
    let mean = innovations.iter().sum::<f64>() / n as f64;
    let variance = innovations.iter().map(|u| (u - mean).powi(2)).sum::<f64>() / n as f64;
    let mut sums = vec![(0.0, 0.0); LAGS + 1];
    for i in 0..n {
        for j in i..n.min(i + LAGS + 1) {
            let lag = (problem.t[j] - problem.t[i]) / problem.spacing;
            let whole = lag.round();
            if whole > LAGS as f64 || (lag - whole).abs() > 0.35 {
                continue;
            }
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "between 0 and LAGS"
            )]
            let slot = &mut sums[whole as usize];
            slot.0 += (innovations[i] - mean) * (innovations[j] - mean) / variance.max(1e-300);
            slot.1 += 1.0;
        }
    }
    let correlation = |(sum, pairs): (f64, f64)| (sum / pairs.max(1.0), pairs);
    sums.into_iter().map(correlation).collect()
}

/// The probability that a standard normal number is as far from 0 as `z`, or farther.
fn two_sided(z: f64) -> f64 {
    erfc(z.abs() * std::f64::consts::FRAC_1_SQRT_2)
}

/// P(chi-square of k degrees > x).
fn chi_square_tail(x: f64, k: f64) -> f64 {
    checked_gamma_ur(0.5 * k, 0.5 * x).unwrap_or(1.0)
}

/// The likeliest noise models of a fit, with and without a load in them.
pub(super) struct Judged<'a> {
    /// Without an undeclared load: white, or remembered by the reading.
    pub(super) plain: &'a Whitener,
    /// White alone.
    pub(super) white_bic: f64,
    pub(super) plain_bic: f64,
    /// With one; `None` where the sampling leaves it no room.
    pub(super) load: Option<(&'a Whitener, f64)>,
}

impl<'a> Judged<'a> {
    /// Of a fit's own residual, what its parameters can still take projected out.
    pub(super) fn of(
        problem: &Problem,
        fitted: &Fitted,
        bank: &'a [Whitener],
        scratch: &mut Scratch,
    ) -> Option<Self> {
        let columns = jacobian(problem, fitted, scratch);
        let residual = fitted.residual(problem);
        let deviance = |whitener: &Whitener| {
            let frame = Frame::new(whitener.clone(), &residual, &columns);
            frame.deviance(frame.misfit) + frame.cost()
        };
        let best = |of: &dyn Fn(Memory) -> bool| {
            let own = bank.iter().filter(|whitener| of(whitener.noise.memory));
            own.map(|whitener| (whitener, deviance(whitener)))
                .min_by(|a, b| a.1.total_cmp(&b.1))
        };
        let (plain, plain_bic) = best(&|memory| memory != Memory::Load)?;
        Some(Self {
            plain,
            plain_bic,
            white_bic: best(&|memory| memory == Memory::None)?.1,
            load: best(&|memory| memory == Memory::Load),
        })
    }

    /// How much of the BIC an undeclared load still takes.
    pub(super) fn load_gain(&self) -> f64 {
        self.load.map_or(0.0, |(_, bic)| self.plain_bic - bic)
    }

    /// How much of it noise that the reading remembers takes over white noise.
    pub(super) fn memory_gain(&self) -> f64 {
        self.white_bic - self.plain_bic
    }
}

/// Posterior mean and standard deviation of the undeclared log-load at each fitted reading: the filter forwards,
/// then Rauch, Tung and Striebel's smoother backwards.
pub(super) fn undeclared_load(
    problem: &Problem,
    fitted: &Fitted,
    whitener: &Whitener,
) -> Vec<(f64, f64)> {
    let residual = fitted.residual(problem);
    let misfit: f64 = whitener.innovations(&residual).iter().map(|u| u * u).sum();
    let sigma = whitener.sigma(misfit);
    // From units of the state to e-folds.
    let typical = problem.typical_velocity();
    let e_folds = match problem.quantity {
        Quantity::Displacement => whitener.noise.ratio * sigma / (typical * whitener.noise.days),
        Quantity::Velocity => whitener.noise.ratio * sigma / typical,
    };
    let scaled: Vec<f64> = residual.iter().map(|e| e / sigma).collect();
    let smoothed = whitener.smooth(problem, &scaled);
    smoothed
        .into_iter()
        .map(|(mean, variance)| (mean * e_folds, variance.max(0.0).sqrt() * e_folds))
        .collect()
}

/// Whether an undeclared load, (mean, standard deviation), stands clear of nothing.
pub(super) fn is_clear((f, s): (f64, f64)) -> bool {
    f.abs() > CLEAR * s && s > 0.0
}

/// Standard deviation of an undeclared load over the readings, its own uncertainty counted.
pub(super) fn load_sd(load: &[(f64, f64)]) -> f64 {
    let squares = load.iter().map(|(f, s)| f * f + s * s).sum::<f64>();
    (squares / load.len().max(1) as f64).sqrt()
}

/// How far the last innovations, one to three of them, stand from nothing together: in standard deviations, taken from the median size of
/// those before them.
pub(super) fn newest_off(innovations: &[f64]) -> f64 {
    let off = |count: usize| {
        let (before, newest) = innovations.split_at(innovations.len().saturating_sub(count));
        let sizes = before.iter().map(|u| u.abs()).collect();
        let deviation = super::quantiles::upper_median(sizes) / NORMAL_MEDIAN;
        newest.iter().sum::<f64>().abs() / (newest.len() as f64).sqrt() / deviation.max(1e-300)
    };
    (1..=NEWEST).map(off).fold(0.0, f64::max)
}

/// Innovations of a fit under one noise model.
pub(super) fn innovations(problem: &Problem, fitted: &Fitted, whitener: &Whitener) -> Vec<f64> {
    whitener.innovations(&fitted.residual(problem))
}

#[cfg(test)]
mod tests;
