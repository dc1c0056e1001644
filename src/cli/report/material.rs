//! What a report is made of: readings and events, from files by a replay or from a daemon's state.

use super::Args;
use crate::alert::Policy;
use crate::cli::{replay, text};
use crate::config;
use crate::monitor::{Event, Settings, by_time};
use crate::reading::{BenchmarkId, Channel, Recording, Sample, Series, TimeSpan, Timestamp};
use crate::runtime::clock;
use crate::store::{EARLIEST, LATEST, MOST_SHOWN, Store, Values};
use anyhow::Context;
use jiff::tz::TimeZone;
use std::collections::BTreeSet;
use std::path::Path;

/// Before the stretch that is reported, its figures show so many times its length.
const BEFORE: i32 = 4;

/// All that a report says something about.
#[derive(Debug)]
pub(super) struct Material {
    /// Its title.
    pub(super) title: String,
    /// Readings and covariates.
    pub(super) recording: Recording,
    /// What the monitor said, by the times that it is of.
    pub(super) events: Vec<Event>,
    /// Events before this are not listed, and hours before it not counted.
    pub(super) listed_from: Timestamp,
    /// Of a state: its newest reading, or now while a daemon works on it; benchmarks may have fallen silent before. Of files each series ends
    /// where it does.
    pub(super) until: Option<Timestamp>,
    /// By which it judged.
    pub(super) policy: Policy,
    /// By whose clocks times are shown.
    pub(super) zone: TimeZone,
    /// Where it comes from, as (what, which).
    pub(super) sources: Vec<(String, String)>,
}

impl Material {
    /// The newest reading.
    pub(super) fn end(&self) -> Timestamp {
        let series = self.recording.series.iter();
        let newest = series
            .filter_map(|one| one.readings.last())
            .max_by_key(|one| one.time);
        newest.map_or(Timestamp::UNIX_EPOCH, |one| one.time)
    }

    /// From the first reading of `series`, or the first event where it has none, to the end of what is known of it.
    pub(super) fn known(&self, series: &Series) -> TimeSpan {
        let own = series.span();
        let to = self.until.or(own.map(|own| own.to)).unwrap_or_default();
        let first = own.map(|own| own.from);
        let events = self.events.iter();
        let mut own_events = events.filter(|one| one.benchmark.as_ref() == Some(&series.benchmark));
        let from = match (self.until, own_events.next()) {
            // The readings of a state may be drawn from later on.
            (Some(_), Some(event)) => first.map_or(event.time, |first| first.min(event.time)),
            (Some(_), None) => first.unwrap_or(self.listed_from),
            (None, _) => first.unwrap_or(to),
        };
        TimeSpan::new(from.min(to), to)
    }

    /// The part of that which is reported.
    pub(super) fn reported(&self, series: &Series) -> TimeSpan {
        let known = self.known(series);
        TimeSpan::new(known.from.max(self.listed_from).min(known.to), known.to)
    }

    /// A time to the minute, as it is shown.
    pub(super) fn shown(&self, time: Timestamp) -> String {
        text::clock(time, &self.zone)
    }
}

/// From files, by a replay of them.
pub(super) fn of_files(args: &Args) -> anyhow::Result<Material> {
    let mut recording = args.readings.load()?.recording;
    args.readings.narrow(&mut recording)?;
    let policy = args.readings.policy(&Policy::default());
    let settings = Settings {
        policy: policy.clone(),
        ..Settings::default()
    };
    let events = replay::events(&recording, &settings, None)?;
    let name = |file: &Path| {
        file.file_name()
            .map(|name| name.to_string_lossy().into_owned())
    };
    let files: Vec<String> = args
        .readings
        .files
        .iter()
        .filter_map(|file| name(file))
        .collect();
    let title = recording.provenance.get("title").cloned();
    Ok(Material {
        title: title.unwrap_or_else(|| files.join(", ")),
        events,
        listed_from: EARLIEST,
        until: None,
        policy,
        zone: TimeZone::UTC,
        sources: vec![
            ("files".to_owned(), files.join(", ")),
            (
                "levels and forecasts".to_owned(),
                "of a replay of these files".to_owned(),
            ),
        ],
        recording,
    })
}

/// From the state of a site: what its daemon read and said.
pub(super) fn of_state(args: &Args, file: &Path) -> anyhow::Result<Material> {
    let config = config::load(file)?;
    let folder = &config.site.state_dir;
    let store = Store::look(folder)
        .with_context(|| format!("cannot read the state in {}", folder.display()))?;
    let end = store.span(None)?.map_or(LATEST, |span| span.to);
    let since = |spans: i32| {
        let span = args.last.and_then(|span| span.checked_mul(spans));
        let from = span.and_then(|span| end.checked_sub(span).ok());
        from.unwrap_or(EARLIEST).max(EARLIEST)
    };
    let listed_from = since(1);
    let drawn_from = since(1 + BEFORE);
    let mut recording = Recording::default();
    // Those that have fallen silent, or never read, too.
    let declared = config.benchmarks.iter().map(|one| one.id.clone());
    let all: BTreeSet<BenchmarkId> = store.benchmarks()?.into_keys().chain(declared).collect();
    let is_asked = |id: &BenchmarkId| {
        let asked = args.readings.benchmark.as_deref();
        asked.is_none_or(|one| one == id.as_str())
    };
    for id in all.iter().filter(|id| is_asked(id)) {
        recording
            .series
            .push(store.series(&wanted(id.as_str(), true, drawn_from))?);
    }
    for (name, unit) in store.channels()? {
        let samples = store.values(&wanted(&name, false, drawn_from))?;
        let samples = samples.into_iter().map(|one| Sample {
            time: one.time,
            value: one.value,
        });
        let samples = samples.collect();
        let stated = config.settings.covariates.get(&name).copied();
        recording.channels.push(Channel {
            name,
            unit,
            stated,
            samples,
        });
    }
    let span = args.last.map_or_else(
        || "all of its data".to_owned(),
        |span| format!("from {}", text::clock(end - span, &config.site.time_zone)),
    );
    Ok(Material {
        title: config.site.name.clone(),
        recording,
        events: events(&store)?,
        listed_from,
        until: Some(if Store::is_held(folder) {
            clock::now().max(end)
        } else {
            end
        }),
        policy: config.settings.policy.clone(),
        zone: config.site.time_zone.clone(),
        sources: vec![
            ("state of the daemon".to_owned(), span),
            (
                "levels and forecasts".to_owned(),
                "as the daemon said them at the time".to_owned(),
            ),
        ],
    })
}

fn wanted(name: &str, is_reading: bool, from: Timestamp) -> Values<'_> {
    Values {
        name,
        is_reading,
        from,
        to: LATEST,
        known: LATEST,
        most: MOST_SHOWN,
    }
}

fn events(store: &Store) -> anyhow::Result<Vec<Event>> {
    let (mut events, mut after) = (Vec::new(), 0);
    loop {
        let chunk = store.events(after, None, None)?;
        let Some((last, _)) = chunk.last() else {
            return Ok(by_time(events));
        };
        after = *last;
        for (_, body) in &chunk {
            events.push(serde_json::from_str(body)?);
        }
    }
}
