//! `sweep FILE`: the inversion over growing `t_max`, a row each.

use super::args::{OutputArgs, ReadingArgs, refuse_empty};
use super::bar;
use super::exit::NoSuchReadings;
use super::fit::{InversionArgs, REGIMES_DIFFER};
use super::table::{TextTable, number, time};
use crate::alert::percent_in_words;
use crate::inversion::{SweepOptions, SweepReport, SweepRow, sweep_showing};
use crate::reading::Timestamp;

/// Invert one benchmark's readings up to one `t_max` after another
///
/// What each inversion would have said at the time: its regime, m, failure time and alternatives.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    #[command(flatten)]
    inversion: InversionArgs,
    /// The first and the last `t_max`; either may be left out
    #[arg(long, value_name = "FIRST..LAST", value_parser = range, default_value = "..")]
    t_max: SweepRange,
    /// How many rows
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = steps)]
    steps: usize,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, Clone, Copy)]
struct SweepRange {
    first: Option<Timestamp>,
    last: Option<Timestamp>,
}

/// Reads the files, inverts the series many times and prints the rows.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let loaded = args.readings.load()?;
    let series = args.readings.series(&loaded.recording)?;
    let options = args.inversion.options(&args.readings);
    refuse_empty(&[series], options.from, options.until)?;
    let steps = SweepOptions {
        first: args.t_max.first,
        last: args.t_max.last,
        steps: args.steps,
    };
    let bar = bar::shared();
    let report = sweep_showing(series, &options, &steps, &mut |share| {
        bar::share(&bar, share);
    });
    bar.finish_and_clear();
    if report.rows.is_empty() {
        let whole = [series.readings.first(), series.readings.last()];
        let [first, last] = whole.map(|reading| time(reading.map(|reading| reading.time)));
        let text = format!(
            "benchmark {}: --t-max leaves nothing to invert: expected FIRST..LAST within its readings, {first} to {last}",
            series.benchmark
        );
        return Err(NoSuchReadings(text).into());
    }
    args.output.print(&report, text)
}

/// `FIRST..LAST`.
fn range(text: &str) -> Result<SweepRange, String> {
    let expected = || "expected FIRST..LAST, each an RFC 3339 time or nothing".to_owned();
    let (first, last) = text.split_once("..").ok_or_else(expected)?;
    let one = |part: &str| match part {
        "" => Ok(None),
        part => part.parse().map(Some).map_err(|_| expected()),
    };
    Ok(SweepRange {
        first: one(first)?,
        last: one(last)?,
    })
}

fn steps(text: &str) -> Result<usize, String> {
    let count = text.parse().ok();
    count
        .filter(|count| (1..=1000).contains(count))
        .ok_or_else(|| "expected 1 to 1000".to_owned())
}

fn text(report: &SweepReport) -> String {
    let unit = report.unit;
    let first = time(report.first);
    let mut table = TextTable::headed([
        "t_max".to_owned(),
        "n".to_owned(),
        "regime".to_owned(),
        "unstable".to_owned(),
        "under constant load".to_owned(),
        "unstable".to_owned(),
        "m".to_owned(),
        "x_i".to_owned(),
        "transition".to_owned(),
        "failure 5 %".to_owned(),
        "failure 50 %".to_owned(),
        "chance".to_owned(),
        "1/v = 0".to_owned(),
        "minima".to_owned(),
        format!("rms {unit}"),
    ]);
    for row in &report.rows {
        table.row(cells(row));
    }
    let (benchmark, quantity) = (&report.benchmark, report.quantity);
    let differs = |row: &&SweepRow| row.regime.differs_from(row.regime_under_load.as_ref());
    let differ: Vec<&SweepRow> = report.rows.iter().filter(differs).collect();
    let note = if report.rows.is_empty() {
        "too few readings for a fit: the table has no row\n"
    } else if differ.is_empty() {
        ""
    } else if differ.iter().all(|row| row.has_stood_still) {
        STOOD_STILL
    } else {
        REGIMES_DIFFER
    };
    format!("benchmark {benchmark}, {quantity} in {unit}, readings from {first}\n\n{table}{note}")
}

/// What is said where the regimes differ after the velocity has stood still alone.
const STOOD_STILL: &str = "The two regimes differ where the velocity stood still over the last third of the readings: these do not decide between\n\
     them. The first, which lets the load change, is what the monitor uses.\n";

fn cells(row: &SweepRow) -> [String; 15] {
    let percent = |share: Option<f64>| share.map_or("-".to_owned(), percent_in_words);
    // First what the monitor uses.
    let (first, second) = match &row.regime_under_load {
        Some(load) => (load, Some(&row.regime)),
        None => (&row.regime, None),
    };
    let minima = row.alternatives.range_of_m();
    let minima = minima.map_or("-".to_owned(), |(low, high)| {
        format!("{}: m {low:.2} to {high:.2}", row.alternatives.0.len())
    });
    let fit = if row.rms.is_some() {
        number(row.rms)
    } else {
        row.termination.clone()
    };
    [
        time(Some(row.t_max)),
        row.readings.to_string(),
        first.label.to_string(),
        percent(first.probability_unstable),
        second.map_or("-".to_owned(), |regime| regime.label.to_string()),
        percent(second.and_then(|regime| regime.probability_unstable)),
        number(row.m),
        number(row.x_i),
        time(row.transition_time),
        time(row.failure_time.low),
        time(row.failure_time.median),
        percent(row.failure_time.probability),
        time(row.inverse_velocity.failure_time),
        minima,
        fit,
    ]
}
