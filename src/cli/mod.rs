//! The commands, their flags and their exit codes.

pub mod check;
mod exit;
pub mod run;

use std::process::ExitCode;

/// Parses the command line, runs the command, and turns the outcome into an exit code.
pub fn main() -> ExitCode {
    ExitCode::SUCCESS
}
