//! The readings of one benchmark, in the science's units and in time order, bounded by count.

use crate::fit::{Observation, Observations, Rate, RateOptions};
use crate::reading::{
    BenchmarkId, Quantity, Reading, SECONDS_PER_DAY, Series, Timestamp, Unit, days_since,
};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Where readings come from, as far as their meaning goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Source {
    /// Their unit.
    pub(super) unit: Unit,
    /// For velocities, the span of the mean.
    pub(super) averaging: Option<SignedDuration>,
}

/// What became of a reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Taken {
    /// It is the newest.
    Newest,
    /// It was filled in before readings that are already there.
    Late,
    /// Its time was known with this other value, in the science's unit, which it replaces.
    Corrected(f64),
    /// It was known.
    Known,
    /// It lies beyond anything a slope does, in the science's unit.
    OutOfRange(f64),
    /// It measures another quantity than the benchmark's first reading did.
    OtherQuantity,
}

/// No displacement in mm, or velocity in mm/day, is larger: a thousand kilometres.
const FARTHEST: f64 = 1e9;

/// The readings of one benchmark.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct History {
    pub(super) epoch: Timestamp,
    pub(super) observations: Observations,
    averaging: Option<SignedDuration>,
}

impl History {
    pub(super) fn new(source: Source, epoch: Timestamp) -> Self {
        let averaging_days = source
            .averaging
            .map_or(0.0, |span| span.as_secs_f64() / SECONDS_PER_DAY);
        let observations = Observations {
            quantity: source.unit.quantity(),
            averaging_days,
            values: Vec::new(),
        };
        Self {
            epoch,
            observations,
            averaging: source.averaging,
        }
    }

    /// Days since the epoch.
    pub(super) fn days(&self, time: Timestamp) -> f64 {
        days_since(self.epoch, time)
    }

    /// The instant so many days after the epoch; `None` outside the calendar.
    pub(super) fn time(&self, days: f64) -> Option<Timestamp> {
        let nanoseconds = (days * SECONDS_PER_DAY * 1e9).round();
        if !nanoseconds.is_finite() {
            return None;
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a float fits, or is cut off far outside the calendar"
        )]
        let since = nanoseconds as i128;
        let whole = self.epoch.as_nanosecond().checked_add(since)?;
        Timestamp::from_nanosecond(whole).ok()
    }

    /// When the newest reading was taken.
    pub(super) fn newest(&self) -> Option<Timestamp> {
        self.time(self.observations.values.last()?.t_days)
    }

    /// `observations` of this benchmark as a series, in mm or mm/day: no more than `most`, each the mean of as
    /// many in a row.
    pub(super) fn series(
        &self,
        benchmark: &BenchmarkId,
        observations: &Observations,
        most: usize,
    ) -> Series {
        let values = &observations.values;
        let block = |values: &[Observation]| {
            let n = values.len() as f64;
            let mean =
                |of: fn(&Observation) -> Option<f64>| values.iter().map(of).sum::<Option<f64>>();
            Some(Reading {
                time: self.time(mean(|one| Some(one.t_days))? / n)?,
                value: mean(|one| Some(one.value))? / n,
                sigma: mean(|one| one.sigma).map(|sum| sum / n),
            })
        };
        let (unit, averaging) = match observations.quantity {
            Quantity::Displacement => (Unit::MM, None),
            Quantity::Velocity => (Unit::MM_PER_DAY, self.averaging),
        };
        let size = values.len().div_ceil(most).max(1);
        let mut series = Series {
            benchmark: benchmark.clone(),
            unit,
            averaging,
            readings: values.chunks(size).filter_map(block).collect(),
        };
        series.settle();
        series
    }

    pub(super) fn take(&mut self, source: Source, reading: &Reading) -> Taken {
        if source.unit.quantity() != self.observations.quantity {
            return Taken::OtherQuantity;
        }
        let factor = source.unit.factor();
        let new = Observation {
            t_days: self.days(reading.time),
            value: reading.value * factor,
            sigma: reading.sigma.map(|sigma| sigma * factor),
        };
        if !new.value.is_finite() || new.value.abs() > FARTHEST {
            return Taken::OutOfRange(new.value);
        }
        let values = &mut self.observations.values;
        let at = values.partition_point(|old| old.t_days < new.t_days);
        match values.get_mut(at) {
            None => {
                values.push(new);
                self.observations.compact();
                Taken::Newest
            }
            Some(old) if old.t_days > new.t_days => {
                values.insert(at, new);
                self.observations.compact();
                Taken::Late
            }
            Some(old) if *old == new => Taken::Known,
            Some(old) => {
                let before = old.value;
                *old = new;
                Taken::Corrected(before)
            }
        }
    }

    /// The velocities that the readings show.
    pub(super) fn rates(&self) -> Vec<Rate> {
        let all = 0..self.observations.values.len();
        self.observations.rates(all, RateOptions::default())
    }

    /// Displacement since the first reading, mm, where displacement is what is measured.
    pub(super) fn displacement_mm(&self) -> Option<f64> {
        let [first, .., newest] = self.observations.values.as_slice() else {
            return Some(0.0).filter(|_| self.observations.quantity == Quantity::Displacement);
        };
        (self.observations.quantity == Quantity::Displacement).then_some(newest.value - first.value)
    }

    /// The velocity that the newest readings show by themselves, mm/day.
    pub(super) fn newest_velocity(&self) -> Option<f64> {
        let values = &self.observations.values;
        match self.observations.quantity {
            Quantity::Velocity => values.last().map(|newest| newest.value),
            Quantity::Displacement => {
                let [.., before, newest] = values.as_slice() else {
                    return None;
                };
                Some((newest.value - before.value) / (newest.t_days - before.t_days))
            }
        }
    }

    /// How many of the newest readings have one and the same value.
    pub(super) fn identical(&self) -> usize {
        let values = &self.observations.values;
        let same = |pair: &&[Observation]| pair[0].value.to_bits() == pair[1].value.to_bits();
        values.windows(2).rev().take_while(same).count() + usize::from(!values.is_empty())
    }
}
