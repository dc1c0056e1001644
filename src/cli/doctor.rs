//! `doctor CONFIG`: whether this machine can carry the site.

use super::args::{OutputArgs, OutputFormat};
use super::exit::{AsUser, UsageError};
use crate::config;
use crate::runtime::doctor::{self, CheckVerdict, Finding};
use anyhow::Context;
use nix::unistd::{Uid, User};
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt::Write as _;
use std::os::unix::process::CommandExt;
use std::path::PathBuf;

/// Check whether this machine can run a site: files, state, brokers, hooks, clock, disk, watches, recordings
///
/// Tries what the daemon will do, as the user who runs it: as root, give the daemon's user with --user.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// The site's config
    #[arg(value_name = "CONFIG")]
    config: PathBuf,
    /// As this user, by name or number: the one that the daemon will run as; only root can
    #[arg(long, value_name = "USER")]
    user: Option<String>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Something is wrong with the machine.
#[derive(Debug, thiserror::Error)]
#[error("{0} wrong; see above")]
struct Unfit(usize);

#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct DoctorReport {
    /// Each thing that was looked at.
    findings: Vec<Finding>,
}

/// Says what was found; an error when something is wrong, not when it is only doubtful.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(user) = &args.user {
        return run_as(user, args);
    }
    let config = config::load(&args.config)?;
    let findings = doctor::examine(&config);
    let report = DoctorReport { findings };
    args.output.print(&report, text)?;
    let is_wrong = |finding: &&Finding| finding.verdict == CheckVerdict::Wrong;
    match report.findings.iter().filter(is_wrong).count() {
        0 => Ok(()),
        wrong => Err(Unfit(wrong).into()),
    }
}

/// Looks again as another user, in a process of its own, whose verdict is ours.
fn run_as(name: &str, args: &Args) -> anyhow::Result<()> {
    let known = match name.parse() {
        Ok(number) => User::from_uid(Uid::from_raw(number)),
        Err(_) => User::from_name(name),
    };
    let (uid, gid) = match (known?, name.parse()) {
        (Some(user), _) => (user.uid.as_raw(), user.gid.as_raw()),
        (None, Ok(number)) => (number, number),
        (None, Err(_)) => return Err(UsageError(format!("--user: there is no user {name}")).into()),
    };
    let format = match args.output.format {
        OutputFormat::Text => "text",
        OutputFormat::Json => "json",
    };
    let ended = std::process::Command::new(std::env::current_exe()?)
        .arg("doctor")
        .arg(&args.config)
        .args(["--format", format])
        .uid(uid)
        .gid(gid)
        .status()
        .with_context(|| format!("cannot become user {name}"))?;
    match ended.code() {
        Some(0) => Ok(()),
        code => Err(AsUser(
            name.to_owned(),
            code.and_then(|code| u8::try_from(code).ok()),
        )
        .into()),
    }
}

fn text(report: &DoctorReport) -> String {
    let mut text = String::new();
    for finding in &report.findings {
        let (verdict, check) = (finding.verdict.name(), finding.check);
        let _ = writeln!(text, "{verdict:8}  {check}: {}", finding.text);
    }
    text
}
