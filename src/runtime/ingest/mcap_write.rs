//! Writes a recording as MCAP: a topic for each series and channel, and for what was said of them where that is
//! given; zstd chunks with checksums, a summary with statistics, and an index of messages.
//!
//! A converted file has no arrival times: `log_time` and `publish_time` both carry when a value was
//! measured. MCAP times are unsigned nanoseconds, so nothing before 1970 can stand there: if the
//! recording's first value is older, all of them count from that value instead, which keeps the
//! order, and `time_base` in every MCAP channel's metadata says so. The JSON `time` is the truth in
//! either case. A series or channel without any value leaves no trace.

use super::IngestError;
use super::atomic::write_atomically;
use super::message::{AVERAGING, Payload, SINCE, TIME_BASE, Topic, UNIX};
use crate::reading::{Channel, Reading, Recording, Sample, Series, Timestamp};
use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Compression, McapError, WriteOptions, Writer};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

/// The name of the MCAP metadata record that says where the data come from.
pub(super) const PROVENANCE: &str = "provenance";

const READING_SCHEMA: &str = r#"{"title":"slipwatch.Reading","description":"One reading of a benchmark, standard error in the same unit","type":"object","properties":{"time":{"type":"string","format":"date-time"},"value":{"type":"number"},"unit":{"type":"string"},"sigma":{"type":"number","exclusiveMinimum":0}},"required":["time","value","unit"]}"#;
const SAMPLE_SCHEMA: &str = r#"{"title":"slipwatch.Sample","description":"One value of a covariate","type":"object","properties":{"time":{"type":"string","format":"date-time"},"value":{"type":"number"},"unit":{"type":"string"}},"required":["time","value"]}"#;

/// Writes a recording into a file, which is wholly there afterwards or untouched.
///
/// # Errors
/// As [`encode_mcap`], and [`IngestError::Write`] when the file cannot be written.
pub fn write_mcap(recording: &Recording, file: &Path) -> Result<(), IngestError> {
    write_atomically(file, |out| encode_mcap(recording, out))
}

/// Writes a recording as MCAP. The same recording gives the same bytes.
///
/// # Errors
/// [`IngestError::Unwritable`] for a value that is not finite or a time out of MCAP's range,
/// [`IngestError::Write`] when `out` fails.
pub fn encode_mcap(recording: &Recording, out: impl Write + Seek) -> Result<(), IngestError> {
    let outgoing = outgoing(recording, &[])?;
    encode(recording, &outgoing, BufWriter::new(out)).map_err(unwritten)
}

/// A topic that holds no readings, but what was said of them. Readers of readings leave it out.
#[derive(Debug, Clone)]
pub(in crate::runtime) struct EventTopic {
    /// The topic, no benchmark's and no channel's.
    pub(in crate::runtime) name: String,
    /// The schema's name and its text.
    pub(in crate::runtime) schema: (&'static str, String),
    /// What was said, and when, in order.
    pub(in crate::runtime) messages: Vec<(Timestamp, Value)>,
}

/// Writes a recording, and what was said of it, into a file, which is wholly there afterwards or untouched.
///
/// # Errors
/// As [`write_mcap`].
pub(in crate::runtime) fn write_mcap_with(
    recording: &Recording,
    said: &[EventTopic],
    file: &Path,
) -> Result<(), IngestError> {
    let outgoing = outgoing(recording, said)?;
    write_atomically(file, |out| {
        encode(recording, &outgoing, BufWriter::new(out)).map_err(unwritten)
    })
}

fn unwritten(error: McapError) -> IngestError {
    IngestError::Write {
        file: "the MCAP output".into(),
        source: io::Error::other(error),
    }
}

/// One topic on its way out.
struct OutgoingTopic {
    name: String,
    schema: (&'static str, String),
    unit: Option<String>,
    metadata: BTreeMap<String, String>,
    rows: Vec<(u64, Row)>,
}

/// One message of it.
enum Row {
    Measured(Reading),
    Said(Value),
}

fn outgoing(recording: &Recording, said: &[EventTopic]) -> Result<Vec<OutgoingTopic>, IngestError> {
    let series = recording.series.iter().map(from_series);
    let channels = recording.channels.iter().map(from_channel);
    let said = said.iter().map(from_said);
    let topics: Vec<_> = series.chain(channels).chain(said).collect();
    let times = topics
        .iter()
        .flat_map(|(_, rows)| rows.iter().map(|(time, _)| *time));
    let first = times.min().unwrap_or(Timestamp::UNIX_EPOCH);
    let (base, time_base) = if first < Timestamp::UNIX_EPOCH {
        (first, format!("{SINCE}{first}"))
    } else {
        (Timestamp::UNIX_EPOCH, UNIX.to_owned())
    };
    topics
        .into_iter()
        .filter(|(_, rows)| !rows.is_empty())
        .map(|(mut topic, rows)| {
            topic
                .metadata
                .insert(TIME_BASE.to_owned(), time_base.clone());
            topic.rows = timed(&topic, rows, base)?;
            Ok(topic)
        })
        .collect()
}

fn from_said(said: &EventTopic) -> (OutgoingTopic, Vec<(Timestamp, Row)>) {
    let topic = OutgoingTopic {
        name: said.name.clone(),
        schema: said.schema.clone(),
        unit: None,
        metadata: BTreeMap::new(),
        rows: Vec::new(),
    };
    let row = |(time, value): &(Timestamp, Value)| (*time, Row::Said(value.clone()));
    (topic, said.messages.iter().map(row).collect())
}

fn from_series(series: &Series) -> (OutgoingTopic, Vec<(Timestamp, Row)>) {
    let mut metadata = BTreeMap::new();
    if let Some(span) = series.averaging {
        let seconds = if span.subsec_nanos() == 0 {
            span.as_secs().to_string()
        } else {
            format!("{:?}", span.as_secs_f64())
        };
        metadata.insert(AVERAGING.to_owned(), seconds);
    }
    let topic = OutgoingTopic {
        name: Topic::Benchmark(series.benchmark.clone(), series.quantity()).name(),
        schema: ("slipwatch.Reading", READING_SCHEMA.to_owned()),
        unit: Some(series.unit.to_string()),
        metadata,
        rows: Vec::new(),
    };
    let row = |reading: &Reading| (reading.time, Row::Measured(*reading));
    (topic, series.readings.iter().map(row).collect())
}

fn from_channel(channel: &Channel) -> (OutgoingTopic, Vec<(Timestamp, Row)>) {
    let topic = OutgoingTopic {
        name: Topic::Channel(channel.name.clone()).name(),
        schema: ("slipwatch.Sample", SAMPLE_SCHEMA.to_owned()),
        unit: channel.unit.clone(),
        metadata: BTreeMap::new(),
        rows: Vec::new(),
    };
    let row = |sample: &Sample| {
        let reading = Reading {
            time: sample.time,
            value: sample.value,
            sigma: None,
        };
        (sample.time, Row::Measured(reading))
    };
    (topic, channel.samples.iter().map(row).collect())
}

fn timed(
    topic: &OutgoingTopic,
    rows: Vec<(Timestamp, Row)>,
    base: Timestamp,
) -> Result<Vec<(u64, Row)>, IngestError> {
    let fail = |problem, expected| IngestError::Unwritable {
        name: topic.name.clone(),
        problem,
        expected,
    };
    rows.into_iter()
        .map(|(time, row)| {
            if matches!(&row, Row::Measured(reading) if !reading.is_sound()) {
                let expected = "finite values, and standard errors above zero";
                return Err(fail("a value that is not finite", expected));
            }
            let nanoseconds = time.as_nanosecond() - base.as_nanosecond();
            u64::try_from(nanoseconds)
                .map(|time| (time, row))
                .map_err(|_| fail("a time too late for MCAP", "less than 584 years in all"))
        })
        .collect()
}

fn encode(
    recording: &Recording,
    outgoing: &[OutgoingTopic],
    out: impl Write + Seek,
) -> Result<(), McapError> {
    let mut writer = WriteOptions::new()
        .compression(Some(Compression::Zstd))
        // No threads of its own: readings are few, and the bytes must not depend on the machine.
        .compression_threads(0)
        .library(concat!("slipwatch ", env!("CARGO_PKG_VERSION")))
        .create(out)?;
    if !recording.provenance.is_empty() {
        writer.write_metadata(&Metadata {
            name: PROVENANCE.to_owned(),
            metadata: recording.provenance.clone(),
        })?;
    }
    let mut ids = Vec::new();
    for one in outgoing {
        ids.push(declare(&mut writer, one)?);
    }
    let mut order: Vec<(u64, usize, usize)> = Vec::new();
    for (which, one) in outgoing.iter().enumerate() {
        order.extend(
            one.rows
                .iter()
                .enumerate()
                .map(|(row, (time, _))| (*time, which, row)),
        );
    }
    order.sort_unstable();
    for (time, which, row) in order {
        let one = &outgoing[which];
        let json = match &one.rows[row].1 {
            Row::Said(value) => serde_json::to_vec(value),
            Row::Measured(reading) => serde_json::to_vec(&Payload {
                time: reading.time,
                value: reading.value,
                unit: one.unit.as_deref(),
                sigma: reading.sigma,
            }),
        };
        let header = MessageHeader {
            channel_id: ids[which],
            sequence: u32::try_from(row).unwrap_or(u32::MAX),
            log_time: time,
            publish_time: time,
        };
        writer.write_to_known_channel(&header, &json.map_err(io::Error::from)?)?;
    }
    writer.finish()?;
    writer.into_inner().flush()?;
    Ok(())
}

fn declare<W: Write + Seek>(writer: &mut Writer<W>, one: &OutgoingTopic) -> Result<u16, McapError> {
    let (name, schema) = &one.schema;
    let schema = writer.add_schema(name, "jsonschema", schema.as_bytes())?;
    writer.add_channel(schema, &one.name, "json", &one.metadata)
}
