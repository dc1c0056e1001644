//! The law with its effects as forecasts use it: the known log-load at any time, and what is in the reading.

use super::act::{Act, mean_and_deviation};
use super::judge::coefficients;
use super::kind::{Form, Kind};
use super::problem::Problem;
use super::refit::Fitted;
use super::response::{Driver, Response};
use super::term::{Term, time_of};
use crate::reading::{Channel, Timestamp, days_since};
use serde::{Deserialize, Serialize};

/// A channel may be silent for so many of its usual spacings before it says nothing of the present.
const MAY_SKIP: f64 = 4.0;
/// Spacings from which the usual one is taken.
const LATEST: usize = 32;

/// What is known besides the law under a constant load. Only what can be said of times to come is in it: a
/// covariate's response, harmonics, a step of the load; a jump of the reading, temperature in it.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct KnownLoad {
    /// In the order in which the search accepted them.
    pub parts: Vec<Part>,
}

/// One effect with its size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub enum Part {
    /// A covariate's response in the log-load: `gain` for one standard deviation.
    Load {
        /// The response.
        filtered: Filtered,
        /// Log-load.
        gain: f64,
    },
    /// Harmonics in the log-load.
    Harmonics {
        /// Seasonal or tide.
        kind: Kind,
        /// Where the phases are 0.
        epoch: Timestamp,
        /// One for each period.
        waves: Vec<Wave>,
    },
    /// Harmonics in the reading.
    ReadingHarmonics {
        /// Where the phases are 0.
        epoch: Timestamp,
        /// One for each period.
        waves: Vec<Wave>,
    },
    /// The log-load steps, and stays.
    Step {
        /// When.
        at: Timestamp,
        /// Log-load.
        size: f64,
    },
    /// The reading jumps.
    Offset {
        /// When.
        at: Timestamp,
        /// mm, or mm/day.
        size: f64,
    },
    /// A temperature's response in the reading.
    Thermal {
        /// The response.
        filtered: Filtered,
        /// mm, or mm/day, for one standard deviation.
        gain: f64,
    },
    /// A part of one of the shapes above, of an effect of another kind than theirs.
    Other {
        /// The effect's.
        kind: Kind,
        /// Its shape.
        part: Box<Self>,
    },
}

/// A covariate's response, standardised as it was over the record that it was found in.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Filtered {
    /// The channel's full name.
    pub channel: String,
    /// By its value or by its rate.
    pub form: Form,
    /// Exponentials one after another: 1 or 2.
    pub stages: u8,
    /// Mean delay, days.
    pub mean_days: f64,
    /// By how much what had gathered before the channel's first value differs from what is usual, in its unit.
    #[serde(default)]
    pub before: f64,
    /// Mean of the response over that record, in the channel's unit (per day, for a rate).
    pub mean: f64,
    /// Standard deviation of it.
    pub deviation: f64,
}

/// One period.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Wave {
    /// Days.
    pub period_days: f64,
    /// Log-load, or mm or mm/day in the reading, times cos of the phase.
    pub cosine: f64,
    /// The same times sin of the phase.
    pub sine: f64,
}

impl KnownLoad {
    /// What of `fitted` can be said of times to come.
    pub(super) fn of(problem: &Problem, fitted: &Fitted, drivers: &[Driver]) -> Self {
        let own = |(index, term): (usize, &Term)| {
            part(problem, term, coefficients(problem, fitted, index), drivers)
        };
        Self {
            parts: fitted.terms.iter().enumerate().filter_map(own).collect(),
        }
    }

    /// The known log-load at `times`, in their order; a covariate that is not among `channels` adds nothing.
    pub fn log_load(&self, channels: &[&Channel], times: &[Timestamp]) -> Vec<f64> {
        self.sum(channels, times, Part::log_load)
    }

    /// What stands in a reading at `times` and is no motion of the ground: mm, or mm/day.
    pub fn in_reading(&self, channels: &[&Channel], times: &[Timestamp]) -> Vec<f64> {
        self.sum(channels, times, Part::in_reading)
    }

    fn sum(&self, channels: &[&Channel], times: &[Timestamp], of: PartOf) -> Vec<f64> {
        let mut sum = vec![0.0; times.len()];
        for part in &self.parts {
            let Some(own) = of(part, channels, times) else {
                continue;
            };
            for (value, by) in sum.iter_mut().zip(own) {
                *value += by;
            }
        }
        sum
    }

    /// Whether every covariate in it still says something of `now`: its newest value is no older than the
    /// usual few spacings and the response's own delay.
    pub fn reaches(&self, channels: &[&Channel], now: Timestamp) -> bool {
        self.parts.iter().all(|part| part.reaches(channels, now))
    }

    /// Whether an effect of this kind, through this channel, is in it.
    pub fn has(&self, kind: Kind, channel: Option<&str>) -> bool {
        self.parts
            .iter()
            .any(|part| part.kind() == kind && part.channel() == channel)
    }
}

type PartOf = fn(&Part, &[&Channel], &[Timestamp]) -> Option<Vec<f64>>;

impl Part {
    /// Its kind.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Load { .. } => Kind::HYDROLOGICAL,
            Self::Harmonics { kind, .. } | Self::Other { kind, .. } => *kind,
            Self::ReadingHarmonics { .. } => Kind::SEASONAL_READING,
            Self::Step { .. } => Kind::LOAD_STEP,
            Self::Offset { .. } => Kind::OFFSET,
            Self::Thermal { .. } => Kind::THERMAL,
        }
    }

    /// The covariate that it works through.
    pub fn channel(&self) -> Option<&str> {
        match self {
            Self::Load { filtered, .. } | Self::Thermal { filtered, .. } => Some(&filtered.channel),
            Self::Other { part, .. } => part.channel(),
            Self::Harmonics { .. }
            | Self::ReadingHarmonics { .. }
            | Self::Step { .. }
            | Self::Offset { .. } => None,
        }
    }

    /// By when 95 % of a covariate's response has passed, days; 0 of what has none.
    pub fn memory_days(&self) -> f64 {
        match self {
            Self::Load { filtered, .. } | Self::Thermal { filtered, .. } => {
                filtered.response().memory_days()
            }
            Self::Other { part, .. } => part.memory_days(),
            Self::Harmonics { .. }
            | Self::ReadingHarmonics { .. }
            | Self::Step { .. }
            | Self::Offset { .. } => 0.0,
        }
    }

    /// Whether the load steps by it.
    pub fn is_step(&self) -> bool {
        match self {
            Self::Step { .. } => true,
            Self::Other { part, .. } => part.is_step(),
            Self::Load { .. }
            | Self::Harmonics { .. }
            | Self::ReadingHarmonics { .. }
            | Self::Offset { .. }
            | Self::Thermal { .. } => false,
        }
    }

    fn reaches(&self, channels: &[&Channel], now: Timestamp) -> bool {
        match self {
            Self::Load { filtered, .. } | Self::Thermal { filtered, .. } => {
                filtered.reaches(channels, now)
            }
            Self::Other { part, .. } => part.reaches(channels, now),
            Self::Harmonics { .. }
            | Self::ReadingHarmonics { .. }
            | Self::Step { .. }
            | Self::Offset { .. } => true,
        }
    }

    fn log_load(&self, channels: &[&Channel], times: &[Timestamp]) -> Option<Vec<f64>> {
        match self {
            Self::Load { filtered, gain } => filtered.times(*gain, channels, times),
            Self::Harmonics { epoch, waves, .. } => Some(harmonics(*epoch, waves, times)),
            Self::Step { at, size } => Some(step(*at, *size, times)),
            Self::Other { part, .. } => part.log_load(channels, times),
            Self::Offset { .. } | Self::ReadingHarmonics { .. } | Self::Thermal { .. } => None,
        }
    }

    fn in_reading(&self, channels: &[&Channel], times: &[Timestamp]) -> Option<Vec<f64>> {
        match self {
            Self::Offset { at, size } => Some(step(*at, *size, times)),
            Self::ReadingHarmonics { epoch, waves } => Some(harmonics(*epoch, waves, times)),
            Self::Thermal { filtered, gain } => filtered.times(*gain, channels, times),
            Self::Other { part, .. } => part.in_reading(channels, times),
            Self::Load { .. } | Self::Harmonics { .. } | Self::Step { .. } => None,
        }
    }
}

impl Filtered {
    fn channel<'a>(&self, channels: &[&'a Channel]) -> Option<&'a Channel> {
        let mut channels = channels.iter();
        channels
            .find(|channel| channel.name == self.channel)
            .copied()
    }

    fn response(&self) -> Response {
        Response {
            form: self.form,
            stages: self.stages,
            mean_days: self.mean_days,
            before: self.before,
        }
    }

    fn times(&self, gain: f64, channels: &[&Channel], times: &[Timestamp]) -> Option<Vec<f64>> {
        let epoch = *times.first()?;
        let driver = Driver::new(0, self.channel(channels)?, epoch)?;
        let days: Vec<f64> = times.iter().map(|time| days_since(epoch, *time)).collect();
        let values = driver.respond_in_unit(self.response(), &days).into_iter();
        let scaled = values.map(|value| gain * (value - self.mean) / self.deviation);
        Some(scaled.collect())
    }

    fn reaches(&self, channels: &[&Channel], now: Timestamp) -> bool {
        let Some(channel) = self.channel(channels) else {
            return false;
        };
        let latest = &channel.samples[channel.samples.len().saturating_sub(LATEST)..];
        let gaps = latest.windows(2);
        let gaps = gaps.map(|pair| days_since(pair[0].time, pair[1].time));
        let usual = super::quantiles::upper_median(gaps.collect());
        latest.last().is_some_and(|newest| {
            days_since(newest.time, now) <= (MAY_SKIP * usual).max(self.mean_days)
        })
    }
}

fn harmonics(epoch: Timestamp, waves: &[Wave], times: &[Timestamp]) -> Vec<f64> {
    let at = |time: &Timestamp| {
        let each = waves.iter().map(|wave| {
            let phase = std::f64::consts::TAU * days_since(epoch, *time) / wave.period_days;
            wave.cosine * phase.cos() + wave.sine * phase.sin()
        });
        each.sum()
    };
    times.iter().map(at).collect()
}

fn step(at: Timestamp, size: f64, times: &[Timestamp]) -> Vec<f64> {
    let value = |time: &Timestamp| if *time >= at { size } else { 0.0 };
    times.iter().map(value).collect()
}

/// `None` for what has no say in times to come.
fn part(problem: &Problem, term: &Term, own: &[f64], drivers: &[Driver]) -> Option<Part> {
    let size = *own.first()?;
    let part = match &term.act {
        Act::Load(_) if term.channel.is_some() => Part::Load {
            filtered: filtered(term, drivers, &problem.nodes)?,
            gain: size,
        },
        Act::Load(_) => Part::Harmonics {
            kind: term.kind,
            epoch: problem.epoch,
            waves: waves(term.kind, own)?,
        },
        Act::Reading(_) if term.channel.is_some() => Part::Thermal {
            filtered: filtered(term, drivers, &problem.t)?,
            gain: size,
        },
        Act::Reading(_) if term.at.is_none() => Part::ReadingHarmonics {
            epoch: problem.epoch,
            waves: waves(term.kind, own)?,
        },
        Act::Reading(_) => Part::Offset {
            at: time_of(problem, term)?,
            size,
        },
        Act::Step => Part::Step {
            at: time_of(problem, term)?,
            size,
        },
        Act::Reset | Act::Friction(_) | Act::PerVelocity | Act::PerSlip | Act::Averaging => {
            return None;
        }
    };
    if part.kind() == term.kind {
        return Some(part);
    }
    Some(Part::Other {
        kind: term.kind,
        part: Box::new(part),
    })
}

fn filtered(term: &Term, drivers: &[Driver], nodes: &[f64]) -> Option<Filtered> {
    let driver = Driver::at(drivers, term.channel)?;
    let response = term.response?;
    let values = driver.respond_in_unit(response, nodes);
    let (mean, deviation) = mean_and_deviation(&values);
    Some(Filtered {
        channel: driver.name.clone(),
        form: response.form,
        stages: response.stages,
        mean_days: response.mean_days,
        before: response.before,
        mean,
        deviation,
    })
}

/// The columns of a search are sqrt 2 times a cosine and a sine, for each period in turn; `None` of what is not made of waves.
fn waves(kind: Kind, own: &[f64]) -> Option<Vec<Wave>> {
    let periods = kind.definition().wave_periods;
    if periods.is_empty() {
        return None;
    }
    let root = std::f64::consts::SQRT_2;
    let pairs = periods.iter().zip(own.chunks_exact(2));
    let waves = pairs.map(|(period, pair)| Wave {
        period_days: *period,
        cosine: root * pair[0],
        sine: root * pair[1],
    });
    Some(waves.collect())
}
