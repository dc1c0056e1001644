//! The readings of one benchmark, in the science's units and in time order, bounded by count.

use super::declared::Declarations;
use super::motion::settled;
use crate::fit::{Observation, Observations, Rate, RateOptions};
use crate::reading::{
    BenchmarkId, Quantity, Reading, Series, Timestamp, Unit, days_of, days_since,
    instant_after_days,
};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Where readings come from, as far as their meaning goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct MeasuredAs {
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
    /// It is larger than [`Quantity::farthest`], in the science's unit.
    OutOfRange(f64),
    /// It measures another quantity than the benchmark's first reading did.
    OtherQuantity,
}

/// Readings set aside that are remembered.
const MOST_ASIDE: usize = 4096;

/// The readings of one benchmark.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct History {
    pub(super) epoch: Timestamp,
    pub(super) observations: Observations,
    averaging: Option<SignedDuration>,
    /// What declared resets have taken off the readings from their times on, by time.
    #[serde(default)]
    resets: Vec<Reset>,
    /// Readings that declared events leave out, by time, as they were read.
    #[serde(default)]
    aside: Vec<Observation>,
    /// Between which values the readings of a sensor at the end of its range lie.
    #[serde(default)]
    pub(super) range_end: Option<(f64, f64)>,
}

/// A declared reset that has taken effect.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
struct Reset {
    t_days: f64,
    /// What was declared of its size, mm.
    declared: Option<f64>,
    /// What the readings jump by, mm.
    jump: f64,
}

impl History {
    pub(super) fn new(source: MeasuredAs, epoch: Timestamp) -> Self {
        let averaging_days = source.averaging.map_or(0.0, days_of);
        let observations = Observations {
            quantity: source.unit.quantity(),
            averaging_days,
            values: Vec::new(),
        };
        Self {
            epoch,
            observations,
            averaging: source.averaging,
            resets: Vec::new(),
            aside: Vec::new(),
            range_end: None,
        }
    }

    /// For velocities, the span of the mean.
    pub(super) fn averaging(&self) -> Option<SignedDuration> {
        self.averaging
    }

    /// What resets have taken off a reading of that day.
    fn taken_off(&self, t_days: f64) -> f64 {
        let before = self.resets.iter().filter(|reset| reset.t_days <= t_days);
        before.map(|reset| reset.jump).sum()
    }

    /// The first and the last time over which a reading is the mean.
    pub(super) fn span(&self, time: Timestamp) -> (Timestamp, Timestamp) {
        let averaging = self.averaging.unwrap_or(SignedDuration::ZERO);
        (time.checked_sub(averaging).unwrap_or(time), time)
    }

    /// Keeps a reading without letting it count; says whether it is of the quantity that is monitored and may be
    /// true.
    pub(super) fn set_aside(&mut self, source: MeasuredAs, reading: &Reading) -> bool {
        let new = self.observation(source, reading);
        let is_ours = source.unit.quantity() == self.observations.quantity;
        let is_used = is_ours
            && new.value.is_finite()
            && new.value.abs() <= source.unit.quantity().farthest();
        if is_used {
            insert(&mut self.aside, new);
            let excess = self.aside.len().saturating_sub(MOST_ASIDE);
            self.aside.drain(..excess);
        }
        is_used
    }

    /// Counts what is to count now that other events are declared; says whether anything changed.
    pub(super) fn sort_out(&mut self, declared: &Declarations) -> bool {
        let before = self.observations.values.clone();
        let mut all = std::mem::take(&mut self.observations.values);
        for one in &mut all {
            one.value += self.taken_off(one.t_days);
        }
        for one in std::mem::take(&mut self.aside) {
            insert(&mut all, one);
        }
        let wanted: Vec<(f64, Option<f64>)> = declared
            .resets()
            .map(|(time, size)| (self.days(time), size))
            .collect();
        self.resets
            .retain(|reset| wanted.contains(&(reset.t_days, reset.declared)));
        for mut one in all {
            let time = self.time(one.t_days);
            if time.is_some_and(|time| self.is_left_out(declared, time)) {
                self.aside.push(one);
            } else {
                one.value -= self.taken_off(one.t_days);
                self.observations.values.push(one);
            }
        }
        self.observations.compact();
        before != self.observations.values
    }

    /// When so many of the newest readings were taken, the first of them.
    pub(super) fn first_of_newest(&self, count: usize) -> Option<Timestamp> {
        let values = &self.observations.values;
        let first = values.get(values.len().checked_sub(count)?)?;
        self.time(first.t_days)
    }

    /// Whether what is declared leaves a reading of that time out.
    pub(super) fn is_left_out(&self, declared: &Declarations, time: Timestamp) -> bool {
        let (from, to) = self.span(time);
        declared.is_maintained(time)
            || declared.is_in_other_unit(time)
            || self.observations.quantity == Quantity::Velocity
                && declared.is_reset_within(from, to)
    }

    /// Takes off what the readings jump by at each reset that has readings before and after it by now; the times of
    /// these resets, and their jumps in mm.
    pub(super) fn reset(&mut self, declared: &Declarations) -> Vec<(Timestamp, f64)> {
        // With each reading: where all are taken off, nothing is looked through, however many an instrument that sticks each day has.
        let is_done = declared.resets().count() == self.resets.len();
        if is_done || self.observations.quantity != Quantity::Displacement {
            return Vec::new();
        }
        let mut pending: Vec<(Timestamp, Option<f64>)> = declared
            .resets()
            .filter(|(time, _)| {
                let t_days = self.days(*time);
                !self
                    .resets
                    .iter()
                    .any(|done| done.t_days.to_bits() == t_days.to_bits())
            })
            .collect();
        // Where one of a known size and one of an unknown size lie between two readings, the rest is the latter's.
        pending.sort_by_key(|(_, size)| size.is_none());
        let mut done = Vec::new();
        for (time, declared) in pending {
            let t_days = self.days(time);
            let values = &self.observations.values;
            let at = values.partition_point(|one| one.t_days < t_days);
            if at == 0 || at == values.len() {
                continue;
            }
            let jump = declared.unwrap_or_else(|| self.jump(at));
            for one in &mut self.observations.values[at..] {
                one.value -= jump;
            }
            self.resets.push(Reset {
                t_days,
                declared,
                jump,
            });
            done.push((time, jump));
        }
        done
    }

    /// What the reading of this number lies off the one before it, less the motion at the velocity so far, mm.
    fn jump(&self, at: usize) -> f64 {
        let [before, after] = [at - 1, at].map(|index| self.observations.values[index]);
        let rates = self.observations.rates(0..at, RateOptions::default());
        let velocity = settled(&rates).unwrap_or(0.0);
        after.value - before.value - velocity * (after.t_days - before.t_days)
    }

    /// The reading as it is kept, but for what resets take off.
    fn observation(&self, source: MeasuredAs, reading: &Reading) -> Observation {
        let factor = source.unit.factor();
        Observation {
            t_days: self.days(reading.time),
            value: reading.value * factor,
            sigma: reading.sigma.map(|sigma| sigma * factor),
        }
    }

    /// The reading as it is kept.
    fn as_kept(&self, source: MeasuredAs, reading: &Reading) -> Observation {
        let mut own = self.observation(source, reading);
        own.value -= self.taken_off(own.t_days);
        own
    }

    /// Days since the epoch.
    pub(super) fn days(&self, time: Timestamp) -> f64 {
        days_since(self.epoch, time)
    }

    /// The instant so many days after the epoch; `None` outside the calendar.
    pub(super) fn time(&self, days: f64) -> Option<Timestamp> {
        instant_after_days(self.epoch, days)
    }

    /// Whether there is one reading, and nothing that is declared has changed or left out any.
    pub(super) fn is_single(&self) -> bool {
        let is_plain = self.resets.is_empty() && self.aside.is_empty();
        is_plain && self.observations.values.len() == 1
    }

    /// Takes out the only reading, in the science's unit; the record begins at `epoch` from here on.
    pub(super) fn begin_again(&mut self, source: MeasuredAs, epoch: Timestamp) -> Option<Reading> {
        let only = self.take_out_newest()?;
        *self = Self::new(source, epoch);
        Some(only)
    }

    /// Takes out the newest reading: as it was read, in the science's unit.
    pub(super) fn take_out_newest(&mut self) -> Option<Reading> {
        let newest = self.observations.values.pop()?;
        Some(Reading {
            time: self.time(newest.t_days)?,
            value: newest.value + self.taken_off(newest.t_days),
            sigma: newest.sigma,
        })
    }

    /// The value of a reading, in the science's unit, as the record would have it.
    pub(super) fn value_of(&self, source: MeasuredAs, reading: &Reading) -> f64 {
        self.as_kept(source, reading).value
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
        series.put_in_order();
        series
    }

    pub(super) fn take(&mut self, source: MeasuredAs, reading: &Reading) -> Taken {
        if source.unit.quantity() != self.observations.quantity {
            return Taken::OtherQuantity;
        }
        let mut new = self.observation(source, reading);
        if !new.value.is_finite() || new.value.abs() > source.unit.quantity().farthest() {
            return Taken::OutOfRange(new.value);
        }
        let taken_off = self.taken_off(new.t_days);
        new.value -= taken_off;
        let values = &mut self.observations.values;
        // Nearly all are later than all others: the search would fetch far more of the record from memory.
        let is_newest = values.last().is_none_or(|last| last.t_days < new.t_days);
        let at = if is_newest {
            values.len()
        } else {
            values.partition_point(|old| old.t_days < new.t_days)
        };
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
                let before = old.value + taken_off;
                *old = new;
                Taken::Corrected(before)
            }
        }
    }

    /// The newest `most` readings as they were read, in `unit`, but for what is declared to be no motion.
    pub(super) fn as_read(&self, unit: Unit, most: usize) -> Vec<(Timestamp, f64)> {
        self.newest_in(unit, most, |one| one.value)
    }

    fn newest_in(
        &self,
        unit: Unit,
        most: usize,
        value: impl Fn(&Observation) -> f64,
    ) -> Vec<(Timestamp, f64)> {
        let values = &self.observations.values;
        let newest = &values[values.len().saturating_sub(most)..];
        let read = newest
            .iter()
            .filter_map(|one| Some((self.time(one.t_days)?, value(one) / unit.factor())));
        read.collect()
    }

    /// The same readings with what resets have taken off.
    pub(super) fn with_resets(&self, unit: Unit, most: usize) -> Vec<(Timestamp, f64)> {
        self.newest_in(unit, most, |one| one.value + self.taken_off(one.t_days))
    }

    /// Whether a reset after `time` has been taken off.
    pub(super) fn is_reset_since(&self, time: Timestamp) -> bool {
        let t_days = self.days(time);
        self.resets.iter().any(|reset| reset.t_days > t_days)
    }

    /// The values of the newest `most` readings, as [`History::as_read`] gives them.
    pub(super) fn values_as_read(&self, unit: Unit, most: usize) -> Vec<f64> {
        let values = &self.observations.values;
        let newest = &values[values.len().saturating_sub(most)..];
        if [Unit::MM, Unit::MM_PER_DAY].contains(&unit) {
            return newest.iter().map(|one| one.value).collect();
        }
        let factor = unit.factor();
        newest.iter().map(|one| one.value / factor).collect()
    }

    /// The values of the readings as [`History::as_read`] gives them, the newest first.
    pub(super) fn newest_first(&self, unit: Unit) -> impl Iterator<Item = f64> {
        let factor = unit.factor();
        let newest_first = self.observations.values.iter().rev();
        newest_first.map(move |one| one.value / factor)
    }

    /// Whether a reading has the value of the newest one, or one of a sensor that stands at the end of its range, and
    /// comes after it.
    pub(super) fn is_repeated_by(&self, source: MeasuredAs, reading: &Reading) -> bool {
        let is_ours = source.unit.quantity() == self.observations.quantity;
        is_ours && self.repeats(&self.as_kept(source, reading))
    }

    /// The velocities that the readings show.
    pub(super) fn rates(&self) -> Vec<Rate> {
        self.observations.all_rates()
    }

    /// How many of the newest readings have one and the same value.
    pub(super) fn identical(&self) -> usize {
        let values = &self.observations.values;
        let same = |pair: &&[Observation]| pair[0].value.to_bits() == pair[1].value.to_bits();
        values.windows(2).rev().take_while(same).count() + usize::from(!values.is_empty())
    }
}

/// Puts a reading in its place; of two of one time the later to come stands.
fn insert(values: &mut Vec<Observation>, new: Observation) {
    let at = values.partition_point(|old| old.t_days < new.t_days);
    match values.get_mut(at) {
        Some(old) if old.t_days <= new.t_days => *old = new,
        Some(_) | None => values.insert(at, new),
    }
}
