//! Point readings as they are given and as they are kept: from the first, about their mean, over their size.

use super::record::WeightedRecord;
use super::solution::{EndOfSearch, Solution};
use crate::model::Law;
use crate::reading::Quantity;

/// Roundings that a reading on a line may differ from it by: of the number, of its day, of the mean that it is taken about.
const ROUNDINGS: f64 = 8.0;

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

    /// Whether they are displacements that rise along one line, to the rounding of the numbers that they were read from.
    pub(super) fn is_rising_line(&self) -> bool {
        let (Some(first), Some(last)) = (self.values.first(), self.values.last()) else {
            return false;
        };
        let (rise, length) = (last - first, self.length_days());
        let rounding = ROUNDINGS * f64::EPSILON * (1.0 + self.centre.abs() / self.scale);
        let is_on_line =
            |(day, value): (&f64, &f64)| (value - first - rise * day / length).abs() <= rounding;
        self.quantity == Quantity::Displacement
            && rise > rounding
            && self.days.iter().zip(&self.values).all(is_on_line)
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

    /// The readings over their length, the values as they are kept.
    pub(super) fn record(&self) -> WeightedRecord {
        let length = self.length_days();
        let times: Vec<f64> = self.days.iter().map(|day| day / length).collect();
        WeightedRecord::new(self.quantity, &times, &self.values)
    }

    /// A solution in the readings' unit, from one in the values as they are kept.
    pub(super) fn solution(
        &self,
        law: &Law,
        at_start: f64,
        cost: f64,
        place: EndOfSearch,
    ) -> Solution {
        let displacement_at_start = match self.quantity {
            Quantity::Velocity => 0.0,
            Quantity::Displacement => at_start * self.scale + self.centre,
        };
        Solution {
            law: Law {
                v_i: law.v_i * self.scale,
                ..*law
            },
            displacement_at_start,
            rms: self.rms(cost),
            place,
        }
    }
}
