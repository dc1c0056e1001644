//! A benchmark's past, judged after its newest reading has been judged: what would have been, had each reading
//! been judged as it came.

use super::forecast::{Forecast, LookAhead};
use super::{StepContext, Track};
use crate::alert::{Level, Policy};
use crate::fit::Observation;
use crate::monitor::declared::Declarations;
use crate::monitor::event::{AlertState, Event, EventKind};
use crate::reading::{BenchmarkId, Reading, Timestamp, days_of};
use jiff::SignedDuration;
use serde::{Deserialize, Serialize};

/// Refits and readings of one turn at most.
const MOST_REFITS: usize = 16;
const MOST_READINGS: usize = 2000;
/// Of refits that lie further back than this from the first that was judged, the first of each day is reported: the state
/// keeps no more.
const ALL_FOR: SignedDuration = SignedDuration::from_hours(90 * 24);
/// The rule of a level that comes from the past.
pub(in crate::monitor) const PAST: &str = "past";
/// Before the reading that is judged first the course of the chance that calls red is begun, with so many readings of each of its spans judged.
const JUDGED_A_COURSE: i32 = 12;
const DAY: SignedDuration = SignedDuration::from_hours(24);

/// A benchmark's past, as far as it has been judged.
#[derive(Debug, Serialize, Deserialize)]
pub(in crate::monitor) struct PastReplay {
    /// As it would stand by now.
    track: Box<Track>,
    /// The last reading, days since the epoch.
    at_days: Option<f64>,
    /// The reading that was judged first: its refit and those after it have been reported.
    until: Timestamp,
    /// The day of the last refit that was reported, of those that are reported once a day.
    day: Option<i64>,
    /// Alerts since the level was last green: they are reported together when it is again, so that what is over never
    /// looks as if it were in force.
    episode: Vec<Event>,
    /// Whether a reading that has been judged was corrected since, or one before it has come: it is begun again.
    #[serde(default)]
    is_stale: bool,
    /// Up to when refits, and when alerts, were reported before it was begun again.
    #[serde(default)]
    reported: Option<Timestamp>,
    #[serde(default)]
    alerts_reported: Option<Timestamp>,
}

impl PastReplay {
    pub(in crate::monitor) fn benchmark(&self) -> &BenchmarkId {
        self.track.record.benchmark()
    }

    /// A reading of `time` has been taken: among those that have been judged, they are not what they were.
    pub(in crate::monitor) fn note(&mut self, time: Timestamp) {
        self.is_stale |= self.track.newest().is_some_and(|newest| time <= newest);
    }

    /// Whether a refit of `time` is reported.
    fn reports(&mut self, time: Timestamp) -> bool {
        if time >= self.until || Some(time) <= self.reported {
            return false;
        }
        if self.until.duration_since(time) <= ALL_FOR {
            return true;
        }
        let day = time.as_second().div_euclid(DAY.as_secs());
        self.day.replace(day) != Some(day)
    }
}

impl Track {
    pub(in crate::monitor) fn newest(&self) -> Option<Timestamp> {
        self.record.newest()
    }

    /// Judges the newest reading, of `time`.
    pub(in crate::monitor) fn judge_now(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        self.pending.begin_past();
        if self.quality.is_stuck() {
            return Vec::new();
        }
        let forecast = self.forecast(policy, context);
        if let Some(forecast) = &forecast {
            self.begin_course(policy, time, forecast, context);
        }
        let mut events = self.judge_by(policy, time, forecast, context);
        self.pending.hold_back(&mut events);
        events
    }

    /// Where the newest `forecast`, of `time`, is not far from calling red: its course is what readings before that would have led to. A
    /// chance that is higher for one reading would call red without it.
    fn begin_course(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: &Forecast,
        context: &StepContext<'_>,
    ) {
        let red_within = days_of(LookAhead::of(policy, Some(forecast)).red);
        if forecast.chance_within(red_within) < policy.red_mean_chance() / 2.0 {
            return;
        }
        let (mut earlier, mut context) = (self.past(time).track, *context);
        let Ok(mut next) = time.checked_sub(policy.red_course_fades()) else {
            return;
        };
        let readings = self.record.observations().values.iter();
        let readings = readings.filter_map(|one| self.reading_of(one));
        for reading in readings.take_while(|one| one.time < time) {
            context.phase.now = reading.time;
            (context.phase.is_past, context.phase.is_queue) = (true, false);
            earlier.take(policy, self.record.source(), &reading, &context);
            if reading.time >= next {
                context.phase.is_past = false;
                earlier.judge(policy, reading.time, &context);
                next = reading.time + policy.red_course() / JUDGED_A_COURSE;
            }
        }
        self.alarm.begin_course(&earlier.alarm);
    }

    fn reading_of(&self, one: &Observation) -> Option<Reading> {
        let time = self.record.history().time(one.t_days)?;
        Some(Reading {
            time,
            value: one.value,
            sigma: one.sigma,
        })
    }

    /// The past of this benchmark up to `until`, at its beginning.
    pub(in crate::monitor) fn past(&self, until: Timestamp) -> PastReplay {
        // Declared resets are taken off what is kept.
        let declared = Declarations::default();
        let record = &self.record;
        let (source, epoch) = (record.source(), record.history().epoch);
        let mut track = Self::new(
            record.benchmark().clone(),
            source,
            epoch,
            declared,
            record.dropped(),
        );
        track.quality = self.quality.begun_again();
        PastReplay {
            track: Box::new(track),
            at_days: None,
            until,
            day: None,
            episode: Vec::new(),
            is_stale: false,
            reported: None,
            alerts_reported: None,
        }
    }

    /// The same begun again where readings of it have been corrected: what was reported is not reported again.
    fn renewed(&self, walk: &mut PastReplay) {
        if walk.is_stale {
            *walk = PastReplay {
                day: walk.day,
                reported: walk.reported.max(walk.track.newest()),
                alerts_reported: walk.alerts_reported,
                ..self.past(walk.until)
            };
        }
    }

    /// Goes on through the past; its refits and alerts that are reported, and whether there is more of it.
    pub(in crate::monitor) fn walk(
        &self,
        walk: &mut PastReplay,
        policy: &Policy,
        context: &StepContext<'_>,
    ) -> (Vec<Event>, bool) {
        self.renewed(walk);
        let values = &self.record.observations().values;
        let from = walk
            .at_days
            .map_or(0, |at| values.partition_point(|one| one.t_days <= at));
        let (mut events, mut refits) = (Vec::new(), 0);
        for one in values.iter().skip(from).take(MOST_READINGS) {
            if refits == MOST_REFITS {
                return (events, true);
            }
            walk.at_days = Some(one.t_days);
            let Some(reading) = self.reading_of(one) else {
                continue;
            };
            let mut context = *context;
            context.phase.now = reading.time;
            let source = self.record.source();
            let said = walk.track.take(policy, source, &reading, &context);
            for event in said {
                if matches!(event.kind, EventKind::Refit { .. }) {
                    refits += 1;
                    events.extend(walk.reports(event.time).then_some(event));
                } else if event.kind.is_of_the_record() {
                    let is_new = Some(event.time) > walk.reported;
                    events.extend(is_new.then_some(event));
                } else if is_of_a_level(&event)
                    && (event.time < walk.until || self.is_end_of_past(&walk.episode, &event))
                {
                    walk.episode.push(event);
                }
            }
            if walk.track.level() == Level::Green {
                let reported = walk.alerts_reported;
                walk.alerts_reported = reported.max(walk.episode.last().map(|event| event.time));
                let is_new = |event: &Event| Some(event.time) > reported;
                events.extend(walk.episode.drain(..).filter(is_new));
            }
        }
        // Half as it was and half corrected it does not go on.
        walk.is_stale = self.pending.has_unjudged_late();
        (events, walk.is_stale || values.len() - from > MOST_READINGS)
    }

    /// Whether `event`, of a time from which on this benchmark is watched, ends what began in the past and is in force no more.
    fn is_end_of_past(&self, episode: &[Event], event: &Event) -> bool {
        let Some((key, AlertState::Resolved, level)) = alert(event) else {
            return false;
        };
        let mut of_it = episode.iter().rev().filter_map(alert);
        let newest = of_it.find(|(one, ..)| *one == key);
        self.level() < level && newest.is_some_and(|(_, state, _)| state == AlertState::Firing)
    }

    /// The past has been judged: goes on as it leads to. A level from there that has not ended is called.
    pub(in crate::monitor) fn go_on_from(
        &mut self,
        policy: &Policy,
        now: Timestamp,
        past: PastReplay,
    ) -> Vec<Event> {
        let (past, mut events) = (*past.track, past.episode);
        self.forecaster.go_on_from(past.forecaster);
        self.changes = past.changes;
        self.pending.end_past();
        let Some((level, since)) = self.alarm.go_on_from(past.alarm) else {
            if self.level() == Level::Green {
                events.extend(events.last().and_then(|last| ended(now, last)));
            }
            return events;
        };
        let benchmark = self.record.benchmark();
        let place = format!("benchmark {benchmark}: {level}");
        let called = events.iter().rev().find_map(|event| {
            if let EventKind::Alert {
                level: called,
                text,
                ..
            } = &event.kind
                && *called == level
            {
                text.strip_prefix(&place)
            } else {
                None
            }
        });
        let text = format!(
            "{place} since {since}, found in the readings from before it was watched; nothing since has ended it{}",
            called.map_or_else(String::new, |called| format!(
                "; when it was called: {}",
                called.trim_start_matches("; ")
            ))
        );
        let kind = EventKind::Alert {
            level,
            state: AlertState::Firing,
            key: self.record.alert_key(level, since),
            rule: PAST.to_owned(),
            text,
        };
        events.push(self.record.event(now, kind));
        // What a sensor at the end of its range gives is judged by the level.
        events.extend((self.quality).judge_sensor(&mut self.record, policy, level, now));
        events
    }
}

/// The key, the state and the level of an alert.
fn alert(event: &Event) -> Option<(&str, AlertState, Level)> {
    if let EventKind::Alert {
        key, state, level, ..
    } = &event.kind
    {
        Some((key, *state, *level))
    } else {
        None
    }
}

/// Whether it enters or leaves a level; that nothing can be said is not reported of the past.
fn is_of_a_level(event: &Event) -> bool {
    matches!(event.kind, EventKind::Alert { level, .. } if level != Level::Unknown)
}

/// The end of what `last` says, where that is the beginning of a level: it ended while the past was gone through.
fn ended(now: Timestamp, last: &Event) -> Option<Event> {
    let mut event = last.clone();
    event.time = now;
    if let EventKind::Alert { state, .. } = &mut event.kind
        && *state == AlertState::Firing
    {
        *state = AlertState::Resolved;
        return Some(event);
    }
    None
}
