//! What was said beside the readings, as MCAP: fits, forecasts, levels, alerts, a log.
//!
//! Readings stand as in any recording, so that the file can be replayed again. A replay writes one file at its end, a
//! daemon file after file while it works (`live`); both by the same writer (`topics`).

mod files;
mod level_now;
pub mod live;
mod messages;
mod schemas;
mod topics;

use super::ingest::{IngestError, write_mcap_by};
use crate::monitor::{Event, Input, Measured};
use crate::reading::{BenchmarkId, Channel, Quantity, Recording, Series, Timestamp};
use crate::runtime::replay::arrivals;
use crate::store::{Store, StoreError};
use level_now::LevelsNow;
use std::collections::BTreeMap;
use std::path::Path;
use topics::TopicWriter;

/// Writes `recording` and the `events` that followed from it into `file`; `words` gives an event's line for a person.
///
/// # Errors
/// As [`super::ingest::write_mcap`].
pub fn write(
    file: &Path,
    recording: &Recording,
    events: &[Event],
    words: &dyn Fn(&Event) -> String,
) -> Result<(), IngestError> {
    let values = arrivals(recording);
    // A daemon judges what is current before the past.
    let mut events: Vec<&Event> = events.iter().collect();
    events.sort_by_key(|event| event.time);
    let times = values.first().map(|one| one.time).into_iter();
    let first = times.chain(events.first().map(|event| event.time)).min();
    let first = first.unwrap_or_default();
    write_mcap_by(file, |out| {
        let mut writer = TopicWriter::create(out, first, &recording.provenance)?;
        let (mut levels, mut events) = (LevelsNow::default(), events.into_iter().peekable());
        for value in &values {
            while let Some(event) = events.next_if(|event| event.time < value.time) {
                writer.event(event, &words(event), &mut levels)?;
            }
            if let Some(measured) = value.input.measured() {
                writer.measured(&measured, &levels)?;
            }
        }
        for event in events {
            writer.event(event, &words(event), &mut levels)?;
        }
        writer.finish()
    })
}

/// Everything measured that a daemon took in, up to `until`.
///
/// # Errors
/// [`StoreError`].
pub fn taken_in(store: &Store, until: Option<Timestamp>) -> Result<Recording, StoreError> {
    let mut series: BTreeMap<(BenchmarkId, Quantity), Series> = BTreeMap::new();
    let mut channels: BTreeMap<String, Channel> = BTreeMap::new();
    let mut after = 0;
    loop {
        let rows = store.steps(after)?;
        let Some(last) = rows.last() else { break };
        after = last.seq;
        for row in rows {
            if until.is_none_or(|until| row.now <= until) {
                take(&row.input, &mut series, &mut channels);
            }
        }
    }
    let mut recording = Recording {
        series: series.into_values().collect(),
        channels: channels.into_values().collect(),
        ..Recording::default()
    };
    for series in &mut recording.series {
        series.put_in_order();
    }
    for channel in &mut recording.channels {
        channel.put_in_order();
    }
    Ok(recording)
}

fn take(
    input: &Input,
    series: &mut BTreeMap<(BenchmarkId, Quantity), Series>,
    channels: &mut BTreeMap<String, Channel>,
) {
    match input.measured() {
        Some(Measured::Reading {
            benchmark,
            unit,
            averaging,
            reading,
        }) => {
            let place = (benchmark.clone(), unit.quantity());
            let one = series.entry(place).or_insert_with(|| Series {
                benchmark: benchmark.clone(),
                unit,
                averaging,
                readings: Vec::new(),
            });
            // A source may have changed its unit; a topic has one.
            let factor = unit.factor() / one.unit.factor();
            let mut reading = *reading;
            if unit != one.unit {
                reading.value *= factor;
                reading.sigma = reading.sigma.map(|sigma| sigma * factor);
            }
            one.readings.push(reading);
        }
        Some(Measured::Sample {
            channel,
            unit,
            sample,
        }) => {
            let one = (channels.entry(channel.to_owned())).or_insert_with_key(|name| Channel {
                name: name.clone(),
                unit: unit.map(str::to_owned),
                stated: None,
                samples: Vec::new(),
            });
            one.samples.push(*sample);
        }
        None => {}
    }
}
