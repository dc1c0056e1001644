//! The level in force at one benchmark, and what it rests on.

mod call;
mod levels;
mod occurrences;
mod overdue;
mod resolved;

use super::forecast::Forecast;
use super::record::BenchmarkRecord;
use crate::alert::{AlertCause, AlertEvidence, Held, Latch, Level, Policy};
use crate::fit::Rate;
use crate::monitor::event::{AlertState, Event, EventKind, REMOVED};
use crate::monitor::kept::KeptForecast;
use crate::monitor::motion::observed;
use crate::reading::{Timestamp, days_of};
use serde::Serialize;

pub(super) use levels::Levels;
pub(super) use occurrences::Occurrences;
pub(super) use overdue::Overdue;

/// What is called at one benchmark.
#[derive(Debug, Default, Serialize)]
pub(super) struct Alarm {
    latch: Latch,
    /// Since when the site's own rules have held.
    held: Held,
    /// What happened that the site's own rules may ask for, and until when it counts.
    #[serde(rename = "look")]
    attention_until: Option<(Timestamp, AlertCause)>,
    /// Whether the slope is taken to move upslope.
    backwards: bool,
    levels: Levels,
    /// The newest forecast, while a level is in force.
    kept: Option<KeptForecast>,
    /// What that leaves to the time after it.
    overdue: Option<Overdue>,
    /// What happened, and whether it calls at least yellow.
    occurrences: Occurrences,
}

/// What a level rests on beside the forecast.
#[derive(Debug, Clone, Copy)]
pub(super) struct BesideForecast<'a> {
    pub(super) record: &'a BenchmarkRecord,
    /// Whether the newest search has found an effect.
    pub(super) has_effect: bool,
    /// Whether the readings show how the slope moves: on others no level falls.
    pub(super) shows_motion: bool,
}

impl BesideForecast<'_> {
    /// What the readings up to `time`, of these rates, show by themselves.
    fn evidence(&self, policy: &Policy, time: Timestamp, rates: &[Rate]) -> AlertEvidence {
        AlertEvidence {
            has_effect: self.has_effect,
            ..observed(
                self.record.observations(),
                rates,
                time,
                days_of(policy.evacuation_time),
            )
        }
    }
}

impl Alarm {
    pub(super) fn from_saved(
        latch: Latch,
        held: Held,
        attention_until: Option<(Timestamp, AlertCause)>,
        backwards: bool,
        levels: Levels,
        kept: Option<KeptForecast>,
        overdue: Option<Overdue>,
    ) -> Self {
        Self {
            latch,
            held,
            attention_until,
            backwards,
            levels,
            kept,
            overdue,
            occurrences: Occurrences::default(),
        }
    }

    /// The same with what has happened of late.
    pub(super) fn with(self, occurrences: Occurrences) -> Self {
        Self {
            occurrences,
            ..self
        }
    }

    pub(super) fn level(&self) -> Level {
        self.latch.level()
    }

    /// The level above green that is in force, and since when.
    pub(super) fn in_force(&self) -> Option<(Level, Timestamp)> {
        self.latch.in_force()
    }

    pub(super) fn levels(&self) -> &Levels {
        &self.levels
    }

    /// The newest forecast, while a level is in force.
    pub(super) fn kept_forecast(&self) -> Option<&KeptForecast> {
        self.kept.as_ref()
    }

    /// Something happened at `time` that counts for as long as a slope must be steady for its level to fall; where it is not
    /// usual it calls yellow.
    pub(super) fn note_cause(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        self.occurrences.note(policy, time, cause);
        self.count(policy, time, cause);
    }

    /// What was attended to goes on at `time`: it counts for longer, and calls yellow for longer if it did.
    fn attend_further(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        self.occurrences.goes_on(policy, time, cause);
        self.count(policy, time, cause);
    }

    fn count(&mut self, policy: &Policy, time: Timestamp, cause: AlertCause) {
        let until = time.checked_add(policy.steady_for).ok();
        self.attention_until = until.map(|until| (until, cause));
    }

    /// The level that follows from a forecast, and what the forecast leaves to the time after it. Where the level may not fall,
    /// because the readings are doubtful, neither it nor what the forecast before left is changed.
    pub(super) fn decide(
        &mut self,
        beside: BesideForecast<'_>,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<Forecast>,
        events: &mut Vec<Event>,
    ) {
        let may_fall = beside.shows_motion || self.level() == Level::Green;
        let before = (!may_fall).then(|| (self.latch.clone(), self.levels.clone()));
        let mut alerts = self.alert(beside, policy, time, forecast.as_ref(), events);
        if let Some((latch, levels)) = before
            && self.level() < latch.level()
        {
            (self.latch, self.levels) = (latch, levels);
            alerts.retain(|event| !matches!(event.kind, EventKind::Alert { .. }));
            events.append(&mut alerts);
            return;
        }
        events.append(&mut alerts);
        if self.level() > Level::Yellow {
            self.occurrences.led_to_more();
        }
        match &forecast {
            Some(forecast) => self.await_red(policy, time, forecast),
            None => self.overdue = None,
        }
        let is_kept = self.level() > Level::Green;
        self.kept = forecast.filter(|_| is_kept).map(|forecast| {
            let outlook = forecast.in_force(days_of(policy.outlook));
            KeptForecast::of(time, &outlook.collapse)
        });
    }

    /// Begins with the course of the chance that calls red as `earlier` has it.
    pub(super) fn begin_course(&mut self, earlier: &Self) {
        self.held.begin_course(&earlier.held);
    }

    /// Goes by the rules that held at the end of the past; where a higher level was in force there, by that level, which is
    /// returned. One that has been called since and has ended, because people know why or the slope slowed down, stays so: the next reading
    /// calls it again, if it does.
    pub(super) fn go_on_from(&mut self, past: Self) -> Option<(Level, Timestamp)> {
        self.held = past.held;
        self.occurrences = past.occurrences;
        let in_force = past.latch.in_force();
        let is_open = |(level, _): &(Level, Timestamp)| {
            *level > self.level() && !self.latch.has_ended(*level)
        };
        let Some((level, since)) = in_force.filter(is_open) else {
            self.levels.go_on_from(past.levels);
            return None;
        };
        (self.latch, self.levels) = (past.latch, past.levels);
        self.attention_until = past.attention_until;
        (self.kept, self.overdue) = (past.kept, past.overdue);
        Some((level, since))
    }

    /// Goes on with the level that is in force at `former`, of readings that meant something else.
    pub(super) fn follow_on(&mut self, former: Self) {
        self.latch = former.latch.measured_otherwise();
        (self.levels, self.kept) = (former.levels, former.kept);
        self.levels.void();
    }

    /// That the level in force ends because the benchmark is no longer watched.
    pub(super) fn removed(
        &self,
        record: &BenchmarkRecord,
        now: Timestamp,
        text: String,
    ) -> Option<Event> {
        let (level, since) = self.in_force()?;
        let kind = EventKind::Alert {
            level,
            state: AlertState::Resolved,
            key: record.alert_key(level, since),
            rule: REMOVED.to_owned(),
            text,
        };
        Some(record.event(now, kind))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alert::Threshold;
    use crate::monitor::track::fixture::{at, record};

    fn policy() -> Policy {
        let threshold = Threshold {
            level: Level::Orange,
            velocity_mm_per_day: Some(100.0),
            displacement_mm: None,
            acceleration_mm_per_day2: None,
        };
        Policy {
            thresholds: vec![threshold],
            ..Policy::default()
        }
    }

    fn beside(record: &BenchmarkRecord, shows_motion: bool) -> BesideForecast<'_> {
        BesideForecast {
            record,
            has_effect: false,
            shows_motion,
        }
    }

    #[test]
    fn a_threshold_raises_the_level_between_two_refits_and_lowers_none() {
        let (fast, slow) = (record([0.0, 10.0]), record([0.0, 0.0]));
        let mut alarm = Alarm::default();
        assert!(alarm.raise(beside(&slow, true), &policy(), at(1)).is_none());
        let event = alarm.raise(beside(&fast, true), &policy(), at(1)).unwrap();
        assert!(matches!(
            event.kind,
            EventKind::Alert {
                level: Level::Orange,
                state: AlertState::Firing,
                ..
            }
        ));
        assert!(alarm.raise(beside(&slow, true), &policy(), at(2)).is_none());
        assert_eq!(alarm.level(), Level::Orange);
    }

    #[test]
    fn a_level_that_people_end_takes_what_called_for_attention_with_it() {
        let record = record([0.0, 10.0]);
        let mut alarm = Alarm::default();
        alarm.raise(beside(&record, true), &policy(), at(1));
        alarm.note_cause(&policy(), at(1), AlertCause::RegimeFlip);
        let given = crate::monitor::Given::default();
        assert!(alarm.resolve(&record, at(2), &given).is_some());
        assert_eq!(alarm.level(), Level::Green);
        assert!(alarm.attention_until.is_none());
        assert!(alarm.resolve(&record, at(2), &given).is_none());
    }

    #[test]
    fn a_higher_level_of_the_past_is_gone_on_with_and_a_lower_one_is_not() {
        let record = record([0.0, 10.0]);
        let orange = || {
            let mut alarm = Alarm::default();
            alarm.raise(beside(&record, true), &policy(), at(1));
            alarm
        };
        let mut green = Alarm::default();
        assert_eq!(green.go_on_from(orange()), Some((Level::Orange, at(1))));
        assert_eq!(green.level(), Level::Orange);
        assert_eq!(orange().go_on_from(orange()), None);
        assert_eq!(orange().go_on_from(Alarm::default()), None);
    }

    #[test]
    fn no_level_falls_on_readings_that_show_no_motion() {
        let (fast, slow) = (record([0.0, 10.0]), record((0..9).map(|_| 0.0)));
        let (mut alarm, mut events) = (Alarm::default(), Vec::new());
        let lasting = Policy {
            steady_for: jiff::SignedDuration::from_hours(1),
            ..policy()
        };
        alarm.raise(beside(&fast, true), &lasting, at(1));
        for hour in 2..9 {
            alarm.decide(beside(&slow, false), &lasting, at(hour), None, &mut events);
        }
        assert_eq!(alarm.level(), Level::Orange);
    }
}
