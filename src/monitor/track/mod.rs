//! One benchmark: each new reading grows t_max, refits, and may change regime, intercept and level.

mod alarm;
mod batch;
mod effects;
mod forecast;
mod forecaster;
mod past;
mod pending;
mod quality;
mod record;
mod refit;
mod saved;
mod timing;

use super::Explain;
use super::covariates::Covariates;
use super::declared::Declarations;
use super::event::Event;
use super::given::Given;
use super::history::{MeasuredAs, Taken};
use super::kept::KeptForecast;
use crate::alert::{AlertCause, Level, Policy};
use crate::fit::Rate;
use crate::reading::{BenchmarkId, Reading, Suspicion, Timestamp};
use alarm::{Alarm, BesideForecast};
use forecast::Forecast;
use forecaster::Forecaster;
use pending::Pending;
use quality::DataQuality;
use record::BenchmarkRecord;
use refit::FitChanges;
use saved::SavedTrack;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

pub(super) use forecaster::Prepared;
pub(super) use past::{PAST, PastReplay};

/// What a step of a benchmark depends on beside its readings.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepContext<'a> {
    pub(super) phase: Phase,
    pub(super) covariates: &'a Covariates,
}

/// What holds for all benchmarks at one step.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_excessive_bools, reason = "each holds by itself")]
pub(super) struct Phase {
    pub(super) explain: Explain,
    /// Data time.
    pub(super) now: Timestamp,
    /// Whether what comes late is judged when all that came with it has been taken.
    pub(super) in_batches: bool,
    /// Whether the past is being read: nothing is judged until it has been.
    pub(super) is_past: bool,
    /// Whether readings come faster than they can be judged: each benchmark is judged for its newest.
    pub(super) is_queue: bool,
    /// Whether a suspicion of another scale goes on until the readings clearly contradict it.
    pub(super) holds_scale: bool,
}

/// Everything the monitor knows of one benchmark. Each part keeps its own state; what one needs of another it is given.
///
/// On disk the parts' fields stand side by side in one map, as they did when a track had no parts: no two parts may have a field
/// of one name, and each field stands in [`SavedTrack`] too.
#[derive(Debug, Serialize, Deserialize)]
#[serde(from = "SavedTrack")]
pub(super) struct Track {
    /// What has been read.
    #[serde(flatten)]
    record: BenchmarkRecord,
    /// Whether that can be believed.
    #[serde(flatten)]
    quality: DataQuality,
    /// What is forecast.
    #[serde(flatten)]
    forecaster: Forecaster,
    /// What refits have reported.
    #[serde(flatten)]
    changes: FitChanges,
    /// What is called.
    #[serde(flatten)]
    alarm: Alarm,
    /// What is still to be done.
    #[serde(flatten)]
    pending: Pending,
}

impl Track {
    pub(super) fn new(
        benchmark: BenchmarkId,
        source: MeasuredAs,
        epoch: Timestamp,
        declared: Declarations,
        dropped: u32,
    ) -> Self {
        Self {
            record: BenchmarkRecord::new(benchmark, source, epoch, declared, dropped),
            quality: DataQuality::default(),
            forecaster: Forecaster::default(),
            changes: FitChanges::default(),
            alarm: Alarm::default(),
            pending: Pending::default(),
        }
    }

    /// Takes one reading, and the one before it that waited for this.
    pub(super) fn take(
        &mut self,
        policy: &Policy,
        source: MeasuredAs,
        reading: &Reading,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let now = context.phase.now;
        let mut events = Vec::from_iter(self.record.leave_out_overtaken(source, reading));
        if let Some((source, waited)) = self.record.take_confirmed(reading.time, now) {
            events.extend(self.take_one(policy, source, &waited, context));
        } else {
            events.extend(self.record.contradict_ahead(reading.time));
        }
        events.extend(self.take_one(policy, source, reading, context));
        self.forecaster.forget_prepared();
        self.pending.hold_back(&mut events);
        events
    }

    /// At `time` the sensor gave something else instead of a reading.
    pub(super) fn note_missing(&mut self, time: Timestamp) {
        self.record.note_missing(time);
    }

    fn take_one(
        &mut self,
        policy: &Policy,
        source: MeasuredAs,
        reading: &Reading,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let mut events = self.record.declared_with(reading.time);
        if self.record.is_left_out(reading.time) {
            events.extend(self.leave_out(source, reading));
            return events;
        }
        if self.quality.is_stuck() && self.record.history().is_repeated_by(source, reading) {
            // It is no reading, but the benchmark is not silent.
            self.record.note_newest(reading.time);
            events.extend(self.read_again(reading.time, reading.time));
            return events;
        }
        // For the look back, which begins with the first that comes late.
        let begins_late = self.record.is_late(reading.time) && !self.pending.has_look_back();
        let before = begins_late.then(|| self.record.observations().clone());
        let taken = self.record.take(source, reading);
        events.extend(self.quality.complaint(&self.record, taken, reading.time));
        match taken {
            Taken::OtherQuantity => {
                events.extend(self.quality.count_other(&self.record, reading.time));
                return events;
            }
            Taken::Known | Taken::OutOfRange(_) => return events,
            Taken::Newest => {
                self.record.note_newest(reading.time);
                self.forecaster.count_reading();
                events.extend(self.quality.unstick(&mut self.record, reading.time));
            }
            // What came late or was corrected is judged at once, as of the newest reading.
            Taken::Late | Taken::Corrected(_) => {
                let levels = self.alarm.levels();
                self.pending.note_late(reading.time, before, levels);
                if taken == Taken::Late {
                    events.extend(self.record.put_overtaken_aside(reading.time));
                }
            }
        }
        events.extend(self.quality.count_own(&self.record, reading.time));
        let time = self.record.newest().unwrap_or(reading.time);
        events.extend(self.record.reset(time));
        events.extend(self.read_again(time, reading.time));
        events.extend(self.record.leave_out_clockless(time));
        if taken == Taken::Newest {
            events.extend(self.doubt(policy, source, time, context.phase));
            if !context.phase.in_batches {
                events.extend(self.look_back(policy, time));
            }
        }
        events.extend(self.judge_where_due(policy, taken, reading.time, time, context));
        events
    }

    /// Keeps a reading that is not to count.
    fn leave_out(&mut self, source: MeasuredAs, reading: &Reading) -> Vec<Event> {
        let Some(mut events) = self.record.leave_out(source, reading) else {
            return Vec::new();
        };
        let now = self.record.data_time(reading.time);
        events.extend(self.read_again(now, reading.time));
        events
    }

    /// The end of a silence, where the reading of `time` is one.
    fn read_again(&mut self, now: Timestamp, time: Timestamp) -> Vec<Event> {
        self.quality.read_again(&mut self.record, now, time)
    }

    /// After the newest reading, of `time`: whether what is read can be what a slope does.
    fn doubt(
        &mut self,
        policy: &Policy,
        source: MeasuredAs,
        time: Timestamp,
        phase: Phase,
    ) -> Vec<Event> {
        let mut events = Vec::new();
        // A state of an earlier version is judged again as it was.
        if phase.holds_scale
            && let Some(since) = self.quality.look_at_unit(&self.record, source.unit)
        {
            self.record.leave_out_other_unit(since);
        }
        if !self.quality.is_in_other_unit() {
            if !self.quality.is_accepted(Suspicion::Fall) {
                events.extend(self.record.find_reset(time));
            }
            let level = self.level();
            let judged = (self.quality).judge_sensor(&mut self.record, policy, level, time);
            events.extend(judged);
        }
        let doubts = (self.quality).suspect(&self.record, source, time, phase.holds_scale);
        events.extend(doubts);
        events
    }

    /// After a reading of `time`, the newest being that of `newest`: a refit where one is due now; where not, thresholds and
    /// the site's own rules act by themselves.
    fn judge_where_due(
        &mut self,
        policy: &Policy,
        taken: Taken,
        time: Timestamp,
        newest: Timestamp,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let waits_for_batch = context.phase.in_batches && taken != Taken::Newest;
        if waits_for_batch {
            self.pending.note_unjudged_late();
        }
        // Until all of them have come the record is half as it was and half corrected: what it shows together no slope did.
        if context.phase.is_past || waits_for_batch {
            return Vec::new();
        }
        if self.quality.is_stuck()
            || !self.is_refit_due(policy, taken, time)
            || context.phase.is_queue && self.waits(policy, newest)
        {
            let beside = beside(&self.record, &self.forecaster, &self.quality);
            let raised = self.alarm.raise(beside, policy, newest);
            return raised.into_iter().collect();
        }
        self.judge(policy, newest, context)
    }

    fn is_refit_due(&mut self, policy: &Policy, taken: Taken, time: Timestamp) -> bool {
        let observations = self.record.observations();
        (self.forecaster).is_refit_due(policy, observations, taken, time)
    }

    /// What follows from the readings as they are now.
    fn judge(&mut self, policy: &Policy, time: Timestamp, context: &StepContext<'_>) -> Vec<Event> {
        let forecast = self.forecast(policy, context);
        self.judge_by(policy, time, forecast, context)
    }

    fn forecast(&mut self, policy: &Policy, context: &StepContext<'_>) -> Option<Forecast> {
        let critical = policy.critical_velocity_mm_per_day;
        let history = self.record.history();
        self.forecaster.forecast(history, critical, context)
    }

    fn judge_by(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<Forecast>,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        self.pending.mark_judged();
        let mut events = Vec::new();
        if let Some(forecast) = &forecast {
            events.extend(self.refit(policy, time, forecast));
            let record = &self.record;
            if let Some(event) = self.forecaster.watch(record, time, forecast, context) {
                let cause = AlertCause::UnexplainedResidual;
                self.alarm.note_cause(policy, time, cause);
                events.push(event);
            }
        }
        self.decide(policy, time, forecast, &mut events);
        events
    }

    fn refit(&mut self, policy: &Policy, time: Timestamp, forecast: &Forecast) -> Vec<Event> {
        let (events, causes) = self.changes.refit(&self.record, policy, time, forecast);
        for cause in causes {
            self.alarm.note_cause(policy, time, cause);
        }
        events
    }

    fn decide(
        &mut self,
        policy: &Policy,
        time: Timestamp,
        forecast: Option<Forecast>,
        events: &mut Vec<Event>,
    ) {
        let beside = beside(&self.record, &self.forecaster, &self.quality);
        self.alarm.decide(beside, policy, time, forecast, events);
    }

    /// Goes by other declarations from here on, and looks again at the readings that it has where they concern some.
    pub(super) fn redeclare(
        &mut self,
        policy: &Policy,
        declared: Declarations,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let Some(changed) = self.record.redeclare(declared) else {
            return Vec::new();
        };
        let (time, mut events) = (changed.time, changed.events);
        if !changed.is_other || self.quality.is_stuck() {
            return events;
        }
        if let Some(forecast) = self.forecast(policy, context) {
            events.extend(self.refit(policy, time, &forecast));
            self.decide(policy, time, Some(forecast), &mut events);
        }
        events
    }

    /// The benchmark is no longer watched: what is in force at it ends.
    pub(super) fn close(&mut self, now: Timestamp, why: &str) -> Vec<Event> {
        let mut events = (self.quality).ends_all_unknown(&mut self.record, now, why);
        events.extend(self.alarm.removed(&self.record, now, why.to_owned()));
        events
    }

    /// What is in force at `former` goes on: the readings of the same benchmark, which mean something else from here on.
    pub(super) fn follow_on(&mut self, mut former: Self, now: Timestamp, why: &str) -> Vec<Event> {
        self.alarm.follow_on(former.alarm);
        (former.quality).ends_all_unknown(&mut former.record, now, why)
    }

    /// Whether the level in force would have been another one, had everything come in time.
    pub(super) fn look_back(&mut self, policy: &Policy, time: Timestamp) -> Option<Event> {
        self.pending.look_back(&self.record, policy, time)
    }

    /// Ends the level in force, because people say so. What is known of the slope stays.
    pub(super) fn resolve(&mut self, now: Timestamp, given: &Given) -> Option<Event> {
        self.alarm.resolve(&self.record, now, given)
    }

    /// Goes by other suspicions that people have looked into.
    pub(super) fn accept(&mut self, now: Timestamp, accepted: BTreeSet<Suspicion>) -> Vec<Event> {
        self.quality.accept(&self.record, now, accepted)
    }

    /// Goes by another policy from here on. A rule that the config has changed begins again, though it has the same name, and the newest
    /// reading is judged by the policy as it is now.
    pub(super) fn change_policy(
        &mut self,
        before: &Policy,
        now: &Policy,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        self.alarm.forget_changed_rules(before, now);
        let Some(newest) = self.record.newest() else {
            return Vec::new();
        };
        if context.phase.is_past || self.quality.is_stuck() {
            return Vec::new();
        }
        if now.forecasts_otherwise(before) {
            return self.judge(now, newest, context);
        }
        let beside = beside(&self.record, &self.forecaster, &self.quality);
        let raised = (self.alarm).raise_by_change(beside, before, now, newest);
        raised.into_iter().collect()
    }

    pub(super) fn level(&self) -> Level {
        self.alarm.level()
    }

    /// The newest forecast, while a level is in force.
    pub(super) fn kept_forecast(&self) -> Option<&KeptForecast> {
        self.alarm.kept_forecast()
    }

    /// Rates of the whole record, and `now` on its clock, days.
    pub(super) fn rates_at(&self, now: Timestamp) -> (Vec<Rate>, f64) {
        self.record.rates_at(now)
    }

    /// Whether something that came late is still to be looked back on.
    pub(super) fn has_look_back(&self) -> bool {
        self.pending.has_look_back()
    }

    /// Whether nothing can be said of it now.
    pub(super) fn is_unknown(&self) -> bool {
        self.quality.is_unknown() || self.record.is_silent()
    }
}

/// What a level rests on beside the forecast.
fn beside<'a>(
    record: &'a BenchmarkRecord,
    forecaster: &Forecaster,
    quality: &DataQuality,
) -> BesideForecast<'a> {
    BesideForecast {
        record,
        has_effect: forecaster.has_effect(),
        shows_motion: quality.shows_motion(),
    }
}

#[cfg(test)]
mod fixture;
