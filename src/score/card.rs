//! The scorecard of one benchmark: what each method said at each lead, and how that compares with what came.

use super::measure::{Outcome, crps_days, is_covered, log_score, scored_days};
use super::{Known, Method, WholeRecord};
use crate::fit::Observations;
use crate::forecast::{FEWEST_READINGS, HORIZON_DAYS, Passage};
use crate::reading::{Channel, CovariateKind, Series, Timestamp, after_days, days_since};
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::BTreeMap;

/// The leads that are scored where a record reaches so far back, days.
pub const LEADS_DAYS: [f64; 14] = [
    40.0,
    20.0,
    10.0,
    5.0,
    2.0,
    1.0,
    18.0 / 24.0,
    12.0 / 24.0,
    8.0 / 24.0,
    6.0 / 24.0,
    4.0 / 24.0,
    3.0 / 24.0,
    2.0 / 24.0,
    1.0 / 24.0,
];
/// Forecasts that are scored of a slope that stood, evenly over its readings.
const FORECASTS: usize = 40;
/// A forecast is for a lead where its newest reading lies at no more than so many leads.
const FARTHEST_LEADS: f64 = 2.0;
/// A reading at the lead itself is known, whatever the rounding of the two, days.
const ROUNDING: f64 = 1e-9;

/// What came of a slope.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Truth {
    /// It failed then.
    Failed(Timestamp),
    /// It had not by the end of its record.
    Stood,
}

/// How the methods did on one benchmark.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Card {
    /// Names, the program's own first.
    pub methods: Vec<&'static str>,
    /// Leads of a failure, longest first.
    pub leads: Vec<Lead>,
    /// Looks at a slope that stood, in order of time.
    pub looks: Vec<Evaluation>,
}

/// At one lead.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Lead {
    /// The lead that was asked for, days.
    pub lead_days: f64,
    /// The latest measured-at time that any forecast here used.
    pub known_until: Timestamp,
    /// From there to the failure, days.
    pub remaining_days: f64,
    /// How far from there a forecast is scored, days. Of a failure beyond it the CRPS says nothing: it is 0 for who expects none.
    pub scored_days: f64,
    /// By method; one that had nothing to say is scored as saying that no failure comes.
    pub scores: BTreeMap<&'static str, Score>,
}

/// At one look at a slope that stood.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Evaluation {
    /// The latest measured-at time that any forecast here used.
    pub known_until: Timestamp,
    /// From there to the end of the record, days.
    pub stood_days: f64,
    /// By method.
    pub scores: BTreeMap<&'static str, Score>,
}

/// How one forecast did.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct Score {
    /// Median less failure, days: above 0 is late, and unsafe; `None` where no median, or no failure, came.
    pub error_days: Option<f64>,
    /// The continuous ranked probability score, days.
    pub crps_days: f64,
    /// Nats.
    pub log_score: f64,
    /// Whether the interval of 90 % held the failure; `None` for a point forecast, and where there was none.
    pub covered: Option<bool>,
    /// Chance of failure within the horizon.
    pub probability: f64,
    /// The unconditional 5 % quantile, median and 95 % quantile.
    pub low: Option<Timestamp>,
    /// See [`Score::low`].
    pub median: Option<Timestamp>,
    /// See [`Score::low`].
    pub high: Option<Timestamp>,
    /// Whether the method had anything to say.
    pub said: bool,
}

impl WholeRecord {
    /// The readings of a series, with the first channel beside it that is a river's flow.
    pub fn of(series: &Series, channels: &[Channel], critical_mm_per_day: f64) -> Self {
        let epoch = series.readings.first().map(|reading| reading.time);
        let is_flow = |channel: &&Channel| channel.kind() == CovariateKind::Flow;
        let river = channels.iter().find(is_flow);
        let samples = river.into_iter().flat_map(|channel| &channel.samples);
        let days = |time| epoch.map_or(0.0, |epoch| days_since(epoch, time));
        Self {
            observations: Observations::of(series),
            flow: samples.map(|one| (days(one.time), one.value)).collect(),
            critical_mm_per_day,
        }
    }
}

/// The scorecard of a history that began at `epoch`, by `methods`; `progress` is called after each look with how many are
/// done, of how many.
pub fn card(
    history: &WholeRecord,
    epoch: Timestamp,
    truth: Truth,
    methods: &[Method],
    progress: &mut dyn FnMut(u64, u64),
) -> Card {
    let mut card = Card {
        methods: methods.iter().map(|method| method.name).collect(),
        leads: Vec::new(),
        looks: Vec::new(),
    };
    let looks = looks(history, epoch, truth);
    let count = looks.len() as u64;
    for (done, (lead, known)) in (1..).zip(looks) {
        let Some(at) = after_days(epoch, known.now_days) else {
            continue;
        };
        match truth {
            Truth::Failed(failure) => {
                let remaining_days = days_since(at, failure);
                card.leads.push(Lead {
                    lead_days: lead,
                    known_until: at,
                    remaining_days,
                    scored_days: known.scored_days(),
                    scores: scores(methods, &known, at, Outcome::Failed(remaining_days)),
                });
            }
            Truth::Stood => {
                let last = history.observations.values.last();
                let stood_days = last.map_or(0.0, |last| last.t_days - known.now_days);
                card.looks.push(Evaluation {
                    known_until: at,
                    stood_days,
                    scores: scores(methods, &known, at, Outcome::Stood(stood_days)),
                });
            }
        }
        progress(done, count);
    }
    card
}

/// What is known at each lead or look, with the lead.
fn looks(history: &WholeRecord, epoch: Timestamp, truth: Truth) -> Vec<(f64, Known)> {
    let enough =
        |known: &Known| known.observations.spaced(FEWEST_READINGS).len() >= FEWEST_READINGS;
    match truth {
        Truth::Failed(failure) => {
            let failure = days_since(epoch, failure);
            let known = LEADS_DAYS.iter().filter_map(|lead| {
                let known = history.at(failure - lead + ROUNDING)?;
                let near = failure - known.now_days <= FARTHEST_LEADS * lead;
                (near && enough(&known)).then_some((*lead, known))
            });
            known.collect()
        }
        Truth::Stood => {
            let values = &history.observations.values;
            let looks = FORECASTS.min(values.len().saturating_sub(1));
            let known = (1..=looks).filter_map(|look| {
                let last = (values.len() - 1) * look / looks;
                let known = history.at(values.get(last.checked_sub(1)?)?.t_days)?;
                enough(&known).then_some((0.0, known))
            });
            known.collect()
        }
    }
}

impl Known {
    /// How far from it a forecast is scored, days.
    fn scored_days(&self) -> f64 {
        let first = self.observations.values.first();
        scored_days(first.map_or(0.0, |first| self.now_days - first.t_days))
    }
}

fn scores(
    methods: &[Method],
    known: &Known,
    at: Timestamp,
    outcome: Outcome,
) -> BTreeMap<&'static str, Score> {
    let scored = known.scored_days();
    let each = methods.iter().map(|method| {
        let said = (method.forecast)(known);
        (method.name, score(said.as_ref(), at, outcome, scored))
    });
    each.collect()
}

fn score(said: Option<&Passage>, at: Timestamp, outcome: Outcome, scored: f64) -> Score {
    let never = Passage::default();
    let forecast = said.unwrap_or(&never);
    let quantile = |share| forecast.quantile(share, HORIZON_DAYS);
    let time = |share| after_days(at, quantile(share)?);
    let failed = match outcome {
        Outcome::Failed(days) => Some(days),
        Outcome::Stood(_) => None,
    };
    Score {
        error_days: quantile(0.5)
            .zip(failed)
            .map(|(median, days)| median - days),
        crps_days: crps_days(forecast, outcome, scored),
        log_score: log_score(forecast, outcome),
        covered: failed
            .filter(|_| forecast.times().len() > 1)
            .map(|days| is_covered(forecast, days)),
        probability: forecast.chance_within(HORIZON_DAYS),
        low: time(0.05),
        median: time(0.5),
        high: time(0.95),
        said: said.is_some(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::METHODS;

    /// 1/v falls in a line to zero at day 60; read daily.
    fn history(days: u32) -> WholeRecord {
        let fall = |day: f64| (day, -100.0 * (1.0 - day / 60.0).ln());
        WholeRecord {
            observations: Observations::of_displacements((0..days).map(f64::from).map(fall)),
            flow: Vec::new(),
            critical_mm_per_day: 1000.0,
        }
    }

    #[test]
    fn the_river_is_the_channel_that_is_a_flow_by_its_unit_by_its_name_or_because_it_is_stated() {
        let channel = |name: &str, unit: Option<&str>, stated| Channel {
            name: name.to_owned(),
            unit: unit.map(str::to_owned),
            stated,
            samples: vec![crate::reading::Sample {
                time: epoch(),
                value: 7.0,
            }],
        };
        let series = Series {
            benchmark: crate::reading::BenchmarkId::new("a"),
            unit: crate::reading::Unit::MM,
            averaging: None,
            readings: vec![crate::reading::Reading {
                time: epoch(),
                value: 0.0,
                sigma: None,
            }],
        };
        let river = |channel| !WholeRecord::of(&series, &[channel], 1.0).flow.is_empty();
        assert!(river(channel("spring_l_s", Some("l_s"), None)));
        assert!(river(channel("inflow", None, None)));
        assert!(river(channel("Abfluss", None, Some(CovariateKind::Flow))));
        assert!(!river(channel("Abfluss", None, None)));
        assert!(!river(channel("inflow", None, Some(CovariateKind::Level))));
    }

    fn epoch() -> Timestamp {
        "2020-01-01T00:00:00Z".parse().unwrap()
    }

    #[test]
    fn no_forecast_knows_what_was_read_after_its_lead() {
        let failure = after_days(epoch(), 60.0).unwrap();
        let (whole, part) = (history(60), history(51));
        let truth = Truth::Failed(failure);
        let card = |history| card(history, epoch(), truth, METHODS, &mut |_, _| ());
        let (later, earlier) = (card(&whole), card(&part));
        // Five days before, the shorter record has only what it had ten days before.
        for lead in earlier.leads.iter().filter(|lead| lead.lead_days >= 10.0) {
            let same = later
                .leads
                .iter()
                .find(|one| one.known_until == lead.known_until);
            assert_eq!(Some(lead), same);
            assert!(days_since(lead.known_until, failure) >= lead.lead_days - 1e-6);
        }
        assert_eq!((earlier.leads.len(), later.leads.len()), (4, 8));
    }

    #[test]
    fn a_line_that_is_one_is_met_by_the_line_and_by_the_panel() {
        let failure = after_days(epoch(), 60.0).unwrap();
        let card = card(
            &history(60),
            epoch(),
            Truth::Failed(failure),
            METHODS,
            &mut |_, _| (),
        );
        for lead in &card.leads {
            let error = |name| lead.scores[name].error_days.unwrap_or(f64::NAN);
            assert!(error("inverse-velocity-line").abs() < 0.5, "{lead:?}");
            assert_eq!(lead.scores["panel"].covered, Some(true), "{lead:?}");
        }
    }

    #[test]
    fn a_slope_that_stood_has_looks_and_no_leads() {
        let mut seen = 0;
        let card = card(
            &history(30),
            epoch(),
            Truth::Stood,
            METHODS,
            &mut |done, count| {
                assert!(done <= count);
                seen = done;
            },
        );
        assert!(card.leads.is_empty());
        assert_eq!(card.looks.len() as u64, seen);
        assert!(card.looks.iter().all(|look| look.stood_days > 0.0));
        let persistence = &card.looks[0].scores["persistence"];
        assert!(persistence.crps_days.abs() < 1e-12 && persistence.covered.is_none());
    }
}
