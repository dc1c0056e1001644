//! Splits one line of CSV at a time, without a new parser for each.

use crate::reading::Delimiter;
use ::csv::{ReaderBuilder, StringRecord, Terminator, Trim};
use std::io::{self, Read};

/// A CSV parser that is fed line by line.
#[derive(Debug)]
pub(super) struct Splitter {
    reader: ::csv::Reader<SplitLine>,
    delimiter: Delimiter,
}

/// The line to be split, as a stream that ends with it.
#[derive(Debug, Default)]
struct SplitLine {
    text: Vec<u8>,
    read: usize,
    /// Whether more was asked for than the line holds.
    exhausted: bool,
}

impl Read for SplitLine {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = (&self.text[self.read..]).read(buffer)?;
        self.read += read;
        self.exhausted |= read == 0;
        Ok(read)
    }
}

impl Splitter {
    pub(super) fn new(delimiter: Delimiter) -> Self {
        let reader = ReaderBuilder::new()
            .has_headers(false)
            .flexible(true)
            .delimiter(delimiter.byte())
            .trim(Trim::All)
            // Only what ends our lines: a stray carriage return is part of its cell.
            .terminator(Terminator::Any(b'\n'))
            .from_reader(SplitLine::default());
        Self { reader, delimiter }
    }

    /// The cells of one line, trimmed; none if it is blank.
    pub(super) fn split(&mut self, line: &str, cells: &mut StringRecord) -> Result<(), String> {
        cells.clear();
        let line = line.trim_end_matches(['\r', '\n']);
        if line.trim().is_empty() {
            return Ok(());
        }
        if line.contains('\n') {
            return Err("a line break within the line".to_owned());
        }
        let source = self.reader.get_mut();
        source.text.clear();
        source.text.extend_from_slice(line.as_bytes());
        source.text.push(b'\n');
        source.read = 0;
        let outcome = self.reader.read_record(cells);
        // The parser asks for more than the line only where a quote is left open.
        let failed = if self.reader.get_ref().exhausted {
            Some("a quote that is not closed".to_owned())
        } else {
            outcome.err().map(|error| error.to_string())
        };
        match failed {
            None => Ok(()),
            Some(problem) => {
                *self = Self::new(self.delimiter);
                Err(problem)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(splitter: &mut Splitter, line: &str) -> Result<Vec<String>, String> {
        let mut cells = StringRecord::new();
        splitter.split(line, &mut cells)?;
        Ok(cells.iter().map(str::to_owned).collect())
    }

    #[test]
    fn lines_are_split_one_after_another_whatever_stood_before() {
        let mut splitter = Splitter::new(Delimiter::Comma);
        let long = "x".repeat(100_000);
        let long_cells = format!("{long},1");
        let cases: [(&str, &[&str]); 7] = [
            ("a, b ,c\r\n", &["a", "b", "c"]),
            ("", &[]),
            (" \r\n", &[]),
            ("\"a,\"\"b\",,", &["a,\"b", "", ""]),
            (&long_cells, &[&long, "1"]),
            ("a\rb,c", &["a\rb", "c"]),
            (",", &["", ""]),
        ];
        for (line, expected) in cases.into_iter().chain(cases) {
            assert_eq!(cells(&mut splitter, line).unwrap(), expected);
        }
    }

    #[test]
    fn an_open_quote_spoils_its_own_line_only() {
        let mut splitter = Splitter::new(Delimiter::Comma);
        let error = cells(&mut splitter, "1,\"2").unwrap_err();
        assert!(error.contains("quote"), "{error}");
        assert_eq!(cells(&mut splitter, "3,4").unwrap(), ["3", "4"]);
        assert!(cells(&mut splitter, "1,2\n3,4").is_err());
        assert_eq!(cells(&mut splitter, "5,6").unwrap(), ["5", "6"]);
    }
}
