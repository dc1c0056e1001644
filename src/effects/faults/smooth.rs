//! Series smoother than any instrument: interpolated between sparse points, drawn, or digitised from a drawing.

use super::trace::{Trace, extreme, resolution};
use crate::effects::quantiles::{median, quantile};

/// Fewer values do not show it.
const FEWEST: usize = 60;
/// Correlation of each rate of change with the next from which no instrument is left in it.
const SMOOTH: f64 = 0.98;
/// How far the bends agree in sign from one to the next, at least, in a smooth curve; noise makes
/// them alternate, however fast the ground accelerates.
const BENDS_AGREE: f64 = 0.3;
/// Share of the points that stand exactly on the line between their neighbours.
const LINEAR: f64 = 0.5;
/// A rise between neighbours of fewer steps of the resolution is no line but rounding.
const LINE_STEPS: f64 = 20.0;
/// Typical change, as a factor's logarithm, from one sampling interval to the next, from which
/// sampling is irregular.
const IRREGULAR: f64 = 0.5;
/// Share of turning points under which a curve is smooth; white noise has two thirds.
const FEW_TURNS: f64 = 0.3;
/// Agreement of interval and increment under which the points were set by the pen: a smooth motion
/// read at times of its own moves more in a longer interval (.6 to 1; drawn curves under .2).
const PEN: f64 = 0.3;
/// Upper over lower quartile of the increments' sizes, under which they are all of one length.
const ONE_LENGTH: f64 = 2.75;

/// In which way a series is no instrument's.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Smoothness {
    /// Straight lines between sparse points.
    Lines,
    /// A smooth curve at regular times.
    Curve,
    /// The vertices of a drawn curve.
    Drawing,
}

/// Whether the benchmark's readings are smoother than any instrument.
pub(super) fn smoothness(trace: &Trace) -> Option<Smoothness> {
    if trace.len() < FEWEST {
        None
    } else if is_lines(trace) {
        Some(Smoothness::Lines)
    } else if is_curve(trace) {
        Some(Smoothness::Curve)
    } else if is_drawing(trace) {
        Some(Smoothness::Drawing)
    } else {
        None
    }
}

/// Whether most points stand exactly on the line between their neighbours.
pub(super) fn is_lines(trace: &Trace) -> bool {
    if trace.len() < FEWEST {
        return false;
    }
    let (days, values) = (&trace.days, &trace.values);
    let step = resolution(values);
    let tolerance = (0.75 * step).max(1e-9 * extreme(&trace.increments()));
    let on_line = (1..values.len() - 1).filter(|&at| {
        let rise = values[at + 1] - values[at - 1];
        let share = (days[at] - days[at - 1]) / (days[at + 1] - days[at - 1]);
        let off = values[at] - values[at - 1] - share * rise;
        rise.abs() > LINE_STEPS * step && off.abs() <= tolerance
    });
    on_line.count() as f64 > LINEAR * (values.len() - 2) as f64
}

fn is_curve(trace: &Trace) -> bool {
    let rates: Vec<f64> = trace
        .increments()
        .iter()
        .zip(trace.intervals())
        .map(|(rise, days)| rise / days)
        .collect();
    let bends: Vec<f64> = rates.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let bends_agree = agreement(&bends[..bends.len() - 1], &bends[1..]);
    autocorrelation(&rates) > SMOOTH && bends_agree > BENDS_AGREE
}

fn is_drawing(trace: &Trace) -> bool {
    let moves: Vec<(f64, f64)> = trace
        .increments()
        .into_iter()
        .zip(trace.intervals())
        .filter(|(rise, _)| *rise != 0.0)
        .collect();
    if moves.len() < FEWEST {
        return false;
    }
    let pairs = || moves.windows(2).map(|pair| (pair[0], pair[1]));
    let intervals: Vec<f64> = pairs().map(|(a, b)| (b.1 / a.1).ln()).collect();
    let rises: Vec<f64> = pairs().map(|(a, b)| (b.0 / a.0).abs().ln()).collect();
    let turns = pairs().filter(|(a, b)| a.0 * b.0 < 0.0).count();
    let sizes: Vec<f64> = moves.iter().map(|(rise, _)| rise.abs()).collect();
    let changes: Vec<f64> = intervals.iter().map(|change| change.abs()).collect();
    median(&changes) > IRREGULAR
        && (turns as f64) < FEW_TURNS * intervals.len() as f64
        && quantile(&sizes, 0.75) < ONE_LENGTH * quantile(&sizes, 0.25)
        && agreement(&intervals, &rises) < PEN
}

/// Correlation of each value with the next; 0 for a constant.
fn autocorrelation(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let square = |value: &f64| (value - mean).powi(2);
    let variance: f64 = values.iter().map(square).sum();
    let products = values
        .windows(2)
        .map(|pair| (pair[0] - mean) * (pair[1] - mean));
    if variance > 0.0 {
        products.sum::<f64>() / variance
    } else {
        0.0
    }
}

/// How far two sequences lie on the same side of their medians together, -1 to 1: a correlation
/// that no single pair can carry.
fn agreement(a: &[f64], b: &[f64]) -> f64 {
    let (middle_a, middle_b) = (median(a), median(b));
    let sides = a.iter().zip(b).map(|(a, b)| {
        let product = (a - middle_a) * (b - middle_b);
        if product == 0.0 {
            0.0
        } else {
            product.signum()
        }
    });
    sides.sum::<f64>() / a.len().max(1) as f64
}
