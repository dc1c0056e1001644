//! Levenberg-Marquardt on a chart, the linear unknowns projected out of residuals and derivatives alike.
//!
//! The derivatives by slope and steady state follow from the curve itself, because all laws of one m are
//! one curve, stretched and shifted in time; only that by m takes a second solution.

use super::chart::{Chart, ChartPoint};
use super::curve::{CurveWindow, Fineness, LawCurve};
use super::damped::{Damping, Descendable, DescentEnd, StepOutcome, descend};
use super::record::WeightedRecord;
use crate::reading::Quantity;

/// Step of the derivative by ln |m|.
const LN_M_STEP: f64 = 1e-5;
const DAMPING: Damping = Damping {
    tighten: 2.0,
    steeper: 2.0,
    most: 1e10,
    ..Damping::PLAIN
};
/// A step that promises less than this share of the least gain is not taken.
const NO_PROMISE: f64 = 0.1;
const EASE: f64 = 0.1;

/// How far a descent goes.
#[derive(Debug, Clone, Copy)]
pub(super) struct DescentEffort {
    pub(super) most_evaluations: usize,
    /// Gain of a step, as a share of the cost, at which it has converged.
    pub(super) least_gain: f64,
    pub(super) fineness: Fineness,
}

/// Where a descent stands.
#[derive(Debug, Clone, Copy)]
pub(super) struct SearchPoint {
    pub(super) chart: Chart,
    pub(super) at: ChartPoint,
    /// Sum of squared residuals.
    pub(super) cost: f64,
    /// Whether it ended before its bound on evaluations.
    pub(super) converged: bool,
}

/// Memory that every descent uses again.
#[derive(Debug)]
pub(super) struct Descent {
    pub(super) curve: LawCurve,
    pub(super) evaluations: usize,
    basis: Vec<f64>,
    rates: Vec<f64>,
    moved: Vec<f64>,
    residuals: Vec<f64>,
    columns: [Vec<f64>; 3],
}

/// J^T J and J^T r.
type NormalEquations = ([[f64; 3]; 3], [f64; 3]);

impl Descent {
    /// For records of at most `count` readings.
    pub(super) fn new(quantity: Quantity, count: usize) -> Self {
        let zeros = || vec![0.0; count];
        Self {
            curve: LawCurve::new(quantity),
            evaluations: 0,
            basis: zeros(),
            rates: zeros(),
            moved: zeros(),
            residuals: zeros(),
            columns: [zeros(), zeros(), zeros()],
        }
    }

    /// Sum of squared residuals at a point; infinite outside the model's domain.
    pub(super) fn cost(
        &mut self,
        record: &WeightedRecord,
        chart: Chart,
        at: &ChartPoint,
        fineness: Fineness,
    ) -> f64 {
        self.evaluations += 1;
        if !self.curve.solve(&chart.shape(at), 1.0, fineness) {
            return f64::INFINITY;
        }
        self.cost_of(record, chart, &CurveWindow::WHOLE)
    }

    /// Sum of squared residuals of a stretch of the curve as it stands.
    pub(super) fn cost_of(
        &mut self,
        record: &WeightedRecord,
        chart: Chart,
        window: &CurveWindow,
    ) -> f64 {
        let basis = &mut self.basis[..record.count()];
        let times = record.times(chart.anchor());
        self.curve.follow(window, times, basis, None);
        let projected = record.project(chart.anchor(), basis);
        projected.map_or(f64::INFINITY, |projected| projected.cost)
    }

    /// Goes down from a point, m held where `holds_m`.
    pub(super) fn descend(
        &mut self,
        record: &WeightedRecord,
        start: &SearchPoint,
        effort: &DescentEffort,
        holds_m: bool,
    ) -> SearchPoint {
        let mut place = *start;
        place.at = inside(place.chart, &place.at, holds_m);
        place.cost = self.cost(record, place.chart, &place.at, effort.fineness);
        place.converged = false;
        let last = self.evaluations + effort.most_evaluations;
        let mut problem = Downhill {
            descent: self,
            record,
            effort,
            holds_m,
            last,
            place,
            normal: ([[0.0; 3]; 3], [0.0; 3]),
        };
        let end = descend(&mut problem, &DAMPING, effort.most_evaluations);
        problem.place.converged = end == DescentEnd::Converged;
        problem.place
    }

    /// J^T J and J^T r at a place, without the coordinates that a bound holds. The curve must be that
    /// of the place: it was solved for its cost.
    fn linearise(
        &mut self,
        record: &WeightedRecord,
        place: &SearchPoint,
        fineness: Fineness,
        holds_m: bool,
    ) -> Option<NormalEquations> {
        let (count, anchor) = (record.count(), place.chart.anchor());
        let shape = place.chart.shape(&place.at);
        let times = record.times(anchor);
        let (basis, rates) = (&mut self.basis[..count], &mut self.rates[..count]);
        self.curve
            .follow(&CurveWindow::WHOLE, times, basis, Some(rates));
        let projected = record.project(anchor, basis)?;
        let chain = place.chart.chain(&place.at);
        let (stretch, over_slope) = (-shape.stretch(), 1.0 / shape.slope);
        let is_slip = f64::from(u8::from(record.quantity == Quantity::Displacement));
        let [first, second, _] = &mut self.columns;
        for i in 0..count {
            // All times stretched: t d/dt; slip is a length in units of velocity times time.
            let by_slope = times[i] * rates[i] - is_slip * basis[i];
            let by_excess = basis[i] + rates[i] * over_slope + stretch * by_slope;
            first[i] = chain.slope_by_first * by_slope;
            second[i] = chain.slope_by_second * by_slope + chain.excess_by_second * by_excess;
        }
        let columns = if holds_m {
            2
        } else {
            self.differentiate_by_m(record, place, fineness);
            3
        };
        let basis = &self.basis[..count];
        for column in &mut self.columns[..columns] {
            record.differentiate(anchor, basis, &projected, &mut column[..count]);
        }
        record.residuals(anchor, basis, &projected, &mut self.residuals[..count]);
        Some(self.normal(place, count, columns, holds_m))
    }

    /// The derivative of the basis by ln |m|; 0 where the law next to it cannot be followed.
    fn differentiate_by_m(
        &mut self,
        record: &WeightedRecord,
        place: &SearchPoint,
        fineness: Fineness,
    ) {
        let count = record.count();
        let mut at = place.at;
        let step = if at[2] + LN_M_STEP > place.chart.corners().1[2] {
            -LN_M_STEP
        } else {
            LN_M_STEP
        };
        at[2] += step;
        self.evaluations += 1;
        let out = &mut self.columns[2][..count];
        if !self.curve.solve(&place.chart.shape(&at), 1.0, fineness) {
            out.fill(0.0);
            return;
        }
        let (times, moved) = (record.times(place.chart.anchor()), &mut self.moved[..count]);
        self.curve.follow(&CurveWindow::WHOLE, times, moved, None);
        for ((slot, there), here) in out.iter_mut().zip(moved).zip(&self.basis) {
            *slot = (*there - here) / step;
        }
    }

    fn normal(
        &self,
        place: &SearchPoint,
        count: usize,
        columns: usize,
        holds_m: bool,
    ) -> NormalEquations {
        let dot = |a: &[f64], b: &[f64]| {
            let products = a[..count].iter().zip(&b[..count]).map(|(a, b)| a * b);
            products.sum::<f64>()
        };
        let product = |i: usize, j: usize| dot(&self.columns[i], &self.columns[j]);
        let mut gradient = [0.0; 3];
        let mut is_free = [false; 3];
        for i in 0..columns {
            gradient[i] = dot(&self.columns[i], &self.residuals);
            is_free[i] = !is_held(place, i, gradient[i], holds_m);
        }
        let mut normal = [[0.0; 3]; 3];
        for (i, j) in [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)] {
            if is_free[i] && is_free[j] {
                normal[i][j] = product(i, j);
                normal[j][i] = normal[i][j];
            }
        }
        for i in (0..3).filter(|i| !is_free[*i]) {
            (normal[i][i], gradient[i]) = (1.0, 0.0);
        }
        (normal, gradient)
    }
}

/// A descent under way.
struct Downhill<'a> {
    descent: &'a mut Descent,
    record: &'a WeightedRecord,
    effort: &'a DescentEffort,
    holds_m: bool,
    /// Evaluations after which it ends.
    last: usize,
    place: SearchPoint,
    normal: NormalEquations,
}

impl Descendable for Downhill<'_> {
    fn linearise(&mut self) -> bool {
        if !self.place.cost.is_finite() || self.descent.evaluations >= self.last {
            return false;
        }
        let fineness = self.effort.fineness;
        let normal = (self.descent).linearise(self.record, &self.place, fineness, self.holds_m);
        if let Some(normal) = normal {
            self.normal = normal;
        }
        normal.is_some()
    }

    fn step(&mut self, damping: f64) -> StepOutcome {
        if self.descent.evaluations >= self.last {
            return StepOutcome::OutOfWork;
        }
        let place = self.place;
        let step = damped_step(&self.normal, damping);
        let promise = promised(&self.normal, &step, damping);
        if promise <= NO_PROMISE * self.effort.least_gain * place.cost {
            return StepOutcome::Converged;
        }
        let there = [0, 1, 2].map(|i| place.at[i] + step[i]);
        let there = inside(place.chart, &there, self.holds_m);
        let fineness = self.effort.fineness;
        let cost = (self.descent).cost(self.record, place.chart, &there, fineness);
        // Not a number is no gain either.
        if cost < place.cost {
            (self.place.at, self.place.cost) = (there, cost);
            let gain = place.cost - cost;
            // Nielsen's rule: a step that kept its promise is taken longer next time.
            let kept = 2.0 * gain / promise - 1.0;
            let ease = (1.0 - kept * kept * kept).clamp(EASE, DAMPING.tighten);
            return StepOutcome::Gained { gain, ease };
        }
        StepOutcome::NoGain
    }

    fn goes_on(&self, gain: f64) -> bool {
        gain > self.effort.least_gain * self.place.cost
    }
}

/// What the linear model gains by a damped step.
fn promised((normal, gradient): &NormalEquations, step: &[f64; 3], damping: f64) -> f64 {
    let each = (0..3).map(|i| step[i] * (damping * normal[i][i] * step[i] - gradient[i]));
    each.sum()
}

/// Whether a coordinate stands at a bound that descent would cross.
fn is_held(place: &SearchPoint, i: usize, gradient: f64, holds_m: bool) -> bool {
    if i == 2 && holds_m {
        return true;
    }
    let (low, high) = place.chart.corners_beside(&place.at);
    (place.at[i] <= low[i] && gradient >= 0.0) || (place.at[i] >= high[i] && gradient <= 0.0)
}

/// The nearest point of the chart.
pub(super) fn inside(chart: Chart, at: &ChartPoint, holds_m: bool) -> ChartPoint {
    let (low, high) = chart.corners_beside(at);
    let mut inside = [0, 1, 2].map(|i| at[i].clamp(low[i], high[i]));
    if holds_m {
        inside[2] = at[2];
    }
    inside
}

/// The step of Levenberg and Marquardt, by Cramer's rule on columns of unit length; none where the
/// matrix is singular.
fn damped_step((normal, gradient): &NormalEquations, damping: f64) -> [f64; 3] {
    let length = [0, 1, 2].map(|i| normal[i][i].sqrt().max(f64::MIN_POSITIVE));
    let mut a = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            a[i][j] = normal[i][j] / length[i] / length[j];
        }
        a[i][i] = 1.0 + damping;
    }
    let cofactor = |i: usize, j: usize| {
        let ((i1, i2), (j1, j2)) = (((i + 1) % 3, (i + 2) % 3), ((j + 1) % 3, (j + 2) % 3));
        a[i1][j1] * a[i2][j2] - a[i1][j2] * a[i2][j1]
    };
    let determinant: f64 = (0..3).map(|j| a[0][j] * cofactor(0, j)).sum();
    let step = [0, 1, 2].map(|i| {
        let sum: f64 = (0..3)
            .map(|j| cofactor(j, i) * gradient[j] / length[j])
            .sum();
        -sum / determinant / length[i]
    });
    if step.iter().all(|s| s.is_finite()) {
        step
    } else {
        [0.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::chart::{Branch, Direction};

    const EFFORT: DescentEffort = DescentEffort {
        most_evaluations: 200,
        least_gain: 1e-10,
        fineness: Fineness::EXACT,
    };

    fn record(quantity: Quantity) -> WeightedRecord {
        let times: Vec<f64> = (0..40).map(|i| f64::from(i) / 39.0).collect();
        let values: Vec<f64> = times
            .iter()
            .map(|t| 0.3 + t + 0.2 * (9.0 * t).sin())
            .collect();
        WeightedRecord::new(quantity, &times, &values)
    }

    fn places() -> Vec<(Chart, ChartPoint)> {
        let mut places = Vec::new();
        for (branch, sizes) in [
            (Branch::AboveOne, [1.3, 8.0]),
            (Branch::BelowOne, [0.9, 0.02]),
            (Branch::BelowZero, [3.0, 0.05]),
        ] {
            for direction in Direction::BOTH {
                for m in sizes {
                    for excess in [0.4, 2.5] {
                        places.push(Chart::locate(branch, direction, 2.0, excess, f64::ln(m)));
                    }
                }
            }
        }
        places
    }

    #[test]
    fn the_derivatives_are_those_of_the_cost() {
        for quantity in [Quantity::Velocity, Quantity::Displacement] {
            let record = record(quantity);
            let mut descent = Descent::new(quantity, 40);
            let mut met = 0;
            for (chart, at) in places() {
                let mut cost = |at: &ChartPoint| descent.cost(&record, chart, at, Fineness::EXACT);
                if !cost(&at).is_finite() {
                    continue;
                }
                met += 1;
                let numeric = [0, 1, 2].map(|i| {
                    let moved = |step: f64| {
                        let mut there = at;
                        there[i] += step;
                        there
                    };
                    (cost(&moved(1e-4)) - cost(&moved(-1e-4))) / 2e-4
                });
                let here = cost(&at);
                let place = SearchPoint {
                    chart,
                    at,
                    cost: here,
                    converged: false,
                };
                let (_, gradient) = descent
                    .linearise(&record, &place, Fineness::EXACT, false)
                    .unwrap();
                for i in 0..3 {
                    let (got, want) = (2.0 * gradient[i], numeric[i]);
                    assert!(
                        (got - want).abs() < 1e-3 * (want.abs() + 0.01 * here),
                        "{quantity}, {chart:?} {at:?}: {i}: {got} not {want}"
                    );
                }
            }
            assert!(met > 12, "only {met} laws could be followed");
        }
    }

    #[test]
    fn a_descent_only_goes_down_and_stays_within_the_chart() {
        let record = record(Quantity::Velocity);
        let mut descent = Descent::new(Quantity::Velocity, 40);
        for (chart, at) in places() {
            let before = descent.cost(&record, chart, &at, EFFORT.fineness);
            let start = SearchPoint {
                chart,
                at,
                cost: before,
                converged: false,
            };
            let end = descent.descend(&record, &start, &EFFORT, false);
            assert!(end.cost <= before, "{chart:?} {at:?}");
            let (low, high) = chart.corners();
            for i in 0..3 {
                assert!((low[i]..=high[i]).contains(&end.at[i]), "{end:?}");
            }
        }
    }
}
