//! The misfit of a law to point readings, its linear unknowns (velocity, zero of displacement) solved for.

use super::chart::Anchor;
use crate::model::{Accuracy, Law, Trajectory};
use crate::reading::Quantity;

/// The readings of one benchmark as point values, in any unit of the quantity.
#[derive(Debug, Clone, PartialEq)]
pub struct PointReadings {
    quantity: Quantity,
    days: Vec<f64>,
    /// Less `centre`, over `scale`.
    values: Vec<f64>,
    centre: f64,
    scale: f64,
}

/// The linear unknowns, in the unit of the readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Linear {
    /// The velocity at the anchor.
    pub(super) velocity: f64,
    /// The displacement at the anchor; 0 for velocities.
    pub(super) displacement: f64,
}

impl PointReadings {
    /// From (days, value) pairs; what is not finite or not later than the pair before is left out.
    /// Displacements must be in a length, velocities in a length per day or any other time.
    pub fn new(quantity: Quantity, pairs: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (mut days, mut values): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
        for (day, value) in pairs {
            let later = days.last().is_none_or(|last| day > *last);
            if day.is_finite() && value.is_finite() && later {
                days.push(day);
                values.push(value);
            }
        }
        let first = days.first().copied().unwrap_or(0.0);
        for day in &mut days {
            *day -= first;
        }
        let centre = match quantity {
            Quantity::Velocity => 0.0,
            Quantity::Displacement => values.iter().map(|v| v / values.len() as f64).sum::<f64>(),
        };
        let sizes = values.iter().map(|value| (value - centre).abs());
        let scale = Some(sizes.fold(0.0, f64::max))
            .filter(|scale| scale.is_normal())
            .unwrap_or(1.0);
        for value in &mut values {
            *value = (*value - centre) / scale;
        }
        Self {
            quantity,
            days,
            values,
            centre,
            scale,
        }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.values.len()
    }

    /// Days from the first to the last.
    pub fn length_days(&self) -> f64 {
        self.days.last().copied().unwrap_or(0.0)
    }

    /// Displacement or velocity.
    pub fn quantity(&self) -> Quantity {
        self.quantity
    }

    /// Whether they are all one number.
    pub(super) fn all_equal(&self) -> bool {
        self.values
            .windows(2)
            .all(|pair| pair[0].total_cmp(&pair[1]).is_eq())
    }

    /// The unknowns of the law that are found by projection, without the nonlinear ones.
    pub(super) fn linear_unknowns(&self) -> usize {
        match self.quantity {
            Quantity::Velocity => 1,
            Quantity::Displacement => 2,
        }
    }

    /// The root mean square, in the readings' unit, of residuals that sum to `cost` squared.
    pub(super) fn rms(&self, cost: f64) -> f64 {
        (cost / self.count() as f64).sqrt() * self.scale
    }

    /// Sum of squares about the best constant velocity, or the best constant-rate displacement: what
    /// a law without any curvature of its own leaves.
    pub(super) fn cost_of_no_change(&self) -> f64 {
        let mut out = vec![0.0; self.count()];
        let steady: Vec<f64> = match self.quantity {
            Quantity::Velocity => vec![1.0; self.count()],
            Quantity::Displacement => self.days.clone(),
        };
        self.project(&steady, &mut out);
        out.iter().map(|residual| residual * residual).sum()
    }

    /// Residuals of `law` (velocity 1 at the anchor) with its linear unknowns at their best; `None`
    /// where it cannot be followed over the record or would have to slide backwards.
    pub(super) fn residuals(
        &self,
        law: &Law,
        anchor: Anchor,
        basis: &mut Vec<f64>,
        out: &mut [f64],
    ) -> Option<Linear> {
        self.basis(law, anchor, basis)?;
        let linear = self.project(basis, out);
        (linear.velocity > 0.0 && linear.velocity.is_finite()).then_some(Linear {
            velocity: linear.velocity * self.scale,
            displacement: linear.displacement * self.scale + self.centre,
        })
    }

    /// Velocity, or displacement from the anchor, of a law with unit velocity there.
    fn basis(&self, law: &Law, anchor: Anchor, basis: &mut Vec<f64>) -> Option<()> {
        let length = self.length_days();
        let (law, sense) = match anchor {
            Anchor::Start => (*law, 1.0),
            Anchor::End => (law.reversed(), -1.0),
        };
        let solution = Trajectory::solve(&law, length, Accuracy::Fit);
        basis.clear();
        for day in &self.days {
            let from_anchor = match anchor {
                Anchor::Start => *day,
                Anchor::End => length - day,
            };
            let motion = solution.at(from_anchor)?;
            let value = match self.quantity {
                Quantity::Velocity => motion.velocity,
                Quantity::Displacement => sense * motion.displacement,
            };
            if !value.is_finite() {
                return None;
            }
            basis.push(value);
        }
        Some(())
    }

    /// Least squares of the scaled values on the basis (and a constant, for displacements).
    fn project(&self, basis: &[f64], out: &mut [f64]) -> Linear {
        let n = basis.len().max(1) as f64;
        let (mean_basis, mean_value) = match self.quantity {
            Quantity::Velocity => (0.0, 0.0),
            Quantity::Displacement => (
                basis.iter().sum::<f64>() / n,
                self.values.iter().sum::<f64>() / n,
            ),
        };
        let (mut squares, mut products) = (0.0, 0.0);
        for (b, value) in basis.iter().zip(&self.values) {
            squares += (b - mean_basis) * (b - mean_basis);
            products += (b - mean_basis) * (value - mean_value);
        }
        let velocity = if squares > 0.0 {
            products / squares
        } else {
            0.0
        };
        for ((slot, b), value) in out.iter_mut().zip(basis).zip(&self.values) {
            *slot = (value - mean_value) - velocity * (b - mean_basis);
        }
        Linear {
            velocity,
            displacement: mean_value - velocity * mean_basis,
        }
    }
}
