//! What a small effect would change in every reading: the law linearised about its fitted motion.

use super::act::Act;
use super::problem::Problem;
use super::term::{Feedback, MotionBefore, Scratch, Term, event_place, law, law_parameters};
use crate::model::Driven;
use crate::reading::Quantity;

/// From the first node on.
const START: (usize, f64) = (0, 0.0);

/// The law's own response to small changes, along the nodes.
#[derive(Debug, Clone)]
pub(super) struct Linear {
    /// Velocity at the nodes, mm/day, and slip since the first, mm.
    velocity: Vec<f64>,
    slip: Vec<f64>,
    /// From node to node: what is left of a change of ln y, and days times the mean of what is added.
    left: Vec<f64>,
    added: Vec<f64>,
    /// b v / `v_i`, 1/day: what a unit of load takes from ln y in a day.
    wear: Vec<f64>,
    /// y^(p-1): what a unit of a adds to ln y in a day.
    healing: Vec<f64>,
    /// v / `v_i`.
    relative: Vec<f64>,
    /// ln y at the nodes, and a there, 1/day.
    ln_y: Vec<f64>,
    a: Vec<f64>,
    span: f64,
    /// Days over which velocities are read as means; 0: of the moment.
    averaging: f64,
}

impl Linear {
    /// About the motion that these parameters lead to.
    pub(super) fn about(
        problem: &Problem,
        (terms, parameters): (&[Term], &[f64]),
        scratch: &mut Scratch,
    ) -> Option<Self> {
        if !scratch.predict(problem, terms, parameters) {
            return None;
        }
        Some(Self::of(problem, (terms, parameters), &scratch.driven))
    }

    /// About a motion that these parameters have just led to.
    pub(super) fn of(
        problem: &Problem,
        (terms, parameters): (&[Term], &[f64]),
        driven: &Driven,
    ) -> Self {
        let span = problem.whole_span();
        let law = law(span, parameters);
        let (mut a, mut b, mut p) = (law.a, law.b, law.p);
        let changes = friction_changes(problem, (terms, parameters), span);
        let count = problem.nodes.len();
        let (mut wear, mut healing, mut growth) = (Vec::new(), Vec::new(), Vec::new());
        let mut each_a = Vec::with_capacity(count);
        for k in 0..count {
            for (_, by) in changes.iter().filter(|(node, _)| *node == k) {
                (b, a) = (b + by[0], a * by[1].exp());
                p = (p + by[2]).min(0.99);
            }
            let rest = ((p - 1.0) * driven.ln_y[k]).exp();
            let gone = b * driven.velocity[k] / law.v_i;
            growth.push((p - 1.0) * a * rest + gone);
            wear.push(gone);
            healing.push(rest);
            each_a.push(a);
        }
        let (mut left, mut added) = (vec![1.0], vec![0.0]);
        for k in 1..count {
            let dt = problem.nodes[k] - problem.nodes[k - 1];
            let exponent = (0.5 * (growth[k - 1] + growth[k]) * dt).clamp(-50.0, 5.0);
            left.push(exponent.exp());
            let mean = if exponent.abs() < 1e-6 {
                1.0
            } else {
                exponent.exp_m1() / exponent
            };
            added.push(mean * dt);
        }
        Self {
            a: each_a,
            ln_y: driven.ln_y.clone(),
            relative: driven.velocity.iter().map(|v| v / law.v_i).collect(),
            velocity: driven.velocity.clone(),
            slip: driven.slip.clone(),
            left,
            added,
            wear,
            healing,
            span,
            averaging: Feedback::of(problem, terms, parameters).averaging,
        }
    }

    /// The change of every reading for one unit of each of the law's own parameters.
    pub(super) fn of_law(&self, problem: &Problem) -> Vec<Vec<f64>> {
        let a = self.a[0];
        let mut columns = vec![
            self.run(problem, (START, (1.0, 0.0)), &|_| 0.0),
            self.run(problem, (START, (0.0, 0.0)), &|k| {
                -self.relative[k] / self.span
            }),
            self.run(problem, (START, (0.0, 0.0)), &|k| {
                self.a[k] * self.healing[k] - a * self.relative[k]
            }),
            self.run(problem, (START, (0.0, 0.0)), &|k| {
                self.a[k] * self.ln_y[k] * self.healing[k]
            }),
        ];
        if problem.quantity == Quantity::Displacement {
            columns.push(vec![1.0; problem.t.len()]);
        }
        columns
    }

    /// From `early` days before node `from` on: ln v changes by `direct`, ln y by `jump`, and the slope of ln y by `forcing`.
    fn run(
        &self,
        problem: &Problem,
        ((from, early), (direct, jump)): ((usize, f64), (f64, f64)),
        forcing: &dyn Fn(usize) -> f64,
    ) -> Vec<f64> {
        let mut ln_v = vec![0.0; self.velocity.len()];
        // What is left of the jump at that node, and what has been added by then.
        let part = match from.checked_sub(1) {
            Some(before) => early / (problem.nodes[from] - problem.nodes[before]),
            None => 0.0,
        };
        let mut change = jump * self.left[from].powf(part) + early * forcing(from);
        for (k, slot) in ln_v.iter_mut().enumerate().skip(from) {
            if k > from {
                let mean = 0.5 * (forcing(k - 1) + forcing(k));
                change = change * self.left[k] + self.added[k] * mean;
            }
            *slot = direct - change;
        }
        self.read_from(problem, &ln_v, (from, early))
    }

    /// The change of every reading for one unit of each coefficient of `term`.
    pub(super) fn columns(&self, problem: &Problem, term: &Term) -> Vec<Vec<f64>> {
        match &term.act {
            Act::Reading(columns) => columns.clone(),
            Act::Load(columns) => columns.iter().map(|f| self.of_load(problem, f)).collect(),
            Act::Step | Act::Reset | Act::Friction(_) => self.of_event(problem, term),
            Act::PerVelocity => {
                let typical = problem.typical_velocity();
                let f: Vec<f64> = self.velocity.iter().map(|v| -v / typical).collect();
                vec![self.of_load(problem, &f)]
            }
            Act::PerSlip => {
                let whole = problem.typical_velocity() * self.span;
                let f: Vec<f64> = self.slip.iter().map(|x| -x / whole).collect();
                vec![self.of_load(problem, &f)]
            }
            Act::Averaging => vec![self.of_averaging(problem)],
        }
    }

    /// A change f of the log-load at the nodes.
    pub(super) fn of_load(&self, problem: &Problem, f: &[f64]) -> Vec<f64> {
        let mut change = 0.0;
        let mut ln_v = Vec::with_capacity(f.len());
        ln_v.push(f[0]);
        for k in 1..f.len() {
            let forcing = 0.5 * (self.wear[k - 1] * f[k - 1] + self.wear[k] * f[k]);
            change = change * self.left[k] - self.added[k] * forcing;
            ln_v.push(f[k] - change);
        }
        self.read(problem, &ln_v)
    }

    fn of_event(&self, problem: &Problem, term: &Term) -> Vec<Vec<f64>> {
        let from = term
            .at
            .map_or(START, |at| event_place(problem, (at, term.share)));
        let run = |direct: f64, jump: f64, forcing: &dyn Fn(usize) -> f64| {
            self.run(problem, (from, (direct, jump)), forcing)
        };
        if matches!(term.act, Act::Step) {
            return vec![run(1.0, 0.0, &|k| -self.wear[k])];
        }
        if matches!(term.act, Act::Reset) {
            return vec![run(0.0, 1.0, &|_| 0.0)];
        }
        let forcings: [&dyn Fn(usize) -> f64; 3] = [
            &|k| -self.relative[k] / self.span,
            &|k| self.a[k] * self.healing[k],
            &|k| self.a[k] * self.ln_y[k] * self.healing[k],
        ];
        let changing = forcings.iter().take(term.coefficients());
        changing.map(|forcing| run(0.0, 0.0, forcing)).collect()
    }

    /// A mean over one median spacing more: half a spacing's delay.
    fn of_averaging(&self, problem: &Problem) -> Vec<f64> {
        let column = problem.node_of.iter().enumerate().map(|(i, &node)| {
            let t = problem.nodes[node] - problem.spacing;
            let k = problem.nodes.partition_point(|n| *n <= t).saturating_sub(1);
            let dt = (problem.nodes[node] - problem.nodes[k]).max(1e-12);
            let mean = (self.slip[node] - self.slip[k]) / dt;
            if i == 0 {
                0.0
            } else {
                mean - self.velocity[node]
            }
        });
        column.collect()
    }

    fn read(&self, problem: &Problem, ln_v: &[f64]) -> Vec<f64> {
        self.read_from(problem, ln_v, START)
    }

    /// From changes of ln v at the nodes, none until `early` days before node `from`, to changes of readings.
    fn read_from(&self, problem: &Problem, ln_v: &[f64], (from, early): (usize, f64)) -> Vec<f64> {
        let velocity = |k: usize| self.velocity[k] * ln_v[k];
        if problem.quantity == Quantity::Velocity && self.averaging <= 0.0 {
            return problem.node_of.iter().map(|&node| velocity(node)).collect();
        }
        let mut slip = vec![0.0; ln_v.len()];
        for k in from.max(1)..ln_v.len() {
            let dt = problem.nodes[k] - problem.nodes[k - 1];
            // Nothing before the event, although its node already moves at the new rate.
            let step = if k == from {
                velocity(k) * early
            } else {
                0.5 * (velocity(k - 1) + velocity(k)) * dt
            };
            slip[k] = slip[k - 1] + step;
        }
        let value = |&node: &usize| match problem.quantity {
            Quantity::Displacement => slip[node],
            Quantity::Velocity => {
                let t = problem.nodes[node] - self.averaging;
                let k = problem.nodes.partition_point(|n| *n <= t);
                let early = match k.checked_sub(1) {
                    None => {
                        let before = MotionBefore::back_to(problem, &self.velocity, t);
                        let growth = (ln_v[before.ahead] - ln_v[0]) / before.apart;
                        velocity(0) * before.days + self.velocity[0] * before.by_growth * growth
                    }
                    Some(j) if k < slip.len() => {
                        let share = (t - problem.nodes[j]) / (problem.nodes[k] - problem.nodes[j]);
                        slip[j] + share * (slip[k] - slip[j])
                    }
                    Some(j) => slip[j],
                };
                (slip[node] - early) / self.averaging
            }
        };
        problem.node_of.iter().map(value).collect()
    }
}

/// (node, changes of b, ln a and p) of the changes of friction already in the law.
fn friction_changes(
    problem: &Problem,
    (terms, parameters): (&[Term], &[f64]),
    span: f64,
) -> Vec<(usize, [f64; 3])> {
    let mut at = law_parameters(problem);
    let mut changes = Vec::new();
    for term in terms {
        if let (Act::Friction(_), Some(reading)) = (&term.act, term.at) {
            let own = &parameters[at..at + term.coefficients()];
            let change = |index: usize| own.get(index).copied().unwrap_or(0.0);
            let by = [change(0) / span, change(1), change(2)];
            let (node, _) = event_place(problem, (reading, term.share));
            changes.push((node, by));
        }
        at += term.coefficients();
    }
    changes
}

#[cfg(test)]
mod tests;
