//! `init FILE...`: from files of readings to a site file.

mod clock;
mod dated;
mod dialect;
mod held;
mod inherited;
mod long;
mod marks;
mod numbers;
mod problems;
mod row_zone;
mod said;
mod text;
mod times;
mod unnamed;
mod unreadable;

use super::args::{CovariateArgs, DialectArgs, FileArgs, OutputArgs};
use super::check;
use super::exit::{self, UsageError};
use crate::config::{SourceKind, value};
use crate::reading::{CovariateKind, Dialect, SummerTime, Timestamp};
use crate::runtime::ingest::{
    IngestError, Measure, ReadOptions, TOA5, look_through, read_with_remarks, survey,
    survey_objects, text_format_of, unit_in_name, unpacked_name,
};
use anyhow::Context;
use dialect::Written;
use held::{FoundInFile, held};
use inherited::inherits_nothing;
use jiff::SignedDuration;
use jiff::tz::TimeZone;
use problems::Problems;
pub(super) use said::ConfigWritten;
use said::{say_beside, say_next, say_written};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// Write a site's config from files of readings: what they hold, how they are written, what to do next
///
/// Nothing is guessed: what the files leave open is said with the flag that decides it, and nothing is written then.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Files of readings as the logger writes them: CSV (.csv, .tsv, .txt), NDJSON (.ndjson, .jsonl), TOA5 (.dat), each also packed (.gz), or MCAP
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The config to write
    #[arg(short, long, value_name = "CONFIG", default_value = "site.toml")]
    output_config: PathBuf,
    /// What hooks call the site [default: the name of the config's folder]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// Where the daemon keeps what it knows, from the config's folder [default: state]; one that another site's files were read
    /// into is taken only where this names it
    #[arg(long, value_name = "FOLDER")]
    state_dir: Option<String>,
    /// A program to run when a level is entered or left, such as ./notify.sh
    #[arg(long, value_name = "PROGRAM")]
    hook: Option<String>,
    /// How long it takes to bring everyone out, such as 12h
    #[arg(long, value_name = "DURATION", value_parser = value::duration)]
    evacuation_time: Option<SignedDuration>,
    #[command(flatten)]
    covariates: CovariateArgs,
    /// Write over a config that is there
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// What is said of a table that has a header alone.
const NO_ROW: &str = "found a header and no row below it: how times and numbers are written is seen in the rows; run init again once the \
                      logger has written some, or give a former file of it and then write this one's path into the config";

/// What the config will say.
#[derive(Debug)]
struct InitPlan {
    name: String,
    state_dir: String,
    zone: Option<String>,
    dst: Option<String>,
    missing: Vec<String>,
    sources: Vec<PlannedSource>,
    benchmarks: Vec<PlannedBenchmark>,
    /// Columns and kinds of those whose names do not say what they measure.
    covariates: Vec<(String, CovariateKind)>,
    /// Of every velocity, where that is said.
    averaging: Option<String>,
    evacuation_time: Option<String>,
    hook: Option<String>,
}

#[derive(Debug)]
struct PlannedSource {
    id: String,
    kind: SourceKind,
    path: String,
    dialect: Dialect,
    /// The zone of its times, where no flag gives one and the name of their column does.
    zone: Option<TimeZone>,
    /// Day 0, where its times are days.
    day_zero: Option<DayZero>,
    /// Whether it has covariates and no benchmark.
    is_beside: bool,
}

/// When the days of a table are counted from.
#[derive(Debug)]
enum DayZero {
    Stated(Timestamp),
    Open,
}

#[derive(Debug)]
struct PlannedBenchmark {
    id: String,
    source: String,
    /// Its column and unit, where the column's name does not say whose readings it holds.
    column: Option<(String, String)>,
    is_velocity: bool,
    /// Whether the file has its velocity too: one of both is monitored.
    has_both: bool,
}

/// Writes the config, checks it, and says what to do next.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let config = &args.output_config;
    if config.exists() && !args.force {
        return Err(usage(format!(
            "{}: is there already; give another name with -o, or --force to write over it",
            config.display()
        )));
    }
    let plan = plan(args)?;
    let text = text::config(&plan);
    if args.state_dir.is_none() {
        inherits_nothing(&text, args, &plan)?;
    }
    say_idle(&plan, args);
    for map in &args.file.columns {
        if let Measure::Reading(unit) = map.measure
            && let Some(doubt) = unnamed::other_unit(&map.column, unit)
        {
            exit::complain(&doubt);
        }
    }
    std::fs::write(config, text).with_context(|| format!("cannot write {}", config.display()))?;
    say_written(args, &plan)?;
    check::check(config, args.output, true)?;
    say_next(args)
}

fn usage(problem: String) -> anyhow::Error {
    UsageError(problem).into()
}

/// What comes from a pipe is there but once, and a daemon would not find it again.
fn can_be_followed(file: &Path) -> anyhow::Result<()> {
    if file == Path::new("-") || file.exists() && !file.is_file() {
        let name = file.display();
        return Err(usage(format!(
            "{name}: is no file that a daemon could follow; write what it gives to a file, and name that"
        )));
    }
    Ok(())
}

fn plan(args: &Args) -> anyhow::Result<InitPlan> {
    let (mut problems, mut beside) = (Problems::default(), Vec::new());
    let (mut sources, mut benchmarks) = (Vec::new(), BTreeMap::new());
    let mut columns = BTreeSet::new();
    for file in &args.files {
        can_be_followed(file)?;
        let kind = kind_of(file)?;
        let written = match written(file, kind, args)? {
            Ok(written) => written,
            Err(open) => {
                for one in open {
                    problems.leave_open_of(file, one);
                }
                continue;
            }
        };
        let mut source = planned(file, kind, written, &sources, args)?;
        match held(file, &source, args, &mut columns)? {
            FoundInFile::Benchmarks(found) => {
                for benchmark in found {
                    if let Some(other) = benchmarks.insert(benchmark.id.clone(), benchmark) {
                        problems.leave_open(twice(file, &other));
                    }
                }
                sources.push(source);
            }
            FoundInFile::Covariates(names, problem) => {
                beside.push((file, names, problem));
                source.is_beside = true;
                sources.push(source);
            }
            FoundInFile::Open(problem) => problems.leave_open(problem),
            FoundInFile::Bad(problem) => problems.bad.push(problem),
        }
    }
    for (file, names, problem) in beside {
        if benchmarks.is_empty() {
            problems.leave_open(problem);
        } else {
            say_beside(file, &names);
        }
    }
    problems.open.extend(dated::days_of_one(&benchmarks));
    problems
        .open
        .extend(no_such_column(&sources, columns, args));
    problems.none()?;
    Ok(InitPlan {
        name: site_name(args),
        state_dir: args.state_dir.clone().unwrap_or_else(|| "state".to_owned()),
        zone: args
            .file
            .time_zone
            .as_ref()
            .and_then(|zone| zone.iana_name())
            .map(str::to_owned),
        dst: args.file.dst.and_then(summer_word),
        missing: args.file.missing.clone(),
        sources,
        benchmarks: benchmarks.into_values().collect(),
        covariates: args.covariates.stated.clone(),
        averaging: args.file.averaging.map(in_words),
        evacuation_time: args.evacuation_time.map(in_words),
        hook: args.hook.clone(),
    })
}

/// What is wrong with a `--column` that no file has; messages and recordings have no columns that could be known here.
fn no_such_column(
    sources: &[PlannedSource],
    columns: BTreeSet<String>,
    args: &Args,
) -> Option<String> {
    let has_columns =
        |source: &PlannedSource| matches!(source.kind, SourceKind::Csv | SourceKind::Toa5);
    let mut maps = args.file.columns.iter();
    let unknown = maps.find(|map| !columns.contains(&map.column))?;
    let are_all_known = sources.len() == args.files.len() && sources.iter().all(has_columns);
    are_all_known.then(|| {
        let no_such = IngestError::NoSuchColumn {
            column: unknown.column.clone(),
            available: columns.into_iter().collect(),
        };
        format!("--column: {no_such}")
    })
}

/// The source of a file that is written so, after those `before` it.
fn planned(
    file: &Path,
    kind: SourceKind,
    written: Written,
    before: &[PlannedSource],
    args: &Args,
) -> anyhow::Result<PlannedSource> {
    let day_zero = written.is_in_days.then(|| {
        let stated = args.file.epoch.map(DayZero::Stated);
        stated.unwrap_or(DayZero::Open)
    });
    let takes_named = written.needs_zone && args.file.time_zone.is_none();
    Ok(PlannedSource {
        id: source_id(file, before),
        kind,
        path: relative(file, &args.output_config)?,
        dialect: written.dialect,
        zone: written.zone.filter(|_| takes_named),
        day_zero,
        is_beside: false,
    })
}

/// `1h` of an hour.
fn in_words(span: SignedDuration) -> String {
    humantime::format_duration(span.unsigned_abs()).to_string()
}

/// Says of flags that no file is there for.
fn say_idle(plan: &InitPlan, args: &Args) {
    let in_days = plan.sources.iter().any(|source| source.day_zero.is_some());
    if args.file.epoch.is_some() && !in_days {
        exit::complain(&"--epoch says nothing here: no file has a column t_days");
    }
    let velocities = plan.benchmarks.iter().any(|one| one.is_velocity);
    if args.file.averaging.is_some() && !velocities {
        exit::complain(&"--averaging says nothing here: no benchmark is watched by its velocity");
    }
}

fn twice(file: &Path, other: &PlannedBenchmark) -> String {
    format!(
        "{}: benchmark {:?} is in source {:?} too. If these are two sensors, give each its own id with --column NAME=ID:QUANTITY:UNIT; where \
         both files name the column alike, run init for one of them, and copy its [[source]] and [[benchmark]] in the config for the other, with \
         another id and path. If it is one sensor, whose files follow each other in time, name one of them and then write its path with a *, as \
         in path = \"toc-*.csv\"",
        file.display(),
        other.id,
        other.source
    )
}

fn summer_word(summer: SummerTime) -> Option<String> {
    let word = match summer {
        SummerTime::Reject => return None,
        SummerTime::Earlier => "earlier",
        SummerTime::Later => "later",
        SummerTime::Standard => "standard",
    };
    Some(word.to_owned())
}

fn kind_of(file: &Path) -> anyhow::Result<SourceKind> {
    let name = unpacked_name(file);
    let ending = name
        .extension()
        .unwrap_or_default()
        .to_string_lossy()
        .to_ascii_lowercase();
    let format = text_format_of(file).map_or(ending.as_str(), |format| format.name);
    let kind = SourceKind::ALL
        .into_iter()
        .find(|kind| kind.name() == format);
    if kind.is_none() {
        // The reader knows what to say of such a file.
        read_with_remarks(&[file.to_owned()], &ReadOptions::default())?;
    }
    Ok(kind.unwrap_or(SourceKind::Csv))
}

/// How the file is written, or what of that it leaves open.
fn written(
    file: &Path,
    kind: SourceKind,
    args: &Args,
) -> anyhow::Result<Result<Written, Vec<String>>> {
    let has_zone = args.file.time_zone.is_some();
    let is_mapped = |name: &str| args.file.columns.iter().any(|map| map.column == name);
    let found = match kind {
        SourceKind::Csv => of_a_table(file, args, &is_mapped)?,
        SourceKind::Ndjson | SourceKind::Toa5 | SourceKind::Mcap => {
            if kind == SourceKind::Toa5 {
                // What is no such table is refused before anything is asked about it.
                look_through(&TOA5, file, &args.file.options())?;
            }
            let dialect = stated_times(kind, &args.file.dialect);
            let rows = match kind {
                SourceKind::Ndjson => survey_objects(file)?,
                SourceKind::Csv | SourceKind::Toa5 | SourceKind::Mcap => None,
            };
            let points = rows.and_then(|rows| long::names_of_points(&rows, &dialect, &is_mapped));
            points.map_or_else(
                || {
                    Ok(Written {
                        dialect,
                        needs_zone: kind == SourceKind::Toa5,
                        zone: None,
                        is_in_days: false,
                        doubts: Vec::new(),
                    })
                },
                |problem| Err(vec![problem]),
            )
        }
    };
    for doubt in found.iter().flat_map(|written| &written.doubts) {
        exit::complain(&format_args!("{}: {doubt}", file.display()));
    }
    if let (Ok(written), Some(stated)) = (&found, &args.file.time_zone) {
        let names = written.dialect.time_columns.iter();
        let doubts = names.filter_map(|name| clock::another_zone(name, stated));
        doubts.for_each(|doubt| exit::complain(&format_args!("{}: {doubt}", file.display())));
    }
    Ok(found.and_then(|written| {
        if written.needs_zone && !has_zone && written.zone.is_none() {
            return Err(vec![
                "its times state no offset: give --time-zone with the zone of the logger's clock, such as Europe/Rome \
                 or UTC (and --dst standard for a clock without summer time)"
                    .to_owned(),
            ]);
        }
        Ok(written)
    }))
}

/// The same of a table of text.
fn of_a_table(
    file: &Path,
    args: &Args,
    is_mapped: &dyn Fn(&str) -> bool,
) -> anyhow::Result<Result<Written, Vec<String>>> {
    let survey = match survey(file, &args.file.dialect.dialect()) {
        Err(IngestError::Empty { missing: "row", .. }) => {
            return Ok(Err(vec![NO_ROW.to_owned()]));
        }
        surveyed => surveyed?,
    };
    if let Some(problem) = unreadable::header(&survey) {
        return Ok(Err(vec![problem]));
    }
    if let Some(remark) = &survey.encoding {
        exit::complain(&format_args!("{}: {remark}", file.display()));
    }
    for doubt in survey
        .names
        .iter()
        .filter_map(|name| unnamed::not_a_total(name))
    {
        exit::complain(&format_args!("{}: {doubt}", file.display()));
    }
    let stated_unit = |name: &str| {
        let mut maps = args.file.columns.iter();
        let (Measure::Reading(unit) | Measure::Sigma(unit)) =
            maps.find(|map| map.column == name)?.measure;
        Some(unit)
    };
    let unit_of = |name: &str| stated_unit(name).or_else(|| unit_in_name(name));
    let written = dialect::written(&survey, &args.file.dialect, &unit_of);
    Ok(written.and_then(|mut written| {
        if let Some(problem) = long::names_of_points(&survey, &written.dialect, is_mapped) {
            return Err(vec![problem]);
        }
        let doubt = row_zone::follow(&survey, &mut written, args.file.time_zone.as_ref());
        written.doubts.extend(doubt.map_err(|open| vec![open])?);
        Ok(written)
    }))
}

/// How times are written where nothing but the flags say it.
fn stated_times(kind: SourceKind, stated: &DialectArgs) -> Dialect {
    if kind != SourceKind::Ndjson {
        return Dialect::default();
    }
    Dialect {
        time_format: stated.time_format.clone().unwrap_or_default(),
        time_columns: stated.time_columns.clone(),
        ..Dialect::default()
    }
}

fn source_id(file: &Path, before: &[PlannedSource]) -> String {
    let name = unpacked_name(file);
    let stem = name
        .file_stem()
        .unwrap_or_default()
        .to_string_lossy()
        .into_owned();
    let taken: BTreeSet<&str> = before.iter().map(|source| source.id.as_str()).collect();
    if !taken.contains(stem.as_str()) {
        return stem;
    }
    let numbered = (2..).map(|number| format!("{stem}-{number}"));
    numbered
        .into_iter()
        .find(|id| !taken.contains(id.as_str()))
        .unwrap_or(stem)
}

/// The file's path as the config has it: relative where the file lies below the config's folder.
fn relative(file: &Path, config: &Path) -> anyhow::Result<String> {
    let whole = std::path::absolute(file)?;
    let config = std::path::absolute(config)?;
    let folder = config.parent().unwrap_or(Path::new("/"));
    let path = whole.strip_prefix(folder).unwrap_or(&whole);
    match path.to_str() {
        Some(text) if !text.contains('*') => Ok(text.to_owned()),
        _ => Err(usage(format!(
            "{}: a name in UTF-8 and without * is needed; rename the file",
            file.display()
        ))),
    }
}

fn site_name(args: &Args) -> String {
    let config = std::path::absolute(&args.output_config).unwrap_or_default();
    let folder = config.parent().and_then(Path::file_name);
    let folder = folder.map(|name| name.to_string_lossy().into_owned());
    args.name
        .clone()
        .or(folder)
        .unwrap_or_else(|| "site".to_owned())
}
