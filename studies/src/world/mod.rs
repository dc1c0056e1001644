//! Simulated slopes that fail and stand as published slopes do, read by instruments as they are.
//!
//! Beside the lives of [`Life`], which follow the law that the monitor fits, these are what forecasts of a collapse
//! learn from and are judged by, one family left out at a time. The velocity last read before a collapse is lognormal
//! with the median of 30 published failures (93 mm/day, 1.1 decades; Federico et al. 2012), the time from the onset
//! to the collapse has the spread of 20 published ones (0.8 decades about 25 days); slopes that accelerate and stop
//! reach the same velocities. Everything else is drawn broadly.

mod course;
mod gauge;
mod onward;
mod weather;

pub use gauge::GaugeKind;

use crate::life::{Fate, Life};
use crate::random::{happens, uniform};
use course::Course;
use gauge::Gauge;
use rand::SeedableRng;
use rand_pcg::Pcg64;
use slipwatch::fit::{Observation, Observations};
use slipwatch::reading::Quantity;

/// The share of records that begin within an acceleration, or anywhere in a life without one, and how far on, at most.
const BEGUN: (f64, f64) = (0.3, 0.7);

/// Seeds of years differ by this from those of lives.
const YEARS: u64 = 0x59_4541_5253;

/// How a slope moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Fails by Voight's relation, alpha 1.3 to 3.
    Voight,
    /// Fails in the middle of an exponential acceleration.
    Exponential,
    /// Accelerates, slows as the load is handed over to another block, and fails with that.
    Handover,
    /// Fails by Voight's relation with log-periodic bursts.
    LogPeriodic,
    /// Fails after one or two pauses.
    Paused,
    /// Fails in pieces: a burst and a slowing before the last.
    Pieces,
    /// Accelerates to a velocity that it keeps, and fails from that.
    Levelled,
    /// Fails by the slider block's law under an undeclared load: [`Life`].
    Law,
    /// Creeps at one velocity.
    Steady,
    /// Creeps at one velocity, then at a higher one.
    TwoRates,
    /// Is loaded by rain.
    Rain,
    /// Swings with the seasons.
    Season,
    /// Steps when a reservoir is drawn down.
    Reservoir,
    /// Moves with frost and thaw.
    FreezeThaw,
    /// Accelerates as the failing do, and stops.
    Stopped,
    /// Accelerates to a velocity that it keeps.
    Plateau,
    /// Moves in fits.
    StickSlip,
    /// Creeps; its instrument is reset.
    Resets,
}

impl Family {
    /// All of them, those that fail first.
    pub const ALL: [Self; 18] = [
        Self::Voight,
        Self::Exponential,
        Self::Handover,
        Self::LogPeriodic,
        Self::Paused,
        Self::Pieces,
        Self::Levelled,
        Self::Law,
        Self::Steady,
        Self::TwoRates,
        Self::Rain,
        Self::Season,
        Self::Reservoir,
        Self::FreezeThaw,
        Self::Stopped,
        Self::Plateau,
        Self::StickSlip,
        Self::Resets,
    ];

    /// What the seeds of its slopes differ by from those of other families; no slope changes when a family is added.
    fn seed(self) -> u64 {
        let others = Self::ALL.iter().filter(|other| **other != Self::Levelled);
        let mut others = others.zip(0..);
        let found = others.find(|(other, _)| **other == self);
        found.map_or(17, |(_, seed)| seed)
    }

    /// Whether its slopes collapse.
    pub fn fails(self) -> bool {
        self <= Self::Law
    }
}

/// One simulated slope and its readings.
#[derive(Debug, Clone, PartialEq)]
pub struct Simulated {
    /// How it moves.
    pub family: Family,
    /// What reads it.
    pub gauge: GaugeKind,
    /// Its readings, days from the beginning of its life.
    pub observations: Observations,
    /// Between readings, days.
    pub interval_days: f64,
    /// When it collapsed, days.
    pub collapse_days: Option<f64>,
    /// When an acceleration that did not end in a collapse stopped, days.
    pub stopped_days: Option<f64>,
    /// From when on the motion since the onset of the acceleration is more than ten times the largest error of the
    /// instrument, days; its end where it never is.
    pub visible_days: f64,
    /// The end of its life, days.
    pub end_days: f64,
}

impl Simulated {
    /// The slope that `seed` gives.
    pub fn draw(family: Family, seed: u64) -> Self {
        if family == Family::Law {
            return Self::by_the_law(seed);
        }
        let mut generator = Pcg64::seed_from_u64(seed.wrapping_mul(31).wrapping_add(family.seed()));
        loop {
            if let Some(drawn) = Self::attempt(family, &mut generator) {
                return drawn;
            }
        }
    }

    /// A year of a slope that stands, read each `interval_days` by an instrument that is read so often.
    pub fn year(family: Family, interval_days: f64, seed: u64) -> Self {
        let index = seed.wrapping_mul(31).wrapping_add(family.seed());
        let mut generator = Pcg64::seed_from_u64(index ^ YEARS);
        loop {
            let gauge = Gauge::draw(family, &mut generator);
            let gauge = gauge.read_each(interval_days);
            let course = gauge
                .as_ref()
                .and_then(|gauge| Course::year(family, gauge, &mut generator));
            if let (Some(gauge), Some(course)) = (gauge, course) {
                let path = onward::path(&course, family, gauge.interval, &mut generator);
                let readings = gauge.read(&path, family, &mut generator);
                return Self::of(family, (&gauge, &course), readings, 0.0);
            }
        }
    }

    /// What a monitor has of it by `now_days`.
    pub fn known(&self, now_days: f64) -> Observations {
        let values = &self.observations.values;
        let count = values.partition_point(|value| value.t_days <= now_days);
        Observations {
            values: values[..count].to_vec(),
            ..self.observations.clone()
        }
    }

    fn by_the_law(seed: u64) -> Self {
        const FIRST_SEED: u64 = 5_000_000;
        const VISIBLE: f64 = 0.3;
        let life = Life::draw(Fate::Failing, FIRST_SEED.wrapping_add(seed));
        let collapse = life.failure_days.unwrap_or(f64::INFINITY);
        let observations = life.known(f64::INFINITY);
        let values = &observations.values;
        let mut spans: Vec<f64> = values
            .windows(2)
            .map(|pair| pair[1].t_days - pair[0].t_days)
            .collect();
        spans.sort_by(f64::total_cmp);
        Self {
            family: Family::Law,
            gauge: GaugeKind::Plain,
            interval_days: spans.get(spans.len() / 2).copied().unwrap_or(1.0),
            collapse_days: life.failure_days,
            stopped_days: None,
            visible_days: VISIBLE * collapse,
            end_days: collapse,
            observations,
        }
    }

    /// `None` where the instrument could not see the motion that is drawn.
    fn attempt(family: Family, generator: &mut Pcg64) -> Option<Self> {
        const FEWEST_READINGS: usize = 14;
        let gauge = Gauge::draw(family, generator);
        let course = Course::draw(family, &gauge, generator)?;
        let path = onward::path(&course, family, gauge.interval, generator);
        let visible_days = path.visible(&course, gauge.error());
        if family.fails() && course.end - visible_days < 2.0 * gauge.interval {
            return None;
        }
        let readings = gauge.read(&path, family, generator);
        // Many a record begins when somebody has seen the slope move.
        let begins = if happens(generator, BEGUN.0) {
            course.onset + uniform(generator, 0.0, BEGUN.1) * (course.end - course.onset)
        } else {
            0.0
        };
        let drawn = Self {
            visible_days: visible_days.max(begins),
            ..Self::of(family, (&gauge, &course), readings, begins)
        };
        (drawn.observations.values.len() >= FEWEST_READINGS).then_some(drawn)
    }

    /// The readings of `course` by `gauge`, from `begins` days on.
    fn of(
        family: Family,
        (gauge, course): (&Gauge, &Course),
        readings: Vec<(f64, f64)>,
        begins: f64,
    ) -> Self {
        let known = readings.into_iter().filter(|(days, _)| *days >= begins);
        let values = known.map(|(t_days, value)| Observation {
            t_days,
            value,
            sigma: None,
        });
        let quantity = if gauge.averaging > 0.0 {
            Quantity::Velocity
        } else {
            Quantity::Displacement
        };
        Self {
            family,
            gauge: gauge.kind,
            observations: Observations {
                quantity,
                averaging_days: gauge.averaging,
                values: values.collect(),
            },
            interval_days: gauge.interval,
            collapse_days: family.fails().then_some(course.end),
            stopped_days: course.stops.filter(|_| !family.fails()),
            visible_days: begins,
            end_days: course.end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_family_ends_as_it_says_and_is_read_before_its_end() {
        for family in Family::ALL {
            for seed in 0..6 {
                let slope = Simulated::draw(family, seed);
                assert_eq!(slope.collapse_days.is_some(), family.fails(), "{family:?}");
                let values = &slope.observations.values;
                assert!(values.len() >= 14, "{family:?} {seed}");
                assert!(values.iter().all(|value| value.value.is_finite()));
                let newest = values[values.len() - 1].t_days;
                assert!(newest <= slope.end_days, "{family:?} {seed}");
                assert_eq!(slope, Simulated::draw(family, seed));
            }
        }
    }

    #[test]
    fn times_of_readings_increase() {
        for family in Family::ALL {
            let slope = Simulated::draw(family, 11);
            let values = &slope.observations.values;
            assert!(
                values
                    .windows(2)
                    .all(|pair| pair[0].t_days < pair[1].t_days)
            );
        }
    }
}
