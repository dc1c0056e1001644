//! The exit codes, which error has which, and how an error is said.

use crate::config::ConfigError;
use crate::model::LawError;
use crate::reading::{MergeError, SelectError};
use crate::runtime::ingest::IngestError;
use crate::runtime::replay::ReplayError;
use crate::runtime::reporting::ReportingError;
use crate::runtime::run::RunError;
use crate::runtime::sandbox::{CANNOT_RUN, SandboxError};
use crate::store::StoreError;
use std::error::Error;
use std::fmt::Display;
use std::io::{self, Write};
use std::process::ExitCode;

/// The job found trouble.
const TROUBLE: u8 = 1;
/// The command line is invalid.
const USAGE: u8 = 2;
/// The data are bad.
const DATA: u8 = 65;
/// A service is missing.
const UNAVAILABLE: u8 = 69;
/// Input or output failed.
const IO: u8 = 74;
/// The config is wrong.
const CONFIG: u8 = 78;

/// What the process of another user ended with; it has said why.
#[derive(Debug, thiserror::Error)]
#[error("checked as user {0}")]
pub(super) struct AsUser(pub(super) String, pub(super) Option<u8>);

/// A command line that parses and is invalid.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct UsageError(pub(super) String);

/// Readings that are there and are none of those that are asked for, or too few of them.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub(super) struct NoSuchReadings(pub(super) String);

/// Writes a line to stderr; nothing can be done when that fails.
pub(super) fn complain(what: &dyn Display) {
    let _ = writeln!(io::stderr(), "{what}");
}

/// Help and version on stdout, a usage error on stderr.
pub(super) fn of_parser(error: &clap::Error) -> ExitCode {
    // Whoever asked for help and closed the pipe has seen enough of it.
    let _ = error.print();
    u8::try_from(error.exit_code()).unwrap_or(USAGE).into()
}

/// Says what went wrong on stderr and gives its code. A reader of stdout that has gone is no error.
pub(super) fn report(error: &anyhow::Error) -> ExitCode {
    if is_broken_pipe(error) {
        return ExitCode::SUCCESS;
    }
    complain(&sentence(error));
    error.chain().find_map(code_of).unwrap_or(TROUBLE).into()
}

/// The only table of errors and codes.
fn code_of(error: &(dyn Error + 'static)) -> Option<u8> {
    if let Some(error) = error.downcast_ref::<IngestError>() {
        return Some(if error.is_io() { IO } else { DATA });
    }
    if let Some(error) = error.downcast_ref::<RunError>() {
        return Some(match error {
            RunError::State { .. } => IO,
            RunError::Follow(_) => TROUBLE,
            RunError::Reporting(ReportingError::Token(_)) => CONFIG,
            RunError::Reporting(ReportingError::Listen(_)) => UNAVAILABLE,
        });
    }
    if let Some(error) = error.downcast_ref::<ReplayError>() {
        return Some(match error {
            ReplayError::NothingUntil { .. } => DATA,
            ReplayError::Output(_) | ReplayError::State(_) => IO,
            ReplayError::Interrupted | ReplayError::Undelivered => TROUBLE,
        });
    }
    if let Some(error) = error.downcast_ref::<AsUser>() {
        return error.1;
    }
    let table = [
        (error.is::<UsageError>() || error.is::<LawError>(), USAGE),
        (error.is::<SelectError>() || error.is::<MergeError>(), DATA),
        (error.is::<NoSuchReadings>(), DATA),
        (error.is::<ConfigError>(), CONFIG),
        (error.is::<SandboxError>(), CANNOT_RUN),
        (error.is::<io::Error>() || error.is::<StoreError>(), IO),
    ];
    table.into_iter().find_map(|(is, code)| is.then_some(code))
}

fn is_broken_pipe(error: &anyhow::Error) -> bool {
    let of_a_file = error.is::<IngestError>();
    let broken = |cause: &(dyn Error + 'static)| {
        let io = cause.downcast_ref::<io::Error>();
        let json = cause.downcast_ref::<serde_json::Error>();
        let kind = io
            .map(io::Error::kind)
            .or(json.and_then(serde_json::Error::io_error_kind));
        kind == Some(io::ErrorKind::BrokenPipe)
    };
    !of_a_file && error.chain().any(broken)
}

/// The error and its causes on one line; a cause that the error has named already is not repeated.
fn sentence(error: &anyhow::Error) -> String {
    let mut text = error.to_string();
    for cause in error.chain().skip(1).map(ToString::to_string) {
        if !text.ends_with(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context;

    #[test]
    fn a_cause_is_named_once_and_a_context_keeps_the_code() {
        let source = io::Error::other("the disk is gone");
        let file = "site.toml".into();
        let failed: Result<(), _> = Err(ConfigError::Unreadable { file, source });
        let error = failed.context("starting").unwrap_err();
        let said = sentence(&error);
        assert_eq!(said.matches("the disk is gone").count(), 1, "{said}");
        assert_eq!(error.chain().find_map(code_of), Some(CONFIG));
    }

    #[test]
    fn only_a_reader_of_ours_that_has_gone_is_quiet() {
        let gone = || io::Error::from(io::ErrorKind::BrokenPipe);
        assert!(is_broken_pipe(&gone().into()));
        assert!(is_broken_pipe(&serde_json::Error::io(gone()).into()));
        assert!(is_broken_pipe(&ReplayError::Output(gone()).into()));
        let file = "a.csv".into();
        let source = gone();
        assert!(!is_broken_pipe(&IngestError::Read { file, source }.into()));
    }
}
