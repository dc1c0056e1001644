//! The straight line through inverse velocity (Fukuzono 1985).

use super::point;
use crate::fit::RateOptions;
use crate::forecast::{InverseVelocityLine, Passage};
use crate::score::Known;

/// Through every rate of the record.
pub(in crate::score) fn raw(known: &Known) -> Option<Passage> {
    let observations = &known.observations;
    let rates = observations.rates(0..observations.values.len(), RateOptions::default());
    let line = InverseVelocityLine::fit(&rates)?;
    Some(
        line.intercept_days
            .map_or_else(Passage::default, |days| point(days - known.now_days)),
    )
}
