//! What a report is made of: readings and events, from files by a replay or from a daemon's state.

use super::Args;
use crate::alert::Policy;
use crate::cli::replay;
use crate::config;
use crate::monitor::{Event, Settings, by_time};
use crate::reading::{Channel, Recording, Sample, Timestamp};
use crate::store::{EARLIEST, LATEST, MOST_SHOWN, Store, Values};
use anyhow::Context;
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
    /// Events before this are not listed.
    pub(super) listed_from: Timestamp,
    /// By which it judged.
    pub(super) policy: Policy,
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
        policy,
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
    for id in store.benchmarks()?.into_keys() {
        if args
            .readings
            .benchmark
            .as_deref()
            .is_none_or(|one| one == id.as_str())
        {
            let series = store.series(&wanted(id.as_str(), true, drawn_from))?;
            if !series.readings.is_empty() {
                recording.series.push(series);
            }
        }
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
        |span| format!("from {}", (end - span).strftime("%Y-%m-%d %H:%MZ")),
    );
    Ok(Material {
        title: config.site.name.clone(),
        recording,
        events: events(&store)?,
        listed_from,
        policy: config.settings.policy.clone(),
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
