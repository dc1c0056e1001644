//! The text of one file on its way in: bytes to lines, lines to values and faults.

use super::lines::{LineFault, Lines, TailLine};
use crate::reading::Quantity;
use crate::runtime::ingest::{FileUnits, IngestError, Item, Meaning, Remark, TextRows, unpack};
use serde::{Deserialize, Serialize};
use std::error::Error;
use std::fmt::Debug;
use std::io::{self, Read};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// Unpacked bytes that are taken at once.
const PIECE_BYTES: usize = 16 * 1024;

/// A line that cannot be used, or a part of one.
#[derive(Debug)]
pub(in crate::runtime) struct BadLine {
    pub(in crate::runtime) number: u64,
    pub(in crate::runtime) text: String,
    pub(in crate::runtime) error: Box<dyn Error + Send + Sync>,
}

/// What came of some bytes.
#[derive(Debug, Default)]
pub(in crate::runtime) struct LinesRead {
    /// Each with its line.
    pub(in crate::runtime) items: Vec<(u64, Item)>,
    pub(in crate::runtime) bad: Vec<BadLine>,
    /// The file does not begin as it should: the last of `bad` says why, and nothing follows.
    pub(in crate::runtime) is_lost: bool,
    /// What has been found out about the file, perhaps once more.
    pub(in crate::runtime) remarks: Vec<Remark>,
}

/// The newest lines of a file, or messages of a recording or broker, where none of them could be used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(in crate::runtime) struct RefusedRows {
    /// Since the last line of which something could be used.
    pub(in crate::runtime) count: u64,
    /// What is wrong with the newest.
    pub(super) why: String,
    /// Whether something of a line before them could be used.
    pub(in crate::runtime) is_below_used: bool,
}

/// So many rows in a row that cannot be used are no accident: the table has become another one.
pub(in crate::runtime) const MOST_REFUSED: u64 = 5;

impl RefusedRows {
    /// What is wrong with the newest, and how many there are, where that is no accident.
    pub(in crate::runtime) fn fault(&self) -> Option<(u64, &str)> {
        (self.count >= MOST_REFUSED).then_some((self.count, self.why.as_str()))
    }

    /// Something of the next one can be used.
    pub(in crate::runtime) fn end(&mut self) {
        self.count = 0;
        self.is_below_used = true;
    }

    /// The next one cannot be used.
    pub(in crate::runtime) fn add(&mut self, error: &dyn Error) {
        self.count += 1;
        self.why = error.to_string();
    }

    /// More lines have been read.
    pub(super) fn note(&mut self, lines: &LinesRead) {
        let used = lines.items.last().map(|(number, _)| *number);
        if used.is_some() {
            self.end();
        }
        // Of a line of which a part can be used the rest is set aside too.
        let since = |line: &&BadLine| used.is_none_or(|used| line.number > used);
        for line in lines.bad.iter().filter(since) {
            self.add(&*line.error);
        }
    }
}

type DecodeFault = Box<dyn Error + Send + Sync>;

/// Where we are in a text.
#[derive(Debug)]
pub(in crate::runtime) struct TextReader {
    lines: Lines,
    rows: TextRows,
    units: FileUnits,
}

impl TextReader {
    pub(in crate::runtime) fn new(rows: TextRows) -> Self {
        Self {
            lines: Lines::default(),
            rows,
            units: FileUnits::default(),
        }
    }

    /// Its writer has ended the lines of other texts only before the next line, or not at all, so it will here.
    pub(super) fn expect_lines_ended_later(&mut self) {
        self.lines.expect_ended_later();
    }

    /// Of a text of which nothing has been read: the same writer has put it in place of `before`.
    pub(super) fn follow_on(&mut self, before: &Self) {
        self.lines = before.lines.written_anew();
    }

    /// Whether its writer ends each line only before the next one.
    pub(super) fn has_lines_ended_later(&self) -> bool {
        self.lines.are_ended_later()
    }

    /// A reader of a text that goes on below these lines of a header, which stand in another file.
    pub(super) fn below(mut rows: TextRows, header: &[String]) -> Option<Self> {
        take_header(&mut rows, header).ok()?;
        (!rows.is_lost()).then(|| Self::new(rows))
    }

    /// The lines of the header in force.
    pub(super) fn header(&self) -> &[String] {
        self.rows.header()
    }

    pub(super) fn saved(&self) -> SavedText {
        SavedText {
            lines: self.lines.clone(),
            header: self.rows.header().to_vec(),
            units: self.units.clone(),
        }
    }

    /// Goes on where another one was; `rows` are new.
    ///
    /// # Errors
    /// When the header is no longer understood: the config is another.
    pub(super) fn restored(mut rows: TextRows, saved: SavedText) -> Result<Self, IngestError> {
        take_header(&mut rows, &saved.header)?;
        if !saved.header.is_empty() && rows.is_lost() {
            return Err(IngestError::NoHeader {
                file: "the file".into(),
                line: saved.lines.number(),
            });
        }
        Ok(Self {
            lines: saved.lines,
            rows,
            units: saved.units,
        })
    }

    /// Takes the next bytes.
    pub(in crate::runtime) fn feed(&mut self, bytes: &[u8]) -> LinesRead {
        let lines = self.lines.feed(bytes);
        self.taken(lines)
    }

    /// The last line, where it is taken for whole although nothing ends it ([`Lines::unended`]).
    pub(super) fn unended(&mut self) -> Option<LinesRead> {
        let line = self.lines.unended()?;
        Some(self.taken([line]))
    }

    /// What comes of whole lines.
    fn taken(&mut self, lines: impl IntoIterator<Item = TailLine>) -> LinesRead {
        let mut fed = LinesRead::default();
        for line in lines {
            let number = line.number;
            let (text, error) = match line.text {
                Err(LineFault::NotUtf8 {
                    latin1: Some(text), ..
                }) if self.rows.takes_latin1() => {
                    fed.remarks.push(Remark::latin1(number));
                    self.line(number, text, &mut fed)
                }
                Err(fault) => (String::new(), Some(fault.into())),
                Ok(text) => self.line(number, text, &mut fed),
            };
            let Some(error) = error else { continue };
            fed.is_lost = !text.is_empty() && self.rows.is_lost();
            fed.bad.push(BadLine {
                number,
                text,
                error,
            });
            if fed.is_lost {
                break;
            }
        }
        // Of one line, and of lines of one time that follow each other.
        let of_one_time =
            |(_, one): &(u64, Item), (_, next): &(u64, Item)| one.time() == next.time();
        for same in fed.items.chunk_by_mut(of_one_time) {
            same.sort_by(|(_, one), (_, next)| order(one).cmp(&order(next)));
        }
        if self.lines.is_utf16() {
            fed.remarks.push(Remark::utf16());
        }
        fed
    }

    fn line(
        &mut self,
        number: u64,
        text: String,
        fed: &mut LinesRead,
    ) -> (String, Option<DecodeFault>) {
        let taken = match guarded(|| self.rows.take(number, &text)) {
            Ok(taken) => taken,
            Err(fault) => return (text, Some(fault.into())),
        };
        for item in taken.items {
            fed.items.push((number, self.units.convert(item)));
        }
        fed.remarks.extend(taken.remarks);
        (text, taken.fault.map(Into::into))
    }

    /// What the columns are taken for, by what has been read so far.
    pub(in crate::runtime) fn meanings(&mut self) -> Vec<(String, Meaning)> {
        self.rows.meanings()
    }

    /// Whether the text ends within a line.
    pub(in crate::runtime) fn is_within_a_line(&self) -> bool {
        self.lines.is_within_a_line()
    }
}

/// A mistake of the program while it read a line.
#[derive(Debug, thiserror::Error)]
#[error(
    "the program failed while it read this line or message, which is passed over; please report it"
)]
pub(in crate::runtime) struct LineBroke;

/// What `work` gives: a line or message on which the program fails must not end the reading of all others, at each start anew.
pub(in crate::runtime) fn guarded<T>(work: impl FnOnce() -> T) -> Result<T, LineBroke> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|_| LineBroke)
}

/// Takes the lines of a header that was read before.
fn take_header(rows: &mut TextRows, header: &[String]) -> Result<(), IngestError> {
    for (number, line) in (1..).zip(header) {
        if let Some(fault) = rows.take(number, line).fault {
            return Err(fault);
        }
    }
    Ok(())
}

/// What of a [`TextReader`] a restart needs.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct SavedText {
    lines: Lines,
    header: Vec<String>,
    units: FileUnits,
}

/// What was measured at one time comes as a replay has it: covariates first, each by name, and of a benchmark the displacement first.
fn order(item: &Item) -> (bool, &str, Option<Quantity>) {
    match item {
        Item::Sample { channel, .. } => (false, channel, None),
        Item::Missing { benchmark, .. } => (true, benchmark.as_str(), None),
        Item::Reading {
            benchmark, unit, ..
        } => (true, benchmark.as_str(), Some(unit.quantity())),
    }
}

/// A packed file while it is being read, whole and once.
#[derive(Debug)]
pub(super) struct Unpacking {
    packed: Option<Box<dyn Packed>>,
    text: TextReader,
}

trait Packed: Read + Send + Debug {}

impl<T: Read + Send + Debug> Packed for T {}

impl Unpacking {
    pub(in crate::runtime) fn new(rows: TextRows) -> Self {
        Self {
            packed: None,
            text: TextReader::new(rows),
        }
    }

    /// The next piece of `file`; `None` when it has all been read.
    pub(super) fn next(&mut self, file: &Path) -> io::Result<Option<LinesRead>> {
        let packed = match &mut self.packed {
            Some(packed) => packed,
            packed => packed.insert(Box::new(unpack(file)?)),
        };
        let mut piece = vec![0; PIECE_BYTES];
        let count = packed.read(&mut piece)?;
        Ok((count > 0).then(|| self.text.feed(&piece[..count])))
    }

    /// What is left when all has been read: a packed file has no more to come behind its last line.
    pub(super) fn end(&mut self) -> LinesRead {
        self.text.feed(b"\n")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_on_which_the_program_fails_is_a_fault_of_that_line() {
        let fault = guarded(|| -> u8 { panic!("a mistake") }).unwrap_err();
        assert!(fault.to_string().contains("passed over"));
        assert_eq!(guarded(|| 7).unwrap(), 7);
    }
}
