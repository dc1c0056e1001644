//! What the effects change in the forecast: the outlook of the readings as they are, and by the load's clock.

use super::clock::Clock;
use super::explanation::{Change, ForecastChange};
use super::fuller::Fuller;
use crate::fit::Observations;
use crate::forecast::{HORIZON_DAYS, Outlook, outlook};
use crate::reading::{Channel, Series, Timestamp, after_days};
use crate::regime::Regime;

/// The regimes of m > 1.
const UNSTABLE: [Regime; 2] = [Regime::UnstableAccelerating, Regime::UnstableDecelerating];

/// Before and after, for readings without faults.
pub(super) fn forecast_change(
    series: &Series,
    channels: &[Channel],
    fuller: &Fuller,
    critical: f64,
) -> ForecastChange {
    let observations = Observations::of(series);
    let Some(epoch) = series.readings.first().map(|reading| reading.time) else {
        return ForecastChange::default();
    };
    let before = outlook(&observations, critical).map(|(outlook, _)| outlook);
    let after = if fuller.parts.is_empty() {
        before.clone()
    } else {
        by_clock((&observations, epoch), channels, fuller, critical)
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

/// The outlook by the load's clock, told back by the calendar: run on at the higher of the present pace and the usual.
fn by_clock(
    (observations, epoch): (&Observations, Timestamp),
    channels: &[Channel],
    fuller: &Fuller,
    critical: f64,
) -> Option<Outlook> {
    let channels: Vec<&Channel> = channels.iter().collect();
    let days = Clock::ticks(observations);
    let times: Vec<Timestamp> = days.iter().filter_map(|t| after_days(epoch, *t)).collect();
    let log_load = fuller.log_load(&channels, &times);
    let usual = Clock::new(days.clone(), log_load.clone(), 0.0).usual();
    let clock = Clock::new(days, log_load, usual);
    let read = observations.values.iter();
    let read: Vec<Timestamp> = read
        .filter_map(|value| after_days(epoch, value.t_days))
        .collect();
    let told = clock.told(observations, &fuller.in_reading(&channels, &read));
    let now = clock.log_load().last()? - usual;
    let pace = now.clamp(0.0, Clock::FARTHEST_LOAD).exp();
    let (outlook, _) = outlook(&told, critical / pace)?;
    let mut outlook = outlook.sooner(pace);
    outlook.now_days = observations.values.last()?.t_days;
    Some(outlook)
}
