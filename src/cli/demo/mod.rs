//! `demo`: the archived crises through the daemon's own site, on an accelerated clock, with a real hook.

mod crisis;
mod marks;
mod serve;
pub(super) mod timeline;
mod verdict;

use super::bar;
use super::run::asynchronous;
use crate::alert::{Level, Policy};
use crate::cli::text::wrapped;
use crate::config::{ExtraMessages, HookConfig};
use crate::monitor::{Event, Settings};
use crate::reading::{Recording, Series};
use crate::runtime::ingest::{ReadOptions, read_files};
use crate::runtime::replay::{self, ReplayPace, ReplayPlan};
use crate::runtime::shutdown::Shutdown;
use anyhow::Context;
use crisis::{CRISES, Crisis};
use jiff::SignedDuration;
use std::collections::BTreeSet;
use std::io::{self, Write};
use std::net::SocketAddr;
use std::path::Path;
use std::time::Duration;
use timeline::Timeline;

/// Show the main job: archived crises replayed through the monitor reading by reading
///
/// Needs nothing. Alerts go to a sample hook, a real process; state lies in a temporary folder.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// How long each crisis takes to play, such as 5s; 0s plays as fast as the monitor works [default: 5s; with --serve 2min]
    #[arg(long, value_name = "DURATION", value_parser = humantime::parse_duration)]
    pace: Option<Duration>,
    /// Show the first crisis on the daemon's page instead, at this address, until interrupted
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:8642", value_parser = loopback)]
    serve: Option<SocketAddr>,
}

/// The demo's token is known to everybody.
fn loopback(text: &str) -> Result<SocketAddr, String> {
    let address: SocketAddr = text
        .parse()
        .map_err(|_| "write an address and a port, such as 127.0.0.1:8642".to_owned())?;
    if address.ip().is_loopback() {
        Ok(address)
    } else {
        Err("the demo is shown to this machine only: write 127.0.0.1 and a port".to_owned())
    }
}

/// How long a crisis takes where nothing else is asked for.
const PACE: Duration = Duration::from_secs(5);

const HOOK: &str = include_str!("../../../deploy/notify.sh");
/// What is said at the end.
const LAST_WORDS: &str = "
A reconstruction fulfils what the literature states of a slope whose readings
are not public; it is not data. recordings/README.md says what each rests on.
Next, with readings of your own: slipwatch init FILE; and slipwatch --help";
/// Columns of the screen.
const COLUMNS: usize = 80;
/// Where the sample hook writes.
const WRITTEN: &str = "hook.txt";

/// Plays every crisis, then the table.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let folder = tempfile::tempdir().context("cannot make a folder for the demo's state")?;
    if let Some(listen) = args.serve {
        return serve::serve(args, listen, folder.path());
    }
    let mut out = io::stdout().lock();
    let (mut table, mut ends) = (vec![verdict::HEAD.to_owned()], Vec::new());
    writeln!(out, "{}", timeline::legend())?;
    let runtime = asynchronous()?;
    for crisis in &CRISES {
        let mut recording = recording(folder.path(), crisis)?;
        let is_played = |series: &Series| crisis.benchmarks.contains(&series.benchmark.as_str());
        recording.series.retain(is_played);
        introduce(&mut out, crisis, &recording)?;
        let mut timeline = Timeline::new();
        runtime.block_on(play(
            args,
            folder.path(),
            crisis,
            &recording,
            &mut |event| {
                let line = timeline.take(event);
                line.map_or(Ok(()), |line| writeln!(out, "{line}"))
            },
        ))?;
        write!(out, "{}", timeline.pictures())?;
        show_hook(&mut out, folder.path())?;
        ends.push(verdict::happened(crisis));
        table.extend(
            timeline
                .records
                .iter()
                .map(|(id, record)| verdict::line(crisis, id, record)),
        );
    }
    writeln!(out, "\n=== What was called when, against what happened\n")?;
    for line in &table {
        writeln!(out, "{line}")?;
    }
    writeln!(out)?;
    for end in &ends {
        writeln!(out, "{}", indented(end))?;
    }
    writeln!(out, "{LAST_WORDS}")?;
    Ok(())
}

/// Reads the program's own copy of the recording.
fn recording(folder: &Path, crisis: &Crisis) -> anyhow::Result<Recording> {
    let file = folder.join(crisis.file);
    std::fs::write(&file, crisis.recording)
        .with_context(|| format!("cannot write {}", file.display()))?;
    let (recording, _) = read_files(&[file], &ReadOptions::default())?;
    Ok(recording)
}

fn introduce(out: &mut impl Write, crisis: &Crisis, recording: &Recording) -> io::Result<()> {
    let readings: usize = recording
        .series
        .iter()
        .map(|series| series.readings.len())
        .sum();
    writeln!(
        out,
        "\n=== {}, {}\n    {readings} readings; an evacuation takes {} h\n",
        crisis.site, crisis.kind, crisis.evacuation_hours
    )
}

async fn play(
    args: &Args,
    folder: &Path,
    crisis: &Crisis,
    recording: &Recording,
    each: &mut (dyn FnMut(&Event) -> io::Result<()> + '_),
) -> anyhow::Result<()> {
    let settings = Settings {
        policy: policy(crisis),
        ..Settings::default()
    };
    let hooks = [sample_hook(folder)?];
    let arrivals = replay::arrivals(recording);
    let plan = ReplayPlan {
        site: crisis.site,
        settings: &settings,
        hooks: &hooks,
        pace: pace(args.pace.unwrap_or(PACE), &arrivals),
        until: None,
    };
    let bar = bar::counted(
        arrivals.len() as u64,
        "{bar:40} {pos}/{len} values, {elapsed}",
    );
    let shutdown = Shutdown::on_signals().context("cannot listen for signals")?;
    let mut show = |event: &Event| {
        bar.set_position(arrivals.partition_point(|arrival| arrival.time <= event.time) as u64);
        bar.suspend(|| each(event))
    };
    replay::replay(recording, &plan, shutdown, &mut show).await?;
    bar.finish_and_clear();
    Ok(())
}

fn policy(crisis: &Crisis) -> Policy {
    Policy {
        evacuation_time: SignedDuration::from_hours(crisis.evacuation_hours),
        ..Policy::default()
    }
}

/// So many seconds of data a second that the whole crisis takes so long.
fn pace(length: Duration, arrivals: &[crate::runtime::tail::Arrival]) -> ReplayPace {
    let (Some(first), Some(last)) = (arrivals.first(), arrivals.last()) else {
        return ReplayPace::Max;
    };
    let span = last.time.duration_since(first.time).as_secs_f64();
    let times = span / length.as_secs_f64();
    if times.is_finite() && times > 0.0 {
        ReplayPace::Times(times)
    } else {
        ReplayPace::Max
    }
}

fn sample_hook(folder: &Path) -> anyhow::Result<HookConfig> {
    use std::os::unix::fs::PermissionsExt;
    let script = folder.join("notify.sh");
    std::fs::write(&script, HOOK)
        .and_then(|()| std::fs::set_permissions(&script, std::fs::Permissions::from_mode(0o755)))
        .with_context(|| format!("cannot write {}", script.display()))?;
    Ok(HookConfig {
        extra: ExtraMessages::default(),
        links: None,
        zone: "UTC".to_owned(),
        site: false,
        to: None,
        escalate_after: None,
        hours: None,
        benchmarks: BTreeSet::new(),
        run: vec![script.display().to_string(), WRITTEN.to_owned()],
        levels: vec![Level::Orange, Level::Red, Level::Unknown],
        timeout: Duration::from_secs(10),
        folder: folder.to_owned(),
        sandbox: false,
        writable: Vec::new(),
        launcher: None,
    })
}

/// A line by two blanks to the right, on as many lines as it needs.
fn indented(line: &str) -> String {
    wrapped(&format!("  {line}"), COLUMNS, "  ")
}

/// Prints what the hook wrote first, and empties its file for the next crisis.
fn show_hook(out: &mut impl Write, folder: &Path) -> anyhow::Result<()> {
    let file = folder.join(WRITTEN);
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    let count = text.lines().count();
    match text.lines().next() {
        None => writeln!(out, "\nthe hook, a process of its own, was not run")?,
        Some(line) => writeln!(
            out,
            "\nthe hook, a process of its own, was run {count} times; what it wrote first:\n{}",
            indented(line)
        )?,
    }
    std::fs::write(&file, "")?;
    Ok(())
}
