//! Flags that several commands share, and the loading of what they name.

use super::exit::{self, NoSuchReadings};
use crate::alert::Policy;
use crate::config::value;
use crate::reading::{
    BenchmarkId, Conventions, CovariateKind, DecimalMark, Delimiter, Dialect, Disorder, LocalClock,
    MOST_SKIPPED, MissingValues, Quantity, Recording, SelectError, Series, SummerTime,
    ThousandsMark, TimeFormat, Timestamp,
};
use crate::runtime::ingest::{
    ColumnMap, FilesRead, IngestError, ReadOptions, Remark, read_channels, read_with_remarks,
};
use jiff::SignedDuration;
use jiff::tz::TimeZone;
use serde::Serialize;
use std::io::{self, Write};
use std::path::PathBuf;

/// How results look.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum OutputFormat {
    /// For people.
    #[default]
    Text,
    /// For programs.
    Json,
}

/// `--format`.
#[derive(Debug, Clone, Copy, clap::Args)]
pub struct OutputArgs {
    /// How results look on stdout
    #[arg(long, value_enum, default_value_t, value_name = "FORMAT")]
    pub format: OutputFormat,
}

impl OutputArgs {
    /// Prints a result: as one JSON object, or as `text` says it.
    ///
    /// # Errors
    /// When it cannot be written.
    pub(super) fn print<T: Serialize>(
        self,
        result: &T,
        text: impl Fn(&T) -> String,
    ) -> anyhow::Result<()> {
        let mut stdout = io::stdout().lock();
        match self.format {
            OutputFormat::Json => writeln!(stdout, "{}", serde_json::to_string(result)?)?,
            OutputFormat::Text => write!(stdout, "{}", text(result))?,
        }
        stdout.flush()?;
        Ok(())
    }
}

/// The names of the arguments that say what a file means.
pub(super) const FILE_FLAGS: [&str; 12] = [
    "columns",
    "averaging",
    "epoch",
    "time_zone",
    "dst",
    "missing",
    "delimiter",
    "decimal",
    "thousands",
    "time_columns",
    "time_format",
    "skip_lines",
];

/// What files do not say of themselves.
#[derive(Debug, Clone, clap::Args)]
pub struct FileArgs {
    /// What a CSV column means whose name does not say it
    #[arg(long = "column", value_name = "NAME=ID:QUANTITY:UNIT")]
    pub columns: Vec<ColumnMap>,
    /// Each velocity is the mean of so long a time before it, such as 1h
    #[arg(long, value_name = "DURATION", value_parser = value::duration)]
    pub averaging: Option<SignedDuration>,
    /// Day 0 of a column `t_days` [default: 2000-01-01T00:00:00Z]
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    pub epoch: Option<Timestamp>,
    /// The zone of times that state no offset, such as Europe/Rome
    #[arg(long, value_name = "ZONE", value_parser = value::time_zone)]
    pub time_zone: Option<TimeZone>,
    /// What a local time means that came twice or never: reject, earlier, later, or standard for a
    /// clock that is never changed [default: reject]
    #[arg(long, value_name = "POLICY", value_parser = SummerTime::parse)]
    pub dst: Option<SummerTime>,
    /// A further mark for a missing value, such as -7999
    #[arg(long, value_name = "VALUE", allow_hyphen_values = true)]
    pub missing: Vec<String>,
    /// How the tables are written.
    #[command(flatten)]
    pub dialect: DialectArgs,
}

/// How tables of text are written, where it is not as in CSV with RFC 3339 times.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct DialectArgs {
    /// What separates the cells of a table: comma, semicolon or tab [default: as in the header]
    #[arg(long, value_name = "MARK", value_parser = Delimiter::parse)]
    pub delimiter: Option<Delimiter>,
    /// The decimal mark: point or comma [default: point]
    #[arg(long, value_name = "MARK", value_parser = DecimalMark::parse)]
    pub decimal: Option<DecimalMark>,
    /// What parts the thousands of numbers: comma, point, blank or apostrophe [default: nothing]
    #[arg(long, value_name = "MARK", value_parser = ThousandsMark::parse)]
    pub thousands: Option<ThousandsMark>,
    /// The column that gives the time; once for each where it stands in several, as date and time do [default: time or t_days]
    #[arg(long = "time-column", value_name = "NAME")]
    pub time_columns: Vec<String>,
    /// How times are written: a pattern such as "%d.%m.%Y %H:%M", rfc3339, unix, unix_ms, excel or mjd
    /// [default: rfc3339]
    #[arg(long, value_name = "FORMAT", value_parser = TimeFormat::parse)]
    pub time_format: Option<TimeFormat>,
    /// So many lines stand before the header of a table, such as the instrument's name; lines that begin with # are passed over
    /// without it [default: 0]
    #[arg(long, value_name = "COUNT", value_parser = clap::value_parser!(u64).range(..=MOST_SKIPPED))]
    pub skip_lines: Option<u64>,
}

impl DialectArgs {
    /// The same for the readers.
    pub fn dialect(&self) -> Dialect {
        Dialect {
            delimiter: self.delimiter,
            decimal: self.decimal.unwrap_or_default(),
            thousands: self.thousands,
            time_columns: self.time_columns.clone(),
            time_format: self.time_format.clone().unwrap_or_default(),
            skip_lines: self.skip_lines.unwrap_or_default(),
        }
    }
}

impl FileArgs {
    /// The same for the readers.
    pub fn options(&self) -> ReadOptions {
        let mut missing = MissingValues::default();
        self.missing.iter().for_each(|mark| missing.add(mark));
        let clock = LocalClock {
            zone: self.time_zone.clone(),
            summer_time: self.dst.unwrap_or_default(),
        };
        let defaults = ReadOptions::default();
        ReadOptions {
            epoch: self.epoch.unwrap_or(defaults.epoch),
            columns: self.columns.clone(),
            averaging: self.averaging,
            conventions: Conventions { clock, missing },
            dialect: self.dialect.dialect(),
            ..defaults
        }
    }

    /// The flags that are given, each with the key of a config that says the same.
    pub(super) fn stated(&self) -> Vec<(&'static str, &'static str)> {
        let dialect = &self.dialect;
        let all = [
            (
                !self.columns.is_empty(),
                "--column",
                "column and unit of [[benchmark]]",
            ),
            (
                self.averaging.is_some(),
                "--averaging",
                "averaging of [[benchmark]]",
            ),
            (self.epoch.is_some(), "--epoch", "epoch of [[source]]"),
            (
                self.time_zone.is_some(),
                "--time-zone",
                "time_zone of [[source]]",
            ),
            (self.dst.is_some(), "--dst", "dst of [[source]]"),
            (
                !self.missing.is_empty(),
                "--missing",
                "missing of [[source]]",
            ),
            (
                dialect.delimiter.is_some(),
                "--delimiter",
                "delimiter of [[source]]",
            ),
            (
                dialect.decimal.is_some(),
                "--decimal",
                "decimal of [[source]]",
            ),
            (
                dialect.thousands.is_some(),
                "--thousands",
                "thousands of [[source]]",
            ),
            (
                !dialect.time_columns.is_empty(),
                "--time-column",
                "time_column of [[source]]",
            ),
            (
                dialect.time_format.is_some(),
                "--time-format",
                "time_format of [[source]]",
            ),
            (
                dialect.skip_lines.is_some(),
                "--skip-lines",
                "skip_lines of [[source]]",
            ),
        ];
        let given = all.into_iter().filter(|(is_given, ..)| *is_given);
        given.map(|(_, flag, key)| (flag, key)).collect()
    }
}

/// Which readings, and what they mean: common to all commands that read some.
#[derive(Debug, Clone, clap::Args)]
pub struct ReadingArgs {
    /// Readings, CSV, NDJSON, TOA5 or MCAP by the name's ending; - reads stdin, by how it begins; a later file stands over an
    /// earlier one
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<PathBuf>,
    /// Take this benchmark only
    #[arg(long, value_name = "ID")]
    pub benchmark: Option<String>,
    /// Take this quantity only: displacement or velocity
    #[arg(long, value_name = "QUANTITY", value_parser = quantity)]
    pub quantity: Option<Quantity>,
    /// Covariates that stand in a file of their own
    #[arg(long, value_name = "FILE")]
    pub channels: Vec<PathBuf>,
    /// Covariates whose names do not say what they measure.
    #[command(flatten)]
    pub covariates: CovariateArgs,
    /// The meaning of the files.
    #[command(flatten)]
    pub file: FileArgs,
    /// How long it takes to bring everyone out, such as 12h
    #[arg(long, value_name = "DURATION", value_parser = value::duration)]
    pub evacuation_time: Option<SignedDuration>,
    /// Passing this velocity is failure, such as "1 m/day"
    #[arg(long, value_name = "VELOCITY", value_parser = value::speed)]
    pub critical_velocity: Option<f64>,
}

/// Covariates whose names do not say what they measure.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct CovariateArgs {
    /// What a covariate measures whose name does not say it: rain, flow, level, temperature, humidity, pressure or other
    #[arg(long = "covariate", value_name = "NAME=KIND", value_parser = stated)]
    pub stated: Vec<(String, CovariateKind)>,
}

/// What the files hold.
#[derive(Debug, Clone)]
pub struct Loaded {
    /// Readings and covariates, in order.
    pub recording: Recording,
    /// What putting them in order met.
    pub disorder: Disorder,
}

impl ReadingArgs {
    /// Reads all files, and warns on stderr of rows that were not in order.
    ///
    /// # Errors
    /// [`IngestError`] as [`read_files`](crate::runtime::ingest::read_files) and [`read_channels`].
    pub fn load(&self) -> Result<Loaded, IngestError> {
        let options = self.file.options();
        self.joined(read_with_remarks(&self.files, &options)?, &|_| {
            options.clone()
        })
    }

    /// With the covariates that stand in files of their own, each read as `options` say of it.
    pub(super) fn joined(
        &self,
        read: FilesRead,
        options: &dyn Fn(&PathBuf) -> ReadOptions,
    ) -> Result<Loaded, IngestError> {
        let FilesRead {
            mut recording,
            mut disorder,
            remarks,
            ..
        } = read;
        say_remarks(&remarks);
        if !self.channels.is_empty() {
            let mut parts = vec![recording];
            for file in &self.channels {
                let (channels, met) = read_channels(file, &options(file))?;
                parts.push(Recording {
                    channels,
                    ..Recording::default()
                });
                disorder += met;
            }
            let (merged, overlap) = Recording::merge(parts)?;
            recording = merged;
            disorder += overlap;
        }
        self.state(&mut recording)?;
        warn_of(disorder);
        Ok(Loaded {
            recording,
            disorder,
        })
    }

    /// Puts to the covariates what is stated of them.
    fn state(&self, recording: &mut Recording) -> Result<(), IngestError> {
        let channels = &mut recording.channels;
        for (name, kind) in &self.covariates.stated {
            let Some(channel) = channels.iter_mut().find(|one| one.name == *name) else {
                return Err(IngestError::NoSuchCovariate {
                    name: name.clone(),
                    available: channels.iter().map(|one| one.name.clone()).collect(),
                });
            };
            channel.stated = Some(*kind);
        }
        Ok(())
    }

    /// The one series that `--benchmark` and `--quantity` mean.
    ///
    /// # Errors
    /// [`SelectError`] when none fits, or several do.
    pub fn series<'a>(&self, recording: &'a Recording) -> Result<&'a Series, SelectError> {
        let benchmark = self.benchmark.as_ref().map(BenchmarkId::new);
        recording.series(benchmark.as_ref(), self.quantity)
    }

    /// The series that `--benchmark` and `--quantity` allow, however many.
    pub(super) fn fitting<'a>(&self, recording: &'a Recording) -> Vec<&'a Series> {
        let all = recording.series.iter();
        all.filter(|series| self.allows(series)).collect()
    }

    fn allows(&self, series: &Series) -> bool {
        let benchmark = self.benchmark.as_deref();
        benchmark.is_none_or(|id| series.benchmark.as_str() == id)
            && self.quantity.is_none_or(|one| series.quantity() == one)
    }

    /// Keeps the series that `--benchmark` and `--quantity` allow, however many.
    ///
    /// # Errors
    /// [`SelectError`] when none is left.
    pub fn narrow(&self, recording: &mut Recording) -> Result<(), SelectError> {
        if let Err(error @ (SelectError::Nothing { .. } | SelectError::NoSuch { .. })) =
            self.series(recording)
        {
            return Err(error);
        }
        recording.series.retain(|series| self.allows(series));
        Ok(())
    }

    /// `base` with the figures that the flags give.
    #[must_use]
    pub fn policy(&self, base: &Policy) -> Policy {
        let velocity = self.critical_velocity;
        Policy {
            evacuation_time: self.evacuation_time.unwrap_or(base.evacuation_time),
            critical_velocity_mm_per_day: velocity.unwrap_or(base.critical_velocity_mm_per_day),
            ..base.clone()
        }
    }
}

/// Refuses a window of time, from `from` to `until`, in which none of these has a reading.
pub(super) fn refuse_empty(
    series: &[&Series],
    from: Option<Timestamp>,
    until: Option<Timestamp>,
) -> Result<(), NoSuchReadings> {
    let times = || {
        let readings = series.iter().flat_map(|one| &one.readings);
        readings.map(|reading| reading.time)
    };
    let is_within = |time: Timestamp| {
        from.is_none_or(|from| from <= time) && until.is_none_or(|until| time <= until)
    };
    if times().any(is_within) {
        return Ok(());
    }
    if let (Some(from), Some(until)) = (from, until)
        && from > until
    {
        return Err(NoSuchReadings(format!(
            "--from {from} is later than --until {until}: no reading lies between them"
        )));
    }
    let names: Vec<&str> = series.iter().map(|one| one.benchmark.as_str()).collect();
    let window = [("from", from), ("until", until)].into_iter();
    let window = window.filter_map(|(word, time)| Some(format!(" {word} {}", time?)));
    let (first, last) = (times().min(), times().max());
    let span = first.zip(last).map_or_else(String::new, |(first, last)| {
        format!(": expected a time among its readings, {first} to {last}")
    });
    Err(NoSuchReadings(format!(
        "benchmark {}: no reading{}{span}",
        names.join(", "),
        window.collect::<String>()
    )))
}

/// What a person should know of files that were read.
pub(super) fn say_remarks(remarks: &[(PathBuf, Remark)]) {
    for (file, remark) in remarks {
        exit::complain(&format_args!("{}: {remark}", file.display()));
    }
}

/// Warns on stderr of values that were not in order.
pub(super) fn warn_of(disorder: Disorder) {
    let kinds = [
        ("repeated an earlier one", disorder.repeated, "dropped"),
        (
            "gave another value for a time already read",
            disorder.corrected,
            "the later one stands",
        ),
        (
            "stood before an earlier time",
            disorder.out_of_order,
            "put in order",
        ),
        (
            "are a mark for a missing value where a reading should be",
            disorder.missing,
            "left out",
        ),
    ];
    if disorder.unended > 0 {
        let files = disorder.unended;
        exit::complain(&format_args!(
            "warning: files without an end: {files} (read as far as they go)"
        ));
    }
    for (what, values, remedy) in kinds {
        if values > 0 {
            exit::complain(&format_args!(
                "warning: values that {what}: {values} ({remedy})"
            ));
        }
    }
}

/// A column's name may hold `=`.
fn stated(text: &str) -> Result<(String, CovariateKind), String> {
    let parts = text.rsplit_once('=').filter(|(name, _)| !name.is_empty());
    let (name, kind) = parts.ok_or("write NAME=KIND, such as Nied_1h=rain")?;
    Ok((name.to_owned(), CovariateKind::parse(kind)?))
}

fn quantity(text: &str) -> Result<Quantity, String> {
    [Quantity::Displacement, Quantity::Velocity]
        .into_iter()
        .find(|quantity| quantity.name() == text)
        .ok_or_else(|| "expected displacement or velocity".to_owned())
}
