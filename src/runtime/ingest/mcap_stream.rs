//! Writes MCAP message by message: zstd chunks with checksums, at the end a summary with statistics and indexes.
//!
//! A chunk is put together in memory and written whole, so that a file whose writer was killed ends behind a whole
//! record as far as it was flushed.

use super::message::{AVERAGING, Payload, SINCE, TIME_BASE, Topic, UNIX};
use crate::monitor::Measured;
use crate::reading::{BenchmarkId, Timestamp, Unit};
use ::mcap::records::{MessageHeader, Metadata};
use ::mcap::{Compression, McapError, WriteOptions, Writer};
use jiff::SignedDuration;
use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

/// The name of the MCAP metadata record that says where the data come from.
pub(super) const PROVENANCE: &str = "provenance";

/// The name of the MCAP metadata record at the beginning of a file that is read while it grows: it may have no end.
pub(super) const GROWING: &str = "growing";

const READING_SCHEMA: &str = r#"{"title":"slipwatch.Reading","description":"One reading of a benchmark, standard error in the same unit","type":"object","properties":{"time":{"type":"string","format":"date-time"},"value":{"type":"number"},"unit":{"type":"string"},"sigma":{"type":"number","exclusiveMinimum":0}},"required":["time","value","unit"]}"#;
const SAMPLE_SCHEMA: &str = r#"{"title":"slipwatch.Sample","description":"One value of a covariate","type":"object","properties":{"time":{"type":"string","format":"date-time"},"value":{"type":"number"},"unit":{"type":"string"}},"required":["time","value"]}"#;

/// What is said of a topic once.
#[derive(Debug, Clone)]
pub(in crate::runtime) struct TopicHead {
    /// Its name.
    pub(in crate::runtime) name: String,
    /// The schema's name and its text.
    pub(in crate::runtime) schema: (&'static str, String),
    /// Beside `time_base`, which every topic has.
    pub(in crate::runtime) metadata: BTreeMap<String, String>,
}

impl TopicHead {
    /// Of a benchmark's readings.
    pub(super) fn of_readings(
        benchmark: &BenchmarkId,
        unit: Unit,
        averaging: Option<SignedDuration>,
    ) -> Self {
        let seconds = averaging.map(|span| {
            if span.subsec_nanos() == 0 {
                span.as_secs().to_string()
            } else {
                format!("{:?}", span.as_secs_f64())
            }
        });
        Self {
            name: Topic::Benchmark(benchmark.clone(), unit.quantity()).name(),
            schema: ("slipwatch.Reading", READING_SCHEMA.to_owned()),
            metadata: seconds
                .map(|seconds| (AVERAGING.to_owned(), seconds))
                .into_iter()
                .collect(),
        }
    }

    /// Of a covariate's values.
    pub(super) fn of_samples(channel: &str) -> Self {
        Self {
            name: Topic::Channel(channel.to_owned()).name(),
            schema: ("slipwatch.Sample", SAMPLE_SCHEMA.to_owned()),
            metadata: BTreeMap::new(),
        }
    }

    /// Of the topic on which this value stands.
    pub(in crate::runtime) fn of(measured: &Measured<'_>) -> Self {
        match measured {
            Measured::Reading {
                benchmark,
                unit,
                averaging,
                ..
            } => Self::of_readings(benchmark, *unit, *averaging),
            Measured::Sample { channel, .. } => Self::of_samples(channel),
        }
    }
}

/// The message of a value.
pub(in crate::runtime) fn reading_json(
    time: Timestamp,
    value: f64,
    unit: Option<&str>,
    sigma: Option<f64>,
) -> io::Result<Vec<u8>> {
    let payload = Payload {
        time,
        value,
        unit,
        sigma,
    };
    Ok(serde_json::to_vec(&payload)?)
}

/// The instant from which the times of a file count whose first value is of `first`, and how `time_base` names it.
pub(super) fn time_base(first: Timestamp) -> (Timestamp, String) {
    if first < Timestamp::UNIX_EPOCH {
        (first, format!("{SINCE}{first}"))
    } else {
        (Timestamp::UNIX_EPOCH, UNIX.to_owned())
    }
}

/// An MCAP file on its way out.
pub(in crate::runtime) struct McapStream<W: Write + Seek> {
    writer: Writer<W>,
    base: (Timestamp, String),
    /// Of each MCAP channel how many messages it has.
    counts: BTreeMap<u16, u32>,
}

impl<W: Write + Seek> McapStream<W> {
    /// A file in which no message is older than `first`, unless that is of 1970 or later.
    pub(in crate::runtime) fn create(
        out: W,
        first: Timestamp,
        provenance: &BTreeMap<String, String>,
    ) -> Result<Self, McapError> {
        let mut writer = WriteOptions::new()
            .compression(Some(Compression::Zstd))
            // No threads of its own: readings are few, and the bytes must not depend on the machine.
            .compression_threads(0)
            .disable_seeking(true)
            .library(concat!("slipwatch ", env!("CARGO_PKG_VERSION")))
            .create(out)?;
        if !provenance.is_empty() {
            writer.write_metadata(&Metadata {
                name: PROVENANCE.to_owned(),
                metadata: provenance.clone(),
            })?;
        }
        Ok(Self {
            writer,
            base: time_base(first),
            counts: BTreeMap::new(),
        })
    }

    /// Says that the file is to be read before its end is written, as far as it goes.
    pub(in crate::runtime) fn grows(&mut self) -> Result<(), McapError> {
        self.writer.write_metadata(&Metadata {
            name: GROWING.to_owned(),
            metadata: BTreeMap::new(),
        })
    }

    /// Whether a message of this time can stand in it.
    pub(in crate::runtime) fn has_place_for(&self, time: Timestamp) -> bool {
        u64::try_from(time.as_nanosecond() - self.base.0.as_nanosecond()).is_ok()
    }

    /// The number of a topic.
    pub(in crate::runtime) fn declare(&mut self, mut head: TopicHead) -> Result<u16, McapError> {
        let (name, text) = &head.schema;
        let schema = self
            .writer
            .add_schema(name, "jsonschema", text.as_bytes())?;
        let base = self.base.1.clone();
        head.metadata.insert(TIME_BASE.to_owned(), base);
        let id = (self.writer).add_channel(schema, &head.name, "json", &head.metadata)?;
        self.counts.entry(id).or_default();
        Ok(id)
    }

    /// Writes a message.
    pub(in crate::runtime) fn write(
        &mut self,
        topic: u16,
        time: Timestamp,
        json: &[u8],
    ) -> Result<(), McapError> {
        let nanoseconds = time.as_nanosecond() - self.base.0.as_nanosecond();
        let nanoseconds = u64::try_from(nanoseconds)
            .map_err(|_| io::Error::other(format!("MCAP has no place for the time {time}")))?;
        let sequence = self.counts.entry(topic).or_default();
        let header = MessageHeader {
            channel_id: topic,
            sequence: *sequence,
            log_time: nanoseconds,
            publish_time: nanoseconds,
        };
        *sequence = sequence.saturating_add(1);
        self.writer.write_to_known_channel(&header, json)
    }

    /// Writes what is in memory, as a chunk of its own.
    pub(in crate::runtime) fn flush(&mut self) -> Result<(), McapError> {
        self.writer.flush()
    }

    /// Writes the rest, and the summary.
    pub(in crate::runtime) fn finish(mut self) -> Result<(), McapError> {
        self.writer.finish()?;
        Ok(self.writer.into_inner().flush()?)
    }
}
