//! Writes a recording as NDJSON: a message a line, in the order of time. Provenance has no place in it.

use super::IngestError;
use super::names::channel_unit;
use crate::reading::{Reading, Recording, Timestamp};
use serde::Serialize;
use std::io::{self, Write};

/// One line.
#[derive(Debug, Serialize)]
struct NdjsonLine<'a> {
    #[serde(skip_serializing_if = "Option::is_none")]
    benchmark: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    channel: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    quantity: Option<&'static str>,
    time: Timestamp,
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    unit: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    sigma: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    averaging_s: Option<f64>,
}

/// Writes NDJSON, every number so that it reads back bit for bit.
///
/// # Errors
/// [`IngestError::Unwritable`] for a value that is not finite and for a name that is empty;
/// [`IngestError::Write`] when `out` fails.
pub fn write_ndjson(recording: &Recording, mut out: impl Write) -> Result<(), IngestError> {
    let mut messages: Vec<NdjsonLine<'_>> = messages(recording).collect();
    for message in &messages {
        let name = message.benchmark.or(message.channel).unwrap_or_default();
        let row = Reading {
            time: message.time,
            value: message.value,
            sigma: message.sigma,
        };
        if !row.is_sound() || name.trim().is_empty() {
            return Err(IngestError::Unwritable {
                name: name.to_owned(),
                problem: "a value that is not finite, or no name",
                expected: "finite values, standard errors above zero, and a name",
            });
        }
    }
    // Stable: what has one time keeps its order.
    messages.sort_by_key(|message| message.time);
    let fail = |source: io::Error| IngestError::Write {
        file: "the NDJSON output".into(),
        source,
    };
    for message in messages {
        let line = serde_json::to_string(&message).map_err(|error| fail(error.into()))?;
        writeln!(out, "{line}").map_err(fail)?;
    }
    out.flush().map_err(fail)
}

fn messages(recording: &Recording) -> impl Iterator<Item = NdjsonLine<'_>> {
    let readings = recording.series.iter().flat_map(|series| {
        series.readings.iter().map(|reading| NdjsonLine {
            benchmark: Some(series.benchmark.as_str()),
            channel: None,
            quantity: Some(series.quantity().name()),
            time: reading.time,
            value: reading.value,
            unit: Some(series.unit.to_string()),
            sigma: reading.sigma,
            averaging_s: series.averaging.map(|span| span.as_secs_f64()),
        })
    });
    let samples = recording.channels.iter().flat_map(|channel| {
        // Where the name says it, it need not be said again with every value.
        let unit = channel.unit.clone();
        let unit = unit.filter(|unit| channel_unit(&channel.name) != Some(unit));
        channel.samples.iter().map(move |sample| NdjsonLine {
            benchmark: None,
            channel: Some(&channel.name),
            quantity: None,
            time: sample.time,
            value: sample.value,
            unit: unit.clone(),
            sigma: None,
            averaging_s: None,
        })
    });
    readings.chain(samples)
}
