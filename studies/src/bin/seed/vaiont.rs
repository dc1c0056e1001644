//! Vaiont: m, the regime and the time of failure of the four benchmarks, and the exponent alpha.

use super::recorded::{displacements, report};
use super::simplex::{self, SimplexFit};
use anyhow::Result;
use slipwatch::fit::{ConstantLoad, Exponent};
use slipwatch::inversion::{Alternative, FitReport, Inversion, InversionOptions};
use slipwatch::reading::{BenchmarkId, Recording, Series};

/// The paper's m of each benchmark, in its order.
pub(crate) const PAPER: [(&str, f64); 4] = [("5", 1.35), ("63", 1.24), ("67", 0.99), ("50", 1.00)];
/// The collapse, 9 October 22:39, in days from 2 August.
pub(crate) const COLLAPSE_DAY: f64 = 68.94;
/// Where the paper's lines through 1/v meet zero.
pub(crate) const PAPER_LINE_DAY: f64 = 69.5;

/// One benchmark, inverted.
#[derive(Debug)]
pub(crate) struct Benchmark {
    pub(crate) id: &'static str,
    pub(crate) paper_m: f64,
    /// Velocities, mm/day.
    pub(crate) series: Series,
    pub(crate) free: FitReport,
    /// The same with its laws.
    pub(crate) least_squares: ConstantLoad,
    /// By simplexes over the paper's unknowns.
    pub(crate) simplex: Option<SimplexFit>,
    /// With the paper's m imposed.
    pub(crate) at_paper_m: ConstantLoad,
    /// From the velocities summed to displacements.
    pub(crate) from_displacement: FitReport,
}

/// A side of m = 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Above,
    At,
    Below,
}

/// The four benchmarks in the paper's order.
pub(crate) fn inverted(recording: &Recording) -> Result<Vec<Benchmark>> {
    let one = |(id, paper_m): (&'static str, f64)| {
        let series = recording.series(Some(&BenchmarkId::new(id)), None)?;
        let inversion = Inversion::new(series, &InversionOptions::default());
        let least_squares = inversion.least_squares();
        let imposed = InversionOptions {
            exponent: Exponent::Fixed(paper_m),
            ..InversionOptions::default()
        };
        Ok(Benchmark {
            id,
            paper_m,
            series: series.clone(),
            free: inversion.report(&least_squares, 0.0),
            simplex: simplex::fit(series)?,
            least_squares,
            at_paper_m: Inversion::new(series, &imposed).least_squares(),
            from_displacement: report(&displacements(series), &InversionOptions::default()),
        })
    };
    PAPER.into_iter().map(one).collect()
}

/// The best minimum on one side of m = 1.
pub(crate) fn best_on(side: Side, report: &FitReport) -> Option<&Alternative> {
    let is_there = |m: f64| match side {
        Side::Above => m > 1.0,
        Side::At => (m - 1.0).abs() < f64::EPSILON,
        Side::Below => m < 1.0,
    };
    let mut all = report.alternatives.0.iter();
    all.find(|one| one.m.is_some_and(is_there))
}
