//! What the effects change in the forecast: the outlook of the readings as they are, and by the load's clock.

use super::by_clock::ByClock;
use super::explanation::{Change, ForecastChange};
use super::known_load::KnownLoad;
use crate::fit::Observations;
use crate::forecast::{HORIZON_DAYS, Outlook, outlook};
use crate::reading::{Channel, Series, after_days};
use crate::regime::Regime;

/// How far ahead the chance of a failure is asked for that an explanation gives, days.
pub const EXPLAINED_DAYS: f64 = HORIZON_DAYS;

/// The regimes of m > 1.
const UNSTABLE: [Regime; 2] = [Regime::UnstableAccelerating, Regime::UnstableDecelerating];

/// Before and after, for readings without faults.
pub(super) fn forecast_change(
    series: &Series,
    channels: &[Channel],
    known_load: &KnownLoad,
    critical: f64,
) -> ForecastChange {
    let observations = Observations::of(series);
    let Some(epoch) = series.readings.first().map(|reading| reading.time) else {
        return ForecastChange::default();
    };
    let before = outlook(&observations, critical).map(|(outlook, _)| outlook);
    let after = if known_load.parts.is_empty() {
        before.clone()
    } else {
        let channels: Vec<&Channel> = channels.iter().collect();
        let by_clock = ByClock::new(&observations, epoch, &channels, known_load, None);
        let after = by_clock.and_then(|one| {
            one.outlook(critical, |readings, critical| {
                outlook(readings, critical).map(|(outlook, _)| outlook)
            })
        });
        after
            .zip(before.as_ref())
            .map(|(after, before)| after.beside(before, false))
    };
    let both = |of: &dyn Fn(&Outlook) -> Option<f64>| Change {
        before: before.as_ref().and_then(of),
        after: after.as_ref().and_then(of),
    };
    let median = |outlook: &Option<Outlook>| {
        let outlook = outlook.as_ref()?;
        let days = outlook.collapse.quantile(0.5, HORIZON_DAYS)?;
        after_days(epoch, outlook.now_days + days)
    };
    ForecastChange {
        probability_unstable: both(&|outlook| {
            let unstable = outlook
                .regimes
                .iter()
                .filter(|(regime, _)| UNSTABLE.contains(regime));
            Some(unstable.map(|(_, share)| share).sum())
        }),
        probability_of_failure: both(&|outlook| Some(outlook.collapse.chance_within(HORIZON_DAYS))),
        failure_time: Change {
            before: median(&before),
            after: median(&after),
        },
    }
}
