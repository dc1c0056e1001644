//! Forecasts that are computed before the reading they rest on is taken.

use super::super::history::{MeasuredAs, Taken};
use super::{Phase, StepContext, Track};
use crate::alert::Policy;
use crate::fit::{Ensemble, Observations};
use crate::forecast::{self, Outlook};
use crate::reading::{Reading, Timestamp};

type ComputedOutlook = Option<(Outlook, Option<Ensemble>)>;

/// What has been computed: of which readings, for which critical velocity, with what result. One under a constant load, and
/// one by the clock of a known load where there is one.
#[derive(Debug, Default)]
pub(in crate::monitor) struct Prepared(Vec<(Observations, f64, ComputedOutlook)>);

impl Prepared {
    /// What `observations` give, computed now where it has not been.
    pub(super) fn outlook(
        &mut self,
        observations: &Observations,
        critical: f64,
    ) -> ComputedOutlook {
        let is_it = |(of, at, _): &(Observations, f64, ComputedOutlook)| {
            at.to_bits() == critical.to_bits() && of == observations
        };
        match self.0.iter().position(is_it) {
            Some(found) => self.0.swap_remove(found).2,
            None => forecast::outlook(observations, critical),
        }
    }

    fn compute(&mut self, observations: &Observations, critical: f64) {
        let result = forecast::outlook(observations, critical);
        self.0.push((observations.clone(), critical, result));
    }
}

impl Track {
    /// Whether a reading of `time` is judged when it is taken, if it is the newest.
    pub(in crate::monitor) fn may_judge(
        &self,
        policy: &Policy,
        time: Timestamp,
        phase: Phase,
    ) -> bool {
        !phase.is_past && (!phase.is_queue || self.is_long_queued(policy, time))
    }

    /// Computes what a refit after `next`, or after the newest reading, will need; nothing where no refit is to be expected.
    pub(in crate::monitor) fn prepare(
        &self,
        policy: &Policy,
        next: Option<(MeasuredAs, &Reading)>,
        context: &StepContext<'_>,
    ) -> Prepared {
        let mut prepared = Prepared::default();
        let critical = policy.critical_velocity_mm_per_day;
        let Some((source, reading)) = next else {
            self.prepare_from(&self.history, critical, context, &mut prepared);
            return prepared;
        };
        let mut history = self.history.clone();
        let is_newest = history.take(source, reading) == Taken::Newest;
        let readings = &history.observations;
        if is_newest
            && self.awaits_refit(policy, reading.time, readings)
            && !(context.phase.is_queue && self.is_quiet(policy, readings))
        {
            self.prepare_from(&history, critical, context, &mut prepared);
        }
        prepared
    }

    fn prepare_from(
        &self,
        history: &super::History,
        critical: f64,
        context: &StepContext<'_>,
        prepared: &mut Prepared,
    ) {
        prepared.compute(&history.observations, critical);
        if let Some(adopted) = &self.adopted {
            adopted.prepare(history, &context.covariates.list(), critical, |of, at| {
                prepared.compute(of, at);
            });
        }
    }

    /// What has been computed for the next reading.
    pub(in crate::monitor) fn keep(&mut self, prepared: Prepared) {
        self.prepared = prepared;
    }
}
