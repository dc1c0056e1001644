//! La Clapière: the fit of 1982.9 to 1987.9, m free and imposed, and t_max growing from two to five years.

use super::recorded::{report, velocities};
use anyhow::{Context, Result};
use slipwatch::fit::{ConstantLoad, Exponent};
use slipwatch::inversion::{
    FitReport, Inversion, InversionOptions, SweepOptions, SweepReport, sweep,
};
use slipwatch::reading::{Series, Timestamp};

/// 1984.9, 1987.0 and 1987.9.
pub(crate) const TWO_YEARS: &str = "1984-11-25T00:00:00Z";
pub(crate) const END_OF_1986: &str = "1987-01-01T00:00:00Z";
pub(crate) const FIVE_YEARS: &str = "1987-11-25T00:00:00Z";
/// The paper's best fit, and what it imposed beside it.
pub(crate) const PAPER_M: f64 = 0.98;
pub(crate) const PAPER_X_I: f64 = 39.0;
pub(crate) const IMPOSED_M: f64 = 1.5;
/// Every quarter of a year.
const STEPS: usize = 13;

/// One inversion of 1982.9 to 1987.9.
#[derive(Debug)]
pub(crate) struct Fit {
    pub(crate) exponent: Exponent,
    pub(crate) report: FitReport,
    pub(crate) least_squares: ConstantLoad,
}

/// The displacement readings of 1982.9 to 1987.9.
pub(crate) fn readings(whole: &Series) -> Result<Series> {
    let options = InversionOptions {
        until: Some(FIVE_YEARS.parse()?),
        ..InversionOptions::default()
    };
    Ok(Inversion::new(whole, &options).series().clone())
}

/// m free, then the paper's m, 1 and the imposed 1.5.
pub(crate) fn fits(series: &Series) -> Vec<Fit> {
    let exponents = [
        Exponent::Free,
        Exponent::Fixed(PAPER_M),
        Exponent::Fixed(1.0),
        Exponent::Fixed(IMPOSED_M),
    ];
    let fit = |exponent| {
        let options = InversionOptions {
            exponent,
            ..InversionOptions::default()
        };
        let inversion = Inversion::new(series, &options);
        let least_squares = inversion.least_squares();
        Fit {
            exponent,
            report: inversion.report(&least_squares, 0.0),
            least_squares,
        }
    };
    exponents.into_iter().map(fit).collect()
}

/// The inversion of the velocities between the readings.
pub(crate) fn velocity_fit(series: &Series) -> Result<FitReport> {
    Ok(report(&velocities(series)?, &InversionOptions::default()))
}

/// t_max every quarter of a year from two to five years after the start.
pub(crate) fn growing(series: &Series) -> Result<SweepReport> {
    let last = series.readings.last().context("no readings")?.time;
    let steps = SweepOptions {
        first: Some(TWO_YEARS.parse()?),
        last: Some(last),
        steps: STEPS,
    };
    Ok(sweep(series, &InversionOptions::default(), &steps))
}

/// Whether `t_max` is before the end of 1986.
pub(crate) fn is_before_the_end_of_1986(t_max: Timestamp) -> Result<bool> {
    Ok(t_max < END_OF_1986.parse::<Timestamp>()?)
}
