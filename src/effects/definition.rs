//! What an effect is, in one value: its name and its words, how a search tries it, what supports it, and how its size is reported.

use super::act::{Act, amplitudes, harmonics, standardise};
use crate::reading::{CovariateKind, DAYS_PER_YEAR, Quantity, Timestamp, Unit};

/// What an effect is. One more is a file in `known` and a row in its table: what searches, judges, declares, reports and
/// names effects goes by these fields.
#[derive(Debug)]
pub struct EffectDefinition {
    /// As it stands in output and config, its own among all.
    pub name: &'static str,
    /// What it is, a sentence: as the JSON Schema describes it.
    pub what: &'static str,
    /// What readings are said to be consistent with. Its covariate, its time and its groups follow, where it has them.
    pub title: &'static str,
    /// How its size follows.
    pub size_in_words: SizeInWords,
    /// How a search tries it.
    pub trying: Trying,
    /// What supports it besides the better fit.
    pub support: Support,
    /// What it lies in.
    pub lies_in: LiesIn,
    /// Whether a load that changes over a while, and that nothing measures, may look like it.
    pub may_be_a_slow_load: bool,
    /// Whether it says something of what comes, so that a later block of the readings has to speak for it.
    pub says_what_comes: bool,
    /// Days of the periods of its waves, where it is made of [`SearchedRecord::waves`] of these, or of the first of them: so far
    /// as it has them, forecasts use it. Empty for all others.
    pub wave_periods: &'static [f64],
    /// Its size as it is reported, from the coefficients of the fit.
    pub size: fn(&FittedCoefficients<'_>) -> EffectSize,
}

/// How a search over the readings of one benchmark tries an effect.
#[derive(Debug, Clone, Copy)]
pub enum Trying {
    /// Through each covariate of these kinds, in the log-load: its delayed responses, by its value and by its rate of change.
    CovariateInLoad(fn(CovariateKind) -> bool),
    /// Through each covariate of these kinds, in the reading: its delayed responses.
    CovariateInReading(fn(CovariateKind) -> bool),
    /// All along and without a covariate: each of the acts that it gives for a record.
    AllAlong(fn(&SearchedRecord<'_>) -> Vec<Act>),
    /// Once, in the ground: each of these acts, before each reading that is tried.
    Once(&'static [Act]),
    /// Once, in the reading: a jump of it, where it jumps most.
    JumpOfReading,
    /// Not at all: other benchmarks show it, or it is what is left in the end.
    Elsewhere,
}

/// What supports an effect besides the better fit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Support {
    /// A covariate.
    Covariate,
    /// Astronomy: its periods are known beforehand, and it cannot drift.
    Astronomy,
    /// A shape that few courses have.
    Shape,
    /// Nothing: it can follow almost any bend of the readings.
    Nothing,
}

/// What an effect lies in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LiesIn {
    /// The ground.
    Ground,
    /// The instrument or its noise.
    Reading,
    /// Nothing: it says that no effect was found.
    Nothing,
}

/// How a sentence gives the size of an effect.
#[derive(Debug, Clone, Copy)]
pub enum SizeInWords {
    /// Not at all.
    Unsaid,
    /// As it is, in its unit, behind these words: `, of `.
    Behind(&'static str),
    /// As a log-load: by what factor the velocity jumps.
    JumpOfVelocity,
}

/// What the acts of an effect may depend on: when a benchmark was read, and what.
#[derive(Debug, Clone, Copy)]
pub struct SearchedRecord<'a> {
    /// Displacement or velocity.
    pub quantity: Quantity,
    /// Day 0.
    pub epoch: Timestamp,
    /// Days on which the law is solved, increasing: a load acts on these.
    pub days: &'a [f64],
    /// Days of the readings.
    pub reading_days: &'a [f64],
    /// Days from the first reading to the last one that is fitted.
    pub span_days: f64,
    /// Median days between readings.
    pub spacing_days: f64,
    /// For velocities, days over which each is known to be the mean; 0: of the moment.
    pub averaging_days: f64,
}

/// The coefficients of an effect as they were fitted, and what they are measured in.
#[derive(Debug, Clone, Copy)]
pub struct FittedCoefficients<'a> {
    /// In the order of its act's columns, or changes; of a load log-load, of what is in the reading mm or mm/day, of an average median
    /// spacings; of what answers to the velocity, or to the slip, for the typical velocity, or for that over the span.
    pub values: &'a [f64],
    /// Of the readings.
    pub unit: Unit,
    /// Mean velocity over the readings that were fitted.
    pub typical_mm_per_day: f64,
    /// Days from the first reading to the last.
    pub span_days: f64,
    /// Median days between readings.
    pub spacing_days: f64,
}

/// The size of an effect as it is reported; the fields of [`Effect`](super::Effect) of the same names.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EffectSize {
    /// How large, in `unit`. Without a unit that of a load is the log-load, e-folds, and that of a reset is the factor of the state.
    pub size: Option<f64>,
    /// The unit of the size, and of the gain of what acts in the reading; `None` for a pure number.
    pub unit: Option<String>,
    /// Gain for one standard deviation of what enters: of a load the log-load, e-folds; of what acts in the reading in `unit`.
    pub gain_per_sd: Option<f64>,
    /// The strongest period, days.
    pub period_days: Option<f64>,
}

impl EffectDefinition {
    /// One that has nothing of its own yet, for the fields that a definition does not state.
    pub const PLAIN: Self = Self {
        name: "",
        what: "",
        title: "",
        size_in_words: SizeInWords::Unsaid,
        trying: Trying::Elsewhere,
        support: Support::Shape,
        lies_in: LiesIn::Ground,
        may_be_a_slow_load: true,
        says_what_comes: true,
        wave_periods: &[],
        size: |_| EffectSize::default(),
    };

    /// Whether a search tries it through a covariate of that kind.
    pub(super) fn is_tried_through(&self, covariate: CovariateKind) -> bool {
        matches!(
            self.trying,
            Trying::CovariateInLoad(of) | Trying::CovariateInReading(of) if of(covariate)
        )
    }

    /// What it may be in a record all along; nothing of other effects.
    pub(super) fn all_along(&self, record: &SearchedRecord) -> Vec<Act> {
        if let Trying::AllAlong(acts) = self.trying {
            acts(record)
        } else {
            Vec::new()
        }
    }

    /// What it may be before a reading, in the ground; nothing of other effects.
    pub(super) fn once(&self) -> &'static [Act] {
        if let Trying::Once(acts) = self.trying {
            acts
        } else {
            &[]
        }
    }

    /// Whether it is tried as a jump of the reading.
    pub(super) fn is_jump_of_reading(&self) -> bool {
        matches!(self.trying, Trying::JumpOfReading)
    }
}

/// Of definitions with one name there is only one.
impl PartialEq for EffectDefinition {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl SearchedRecord<'_> {
    /// A load of this course, by days since the epoch, in standard deviations; `None` where it does not change over the record.
    pub fn load(&self, course: impl Fn(f64) -> f64) -> Option<Act> {
        let column = self.days.iter().map(|day| course(*day)).collect();
        Some(Act::Load(vec![standardise(column)?]))
    }

    /// A load of waves of these periods, days, each with a phase of its own.
    pub fn waves(&self, periods: &[f64]) -> Act {
        Act::Load(harmonics(self.days, periods))
    }

    /// The same in the reading.
    pub fn waves_in_reading(&self, periods: &[f64]) -> Act {
        Act::Reading(harmonics(self.reading_days, periods))
    }

    /// Whether two years have been seen, read often enough to show what comes and goes with them.
    pub fn shows_the_year(&self) -> bool {
        self.span_days >= 1.95 * DAYS_PER_YEAR && self.spacing_days <= 0.2 * DAYS_PER_YEAR
    }
}

impl EffectSize {
    /// A pure number.
    pub fn number(size: f64) -> Self {
        Self {
            size: Some(size),
            ..Self::default()
        }
    }

    /// A size in a unit.
    pub fn measured(size: f64, unit: &str) -> Self {
        Self {
            unit: Some(unit.to_owned()),
            ..Self::number(size)
        }
    }

    /// The strongest of waves of these periods, days: its amplitude, in log-load or in what the reading is measured in, and its period.
    pub fn of_waves(fitted: &FittedCoefficients, periods: &[f64]) -> Self {
        let strongest = amplitudes(fitted.values)
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(&b.1));
        Self {
            size: strongest.map(|(_, size)| size),
            period_days: strongest.and_then(|(k, _)| periods.get(k).copied()),
            ..Self::default()
        }
    }
}

impl FittedCoefficients<'_> {
    /// The first of them.
    pub fn first(&self) -> f64 {
        self.values.first().copied().unwrap_or(0.0)
    }
}
