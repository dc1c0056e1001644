//! `init FILE...`: from files of readings to a site file.

mod dialect;
mod text;
mod times;
mod unnamed;

use super::args::{DialectArgs, FileArgs, OutputArgs, OutputFormat};
use super::check;
use super::exit::{self, UsageError};
use crate::config::{SourceKind, value};
use crate::reading::{BenchmarkId, Dialect, Quantity, SummerTime, TimeFormat, Unit};
use crate::runtime::ingest::{
    FileSurvey, Measure, ReadOptions, TextFormat, look_through, read_with_remarks, survey,
    text_format_of, unpacked_name,
};
use dialect::Written;
use jiff::SignedDuration;
use schemars::JsonSchema;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use unnamed::without_readings;

/// Write a site's config from files of readings: what they hold, how they are written, what to do next
///
/// Nothing is guessed: what the files leave open is said with the flag that decides it, and nothing is written then.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Files of readings as the logger writes them: CSV, NDJSON, TOA5 or MCAP by the name's ending
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The config to write
    #[arg(short, long, value_name = "CONFIG", default_value = "site.toml")]
    output_config: PathBuf,
    /// What hooks call the site [default: the name of the config's folder]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// A program to run when a level is entered or left, such as ./notify.sh
    #[arg(long, value_name = "PROGRAM")]
    hook: Option<String>,
    /// How long it takes to bring everyone out, such as 12h
    #[arg(long, value_name = "DURATION", value_parser = value::duration)]
    evacuation_time: Option<SignedDuration>,
    /// Write over a config that is there
    #[arg(long)]
    force: bool,
    #[command(flatten)]
    file: FileArgs,
    #[command(flatten)]
    output: OutputArgs,
}

/// What the config will say.
#[derive(Debug)]
struct InitPlan {
    name: String,
    zone: Option<String>,
    dst: Option<String>,
    missing: Vec<String>,
    sources: Vec<PlannedSource>,
    benchmarks: Vec<PlannedBenchmark>,
    evacuation_time: Option<String>,
    hook: Option<String>,
}

#[derive(Debug)]
struct PlannedSource {
    id: String,
    kind: SourceKind,
    path: String,
    dialect: Dialect,
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
    std::fs::write(config, text::config(&plan))?;
    say_written(args, &plan)?;
    check::check(config, args.output, true)?;
    say_next(args)
}

fn usage(problem: String) -> anyhow::Error {
    UsageError(problem).into()
}

fn plan(args: &Args) -> anyhow::Result<InitPlan> {
    let mut problems = Vec::new();
    let (mut sources, mut benchmarks) = (Vec::new(), BTreeMap::new());
    for file in &args.files {
        let kind = kind_of(file)?;
        let written = match written(file, kind, args)? {
            Ok(written) => written,
            Err(open) => {
                problems.extend(
                    open.into_iter()
                        .map(|one| format!("{}: {one}", file.display())),
                );
                continue;
            }
        };
        let source = PlannedSource {
            id: source_id(file, &sources),
            kind,
            path: relative(file, &args.output_config)?,
            dialect: written.dialect,
        };
        match held(file, &source, args)? {
            Ok(found) => {
                for benchmark in found {
                    if let Some(other) = benchmarks.insert(benchmark.id.clone(), benchmark) {
                        problems.push(twice(file, &other));
                    }
                }
                sources.push(source);
            }
            Err(problem) => problems.push(problem),
        }
    }
    if !problems.is_empty() {
        return Err(usage(problems.join("\n")));
    }
    Ok(InitPlan {
        name: site_name(args),
        zone: args
            .file
            .time_zone
            .as_ref()
            .and_then(|zone| zone.iana_name())
            .map(str::to_owned),
        dst: summer_word(args.file.dst),
        missing: args.file.missing.clone(),
        sources,
        benchmarks: benchmarks.into_values().collect(),
        evacuation_time: args
            .evacuation_time
            .map(|span| format!("{}s", span.as_secs())),
        hook: args.hook.clone(),
    })
}

fn twice(file: &Path, other: &PlannedBenchmark) -> String {
    format!(
        "{}: benchmark {:?} is in source {:?} too; give each its own id with --column NAME=ID:QUANTITY:UNIT, \
         or name one of the files and then write its path with a * for the others, as in path = \"toc-*.csv\"",
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
    let found = match kind {
        SourceKind::Csv => {
            let survey = survey(file, args.file.dialect.delimiter)?;
            if let Some(remark) = &survey.encoding {
                exit::complain(&format_args!("{}: {remark}", file.display()));
            }
            dialect::written(&survey, &args.file.dialect)
        }
        SourceKind::Ndjson | SourceKind::Toa5 | SourceKind::Mcap => Ok(Written {
            dialect: Dialect {
                time_format: stated_format(kind, &args.file.dialect),
                ..Dialect::default()
            },
            needs_zone: kind == SourceKind::Toa5,
        }),
    };
    Ok(found.and_then(|written| {
        if written.needs_zone && !has_zone {
            return Err(vec![
                "its times state no offset: give --time-zone with the zone of the logger's clock, such as Europe/Rome \
                 or UTC (and --dst standard for a clock that is never put forward)"
                    .to_owned(),
            ]);
        }
        Ok(written)
    }))
}

/// How times are written where nothing but the flag says it.
fn stated_format(kind: SourceKind, stated: &DialectArgs) -> TimeFormat {
    let stated = stated.time_format.clone();
    stated
        .filter(|_| kind == SourceKind::Ndjson)
        .unwrap_or_default()
}

/// The benchmarks that the file holds, or which flag names them.
fn held(
    file: &Path,
    source: &PlannedSource,
    args: &Args,
) -> anyhow::Result<Result<Vec<PlannedBenchmark>, String>> {
    let options = ReadOptions {
        dialect: source.dialect.clone(),
        ..args.file.options()
    };
    let looked = look(file, source.kind, &options)?;
    let stated = |benchmark: &BenchmarkId, unit: Unit| {
        let mut maps = args.file.columns.iter();
        let map =
            maps.find(|map| map.benchmark == *benchmark && map.measure == Measure::Reading(unit));
        map.map(|map| (map.column.clone(), unit.to_string()))
    };
    let found = looked
        .readings
        .iter()
        .map(|(benchmark, unit)| PlannedBenchmark {
            id: benchmark.as_str().to_owned(),
            source: source.id.clone(),
            column: stated(benchmark, *unit),
            is_velocity: unit.quantity() == Quantity::Velocity,
            has_both: false,
        });
    let found: Vec<PlannedBenchmark> = found.collect();
    if found.is_empty() {
        return Ok(Err(without_readings(file, &looked)));
    }
    Ok(Ok(one_quantity_each(found)))
}

/// The displacement of each benchmark that has its velocity too: the config names each benchmark once.
fn one_quantity_each(mut found: Vec<PlannedBenchmark>) -> Vec<PlannedBenchmark> {
    let with = |velocity: bool, found: &[PlannedBenchmark]| -> BTreeSet<String> {
        let of_it = found.iter().filter(|one| one.is_velocity == velocity);
        of_it.map(|one| one.id.clone()).collect()
    };
    let (displacements, velocities) = (with(false, &found), with(true, &found));
    found.retain(|one| !one.is_velocity || !displacements.contains(&one.id));
    for one in &mut found {
        one.has_both = !one.is_velocity && velocities.contains(&one.id);
    }
    found
}

fn look(file: &Path, kind: SourceKind, options: &ReadOptions) -> anyhow::Result<FileSurvey> {
    let Some(format) = TextFormat::named(kind.name()) else {
        let read = read_with_remarks(&[file.to_owned()], options)?;
        let series = read.recording.series.into_iter();
        return Ok(FileSurvey {
            readings: series.map(|one| (one.benchmark, one.unit)).collect(),
            ..FileSurvey::default()
        });
    };
    Ok(look_through(format, file, options)?)
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

/// What was written; the answer of `check` follows.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct ConfigWritten<'a> {
    /// The file.
    config: &'a Path,
    /// The benchmarks in it.
    benchmarks: Vec<&'a str>,
    /// What to do next: each command, and why.
    next: Vec<(String, &'static str)>,
}

fn say_written(args: &Args, plan: &InitPlan) -> anyhow::Result<()> {
    let mut stdout = std::io::stdout().lock();
    let config = args.output_config.display();
    match args.output.format {
        OutputFormat::Text => {
            let (sources, benchmarks) = (plan.sources.len(), plan.benchmarks.len());
            writeln!(
                stdout,
                "wrote {config} (sources: {sources}, benchmarks: {benchmarks}); it is checked now\n"
            )?;
        }
        OutputFormat::Json => {
            let ids = plan
                .benchmarks
                .iter()
                .map(|benchmark| benchmark.id.as_str());
            let written = ConfigWritten {
                config: &args.output_config,
                benchmarks: ids.collect(),
                next: next(args),
            };
            writeln!(stdout, "{}", serde_json::to_string(&written)?)?;
        }
    }
    Ok(())
}

fn say_next(args: &Args) -> anyhow::Result<()> {
    if args.output.format == OutputFormat::Json {
        return Ok(());
    }
    let mut stdout = std::io::stdout().lock();
    writeln!(
        stdout,
        "\nIs all this as you meant it? If not, edit {}. Then:",
        args.output_config.display()
    )?;
    for (command, what) in next(args) {
        writeln!(stdout, "  {command:WIDTH$}  {what}")?;
    }
    Ok(())
}

/// Columns of a command, beside which stands what it does.
const WIDTH: usize = 46;

/// The path as a shell takes it for one word.
fn in_shell(path: &Path) -> String {
    let text = path.display().to_string();
    let is_plain = |letter: char| letter.is_alphanumeric() || "/._-+:,@%".contains(letter);
    let text = if text.starts_with('-') {
        format!("./{text}")
    } else {
        text
    };
    if !text.is_empty() && text.chars().all(is_plain) {
        return text;
    }
    format!("'{}'", text.replace('\'', "'\\''"))
}

/// The commands that come next, and what each does.
fn next(args: &Args) -> Vec<(String, &'static str)> {
    let config = in_shell(&args.output_config);
    let files: Vec<String> = args.files.iter().map(|file| in_shell(file)).collect();
    let mut next = vec![
        (
            format!("slipwatch doctor {config}"),
            "is this machine right for it",
        ),
        (
            format!("slipwatch replay {} --config {config}", files.join(" ")),
            "what it would have said so far",
        ),
    ];
    if args.hook.is_some() {
        next.push((
            format!("slipwatch hook test --config {config}"),
            "run the hook once, marked as a test",
        ));
    }
    next.push((
        format!("slipwatch run {config}"),
        "watch, until it is stopped",
    ));
    next.push((
        format!("slipwatch status --config {config}"),
        "how the site stands, while it runs",
    ));
    next
}
