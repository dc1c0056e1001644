//! The commands, their flags and their exit codes.

mod alerts;
pub mod args;
mod bar;
mod check;
mod columnar;
mod completions;
mod convert;
mod demo;
mod doctor;
mod exit;
mod explain;
mod fit;
mod hook;
mod init;
mod load;
mod man;
mod picture;
mod plot;
mod preview;
mod replay;
mod report;
mod run;
mod schema;
mod score;
mod simulate;
mod state;
mod status;
mod sweep;
mod table;
mod text;
mod watched;

pub use explain::in_words as explanation_in_words;

use crate::runtime::log;
use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Streaming landslide early warning, built on the slider-block friction law.
#[derive(Debug, Parser)]
#[command(version, arg_required_else_help = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Demo(demo::Args),
    Init(Box<init::Args>),
    Run(run::Args),
    Check(check::Args),
    Doctor(doctor::Args),
    #[command(mut_arg("files", |files| files.required_unless_present("state").required(false)))]
    Replay(replay::Args),
    Status(status::StatusArgs),
    Events(state::EventsArgs),
    Alerts(alerts::AlertsArgs),
    Backup(state::BackupArgs),
    Fit(fit::Args),
    Sweep(sweep::Args),
    Explain(explain::Args),
    Score(score::Args),
    Plot(plot::Args),
    #[command(mut_arg("files", |files| files.required_unless_present("config").required(false)))]
    Report(Box<report::Args>),
    Simulate(simulate::Args),
    Convert(convert::Args),
    #[command(subcommand)]
    Hook(hook::HookCommand),
    Schema(schema::Args),
    Completions(completions::Args),
    Man(man::Args),
}

/// Parses the command line, runs the command, and turns the outcome into an exit code.
pub fn main() -> ExitCode {
    let done = match Cli::try_parse() {
        Ok(cli) => match cli.command {
            Command::Demo(args) => demo::run(&args),
            Command::Init(args) => init::run(&args),
            Command::Run(args) => run::run(&args),
            Command::Check(args) => check::run(&args),
            Command::Doctor(args) => doctor::run(&args),
            Command::Replay(args) => replay::run(&args),
            Command::Status(args) => status::status(&args),
            Command::Events(args) => state::events(&args),
            Command::Alerts(args) => alerts::run(&args),
            Command::Backup(args) => state::backup(&args),
            Command::Fit(args) => fit::run(&args),
            Command::Sweep(args) => sweep::run(&args),
            Command::Explain(args) => explain::run(&args),
            Command::Score(args) => score::run(&args),
            Command::Plot(args) => plot::run(&args),
            Command::Report(args) => report::run(&args),
            Command::Simulate(args) => simulate::run(&args),
            Command::Convert(args) => convert::run(&args),
            Command::Hook(command) => hook::run(&command),
            Command::Schema(args) => schema::run(&args),
            Command::Completions(args) => completions::run(&args),
            Command::Man(args) => man::run(&args),
        },
        Err(error) => return exit::of_parser(&error),
    };
    log::finish();
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => exit::report(&error),
    }
}
