//! `explain FILE`: from a benchmark's residual to the effect that its law lacks.

mod given;
mod page;
mod sections;
mod sentence;
mod text;

pub(super) use page::{STYLE, part};

use super::args::{OutputArgs, ReadingArgs, refuse_empty};
use super::{bar, exit};
use crate::alert::Policy;
use crate::config::value;
use crate::effects::{self, Cause, Explanation, Options};
use crate::reading::{Channel, Recording, SelectError, Series, Timestamp};
use anyhow::Context;
use std::path::PathBuf;

/// Fewer surrogates cannot give a p-value that an effect is accepted for.
const FEWEST_SURROGATES: usize = 99;
/// More show nothing and take for ever.
const MOST_SURROGATES: usize = 9999;

/// Trace a benchmark's residual to the effect that the law lacks, with the error before and after
///
/// Nothing is declared beforehand: every known effect is tried inside the law, with every covariate
/// there is. One is accepted only if the fit gains more by it than by chance, and if a later block that the fit has
/// not seen does not speak against it: predicted from reading to reading no worse than without the effect, and over
/// the whole block with an error of at most 1.2 times that without it, where a covariate or the season supports it; of at
/// most 10 times for a wave of known astronomy, and of no more at all where only the shape of the readings does.
/// An effect is what the readings are consistent with, never what is proved to cause them. With `--given`
/// only what you declare is tried.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    #[command(flatten)]
    readings: ReadingArgs,
    /// Use no reading before this
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    from: Option<Timestamp>,
    /// Use no reading and no covariate after this
    #[arg(long, value_name = "TIME", value_parser = value::instant)]
    until: Option<Timestamp>,
    /// Try no effect but this one and others that are declared like it: all are put into the law, and each is judged.
    /// `hydrological:lake_level_m`, `offset@2017-06-06T17:00:00Z`, `seasonal`
    #[arg(long, value_name = "KIND[:CHANNEL][@TIME]", value_parser = given::cause)]
    given: Vec<Cause>,
    /// Write a page with plots to this file, which needs no other
    #[arg(long, value_name = "FILE")]
    html: Option<PathBuf>,
    /// Of the surrogates behind the p-values
    #[arg(long, value_name = "N", default_value_t = Options::default().seed)]
    seed: u64,
    /// How many surrogates judge a gain
    #[arg(long, value_name = "N", default_value_t = Options::default().surrogates, value_parser = surrogates)]
    surrogates: usize,
    #[command(flatten)]
    output: OutputArgs,
}

/// An explanation as the terminal shows it: the verdict in one sentence, then what else there is to say, and tables.
pub fn in_words(explanation: &Explanation) -> String {
    text::text(explanation)
}

/// Reads the files, explains the series, prints the result and writes the page.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let mut recording = args.readings.load()?.recording;
    // Which series is meant is decided before any is cut, so that the answer does not depend on it.
    let one = args.readings.series(&recording);
    let several =
        matches!(one, Err(SelectError::Several { .. })) && args.readings.benchmark.is_none();
    if !several {
        one?;
    }
    let wanted = args.readings.fitting(&recording);
    refuse_empty(&wanted, args.from, args.until)?;
    cut(&mut recording, args.from, args.until);
    if several && !args.given.is_empty() {
        anyhow::bail!(exit::UsageError(
            "--given is judged on one benchmark: choose it with --benchmark".to_owned()
        ));
    }
    if several {
        return together(args, &mut recording);
    }
    let series = args.readings.series(&recording)?;
    given::check(&args.given, series, &recording.channels)?;
    let mut explanation = look(series, &recording, &args.given, &options(args));
    if let Some(remark) = remark_on_origin(&recording) {
        explanation.remarks.insert(0, remark);
    }
    // A page that cannot be written is no reason to lose what took so long to find.
    let written = args.html.as_ref().map_or(Ok(()), |file| {
        std::fs::write(file, page::page(&explanation))
            .with_context(|| format!("cannot write {}", file.display()))
    });
    args.output.print(&explanation, text::text)?;
    written
}

/// Explains every series that the flags allow: whether they part, and what each shows.
fn together(args: &Args, recording: &mut Recording) -> anyhow::Result<()> {
    args.readings.narrow(recording)?;
    if args.html.is_some() {
        anyhow::bail!(exit::UsageError(
            "--html shows one benchmark: choose it with --benchmark".to_owned()
        ));
    }
    let all: Vec<&Series> = recording.series.iter().collect();
    let bar = bar::shared();
    let mut progress = |share: f64| bar::share(&bar, share);
    let channels = &recording.channels;
    let mut found = effects::explain_together(&all, channels, &options(args), &mut progress);
    bar.finish_and_clear();
    if let Some(remark) = remark_on_origin(recording) {
        for explanation in &mut found.each {
            explanation.remarks.insert(0, remark.clone());
        }
    }
    args.output.print(&found, text::together)
}

fn options(args: &Args) -> Options {
    let policy = args.readings.policy(&Policy::default());
    Options {
        critical_velocity_mm_per_day: policy.critical_velocity_mm_per_day,
        seed: args.seed,
        surrogates: args.surrogates,
        ..Options::default()
    }
}

/// The search with its usual settings, for those who show a part of it.
pub(super) fn quick(series: &Series, recording: &Recording, policy: &Policy) -> Explanation {
    let options = Options {
        critical_velocity_mm_per_day: policy.critical_velocity_mm_per_day,
        ..Options::default()
    };
    let mut explanation = look(series, recording, &[], &options);
    if let Some(remark) = remark_on_origin(recording) {
        explanation.remarks.insert(0, remark);
    }
    explanation
}

/// Searches for what the law lacks, or, where effects are declared, judges these.
fn look(series: &Series, recording: &Recording, given: &[Cause], options: &Options) -> Explanation {
    let others = recording.series.iter();
    let neighbours: Vec<&Series> = others
        .filter(|other| other.benchmark != series.benchmark)
        .collect();
    let bar = bar::shared();
    let mut progress = |share: f64| bar::share(&bar, share);
    let channels = &recording.channels;
    let explanation = if given.is_empty() {
        effects::explain(series, channels, &neighbours, options, &mut progress)
    } else {
        effects::explain_given(series, channels, given, options, &mut progress)
    };
    bar.finish_and_clear();
    explanation
}

/// Leaves out what is not asked for. A covariate from before the first reading still acts after it.
fn cut(recording: &mut Recording, from: Option<Timestamp>, until: Option<Timestamp>) {
    let early = |time: Timestamp| from.is_some_and(|from| time < from);
    let late = |time: Timestamp| until.is_some_and(|until| time > until);
    for series in &mut recording.series {
        let out = |time| early(time) || late(time);
        series.readings.retain(|reading| !out(reading.time));
    }
    for channel in &mut recording.channels {
        let Channel { samples, .. } = channel;
        samples.retain(|sample| !late(sample.time));
    }
}

/// What a recording that was never measured must have said of it.
fn remark_on_origin(recording: &Recording) -> Option<String> {
    recording.reconstruction()?;
    let title = recording.provenance.get("title");
    let title = title.map_or(String::new(), |title| format!(" ({title})"));
    Some(format!(
        "These readings are a reconstruction, not measured{title}."
    ))
}

fn surrogates(text: &str) -> Result<usize, String> {
    let count = text.parse().ok();
    count
        .filter(|count| (FEWEST_SURROGATES..=MOST_SURROGATES).contains(count))
        .ok_or_else(|| format!("expected {FEWEST_SURROGATES} to {MOST_SURROGATES}"))
}
