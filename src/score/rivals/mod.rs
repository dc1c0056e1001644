//! The rival methods, each as it was published, each knowing the past alone.

pub(super) mod line;

use super::Known;
use crate::forecast::{Panel, Passage};

/// A point forecast, `days` from now; `None` where it lies in the past.
fn point(days: f64) -> Passage {
    Passage::from_times(vec![(days.max(0.0), 1.0)])
}

/// The law under an undeclared load, alone.
pub(super) fn slider_block(known: &Known) -> Option<Passage> {
    let outlook = Panel::default().update(&known.observations, known.critical_mm_per_day)?;
    Some(outlook.passage)
}
