//! How readings scatter about the law: a white part, a part that remembers, and the reading's own error.
//!
//! In the scale of [`super::window`] the residual of rate k is
//!
//! ```text
//! e_k = l_k u_k + white + g_k (d_k - d_(k-1))
//! ```
//!
//! with u an Ornstein-Uhlenbeck process of the motion, a white relative scatter and the reading's own
//! error; rates that are differences of displacement share the error d of the reading between them. A
//! scalar filter gives the likelihood in one pass over the rates, gaps included; innovations are Student t
//! with [`STUDENT`] degrees of freedom, so that an outlier neither decides nor is remembered.

use super::prior::{self, SLOW_SHARES, WITHOUT_MEMORY};
use super::window::Window;
use nalgebra::{Matrix4, Vector4};

/// Degrees of freedom of the innovations.
const STUDENT: f64 = 7.0;
/// Squares of standardised innovations end here: beyond, all are the same outlier.
const FARTHEST: f64 = 1e8;
/// ScatterStep of the derivatives in ln size, and the least curvature that a step there assumes.
const SIZE_STEP: f64 = 0.1;
const LEAST_SIZE_BEND: f64 = 1.0;
/// Rates whose densities are multiplied before the logarithm: the least is 1e-18, the most 1e8.
const TOGETHER: usize = 8;
/// Correlation times tried for each slow share.
const MEMORIES: u32 = 4;

/// The make-up of the scatter apart from its size: how much of it remembers, and for how long.
#[derive(Debug, Clone)]
pub(super) struct Texture {
    /// The slow part's share of the variance.
    pub(super) slow: f64,
    pub(super) log_prior: f64,
    steps: Vec<ScatterStep>,
}

/// What happens to the slow part between two rates, and how it enters the rate.
#[derive(Debug, Clone, Copy)]
struct ScatterStep {
    keep: f64,
    load: f64,
}

/// The textures that the posterior averages over.
pub(super) fn textures(window: &Window) -> Vec<Texture> {
    let mut textures = vec![Texture::new(window, 0.0, 1.0, WITHOUT_MEMORY)];
    let (shortest, longest) = window.memories_days();
    let each = (1.0 - WITHOUT_MEMORY) / f64::from(MEMORIES) / SLOW_SHARES.len() as f64;
    for slow in SLOW_SHARES {
        for index in 0..MEMORIES {
            // The middles of equal parts of the log.
            let share = (f64::from(index) + 0.5) / f64::from(MEMORIES);
            let memory = shortest * (longest / shortest).powf(share);
            textures.push(Texture::new(window, slow, memory, each));
        }
    }
    textures
}

/// A few of all textures, for a first look: white, and slow ones of two kinds.
pub(super) fn few(textures: &[Texture]) -> Vec<Texture> {
    let third = textures.len() / 3;
    let chosen = [0, textures.len() - third, textures.len() - 1];
    chosen.map(|index| textures[index].clone()).to_vec()
}

/// The filter's belief about the slow part and about the error of the reading between two rates.
#[derive(Debug, Clone, Copy)]
struct Belief {
    slow: f64,
    end: f64,
    slow_end: f64,
}

/// What the filter does with one rate.
#[derive(Debug, Clone, Copy)]
struct ScatterGain {
    variance: f64,
    slow: f64,
    end: f64,
}

/// The normal equations of a Gauss-Newton step, J^T W J and J^T W e.
#[derive(Debug, Clone, Copy)]
pub(super) struct NormalMoments {
    pub(super) information: Matrix4<f64>,
    pub(super) gradient: Vector4<f64>,
}

impl Texture {
    fn new(window: &Window, slow: f64, memory_days: f64, prior: f64) -> Self {
        let mut before: Option<f64> = None;
        let step = |rate: &super::window::SeenRate| {
            let middle = f64::midpoint(rate.older, rate.newer);
            let gap = before.map_or(f64::INFINITY, |before| (before - middle).max(0.0));
            before = Some(middle);
            // The mean of the slow part over an interval scatters less than the slow part.
            let x = (rate.older - rate.newer) / memory_days;
            let mean = if x > 1e-3 {
                2.0 * (x + (-x).exp_m1()) / (x * x)
            } else {
                1.0
            };
            ScatterStep {
                keep: (-gap / memory_days).exp(),
                load: rate.load * mean.sqrt(),
            }
        };
        Self {
            slow,
            log_prior: prior.ln(),
            steps: window.seen.iter().map(step).collect(),
        }
    }

    /// ln of the likelihood of the residuals, up to a constant that no parameter changes.
    pub(super) fn log_likelihood(&self, window: &Window, residuals: &[f64], size: f64) -> f64 {
        let (mut sum, mut mean) = (0.0, [0.0; 2]);
        // Products of a few, because a logarithm costs more than all the rest.
        let (mut variances, mut tails) = (1.0, 1.0);
        let mut belief = Belief::start(size * size * self.slow);
        for (index, (rate, step)) in window.seen.iter().zip(&self.steps).enumerate() {
            let gain = belief.predict(rate, step, size * size, self.slow);
            mean[0] *= step.keep;
            let innovation = residuals[index] - step.load * mean[0] + rate.ends * mean[1];
            let z2 = (innovation * innovation / gain.variance).min(FARTHEST);
            let weight = ((STUDENT + 1.0) / (STUDENT + z2)).min(1.0);
            variances *= gain.variance;
            tails *= 1.0 + z2 / STUDENT;
            if index % TOGETHER == TOGETHER - 1 {
                sum += variances.ln() + (STUDENT + 1.0) * tails.ln();
                (variances, tails) = (1.0, 1.0);
            }
            mean[0] += gain.slow * weight * innovation;
            mean[1] = gain.end * weight * innovation;
            belief.update(&gain, weight);
        }
        -0.5 * (sum + variances.ln() + (STUDENT + 1.0) * tails.ln())
    }

    /// The normal equations about these residuals, whose derivatives are `columns`.
    pub(super) fn normal(
        &self,
        window: &Window,
        residuals: &[f64],
        columns: &[Vec<f64>; 4],
        size: f64,
    ) -> NormalMoments {
        let mut information = Matrix4::zeros();
        let mut gradient = Vector4::zeros();
        let mut means = [[0.0; 2]; 5];
        let mut belief = Belief::start(size * size * self.slow);
        for (index, (rate, step)) in window.seen.iter().zip(&self.steps).enumerate() {
            let gain = belief.predict(rate, step, size * size, self.slow);
            let mut z = [0.0; 5];
            for (column, mean) in means.iter_mut().enumerate() {
                mean[0] *= step.keep;
                let value = if column == 4 {
                    residuals[index]
                } else {
                    columns[column][index]
                };
                z[column] = value - step.load * mean[0] + rate.ends * mean[1];
            }
            let z2 = z[4] * z[4] / gain.variance;
            let weight = ((STUDENT + 1.0) / (STUDENT + z2)).min(1.0);
            for (mean, innovation) in means.iter_mut().zip(z) {
                mean[0] += gain.slow * weight * innovation;
                mean[1] = gain.end * weight * innovation;
            }
            belief.update(&gain, weight);
            let share = weight / gain.variance;
            for i in 0..4 {
                gradient[i] += share * z[i] * z[4];
                for j in 0..=i {
                    information[(i, j)] += share * z[i] * z[j];
                }
            }
        }
        for i in 0..4 {
            for j in 0..i {
                information[(j, i)] = information[(i, j)];
            }
        }
        NormalMoments {
            information,
            gradient,
        }
    }

    /// ln of the most probable size of the scatter given these residuals, and its standard error: Newton's
    /// method on the likelihood itself, `steps` of them.
    pub(super) fn size(
        &self,
        window: &Window,
        residuals: &[f64],
        start: f64,
        steps: u32,
    ) -> (f64, f64) {
        let value = |log_size: f64| {
            self.log_likelihood(window, residuals, log_size.exp()) + prior::log_size(log_size)
        };
        let mut at = start;
        let mut spread = SIZE_STEP;
        for _ in 0..steps {
            let (less, here, more) = (value(at - SIZE_STEP), value(at), value(at + SIZE_STEP));
            let slope = (more - less) / (2.0 * SIZE_STEP);
            let bend = (2.0 * here - more - less) / (SIZE_STEP * SIZE_STEP);
            let bend = bend.max(LEAST_SIZE_BEND);
            at = (at + (slope / bend).clamp(-1.0, 1.0)).clamp(-9.0, 2.5);
            spread = bend.sqrt().recip();
        }
        (at, spread)
    }
}

impl Belief {
    fn start(slow: f64) -> Self {
        Self {
            slow,
            end: 1.0,
            slow_end: 0.0,
        }
    }

    fn predict(
        &mut self,
        rate: &super::window::SeenRate,
        step: &ScatterStep,
        size2: f64,
        slow: f64,
    ) -> ScatterGain {
        let renewed = size2 * slow * (1.0 - step.keep * step.keep);
        self.slow = step.keep * step.keep * self.slow + renewed;
        self.slow_end *= step.keep;
        let ends = rate.ends;
        let from_slow = step.load * self.slow - ends * self.slow_end;
        let remembered = step.load * from_slow - ends * step.load * self.slow_end;
        let white = size2 * (1.0 - slow) * rate.white;
        let variance = remembered + ends * ends * (self.end + 1.0) + white + rate.own;
        let variance = variance.max(1e-18);
        ScatterGain {
            variance,
            slow: from_slow / variance,
            end: ends / variance,
        }
    }

    fn update(&mut self, gain: &ScatterGain, weight: f64) {
        let share = weight * gain.variance;
        self.slow -= gain.slow * gain.slow * share;
        self.end = 1.0 - gain.end * gain.end * share;
        self.slow_end = -gain.slow * gain.end * share;
    }
}
