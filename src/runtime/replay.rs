//! Recorded readings through the daemon's own site, in data time: the wall clock decides nothing.

use super::clock;
use super::deliver::{Dispatcher, Retry};
use super::delivered::Delivered;
use super::hook::Status;
use super::shutdown::Shutdown;
use super::site::{Counts, Sinks, Site};
use super::tail::Arrival;
use super::workers::AllCores;
use crate::config::HookConfig;
use crate::monitor::{Event, Input, Monitor, Settings};
use crate::reading::{Channel, Recording, Timestamp};
use crate::store::{Store, StoreError};
use std::io;
use std::time::Duration;

/// The longest wait, about thirty years: as good as one that no duration can hold.
const LONGEST_WAIT: Duration = Duration::from_secs(1_000_000_000);
/// How long the hooks may take to finish after the last reading.
const DRAIN_LIMIT: Duration = Duration::from_secs(600);

/// How fast data time goes by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ReplayPace {
    /// As fast as the monitor works.
    Max,
    /// So many seconds of data a second, a finite number above zero.
    Times(f64),
}

/// What a replay is to do.
#[derive(Debug, Clone, Copy)]
pub struct ReplayPlan<'a> {
    /// What hooks call the site.
    pub site: &'a str,
    /// The monitor's.
    pub settings: &'a Settings,
    /// The hooks to run, as an exercise.
    pub hooks: &'a [HookConfig],
    /// How fast.
    pub pace: ReplayPace,
    /// Where in data time to stop; the end of the recording if that comes first.
    pub until: Option<Timestamp>,
}

/// Why a replay did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    /// The recording begins later than the replay is to stop.
    #[error("no reading up to {until}: expected a time at or after the first one, {first}")]
    NothingUntil {
        /// Where it was to stop.
        until: Timestamp,
        /// The first reading.
        first: Timestamp,
    },
    /// The events could not be written.
    #[error("cannot write the events: {0}")]
    Output(#[from] io::Error),
    /// The state could not be read.
    #[error("{0}")]
    State(#[from] StoreError),
    /// It was asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// Hooks did not take what they were given.
    #[error("the replay is complete, but its hooks did not take every alert (the log says which)")]
    Undelivered,
}

/// Everything in `recording` as it would have arrived: by [`Arrival::rank`].
pub fn arrivals(recording: &Recording) -> Vec<Arrival> {
    let samples = recording.channels.iter().flat_map(|channel| {
        channel.samples.iter().map(|sample| Arrival {
            time: sample.time,
            input: Input::Sample {
                channel: channel.name.clone(),
                unit: channel.unit.clone(),
                sample: *sample,
            },
        })
    });
    let readings = recording.series.iter().flat_map(|series| {
        series.readings.iter().map(|reading| Arrival {
            time: reading.time,
            input: Input::Reading {
                benchmark: series.benchmark.clone(),
                unit: series.unit,
                averaging: series.averaging,
                reading: *reading,
            },
        })
    });
    let mut arrivals: Vec<Arrival> = samples.chain(readings).collect();
    arrivals.sort_by(|one, other| one.rank().cmp(&other.rank()));
    arrivals
}

/// The settings, and what is stated of the recording's covariates.
fn with_stated(settings: &Settings, recording: &Recording) -> Settings {
    let mut settings = settings.clone();
    let stated = |channel: &Channel| Some((channel.name.clone(), channel.stated?));
    let stated = recording.channels.iter().filter_map(stated);
    settings.covariates.extend(stated);
    settings
}

/// Plays `recording` and hands every event to `each`, the summary last; needs a multi-threaded
/// tokio runtime where there are hooks. Neither the pace nor the hooks change the events, and those
/// up to `plan.until` are the beginning of those of the whole recording.
///
/// # Errors
/// [`ReplayError`].
pub async fn replay(
    recording: &Recording,
    plan: &ReplayPlan<'_>,
    mut shutdown: Shutdown,
    each: &mut (dyn FnMut(&Event) -> io::Result<()> + '_),
) -> Result<Counts, ReplayError> {
    let arrivals = arrivals(recording);
    let (Some(first), Some(last)) = (arrivals.first(), arrivals.last()) else {
        return Ok(Counts::default());
    };
    let end = plan.until.map_or(last.time, |until| until.min(last.time));
    if end < first.time {
        let (until, first) = (end, first.time);
        return Err(ReplayError::NothingUntil { until, first });
    }
    let settings = with_stated(plan.settings, recording);
    let mut site = Site::new(plan.site, settings, sinks(plan.hooks));
    let started = clock::later(Duration::ZERO);
    let mut prepared = 0;
    for (number, arrival) in arrivals.iter().enumerate() {
        if arrival.time > end {
            break;
        }
        if let Some(wait) = wait(plan.pace, first.time, arrival.time) {
            tokio::select! {
                () = tokio::time::sleep_until(started + wait) => {}
                () = shutdown.requested() => {}
            }
        }
        if shutdown.is_requested() {
            return Err(ReplayError::Interrupted);
        }
        if prepared == 0 {
            prepared = site.prepare(&arrivals[number..]);
        }
        prepared -= 1;
        report_each(&site.take(arrival, arrival.time)?, each)?;
        site.commit(arrival.time)?;
    }
    report_each(&site.pass(end), each)?;
    site.commit(end)?;
    let (summary, counts) = (site.summary(), site.counts());
    let lost = site.close(end, DRAIN_LIMIT).await?;
    report_each(summary.as_slice(), each)?;
    match lost {
        Some(0) => Ok(counts),
        Some(_) | None => Err(ReplayError::Undelivered),
    }
}

/// Plays what a daemon took in, in the order in which it did: every value, every passage of time, every finding of
/// a search and every change of its settings. The events are the daemon's own, the summary last. Under `settings` they are
/// those that it would have said with these in place of its own. `progress` receives the share of the steps that is
/// done, 0 to 1.
///
/// # Errors
/// [`ReplayError`].
pub fn replay_state(
    store: &Store,
    settings: Option<&Settings>,
    until: Option<Timestamp>,
    shutdown: &Shutdown,
    progress: &mut dyn FnMut(f64),
    each: &mut (dyn FnMut(&Event) -> io::Result<()> + '_),
) -> Result<(), ReplayError> {
    let steps = store.last_step().max(1) as f64;
    let mut monitor = Monitor::new(settings.cloned().unwrap_or_default());
    let mut after = 0;
    'all: loop {
        let mut rows = store.steps(after)?;
        for row in &mut rows {
            if let (Input::Settings(held), Some(settings)) = (&mut row.input, settings) {
                **held = settings.clone();
            }
        }
        let Some(last) = rows.last() else { break };
        after = last.seq;
        let mut prepared = 0;
        for (number, row) in rows.iter().enumerate() {
            if until.is_some_and(|until| row.now > until) {
                break 'all;
            }
            if shutdown.is_requested() {
                return Err(ReplayError::Interrupted);
            }
            if prepared == 0 {
                let next = rows[number..].iter().map(|row| &row.input);
                prepared = monitor.prepare(next, &AllCores);
            }
            prepared -= 1;
            report_each(&monitor.step(row.now, &row.input), each)?;
            progress(row.seq as f64 / steps);
            // Their findings are among the steps.
            monitor.searches();
        }
    }
    report_each(monitor.summary().as_slice(), each)
}

fn report_each(
    events: &[Event],
    each: &mut (dyn FnMut(&Event) -> io::Result<()> + '_),
) -> Result<(), ReplayError> {
    Ok(events.iter().try_for_each(each)?)
}

/// Nothing is kept: what a replay says and sends is its output.
fn sinks(hooks: &[HookConfig]) -> Sinks {
    let start = || Dispatcher::start(hooks, &Retry::default(), Delivered::default());
    Sinks {
        store: None,
        alerts: (!hooks.is_empty()).then(start),
        status: Status::Exercise,
    }
}

/// How long after the start `time` is due; `None` for at once.
pub(super) fn wait(pace: ReplayPace, first: Timestamp, time: Timestamp) -> Option<Duration> {
    let ReplayPace::Times(times) = pace else {
        return None;
    };
    let seconds = time.duration_since(first).as_secs_f64() / times;
    let wait = Duration::try_from_secs_f64(seconds).unwrap_or(LONGEST_WAIT);
    Some(wait.min(LONGEST_WAIT))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::{BenchmarkId, Reading, Sample, Series, Unit};

    fn at(second: i64) -> Timestamp {
        Timestamp::from_second(second).unwrap()
    }

    fn series(benchmark: &str, seconds: &[i64]) -> Series {
        let reading = |&second: &i64| Reading {
            time: at(second),
            value: 1.0,
            sigma: None,
        };
        Series {
            benchmark: BenchmarkId::new(benchmark),
            unit: Unit::MM,
            averaging: None,
            readings: seconds.iter().map(reading).collect(),
        }
    }

    #[test]
    fn values_come_by_time_then_covariates_first_then_by_benchmark() {
        let recording = Recording {
            series: vec![series("a", &[1, 3]), series("b", &[1, 2, 3])],
            channels: vec![Channel {
                name: "rain_mm".to_owned(),
                unit: None,
                stated: None,
                samples: vec![Sample {
                    time: at(3),
                    value: 0.0,
                }],
            }],
            ..Recording::default()
        };
        let name = |arrival: &Arrival| arrival.input.series_name().to_owned();
        let names: Vec<String> = arrivals(&recording).iter().map(name).collect();
        assert_eq!(names, ["a", "b", "b", "rain_mm", "a", "b"]);
    }

    #[test]
    fn the_pace_divides_data_time() {
        assert_eq!(wait(ReplayPace::Max, at(0), at(100)), None);
        let tenth = wait(ReplayPace::Times(10.0), at(0), at(100));
        assert_eq!(tenth, Some(Duration::from_secs(10)));
        let slowest = wait(ReplayPace::Times(1e-300), at(0), at(100));
        assert_eq!(slowest, Some(LONGEST_WAIT));
    }
}
