//! `doctor CONFIG`: whether this machine can carry the site.

use super::args::OutputArgs;
use crate::config;
use crate::runtime::doctor::{self, Finding, Verdict};
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// Check whether this machine can carry a site: watches, file systems, clock, disk, hooks, recordings
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site's config
    #[arg(value_name = "CONFIG")]
    config: PathBuf,
    #[command(flatten)]
    output: OutputArgs,
}

/// Something is wrong with the machine.
#[derive(Debug, thiserror::Error)]
#[error("{0} wrong; see above")]
struct Unfit(usize);

#[derive(Debug, Serialize)]
struct Report {
    findings: Vec<Finding>,
}

/// Says what was found; an error when something is wrong, not when it is only doubtful.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    let config = config::load(&args.config)?;
    let findings = doctor::examine(&config);
    let report = Report { findings };
    args.output.print(&report, text)?;
    let is_wrong = |finding: &&Finding| finding.verdict == Verdict::Wrong;
    match report.findings.iter().filter(is_wrong).count() {
        0 => Ok(()),
        wrong => Err(Unfit(wrong).into()),
    }
}

fn text(report: &Report) -> String {
    let mut text = String::new();
    for finding in &report.findings {
        let (verdict, check) = (finding.verdict.name(), finding.check);
        let _ = writeln!(text, "{verdict:8}  {check}: {}", finding.text);
    }
    text
}
