//! `replay FILE...`: the monitor over recorded readings, in data time.

use super::args::{FILE_FLAGS, OutputFormat, ReadingArgs};
use super::bar::{self, BarInTime};
use super::columnar::{RowSink, TableArgs};
use super::demo::timeline::Timeline;
use super::exit::UsageError;
use super::run::asynchronous;
use super::{exit, text, watched};
use crate::config::{self, Config, value};
use crate::monitor::{Event, Settings};
use crate::reading::{BenchmarkId, Quantity, Recording, SelectError, Series, Timestamp};
use crate::runtime::log::{self, LogFormat};
use crate::runtime::record;
use crate::runtime::replay::{self, ReplayPace, ReplayPlan};
use crate::runtime::sandbox::OURSELVES;
use crate::runtime::shutdown::Shutdown;
use crate::store::Store;
use anyhow::Context;
use jiff::tz::TimeZone;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};

/// What a site without a config is called.
const NAMELESS: &str = "replay";
/// Fewer columns leave no room for a time and a name.
const LEAST_COLUMNS: i64 = 40;
/// What a line begins with that continues an event.
const CONTINUED: &str = "    ";

/// Play recorded readings through the monitor, in their own time
///
/// The events are those that the daemon would have said; the last one is a summary.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    /// The site whose alert policy and averaging hold; default is the policy's defaults, with --state what the daemon had
    #[arg(long, value_name = "CONFIG")]
    config: Option<PathBuf>,
    /// max, or how many seconds of data go by in a second
    #[arg(long, value_name = "max|N", default_value = "max", value_parser = pace)]
    speed: ReplayPace,
    /// Play what the daemon of this state folder took in, in the order in which it did, instead of files
    #[arg(long, value_name = "DIR", conflicts_with_all = ["hooks", "quantity", "files", "channels"], conflicts_with_all = FILE_FLAGS)]
    state: Option<PathBuf>,
    /// Stop at this time of the data
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    until: Option<Timestamp>,
    /// Also write the readings and what was said of them into this MCAP file: for Foxglove, or to be replayed again
    #[arg(long, value_name = "OUT.mcap", value_parser = mcap_file)]
    record: Option<PathBuf>,
    /// Run the hooks of --config, marked as an exercise
    #[arg(long, requires = "config")]
    hooks: bool,
    /// Text in lines of at most so many columns, such as 80; default is a line for each event
    #[arg(long, value_name = "COLUMNS", value_parser = clap::value_parser!(u16).range(LEAST_COLUMNS..))]
    width: Option<u16>,
    #[command(flatten)]
    output: TableArgs,
}

/// Replays the files and prints the events.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    log::init(LogFormat::Text);
    if let Some(folder) = &args.state {
        return run_state(args, folder);
    }
    let mut config = args.config.as_deref().map(config::load).transpose()?;
    if let Some(config) = &mut config {
        config.sandbox_hooks(Path::new(OURSELVES));
    }
    for warning in config.iter().flat_map(|config| &config.warnings) {
        exit::complain(warning);
    }
    let loaded = match &config {
        Some(config) => watched::load(&args.readings, config)?,
        None => args.readings.load()?,
    };
    let mut recording = loaded.recording;
    args.readings.narrow(&mut recording)?;
    if let Some(config) = &config {
        lend_averaging(&mut recording, config);
    }
    let settings = settings(args, config.as_ref());
    let plan = ReplayPlan {
        site: config.as_ref().map_or(NAMELESS, |config| &config.site.name),
        settings: &settings,
        hooks: config
            .as_ref()
            .filter(|_| args.hooks)
            .map_or(&[], |config| &config.hooks),
        pace: args.speed,
        until: args.until,
    };
    let zone = config
        .as_ref()
        .map_or(TimeZone::UTC, |config| config.site.time_zone.clone());
    let mut printer = Printer::new(args, zone)?;
    asynchronous()?.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        // Where the lines are seen they say how far it has come.
        let is_seen = io::stdout().is_terminal();
        let bar = (!is_seen).then(|| BarInTime::of(&recording, args.until));
        let mut print = |event: &Event| {
            if let Some(bar) = &bar {
                bar.moved(event.time);
            }
            printer.print(event)
        };
        anyhow::Ok(replay::replay(&recording, &plan, shutdown, &mut print).await?)
    })?;
    if let Some(until) = args.until {
        cut(&mut recording, until);
    }
    printer.end(args.record.as_deref(), || Ok(recording))
}

/// Leaves what had been measured until then.
fn cut(recording: &mut Recording, until: Timestamp) {
    for series in &mut recording.series {
        series.readings.retain(|reading| reading.time <= until);
    }
    for channel in &mut recording.channels {
        channel.samples.retain(|sample| sample.time <= until);
    }
}

/// Prints the events of the stored input; with `--benchmark` those of one benchmark and of the site as a whole.
fn run_state(args: &Args, folder: &Path) -> anyhow::Result<()> {
    let has_figure =
        args.readings.evacuation_time.is_some() || args.readings.critical_velocity.is_some();
    if args.config.is_none() && has_figure {
        let text = "--evacuation-time and --critical-velocity change a policy: with --state give the one that they change with --config";
        return Err(UsageError(text.to_owned()).into());
    }
    let store = Store::look(folder)
        .with_context(|| format!("cannot read the state in {}", folder.display()))?;
    let wanted = args.readings.benchmark.as_ref().map(BenchmarkId::new);
    if let Some(asked) = &wanted {
        let known = store.benchmarks()?;
        if !known.contains_key(asked) {
            return Err(SelectError::NoSuch {
                asked: format!("benchmark {asked}"),
                available: known.keys().map(ToString::to_string).collect(),
            }
            .into());
        }
    }
    let is_wanted =
        |event: &Event| wanted.is_none() || event.benchmark.is_none() || event.benchmark == wanted;
    let config = args.config.as_deref().map(config::load).transpose()?;
    for warning in config.iter().flat_map(|config| &config.warnings) {
        exit::complain(warning);
    }
    let settings = config.as_ref().map(|config| settings(args, Some(config)));
    let zone = config.map_or(TimeZone::UTC, |config| config.site.time_zone);
    let mut printer = Printer::new(args, zone)?;
    asynchronous()?.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        // Where the lines are seen they say how far it has come.
        let bar = (!io::stdout().is_terminal()).then(bar::shared);
        let mut progress = |share: f64| {
            if let Some(bar) = &bar {
                bar::share(bar, share);
            }
        };
        let mut print = |event: &Event| {
            if is_wanted(event) {
                printer.print(event)?;
            }
            Ok(())
        };
        let settings = settings.as_ref();
        let played = replay::replay_state(
            &store,
            settings,
            args.until,
            &shutdown,
            &mut progress,
            &mut print,
        );
        if let Some(bar) = &bar {
            bar.finish_and_clear();
        }
        anyhow::Ok(played?)
    })?;
    printer.end(args.record.as_deref(), || {
        let mut taken = record::taken_in(&store, args.until)?;
        let is_wanted =
            |series: &Series| wanted.as_ref().is_none_or(|one| series.benchmark == *one);
        taken.series.retain(is_wanted);
        Ok(taken)
    })
}

/// The events of a recording, for those who do not print them.
pub(super) fn events(
    recording: &Recording,
    settings: &Settings,
    until: Option<Timestamp>,
) -> anyhow::Result<Vec<Event>> {
    let plan = ReplayPlan {
        site: NAMELESS,
        settings,
        hooks: &[],
        pace: ReplayPace::Max,
        until,
    };
    let mut events = Vec::new();
    asynchronous()?.block_on(async {
        let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
        let bar = BarInTime::of(recording, until);
        let mut keep = |event: &Event| {
            bar.moved(event.time);
            events.push(event.clone());
            Ok(())
        };
        replay::replay(recording, &plan, shutdown, &mut keep).await?;
        anyhow::Ok(())
    })?;
    Ok(events)
}

/// A line for each event; as text, at the end velocity, level and forecast of each benchmark as marks.
struct Printer {
    out: io::StdoutLock<'static>,
    format: OutputFormat,
    /// Instead of lines, where that is asked for.
    table: Option<Box<dyn RowSink>>,
    zone: TimeZone,
    /// Columns of a line, where that is asked for.
    width: Option<usize>,
    timeline: Timeline,
    /// All of them, where they are to be recorded.
    kept: Option<Vec<Event>>,
}

impl Printer {
    fn new(args: &Args, zone: TimeZone) -> anyhow::Result<Self> {
        Ok(Self {
            out: io::stdout().lock(),
            format: args.output.lines(),
            table: args.output.table::<Event>()?,
            zone,
            width: args.width.map(usize::from),
            timeline: Timeline::new(),
            kept: args.record.is_some().then(Vec::new),
        })
    }

    fn print(&mut self, event: &Event) -> io::Result<()> {
        if let Some(kept) = &mut self.kept {
            kept.push(event.clone());
        }
        if let Some(table) = &mut self.table {
            let row = serde_json::to_value(event)?;
            return table.row(&row).map_err(io::Error::other);
        }
        let line = match self.format {
            OutputFormat::Json => serde_json::to_string(event)?,
            OutputFormat::Text => {
                self.timeline.take(event);
                let line = text::line(event, &self.zone);
                match self.width {
                    Some(columns) => text::wrapped(&line, columns, CONTINUED),
                    None => line,
                }
            }
        };
        writeln!(self.out, "{line}")
    }

    /// Prints what comes after the events, and records them with the readings that they rest on, where that is asked for.
    fn end(
        mut self,
        file: Option<&Path>,
        readings: impl FnOnce() -> anyhow::Result<Recording>,
    ) -> anyhow::Result<()> {
        write!(self.out, "{}", self.timeline.bands())?;
        if let Some(table) = self.table {
            table.finish()?;
        }
        if let (Some(file), Some(events)) = (file, &self.kept) {
            let words = |event: &Event| text::line(event, &self.zone);
            record::write(file, &readings()?, events, &words)?;
        }
        Ok(())
    }
}

fn settings(args: &Args, config: Option<&Config>) -> Settings {
    let mut settings = config.map_or_else(Settings::default, |config| config.settings.clone());
    settings.policy = args.readings.policy(&settings.policy);
    for policy in settings.benchmarks.values_mut() {
        *policy = args.readings.policy(policy);
    }
    settings
}

/// Velocities whose file states no averaging have that of the config, as in the daemon.
fn lend_averaging(recording: &mut Recording, config: &Config) {
    for series in &mut recording.series {
        let mut known = config.benchmarks.iter();
        let ours = known.find(|one| one.id == series.benchmark);
        if series.quantity() == Quantity::Velocity && series.averaging.is_none() {
            series.averaging = ours.and_then(|benchmark| benchmark.averaging);
        }
    }
}

/// Only by its ending is it read as what it is.
fn mcap_file(text: &str) -> Result<PathBuf, String> {
    let file = PathBuf::from(text);
    let is_mcap = file
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("mcap"));
    is_mcap
        .then_some(file)
        .ok_or_else(|| "expected a name that ends in .mcap".to_owned())
}

fn pace(text: &str) -> Result<ReplayPace, String> {
    if text == "max" {
        return Ok(ReplayPace::Max);
    }
    match text.parse::<f64>() {
        Ok(times) if times.is_finite() && times > 0.0 => Ok(ReplayPace::Times(times)),
        Ok(_) | Err(_) => Err("expected max or a number above 0".to_owned()),
    }
}
