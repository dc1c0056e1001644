//! The laws with m = 1: inverse velocity is a straight line, and one number gives its shape.

use super::chart::{Anchor, Direction, slope_bounds};
use super::record::WeightedRecord;
use crate::model::Law;
use crate::reading::Quantity;

/// ln(|r| L) where the search looks first: lowest, step, how many.
const STARTS: (f64, f64, u32) = (-5.0, 0.9, 16);
/// How many of them are followed down.
const FOLLOWED: usize = 2;
/// Steps of Gauss and Newton, and the size of one that has converged.
const MOST_STEPS: usize = 30;
const LEAST_STEP: f64 = 1e-10;
const LONGEST_STEP: f64 = 1.0;
const MOST_HALVINGS: usize = 8;

/// A straight line in inverse velocity.
#[derive(Debug, Clone, Copy)]
pub(super) struct UnitMLine {
    pub(super) direction: Direction,
    /// ln(|r| L) at the anchor.
    pub(super) ln_slope: f64,
    pub(super) cost: f64,
}

/// The end where the velocity is greatest: y is 1 there and rises away from it.
pub(super) fn anchor(direction: Direction) -> Anchor {
    match direction {
        Direction::Accelerating => Anchor::End,
        Direction::Decelerating => Anchor::Start,
    }
}

/// Searches lines; keeps its memory.
#[derive(Debug)]
pub(super) struct UnitMLines {
    basis: Vec<f64>,
    column: Vec<f64>,
    residuals: Vec<f64>,
    pub(super) evaluations: usize,
}

impl UnitMLines {
    /// For records of at most `count` readings.
    pub(super) fn new(count: usize) -> Self {
        Self {
            basis: vec![0.0; count],
            column: vec![0.0; count],
            residuals: vec![0.0; count],
            evaluations: 0,
        }
    }

    /// The minima that descents from a few places end in, lowest first.
    pub(super) fn minima(
        &mut self,
        record: &WeightedRecord,
        direction: Direction,
        shift: f64,
    ) -> Vec<UnitMLine> {
        let (lowest, step, count) = STARTS;
        let at = (0..count).map(|i| lowest + step * (f64::from(i) + shift));
        let costs: Vec<UnitMLine> = at
            .map(|ln_slope| UnitMLine {
                direction,
                ln_slope,
                cost: self.cost(record, direction, ln_slope),
            })
            .collect();
        let cost = |i: usize| costs.get(i).map_or(f64::INFINITY, |line| line.cost);
        let is_low = |i: &usize| cost(*i) <= cost(i + 1) && cost(*i) <= cost(i.wrapping_sub(1));
        let mut low: Vec<UnitMLine> = (0..costs.len()).filter(is_low).map(|i| costs[i]).collect();
        low.retain(|line| line.cost.is_finite());
        low.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        low.truncate(FOLLOWED);
        for line in &mut low {
            *line = self.descend(record, *line);
        }
        low
    }

    /// The best line that descent from those finds.
    pub(super) fn best(
        &mut self,
        record: &WeightedRecord,
        from: &[UnitMLine],
    ) -> Option<UnitMLine> {
        let ends = from.iter().map(|line| self.descend(record, *line));
        ends.min_by(|a, b| a.cost.total_cmp(&b.cost))
            .filter(|line| line.cost.is_finite())
    }

    fn cost(&mut self, record: &WeightedRecord, direction: Direction, ln_slope: f64) -> f64 {
        self.evaluations += 1;
        let (anchor, slope) = (anchor(direction), ln_slope.exp());
        let count = record.count();
        for (slot, t) in self.basis.iter_mut().zip(record.times(anchor)) {
            *slot = match record.quantity {
                Quantity::Velocity => 1.0 / (1.0 + slope * t),
                Quantity::Displacement => (slope * t).ln_1p() / slope,
            };
        }
        let projected = record.project(anchor, &self.basis[..count]);
        projected.map_or(f64::INFINITY, |projected| projected.cost)
    }

    /// By Gauss and Newton with halved steps: one unknown, the rest is projected out, so that there is nothing to damp.
    fn descend(&mut self, record: &WeightedRecord, start: UnitMLine) -> UnitMLine {
        let bounds = slope_bounds();
        let mut line = start;
        line.cost = self.cost(record, line.direction, line.ln_slope);
        for _ in 0..MOST_STEPS {
            let Some(mut step) = self.step(record, &line) else {
                break;
            };
            let before = line.cost;
            for _ in 0..MOST_HALVINGS {
                let there = (line.ln_slope + step).clamp(bounds.0, bounds.1);
                let cost = self.cost(record, line.direction, there);
                if cost < line.cost {
                    (line.ln_slope, line.cost) = (there, cost);
                    break;
                }
                step *= 0.3;
            }
            if line.cost >= before || step.abs() < LEAST_STEP {
                break;
            }
        }
        line
    }

    /// Gauss and Newton's step at a line.
    fn step(&mut self, record: &WeightedRecord, line: &UnitMLine) -> Option<f64> {
        let anchor = anchor(line.direction);
        self.cost(record, line.direction, line.ln_slope);
        let count = record.count();
        let (basis, slope) = (&self.basis[..count], line.ln_slope.exp());
        let column = &mut self.column[..count];
        for ((slot, f), t) in column.iter_mut().zip(basis).zip(record.times(anchor)) {
            *slot = match record.quantity {
                Quantity::Velocity => -slope * t * f * f,
                Quantity::Displacement => t / (1.0 + slope * t) - f,
            };
        }
        let projected = record.project(anchor, basis)?;
        record.differentiate(anchor, basis, &projected, column);
        let residuals = &mut self.residuals[..count];
        record.residuals(anchor, basis, &projected, residuals);
        let products = column.iter().zip(&*residuals).map(|(d, r)| d * r);
        let gradient: f64 = products.sum();
        let curvature: f64 = column.iter().map(|d| d * d).sum();
        let step = -gradient / curvature;
        (step.abs() > LEAST_STEP && step.is_finite())
            .then(|| step.clamp(-LONGEST_STEP, LONGEST_STEP))
    }

    /// The law of a line at the first reading, and the modelled displacement there (velocities: 0),
    /// both in the record's units of value.
    pub(super) fn law(
        &mut self,
        record: &WeightedRecord,
        line: &UnitMLine,
        length_days: f64,
    ) -> Option<(Law, f64)> {
        let anchor = anchor(line.direction);
        self.cost(record, line.direction, line.ln_slope);
        let projected = record.project(anchor, &self.basis[..record.count()])?;
        let (slope, velocity) = (line.ln_slope.exp(), projected.velocity);
        let forwards = match record.quantity {
            Quantity::Velocity => velocity,
            // Displacement from the end was counted backwards.
            Quantity::Displacement => velocity.abs() / length_days,
        };
        Some(match anchor {
            Anchor::Start => (
                Law::from_fit(forwards, -slope / length_days, 0.0, 0.0),
                projected.offset,
            ),
            Anchor::End => {
                let y = 1.0 + slope;
                let r = slope / y / length_days;
                let past = match record.quantity {
                    Quantity::Velocity => 0.0,
                    Quantity::Displacement => velocity * slope.ln_1p() / slope,
                };
                (
                    Law::from_fit(forwards / y, r, 0.0, 0.0),
                    projected.offset + past,
                )
            }
        })
    }
}
