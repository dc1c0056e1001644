//! What a forecaster has at a time: everything measured until then, and nothing later.

use crate::fit::{Observation, Observations};

/// A whole record, from which only the past is given out.
#[derive(Debug, Clone, PartialEq)]
pub struct WholeRecord {
    /// The readings, days since the first.
    pub observations: Observations,
    /// (days, value) of a river's flow beside them, in time order; empty where there is none.
    pub flow: Vec<(f64, f64)>,
    /// Passing this velocity is failure, mm/day.
    pub critical_mm_per_day: f64,
}

/// The part of a record that was measured by a time.
#[derive(Debug, Clone, PartialEq)]
pub struct Known {
    /// The latest measured-at time that the forecast may use, days: that of the newest reading.
    pub now_days: f64,
    /// The readings until then.
    pub observations: Observations,
    /// The river's flow until then.
    pub flow: Vec<(f64, f64)>,
    /// Passing this velocity is failure, mm/day.
    pub critical_mm_per_day: f64,
}

impl WholeRecord {
    /// What is known at `days`; `None` before the first reading.
    pub fn at(&self, days: f64) -> Option<Known> {
        let values = &self.observations.values;
        let read = values.partition_point(|value| value.t_days <= days);
        let values: Vec<Observation> = values.get(..read)?.to_vec();
        let now_days = values.last()?.t_days;
        let flowed = self.flow.partition_point(|(at, _)| *at <= now_days);
        Some(Known {
            now_days,
            observations: Observations {
                quantity: self.observations.quantity,
                averaging_days: self.observations.averaging_days,
                values,
            },
            flow: self.flow[..flowed].to_vec(),
            critical_mm_per_day: self.critical_mm_per_day,
        })
    }
}
