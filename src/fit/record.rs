//! The readings as a search sees them: over the unit of time and of value, from either end, perhaps merged.

use super::chart::Anchor;
use crate::reading::Quantity;

/// Readings over their length, seen from one end.
#[derive(Debug, Clone, Default)]
pub(super) struct RecordSide {
    /// From the anchor, increasing, 0 to 1.
    pub(super) times: Vec<f64>,
    values: Vec<f64>,
}

/// Readings with the number of measurements that each stands for.
#[derive(Debug, Clone)]
pub(super) struct WeightedRecord {
    pub(super) quantity: Quantity,
    sides: [RecordSide; 2],
    /// From either end.
    weights: [Vec<f64>; 2],
    /// Their roots, which residuals are scaled by.
    roots: [Vec<f64>; 2],
    total: f64,
}

/// A record merged to so many readings still shows where its basins are.
const MERGED: usize = 24;
/// Records longer than this keep more.
const LONG: usize = 200;
const MERGED_LONG: usize = 48;
/// How much a record's length counts beside its range of values when neighbours are merged.
const TIME_SHARE: f64 = 0.3;

/// One reading: (time, value, weight).
type Merged = (f64, f64, f64);

/// What the projection found: the velocity at the anchor, and the sum of squares left.
#[derive(Debug, Clone, Copy)]
pub(super) struct Projected {
    pub(super) velocity: f64,
    /// Mean value less velocity times mean basis; 0 for velocities.
    pub(super) offset: f64,
    pub(super) cost: f64,
    mean_basis: f64,
    mean_value: f64,
    squares: f64,
}

impl WeightedRecord {
    /// `times` from 0 to 1, increasing.
    pub(super) fn new(quantity: Quantity, times: &[f64], values: &[f64]) -> Self {
        let merged = times.iter().zip(values).map(|(t, v)| (*t, *v, 1.0));
        Self::of(quantity, &merged.collect::<Vec<_>>())
    }

    fn of(quantity: Quantity, readings: &[Merged]) -> Self {
        let forwards = RecordSide {
            times: readings.iter().map(|one| one.0).collect(),
            values: readings.iter().map(|one| one.1).collect(),
        };
        let backwards = RecordSide {
            times: readings.iter().rev().map(|one| 1.0 - one.0).collect(),
            values: readings.iter().rev().map(|one| one.1).collect(),
        };
        let weights: Vec<f64> = readings.iter().map(|one| one.2).collect();
        let roots: Vec<f64> = weights.iter().map(|weight| weight.sqrt()).collect();
        let both_ways = |list: Vec<f64>| {
            let reversed = list.iter().rev().copied().collect();
            [list, reversed]
        };
        Self {
            quantity,
            sides: [forwards, backwards],
            total: weights.iter().sum(),
            weights: both_ways(weights),
            roots: both_ways(roots),
        }
    }

    pub(super) fn count(&self) -> usize {
        self.weights[0].len()
    }

    pub(super) fn times(&self, anchor: Anchor) -> &[f64] {
        &self.sides[anchor as usize].times
    }

    /// A record of few readings, in which neighbours that are alike are one.
    pub(super) fn merged(&self) -> Self {
        let most = if self.count() > LONG {
            MERGED_LONG
        } else {
            MERGED
        };
        let side = &self.sides[0];
        let each = side.times.iter().zip(&side.values).zip(&self.weights[0]);
        let mut readings: Vec<Merged> = each.map(|((t, v), w)| (*t, *v, *w)).collect();
        while readings.len() > most {
            readings = merge_cheapest(&readings, most);
        }
        Self::of(self.quantity, &readings)
    }

    /// Least squares of the values on `basis` (and a constant, for displacements); `None` where the law
    /// would have to slide backwards.
    pub(super) fn project(&self, anchor: Anchor, basis: &[f64]) -> Option<Projected> {
        let projected = self.regress(anchor, basis);
        let sense = match (self.quantity, anchor) {
            (Quantity::Displacement, Anchor::End) => -1.0,
            (Quantity::Displacement, Anchor::Start) | (Quantity::Velocity, _) => 1.0,
        };
        let forward = projected.velocity * sense > 0.0;
        (forward && projected.velocity.is_finite() && projected.cost.is_finite())
            .then_some(projected)
    }

    /// The same, whichever way it slides.
    fn regress(&self, anchor: Anchor, basis: &[f64]) -> Projected {
        let values = &self.sides[anchor as usize].values;
        let weights = &self.weights[anchor as usize];
        let each = || basis.iter().zip(values).zip(weights);
        let (mut mean_basis, mut mean_value) = (0.0, 0.0);
        if self.quantity == Quantity::Displacement {
            for ((b, v), w) in each() {
                mean_basis += w * b;
                mean_value += w * v;
            }
            mean_basis /= self.total;
            mean_value /= self.total;
        }
        let (mut squares, mut products) = (0.0, 0.0);
        for ((b, v), w) in each() {
            let centred = b - mean_basis;
            squares += w * centred * centred;
            products += w * centred * (v - mean_value);
        }
        let velocity = products / squares;
        let mut cost = 0.0;
        for ((b, v), w) in each() {
            let left = (v - mean_value) - velocity * (b - mean_basis);
            cost += w * left * left;
        }
        Projected {
            velocity,
            offset: mean_value - velocity * mean_basis,
            cost,
            mean_basis,
            mean_value,
            squares,
        }
    }

    /// Weighted residuals of a projection.
    pub(super) fn residuals(
        &self,
        anchor: Anchor,
        basis: &[f64],
        projected: &Projected,
        out: &mut [f64],
    ) {
        let values = &self.sides[anchor as usize].values;
        let roots = &self.roots[anchor as usize];
        for (((slot, b), v), root) in out.iter_mut().zip(basis).zip(values).zip(roots) {
            let left = (v - projected.mean_value) - projected.velocity * (b - projected.mean_basis);
            *slot = left * root;
        }
    }

    /// Turns a derivative of the basis into that of the weighted residuals, in place.
    pub(super) fn differentiate(
        &self,
        anchor: Anchor,
        basis: &[f64],
        projected: &Projected,
        column: &mut [f64],
    ) {
        let values = &self.sides[anchor as usize].values;
        let weights = &self.weights[anchor as usize];
        let mut mean = 0.0;
        if self.quantity == Quantity::Displacement {
            mean = column.iter().zip(weights).map(|(d, w)| d * w).sum::<f64>() / self.total;
        }
        let mut change = 0.0;
        for (((d, b), v), w) in column.iter().zip(basis).zip(values).zip(weights) {
            let value = v - projected.mean_value;
            let basis = b - projected.mean_basis;
            change += w * (d - mean) * (value - 2.0 * projected.velocity * basis);
        }
        change /= projected.squares;
        let roots = &self.roots[anchor as usize];
        for ((d, b), root) in column.iter_mut().zip(basis).zip(roots) {
            let moved = projected.velocity * (*d - mean) + change * (b - projected.mean_basis);
            *d = -moved * root;
        }
    }

    /// Sum of squares about the best constant velocity, or the best constant-rate displacement: what
    /// a law without any curvature of its own leaves.
    pub(super) fn cost_of_no_change(&self) -> f64 {
        let steady: Vec<f64> = match self.quantity {
            Quantity::Velocity => vec![1.0; self.count()],
            Quantity::Displacement => self.sides[0].times.clone(),
        };
        self.regress(Anchor::Start, &steady).cost
    }
}

/// Merges the quarter of the neighbouring pairs that are most alike, down to no fewer than `most`.
fn merge_cheapest(readings: &[Merged], most: usize) -> Vec<Merged> {
    let count = readings.len();
    let price = |pair: &[Merged]| {
        let (a, b) = (pair[0], pair[1]);
        let (step, wait) = (a.1 - b.1, a.0 - b.0);
        a.2 * b.2 / (a.2 + b.2) * (step * step + TIME_SHARE * wait * wait)
    };
    let mut priced: Vec<(f64, usize)> = readings.windows(2).map(price).zip(0..).collect();
    priced.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let wanted = (count - most).min((count / 4).max(1));
    let mut taken = vec![false; count];
    let mut begins = vec![false; count];
    let mut merged = 0;
    for (_, index) in priced {
        if merged < wanted && !taken[index] && !taken[index + 1] {
            (taken[index], taken[index + 1], begins[index]) = (true, true, true);
            merged += 1;
        }
    }
    let mut out = Vec::with_capacity(count - merged);
    let mut index = 0;
    while index < count {
        let one = readings[index];
        if begins[index] {
            let other = readings[index + 1];
            let weight = one.2 + other.2;
            let mean = |a: f64, b: f64| (a * one.2 + b * other.2) / weight;
            out.push((mean(one.0, other.0), mean(one.1, other.1), weight));
            index += 1;
        } else {
            out.push(one);
        }
        index += 1;
    }
    out
}
