//! The joint fit of the law and its effects under one noise model, and under the best of several.

use super::act::Act;
use super::frame::{dot, likeliest as likeliest_noise};
use super::linear::Linear;
use super::noise::{Memory, Noise, Whitener};
use super::prior::Prior;
use super::problem::Problem;
use super::term::{Scratch, Term, coefficients_of, law_parameters, read};
use crate::fit::{Damping, Descendable, StepOutcome, descend};
use crate::model::Driven;
use nalgebra::{DMatrix, DVector};

/// Most steps of Gauss and Newton for one fit.
const MOST_STEPS: usize = 20;
/// A step that lowers the misfit by less than this share ends the fit.
const CONVERGED: f64 = 1e-5;
const DAMPING: Damping = Damping {
    tighten: 6.0,
    least: 1e-9,
    most_tries: 8,
    ..Damping::PLAIN
};
/// Where among the parameters those of the law's shape stand.
const SHAPE: std::ops::Range<usize> = 1..4;
/// Rounds of 'which noise, then which law': the third no longer changes the choice.
const NOISE_ROUNDS: usize = 4;

/// The law with its effects, fitted.
#[derive(Debug, Clone)]
pub(super) struct Fitted {
    pub(super) terms: Vec<Term>,
    pub(super) parameters: Vec<f64>,
    pub(super) noise: Noise,
    /// Of every reading, also of those held out.
    pub(super) prediction: Vec<f64>,
    /// The model's velocity at every reading, mm/day.
    pub(super) velocity: Vec<f64>,
    /// -2 ln likelihood of the fitted readings.
    pub(super) deviance: f64,
    /// Standard deviation of the white noise (of weight 1).
    pub(super) sigma: f64,
}

impl Fitted {
    /// BIC: the likelihood, and what parameters of law, effects and noise cost.
    pub(super) fn bic(&self, problem: &Problem) -> f64 {
        let terms: f64 = self.terms.iter().map(Term::parameters).sum();
        let count = law_parameters(problem) as f64 + terms + self.noise.parameters();
        self.deviance + count * (problem.used as f64).ln()
    }

    /// The parameters with nothing of the term of that index.
    pub(super) fn parameters_without(&self, problem: &Problem, index: usize) -> Vec<f64> {
        let mut without = self.parameters.clone();
        without[coefficients_of(problem, &self.terms, index)].fill(0.0);
        without
    }

    /// Readings less prediction, of the fitted ones.
    pub(super) fn residual(&self, problem: &Problem) -> Vec<f64> {
        problem.residual(&self.prediction)
    }

    /// Root mean square of readings less prediction over a range of readings.
    pub(super) fn rms(&self, problem: &Problem, range: std::ops::Range<usize>) -> f64 {
        let n = range.len() as f64;
        let squares = range.map(|i| (problem.y[i] - self.prediction[i]).powi(2));
        (squares.sum::<f64>() / n).sqrt()
    }
}

/// Where fits start.
#[derive(Debug, Clone)]
pub(super) struct Start {
    pub(super) terms: Vec<Term>,
    pub(super) parameters: Vec<f64>,
    /// The noise of the first round.
    pub(super) noise: Noise,
    /// So many parameters at the end stay as they are.
    pub(super) frozen: usize,
    /// Whether the law's shape (r, a and p) stays as it is.
    pub(super) holds_shape: bool,
}

impl Start {
    /// This start with these terms besides, their coefficients at the first of their starts.
    pub(super) fn joined(mut self, terms: &[Term]) -> Self {
        for term in terms {
            self = self.with_size(term, term.act.starts()[0]);
        }
        self
    }

    /// This start with one more term, its coefficients all `size`.
    pub(super) fn with_size(mut self, term: &Term, size: f64) -> Self {
        self.parameters.extend(vec![size; term.coefficients()]);
        self.terms.push(term.clone());
        self
    }

    /// A law alone, under white noise.
    pub(super) fn of_law(parameters: Vec<f64>) -> Self {
        Self {
            terms: Vec::new(),
            parameters,
            noise: Noise::WHITE,
            frozen: 0,
            holds_shape: false,
        }
    }

    /// `fitted` as it is.
    pub(super) fn at(fitted: &Fitted) -> Self {
        Self {
            terms: fitted.terms.clone(),
            parameters: fitted.parameters.clone(),
            noise: fitted.noise,
            frozen: 0,
            holds_shape: false,
        }
    }
}

/// The best of several starts under the noise models of `noises`; `None` where none leads to a motion.
pub(super) fn refit_from(
    problem: &Problem,
    starts: &[Start],
    bank: &[Whitener],
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let fits = starts
        .iter()
        .filter_map(|start| refit(problem, start, bank, scratch));
    likeliest(problem, fits)
}

/// The best of the fits from one start with noise of each memory: where a load may hide in the noise, a fit that
/// began with the one seldom finds the other.
pub(super) fn refit_every_memory(
    problem: &Problem,
    start: &Start,
    bank: &[Whitener],
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let memories = [Memory::None, Memory::Reading, Memory::Load];
    let fits = memories.iter().filter_map(|memory| {
        let own = bank.iter().filter(|w| w.noise.memory == *memory);
        let own: Vec<Whitener> = own.cloned().collect();
        let noise = if start.noise.memory == *memory {
            start.noise
        } else {
            own.get(own.len() / 2)?.noise
        };
        let start = Start {
            noise,
            ..start.clone()
        };
        refit(problem, &start, &own, scratch)
    });
    likeliest(problem, fits)
}

/// The fit of the lowest BIC.
pub(super) fn likeliest(problem: &Problem, fits: impl Iterator<Item = Fitted>) -> Option<Fitted> {
    fits.min_by(|a, b| a.bic(problem).total_cmp(&b.bic(problem)))
}

/// The joint fit from one start, the noise model being the likeliest of `noises`.
pub(super) fn refit(
    problem: &Problem,
    start: &Start,
    bank: &[Whitener],
    scratch: &mut Scratch,
) -> Option<Fitted> {
    let mut point = ParameterPoint::at(problem, &start.terms, start.parameters.clone(), scratch)?;
    let mut whitener = bank
        .iter()
        .find(|w| w.noise == start.noise)
        .or(bank.first())?;
    let mut best: Option<Fitted> = None;
    for _ in 0..NOISE_ROUNDS {
        point = point.descend(problem, start, whitener, (MOST_STEPS, scratch));
        let fitted = point.fitted(problem, &start.terms, whitener);
        if best
            .as_ref()
            .is_none_or(|best| fitted.bic(problem) < best.bic(problem))
        {
            best = Some(fitted);
        }
        if bank.len() == 1 {
            break;
        }
        let jacobian = point.jacobian(problem, &start.terms, scratch);
        let likeliest = likeliest_noise(bank, &point.residual(problem), &jacobian);
        if bank[likeliest].noise == whitener.noise {
            break;
        }
        whitener = &bank[likeliest];
    }
    best
}

/// No more than `steps` towards the fit from one start, under one noise model.
pub(super) fn towards(
    problem: &Problem,
    start: &Start,
    whitener: &Whitener,
    (steps, scratch): (usize, &mut Scratch),
) -> Option<Fitted> {
    let terms = &start.terms;
    let point = ParameterPoint::at(problem, terms, start.parameters.clone(), scratch)?;
    let there = point.descend(problem, start, whitener, (steps, scratch));
    Some(there.fitted(problem, terms, whitener))
}

/// A start at `fitted` under the noise that makes its residual likeliest.
pub(super) fn under_likeliest(
    problem: &Problem,
    fitted: &Fitted,
    bank: &[Whitener],
    scratch: &mut Scratch,
) -> Start {
    let columns = jacobian(problem, fitted, scratch);
    let likeliest = likeliest_noise(bank, &fitted.residual(problem), &columns);
    Start {
        noise: bank[likeliest].noise,
        ..Start::at(fitted)
    }
}

/// Columns of the prediction by each parameter, at the fitted readings.
pub(super) fn jacobian(problem: &Problem, fitted: &Fitted, scratch: &mut Scratch) -> Vec<Vec<f64>> {
    let parameters = fitted.parameters.clone();
    let point = ParameterPoint::at(problem, &fitted.terms, parameters, scratch);
    // A fit has a motion.
    point.map_or_else(Vec::new, |point| {
        point.jacobian(problem, &fitted.terms, scratch)
    })
}

/// Parameters and what they predict.
#[derive(Debug, Clone)]
struct ParameterPoint {
    parameters: Vec<f64>,
    prediction: Vec<f64>,
    driven: Driven,
}

impl ParameterPoint {
    fn at(
        problem: &Problem,
        terms: &[Term],
        parameters: Vec<f64>,
        scratch: &mut Scratch,
    ) -> Option<Self> {
        let sound = scratch.predict(problem, terms, &parameters)
            && scratch.prediction.iter().all(|value| value.is_finite());
        sound.then(|| Self {
            parameters,
            prediction: scratch.prediction.clone(),
            driven: scratch.driven.clone(),
        })
    }

    fn residual(&self, problem: &Problem) -> Vec<f64> {
        problem.residual(&self.prediction)
    }

    fn fitted(&self, problem: &Problem, terms: &[Term], whitener: &Whitener) -> Fitted {
        let innovations = whitener.whiten(&self.residual(problem));
        let misfit = dot(&innovations, &innovations);
        let velocity = |&node: &usize| self.driven.velocity[node];
        Fitted {
            terms: terms.to_vec(),
            deviance: whitener.deviance(misfit),
            sigma: whitener.sigma(misfit),
            noise: whitener.noise,
            parameters: self.parameters.clone(),
            prediction: self.prediction.clone(),
            velocity: problem.node_of.iter().map(velocity).collect(),
        }
    }

    /// Columns of the prediction by each parameter: the law linearised, and for a mean's length reading the same motion
    /// again. Where the load answers to the motion by differences: there the law linearised from node to node is too
    /// rough to find the way.
    fn jacobian(&self, problem: &Problem, terms: &[Term], scratch: &mut Scratch) -> Vec<Vec<f64>> {
        let feeds_back = |term: &Term| matches!(term.act, Act::PerVelocity | Act::PerSlip);
        if terms.iter().any(feeds_back) {
            let each = 0..self.parameters.len();
            return each
                .map(|k| self.difference(problem, terms, k, scratch))
                .collect();
        }
        let linear = Linear::of(problem, (terms, &self.parameters), &self.driven);
        let mut columns = linear.of_law(problem);
        for term in terms {
            if matches!(term.act, Act::Averaging) {
                let own = self.parameters[columns.len()];
                columns.push(self.by_averaging(problem, own));
            } else {
                columns.extend(linear.columns(problem, term));
            }
        }
        for column in &mut columns {
            column.truncate(problem.used);
        }
        columns
    }

    fn difference(
        &self,
        problem: &Problem,
        terms: &[Term],
        k: usize,
        scratch: &mut Scratch,
    ) -> Vec<f64> {
        let mut column = vec![0.0; problem.used];
        for size in [1e-4, -1e-4] {
            let mut parameters = self.parameters.clone();
            let by = size * self.parameters[k].abs().max(1.0);
            parameters[k] += by;
            if scratch.predict(problem, terms, &parameters)
                && scratch.prediction.iter().all(|value| value.is_finite())
            {
                let both = scratch.prediction.iter().zip(&self.prediction);
                for (slot, (there, here)) in column.iter_mut().zip(both) {
                    *slot = (there - here) / by;
                }
                break;
            }
        }
        column
    }

    /// The change of the readings by a mean longer than `own` spacings, per spacing.
    fn by_averaging(&self, problem: &Problem, own: f64) -> Vec<f64> {
        let by = 1e-4 * own.max(1.0);
        if own + by <= 0.0 {
            // Below nothing it stays nothing.
            return vec![0.0; problem.used];
        }
        let [mut here, mut there] = [Vec::new(), Vec::new()];
        let mean = own.max(0.0) * problem.spacing;
        read(problem, &self.driven, mean, &mut here);
        let longer = (own + by) * problem.spacing;
        read(problem, &self.driven, longer, &mut there);
        let both = there.iter().zip(&here);
        both.map(|(there, here)| (there - here) / by).collect()
    }

    /// Damped steps of Gauss and Newton under `noise`, its shape held at the start's velocity.
    fn descend(
        self,
        problem: &Problem,
        start: &Start,
        whitener: &Whitener,
        (most_steps, scratch): (usize, &mut Scratch),
    ) -> Self {
        let innovations = whitener.whiten(&self.residual(problem));
        let mut refit = Refitting {
            problem,
            start,
            whitener,
            prior: Prior::of(problem, &start.terms),
            point: self,
            innovations,
            scratch,
            variance: 1.0,
            objective: f64::INFINITY,
            normal: (DMatrix::zeros(0, 0), DVector::zeros(0)),
        };
        descend(&mut refit, &DAMPING, most_steps);
        refit.point
    }
}

/// A fit under way.
struct Refitting<'a> {
    problem: &'a Problem,
    start: &'a Start,
    whitener: &'a Whitener,
    prior: Prior,
    point: ParameterPoint,
    innovations: Vec<f64>,
    scratch: &'a mut Scratch,
    /// Of the noise, held while steps are tried.
    variance: f64,
    objective: f64,
    /// J^T J and J^T r.
    normal: (DMatrix<f64>, DVector<f64>),
}

impl Refitting<'_> {
    fn normal_equations(&self, columns: &[Vec<f64>]) -> (DMatrix<f64>, DVector<f64>) {
        let k = columns.len();
        let (mut normal, mut slope) = (DMatrix::zeros(k, k), DVector::zeros(k));
        for i in 0..k {
            for j in 0..=i {
                let value = dot(&columns[i], &columns[j]) / self.variance;
                normal[(i, j)] = value;
                normal[(j, i)] = value;
            }
            slope[i] = dot(&columns[i], &self.innovations) / self.variance;
        }
        let parameters = &self.point.parameters;
        (self.prior).weigh_in(parameters, (&mut normal, &mut slope));
        (normal, slope)
    }
}

impl Descendable for Refitting<'_> {
    fn linearise(&mut self) -> bool {
        let (problem, start) = (self.problem, self.start);
        let (frozen, holds_shape) = (start.frozen, start.holds_shape);
        let columns = (self.point).jacobian(problem, &self.start.terms, self.scratch);
        let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut white = self.whitener.whiten_all(&columns);
        let count = white.len();
        let is_held = |k: &usize| *k >= count - frozen || holds_shape && SHAPE.contains(k);
        let held: Vec<usize> = (0..count).filter(is_held).collect();
        for k in &held {
            white[*k].fill(0.0);
        }
        let misfit = dot(&self.innovations, &self.innovations);
        let parameters = &self.point.parameters;
        self.variance = (misfit / problem.used as f64).max(1e-300);
        self.objective = misfit / self.variance + self.prior.misfit(parameters);
        let (normal, mut slope) = self.normal_equations(&white);
        for k in &held {
            slope[*k] = 0.0;
        }
        self.normal = (normal, slope);
        true
    }

    fn step(&mut self, damping: f64) -> StepOutcome {
        let (normal, slope) = &self.normal;
        let Some(step) = solve(normal, slope, damping) else {
            return StepOutcome::NoGain;
        };
        let (problem, terms) = (self.problem, self.start.terms.as_slice());
        let parameters = self.point.parameters.iter().zip(step.iter());
        let there = parameters.map(|(p, s)| p + s).collect();
        let Some(point) = ParameterPoint::at(problem, terms, there, self.scratch) else {
            return StepOutcome::NoGain;
        };
        let trial = self.whitener.whiten(&point.residual(problem));
        let value = dot(&trial, &trial) / self.variance + self.prior.misfit(&point.parameters);
        if value < self.objective {
            (self.point, self.innovations) = (point, trial);
            let gain = self.objective - value;
            return StepOutcome::Gained { gain, ease: 0.2 };
        }
        StepOutcome::NoGain
    }

    fn goes_on(&self, gain: f64) -> bool {
        gain >= CONVERGED * self.problem.used as f64
    }
}

fn solve(normal: &DMatrix<f64>, slope: &DVector<f64>, damping: f64) -> Option<DVector<f64>> {
    let mut damped = normal.clone();
    for i in 0..slope.len() {
        damped[(i, i)] += damping * normal[(i, i)].max(1e-12);
    }
    let step = damped.cholesky()?.solve(slope);
    // No parameter moves by more than its own order at once.
    let most = step.iter().fold(0.0_f64, |most, s| most.max(s.abs()));
    let within = (1e6 / most).min(1.0);
    step.iter().all(|s| s.is_finite()).then(|| step * within)
}
