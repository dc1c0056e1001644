//! A known effect put into measured readings: a step of the velocity, a reset of the instrument, a wave in the velocity.
//!
//! The measured noise stays as it is: the ground's motion is the fit of `explain` to the readings as they are, and what the
//! effect adds to that motion is added to the readings. No law is asked how its state would answer.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use slipwatch::effects::{Explanation, Kind};
use slipwatch::reading::{Quantity, Reading, Series, Timestamp, days_since};
use std::f64::consts::TAU;

/// Days of the moon's tide and of the year.
const M2: f64 = 12.420_601_2 / 24.0;
const YEAR: f64 = 365.25;
/// The date lies within this part of the record, drawn evenly.
const DATE: (f64, f64) = (0.3, 0.65);
/// A step multiplies the velocity by e to a power of this size, a wave by e to as much at its crest, drawn evenly.
const STEP: (f64, f64) = (0.7, 1.2);
const WAVE: (f64, f64) = (0.4, 0.8);
/// A reset is so many times the scatter of the readings about the line through their neighbours, up or down.
const RESET: (f64, f64) = (8.0, 20.0);
/// The wave is summed up in so many parts of the time between two readings.
const PARTS: u32 = 24;

/// What is put in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum What {
    /// From a date on the ground moves faster by one factor.
    Step,
    /// From a date on the instrument reads more, or less, by one value.
    Reset,
    /// The ground moves faster and slower with the moon's tide.
    Tide,
    /// The same with the year.
    Season,
}

impl What {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Step => "step of the velocity",
            Self::Reset => "reset of the instrument",
            Self::Tide => "wave of 12.42 h in the velocity",
            Self::Season => "wave of a year in the velocity",
        }
    }

    /// The kind that is right.
    pub(crate) fn kind(self) -> Kind {
        match self {
            Self::Step => Kind::LOAD_STEP,
            Self::Reset => Kind::OFFSET,
            Self::Tide => Kind::TIDE,
            Self::Season => Kind::SEASONAL,
        }
    }

    /// Days; of what happens once none.
    pub(crate) fn period_days(self) -> Option<f64> {
        match self {
            Self::Step | Self::Reset => None,
            Self::Tide => Some(M2),
            Self::Season => Some(YEAR),
        }
    }
}

/// What was put in, when, and how large.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PutIn {
    pub(crate) what: What,
    /// Of a wave when it rises through nothing.
    pub(crate) at: Timestamp,
    /// e-folds of the velocity; of a reset in the unit of the readings.
    pub(crate) size: f64,
}

/// Readings with an effect in them that was not measured.
#[derive(Debug)]
pub(crate) struct Changed {
    pub(crate) series: Series,
    pub(crate) put_in: PutIn,
}

/// Puts `what` into `series`, of which `said` was found as it is; date and size are drawn by `seed`. `None` where nothing
/// was fitted, or the ground does not move.
pub(crate) fn put_in(
    series: &Series,
    said: &Explanation,
    what: What,
    seed: u64,
) -> Option<Changed> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut between = |(low, high): (f64, f64)| low + (high - low) * rng.random::<f64>();
    let (first, last) = (series.readings.first()?.time, series.readings.last()?.time);
    let day = between(DATE) * days_since(first, last);
    let size = match what {
        What::Step => between(STEP),
        What::Tide | What::Season => between(WAVE),
        What::Reset => between(RESET) * scatter(&series.readings),
    };
    // An event goes either way by turns.
    let is_down = seed.is_multiple_of(2) && what.period_days().is_none();
    let size = if is_down { -size } else { size };
    let motion = Motion::of(said)?;
    let readings = match what {
        What::Reset => jumped(series, first, (day, size)),
        What::Step | What::Tide | What::Season => {
            let log_load = |t: f64| match what.period_days() {
                Some(period) => size * (TAU * (t - day) / period).sin(),
                None if t < day => 0.0,
                None => size,
            };
            driven(series, first, &motion, log_load)
        }
    };
    Some(Changed {
        series: Series {
            readings,
            ..series.clone()
        },
        put_in: PutIn {
            what,
            at: slipwatch::reading::after_days(first, day)?,
            size,
        },
    })
}

fn jumped(series: &Series, first: Timestamp, (day, size): (f64, f64)) -> Vec<Reading> {
    let each = series.readings.iter().map(|reading| Reading {
        value: reading.value
            + if days_since(first, reading.time) < day {
                0.0
            } else {
                size
            },
        ..*reading
    });
    each.collect()
}

/// The readings with what the motion gains where its velocity is multiplied by e to the load.
fn driven(
    series: &Series,
    first: Timestamp,
    motion: &Motion,
    log_load: impl Fn(f64) -> f64,
) -> Vec<Reading> {
    let is_velocity = series.quantity() == Quantity::Velocity;
    let averaging = series
        .averaging
        .map_or(0.0, |span| span.as_secs_f64() / 86_400.0);
    let factor = |from: f64, until: f64| {
        let parts =
            (0..PARTS).map(|k| from + (until - from) * (f64::from(k) + 0.5) / f64::from(PARTS));
        parts.map(|t| log_load(t).exp()).sum::<f64>() / f64::from(PARTS) - 1.0
    };
    let mut gained = 0.0;
    let mut before: Option<(f64, f64)> = None;
    let each = series.readings.iter().map(|reading| {
        let here = (days_since(first, reading.time), motion.at(reading.time));
        let added = if is_velocity {
            here.1 * factor(here.0 - averaging, here.0)
        } else {
            let (t, value) = before.replace(here).unwrap_or(here);
            gained += (here.1 - value) * factor(t, here.0);
            gained
        };
        Reading {
            value: reading.value + added,
            ..*reading
        }
    });
    each.collect()
}

/// The ground's motion as `explain` found it in the readings as they are: its fit without what stands in the reading alone.
struct Motion {
    times: Vec<Timestamp>,
    values: Vec<f64>,
}

impl Motion {
    fn of(said: &Explanation) -> Option<Self> {
        let mut values = said.curves.after.clone();
        for (name, added) in &said.curves.contributions {
            if name.starts_with(Kind::OFFSET.name()) || name.starts_with(Kind::THERMAL.name()) {
                for (value, by) in values.iter_mut().zip(added) {
                    *value -= by;
                }
            }
        }
        let rises = values.last()? > values.first()? || said.quantity == Quantity::Velocity;
        rises.then(|| Self {
            times: said.curves.times.clone(),
            values,
        })
    }

    /// Between the readings that were fitted in a straight line.
    fn at(&self, time: Timestamp) -> f64 {
        let next = self.times.partition_point(|known| *known < time);
        let next = next.clamp(1, self.times.len() - 1);
        let span = days_since(self.times[next - 1], self.times[next]);
        let share = (days_since(self.times[next - 1], time) / span).clamp(0.0, 1.0);
        self.values[next - 1] + share * (self.values[next] - self.values[next - 1])
    }
}

/// How far a reading stands from the middle of its neighbours, as the standard deviation of its own error.
fn scatter(readings: &[Reading]) -> f64 {
    let middle = |trio: &[Reading]| {
        let off = trio[1].value - 0.5 * (trio[0].value + trio[2].value);
        off.abs() / 1.5_f64.sqrt()
    };
    let mut off: Vec<f64> = readings.windows(3).map(middle).collect();
    off.sort_by(f64::total_cmp);
    off.get(off.len() / 2).copied().unwrap_or(0.0) / 0.6745
}
