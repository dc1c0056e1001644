//! One forecast as it was made, in short.

use crate::corpus::{Evaluation, SkillSubject, SubjectKind};
use slipwatch::forecast::Passage;
use slipwatch::reading::Timestamp;
use slipwatch::score::{Known, Method, Outcome, is_covered};

/// A passage is reduced to so many times, each of about the same share of it.
const MOST_TIMES: u32 = 64;
/// Chances are given of passing within so many days.
pub(crate) const HORIZONS_DAYS: [f64; 6] = [0.25, 1.0, 2.0, 3.0, 10.0, 30.0];

/// A series as its records name it.
#[derive(Debug, Clone)]
pub(crate) struct SeriesForecasts {
    pub(crate) name: String,
    pub(crate) kind: SubjectKind,
    pub(crate) family: String,
    /// Of the first reading; `None` of a simulated life.
    pub(crate) epoch: Option<Timestamp>,
    /// By look, then by method.
    pub(crate) records: Vec<Record>,
}

/// What one method said at one look.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub(crate) method: &'static str,
    /// Days before the failure that were asked for; `None` of a look that is one of several spread over the record.
    pub(crate) lead_days: Option<f64>,
    /// The latest measured-at time that was used, days since the first reading.
    pub(crate) now_days: f64,
    /// What came, as seen from there.
    pub(crate) outcome: Outcome,
    /// `None` where the method had nothing to say.
    pub(crate) said: Option<Passage>,
    /// Chance of passing within each of [`HORIZONS_DAYS`].
    pub(crate) chances: [f64; HORIZONS_DAYS.len()],
    /// Of a failure: the chance given to its coming by then.
    pub(crate) pit: Option<f64>,
    /// Whether the interval held the failure; `None` without a failure or an interval.
    pub(crate) covered: Option<bool>,
}

impl Record {
    /// What `method` says at one look, of what is `known` by then.
    pub(crate) fn of(
        subject: &SkillSubject,
        look: &Evaluation,
        known: &Known,
        method: &Method,
    ) -> Self {
        let said = (method.forecast)(known);
        let outcome = subject.truth.from(known.now_days);
        let after = match outcome {
            Outcome::Failed(after) => Some(after),
            Outcome::Stood(_) => None,
        };
        // An interval has more than one time, a point forecast one.
        let spread = said.as_ref().filter(|said| said.times().len() > 1);
        let chance = |days| said.as_ref().map_or(0.0, |said| said.chance_within(days));
        Self {
            method: method.name,
            lead_days: look.lead_days,
            now_days: known.now_days,
            outcome,
            chances: HORIZONS_DAYS.map(chance),
            pit: said
                .as_ref()
                .zip(after)
                .map(|(said, after)| said.chance_within(after)),
            covered: spread
                .zip(after)
                .map(|(said, after)| is_covered(said, after)),
            said: said.as_ref().map(reduced),
        }
    }

    /// Days to the failure; `None` of a slope that stood.
    pub(crate) fn remaining_days(&self) -> Option<f64> {
        match self.outcome {
            Outcome::Failed(days) => Some(days),
            Outcome::Stood(_) => None,
        }
    }

    /// The chance of passing within one of [`HORIZONS_DAYS`].
    pub(crate) fn chance_within(&self, horizon_days: f64) -> f64 {
        let mut each = HORIZONS_DAYS.iter().zip(&self.chances);
        each.find_map(|(days, chance)| days.total_cmp(&horizon_days).is_eq().then_some(*chance))
            .unwrap_or(0.0)
    }
}

/// The same chances at no more than [`MOST_TIMES`] times: neighbours that make up one share come at their mean.
fn reduced(passage: &Passage) -> Passage {
    let total: f64 = passage.times().iter().map(|(_, share)| share).sum();
    let mut shares: Vec<(u32, f64, f64)> = Vec::new();
    let mut before = 0.0;
    for (days, share) in passage.times().iter().filter(|(_, share)| *share > 0.0) {
        let middle = (before + 0.5 * share) / total * f64::from(MOST_TIMES);
        before += share;
        let bin = (1..MOST_TIMES)
            .find(|bin| middle < f64::from(*bin))
            .unwrap_or(MOST_TIMES);
        match shares.last_mut() {
            Some((last, sum, weight)) if *last == bin => {
                *sum += days * share;
                *weight += share;
            }
            Some(_) | None => shares.push((bin, days * share, *share)),
        }
    }
    let times = shares
        .into_iter()
        .map(|(_, sum, weight)| (sum / weight, weight));
    Passage::from_times(times.collect())
}
