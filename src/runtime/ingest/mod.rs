//! Files of readings in and out: CSV, NDJSON, TOA5 and MCAP become one [`Recording`], and back.

mod again;
mod atomic;
mod bytes;
mod collect;
mod column_map;
mod columns;
mod convert;
mod csv;
mod encoding;
mod error;
mod mcap;
mod mcap_stream;
mod mcap_write;
mod message;
mod names;
mod ndjson;
mod ndjson_write;
mod remark;
mod split;
mod survey;
mod table;
mod table_write;
mod taken;
mod text;
mod text_format;
mod text_formats;
mod toa5;
mod units;
mod units_row;
mod vector;

pub use bytes::{is_packed, unpack, unpacked_name};
pub use column_map::{ColumnMap, ColumnMapError, Measure};
pub use columns::Meaning;
pub use convert::{ChannelCount, ConvertReport, ConvertStage, SeriesCount, convert};
pub use csv::{CSV, CsvRows};
pub use encoding::{Transcoder, latin1};
pub use error::IngestError;
pub(super) use mcap_stream::{McapStream, TopicHead, reading_json};
pub(super) use mcap_write::write_mcap_by;
pub use mcap_write::{encode_mcap, write_mcap};
pub(super) use message::escape;
pub use message::{JSON, MessageChannel, MessageError, decode_message};
pub use names::unit_in_name;
pub use ndjson::NDJSON;
pub use ndjson_write::write_ndjson;
pub use remark::Remark;
pub use survey::{Survey, survey, survey_objects};
pub use table_write::{write_csv, write_toa5};
pub use taken::LineResult;
pub use text::{FileSurvey, TextRows, look_through};
pub use text_format::{LineReader, TextFormat};
pub use text_formats::TEXT_FORMATS;
pub use toa5::TOA5;
pub use units::FileUnits;
pub use vector::VectorMap;

use taken::BadRows;

use crate::reading::{
    BenchmarkId, Channel, Conventions, Dialect, Disorder, Quantity, Reading, Recording, Sample,
    Unit,
};
use jiff::{SignedDuration, Timestamp};
use std::path::{Path, PathBuf};

/// What a file does not say of itself.
#[derive(Debug, Clone, PartialEq)]
pub struct ReadOptions {
    /// Day 0 of a `t_days` column.
    pub epoch: Timestamp,
    /// What columns mean whose names do not say it.
    pub columns: Vec<ColumnMap>,
    /// Benchmarks whose readings stand in those columns alone, and in no other that has their name.
    pub reserved: Vec<BenchmarkId>,
    /// Units of benchmarks whose columns are known by their names, and which count before those in the names.
    pub units: Vec<(BenchmarkId, Unit)>,
    /// The span over which velocities are means, for series that state none.
    pub averaging: Option<SignedDuration>,
    /// How times and missing values are written.
    pub conventions: Conventions,
    /// How a table of text is written.
    pub dialect: Dialect,
    /// Readings that are given by their components.
    pub vectors: Vec<VectorMap>,
}

impl Default for ReadOptions {
    fn default() -> Self {
        Self {
            epoch: Timestamp::constant(946_684_800, 0),
            columns: Vec::new(),
            reserved: Vec::new(),
            units: Vec::new(),
            averaging: None,
            conventions: Conventions::default(),
            dialect: Dialect::default(),
            vectors: Vec::new(),
        }
    }
}

impl ReadOptions {
    /// Whether its readings stand in a column that is given, and in no other.
    fn reserves(&self, benchmark: &BenchmarkId) -> bool {
        self.reserved.contains(benchmark)
    }

    /// The same with these in place of what maps the columns of their names.
    fn with_columns(&self, others: Vec<ColumnMap>) -> Self {
        let mut options = self.clone();
        for other in others {
            let mut own = options.columns.iter_mut();
            if let Some(own) = own.find(|own| own.column == other.column) {
                *own = other;
            }
        }
        options
    }

    /// The unit that is stated of a benchmark beside the one that its column's name has.
    fn unit_beside(&self, benchmark: &BenchmarkId, named: Unit) -> Option<Unit> {
        let of_it = |(id, unit): &&(BenchmarkId, Unit)| {
            id == benchmark && unit.quantity() == named.quantity() && *unit != named
        };
        self.units.iter().find(of_it).map(|(_, unit)| *unit)
    }

    fn averaging_of(&self, unit: Unit, stated: Option<SignedDuration>) -> Option<SignedDuration> {
        match unit.quantity() {
            Quantity::Velocity => stated.or(self.averaging),
            Quantity::Displacement => stated,
        }
    }
}

/// One value on its way in.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    /// A reading of a benchmark.
    Reading {
        /// Whose.
        benchmark: BenchmarkId,
        /// Its unit, which also says the quantity.
        unit: Unit,
        /// For velocities: the span before the time stamp over which it is the mean.
        averaging: Option<SignedDuration>,
        /// The reading itself.
        reading: Reading,
    },
    /// A value of a covariate.
    Sample {
        /// The channel's name.
        channel: String,
        /// Its unit, where known.
        unit: Option<String>,
        /// The value itself.
        sample: Sample,
    },
    /// A reading that should be there and is not: the sensor gave a mark for no value, or the column
    /// is no longer in its unit.
    Missing {
        /// Whose.
        benchmark: BenchmarkId,
        /// When it should have been measured.
        time: Timestamp,
        /// What stands there instead.
        what: String,
    },
}

impl Item {
    /// When it was measured, or should have been.
    pub(in crate::runtime) fn time(&self) -> Timestamp {
        match self {
            Self::Reading { reading, .. } => reading.time,
            Self::Sample { sample, .. } => sample.time,
            Self::Missing { time, .. } => *time,
        }
    }
}

#[derive(Debug, Clone, Copy)]
enum Format {
    Text(&'static TextFormat),
    Mcap,
}

impl Format {
    fn of(file: &Path) -> Result<Self, IngestError> {
        if bytes::is_stdin(file) {
            return Self::of_stdin();
        }
        let name = bytes::unpacked_name(file);
        let extension = name.extension().unwrap_or_default().to_string_lossy();
        let extension = extension.to_ascii_lowercase();
        if let Some(format) = text_format_of(file) {
            return Ok(Self::Text(format));
        }
        match extension.as_str() {
            "mcap" if !is_packed(file) => Ok(Self::Mcap),
            "xlsx" | "xls" | "xlsm" | "xlsb" | "ods" => {
                Err(IngestError::Workbook { file: file.into() })
            }
            _ => Err(IngestError::UnknownFormat { file: file.into() }),
        }
    }
}

impl Format {
    /// As what stdin begins with.
    fn of_stdin() -> Result<Self, IngestError> {
        let all = bytes::stdin().map_err(|source| IngestError::Read {
            file: "stdin".into(),
            source,
        })?;
        if all.starts_with(MCAP_MAGIC) {
            return Ok(Self::Mcap);
        }
        let mut formats = TEXT_FORMATS.into_iter();
        let format = formats.find(|one| begins_as(one, all)).unwrap_or(&CSV);
        Ok(Self::Text(format))
    }
}

/// The format of a text file by the ending of its name; `None` where it is that of none. A logger's table is one whatever
/// its file is called.
pub fn text_format_of(file: &Path) -> Option<&'static TextFormat> {
    let name = bytes::unpacked_name(file);
    let extension = name.extension().unwrap_or_default().to_string_lossy();
    let format = TextFormat::of_extension(&extension.to_ascii_lowercase())?;
    let is_table = || begins_as(&TOA5, &bytes::first_bytes(file));
    let is_toa5 = format.name == CSV.name && is_table();
    Some(if is_toa5 { &TOA5 } else { format })
}

/// Whether these first bytes are those of a file of the format, behind a byte order mark and white space.
fn begins_as(format: &TextFormat, first: &[u8]) -> bool {
    let text = first.strip_prefix("\u{feff}".as_bytes());
    (format.begins)(text.unwrap_or(first).trim_ascii_start())
}

/// How a recording begins.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// What files hold, and what a person should know of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FilesRead {
    /// The readings and covariates, in order.
    pub recording: Recording,
    /// What putting them in order met.
    pub disorder: Disorder,
    /// What has been found out about the files.
    pub remarks: Vec<(PathBuf, Remark)>,
    /// The columns of their tables.
    pub columns: Vec<String>,
}

/// Reads and joins files, each in the format of its extension; values of a later file replace those of an earlier one.
///
/// # Errors
/// [`IngestError`] names the first thing found wrong; nothing is silently left out but MCAP
/// topics that are neither benchmarks nor channels, and, beside others, files without any other.
pub fn read_files(
    paths: &[PathBuf],
    options: &ReadOptions,
) -> Result<(Recording, Disorder), IngestError> {
    let read = read_with_remarks(paths, options)?;
    Ok((read.recording, read.disorder))
}

/// As [`read_files`], and says what a person should know of the files.
///
/// # Errors
/// As [`read_files`].
pub fn read_with_remarks(
    paths: &[PathBuf],
    options: &ReadOptions,
) -> Result<FilesRead, IngestError> {
    read_watched(paths, options, &mut |_| {})
}

/// As [`read_with_remarks`]; `progress` receives the share of the present file that is read, 0 to 1.
fn read_watched(
    paths: &[PathBuf],
    options: &ReadOptions,
    progress: &mut dyn FnMut(f64),
) -> Result<FilesRead, IngestError> {
    let each: Vec<(&Path, &ReadOptions)> =
        paths.iter().map(|path| (path.as_path(), options)).collect();
    let read = read_taking(&each, &mut BadRows::Refuse, progress)?;
    for map in &options.columns {
        if !read.columns.contains(&map.column) {
            return Err(IngestError::NoSuchColumn {
                column: map.column.clone(),
                available: read.columns,
            });
        }
    }
    Ok(read)
}

/// Reads one file; a row or message that cannot be used is handed to `aside`, and the rest is read, as the daemon does: a column
/// without a value is no fault then, nor a column of the options that is not there.
///
/// # Errors
/// [`IngestError`] where the whole file cannot be used.
pub fn read_beside(
    file: &Path,
    options: &ReadOptions,
    aside: &mut dyn FnMut(IngestError),
) -> Result<FilesRead, IngestError> {
    let each = [(file, options)];
    read_taking(&each, &mut BadRows::SetAside(aside), &mut |_| {})
}

fn read_taking(
    files: &[(&Path, &ReadOptions)],
    bad: &mut BadRows<'_>,
    progress: &mut dyn FnMut(f64),
) -> Result<FilesRead, IngestError> {
    let (mut parts, mut read) = (Vec::new(), FilesRead::default());
    let mut without_readings = None;
    for (path, options) in files {
        let (recording, met) = match Format::of(path)? {
            Format::Text(format) => {
                let table = text::read_text(format, path, options, bad, progress)?;
                read.columns.extend(table.columns);
                let remarks = table.remarks.into_iter();
                read.remarks
                    .extend(remarks.map(|one| (path.to_path_buf(), one)));
                (table.recording, table.disorder)
            }
            Format::Mcap => match mcap::read_mcap(path, options, bad, progress) {
                Err(none @ IngestError::NoTopics { .. }) => {
                    let file = path.to_path_buf();
                    read.remarks.extend(none.left_out().map(|one| (file, one)));
                    without_readings.get_or_insert(none);
                    continue;
                }
                taken => {
                    let taken = taken?;
                    let remark = taken.remark.into_iter();
                    read.remarks
                        .extend(remark.map(|one| (path.to_path_buf(), one)));
                    (taken.recording, taken.disorder)
                }
            },
        };
        parts.push(recording);
        read.disorder += met;
    }
    if let Some(none) = without_readings.filter(|_| parts.is_empty()) {
        return Err(none);
    }
    let (recording, overlap) = Recording::merge(parts)?;
    read.disorder += overlap;
    read.recording = recording;
    Ok(read)
}

/// Reads covariates kept in a file of their own; benchmarks that stand there too are left out.
///
/// # Errors
/// [`IngestError`] as [`read_files`]; also for a file without any channel.
pub fn read_channels(
    path: &Path,
    options: &ReadOptions,
) -> Result<(Vec<Channel>, Disorder), IngestError> {
    let options = ReadOptions {
        columns: Vec::new(),
        ..options.clone()
    };
    let (recording, disorder) = read_files(&[path.to_owned()], &options)?;
    if recording.channels.is_empty() {
        return Err(IngestError::NoChannels {
            file: path.to_owned(),
        });
    }
    Ok((recording.channels, disorder))
}
