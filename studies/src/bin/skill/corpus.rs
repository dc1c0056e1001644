//! What forecasts are scored on: a series, when it was looked at, and what came of it.

use slipwatch::reading::Timestamp;
use slipwatch::score::{Outcome, WholeRecord};
use studies::{Corpus, Life};

/// What a series is. Scores of one kind say nothing of another, and stand apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum SubjectKind {
    /// Instruments' readings.
    Measured,
    /// Made to fulfil what a publication states.
    Reconstruction,
    /// Drawn, with its end known.
    Simulated,
}

impl SubjectKind {
    const ALL: [Self; 3] = [Self::Measured, Self::Reconstruction, Self::Simulated];

    pub(crate) fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name)
    }

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
pub(crate) enum SubjectTruth {
    /// It failed then.
    FailedAt(f64),
    /// It had not failed by then, where its record ends.
    StoodUntil(f64),
}

impl SubjectTruth {
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
pub(crate) struct SkillSubject {
    pub(crate) name: String,
    pub(crate) kind: SubjectKind,
    /// The site, or the fate of a simulated life.
    pub(crate) family: String,
    /// Of the first reading, which is day 0; `None` of a simulated life.
    pub(crate) epoch: Option<Timestamp>,
    pub(crate) history: WholeRecord,
    pub(crate) truth: SubjectTruth,
    /// Days before the failure at which it is looked at; of no use where it stood.
    pub(crate) leads: Vec<f64>,
    /// Looks evenly over its readings, beside the leads.
    pub(crate) spread: usize,
}

/// When a forecast is made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Evaluation {
    /// At the last reading until then, days.
    pub(crate) at_days: f64,
    /// Days before the failure that were asked for; `None` of a look that is one of several spread over the record.
    pub(crate) lead_days: Option<f64>,
}

/// Leads of simulated records that methods are compared at, days.
pub(crate) const SIMULATED_LEADS: [f64; 5] = [40.0, 20.0, 10.0, 5.0, 2.0];
/// Leads beside those, for what is reported of the last days.
pub(crate) const SHORT_LEADS: [f64; 3] = [1.0, 0.5, 0.2];
/// Looks at a slope that stood, evenly over its readings.
pub(crate) const LOOKS: usize = 40;
/// The same of a simulated one that failed.
pub(crate) const LOOKS_AT_FAILING: usize = 10;
/// A tenth of a millisecond, days: a reading at the lead itself is known, whatever the rounding of the two.
const ROUNDING: f64 = 1e-9;

impl SkillSubject {
    fn simulated(name: String, life: &Life) -> Self {
        let end = life.readings.last().map_or(0.0, |(days, _)| *days);
        let truth = life
            .failure_days
            .map_or(SubjectTruth::StoodUntil(end), SubjectTruth::FailedAt);
        Self {
            name,
            kind: SubjectKind::Simulated,
            epoch: None,
            family: format!("{:?}", life.fate).to_lowercase(),
            history: WholeRecord {
                observations: life.known(f64::INFINITY),
                flow: Vec::new(),
                critical_mm_per_day: Life::CRITICAL_MM_PER_DAY,
            },
            spread: match truth {
                SubjectTruth::FailedAt(_) => LOOKS_AT_FAILING,
                SubjectTruth::StoodUntil(_) => LOOKS,
            },
            truth,
            leads: [&SIMULATED_LEADS[..], &SHORT_LEADS[..]].concat(),
        }
    }

    /// When forecasts are made of it. A lead that a gap in the readings makes more than twice as long is left out.
    pub(crate) fn looks(&self) -> Vec<Evaluation> {
        let (end, leads) = match self.truth {
            SubjectTruth::FailedAt(failure) => (failure, &self.leads[..]),
            // At the end nothing can come any more that would score.
            SubjectTruth::StoodUntil(end) => (end, &[][..]),
        };
        let at_lead = |lead: &f64| {
            let values = &self.history.observations.values;
            let known = values.partition_point(|value| value.t_days <= end - lead + ROUNDING);
            let at_days = self.read(known)?;
            (end - at_days <= 2.0 * lead).then_some(Evaluation {
                at_days,
                lead_days: Some(*lead),
            })
        };
        let at_leads = leads.iter().filter_map(at_lead);
        let at_spread = self.spread_days().into_iter().map(|at_days| Evaluation {
            at_days,
            lead_days: None,
        });
        at_leads
            .chain(at_spread.filter(|look| look.at_days < end))
            .collect()
    }

    fn spread_days(&self) -> Vec<f64> {
        let readings = self.history.observations.values.len();
        let mut counts: Vec<usize> = (1..=self.spread)
            .map(|look| readings * look / self.spread)
            .collect();
        counts.dedup();
        counts
            .into_iter()
            .filter_map(|count| self.read(count))
            .collect()
    }

    /// When the newest of so many readings was taken, days.
    fn read(&self, count: usize) -> Option<f64> {
        let values = &self.history.observations.values;
        Some(values.get(count.checked_sub(1)?)?.t_days)
    }
}

/// All series, in one order; the simulated ones are drawn when they are asked for.
#[derive(Debug)]
pub(crate) struct Subjects {
    recorded: Vec<SkillSubject>,
    corpus: Corpus,
    simulated: u64,
}

impl Subjects {
    pub(crate) fn new(recorded: Vec<SkillSubject>, corpus: Corpus, simulated: u64) -> Self {
        Self {
            recorded,
            corpus,
            simulated,
        }
    }

    pub(crate) fn count(&self) -> u64 {
        self.recorded.len() as u64 + self.simulated
    }

    pub(crate) fn at(&self, index: u64) -> SkillSubject {
        let recorded = usize::try_from(index)
            .ok()
            .and_then(|at| self.recorded.get(at));
        recorded.cloned().unwrap_or_else(|| {
            let index = index - self.recorded.len() as u64;
            let seed = self.corpus.seeds().start + index;
            SkillSubject::simulated(format!("seed {seed}"), &self.corpus.life(index))
        })
    }
}
