//! Whether the plain law's residual has structure that a load could bring: the cheap look before a search.

use super::diagnosis::{Judged, is_clear, load_sd, undeclared_load};
use super::noise::Noise;
use super::problem::Problem;
use super::search::plain;
use super::term::Scratch;
use crate::reading::{Series, Timestamp, after_days};

/// What the residual of the law under a constant load holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Residual {
    /// By how much the BIC falls if a random load is let into the noise, against white noise and noise of the
    /// reading alone.
    pub bic_gain: f64,
    /// Standard deviation of that load, e-folds of velocity.
    pub load_sd: f64,
    /// From when it stands out; the first reading where it nowhere does by itself.
    pub since: Timestamp,
}

/// Fits the plain law to `series` by least squares and weighs what it leaves; the noise's sizes are tried on the
/// law linearised, so that it costs one fit. `None` with fewer than eight readings, where none moves, or where
/// the sampling leaves a load no room.
pub fn residual_structure(series: &Series) -> Option<Residual> {
    let mut scratch = Scratch::default();
    let mut problem = Problem::new(series, &[])?;
    let fitted = plain(&problem, &mut scratch)?;
    problem.see(&fitted.velocity);
    let bank = Noise::bank(&problem);
    let judged = Judged::of(&problem, &fitted, &bank, &mut scratch)?;
    let (whitener, _) = judged.load?;
    let load = undeclared_load(&problem, &fitted, whitener);
    let first = load.iter().position(|one| is_clear(*one)).unwrap_or(0);
    Some(Residual {
        bic_gain: judged.load_gain(),
        load_sd: load_sd(&load),
        since: after_days(problem.epoch, problem.t[first])?,
    })
}
