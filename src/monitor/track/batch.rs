//! Readings that are not judged as they come: of a batch those that were late, of a queue the newest when it ends, and one in an
//! evacuation time at least where orange is possible.

use super::{Phase, Prepared, StepContext, Track};
use crate::alert::{Level, Policy, to_the_next_reading};
use crate::fit::Observations;
use crate::forecast::{Indicators, of_motion};
use crate::monitor::event::Event;
use crate::monitor::history::{MeasuredAs, Taken};
use crate::reading::{Reading, Timestamp, days_of};

impl Track {
    /// Everything that came together has been taken: judges what of it came late, or queued.
    pub(in crate::monitor) fn judge_batch(
        &mut self,
        policy: &Policy,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        let is_due = self.pending.has_unjudged();
        let Some(time) = self.record.newest().filter(|_| is_due) else {
            return Vec::new();
        };
        if self.quality.is_stuck() {
            self.pending.mark_judged();
            return Vec::new();
        }
        let mut events = self.judge(policy, time, context);
        self.forecaster.forget_prepared();
        self.pending.hold_back(&mut events);
        events
    }

    /// As [`Track::judge_batch`] while more of what came together is to be read: nothing where some of it came late.
    pub(in crate::monitor) fn judge_within_batch(
        &mut self,
        policy: &Policy,
        context: &StepContext<'_>,
    ) -> Vec<Event> {
        if self.pending.has_unjudged_late() {
            return Vec::new();
        }
        self.judge_batch(policy, context)
    }

    /// Whether a reading of a queue is judged later: not where the first that was not lies an evacuation time back, unless
    /// what moved since then can call nothing that people act on.
    pub(super) fn waits(&mut self, policy: &Policy, time: Timestamp) -> bool {
        self.pending.queue(time);
        if !self.pending.is_long_queued(policy, time) {
            return true;
        }
        let is_quiet = self.is_quiet(policy, self.record.observations());
        if is_quiet {
            self.pending.queue_anew(time);
        }
        is_quiet
    }

    /// Whether no level is in force and a forecast after `observations` could call neither orange nor red, whatever it
    /// expects.
    fn is_quiet(&self, policy: &Policy, observations: &Observations) -> bool {
        if self.level() > Level::Green
            || self.forecaster.has_known_load()
            || !policy.rules.is_empty()
        {
            return false;
        }
        Indicators::of(&of_motion(observations)).is_some_and(|shown| {
            let red = to_the_next_reading(policy.red_within(), shown.to_next_days());
            !shown.may_reach(days_of(red), policy.red_chance)
                && !shown.may_reach(days_of(policy.outlook), policy.orange_chance)
        })
    }

    /// Whether a reading of a queue is still to be judged.
    pub(in crate::monitor) fn is_queued(&self) -> bool {
        self.pending.is_queued()
    }

    /// Whether a reading of `time` is judged when it is taken, if it is the newest.
    pub(in crate::monitor) fn may_judge(
        &self,
        policy: &Policy,
        time: Timestamp,
        phase: Phase,
    ) -> bool {
        !phase.is_past && (!phase.is_queue || self.pending.is_long_queued(policy, time))
    }

    /// Computes what a refit after `next`, or after the newest reading, will need; nothing where no refit is to be expected.
    pub(in crate::monitor) fn prepare(
        &self,
        policy: &Policy,
        next: Option<(MeasuredAs, &Reading)>,
        context: &StepContext<'_>,
    ) -> Prepared {
        let critical = policy.critical_velocity_mm_per_day;
        let Some((source, reading)) = next else {
            let history = self.record.history();
            return self.forecaster.compute(history, critical, context);
        };
        let mut history = self.record.history().clone();
        let is_newest = history.take(source, reading) == Taken::Newest;
        let readings = &history.observations;
        if is_newest
            && self.forecaster.awaits_refit(policy, reading.time, readings)
            && !(context.phase.is_queue && self.is_quiet(policy, readings))
        {
            return self.forecaster.compute(&history, critical, context);
        }
        Prepared::default()
    }

    /// What has been computed for the next reading.
    pub(in crate::monitor) fn keep(&mut self, prepared: Prepared) {
        self.forecaster.keep(prepared);
    }
}
