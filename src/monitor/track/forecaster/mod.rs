//! What one benchmark is forecast to do: by the law, by the law under the load that a search found, and when that is computed.

mod adopted;
mod pace;
mod prepared;
mod watch;

use super::StepContext;
use super::forecast::Forecast;
use crate::forecast::LawForecaster;
use crate::monitor::history::History;
use serde::Serialize;

pub(super) use adopted::Adopted;
pub(super) use pace::Pace;
pub(in crate::monitor) use prepared::Prepared;
pub(super) use watch::Watch;

/// What forecasts of one benchmark go by, beside its readings.
#[derive(Debug, Default, Serialize)]
pub(super) struct Forecaster {
    panel: LawForecaster,
    pace: Pace,
    watch: Watch,
    /// The law under the known load that forecasts and levels go by.
    adopted: Option<Adopted>,
    /// Forecasts computed ahead, for the next reading alone.
    #[serde(skip)]
    prepared: Prepared,
}

impl Forecaster {
    pub(super) fn from_saved(
        panel: LawForecaster,
        pace: Pace,
        watch: Watch,
        adopted: Option<Adopted>,
    ) -> Self {
        Self {
            panel,
            pace,
            watch,
            adopted,
            prepared: Prepared::default(),
        }
    }

    /// What the laws predict after the newest reading.
    pub(super) fn forecast(
        &mut self,
        history: &History,
        critical: f64,
        context: &StepContext<'_>,
    ) -> Option<Forecast> {
        let prepared = &mut self.prepared;
        let by = |readings: &_, critical| prepared.outlook(readings, critical);
        let plain = (self.panel).update_by(&history.observations, critical, by)?;
        let known_load = self.adopted.as_mut().and_then(|adopted| {
            let channels = context.covariates.list();
            adopted.forecast(history, &channels, critical, &plain, prepared)
        });
        Some(Forecast { plain, known_load })
    }

    /// What [`Forecaster::forecast`] will compute of these readings.
    pub(super) fn compute(
        &self,
        history: &History,
        critical: f64,
        context: &StepContext<'_>,
    ) -> Prepared {
        let mut prepared = Prepared::default();
        prepared.compute(&history.observations, critical);
        if let Some(adopted) = &self.adopted {
            adopted.prepare(history, &context.covariates.list(), critical, |of, at| {
                prepared.compute(of, at);
            });
        }
        prepared
    }

    /// Keeps what has been computed for the next reading.
    pub(super) fn keep(&mut self, prepared: Prepared) {
        self.prepared = prepared;
    }

    /// The reading for which something was computed has been judged.
    pub(super) fn forget_prepared(&mut self) {
        self.prepared = Prepared::default();
    }

    /// One more newest reading has been taken.
    pub(super) fn count_reading(&mut self) {
        self.watch.count();
    }

    /// Whether the newest search has found an effect.
    pub(super) fn has_effect(&self) -> bool {
        self.watch.has_effect()
    }

    /// Whether forecasts go by a law under a known load.
    pub(super) fn has_known_load(&self) -> bool {
        self.adopted.is_some()
    }

    /// Goes on as the one that went through the past, which knew no effects.
    pub(super) fn go_on_from(&mut self, past: Self) {
        (self.panel, self.pace) = (past.panel, past.pace);
    }
}
