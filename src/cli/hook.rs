//! `hook test`: a drill for a site's hooks. `hook exec`: what the daemon starts to run a hook that may write only where it is allowed to.

use super::args::{OutputArgs, OutputFormat};
use super::run::asynchronous;
use crate::alert::Level;
use crate::config::{self, ADD_HOOK, Config, HookConfig, NO_HOOK};
use crate::monitor::{AlertState, Event, EventKind};
use crate::reading::Timestamp;
use crate::runtime::clock;
use crate::runtime::deliver;
use crate::runtime::hook::{Alert, HookOutcome, Status};
use crate::runtime::log::{self, LogFormat};
use crate::runtime::sandbox::{self, OURSELVES};
use schemars::JsonSchema;
use serde::Serialize;
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Try a site's hooks
#[derive(Debug, clap::Subcommand)]
pub(super) enum HookCommand {
    /// Run a site's hooks once, as the daemon would, with an alert that is marked as a test
    Test(Test),
    /// Run a program that can write only where it is allowed to, and end as it does
    #[command(hide = true)]
    Exec(Exec),
}

#[derive(Debug, clap::Args)]
pub(super) struct Test {
    /// The site whose hooks are run
    #[arg(long, value_name = "CONFIG")]
    config: PathBuf,
    /// Only the hooks for this level, run with it; default is every hook, run with its most severe
    #[arg(long, value_name = "LEVEL", value_parser = level)]
    level: Option<Level>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Debug, clap::Args)]
pub(super) struct Exec {
    /// Where it may write, beside /tmp and /dev/null
    #[arg(long, value_name = "PATH")]
    writable: Vec<PathBuf>,
    /// The program and its arguments
    #[arg(required = true, last = true, value_name = "PROGRAM")]
    run: Vec<OsString>,
}

/// A hook that did not take the drill.
#[derive(Debug, thiserror::Error)]
enum Failed {
    /// The config has none.
    #[error("{NO_HOOK}; {ADD_HOOK}")]
    NoHook,
    /// No hook would be run.
    #[error("no hook asks for {0}")]
    None(String),
    /// So many of them.
    #[error("{0} of {1} hooks failed; see above")]
    Some(usize, usize),
}

/// What became of one hook's drill.
#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct HookDrill {
    /// The hook's name.
    hook: String,
    /// The level that it was run with.
    level: Level,
    /// Whether it took the alert.
    is_taken: bool,
    /// How it ended, for a person.
    outcome: String,
}

#[derive(Debug, JsonSchema, Serialize)]
pub(super) struct HookReport {
    /// That it was a test.
    status: &'static str,
    /// Each hook that was run.
    hooks: Vec<HookDrill>,
}

/// Runs the drill, or becomes the hook.
pub(super) fn run(command: &HookCommand) -> anyhow::Result<()> {
    match command {
        HookCommand::Test(args) => test(args),
        HookCommand::Exec(Exec { writable, run }) => {
            if let Some((program, arguments)) = run.split_first() {
                match sandbox::become_hook(writable, program, arguments)? {}
            }
            Ok(())
        }
    }
}

fn test(args: &Test) -> anyhow::Result<()> {
    log::init(match args.output.format {
        OutputFormat::Text => LogFormat::Text,
        OutputFormat::Json => LogFormat::Json,
    });
    let mut config = config::load(&args.config)?;
    config.sandbox_hooks(Path::new(OURSELVES));
    if config.hooks.is_empty() {
        return Err(Failed::NoHook.into());
    }
    let now = clock::now();
    let asked: Vec<(&HookConfig, Level)> = config
        .hooks
        .iter()
        .filter_map(|hook| Some((hook, of_hook(hook, args.level)?)))
        .collect();
    if asked.is_empty() {
        let level = args.level.map_or("any level", Level::name);
        return Err(Failed::None(level.to_owned()).into());
    }
    let mut hooks = Vec::new();
    let runtime = asynchronous()?;
    for (hook, level) in asked {
        let Some(alert) = drill(&config, hook, level, now) else {
            continue;
        };
        let outcome = runtime.block_on(deliver::run(hook, &alert, 1));
        hooks.push(HookDrill {
            hook: hook.name(),
            level,
            is_taken: outcome == HookOutcome::Done,
            outcome: outcome.in_words(),
        });
    }
    let status = Status::Test.name();
    let report = HookReport { status, hooks };
    args.output.print(&report, text)?;
    let failed = report.hooks.iter().filter(|drill| !drill.is_taken).count();
    if failed > 0 {
        return Err(Failed::Some(failed, report.hooks.len()).into());
    }
    Ok(())
}

/// The level that the hook is run with; `None` where it does not ask for any.
fn of_hook(hook: &HookConfig, wanted: Option<Level>) -> Option<Level> {
    match wanted {
        Some(level) => hook.levels.contains(&level).then_some(level),
        // Unknown is no level of the slope.
        None => {
            (hook.levels.iter().copied()).max_by_key(|level| (*level != Level::Unknown, *level))
        }
    }
}

fn drill(config: &Config, hook: &HookConfig, level: Level, now: Timestamp) -> Option<Alert> {
    let first = config.benchmarks.first().map(|one| one.id.clone());
    let first = hook.benchmarks.first().cloned().or(first);
    let kind = EventKind::Alert {
        level,
        state: AlertState::Firing,
        key: format!("drill/{level}/{now}"),
        rule: "drill".to_owned(),
        text: format!("DRILL: a test of this hook, nothing has happened; it would be {level}"),
    };
    let event = Event {
        time: now,
        benchmark: first.filter(|_| !hook.site),
        kind,
    };
    Alert::new(&event, &config.site.name, None, Status::Test)
}

fn text(report: &HookReport) -> String {
    let mut text = String::new();
    for drill in &report.hooks {
        let HookDrill {
            hook,
            level,
            outcome,
            ..
        } = drill;
        let _ = writeln!(text, "{level:8}{hook}: {outcome}");
    }
    text
}

fn level(text: &str) -> Result<Level, String> {
    [Level::Yellow, Level::Orange, Level::Red, Level::Unknown]
        .into_iter()
        .find(|level| level.name() == text)
        .ok_or_else(|| "expected yellow, orange, red or unknown".to_owned())
}
