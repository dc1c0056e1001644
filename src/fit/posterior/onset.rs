//! Since when the law holds: a few candidate starts, each tried on all the rates, and averaged over.
//!
//! Before its start a law's slope creeps at the velocity that the law starts with, with the same scatter;
//! so every candidate explains the same readings, and their evidences compare.

use super::Posterior;
use super::mode::{ModeProblem, Sign};
use super::prior::FROM_THE_FIRST;
use super::window::Window;

/// Ranges of starts tried besides the first reading, and the least half-width of one, in ln.
const LATER: u32 = 8;
const LEAST_REACH: f64 = 0.01;
/// Fewest rates after a start.
const FEWEST_RATES: usize = 8;

/// When the law began to hold, days since the epoch of the rates; the bounds hold 90 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// 5 % quantile.
    pub low_days: f64,
    /// Median: the first reading where that is the likelier.
    pub median_days: f64,
    /// 95 % quantile.
    pub high_days: f64,
}

/// A range of starts: how far back the law holds in its middle, and ln of its prior probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct OnsetStart {
    span_days: f64,
    reach: f64,
    log_prior: f64,
}

impl OnsetStart {
    /// The first reading, for certain.
    pub(super) fn first(window: &Window) -> Self {
        Self {
            span_days: window.length_days,
            reach: 0.0,
            log_prior: 0.0,
        }
    }

    /// The first reading, and ranges of later starts, even in the log of their distance from the present.
    pub(super) fn candidates(window: &Window) -> Vec<Self> {
        let first = Self::first(window);
        let longest = window.length_days;
        let newest = window.seen.len().checked_sub(FEWEST_RATES);
        let Some(shortest) = newest.map(|index| window.seen[index].older) else {
            return vec![first];
        };
        let reach = 0.5 * (longest / shortest).ln() / f64::from(LATER);
        if reach < LEAST_REACH || reach.is_nan() {
            return vec![first];
        }
        let later = (0..LATER).map(|index| Self {
            span_days: longest * (-reach * f64::from(2 * index + 1)).exp(),
            reach,
            log_prior: ((1.0 - FROM_THE_FIRST) / f64::from(LATER)).ln(),
        });
        let first = Self {
            log_prior: FROM_THE_FIRST.ln(),
            ..first
        };
        std::iter::once(first).chain(later).collect()
    }

    /// The laws of one sign that hold from this start on.
    pub(super) fn problem<'a>(&self, window: &'a Window, sign: Sign) -> ModeProblem<'a> {
        ModeProblem {
            window,
            span_days: self.span_days,
            sign,
            span_reach: self.reach,
            log_prior: self.log_prior,
        }
    }
}

impl Posterior {
    /// When the law began to hold; the first rate's start where no other was tried.
    pub fn onset(&self) -> Onset {
        let spans = self.spans_days.iter().zip(&self.ensemble.samples);
        let mut spans: Vec<(f64, f64)> = spans.map(|(span, one)| (*span, one.weight)).collect();
        // The longest span is the earliest start.
        spans.sort_by(|a, b| b.0.total_cmp(&a.0));
        let quantile = |share: f64| {
            let mut reached = 0.0;
            let found = spans.iter().find(|(_, weight)| {
                reached += weight;
                reached >= share
            });
            let span = found.or(spans.last());
            span.map_or(self.from_days, |(span, _)| self.ensemble.now_days - span)
        };
        Onset {
            low_days: quantile(0.05),
            median_days: quantile(0.5),
            high_days: quantile(0.95),
        }
    }
}
