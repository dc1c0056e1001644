//! Writes a recording as MCAP: a topic for each series and channel.
//!
//! A converted file has no arrival times: `log_time` and `publish_time` both carry when a value was
//! measured. MCAP times are unsigned nanoseconds, so nothing before 1970 can stand there: if the
//! recording's first value is older, all of them count from that value instead, which keeps the
//! order, and `time_base` in every MCAP channel's metadata says so. The JSON `time` is the truth in
//! either case. A series or channel without any value leaves no trace.

use super::IngestError;
use super::atomic::write_atomically;
use super::mcap_stream::{McapStream, TopicHead, reading_json, time_base};
use crate::reading::{Channel, Reading, Recording, Sample, Series, Timestamp};
use ::mcap::McapError;
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;

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
    let outgoing = outgoing(recording)?;
    encode(recording, &outgoing, BufWriter::new(out)).map_err(unwritten)
}

/// Writes a file by `write`, which is wholly there afterwards or untouched.
///
/// # Errors
/// [`IngestError::Write`].
pub(in crate::runtime) fn write_mcap_by(
    file: &Path,
    write: impl FnOnce(BufWriter<&mut std::fs::File>) -> Result<(), McapError>,
) -> Result<(), IngestError> {
    write_atomically(file, |out| write(BufWriter::new(out)).map_err(unwritten))
}

fn unwritten(error: McapError) -> IngestError {
    IngestError::Write {
        file: "the MCAP output".into(),
        source: io::Error::other(error),
    }
}

/// One topic on its way out.
struct OutgoingTopic {
    head: TopicHead,
    unit: Option<String>,
    rows: Vec<Reading>,
}

fn outgoing(recording: &Recording) -> Result<Vec<OutgoingTopic>, IngestError> {
    let series = recording.series.iter().map(from_series);
    let channels = recording.channels.iter().map(from_channel);
    let mut topics: Vec<OutgoingTopic> = series.chain(channels).collect();
    topics.retain(|topic| !topic.rows.is_empty());
    let (base, _) = time_base(first(&topics));
    for topic in &topics {
        refuse_unwritable(topic, base)?;
    }
    Ok(topics)
}

fn first(topics: &[OutgoingTopic]) -> Timestamp {
    let times = topics.iter().flat_map(|topic| &topic.rows);
    let first = times.map(|row| row.time).min();
    first.unwrap_or(Timestamp::UNIX_EPOCH)
}

fn from_series(series: &Series) -> OutgoingTopic {
    OutgoingTopic {
        head: TopicHead::of_readings(&series.benchmark, series.unit, series.averaging),
        unit: Some(series.unit.to_string()),
        rows: series.readings.clone(),
    }
}

fn from_channel(channel: &Channel) -> OutgoingTopic {
    let row = |sample: &Sample| Reading {
        time: sample.time,
        value: sample.value,
        sigma: None,
    };
    OutgoingTopic {
        head: TopicHead::of_samples(&channel.name),
        unit: channel.unit.clone(),
        rows: channel.samples.iter().map(row).collect(),
    }
}

fn refuse_unwritable(topic: &OutgoingTopic, base: Timestamp) -> Result<(), IngestError> {
    let fail = |problem, expected| IngestError::Unwritable {
        name: topic.head.name.clone(),
        problem,
        expected,
    };
    for row in &topic.rows {
        if !row.is_sound() {
            let expected = "finite values, and standard errors above zero";
            return Err(fail("a value that is not finite", expected));
        }
        let nanoseconds = row.time.as_nanosecond() - base.as_nanosecond();
        if u64::try_from(nanoseconds).is_err() {
            return Err(fail(
                "a time too late for MCAP",
                "less than 584 years in all",
            ));
        }
    }
    Ok(())
}

fn encode(
    recording: &Recording,
    outgoing: &[OutgoingTopic],
    out: impl Write + Seek,
) -> Result<(), McapError> {
    let mut stream = McapStream::create(out, first(outgoing), &recording.provenance)?;
    let mut ids = Vec::new();
    for one in outgoing {
        ids.push(stream.declare(one.head.clone())?);
    }
    let mut order: Vec<(Timestamp, usize, usize)> = Vec::new();
    for (which, one) in outgoing.iter().enumerate() {
        let rows = one.rows.iter().enumerate();
        order.extend(rows.map(|(row, reading)| (reading.time, which, row)));
    }
    order.sort_unstable();
    for (time, which, row) in order {
        let one = &outgoing[which];
        let Reading { value, sigma, .. } = one.rows[row];
        let json = reading_json(time, value, one.unit.as_deref(), sigma)?;
        stream.write(ids[which], time, &json)?;
    }
    stream.finish()
}
