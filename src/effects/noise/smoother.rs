//! What the remembering part of a noise is expected to have been, by all readings: the smoother of the two states.

use super::{
    Covariance, StateTransition, Whitener, advance, since_last, stationary, transition, update,
};
use crate::effects::problem::Problem;

impl Whitener {
    /// Posterior (mean, variance) of what remembers, at every fitted reading, for a column in units of the white noise.
    pub(in crate::effects) fn smooth(&self, problem: &Problem, column: &[f64]) -> Vec<(f64, f64)> {
        let (mut mean, mut p) = ([0.0; 2], stationary(self.noise));
        let mut path = Vec::with_capacity(self.steps.len());
        let typical = problem.typical_velocity();
        for (i, step) in self.steps.iter().enumerate() {
            let dt = since_last(problem, i);
            let (passage, q) = transition(problem, self.noise, dt, problem.seen[i] / typical);
            let ahead: [f64; 2] = passage.on(mean[0], mean[1]).into();
            let p_ahead = advance(p, passage, q);
            let (gain, _, after) = update(p_ahead, step.reads);
            let off = column[i] * step.weight - step.reads[0] * ahead[0] - step.reads[1] * ahead[1];
            mean = [ahead[0] + gain[0] * off, ahead[1] + gain[1] * off];
            p = after;
            path.push(SmootherStep {
                passage,
                ahead: TwoStates {
                    mean: ahead,
                    covariance: p_ahead,
                },
                after: TwoStates {
                    mean,
                    covariance: p,
                },
            });
        }
        backwards(&path)
    }
}

/// What has gathered and what remembers, as they are expected.
#[derive(Clone, Copy)]
struct TwoStates {
    mean: [f64; 2],
    covariance: Covariance,
}

/// One reading in the filter: how the states come to it, and as they are expected before and after it.
struct SmootherStep {
    passage: StateTransition,
    ahead: TwoStates,
    after: TwoStates,
}

/// The smoother's way back, from the filter's way forth.
fn backwards(path: &[SmootherStep]) -> Vec<(f64, f64)> {
    let mut smoothed = vec![(0.0, 0.0); path.len()];
    let mut later: Option<TwoStates> = None;
    for i in (0..path.len()).rev() {
        let after = path[i].after;
        let here = later.map_or(after, |later| smooth_pair(after, &path[i + 1], later));
        smoothed[i] = (here.mean[1], here.covariance[2]);
        later = Some(here);
    }
    smoothed
}

/// One step back from `later`, the smoothed states at the reading of `next`, to those before it, C = P F' (P ahead)^-1 (Rauch, Tung and
/// Striebel 1965).
fn smooth_pair(before: TwoStates, next: &SmootherStep, later: TwoStates) -> TwoStates {
    let (mean, p) = (before.mean, before.covariance);
    let (ahead, p_ahead) = (next.ahead.mean, next.ahead.covariance);
    let StateTransition {
        keep,
        gather,
        decay,
    } = next.passage;
    let (m_later, v_later) = (later.mean, later.covariance);
    let determinant = p_ahead[0] * p_ahead[2] - p_ahead[1] * p_ahead[1];
    if determinant <= 1e-12 * p_ahead[0].max(1e-12) * p_ahead[2] {
        // Only what remembers is there to be smoothed.
        let gain = if p_ahead[2] > 0.0 {
            decay * p[2] / p_ahead[2]
        } else {
            0.0
        };
        return TwoStates {
            mean: [mean[0], mean[1] + gain * (m_later[1] - ahead[1])],
            covariance: [p[0], p[1], p[2] + gain * gain * (v_later[2] - p_ahead[2])],
        };
    }
    let inverse = [
        p_ahead[2] / determinant,
        -p_ahead[1] / determinant,
        p_ahead[0] / determinant,
    ];
    // P F', F = [[keep, gather], [0, decay]].
    let pf = [
        [keep * p[0] + gather * p[1], decay * p[1]],
        [keep * p[1] + gather * p[2], decay * p[2]],
    ];
    let row = |r: [f64; 2]| {
        [
            r[0] * inverse[0] + r[1] * inverse[1],
            r[0] * inverse[1] + r[1] * inverse[2],
        ]
    };
    let c = [row(pf[0]), row(pf[1])];
    let off = [m_later[0] - ahead[0], m_later[1] - ahead[1]];
    let fall = [
        v_later[0] - p_ahead[0],
        v_later[1] - p_ahead[1],
        v_later[2] - p_ahead[2],
    ];
    let add = |a: [f64; 2], b: [f64; 2]| {
        a[0] * (fall[0] * b[0] + fall[1] * b[1]) + a[1] * (fall[1] * b[0] + fall[2] * b[1])
    };
    TwoStates {
        mean: [
            mean[0] + c[0][0] * off[0] + c[0][1] * off[1],
            mean[1] + c[1][0] * off[0] + c[1][1] * off[1],
        ],
        covariance: [
            p[0] + add(c[0], c[0]),
            p[1] + add(c[0], c[1]),
            p[2] + add(c[1], c[1]),
        ],
    }
}
