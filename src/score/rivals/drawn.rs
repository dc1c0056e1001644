//! Records drawn without noise, for the tests of the methods.

use crate::fit::{Observation, Observations};
use crate::forecast::Passage;
use crate::reading::Quantity;
use crate::score::Known;

/// Velocities of the moment, mm/day, every `step` days until `end`.
pub(super) fn velocities(step: f64, end: f64, velocity: impl Fn(f64) -> f64) -> Known {
    record(Quantity::Velocity, step, end, velocity)
}

/// Displacements, mm, every `step` days until `end`.
pub(super) fn slips(step: f64, end: f64, slip: impl Fn(f64) -> f64) -> Known {
    record(Quantity::Displacement, step, end, slip)
}

fn record(quantity: Quantity, step: f64, end: f64, value: impl Fn(f64) -> f64) -> Known {
    let days = (0_u32..).map(|index| step * f64::from(index));
    let values: Vec<Observation> = days
        .take_while(|t_days| *t_days <= end)
        .map(|t_days| Observation {
            t_days,
            value: value(t_days),
            sigma: None,
        })
        .collect();
    Known {
        now_days: values[values.len() - 1].t_days,
        observations: Observations {
            quantity,
            averaging_days: 0.0,
            values,
        },
        flow: Vec::new(),
        critical_mm_per_day: 1000.0,
    }
}

/// The one time of a point forecast, days of the record.
pub(super) fn when(known: &Known, passage: Option<&Passage>) -> f64 {
    match passage.unwrap().times() {
        [(days, share)] => {
            assert!((share - 1.0).abs() < 1e-12);
            known.now_days + days
        }
        times => panic!("{times:?}"),
    }
}

/// Whether it is forecast that the critical velocity is never passed.
pub(super) fn never(passage: Option<&Passage>) -> bool {
    passage.is_some_and(|passage| passage.times().is_empty())
}
