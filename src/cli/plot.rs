//! `plot FILE...`: one benchmark's crisis as one SVG or PNG, drawn from a replay.

use super::args::ReadingArgs;
use super::exit::{NoSuchReadings, UsageError};
use super::{explain, picture, replay};
use crate::alert::Policy;
use crate::figures::{self, Replayed};
use crate::monitor::{Event, Settings};
use crate::reading::{Recording, Series, Timestamp};
use anyhow::bail;
use jiff::civil::Date;
use jiff::tz::TimeZone;
use std::io::Write;
use std::path::PathBuf;

/// Draw a benchmark's crisis as one SVG or PNG: readings, forecasts as they were made, levels as they were called
///
/// All forecasts and levels are those of a replay of the same files. Times may be dates alone: midnight UTC.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    /// What to draw
    #[arg(long, value_enum, value_name = "KIND")]
    kind: PlotKind,
    /// When the slope collapsed
    #[arg(long, value_name = "TIME", value_parser = instant)]
    failure_time: Option<Timestamp>,
    /// Draw the forecast made with the readings until then, repeatable; default is three dates in the last half
    #[arg(long, value_name = "TIME", value_parser = instant, value_delimiter = ',')]
    at: Vec<Timestamp>,
    /// Stop at this time of the data
    #[arg(long, value_name = "TIME", value_parser = instant)]
    until: Option<Timestamp>,
    /// The file to write, replaced when it is there: PNG where its name ends in .png, else SVG; SVG on stdout when not given
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

/// What a plot shows.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum PlotKind {
    /// Readings, inverse velocity, the forecasts made at some dates, levels
    InverseVelocity,
    /// The time of collapse that was forecast against the time at which it was
    Forecast,
    /// How sure the law was of instability and of acceleration, the chances, levels
    Regime,
    /// What the law does not explain, as `explain` finds it
    Residual,
}

/// Replays the files and draws.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if args.kind != PlotKind::InverseVelocity && !args.at.is_empty() {
        let text =
            "--at chooses forecasts for --kind inverse-velocity; the other kinds draw all of them";
        bail!(UsageError(text.to_owned()));
    }
    if args.kind == PlotKind::Residual {
        return write(args, &residual(args)?);
    }
    let mut recording = args.readings.load()?.recording;
    let mut series = args.readings.series(&recording)?.clone();
    recording.series = vec![series.clone()];
    let events = events(args, &recording)?;
    if let Some(until) = args.until {
        series.readings.retain(|reading| reading.time <= until);
    }
    check_times(args, &series)?;
    let replayed = Replayed {
        series: &series,
        events: &events,
        collapse: args.failure_time,
    };
    let svg = match args.kind {
        PlotKind::InverseVelocity if args.at.is_empty() => {
            replayed.inverse_velocity(&replayed.three_dates())
        }
        PlotKind::InverseVelocity => replayed.inverse_velocity(&args.at),
        PlotKind::Forecast => replayed.forecasts(),
        PlotKind::Regime | PlotKind::Residual => replayed.regimes(),
    };
    write(args, &svg)
}

fn write(args: &Args, svg: &str) -> anyhow::Result<()> {
    match &args.output {
        Some(file) => picture::write(file, svg)?,
        None => std::io::stdout().lock().write_all(svg.as_bytes())?,
    }
    Ok(())
}

/// The residual of the law under a constant load, of the readings until `--until`.
fn residual(args: &Args) -> anyhow::Result<String> {
    let mut recording = args.readings.load()?.recording;
    if let Some(until) = args.until {
        for series in &mut recording.series {
            series.readings.retain(|reading| reading.time <= until);
        }
    }
    let series = args.readings.series(&recording)?;
    let explanation = explain::quick(
        series,
        &recording,
        &args.readings.policy(&Policy::default()),
    );
    let picture = figures::residual(&explanation).ok_or_else(|| {
        let benchmark = &series.benchmark;
        let why = explanation.remarks.first();
        NoSuchReadings(match why {
            Some(why) => format!("benchmark {benchmark}: no residual. {why}"),
            None => format!("benchmark {benchmark}: too few readings for a residual"),
        })
    })?;
    Ok(picture.svg)
}

fn events(args: &Args, recording: &Recording) -> anyhow::Result<Vec<Event>> {
    let settings = Settings {
        policy: args.readings.policy(&Policy::default()),
        ..Settings::default()
    };
    replay::events(recording, &settings, args.until)
}

/// Whether the times that are asked for lie where there is something to draw.
fn check_times(args: &Args, series: &Series) -> anyhow::Result<()> {
    let (id, readings) = (&series.benchmark, &series.readings);
    let (Some(first), Some(last)) = (readings.first(), readings.last()) else {
        let until = args
            .until
            .map_or_else(String::new, |until| format!(" up to {until}"));
        bail!(NoSuchReadings(format!(
            "benchmark {id} has no readings{until}"
        )));
    };
    let (first, last) = (first.time, last.time);
    if let Some(at) = args.at.iter().find(|at| !(first..=last).contains(at)) {
        let text = format!(
            "--at {at} lies outside the readings of benchmark {id}: expected a time from {first} to {last}"
        );
        bail!(UsageError(text));
    }
    if let Some(failure) = args.failure_time.filter(|failure| *failure <= first) {
        let text = format!(
            "--failure-time {failure} lies before the readings of benchmark {id}: expected a time after {first}"
        );
        bail!(NoSuchReadings(text));
    }
    Ok(())
}

/// A time with its offset, or a date alone.
fn instant(text: &str) -> Result<Timestamp, String> {
    let date = || {
        let midnight = text.parse::<Date>().ok()?.to_zoned(TimeZone::UTC).ok()?;
        Some(midnight.timestamp())
    };
    text.parse::<Timestamp>()
        .ok()
        .or_else(date)
        .ok_or_else(|| "expected a time such as 2012-05-15T01:30:00Z, or a date".to_owned())
}
