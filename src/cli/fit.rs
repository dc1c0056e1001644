//! `fit FILE`: one inversion.

use super::args::{OutputArgs, ReadingArgs, refuse_empty};
use super::bar;
use super::columnar::TableArgs;
use super::table::{TextTable, number, time};
use super::text::wrapped;
use crate::alert::{Policy, percent_in_words};
use crate::config::value;
use crate::fit::Exponent;
use crate::inversion::{
    Estimate, FitReport, FittedFailureTime, FittedRegime, Inversion, InversionOptions,
    TogetherReport, UnderPrior, together,
};
use crate::reading::{BenchmarkId, Quantity, Series, Timestamp, Unit};
use crate::runtime::clock::Stopwatch;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt::Write as _;

/// Invert a benchmark's readings: the law's parameters, the regime, the failure time
///
/// Several benchmarks are inverted one by one, and then asked which of them fail together, and when.
/// The best fit and its rms are those of the constant-load law by unweighted least squares. Intervals
/// bound 90 %. Failure is the collapse; the first passage of --critical-velocity stands beside it. A table has a row a benchmark, and not
/// which fail together.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    #[command(flatten)]
    inversion: InversionArgs,
    #[command(flatten)]
    output: TableArgs,
}

/// What `fit` and `sweep` hold and choose.
#[derive(Debug, Clone, Copy, clap::Args)]
pub(super) struct InversionArgs {
    /// Use no reading before this
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    from: Option<Timestamp>,
    /// Use no reading after this
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    until: Option<Timestamp>,
    /// Hold m at this value: regime and intervals are then those of the laws with about this m, under a constant load
    #[arg(long, value_name = "m=M", value_parser = fixed)]
    fix: Option<f64>,
}

impl InversionArgs {
    /// The same for the inversion.
    pub(super) fn options(&self, readings: &ReadingArgs) -> InversionOptions {
        let policy = readings.policy(&Policy::default());
        InversionOptions {
            from: self.from,
            until: self.until,
            exponent: self.fix.map_or(Exponent::Free, Exponent::Fixed),
            critical_velocity_mm_per_day: policy.critical_velocity_mm_per_day,
            evacuation_time: policy.evacuation_time,
            ..InversionOptions::default()
        }
    }
}

/// Reads the files, inverts the series and prints the result.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let mut recording = args.readings.load()?.recording;
    args.readings.narrow(&mut recording)?;
    let options = args.inversion.options(&args.readings);
    let all: Vec<&Series> = recording.series.iter().collect();
    refuse_empty(&all, options.from, options.until)?;
    let count = recording.series.len() as u64;
    let mut table = args.output.table::<FitReport>()?;
    let format = args.output.lines();
    let output = OutputArgs { format };
    let is_held = args.inversion.fix.is_some();
    let bar = bar::counted(count + 1, "{bar:40} {pos}/{len} inversions, {elapsed}");
    for (index, series) in recording.series.iter().enumerate() {
        let report = report(series, &options);
        bar.inc(1);
        if let Some(table) = &mut table {
            table.row(&serde_json::to_value(&report)?)?;
            continue;
        }
        let blank = if index == 0 { "" } else { "\n" };
        bar.suspend(|| {
            output.print(&report, |report| {
                format!("{blank}{}", text(report, is_held))
            })
        })?;
    }
    if let Some(table) = table {
        bar.finish_and_clear();
        return table.finish();
    }
    let report = together(&recording.series, &options);
    bar.finish_and_clear();
    let Some(report) = report else {
        return Ok(());
    };
    output.print(&SiteReport { together: report }, |site| {
        neighbours(&site.together)
    })
}

/// What is said after the benchmarks one by one.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct SiteReport {
    /// Which of them fail together, and when.
    together: TogetherReport,
}

/// Inverts a series; `seconds` is what the least squares took.
pub(super) fn report(series: &Series, options: &InversionOptions) -> FitReport {
    let inversion = Inversion::new(series, options);
    let stopwatch = Stopwatch::start();
    let least_squares = inversion.least_squares();
    let seconds = stopwatch.elapsed().as_secs_f64();
    inversion.report(&least_squares, seconds)
}

/// `m=1.5`.
fn fixed(text: &str) -> Result<f64, String> {
    let value = text.strip_prefix("m=").and_then(|m| m.parse::<f64>().ok());
    value
        .filter(|m| m.is_finite() && *m != 0.0 && (-20.0..=29.0).contains(m))
        .ok_or_else(|| "expected m=M with M from -20 to 29, not 0".to_owned())
}

fn text(report: &FitReport, is_held: bool) -> String {
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "benchmark {}, {} in {}, {} readings, {} to {}",
        report.benchmark,
        report.quantity,
        report.unit,
        report.readings,
        time(report.first),
        time(report.last),
    );
    let _ = writeln!(
        out,
        "{}; rms {} {}, the law solved {} times in {:.1} ms\n",
        report.termination,
        number(report.rms),
        report.unit,
        report.evaluations,
        report.seconds * 1e3,
    );
    out.push_str(&summary(report).to_string());
    out.push('\n');
    out.push_str(&parameters(report).to_string());
    out.push_str(&notes(report, is_held));
    if !report.alternatives.0.is_empty() {
        out.push('\n');
        out.push_str(&alternatives(report).to_string());
    }
    out
}

fn summary(report: &FitReport) -> TextTable {
    let percent = |share: Option<f64>| share.map_or("-".to_owned(), percent_in_words);
    let shown = |regime: &FittedRegime| {
        format!(
            "{} (unstable {}, accelerating {})",
            regime.label,
            percent(regime.probability_unstable),
            percent(regime.probability_accelerating),
        )
    };
    let failure = &report.failure_time;
    let line = &report.inverse_velocity;
    let mut table = TextTable::plain();
    // First what the monitor uses.
    match &report.regime_under_load {
        Some(regime) => {
            table.row(["regime".to_owned(), shown(regime)]);
            table.row(["  under constant load".to_owned(), shown(&report.regime)]);
        }
        None => table.row(["regime".to_owned(), shown(&report.regime)]),
    }
    table.row(["    other priors".to_owned(), other_priors(report)]);
    table.row([
        "onset".to_owned(),
        format!(
            "{} ({} to {})",
            time(report.onset),
            time(report.onset_low),
            time(report.onset_high)
        ),
    ]);
    table.row([
        "failure".to_owned(),
        format!(
            "{} within {:.0} days, {} within the evacuation time",
            percent(failure.probability),
            failure.horizon_days,
            percent(failure.chance_within_evacuation_time),
        ),
    ]);
    table.row(quantiles(failure));
    let passage = &report.critical_velocity_time;
    table.row([
        "critical velocity".to_owned(),
        format!(
            "passed in {} of cases within {:.0} days",
            percent(passage.probability),
            passage.horizon_days
        ),
    ]);
    table.row(quantiles(passage));
    table.row([
        "inverse velocity".to_owned(),
        format!(
            "meets zero {} (r squared {})",
            time(line.failure_time),
            number(line.r_squared)
        ),
    ]);
    let alpha = line.alpha.map_or("-".to_owned(), |alpha| {
        let bounds = [alpha.low, alpha.high].map(number).join(" to ");
        format!("{} ({bounds})", number(alpha.best))
    });
    table.row(["  alpha".to_owned(), alpha]);
    table.row(["transition".to_owned(), time(report.transition_time)]);
    table
}

fn quantiles(of: &FittedFailureTime) -> [String; 2] {
    let times = [of.low, of.median, of.high].map(time);
    ["  5, 50, 95 %".to_owned(), times.join("  ")]
}

/// What needs an explanation where the report has it.
fn notes(report: &FitReport, is_held: bool) -> String {
    let mut out = String::new();
    if estimates(report).iter().any(|(_, one, _)| is_outside(one)) {
        out.push_str(
            "*  outside of its interval. The best fit is the one law of constant load with the least squares; the\n   \
             interval bounds 90 % of all laws that fit the readings within their noise. Where many different laws fit\n   \
             (see the minima below), the best one may be an extreme among them: go by the interval.\n",
        );
    }
    if is_held {
        out.push_str(HELD);
    }
    let differ = report
        .regime
        .differs_from(report.regime_under_load.as_ref());
    // What is said of a velocity that stood still is among the remarks.
    if differ && !report.has_stood_still {
        out.push_str(REGIMES_DIFFER);
    }
    for remark in &report.remarks {
        out.push_str(&wrapped(remark, COLUMNS, ""));
        out.push('\n');
    }
    out
}

/// Columns of a paragraph.
const COLUMNS: usize = 118;

/// What is said where the two regimes differ.
pub(super) const REGIMES_DIFFER: &str = "The two regimes differ. The first lets the load change, and is what the monitor uses; use it too. The\n\
     second, the parameters and the minima take the load for constant over the whole record.\n";

/// What is said where m is.
const HELD: &str = "m is held. Regime, onset and intervals are those of the laws under a constant load whose m is about there, and - where\n\
     hardly any law that fits the readings has it. The failure is the monitor's, which leaves m free.\n";

/// Whether the best fit lies outside of the interval.
fn is_outside(estimate: &Estimate) -> bool {
    estimate.best.is_some_and(|best| {
        estimate.low.is_some_and(|low| best < low) || estimate.high.is_some_and(|high| best > high)
    })
}

/// How far the chance of m > 1 and the law's own failure time depend on the prior.
fn other_priors(report: &FitReport) -> String {
    let all = &report.prior_sensitivity;
    let unstable: Vec<f64> = all.iter().map(UnderPrior::probability_unstable).collect();
    let fails: Vec<f64> = all.iter().map(|one| one.failure_probability).collect();
    let range = |values: &[f64]| {
        let low = values.iter().copied().fold(f64::INFINITY, f64::min);
        let high = values.iter().copied().fold(0.0, f64::max);
        format!("{:.0} to {:.0} %", 100.0 * low, 100.0 * high)
    };
    if all.is_empty() {
        return "-".to_owned();
    }
    format!(
        "unstable {}, the law alone fails {}",
        range(&unstable),
        range(&fails)
    )
}

type EstimateRow<'a> = (&'static str, &'a Estimate, String);

fn estimates(report: &FitReport) -> [EstimateRow<'_>; 9] {
    let velocity = match report.unit {
        unit @ Unit::Rate(..) => unit.to_string(),
        unit @ Unit::Length(_) => format!("{unit}/day"),
    };
    let length = match report.unit {
        Unit::Length(length) | Unit::Rate(length, _) => length.symbol(),
    };
    let p = &report.parameters;
    let rows = [
        ("m", &p.m, ""),
        ("x_i", &p.x_i, ""),
        ("T", &p.t_unit_days, "days"),
        ("D", &p.d, &velocity),
        ("D_c", &p.d_c, length),
        ("S theta_i", &p.s_theta_i, ""),
        ("v_i", &p.v_i, &velocity),
        ("r", &p.r_per_day, "1/day"),
        ("kappa", &p.kappa_per_day, "1/day"),
    ];
    rows.map(|(name, estimate, unit)| (name, estimate, unit.to_owned()))
}

fn parameters(report: &FitReport) -> TextTable {
    let mut table = TextTable::headed(["parameter", "best fit", "5 %", "95 %", "unit"]);
    for (name, estimate, unit) in estimates(report) {
        let mark = if is_outside(estimate) { " *" } else { "" };
        table.row([
            name.to_owned(),
            number(estimate.best) + mark,
            number(estimate.low),
            number(estimate.high),
            unit,
        ]);
    }
    table
}

fn alternatives(report: &FitReport) -> TextTable {
    let unit = report.unit;
    let d = match unit.quantity() {
        Quantity::Velocity => format!("D {unit}"),
        Quantity::Displacement => format!("D {unit}/day"),
    };
    let mut table = TextTable::headed([
        "minimum m".to_owned(),
        "x_i".to_owned(),
        "T days".to_owned(),
        d,
        format!("rms {unit}"),
        "regime".to_owned(),
    ]);
    for one in &report.alternatives.0 {
        table.row([
            number(one.m),
            number(one.x_i),
            number(one.t_unit_days),
            number(one.d),
            number(one.rms),
            one.regime.to_string(),
        ]);
    }
    table
}

fn neighbours(report: &TogetherReport) -> String {
    let since = |since: Timestamp| {
        if since <= report.judged_from {
            "from the first snapshot on".to_owned()
        } else {
            format!("since {}", time(Some(since)))
        }
    };
    let mut out = String::from("\n");
    for group in &report.groups {
        let named = group.benchmarks.iter().zip(&group.probabilities);
        let named: Vec<String> = named
            .map(|(benchmark, probability)| {
                format!("{benchmark} ({})", percent_in_words(*probability))
            })
            .collect();
        let failure = &group.failure_time;
        let _ = writeln!(
            out,
            "together {}, {}: failure {} within {:.0} days, {} within the evacuation time\n  5, 50, 95 %     {}",
            named.join(", "),
            since(group.since),
            failure.probability.map_or("-".to_owned(), percent_in_words),
            failure.horizon_days,
            failure
                .chance_within_evacuation_time
                .map_or("-".to_owned(), percent_in_words),
            [failure.low, failure.median, failure.high]
                .map(time)
                .join("  "),
        );
    }
    for one in &report.apart {
        let _ = writeln!(
            out,
            "apart {} ({}), {}",
            one.benchmark,
            percent_in_words(one.probability),
            since(one.since),
        );
    }
    if !report.silent.is_empty() {
        let silent: Vec<&str> = report.silent.iter().map(BenchmarkId::as_str).collect();
        let _ = writeln!(out, "without a forecast {}", silent.join(", "));
    }
    let _ = writeln!(
        out,
        "judged by {} snapshots from {} on",
        report.looks,
        time(Some(report.judged_from)),
    );
    out
}
