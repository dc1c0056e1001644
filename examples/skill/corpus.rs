//! What forecasts are scored on: a series, when it was looked at, and what came of it.

use slipwatch::forecast::{Corpus, Life};
use slipwatch::score::{History, Outcome};

/// What a series is. Scores of one kind say nothing of another, and stand apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Kind {
    /// Instruments' readings.
    Measured,
    /// Made to fulfil what a publication states.
    Reconstruction,
    /// Drawn, with its end known.
    Simulated,
}

impl Kind {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Reconstruction => "reconstruction",
            Self::Simulated => "simulated",
        }
    }
}

/// What is known now of how it went, days since the first reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Truth {
    /// It failed then.
    FailedAt(f64),
    /// It had not failed by then, where its record ends.
    StoodUntil(f64),
}

impl Truth {
    /// As seen from `now_days`.
    pub(crate) fn from(self, now_days: f64) -> Outcome {
        match self {
            Self::FailedAt(days) => Outcome::Failed(days - now_days),
            Self::StoodUntil(days) => Outcome::Stood(days - now_days),
        }
    }
}

/// One series.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Subject {
    pub(crate) name: String,
    pub(crate) kind: Kind,
    /// The site, or the fate of a simulated life.
    pub(crate) family: String,
    pub(crate) history: History,
    pub(crate) truth: Truth,
    /// Days before the failure at which it is looked at; of no use where it stood.
    pub(crate) leads: Vec<f64>,
}

/// When a forecast is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Look {
    /// At the last reading until then, days.
    pub(crate) at_days: f64,
    /// Days before the failure that were asked for.
    pub(crate) lead_days: Option<f64>,
}

/// Leads of simulated lives, days.
const SIMULATED_LEADS: [f64; 5] = [40.0, 20.0, 10.0, 5.0, 2.0];
/// Looks at a slope that stood, evenly over its readings.
const LOOKS: usize = 40;
/// A tenth of a millisecond, days: a reading at the lead itself is known, whatever the rounding of the two.
const ROUNDING: f64 = 1e-9;

impl Subject {
    fn simulated(name: String, life: &Life) -> Self {
        let end = life.readings.last().map_or(0.0, |(days, _)| *days);
        let truth = life
            .failure_days
            .map_or(Truth::StoodUntil(end), Truth::FailedAt);
        Self {
            name,
            kind: Kind::Simulated,
            family: format!("{:?}", life.fate).to_lowercase(),
            history: History {
                observations: life.known(f64::INFINITY),
                flow: Vec::new(),
                critical_mm_per_day: Life::CRITICAL_MM_PER_DAY,
            },
            truth,
            leads: SIMULATED_LEADS.to_vec(),
        }
    }

    /// When forecasts are made of it. A lead that a gap in the readings makes more than twice as long is left out.
    pub(crate) fn looks(&self) -> Vec<Look> {
        let values = &self.history.observations.values;
        let read = |count: usize| Some(values.get(count.checked_sub(1)?)?.t_days);
        match self.truth {
            Truth::FailedAt(failure) => {
                let look = |lead: &f64| {
                    let known =
                        values.partition_point(|value| value.t_days <= failure - lead + ROUNDING);
                    let at_days = read(known)?;
                    (failure - at_days <= 2.0 * lead).then_some(Look {
                        at_days,
                        lead_days: Some(*lead),
                    })
                };
                self.leads.iter().filter_map(look).collect()
            }
            Truth::StoodUntil(end) => {
                let mut counts: Vec<usize> = (1..=LOOKS)
                    .map(|look| values.len() * look / LOOKS)
                    .collect();
                counts.dedup();
                let look = |count: usize| {
                    // At the end nothing can come any more that would score.
                    let at_days = read(count).filter(|at_days| *at_days < end)?;
                    Some(Look {
                        at_days,
                        lead_days: None,
                    })
                };
                counts.into_iter().filter_map(look).collect()
            }
        }
    }
}

/// All series, in one order; the simulated ones are drawn when they are asked for.
#[derive(Debug)]
pub(crate) struct Subjects {
    recorded: Vec<Subject>,
    corpus: Corpus,
    simulated: u64,
}

impl Subjects {
    pub(crate) fn new(recorded: Vec<Subject>, corpus: Corpus, simulated: u64) -> Self {
        Self {
            recorded,
            corpus,
            simulated,
        }
    }

    pub(crate) fn count(&self) -> u64 {
        self.recorded.len() as u64 + self.simulated
    }

    pub(crate) fn at(&self, index: u64) -> Subject {
        let recorded = usize::try_from(index)
            .ok()
            .and_then(|at| self.recorded.get(at));
        recorded.cloned().unwrap_or_else(|| {
            let index = index - self.recorded.len() as u64;
            let seed = self.corpus.seeds().start + index;
            Subject::simulated(format!("seed {seed}"), &self.corpus.life(index))
        })
    }
}
