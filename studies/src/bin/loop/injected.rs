//! The section on what was put into measured readings and found again.

use crate::found_again::{Found, Trial, effects, trials};
use crate::put_in::What;
use crate::subjects::SUBJECTS;
use crate::tables::number;
use anyhow::{Context, Result};
use slipwatch::effects::Explanation;
use std::fmt::Write as _;

/// So many draws of each effect.
const DRAWS: u64 = 3;

/// What is put into which series: all that it can show. A station that stands has no velocity to change, a displacement read
/// daily shows no tide, a record of little more than a year no year, and a velocity has no zero to be reset.
const PLAN: [(&str, &[What]); 8] = [
    ("salmon-falls-blkm", &[What::Step, What::Reset]),
    ("salmon-falls-ntoe", &[What::Step, What::Reset]),
    ("bazimen", &[What::Step, What::Reset, What::Season]),
    ("houston", &[What::Reset]),
    ("lanzada", &[What::Step, What::Tide]),
    ("columbia", &[What::Step, What::Tide]),
    ("century-31-1931", &[What::Step, What::Reset]),
    ("preonzo", &[What::Step, What::Reset]),
];

/// The seed of a draw: the same for every series, and chosen by nothing that was found.
fn seed(what: What, draw: u64) -> u64 {
    let kind = match what {
        What::Step => 0,
        What::Reset => 1,
        What::Tide => 2,
        What::Season => 3,
    };
    100 * kind + draw
}

/// Every trial with the heading of its series; a series that is not at hand has none.
pub(crate) fn all() -> Result<Vec<(&'static str, Trial)>> {
    let mut rows = Vec::new();
    for (name, whats) in PLAN {
        let subject = SUBJECTS.iter().find(|subject| subject.name == name);
        let subject = subject.with_context(|| name.to_owned())?;
        let Some(recording) = subject.recording()? else {
            continue;
        };
        let series = subject.series(&recording)?;
        let draws = |what: &What| {
            let what = *what;
            (1..=DRAWS).map(move |draw| (what, seed(what, draw)))
        };
        let drawn: Vec<(What, u64)> = whats.iter().flat_map(draws).collect();
        let some = trials(series, &recording.channels, &drawn);
        rows.extend(some.into_iter().map(|trial| (subject.heading, trial)));
    }
    Ok(rows)
}

const SECTION: &str = "
## Measured, with an effect put in by us

The readings of this section are measured, and one effect in each was not: it was put in by us. Date, phase and size are drawn by
a seed, three draws of each effect, the same seeds for every series, a step and a reset up or down by turns (`studies/src/bin/loop/injected.rs`). The
ground's motion is taken from the fit of `explain` to the readings as they are. A step multiplies its velocity by e to the size from
a date on, a wave by e to a sine of that size; a reset adds one value to every reading from a date on. The measured noise stays
what it was, and no law is asked how the state would answer. Each series is explained alone, with the channels beside it and
nothing declared, as it is and with the effect. An effect counts as found where its kind is right, an event also within three
intervals between readings of its date; *as* another kind is not counted. A jump of the reading is not judged by the later block.
";

/// The section of the document.
pub(crate) fn section(rows: &[(&str, Trial)]) -> String {
    let mut out = SECTION.to_owned();
    out.push_str("\n| put in | found | as another kind that moves the ground | not found |\n|---|---|---|---|\n");
    for what in [What::Step, What::Reset, What::Tide, What::Season] {
        let own = || {
            let all = rows.iter().map(|(_, trial)| trial);
            all.filter(move |trial| trial.put_in.what == what)
        };
        let right = own().filter(|trial| trial.is_right()).count();
        let found = own().filter(|trial| trial.found().is_some()).count();
        let _ = writeln!(
            out,
            "| {} | {right} | {} | {} |",
            what.name(),
            found - right,
            own().count() - found
        );
    }
    out.push_str("\nErrors are those of the readings with the effect in them, before → after.\n");
    out.push_str("\n| series | put in | found | late by, intervals | size put in | size found | fit | held out, from reading to reading | said of it as it is | said with it |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (heading, trial) in rows {
        let _ = writeln!(out, "| {heading} | {} |", cells(trial));
    }
    out
}

fn cells(trial: &Trial) -> String {
    let put_in = &trial.put_in;
    let found = trial.found();
    let date = put_in.at.strftime("%F");
    let when = match put_in.what {
        What::Step | What::Reset => format!(", {date}"),
        What::Tide | What::Season => String::new(),
    };
    let late = found.and_then(|found| found.late_days);
    let unit = match put_in.what {
        What::Reset => format!(" {}", trial.with.unit),
        What::Step | What::Tide | What::Season => String::new(),
    };
    let sized = |size: Option<f64>| match size {
        Some(size) => format!("{}{unit}", number(Some(size))),
        None => "–".to_owned(),
    };
    let size = found
        .filter(|_| trial.is_right())
        .and_then(|found| found.size);
    let error = &trial.with.error;
    [
        format!("{}{when}", put_in.what.name()),
        outcome(trial, found),
        number(late.map(|days| trial.intervals(days))),
        sized(Some(put_in.size)),
        sized(size),
        format!("{} → {}", number(error.fit.before), number(error.fit.after)),
        format!(
            "{} → {} {}",
            number(error.held_out_step.before),
            number(error.held_out_step.after),
            error.unit
        ),
        named(&trial.without),
        named(&trial.with),
    ]
    .join(" | ")
}

fn outcome(trial: &Trial, found: Option<Found>) -> String {
    match found {
        None => "no".to_owned(),
        Some(found) if found.as_fault => "yes, as a fault of the data".to_owned(),
        Some(_) if trial.is_right() => "yes".to_owned(),
        Some(found) => format!("as `{}`", found.kind),
    }
}

fn named(explanation: &Explanation) -> String {
    let all = effects(explanation);
    let names = all.iter().map(|one| match (&one.channel, one.at) {
        (Some(channel), _) => format!("`{}` `{channel}`", one.effect),
        (None, Some(at)) => format!("`{}` {}", one.effect, at.strftime("%F")),
        (None, None) => format!("`{}`", one.effect),
    });
    names.collect::<Vec<_>>().join(", ")
}
