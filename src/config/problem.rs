//! What is wrong with a site file: where, what, and how to put it right.

use super::keys::Keys;
use schemars::JsonSchema;
use serde::Serialize;
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Whether the daemon may start with it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, JsonSchema, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The file is refused.
    Error,
    /// The file is taken, but it hardly means what was intended.
    Warning,
}

/// One thing that is wrong with a site file.
#[derive(Debug, Clone, PartialEq, Eq, JsonSchema, Serialize)]
pub struct ConfigProblem {
    /// The site file.
    pub file: PathBuf,
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Refused, or only doubtful.
    pub severity: Severity,
    /// What is wrong, with the value.
    pub what: String,
    /// What to write instead.
    pub fix: String,
}

impl fmt::Display for ConfigProblem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let kind = match self.severity {
            Severity::Error => "error",
            Severity::Warning => "warning",
        };
        write!(
            f,
            "{}:{}:{}: {kind}: {}; {}",
            self.file.display(),
            self.line,
            self.column,
            self.what,
            self.fix
        )
    }
}

/// A site file that cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// It could not be read at all.
    #[error("cannot read the config {file}: {source}")]
    Unreadable {
        /// The site file.
        file: PathBuf,
        /// Why not.
        source: std::io::Error,
    },
    /// The token that it asks callers for.
    #[error(transparent)]
    Token(#[from] super::WordFileError),
    /// It was read and has errors; warnings stand among them.
    #[error("{}", lines(.problems))]
    Invalid {
        /// All problems, in the order of the file.
        problems: Vec<ConfigProblem>,
    },
}

fn lines(problems: &[ConfigProblem]) -> String {
    let lines: Vec<String> = problems.iter().map(ConfigProblem::to_string).collect();
    lines.join("\n")
}

/// The problems of one file, with the line and column of each.
#[derive(Debug)]
pub(super) struct ConfigProblems {
    file: PathBuf,
    text: String,
    problems: Vec<ConfigProblem>,
    /// What was asked of each table.
    pub(super) keys: Keys,
}

impl ConfigProblems {
    pub(super) fn new(file: &Path, text: &str) -> Self {
        Self {
            file: file.to_owned(),
            text: text.to_owned(),
            problems: Vec::new(),
            keys: Keys::default(),
        }
    }

    pub(super) fn error(&mut self, at: &Range<usize>, what: String, fix: impl Into<String>) {
        self.note(Severity::Error, at, what, fix.into());
    }

    pub(super) fn warning(&mut self, at: &Range<usize>, what: String, fix: impl Into<String>) {
        self.note(Severity::Warning, at, what, fix.into());
    }

    fn note(&mut self, severity: Severity, at: &Range<usize>, what: String, fix: String) {
        let problem = self.problem(severity, at, what, fix);
        self.problems.push(problem);
    }

    /// One that is not noted.
    pub(super) fn problem(
        &self,
        severity: Severity,
        at: &Range<usize>,
        what: String,
        fix: String,
    ) -> ConfigProblem {
        let before = self.text.get(..at.start).unwrap_or(&self.text);
        let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
        ConfigProblem {
            file: self.file.clone(),
            line: before.matches('\n').count() + 1,
            column: before[line_start..].chars().count() + 1,
            severity,
            what,
            fix,
        }
    }

    /// All problems in the order of the file.
    pub(super) fn close(mut self) -> Vec<ConfigProblem> {
        self.problems
            .sort_by_key(|problem| (problem.line, problem.column));
        self.problems
    }
}
