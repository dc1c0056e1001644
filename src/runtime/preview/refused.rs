//! Rows that the daemon refuses, each kind once: two rows are of one kind where they are wrong in the same way, whatever
//! stands in them.

use super::view::Refusal;
use crate::runtime::ingest::{IngestError, MessageError};
use crate::runtime::tail::BadLine;
use crate::runtime::tail::lines::LineFault;
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Kinds of rows that are counted apart; the rows of any others are counted together.
const MOST_KINDS: usize = 30;
/// What the rows of further kinds are counted under.
const OTHERS: &str = "";

/// What is wrong with a row, and what is said of it where it is the first of its kind.
#[derive(Debug)]
pub struct RefusedRow {
    kind: String,
    text: String,
}

impl RefusedRow {
    /// A row or message of a file.
    pub fn of_fault(fault: &IngestError) -> Self {
        Self {
            kind: kind_of(fault),
            text: fault.to_string(),
        }
    }

    /// A line of a text; `file` is its name.
    pub(super) fn of_line(line: &BadLine, file: &str) -> Self {
        if let Some(fault) = line.error.downcast_ref::<IngestError>() {
            return Self::of_fault(fault);
        }
        let text = line.error.to_string();
        let kind = match line.error.downcast_ref::<LineFault>() {
            Some(LineFault::TooLong) => "too long".to_owned(),
            Some(LineFault::NotUtf8 { .. }) => "encoding".to_owned(),
            Some(LineFault::Nul) => "NUL".to_owned(),
            None => without_digits(&text),
        };
        Self {
            kind,
            text: format!("{file}, line {}: {text}", line.number),
        }
    }

    /// A message of a recording.
    pub(super) fn of_message(error: &MessageError, text: String) -> Self {
        Self {
            kind: kind_of_message(error),
            text,
        }
    }

    /// What has no kind but its text.
    pub(super) fn of_text(text: String) -> Self {
        Self {
            kind: without_digits(&text),
            text,
        }
    }
}

/// The refusals of one source or file, by kind.
#[derive(Debug, Default)]
pub struct RefusedKinds(BTreeMap<String, Refusal>);

impl RefusedKinds {
    /// Counts a row.
    pub fn row(&mut self, row: RefusedRow) {
        let RefusedRow { kind, text } = row;
        if self.0.contains_key(&kind) || self.0.len() < MOST_KINDS {
            self.count(&kind, || text);
        } else {
            self.count(OTHERS, || format!("of other kinds: {text}"));
        }
    }

    /// Counts under a kind of which there are few.
    pub(super) fn count(&mut self, kind: &str, first: impl FnOnce() -> String) {
        if let Some(refusal) = self.0.get_mut(kind) {
            refusal.rows += 1;
            return;
        }
        let (rows, first) = (1, first());
        self.0.insert(kind.to_owned(), Refusal { rows, first });
    }

    /// Takes back what was counted under a kind; whether there was something.
    pub(super) fn forget(&mut self, kind: &str) -> bool {
        self.0.remove(kind).is_some()
    }

    /// What most rows are refused for stands first.
    pub fn sorted(self) -> Vec<Refusal> {
        let mut all: Vec<Refusal> = self.0.into_values().collect();
        all.sort_by_key(|refusal| Reverse(refusal.rows));
        all
    }
}

/// Without what was found in the row.
fn kind_of(error: &IngestError) -> String {
    match error {
        IngestError::Field {
            column, expected, ..
        } => format!("{column} {expected}"),
        IngestError::Header {
            problem, expected, ..
        } => format!("header {problem} {expected}"),
        IngestError::BadHeader { .. } => "bad header".to_owned(),
        IngestError::NoHeader { .. } => "no header".to_owned(),
        IngestError::Torn { .. } => "no object".to_owned(),
        IngestError::Record { problem, .. } | IngestError::Message { problem, .. } => {
            kind_of_message(problem)
        }
        IngestError::Inconsistent { expected, .. } => format!("inconsistent {expected}"),
        IngestError::Line { expected, .. } => format!("fields {expected}"),
        IngestError::Read { .. }
        | IngestError::Write { .. }
        | IngestError::UnknownFormat { .. }
        | IngestError::Workbook { .. }
        | IngestError::EmptyColumn { .. }
        | IngestError::Empty { .. }
        | IngestError::NoSuchColumn { .. }
        | IngestError::NoSuchCovariate { .. }
        | IngestError::NoChannels { .. }
        | IngestError::Damaged { .. }
        | IngestError::MessageCount { .. }
        | IngestError::NoTopics { .. }
        | IngestError::Unwritable { .. }
        | IngestError::Merge(_) => without_digits(&error.to_string()),
    }
}

fn kind_of_message(error: &MessageError) -> String {
    format!("{} {}", error.field, error.expected)
}

fn without_digits(text: &str) -> String {
    text.replace(|c: char| c.is_ascii_digit(), "")
}
