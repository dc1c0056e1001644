//! The document: what is scored and how, then each section.

use crate::sums::{PANEL, Scored};
use crate::{chances, figures, la_clapiere, simulated, sites, verdicts};
use anyhow::{Context, Result};
use slipwatch::score::{LONGEST_SCORED_DAYS, RECORDS_SCORED};
use std::fmt::Write as _;
use studies::Corpus;

/// Constants that a person set who could see how measured series came out.
const IN_VIEW: &str = include_str!("in_view.md");

/// Writes docs/skill.md and its figures.
pub(crate) fn write(scored: &Scored, judged: bool) -> Result<()> {
    let docs = studies::project().join("docs");
    let folder = docs.join("skill");
    std::fs::create_dir_all(&folder).with_context(|| folder.display().to_string())?;
    for (name, svg) in figures::all(scored) {
        let file = folder.join(name);
        std::fs::write(&file, svg).with_context(|| file.display().to_string())?;
    }
    let file = docs.join("skill.md");
    std::fs::write(&file, text(scored, judged)).with_context(|| file.display().to_string())
}

fn text(scored: &Scored, judged: bool) -> String {
    let mut out = head(scored, judged);
    simulated::section(&mut out, scored);
    chances::brier_section(&mut out, scored);
    chances::levels_section(&mut out, scored);
    sites::failed_section(&mut out, scored);
    sites::stood_section(&mut out, scored);
    la_clapiere::section(&mut out, scored);
    verdicts::losses(&mut out, scored);
    verdicts::targets(&mut out, scored);
    out.push_str(IN_VIEW);
    out
}

fn head(scored: &Scored, judged: bool) -> String {
    let (flag, seeds) = if judged {
        (
            " --judged",
            "The simulated slopes are seeds that nothing was tuned on; what the panel has learnt was learnt on others.",
        )
    } else {
        (
            "",
            "**The simulated slopes are those that the panel was tuned on**: its figures here are too good.",
        )
    };
    let simulated = (scored.failing.len() + scored.standing.len()) as u64;
    let fewer = match simulated {
        Corpus::LIVES => String::new(),
        fewer => format!(" --simulated {fewer}"),
    };
    let mut out = String::new();
    // Writing to a string cannot fail.
    let _ = writeln!(
        out,
        "# Skill: forecasts of the time of failure, scored as they would have been made

Written by `cargo run --release -p studies --bin skill --{flag}{fewer} --write`. Every number is of that run. The readings of some series
may not be redistributed, and without them their sections are left out.

- A forecast made at a time knows what had been *measured* by then, river and readings alike, and nothing later. When readings reach the
  monitor is another matter, and is not scored here.
- `{PANEL}` is what the monitor uses; `slider-block` the law alone under an undeclared load; all others are rivals as published
  (`slipwatch score --help` and src/score/method.rs name the sources), and `persistence` predicts from the newest velocity that nothing changes.
- CRPS: the integral over time of (F(t) − 1{{failed by t}})², days. It and nothing else is cut at {LONGEST_SCORED_DAYS} days or {RECORDS_SCORED} lengths of the
  record, whichever is less, and at the end of a record without failure. A point forecast is a step, and scores its error.
- A method that has nothing to say is scored as saying that no failure comes.
- A lead that a gap in the readings makes more than twice as long is left out; the time that remains is counted from the newest reading.
- {seeds}
- Intervals are 90 %, of a bootstrap over series: a slope with all its evaluations is drawn again, never a single evaluation.

*Measured* are instruments' readings. A *reconstruction* is made to fulfil what a publication states, and confirms nothing about its
site. *Simulated* slopes follow the law that `slider-block` fits, which favours it and the panel; their load, noise, gaps and resets are
known to no method."
    );
    out
}
