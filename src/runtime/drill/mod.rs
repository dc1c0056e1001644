//! Drills: from time to time a made-up failure goes the whole way of an alert, from a file to the people who acknowledge it.
//!
//! Each is a site of its own with a state of its own, in the folder `drill` of the site's state: nothing of it reaches the
//! site's monitor, its levels or its replay.

mod exercise;
mod runner;

use super::clock;
use super::drilled::DrillRecord;
use super::shutdown::Shutdown;
use super::vitals::Vitals;
use crate::config::{Config, Drill};
use crate::reading::Timestamp;
use crate::store::Store;
use jiff::SignedDuration;
use jiff::tz::TimeZone;
use std::sync::Arc;
use std::time::Duration;
use tokio::task::JoinSet;

/// How often it is checked whether one is due: the host's clock may be set.
const POLL_INTERVAL: Duration = Duration::from_secs(1);
/// A drill begins a little after it is due: the next one is not put off by a day for that.
const SLACK: SignedDuration = SignedDuration::from_hours(1);

/// What a drill needs of the daemon.
#[derive(Debug)]
struct DrillContext {
    config: Config,
    store: Arc<Store>,
    vitals: Arc<Vitals>,
}

/// Holds drills by `config` from here on; ends with `shutdown`, or when the tasks are dropped.
pub(super) fn start(
    config: &Config,
    store: &Arc<Store>,
    vitals: &Arc<Vitals>,
    shutdown: &Shutdown,
) -> JoinSet<()> {
    let mut tasks = JoinSet::new();
    // Here and not in the task: what is shown of drills stands before the past has been read.
    let held = config.drill.clone().map(|drill| {
        let mut record = DrillRecord::read(&config.site.state_dir)
            .unwrap_or_else(|| DrillRecord::new(clock::now()));
        record.overdue_after = overdue_after(&drill, &record);
        (drill, record)
    });
    let shown = held.as_ref().map(|(_, record)| record.clone());
    vitals.update(|health| health.drill = shown);
    if let Some((drill, record)) = held {
        let context = DrillContext {
            config: config.clone(),
            store: Arc::clone(store),
            vitals: Arc::clone(vitals),
        };
        let mut shutdown = shutdown.clone();
        tasks.spawn(async move {
            let mut asked = shutdown.clone();
            tokio::select! {
                () = asked.requested() => {}
                () = hold(&context, &drill, record, &mut shutdown) => {}
            }
        });
    }
    tasks
}

async fn hold(
    context: &DrillContext,
    drill: &Drill,
    mut record: DrillRecord,
    shutdown: &mut Shutdown,
) {
    let site = &context.config.site;
    loop {
        record.overdue_after = overdue_after(drill, &record);
        keep(context, &record);
        let due = due(drill, &record, clock::now(), &site.time_zone);
        // Before the past has been read nobody is watched, and the machine has other work.
        while clock::now() < due || !context.vitals.health().is_caught_up {
            tokio::time::sleep(POLL_INTERVAL).await;
        }
        tracing::info!("a drill begins");
        record.started = Some(clock::now());
        match Box::pin(exercise::hold(context, drill, shutdown)).await {
            Ok(passed) => record.passes(passed, clock::now()),
            Err(why) => {
                tracing::error!(why, "the drill failed: an alert might not arrive either");
                record.fails(why);
            }
        }
    }
}

/// Shows how drills stand, and keeps it over restarts.
fn keep(context: &DrillContext, record: &DrillRecord) {
    if let Err(error) = record.write(&context.config.site.state_dir) {
        tracing::warn!(%error, "a restart will not know of the last drill");
    }
    let shown = Some(record.clone());
    context.vitals.update(|health| health.drill = shown);
}

/// When the next one begins.
fn due(drill: &Drill, record: &DrillRecord, now: Timestamp, zone: &TimeZone) -> Timestamp {
    let earliest = match record.started {
        Some(started) => started
            .saturating_add(drill.every)
            .unwrap_or(Timestamp::MAX),
        None => now,
    };
    let Some(at) = drill.at else {
        return earliest;
    };
    let slack = if record.started.is_some() {
        SLACK
    } else {
        SignedDuration::ZERO
    };
    let from = earliest.saturating_sub(slack).unwrap_or(earliest).max(now);
    let first = from.to_zoned(zone.clone()).date();
    let days = [
        Some(first),
        first.tomorrow().ok(),
        first.tomorrow().and_then(jiff::civil::Date::tomorrow).ok(),
    ];
    let times = days.into_iter().flatten();
    let mut times = times.filter_map(|day| day.to_datetime(at).to_zoned(zone.clone()).ok());
    times
        .find(|time| time.timestamp() >= from)
        .map_or(earliest, |time| time.timestamp())
}

/// When it is an alarm that none has passed.
fn overdue_after(drill: &Drill, record: &DrillRecord) -> Timestamp {
    let since = record.passed_at.unwrap_or(record.since);
    let slack = if drill.at.is_some() {
        SignedDuration::from_hours(25)
    } else {
        SignedDuration::from_mins(10)
    };
    let longest = drill
        .every
        .saturating_add(drill.every / 2)
        .saturating_add(slack);
    since.saturating_add(longest).unwrap_or(Timestamp::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time(text: &str) -> Timestamp {
        text.parse().unwrap()
    }

    #[test]
    fn a_drill_is_due_at_its_time_of_day_there_and_does_not_drift_by_a_day() {
        let zone = TimeZone::get("Europe/Rome").unwrap();
        let drill = Drill {
            every: SignedDuration::from_hours(7 * 24),
            at: Some(jiff::civil::time(10, 0, 0, 0)),
            acknowledge_within: None,
        };
        let now = time("2026-10-20T09:00:00Z");
        let mut record = DrillRecord::new(now);
        // 10:00 there is over for today.
        let first = due(&drill, &record, now, &zone);
        assert_eq!(first, time("2026-10-21T08:00:00Z"));
        // The summer time ends before the next one.
        record.started = Some(first + SignedDuration::from_secs(3));
        let next = due(&drill, &record, now, &zone);
        assert_eq!(next, time("2026-10-28T09:00:00Z"));
        // The daemon was away at the time: it is held by day all the same.
        let late = time("2026-10-30T02:00:00Z");
        assert_eq!(
            due(&drill, &record, late, &zone),
            time("2026-10-30T09:00:00Z")
        );
        let drill = Drill { at: None, ..drill };
        assert!(due(&drill, &record, late, &zone) < late);
        assert!(overdue_after(&drill, &record) > late);
        assert!(overdue_after(&drill, &record) < late + SignedDuration::from_hours(48));
    }
}
