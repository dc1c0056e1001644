//! What is held to be likely of the law's parameters before any reading: weak, so that what the readings do not determine
//! stays within bounds. The posterior of the monitor has one of its own (`fit/under_load/prior`), of the law as seen from the present velocity:
//! here the parameters are those at the first reading, from which effects act.

use super::problem::Problem;
use super::term::{Term, law_parameters};
use nalgebra::{DMatrix, DVector};

/// Deviation of r times the span where the block speeds up. Where it slows down, or approaches a steady state, |r| is less
/// than a: how fast it does is a's to say.
const MOST_ACCELERATION: f64 = 3.0;
/// Deviation of kappa times the span, where kappa > 0.
const MOST_GROWTH: f64 = 1.0;

/// Deviation of the rate at which the block approaches its steady state, (1 - p) b, times the spacing of the readings: an
/// approach within few of them follows whatever noise remembers.
const FASTEST_APPROACH: f64 = 0.2;

/// Where r times the span, and ln of a times the span, stand among the parameters, and p.
const R: usize = 1;
const LN_A: usize = 2;
const P: usize = 3;

/// Normal priors.
pub(super) struct Prior {
    centre: Vec<f64>,
    deviation: Vec<f64>,
    /// The spacing of the readings over the span.
    spacing: f64,
}

/// A quantity that should be small, with its derivatives by some of the parameters.
struct Penalty {
    value: f64,
    by: [(usize, f64); 3],
}

impl Prior {
    pub(super) fn of(problem: &Problem, terms: &[Term]) -> Self {
        // ln v: within a few e-folds of the mean velocity, or a noise that sums up would take the motion over. r: see `rows`.
        // a: the contacts age over some third of the record, give or take e^2. p: m between some .6 and 3.
        let mut centre = vec![problem.typical_velocity().ln(), 0.0, -1.0, 0.0];
        let mut deviation = vec![1.5, f64::INFINITY, 2.0, 0.6];
        if law_parameters(problem) == 5 {
            centre.push(0.0);
            deviation.push(f64::INFINITY);
        }
        for term in terms {
            for index in 0..term.coefficients() {
                centre.push(0.0);
                deviation.push(term.act.prior(index));
            }
        }
        Self {
            centre,
            deviation,
            spacing: problem.spacing / problem.whole_span(),
        }
    }

    /// Twice what it takes from the logarithm of the likelihood.
    pub(super) fn misfit(&self, parameters: &[f64]) -> f64 {
        let each = parameters
            .iter()
            .zip(self.centre.iter().zip(&self.deviation));
        let each = each.map(|(p, (centre, deviation))| ((p - centre) / deviation).powi(2));
        let rows = self.rows(parameters);
        each.sum::<f64>() + rows.map(|row| row.value.powi(2)).iter().sum::<f64>()
    }

    /// Its share of the normal equations.
    pub(super) fn weigh_in(
        &self,
        parameters: &[f64],
        (normal, slope): (&mut DMatrix<f64>, &mut DVector<f64>),
    ) {
        for (i, parameter) in parameters.iter().enumerate() {
            let weight = self.deviation[i].powi(-2);
            normal[(i, i)] += weight;
            slope[i] -= weight * (parameter - self.centre[i]);
        }
        for row in self.rows(parameters) {
            for (i, by_i) in row.by {
                for (j, by_j) in row.by {
                    normal[(i, j)] += by_i * by_j;
                }
                slope[i] -= by_i * row.value;
            }
        }
    }

    /// r, an acceleration by e over the record being nothing rare; kappa times the span over its deviation, where it lets
    /// small departures grow: a block balanced on an unstable steady state for a whole record is no slope's; and how fast
    /// a steady state is approached.
    fn rows(&self, parameters: &[f64]) -> [Penalty; 3] {
        let (r, a, p) = (parameters[R], parameters[LN_A].exp(), parameters[P]);
        let scale = MOST_ACCELERATION + if r < 0.0 { a } else { 0.0 };
        let by_a = if r < 0.0 {
            -r * a / (scale * scale)
        } else {
            0.0
        };
        let growth = a * p.max(0.0) / MOST_GROWTH;
        let by_p = if p > 0.0 { a / MOST_GROWTH } else { 0.0 };
        let b = a + r;
        let approach = if b > 0.0 {
            self.spacing / FASTEST_APPROACH
        } else {
            0.0
        };
        let per_b = approach * (1.0 - p);
        [
            Penalty {
                value: r / scale,
                by: [(R, 1.0 / scale), (LN_A, by_a), (P, 0.0)],
            },
            Penalty {
                value: growth,
                by: [(R, 0.0), (LN_A, growth), (P, by_p)],
            },
            Penalty {
                value: per_b * b,
                by: [(R, per_b), (LN_A, per_b * a), (P, -approach * b)],
            },
        ]
    }
}
