//! Levenberg-Marquardt in a few dimensions, on weighted residuals with a numerical Jacobian.

use nalgebra::{SMatrix, SVector};

/// Why a search stopped.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Termination {
    /// The step or the gain fell below the tolerance.
    Converged,
    /// The bound on evaluations was reached first.
    TooManyEvaluations,
}

/// Where a search ended.
#[derive(Debug, Clone)]
pub(super) struct Optimum<const N: usize> {
    pub(super) at: SVector<f64, N>,
    /// Sum of squared residuals.
    pub(super) cost: f64,
    pub(super) termination: Termination,
}

/// Gain of a step, as a share of the cost, at which a search has converged.
const RELATIVE_GAIN: f64 = 1e-13;
const JACOBIAN_STEP: f64 = 1e-5;

/// Where a search may go, how far, and how finely it differentiates.
#[derive(Debug, Clone, Copy)]
pub(super) struct Limits<const N: usize> {
    pub(super) lowest: SVector<f64, N>,
    pub(super) highest: SVector<f64, N>,
    /// Coordinates smaller than this are differentiated as if they were of this size.
    pub(super) scale: f64,
    pub(super) most_evaluations: usize,
    /// Gain of a step, as a share of the cost, at which it has converged.
    pub(super) least_gain: f64,
}

impl<const N: usize> Limits<N> {
    /// No bounds but that on the work.
    pub(super) fn evaluations(most_evaluations: usize) -> Self {
        Self {
            lowest: SVector::repeat(f64::NEG_INFINITY),
            highest: SVector::repeat(f64::INFINITY),
            scale: 1e-2,
            most_evaluations,
            least_gain: RELATIVE_GAIN,
        }
    }

    fn clamp(&self, at: &SVector<f64, N>) -> SVector<f64, N> {
        SVector::from_fn(|i, _| at[i].clamp(self.lowest[i], self.highest[i]))
    }

    /// Whether coordinate `i` stands at a bound that descent would cross.
    fn holds(&self, i: usize, at: &SVector<f64, N>, gradient: &SVector<f64, N>) -> bool {
        (at[i] <= self.lowest[i] && gradient[i] >= 0.0)
            || (at[i] >= self.highest[i] && gradient[i] <= 0.0)
    }
}

/// Minimises the sum of squares of `residuals(point, out)`, which returns false outside the model's domain.
/// `None` when the start itself lies outside.
pub(super) fn minimise<const N: usize>(
    start: SVector<f64, N>,
    count: usize,
    limits: &Limits<N>,
    mut residuals: impl FnMut(&SVector<f64, N>, &mut [f64]) -> bool,
) -> Option<Optimum<N>> {
    let most_evaluations = limits.most_evaluations;
    let mut buffers = Buffers {
        here: vec![0.0; count],
        there: vec![0.0; count],
        columns: vec![vec![0.0; count]; N],
    };
    let mut at = start;
    if !residuals(&at, &mut buffers.here) {
        return None;
    }
    let mut cost = sum_of_squares(&buffers.here);
    let (mut damping, mut evaluations) = (1e-3, 1);
    let mut termination = Termination::TooManyEvaluations;
    while evaluations < most_evaluations {
        let (normal, gradient) = jacobian(&at, limits.scale, &mut buffers, &mut residuals);
        evaluations += N;
        let (normal, gradient) = hold_bounds(limits, &at, normal, gradient);
        let mut gained = None;
        while damping < 1e12 && evaluations < most_evaluations {
            let step = damped_step(&normal, &gradient, damping);
            let there = limits.clamp(&(at + step));
            evaluations += 1;
            let inside = residuals(&there, &mut buffers.there);
            let new_cost = if inside {
                sum_of_squares(&buffers.there)
            } else {
                f64::INFINITY
            };
            if new_cost < cost {
                gained = Some(cost - new_cost);
                (at, cost) = (there, new_cost);
                std::mem::swap(&mut buffers.here, &mut buffers.there);
                damping = (damping * 0.2).max(1e-12);
                break;
            }
            damping *= 6.0;
        }
        if gained.is_none_or(|gain| gain <= limits.least_gain * cost) {
            if gained.is_some() || damping >= 1e12 {
                termination = Termination::Converged;
            }
            break;
        }
    }
    Some(Optimum {
        at,
        cost,
        termination,
    })
}

struct Buffers {
    here: Vec<f64>,
    there: Vec<f64>,
    columns: Vec<Vec<f64>>,
}

fn sum_of_squares(values: &[f64]) -> f64 {
    let sum: f64 = values.iter().map(|value| value * value).sum();
    if sum.is_finite() { sum } else { f64::INFINITY }
}

/// Takes the coordinates that are held by a bound out of the step.
fn hold_bounds<const N: usize>(
    limits: &Limits<N>,
    at: &SVector<f64, N>,
    mut normal: SMatrix<f64, N, N>,
    mut gradient: SVector<f64, N>,
) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    for i in (0..N)
        .filter(|i| limits.holds(*i, at, &gradient))
        .collect::<Vec<_>>()
    {
        normal.row_mut(i).fill(0.0);
        normal.column_mut(i).fill(0.0);
        normal[(i, i)] = 1.0;
        gradient[i] = 0.0;
    }
    (normal, gradient)
}

fn damped_step<const N: usize>(
    normal: &SMatrix<f64, N, N>,
    gradient: &SVector<f64, N>,
    damping: f64,
) -> SVector<f64, N> {
    let mut damped = *normal;
    for i in 0..N {
        damped[(i, i)] += damping * normal[(i, i)].max(1e-30);
    }
    damped
        .try_inverse()
        .map_or_else(SVector::zeros, |inverse| -(inverse * gradient))
}

/// J^T J and J^T r by forward differences, backward where forward leaves the domain.
fn jacobian<const N: usize>(
    at: &SVector<f64, N>,
    scale: f64,
    buffers: &mut Buffers,
    residuals: &mut impl FnMut(&SVector<f64, N>, &mut [f64]) -> bool,
) -> (SMatrix<f64, N, N>, SVector<f64, N>) {
    for i in 0..N {
        let size = JACOBIAN_STEP * at[i].abs().max(scale);
        let mut taken = 0.0;
        for step in [size, -size] {
            let mut there = *at;
            there[i] += step;
            if residuals(&there, &mut buffers.there) {
                taken = step;
                break;
            }
        }
        let column = &mut buffers.columns[i];
        for ((slot, moved), here) in column.iter_mut().zip(&buffers.there).zip(&buffers.here) {
            *slot = if taken == 0.0 {
                0.0
            } else {
                (moved - here) / taken
            };
        }
    }
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let normal = SMatrix::from_fn(|i, j| dot(&buffers.columns[i], &buffers.columns[j]));
    let gradient = SVector::from_fn(|i, _| dot(&buffers.columns[i], &buffers.here));
    (normal, gradient)
}
