//! Since when the law holds: a few candidate starts, each tried on all the rates, and averaged over.
//!
//! Before its start a law's slope creeps at the velocity that the law starts with, with the same scatter;
//! so every candidate explains the same readings, and their evidences compare.

use super::mode::{Problem, Sign};
use super::prior::FROM_THE_FIRST;
use super::window::Window;
use super::{Posterior, Sample};

/// Starts tried besides the first reading.
const LATER: usize = 8;
/// Fewest rates after a start.
const FEWEST_RATES: usize = 8;

/// When the law began to hold, days since the epoch of the rates; the bounds hold 90 %.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Onset {
    /// 5 % quantile.
    pub low_days: f64,
    /// The most probable of the starts tried.
    pub best_days: f64,
    /// 95 % quantile.
    pub high_days: f64,
}

/// A start: how far back the law holds, and ln of its prior probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Start {
    pub(super) span_days: f64,
    pub(super) log_prior: f64,
}

impl Start {
    /// The first reading, for certain.
    pub(super) fn first(window: &Window) -> Self {
        Self {
            span_days: window.length_days,
            log_prior: 0.0,
        }
    }

    /// The first reading, and later ones whose distances from the present fall geometrically.
    pub(super) fn candidates(window: &Window) -> Vec<Self> {
        let count = window.seen.len();
        let longest = window.length_days;
        let Some(newest) = count.checked_sub(FEWEST_RATES).map(|i| window.seen[i].older) else {
            return vec![Self::first(window)];
        };
        let at = |index: usize| longest * (newest / longest).powf(index as f64 / LATER as f64);
        let snap = |wanted: f64| {
            let later = window.seen.iter().map(|rate| rate.older);
            later.filter(|ago| *ago <= wanted * 1.001).fold(newest, f64::max)
        };
        let mut spans: Vec<f64> = (1..=LATER).map(|index| snap(at(index))).collect();
        spans.retain(|span| *span < 0.999 * longest);
        spans.dedup();
        if spans.is_empty() {
            return vec![Self::first(window)];
        }
        let each = ((1.0 - FROM_THE_FIRST) / spans.len() as f64).ln();
        let later = spans.into_iter().map(|span_days| Self {
            span_days,
            log_prior: each,
        });
        let first = Self {
            span_days: longest,
            log_prior: FROM_THE_FIRST.ln(),
        };
        std::iter::once(first).chain(later).collect()
    }

    /// The laws of one sign that hold from this start on.
    pub(super) fn problem<'a>(&self, window: &'a Window, sign: Sign) -> Problem<'a> {
        Problem {
            window,
            span_days: self.span_days,
            sign,
            log_prior: self.log_prior,
        }
    }
}

impl Posterior {
    /// When the law began to hold; the first rate's start where no other was tried.
    pub fn onset(&self) -> Onset {
        let mut spans: Vec<(f64, f64)> = Vec::new();
        for (span, Sample { weight, .. }) in self.spans_days.iter().zip(&self.ensemble.samples) {
            match spans.iter_mut().find(|known| known.0.to_bits() == span.to_bits()) {
                Some(known) => known.1 += weight,
                None => spans.push((*span, *weight)),
            }
        }
        // The longest span is the earliest start.
        spans.sort_by(|a, b| b.0.total_cmp(&a.0));
        let start = |span: f64| self.ensemble.now_days - span;
        let quantile = |share: f64| {
            let mut reached = 0.0;
            let found = spans.iter().find(|(_, weight)| {
                reached += weight;
                reached >= share
            });
            found.or(spans.last()).map_or(self.from_days, |one| start(one.0))
        };
        let best = spans.iter().max_by(|a, b| a.1.total_cmp(&b.1));
        Onset {
            low_days: quantile(0.05),
            best_days: best.map_or(self.from_days, |one| start(one.0)),
            high_days: quantile(0.95),
        }
    }
}
