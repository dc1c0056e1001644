//! A benchmark whose next reading does not come is judged again as time passes: a collapse that was forecast comes nearer
//! without readings too.

use super::Alarm;
use super::call::alert_of;
use crate::alert::{AlertEvidence, Level, Policy, percent_in_words, span_in_words};
use crate::monitor::event::Event;
use crate::monitor::kept::KeptForecast;
use crate::monitor::track::forecast::Forecast;
use crate::monitor::track::record::BenchmarkRecord;
use crate::reading::{SECONDS_PER_DAY, Timestamp, days_of};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Checks in an evacuation time.
const CHECKS_AN_EVACUATION: i32 = 8;
/// Checks at most, however long the outlook is beside the evacuation time.
const MOST_CHECKS: i32 = 2000;

/// What the newest forecast leaves to the time after it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(in crate::monitor::track) struct Overdue {
    /// The chances that levels go by.
    chances: KeptForecast,
    /// Between readings.
    interval: SignedDuration,
    /// From when on the chance within [`Policy::red_within`] calls red, if no collapse has come by then.
    red_from: Timestamp,
}

impl Overdue {
    /// `None` where the forecast never comes to that within the outlook.
    fn of(policy: &Policy, time: Timestamp, forecast: &Forecast) -> Option<Self> {
        let outlook = forecast.in_force(days_of(policy.outlook));
        let chances = KeptForecast::of(time, &outlook.chances);
        let to_next = outlook.to_next_days * SECONDS_PER_DAY;
        let interval = SignedDuration::try_from_secs_f64(to_next).ok()?;
        let is_red = |now: Timestamp| {
            chances.chance_within(now, days_of(policy.red_within())) >= policy.red_chance
        };
        let checks = (1..=MOST_CHECKS).map_while(|check| {
            let after = policy.evacuation_time.checked_mul(check)? / CHECKS_AN_EVACUATION;
            let now = time.checked_add(interval.checked_add(after)?).ok()?;
            (after <= policy.outlook).then_some(now)
        });
        let red_from = checks.into_iter().find(|now| is_red(*now))?;
        Some(Self {
            chances,
            interval,
            red_from,
        })
    }

    /// When red is due, if no reading comes after the one of `newest`.
    fn due(&self, newest: Timestamp) -> Timestamp {
        let next = newest.checked_add(self.interval).unwrap_or(newest);
        self.red_from.max(next)
    }
}

/// When the last reading was that has been read, of those that wait for earlier ones too: no collapse has come by then.
fn read_last(record: &BenchmarkRecord) -> Option<Timestamp> {
    let newest = record.newest()?;
    Some(
        record
            .counted_from()
            .map_or(newest, |read| read.max(newest)),
    )
}

impl Alarm {
    /// Keeps what the forecast of `time` leaves to the time after it, while a level below red is in force.
    pub(super) fn await_red(&mut self, policy: &Policy, time: Timestamp, forecast: &Forecast) {
        let may_rise = matches!(self.latch.level(), Level::Yellow | Level::Orange);
        self.overdue = may_rise
            .then(|| Overdue::of(policy, time, forecast))
            .flatten();
    }

    /// When red is due, if no reading comes.
    pub(in crate::monitor::track) fn overdue_at(
        &self,
        record: &BenchmarkRecord,
    ) -> Option<Timestamp> {
        let newest = read_last(record)?;
        let due = self.overdue.as_ref()?.due(newest);
        Some(record.put_off(newest, due))
    }

    /// Red at `now`, where `until` has come to when it is due without a reading.
    pub(in crate::monitor::track) fn judge_overdue(
        &mut self,
        record: &BenchmarkRecord,
        policy: &Policy,
        (now, until): (Timestamp, Timestamp),
    ) -> Option<Event> {
        self.overdue_at(record).filter(|due| *due <= until)?;
        let (newest, overdue) = (read_last(record)?, self.overdue.take()?);
        let chance = overdue
            .chances
            .chance_within(until, days_of(policy.red_within()));
        let evidence = AlertEvidence {
            now,
            chance_for_red: Some(chance),
            ..AlertEvidence::default()
        };
        let change = self.latch.raise(policy, &evidence)?;
        self.levels.note(now, &self.latch);
        let text = format!(
            "benchmark {}: {}; no reading since {newest}; if no collapse has come since, chance of collapse {} within {} ({}) from {until:.0} on; rule {}",
            record.benchmark(),
            change.level,
            percent_in_words(chance),
            span_in_words(policy.red_within()),
            policy.red_within_in_words(),
            change.rule,
        );
        Some(alert_of(record, now, &change, text))
    }
}
