//! Writes a recording as one table over the union of all times: CSV, and TOA5.
//!
//! Times are in UTC, and every number reads back bit for bit. A table has no place for the averaging
//! of velocities nor for provenance: these are not written, and must be given again on reading.

use super::IngestError;
use super::column_map::Measure;
use super::names::{Name, name_of};
use crate::reading::{Conventions, Reading, Recording, Sample, Timestamp, Unit};
use ::csv::{QuoteStyle, Writer, WriterBuilder};
use jiff::tz::Offset;
use std::collections::BTreeSet;
use std::io::{self, Write};

/// One column on its way out: its rows, of which those before `next` are written.
struct OutgoingColumn<'a> {
    name: String,
    unit: String,
    rows: Vec<(Timestamp, Reading)>,
    sigma: Option<String>,
    next: usize,
    title: &'a str,
}

/// Writes CSV.
///
/// # Errors
/// [`IngestError::Unwritable`] for a name that would be read back as something else, for a value
/// that is not finite and for rows out of order; [`IngestError::Write`] when `out` fails.
pub fn write_csv(recording: &Recording, out: impl Write) -> Result<(), IngestError> {
    let columns = outgoing(recording);
    refuse_unreadable(recording, &columns)?;
    let mut writer = Writer::from_writer(out);
    let mut header = vec!["time".to_owned()];
    for column in &columns {
        header.push(column.name.clone());
        header.extend(column.sigma.clone());
    }
    let written = writer
        .write_record(&header)
        .and_then(|()| write_rows(columns, &mut writer, |time, _row| vec![time.to_string()]));
    written.map_err(|error| unwritten("the CSV output", error))
}

/// Writes a Campbell TOA5 table, its time stamps in UTC.
///
/// # Errors
/// As [`write_csv`]; also for a value that TOA5 has for a mark of no value.
pub fn write_toa5(recording: &Recording, out: impl Write) -> Result<(), IngestError> {
    let columns = outgoing(recording);
    refuse_unreadable(recording, &columns)?;
    let marks = Conventions::default().of_a_logger().missing;
    let is_mark = |column: &&OutgoingColumn<'_>| {
        let mut rows = column.rows.iter();
        rows.any(|row| marks.has_number(row.1.value))
    };
    if let Some(column) = columns.iter().find(is_mark) {
        return Err(IngestError::Unwritable {
            name: column.title.to_owned(),
            problem: "a value of -7999 or -99999",
            expected: "values that TOA5 does not have for missing ones",
        });
    }
    let mut writer = WriterBuilder::new()
        .quote_style(QuoteStyle::NonNumeric)
        .flexible(true)
        .from_writer(out);
    let station = ["TOA5", "slipwatch", "", "", "", "", "", "readings"];
    let mut header = [("TIMESTAMP", "TS", ""), ("RECORD", "RN", "")]
        .map(|(name, unit, kind)| [name, unit, kind].map(str::to_owned))
        .to_vec();
    for column in &columns {
        let names = [Some(&column.name), column.sigma.as_ref()];
        let smp = "Smp".to_owned();
        let titles = names.into_iter().flatten();
        header.extend(titles.map(|name| [name.clone(), column.unit.clone(), smp.clone()]));
    }
    let stamp = |time: Timestamp, row: usize| {
        let local = Offset::UTC.to_datetime(time);
        vec![
            format!("{} {}", local.date(), local.time()),
            row.to_string(),
        ]
    };
    let lines = (0..3).map(|line| header.iter().map(move |column| &column[line]));
    let written = writer
        .write_record(station)
        .and_then(|()| {
            lines
                .into_iter()
                .try_for_each(|line| writer.write_record(line))
        })
        .and_then(|()| write_rows(columns, &mut writer, stamp));
    written.map_err(|error| unwritten("the TOA5 output", error))
}

fn unwritten(output: &str, error: ::csv::Error) -> IngestError {
    IngestError::Write {
        file: output.into(),
        source: io::Error::other(error),
    }
}

/// One row for each time: what `begin` makes of the time and the row's number, then the values.
fn write_rows<W: Write>(
    mut columns: Vec<OutgoingColumn<'_>>,
    writer: &mut Writer<W>,
    begin: impl Fn(Timestamp, usize) -> Vec<String>,
) -> Result<(), ::csv::Error> {
    let times: BTreeSet<Timestamp> = columns
        .iter()
        .flat_map(|column| column.rows.iter().map(|row| row.0))
        .collect();
    for (number, time) in times.into_iter().enumerate() {
        let mut cells = begin(time, number);
        for column in &mut columns {
            let row = column.rows.get(column.next).filter(|row| row.0 == time);
            column.next += usize::from(row.is_some());
            // Debug, unlike Display, writes large and small numbers with an exponent.
            cells.push(row.map_or_else(String::new, |row| format!("{:?}", row.1.value)));
            if column.sigma.is_some() {
                let sigma = row.and_then(|row| row.1.sigma);
                cells.push(sigma.map_or_else(String::new, |sigma| format!("{sigma:?}")));
            }
        }
        writer.write_record(&cells)?;
    }
    writer.flush()?;
    Ok(())
}

fn outgoing(recording: &Recording) -> Vec<OutgoingColumn<'_>> {
    let series = recording.series.iter().map(|series| {
        let suffix = series.unit.column_suffix();
        let id = &series.benchmark;
        let has_sigma = series.readings.iter().any(|row| row.sigma.is_some());
        OutgoingColumn {
            name: format!("{id}_{}_{suffix}", series.quantity()),
            unit: series.unit.to_string(),
            rows: series.readings.iter().map(|row| (row.time, *row)).collect(),
            sigma: has_sigma.then(|| format!("{id}_sigma_{suffix}")),
            next: 0,
            title: id.as_str(),
        }
    });
    let channels = recording.channels.iter().map(|channel| {
        let as_reading = |sample: &Sample| Reading {
            time: sample.time,
            value: sample.value,
            sigma: None,
        };
        let samples = channel.samples.iter();
        OutgoingColumn {
            name: channel.name.clone(),
            unit: channel.unit.clone().unwrap_or_default(),
            rows: samples.map(|row| (row.time, as_reading(row))).collect(),
            sigma: None,
            next: 0,
            title: &channel.name,
        }
    });
    let columns = series.chain(channels);
    columns.filter(|column| !column.rows.is_empty()).collect()
}

fn refuse_unreadable(
    recording: &Recording,
    columns: &[OutgoingColumn<'_>],
) -> Result<(), IngestError> {
    let fail = |name: &str, problem, expected| IngestError::Unwritable {
        name: name.to_owned(),
        problem,
        expected,
    };
    for series in &recording.series {
        let id = series.benchmark.as_str();
        let name = format!("{id}_displacement_mm");
        let read = name_of(&name);
        if read != Name::Measure(Some(id), Measure::Reading(Unit::MM)) || id.trim() != id {
            return Err(fail(
                id,
                "no column can have this benchmark's name",
                "another name",
            ));
        }
    }
    for channel in &recording.channels {
        let name = channel.name.as_str();
        if !matches!(name_of(name), Name::Channel(_)) || name.is_empty() || name.trim() != name {
            let problem = "a column of this name would not be read as a covariate";
            return Err(fail(name, problem, "another name"));
        }
    }
    let mut names = BTreeSet::new();
    for column in columns {
        if !names.insert(&column.name) || name_breaks_lines(&column.name) {
            return Err(fail(
                &column.name,
                "the name stands twice or has a line break",
                "every name once, on one line",
            ));
        }
        if !column.rows.is_sorted_by(|a, b| a.0 < b.0) {
            return Err(fail(
                column.title,
                "rows out of order",
                "strictly increasing times",
            ));
        }
        if !column.rows.iter().all(|row| row.1.is_sound()) {
            let expected = "finite values, and standard errors above zero";
            return Err(fail(column.title, "a value that is not finite", expected));
        }
    }
    Ok(())
}

fn name_breaks_lines(name: &str) -> bool {
    name.contains(['\n', '\r'])
}
