//! Turns a file of readings into another format.

use super::atomic::write_atomically;
use super::{Format, ReadOptions, Remark, encode_mcap, is_packed, read_watched};
use crate::reading::{BenchmarkId, Disorder, Quantity, Recording, Unit};
use anyhow::Context;
use schemars::JsonSchema;
use serde::Serialize;
use std::io::{self, BufWriter, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// What was converted.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct ConvertReport {
    /// The series written.
    pub series: Vec<SeriesCount>,
    /// The channels written.
    pub channels: Vec<ChannelCount>,
    /// What putting the rows in order met.
    pub disorder: Disorder,
    /// What the input says and the output has no place for.
    pub left_out: Vec<String>,
    /// What a person should know of the input.
    #[serde(skip)]
    #[schemars(skip)]
    pub remarks: Vec<(PathBuf, Remark)>,
}

/// How much of a series was written.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct SeriesCount {
    /// Whose readings.
    pub benchmark: BenchmarkId,
    /// Which quantity.
    pub quantity: Quantity,
    /// In which unit.
    pub unit: Unit,
    /// How many.
    pub readings: usize,
}

/// How much of a channel was written.
#[derive(Debug, Clone, PartialEq, JsonSchema, Serialize)]
pub struct ChannelCount {
    /// The channel's name.
    pub name: String,
    /// How many values.
    pub samples: usize,
}

/// How far a conversion has come.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ConvertStage {
    /// The share of the input that is read, 0 to 1.
    Read(f64),
    /// Bytes of the output that are written.
    Written(u64),
}

/// Reports how many bytes have gone through.
struct CountedOutput<'a, W> {
    out: W,
    bytes: u64,
    progress: &'a mut dyn FnMut(ConvertStage),
}

impl<W: Write> Write for CountedOutput<'_, W> {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.out.write(buffer)?;
        self.bytes += written as u64;
        (self.progress)(ConvertStage::Written(self.bytes));
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

impl<W: Seek> Seek for CountedOutput<'_, W> {
    fn seek(&mut self, to: SeekFrom) -> io::Result<u64> {
        self.out.seek(to)
    }
}

/// Reads `input` and writes it as `output`, each in the format of its extension. The output is wholly
/// there afterwards or untouched. `progress` receives how far it has come.
///
/// # Errors
/// An [`IngestError`](super::IngestError) (to be had by `downcast_ref`), with the files named.
pub fn convert(
    input: &Path,
    output: &Path,
    options: &ReadOptions,
    progress: &mut dyn FnMut(ConvertStage),
) -> anyhow::Result<ConvertReport> {
    let format = Format::of(output)?;
    anyhow::ensure!(
        !is_packed(output),
        "{}: packed files are read and not written, expected a name without .gz",
        output.display()
    );
    let is_same = input.canonicalize().ok().zip(output.canonicalize().ok());
    anyhow::ensure!(
        is_same.is_none_or(|(input, output)| input != output),
        "{}: it is what is read, expected another file to write: what the other format has no place for would be lost",
        output.display()
    );
    let read = read_watched(&[input.to_owned()], options, &mut |share| {
        progress(ConvertStage::Read(share));
    })?;
    let (recording, disorder) = (read.recording, read.disorder);
    write_atomically(output, |out| {
        let bytes = 0;
        let out = CountedOutput {
            out,
            bytes,
            progress,
        };
        match format {
            Format::Text(format) => (format.write)(&recording, &mut BufWriter::new(out)),
            Format::Mcap => encode_mcap(&recording, out),
        }
    })
    .with_context(|| format!("converting {} to {}", input.display(), output.display()))?;
    Ok(ConvertReport {
        remarks: read.remarks,
        ..report(&recording, disorder, format)
    })
}

fn report(recording: &Recording, disorder: Disorder, format: Format) -> ConvertReport {
    let series = recording.series.iter().map(|series| SeriesCount {
        benchmark: series.benchmark.clone(),
        quantity: series.quantity(),
        unit: series.unit,
        readings: series.readings.len(),
    });
    let channels = recording.channels.iter().map(|channel| ChannelCount {
        name: channel.name.clone(),
        samples: channel.samples.len(),
    });
    let mut left_out = Vec::new();
    if let Format::Text(format) = format {
        for series in &recording.series {
            if let Some(span) = series.averaging.filter(|_| !format.states_averaging) {
                left_out.push(format!(
                    "averaging of {} {}: {span}",
                    series.benchmark,
                    series.quantity()
                ));
            }
        }
        let provenance = recording.provenance.iter();
        left_out.extend(provenance.map(|(key, value)| format!("provenance, {key}: {value}")));
    }
    ConvertReport {
        series: series.collect(),
        channels: channels.collect(),
        disorder,
        left_out,
        remarks: Vec::new(),
    }
}
