//! The parts of a report on one benchmark.

use super::Args;
use super::material::Material;
use crate::alert::{Level, chance_in_words};
use crate::cli::table::TextTable;
use crate::cli::{explain, score, text};
use crate::figures::{self, Replayed};
use crate::monitor::{Event, EventKind, FailureTime, KindShown, levels_in};
use crate::plot::escaped;
use crate::reading::{Series, Timestamp, counted, days_since, figure};
use crate::store::EARLIEST;
use std::fmt::Write as _;

/// Events that are listed, the newest.
const LISTED: usize = 200;
const HOURS: f64 = 24.0;

/// One sentence that says how the benchmark stands at the end.
pub(super) fn summary(material: &Material, series: &Series) -> String {
    let known = material.known(series);
    let (levels, unknown) = levels_in(&material.events, Some(&series.benchmark), known);
    let level = levels.last().map_or(Level::Green, |stretch| stretch.level);
    let since = levels.last().map_or(known.from, |stretch| stretch.from);
    let unknown = unknown.last().filter(|stretch| stretch.is_in_force);
    let standing = match (level, &unknown) {
        // What nothing can be said of is never called green.
        (Level::Green, Some(stretch)) => format!("unknown since {}", material.shown(stretch.from)),
        (level, Some(stretch)) => format!(
            "{level} since {} and unknown since {}",
            material.shown(since),
            material.shown(stretch.from)
        ),
        (Level::Green, None) if series.readings.is_empty() => "nothing is known".to_owned(),
        (level, None) => format!("{level} since {}", material.shown(since)),
    };
    let reported = material.reported(series);
    let from = (series.readings).partition_point(|reading| reading.time < reported.from);
    let mut out = match &series.readings[from..] {
        [] if series.readings.is_empty() && material.listed_from == EARLIEST => {
            format!("{standing}; no reading")
        }
        [] => format!(
            "{standing}; no reading since {}",
            material.shown(material.listed_from)
        ),
        readings @ [first, ..] => format!(
            "{standing}; {}, {} to {}",
            counted(readings.len() as u64, "reading", "readings"),
            material.shown(first.time),
            material.shown(readings[readings.len() - 1].time),
        ),
    };
    if let Some((velocity, failure)) = newest_forecast(material, series) {
        // Writing to a string cannot fail.
        let _ = match velocity {
            Some(velocity) => write!(out, "; {} mm/day", figure(velocity, 3)),
            None => Ok(()),
        };
        let (chance, days) = (chance_in_words(failure.probability), failure.horizon_days);
        let none = || format!("after {days:.0} days");
        let at = |at: Option<Timestamp>| at.map_or_else(none, |at| material.shown(at));
        let _ = if failure.low.is_none() {
            write!(
                out,
                "; no collapse forecast within {days:.0} days (chance {chance})"
            )
        } else {
            write!(
                out,
                "; collapse forecast {} (median, on the early side; 90 %: {} to {}; chance {chance} in {days:.0} days)",
                at(failure.median),
                at(failure.low),
                at(failure.high),
            )
        };
    }
    out + "."
}

fn newest_forecast(material: &Material, series: &Series) -> Option<(Option<f64>, FailureTime)> {
    let ours = material.events.iter().rev();
    let mut ours = ours.filter(|event| event.benchmark.as_ref() == Some(&series.benchmark));
    ours.find_map(|event| {
        let EventKind::Refit {
            velocity_mm_per_day,
            failure_time,
            ..
        } = &event.kind
        else {
            return None;
        };
        Some((*velocity_mm_per_day, *failure_time))
    })
}

/// The figures of the replay.
pub(super) fn figures(args: &Args, material: &Material, series: &Series) -> Vec<String> {
    let replayed = Replayed {
        series,
        events: &material.events,
        collapse: args.failure_time,
    };
    vec![
        replayed.inverse_velocity(&replayed.three_dates()),
        replayed.forecasts(),
        replayed.regimes(),
    ]
}

/// What was said of a benchmark but its forecasts, oldest first; of a run of drifts of one kind the first and the last; `None` where nothing was.
pub(super) fn in_order(material: &Material, series: &Series) -> Option<TextTable> {
    let ours = |event: &&Event| {
        let kind = event.kind.name();
        event.benchmark.as_ref() == Some(&series.benchmark)
            && kind != KindShown::REFIT.name
            && kind != KindShown::SUMMARY.name
            && event.time >= material.listed_from
    };
    let said: Vec<&Event> = material.events.iter().filter(ours).collect();
    let mut table = TextTable::headed(["time", "kind", "what"]);
    let said = &said[said.len().saturating_sub(LISTED)..];
    let mut left_out = 0;
    for (at, event) in said.iter().enumerate() {
        let is_alike = |other: Option<&&Event>| other.is_some_and(|other| is_drift(event, other));
        if is_alike(at.checked_sub(1).and_then(|before| said.get(before)))
            && is_alike(said.get(at + 1))
        {
            left_out += 1;
            continue;
        }
        let line = text::line(event, &material.zone);
        // Time and place stand before it, two blanks apart.
        let what = line.splitn(3, "  ").nth(2).unwrap_or(&line);
        table.row([
            material.shown(event.time),
            event.kind.name().to_owned(),
            match std::mem::take(&mut left_out) {
                0 => what.to_owned(),
                others => format!("{what} ({others} more of this kind before it)"),
            },
        ]);
    }
    (!said.is_empty()).then_some(table)
}

/// Whether both say that the same time has come nearer or gone further away.
fn is_drift(one: &Event, other: &Event) -> bool {
    let both = |is: fn(&EventKind) -> bool| is(&one.kind) && is(&other.kind);
    both(|kind| matches!(kind, EventKind::InterceptDrift { .. }))
        || both(|kind| matches!(kind, EventKind::TransitionDrift { .. }))
}

/// When each level was first in force, for how long, and how long before the failure.
pub(super) fn levels(args: &Args, material: &Material, series: &Series) -> TextTable {
    let span = material.reported(series);
    let (levels, unknown) = levels_in(&material.events, Some(&series.benchmark), span);
    let mut heads = vec!["level", "first", "hours in force"];
    if args.failure_time.is_some() {
        heads.push("days before the failure");
    }
    let mut table = TextTable::headed(heads);
    for level in [Level::Yellow, Level::Orange, Level::Red, Level::Unknown] {
        let stretches = levels.iter().chain(&unknown);
        let own: Vec<_> = stretches.filter(|one| one.level == level).collect();
        // Stretches that were over before what is reported have no hour in it.
        let own = own
            .iter()
            .filter(|one| one.to > span.from || one.is_in_force);
        let own: Vec<_> = own.collect();
        let lengths = own
            .iter()
            .map(|one| HOURS * days_since(one.from.max(span.from), one.to));
        let hours = lengths.fold(0.0, |sum, one| sum + one.max(0.0));
        let first = own.first().map(|one| one.from);
        let mut row = vec![
            level.to_string(),
            first.map_or_else(|| "never".to_owned(), |first| material.shown(first)),
            format!("{hours:.0}"),
        ];
        if let Some(failure) = args.failure_time {
            row.push(first.map_or_else(
                || "-".to_owned(),
                |first| format!("{:.1}", days_since(first, failure)),
            ));
        }
        table.row(row);
    }
    table
}

/// What the law lacks: the verdict, the error before and after, the residual.
pub(super) fn closing_the_loop(material: &Material, series: &Series) -> String {
    let explanation = explain::quick(series, &material.recording, &material.policy);
    let mut out = explain::part(&explanation);
    for picture in figures::of_the_loop(&explanation) {
        let _ = write!(
            out,
            "<figure>\n{}<figcaption>{}</figcaption>\n</figure>\n",
            picture.svg,
            escaped(&picture.caption)
        );
    }
    out
}

/// Forecasts scored as they were made, where it is known what happened.
pub(super) fn scorecard(
    args: &Args,
    material: &Material,
    series: &Series,
) -> anyhow::Result<Option<String>> {
    if args.failure_time.is_none() && !args.no_failure {
        return Ok(None);
    }
    let recording = &material.recording;
    score::part(args.failure_time, recording, series, &material.policy).map(Some)
}
