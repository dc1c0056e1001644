//! A series made ready for a search: its readings, its covariates, the plain law, and the noise models.

use super::channels::drivers;
use super::noise::{Noise, Whitener};
use super::options::Options;
use super::problem::Problem;
use super::refit::Fitted;
use super::response::Driver;
use super::search::{Search, plain};
use super::term::Scratch;
use crate::reading::{Channel, Series, Unit};

/// All that a search rests on.
#[derive(Debug, Clone)]
pub(super) struct Ready {
    pub(super) problem: Problem,
    pub(super) drivers: Vec<Driver>,
    pub(super) bank: Vec<Whitener>,
    /// The plain law by least squares.
    pub(super) plain: Fitted,
    /// In which it is reported.
    pub(super) unit: Unit,
}

impl Ready {
    /// Of cleaned readings and covariates; `None` where they are too few, or show no motion. Says in `remarks` which
    /// covariates were left out.
    pub(super) fn of(
        series: &Series,
        channels: &[Channel],
        remarks: &mut Vec<String>,
    ) -> Option<Self> {
        let mut problem = Problem::new(series, channels)?;
        let plain = plain(&problem, &mut Scratch::default())?;
        problem.see(&plain.velocity);
        let drivers = drivers(&problem, channels, remarks);
        Some(Self {
            bank: Noise::bank(&problem),
            drivers,
            problem,
            plain,
            unit: series.unit,
        })
    }

    /// The search, before anything was tried; `is_drawn`: the values are smoother than any instrument's.
    pub(super) fn search<'a>(&'a self, options: &'a Options, is_drawn: bool) -> Search<'a> {
        Search::new(&self.problem, &self.drivers, &self.bank, options, is_drawn)
    }
}
