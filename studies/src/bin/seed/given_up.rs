//! The one statement on Vaiont that cannot be had together with the others, and the numbers tried.

use super::recorded::vaiont_day;
use super::vaiont::PAPER_LINE_DAY;
use anyhow::Result;
use slipwatch::inversion::{Inversion, InversionOptions};
use slipwatch::reading::{BenchmarkId, Recording, Series};

/// The benchmarks whose fits are near 1/(`t_c` - t).
pub(crate) const BENCHMARKS: [&str; 3] = ["5", "63", "50"];
/// The day from which the increase is made to exhaust itself.
pub(crate) const FROM_DAY: f64 = 64.0;
/// ln(velocity) lost per day from then on.
const LOSSES: [f64; 6] = [0.0, 0.001, 0.003, 0.01, 0.02, 0.035];
/// Days over which the last gain of ln(velocity) is taken.
const LAST_DAYS: usize = 4;

/// The readings with a part of their last increase taken away.
#[derive(Debug, Clone)]
pub(crate) struct LossTrial {
    pub(crate) loss_per_day: f64,
    /// Best m, and the gain of the last days over that of 1/(69.5 - t), of each of [`BENCHMARKS`].
    pub(crate) of: Vec<(Option<f64>, Option<f64>)>,
}

/// A trial for each loss, the first with none.
pub(crate) fn trials(recording: &Recording) -> Result<Vec<LossTrial>> {
    let trial = |loss_per_day| {
        let mut of = Vec::new();
        for id in BENCHMARKS {
            let series = recording.series(Some(&BenchmarkId::new(id)), None)?;
            let series = exhausted(series, loss_per_day)?;
            let fit = Inversion::new(&series, &InversionOptions::default()).least_squares();
            let m = fit.best().map(|best| 1.0 / (1.0 - best.law.p));
            of.push((m, last_gain(&series)?));
        }
        Ok(LossTrial { loss_per_day, of })
    };
    LOSSES.into_iter().map(trial).collect()
}

fn exhausted(series: &Series, loss_per_day: f64) -> Result<Series> {
    let mut series = series.clone();
    for reading in &mut series.readings {
        let days = (vaiont_day(reading.time)? - FROM_DAY).max(0.0);
        reading.value *= (-loss_per_day * days).exp();
    }
    Ok(series)
}

/// What ln(velocity) gained over the last four days, over what ln of 1/(69.5 - t) gains: under 1, the
/// increase exhausts itself before that day.
pub(crate) fn last_gain(series: &Series) -> Result<Option<f64>> {
    let mut last = series.readings.iter().rev();
    let (Some(to), Some(from)) = (last.next(), last.nth(LAST_DAYS - 1)) else {
        return Ok(None);
    };
    let left = |time| vaiont_day(time).map(|day| PAPER_LINE_DAY - day);
    let expected = (left(from.time)? / left(to.time)?).ln();
    Ok(Some((to.value / from.value).ln() / expected))
}
