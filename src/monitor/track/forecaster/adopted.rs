//! The law with the effects that were found, of one benchmark: its forecast, and whether it explains how fast the
//! slope is now.

use super::prepared::Prepared;
use crate::effects::{self, ByClock};
use crate::fit::Observations;
use crate::forecast::{LawForecaster, Outlook};
use crate::monitor::history::History;
use crate::monitor::motion::{fastest, is_new_highest, settled};
use crate::monitor::track::forecast::UnderKnownLoad;
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

/// A law under a known load in use.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Adopted {
    #[serde(rename = "fuller")]
    known_load: effects::KnownLoad,
    /// ln of the mean pace over the record in which it was found: the log-load that counts as none.
    usual: f64,
    /// Of the log-load over that record.
    range: (f64, f64),
    /// The highest settled velocity of that record, mm/day.
    fastest: f64,
    panel: LawForecaster,
    /// Readings in a row that were faster than explained.
    faster: u32,
}

impl Adopted {
    /// Takes a law under a known load into use; its expectation for the next reading rests on those in `history`.
    pub(super) fn new(
        known_load: effects::KnownLoad,
        history: &History,
        channels: &[&Channel],
        critical: f64,
    ) -> Self {
        let mut adopted = Self {
            known_load,
            usual: 0.0,
            range: (0.0, 0.0),
            fastest: fastest(&history.rates()).unwrap_or(0.0),
            panel: LawForecaster::default(),
            faster: 0,
        };
        let observations = &history.observations;
        let by_clock = ByClock::new(
            observations,
            history.epoch,
            channels,
            &adopted.known_load,
            None,
        );
        let Some(by_clock) = by_clock else {
            return adopted;
        };
        adopted.usual = by_clock.usual();
        let none = (f64::INFINITY, f64::NEG_INFINITY);
        adopted.range = by_clock
            .above_usual()
            .fold(none, |(low, high), f| (low.min(f), high.max(f)));
        by_clock.outlook(critical, |readings, critical| {
            adopted.panel.update(readings, critical)
        });
        adopted
    }

    pub(super) fn law(&self) -> &effects::KnownLoad {
        &self.known_load
    }

    /// What it predicts after the newest reading of `history`, beside `plain`, which knows no load.
    pub(super) fn forecast(
        &mut self,
        history: &History,
        channels: &[&Channel],
        critical: f64,
        plain: &Outlook,
        prepared: &mut Prepared,
    ) -> Option<UnderKnownLoad> {
        let by_clock = self.by_clock(history, channels)?;
        let excess = self.panel.excess(by_clock.readings());
        self.faster = match excess {
            Some(excess) if excess <= FASTER => 0,
            Some(_) | None => self.faster + 1,
        };
        let load = by_clock.now()?;
        let outlook = by_clock.outlook(critical, |readings, critical| {
            let by = |readings: &_, critical| prepared.outlook(readings, critical);
            self.panel.update_by(readings, critical, by)
        })?;
        let width = BEYOND_RANGE * (self.range.1 - self.range.0);
        let is_explained = self.known_load.reaches(channels, history.newest()?)
            && (self.range.0 - width..=self.range.1 + width).contains(&load)
            && self.faster < IN_A_ROW
            && !is_new_highest(&outlook.rates)
            && settled(&plain.rates).is_some_and(|velocity| {
                velocity < TOO_FAST * critical && velocity <= BEYOND_FASTEST * self.fastest
            });
        Some(UnderKnownLoad {
            outlook: outlook.beside(plain, is_explained),
            is_explained,
        })
    }

    /// Has `compute` compute what [`Adopted::forecast`] will ask for.
    pub(super) fn prepare(
        &self,
        history: &History,
        channels: &[&Channel],
        critical: f64,
        compute: impl FnOnce(&Observations, f64),
    ) {
        if let Some(by_clock) = self.by_clock(history, channels) {
            by_clock.outlook(critical, |readings, critical| {
                compute(readings, critical);
                None
            });
        }
    }

    /// The readings by the load's clock, without what in them is no motion.
    pub(super) fn readings(
        &self,
        history: &History,
        channels: &[&Channel],
    ) -> Option<Observations> {
        let by_clock = self.by_clock(history, channels)?;
        Some(by_clock.readings().clone())
    }

    /// The calendar's time when the load's clock stands at `time`.
    pub(super) fn by_calendar(
        &self,
        history: &History,
        channels: &[&Channel],
        time: Timestamp,
    ) -> Option<Timestamp> {
        let by_clock = self.by_clock(history, channels)?;
        after_days(history.epoch, by_clock.calendar_day(history.days(time)))
    }

    fn by_clock(&self, history: &History, channels: &[&Channel]) -> Option<ByClock> {
        let usual = Some(self.usual);
        ByClock::new(
            &history.observations,
            history.epoch,
            channels,
            &self.known_load,
            usual,
        )
    }
}
