//! The rates as the likelihood sees them, and their residuals from a law.
//!
//! Residuals are differences of asinh(v / s), which is ln v where a velocity stands clear of its own
//! error and v itself where it does not: so zero and backward velocities are readings like all others,
//! and the scale is the data's alone, the same for every law.

use super::past::{PastShape, PastSolution};
use crate::fit::newest_slope::newest_interval_days;
use crate::fit::rates::{Rate, ReadingError};

/// A velocity this many of its own standard errors large is half-way from v to ln v.
const BEND: f64 = 10.0;

/// A velocity this many standard errors from its neighbours is not like them.
const STANDS_OUT: f64 = 5.0;
/// Neighbours on either side that say how fast it was about then.
const NEIGHBOURS: usize = 3;

/// One rate.
#[derive(Debug, Clone, Copy)]
pub(super) struct SeenRate {
    /// Days from its start and from its end to the present.
    pub(super) older: f64,
    pub(super) newer: f64,
    /// asinh(v / scale), or ln v where the scale is 0.
    height: f64,
    scale: f64,
    /// What a relative change of velocity changes in the height.
    pub(super) load: f64,
    /// Variance of the white scatter for a relative scatter of 1.
    pub(super) white: f64,
    /// Variance of the rate's own error, in the height.
    pub(super) own: f64,
    /// Standard error of the reading at each end, where the rate is a difference of readings.
    pub(super) ends: f64,
}

/// A window of rates.
#[derive(Debug, Clone)]
pub(super) struct Window {
    /// The present: the end of the last rate, days.
    pub(super) now_days: f64,
    /// From the start of the first rate to the present, days.
    pub(super) length_days: f64,
    /// The newest sampling interval, days.
    pub(super) interval_days: f64,
    /// Oldest first.
    pub(super) seen: Vec<SeenRate>,
    spacing_days: f64,
}

impl Window {
    /// `None` where the rates span no time or none of them moves.
    pub(super) fn new(rates: &[Rate]) -> Option<Self> {
        let (first, last) = (rates.first()?, rates.last()?);
        let length = last.to - first.from;
        let moves = rates.iter().any(|rate| rate.velocity > 0.0);
        if !(length > 0.0 && moves) {
            return None;
        }
        let floor = floor(rates);
        let mut spacings: Vec<f64> = rates.windows(2).map(|w| w[1].to - w[0].to).collect();
        spacings.sort_by(f64::total_cmp);
        let spacing = spacings.get(spacings.len() / 2).copied().unwrap_or(length);
        Some(Self {
            now_days: last.to,
            length_days: length,
            interval_days: newest_interval_days(rates).unwrap_or(length),
            seen: rates
                .iter()
                .zip(about(rates))
                .map(|(rate, about)| SeenRate::new(rate, last.to, (about, floor)))
                .collect(),
            spacing_days: spacing.max(1e-6 * length),
        })
    }

    /// The shortest and the longest correlation time that the scatter may have, days.
    pub(super) fn memories_days(&self) -> (f64, f64) {
        let longest = self.length_days;
        (self.spacing_days.min(0.5 * longest), longest)
    }

    /// Residuals of a law with velocity exp(`ln_v`) now, which holds for `span` days back; before them the
    /// slope creeps at the velocity that it had then. False where the law leaves the prior's range.
    pub(super) fn residuals(
        &self,
        past: &mut PastSolution,
        ln_v: f64,
        shape: PastShape,
        span: f64,
        out: &mut [f64],
    ) -> bool {
        if !(ln_v.abs() < 600.0 && past.solve(shape, span)) {
            return false;
        }
        let mut hint = 0;
        let mut before: Option<(f64, f64)> = None;
        for (slot, rate) in out.iter_mut().zip(&self.seen).rev() {
            let ln_predicted = if rate.older > rate.newer {
                let newer = match before {
                    Some((ago, slip)) if ago.to_bits() == rate.newer.to_bits() => slip,
                    _ => past.at(rate.newer, &mut hint).1,
                };
                let older = past.at(rate.older, &mut hint).1;
                before = Some((rate.older, older));
                ln_v + ((older - newer) / (rate.older - rate.newer)).ln()
            } else {
                ln_v - past.at(rate.newer, &mut hint).0
            };
            *slot = rate.height
                - if rate.scale > 0.0 {
                    asinh(ln_predicted.exp() / rate.scale)
                } else {
                    ln_predicted
                };
        }
        out.iter().all(|residual| residual.is_finite())
    }
}

impl SeenRate {
    fn new(rate: &Rate, now_days: f64, (about, floor): (f64, f64)) -> Self {
        let sigma = rate.sigma.max(floor);
        let scale = BEND * sigma;
        // By the neighbours, or else a reading that happens to be high would count for more.
        let stands_out = (rate.velocity - about).abs() > STANDS_OUT * sigma;
        let typical = if stands_out { rate.velocity } else { about };
        let size = typical.max(0.0).hypot(scale);
        let load = (typical / size).max(0.0);
        let own = sigma / size;
        let (own, ends) = match rate.error {
            ReadingError::Own => (own * own, 0.0),
            // The two ends' errors together make the rate's.
            ReadingError::OfEnds => (0.0, own * std::f64::consts::FRAC_1_SQRT_2),
        };
        Self {
            older: now_days - rate.from,
            newer: now_days - rate.to,
            height: if scale > 0.0 {
                asinh(rate.velocity / scale)
            } else {
                rate.velocity.ln()
            },
            scale,
            load,
            white: load * load / f64::from(rate.readings.max(1)),
            own,
            ends,
        }
    }
}

/// The mean velocity of each rate's neighbours.
fn about(rates: &[Rate]) -> Vec<f64> {
    let of = |index: usize| {
        let first = index.saturating_sub(NEIGHBOURS);
        let near = &rates[first..(index + NEIGHBOURS + 1).min(rates.len())];
        let sum: f64 = near.iter().map(|rate| rate.velocity).sum();
        let others = (near.len() - 1).max(1) as f64;
        (sum - rates[index].velocity) / others
    };
    (0..rates.len()).map(of).collect()
}

/// What a velocity without a stated error may be off by, mm/day: nothing, unless some of them do not
/// move forwards; then as far as those go, and half the smallest that does.
fn floor(rates: &[Rate]) -> f64 {
    let bare = || rates.iter().filter(|rate| rate.sigma <= 0.0);
    let backwards: Vec<f64> = bare()
        .map(|rate| rate.velocity)
        .filter(|velocity| *velocity <= 0.0)
        .collect();
    if backwards.is_empty() {
        return 0.0;
    }
    let mean_square = backwards.iter().map(|v| v * v).sum::<f64>() / backwards.len() as f64;
    let forwards = rates.iter().map(|rate| rate.velocity).filter(|v| *v > 0.0);
    let smallest = forwards.fold(f64::INFINITY, f64::min);
    mean_square.sqrt().max(0.5 * smallest)
}

/// To 1e-15 absolute; the library's is relative, and four times slower.
fn asinh(x: f64) -> f64 {
    let size = x.abs();
    let value = if size < 1e100 {
        (size + (size * size + 1.0).sqrt()).ln()
    } else {
        size.ln() + std::f64::consts::LN_2
    };
    value.copysign(x)
}
