//! Splits one line of CSV at a time, without a new parser for each.

use crate::reading::Delimiter;
use ::csv::StringRecord;
use csv_core::{ReadRecordResult, Reader, ReaderBuilder, Terminator};

/// A CSV parser that is fed line by line.
#[derive(Debug)]
pub(super) struct Splitter {
    parser: Reader,
    /// The cells of the line one after another, unquoted, and where each ends.
    text: Vec<u8>,
    ends: Vec<usize>,
}

impl Splitter {
    pub(super) fn new(delimiter: Delimiter) -> Self {
        let parser = ReaderBuilder::new()
            .delimiter(delimiter.byte())
            // Only what ends our lines: a stray carriage return is part of its cell.
            .terminator(Terminator::Any(b'\n'))
            .build();
        Self {
            parser,
            text: Vec::new(),
            ends: Vec::new(),
        }
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
        // One more than a line can fill: the parser does not begin where there is no room.
        self.text.resize(line.len() + 1, 0);
        self.ends.resize(line.len() + 2, 0);
        let (text, ends) = (&mut self.text, &mut self.ends);
        let (_, _, written, ended) = self.parser.read_record(line.as_bytes(), text, ends);
        let (last, _, _, more) =
            (self.parser).read_record(b"\n", &mut text[written..], &mut ends[ended..]);
        // The line break is part of a cell only where a quote is left open.
        if !matches!(last, ReadRecordResult::Record) {
            self.parser.reset();
            return Err("a quote that is not closed".to_owned());
        }
        let mut from = 0;
        for to in &ends[..ended + more] {
            let cell = std::str::from_utf8(&text[from..*to]).map_err(|error| error.to_string())?;
            cells.push_field(cell.trim());
            from = *to;
        }
        Ok(())
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
