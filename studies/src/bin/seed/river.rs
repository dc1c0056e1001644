//! La Clapière: what the Tinée explains of the velocity before 1986 and after, and what became of the peak.

use super::recorded::{decimal_year, velocities};
use anyhow::{Context, Result};
use slipwatch::fit::ConstantLoad;
use slipwatch::model::{Accuracy, Trajectory};
use slipwatch::reading::{Channel, LineFit, Reading, Series, days_since};
use std::ops::Range;

/// Days over which the flow is smoothed, exponentially.
const RESPONSE_DAYS: f64 = 15.0;
/// Years in which the river is learned.
const BEFORE: Range<f64> = 1982.0..1986.0;
/// And those in which what was learned is tried.
const AFTER: Range<f64> = 1986.0..1988.0;
/// The years over which the velocity was six times less than its peak.
const LATER: Range<f64> = 1988.0..1991.0;

/// What the river explains of ln(velocity) about the fit of 1982.9 to 1987.9, and the fall after it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct River {
    /// Share of the variance of 1982 to 1985.
    pub(crate) before: Option<f64>,
    /// That of 1986 and 1987, with the gain of before; below 0 the river makes it worse.
    pub(crate) after: Option<f64>,
    /// The fastest month over the mean velocity of 1988 to 1990.
    pub(crate) fall: Option<f64>,
}

/// Of the whole record, with the best fit of its first five years.
pub(crate) fn river(whole: &Series, flow: Option<&Channel>, fit: &ConstantLoad) -> Result<River> {
    let mut before = Vec::new();
    let mut after = Vec::new();
    for (year, flow, residual) in residuals(whole, flow, fit)? {
        if BEFORE.contains(&year) {
            before.push((flow, residual));
        } else if AFTER.contains(&year) {
            after.push((flow, residual));
        }
    }
    let gain = gain(&before);
    Ok(River {
        before: gain.and_then(|gain| explained(&before, gain)),
        after: gain.and_then(|gain| explained(&after, gain)),
        fall: fall(whole)?,
    })
}

/// Year, smoothed flow and ln of the velocity over the fit's, of every month that the fit reaches.
fn residuals(
    whole: &Series,
    flow: Option<&Channel>,
    fit: &ConstantLoad,
) -> Result<Vec<(f64, f64, f64)>> {
    let (Some(flow), Some(best)) = (flow, fit.best()) else {
        return Ok(Vec::new());
    };
    let first = whole.readings.first().context("no readings")?.time;
    let smooth = smoothed(flow);
    let end_days = 366.0 * 5.0;
    let solution = Trajectory::solve(&best.law, end_days, Accuracy::Full);
    let mut residuals = Vec::new();
    for pair in whole.readings.windows(2) {
        let at = |reading: &Reading| days_since(first, reading.time);
        let (from, to) = (at(&pair[0]), at(&pair[1]));
        let motions = (to < end_days).then(|| solution.at(from).zip(solution.at(to)));
        let Some((start, end)) = motions.flatten() else {
            break;
        };
        let inside = smooth.iter().filter(|(time, _)| {
            let day = days_since(first, *time);
            (from..to).contains(&day)
        });
        let (sum, count) = inside.fold((0.0, 0.0), |(sum, n), (_, flow)| (sum + flow, n + 1.0));
        let moved = pair[1].value - pair[0].value;
        let residual = (moved / (end.displacement - start.displacement)).ln();
        let year = decimal_year(pair[0].time)? + 0.5 * (to - from) / 365.25;
        if count > 0.0 && residual.is_finite() {
            residuals.push((year, sum / count, residual));
        }
    }
    Ok(residuals)
}

/// The flow through an exponential response.
fn smoothed(flow: &Channel) -> Vec<(slipwatch::reading::Timestamp, f64)> {
    let mut all = Vec::new();
    let mut state = None;
    for sample in &flow.samples {
        let value = match state {
            None => sample.value,
            Some((time, last)) => {
                let kept = (-days_since(time, sample.time) / RESPONSE_DAYS).exp();
                kept * last + (1.0 - kept) * sample.value
            }
        };
        state = Some((sample.time, value));
        all.push((sample.time, value));
    }
    all
}

fn centred(pairs: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let count = pairs.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / count;
    let (x_mean, y_mean) = (mean(|pair| pair.0), mean(|pair| pair.1));
    pairs
        .iter()
        .map(|(x, y)| (x - x_mean, y - y_mean))
        .collect()
}

fn gain(pairs: &[(f64, f64)]) -> Option<f64> {
    LineFit::through(pairs).map(|line| line.slope())
}

fn explained(pairs: &[(f64, f64)], gain: f64) -> Option<f64> {
    let pairs = centred(pairs);
    let whole: f64 = pairs.iter().map(|(_, y)| y * y).sum();
    let left: f64 = pairs.iter().map(|(x, y)| (y - gain * x).powi(2)).sum();
    (whole > 0.0).then(|| 1.0 - left / whole)
}

fn fall(whole: &Series) -> Result<Option<f64>> {
    let velocities = velocities(whole)?;
    let (mut peak, mut sum, mut count) = (0.0, 0.0, 0.0);
    for reading in &velocities.readings {
        let year = decimal_year(reading.time)?;
        if LATER.contains(&year) {
            sum += reading.value;
            count += 1.0;
        } else if year < LATER.start {
            peak = f64::max(peak, reading.value);
        }
    }
    Ok((count > 0.0).then(|| peak * count / sum))
}
