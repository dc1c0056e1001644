//! The fuller law of one benchmark: its forecast, and whether it explains how fast the slope is now.
//!
//! Under a known log-load f the law reads v = v_i e^f / y, dy/dt = a y^p - b e^f. In the time of a clock that runs
//! at the pace e^f it is the law under a constant load, exactly so where a = 0 (the inverse-velocity line; else
//! the contacts age by the calendar, which the undeclared load of the forecast is left to make up for). So the
//! readings are told in that clock's time, forecast as ever, and the times told back.

use super::forecast::Fuller;
use super::motion::{fastest, is_new_highest, settled};
use crate::effects::{self, Clock};
use crate::fit::{Observations, Rate};
use crate::forecast::{Outlook, Panel};
use crate::monitor::history::History;
use crate::reading::{Channel, Timestamp, after_days};
use serde::{Deserialize, Serialize};

/// A load beyond its range over the record by more than this share of it explains nothing: nobody has seen it.
const BEYOND_RANGE: f64 = 0.25;
/// Nor is a velocity explained of more than so many times the highest from which the effect was learnt.
const BEYOND_FASTEST: f64 = 2.0;
/// A reading is faster than explained from so many standard deviations on.
const FASTER: f64 = 3.0;
/// So many in a row are no outlier.
const IN_A_ROW: u32 = 2;
/// From this share of the critical velocity on no effect explains how fast it is.
const TOO_FAST: f64 = 0.1;

/// A fuller law in use.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Adopted {
    fuller: effects::Fuller,
    /// ln of the mean pace over the record in which it was found: the log-load that counts as none.
    usual: f64,
    /// Of the log-load over that record.
    range: (f64, f64),
    /// The highest settled velocity of that record, mm/day.
    fastest: f64,
    panel: Panel,
    /// Readings in a row that were faster than explained.
    faster: u32,
}

impl Adopted {
    /// Takes a fuller law into use; its expectation for the next reading rests on those in `history`.
    pub(super) fn new(
        fuller: effects::Fuller,
        history: &History,
        channels: &[&Channel],
        critical: f64,
    ) -> Self {
        let mut adopted = Self {
            fuller,
            usual: 0.0,
            range: (0.0, 0.0),
            fastest: fastest(&history.rates()).unwrap_or(0.0),
            panel: Panel::default(),
            faster: 0,
        };
        let clock = adopted.clock(history, channels);
        adopted.usual = clock.usual();
        let each = clock.log_load().iter();
        adopted.range = each.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), f| {
            (low.min(f - adopted.usual), high.max(f - adopted.usual))
        });
        let clock = adopted.clock(history, channels);
        let readings = adopted.told(&clock, history, channels);
        adopted.outlook(history, (&clock, &readings), critical);
        adopted
    }

    pub(super) fn law(&self) -> &effects::Fuller {
        &self.fuller
    }

    /// What it foretells after the newest reading of `history`, of which `rates` are the velocities.
    pub(super) fn forecast(
        &mut self,
        history: &History,
        channels: &[&Channel],
        (critical, rates): (f64, &[Rate]),
    ) -> Option<Fuller> {
        let clock = self.clock(history, channels);
        let readings = self.told(&clock, history, channels);
        let excess = self.panel.excess(&readings);
        self.faster = match excess {
            Some(excess) if excess <= FASTER => 0,
            Some(_) | None => self.faster + 1,
        };
        let load = clock.log_load().last()? - self.usual;
        let outlook = self.outlook(history, (&clock, &readings), critical)?;
        let width = BEYOND_RANGE * (self.range.1 - self.range.0);
        let is_explained = self.fuller.reaches(channels, history.newest()?)
            && (self.range.0 - width..=self.range.1 + width).contains(&load)
            && self.faster < IN_A_ROW
            && !is_new_highest(&outlook.rates)
            && settled(rates).is_some_and(|velocity| {
                velocity < TOO_FAST * critical && velocity <= BEYOND_FASTEST * self.fastest
            });
        Some(Fuller {
            outlook,
            is_explained,
        })
    }

    /// The forecast in calendar time. A load that is high now may stay, and one that is low may be gone tomorrow:
    /// the slope is run on at the higher of the present pace and the usual one.
    fn outlook(
        &mut self,
        history: &History,
        (clock, readings): (&Clock, &Observations),
        critical: f64,
    ) -> Option<Outlook> {
        let now = clock.log_load().last()? - self.usual;
        let pace = now.clamp(0.0, Clock::FARTHEST_LOAD).exp();
        let outlook = self.panel.update(readings, critical / pace)?;
        Some(Outlook {
            now_days: history.observations.values.last()?.t_days,
            ..outlook.sooner(pace)
        })
    }

    /// The readings by the load's clock, without what in them is no motion.
    pub(super) fn readings(&self, history: &History, channels: &[&Channel]) -> Observations {
        self.told(&self.clock(history, channels), history, channels)
    }

    /// The calendar's time when the load's clock stands at `time`.
    pub(super) fn by_calendar(
        &self,
        history: &History,
        channels: &[&Channel],
        time: Timestamp,
    ) -> Option<Timestamp> {
        let told = history.days(time);
        after_days(history.epoch, self.clock(history, channels).day(told))
    }

    fn told(&self, clock: &Clock, history: &History, channels: &[&Channel]) -> Observations {
        let observations = &history.observations;
        let times = observations.values.iter();
        let times: Vec<_> = times
            .filter_map(|value| history.time(value.t_days))
            .collect();
        clock.told(observations, &self.fuller.in_reading(channels, &times))
    }

    fn clock(&self, history: &History, channels: &[&Channel]) -> Clock {
        let days = Clock::ticks(&history.observations);
        let times: Vec<_> = days.iter().filter_map(|t| history.time(*t)).collect();
        let log_load = self.fuller.log_load(channels, &times);
        Clock::new(days, log_load, self.usual)
    }
}
