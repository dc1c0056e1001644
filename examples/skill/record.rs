//! One forecast as it was made, in short.

use crate::corpus::{Kind, Look, Subject};
use serde::Serialize;
use slipwatch::forecast::Passage;
use slipwatch::score::{Known, Method, Outcome};

/// A passage is reduced to so many times, each of about the same share of it.
const MOST_TIMES: u32 = 64;

/// A series as its records name it.
#[derive(Debug, Clone)]
pub(crate) struct Told {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    pub(crate) family: String,
    /// By look, then by method.
    pub(crate) records: Vec<Record>,
}

/// What one method said at one look.
#[derive(Debug, Clone)]
pub(crate) struct Record {
    pub(crate) method: &'static str,
    /// Days before the failure that were asked for; `None` of a slope that stood.
    pub(crate) lead_days: Option<f64>,
    /// The latest measured-at time that was used, days since the first reading.
    pub(crate) now_days: f64,
    /// What came, as seen from there.
    pub(crate) outcome: Outcome,
    /// `None` where the method had nothing to say.
    pub(crate) said: Option<Passage>,
}

impl Record {
    /// What `method` says at one look, of what is `known` by then.
    pub(crate) fn of(subject: &Subject, look: &Look, known: &Known, method: &Method) -> Self {
        Self {
            method: method.name,
            lead_days: look.lead_days,
            now_days: known.now_days,
            outcome: subject.truth.from(known.now_days),
            said: (method.forecast)(known).map(|passage| reduced(&passage)),
        }
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

#[derive(Serialize)]
struct Line<'a> {
    series: &'a str,
    kind: &'static str,
    family: &'a str,
    method: &'static str,
    lead_days: Option<f64>,
    now_days: f64,
    failed_after_days: Option<f64>,
    stood_for_days: Option<f64>,
    passage: Option<&'a [(f64, f64)]>,
}

/// Every record, a line of JSON each.
pub(crate) fn lines(told: &[Told]) -> serde_json::Result<String> {
    let mut out = String::new();
    for one in told {
        for record in &one.records {
            let (failed_after_days, stood_for_days) = match record.outcome {
                Outcome::Failed(days) => (Some(days), None),
                Outcome::Stood(days) => (None, Some(days)),
            };
            out.push_str(&serde_json::to_string(&Line {
                series: &one.name,
                kind: one.kind.name(),
                family: &one.family,
                method: record.method,
                lead_days: record.lead_days,
                now_days: record.now_days,
                failed_after_days,
                stood_for_days,
                passage: record.said.as_ref().map(Passage::times),
            })?);
            out.push('\n');
        }
    }
    Ok(out)
}
