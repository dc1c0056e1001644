//! `score FILE...`: forecasts scored as they would have been made, against every rival.

mod rows;
mod text;
mod warning;

use super::args::{OutputArgs, ReadingArgs};
use super::columnar::TableArgs;
use super::exit::NoSuchReadings;
use super::{bar, exit, picture};
use crate::alert::Policy;
use crate::config::value;
use crate::figures;
use crate::plot::escaped;
use crate::reading::{Recording, Series, Timestamp, days_since};
use crate::score::{Card, METHODS, Truth, WholeRecord, card};
use anyhow::ensure;
use clap::ArgGroup;
use schemars::JsonSchema;
use serde::Serialize;
use std::path::PathBuf;
use warning::Warning;

/// How the slope ended, of which one of two flags says something.
const OUTCOME: &str = "outcome";

/// Score forecasts of the failure time as they would have been made, against rival methods
///
/// At each lead before the failure every method is given what had been measured by then, and nothing
/// later. A method with nothing to say is scored as saying that no failure comes. The warnings are
/// those of a replay of the record up to the failure.
#[derive(Debug, clap::Args)]
#[command(group(ArgGroup::new(OUTCOME).required(true)))]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    /// When the slope failed
    #[arg(long, value_name = "TIME", value_parser = value::instant, group = OUTCOME)]
    failure_time: Option<Timestamp>,
    /// It had not failed when the record ended
    #[arg(long, group = OUTCOME)]
    no_failure: bool,
    /// Draw when each forecast said that the slope would fail, as PNG where the name ends in .png, else as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    output: TableArgs,
}

/// What is printed of one benchmark.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct ScoreReport {
    /// Which.
    benchmark: String,
    /// When the slope failed; `None`: it had not.
    failure_time: Option<Timestamp>,
    /// Where each method was published.
    sources: Vec<&'static str>,
    #[serde(flatten)]
    card: Card,
    /// The levels that a replay called.
    warning: Warning,
}

impl ScoreReport {
    /// What is said where no forecast could have been made.
    fn nothing(&self) -> Option<String> {
        (self.card.leads.is_empty() && self.card.looks.is_empty()).then(|| {
            let before = match self.failure_time {
                Some(_) => " not long before the failure",
                None => "",
            };
            format!(
                "benchmark {}: too few readings for a forecast, and nothing to score: expected ten or more, half an \
                 hour apart or more,{before}",
                self.benchmark
            )
        })
    }
}

/// Reads the files and prints a scorecard for each benchmark.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let mut recording = args.readings.load()?.recording;
    args.readings.narrow(&mut recording)?;
    let policy = args.readings.policy(&Policy::default());
    let count = recording.series.len();
    ensure!(
        args.plot.is_none() || count == 1,
        "--plot draws one benchmark, and there are {count}: expected --benchmark"
    );
    let mut table = args.output.table::<rows::ScoreRow<'_>>()?;
    let format = args.output.lines();
    let output = OutputArgs { format };
    for (index, series) in recording.series.iter().enumerate() {
        let report = report(args.failure_time, &recording, series, &policy)?;
        if let Some(problem) = report.nothing() {
            if count == 1 {
                return Err(NoSuchReadings(problem).into());
            }
            exit::complain(&problem);
        }
        if let Some(file) = &args.plot {
            let svg = figures::life_expectancy(&report.card, report.failure_time);
            picture::write(file, &svg)?;
        }
        if let Some(table) = &mut table {
            for row in rows::of(&report) {
                table.row(&serde_json::to_value(row)?)?;
            }
            continue;
        }
        let blank = if index == 0 { "" } else { "\n" };
        output.print(&report, |report| format!("{blank}{}", text::text(report)))?;
    }
    match table {
        Some(table) => table.finish(),
        None => Ok(()),
    }
}

/// The scorecard and its figure as a part of a page.
pub(super) fn part(
    failure_time: Option<Timestamp>,
    recording: &Recording,
    series: &Series,
    policy: &Policy,
) -> anyhow::Result<String> {
    let report = report(failure_time, recording, series, policy)?;
    if let Some(problem) = report.nothing() {
        return Ok(format!("<p>{}</p>\n", escaped(&problem)));
    }
    let svg = figures::life_expectancy(&report.card, failure_time);
    Ok(format!(
        "<figure>\n{svg}</figure>\n<p>{}</p>\n<div class=\"wide scores\">{}</div>\n",
        text::meaning(&report),
        text::table(&report).html()
    ))
}

fn report(
    failure_time: Option<Timestamp>,
    recording: &Recording,
    series: &Series,
    policy: &Policy,
) -> anyhow::Result<ScoreReport> {
    let mut series = series.clone();
    let truth = match failure_time {
        None => Truth::Stood,
        Some(failure) => {
            let before = series.readings.len();
            series.readings.retain(|reading| reading.time <= failure);
            let after = before - series.readings.len();
            if after > 0 {
                exit::complain(&format_args!(
                    "benchmark {}: readings after the failure, which nothing is scored on: {after}",
                    series.benchmark
                ));
            }
            Truth::Failed(failure)
        }
    };
    let epoch = series.readings.first().map(|reading| reading.time);
    let epoch = epoch.ok_or_else(|| {
        NoSuchReadings(format!(
            "benchmark {}: expected readings before --failure-time",
            series.benchmark
        ))
    })?;
    let history = WholeRecord::of(
        &series,
        &recording.channels,
        policy.critical_velocity_mm_per_day,
    );
    let template = "{msg} {bar:40} {pos}/{len} forecasts, {elapsed}";
    let bar = bar::counted(0, template).with_message(format!("benchmark {}", series.benchmark));
    let mut card = card(&history, epoch, truth, METHODS, &mut |done, count| {
        bar.set_length(count);
        bar.set_position(done);
    });
    bar.finish_and_clear();
    if history.flow.is_empty() {
        leave_out_rivers(&mut card);
    }
    let until = match truth {
        Truth::Failed(failure) => failure,
        Truth::Stood => series.readings.last().map_or(epoch, |last| last.time),
    };
    let warning = warning::of(&series, &recording.channels, policy, until)?;
    Ok(ScoreReport {
        benchmark: series.benchmark.to_string(),
        failure_time,
        sources: METHODS
            .iter()
            .filter(|method| card.methods.contains(&method.name))
            .map(|method| method.source)
            .collect(),
        card,
        warning,
    })
}

/// Without a river the methods that weigh its flow have nothing to say.
fn leave_out_rivers(card: &mut Card) {
    let is_of_a_river = |name: &str| {
        let mut flowing = METHODS.iter().filter(|method| method.needs_flow);
        flowing.any(|method| method.name == name)
    };
    card.methods.retain(|name| !is_of_a_river(name));
    let of_leads = card.leads.iter_mut().map(|lead| &mut lead.scores);
    let of_looks = card.looks.iter_mut().map(|look| &mut look.scores);
    for scores in of_leads.chain(of_looks) {
        scores.retain(|name, _| !is_of_a_river(name));
    }
}

/// Hours between two times.
fn hours(from: Timestamp, to: Timestamp) -> f64 {
    24.0 * days_since(from, to)
}
