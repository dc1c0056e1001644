//! The cells of a table as they stand, before anyone has said what they mean.

use super::bytes::read_bytes;
use super::csv::stands_before_header;
use super::encoding::{Transcoder, latin1};
use super::names::unit_in_name;
use super::ndjson::cell;
use super::split::Splitter;
use super::units_row;
use super::{IngestError, Remark};
use crate::reading::{Delimiter, Dialect};
use ::csv::StringRecord;
use serde_json::{Map, Value};
use std::borrow::Cow;
use std::path::Path;

/// Rows that are looked at.
const MOST_ROWS: usize = 200_000;

/// What is expected where rows are others than their header says,
const THE_HEADER: &str = "the header of the rows; where other lines stand before it, skip_lines (--skip-lines) with their number";
/// and where their cells cannot be distinguished.
const A_DELIMITER: &str = "commas, semicolons or tabs between the cells: let the logger write one of them, or replace what stands there";

/// and where its lines cannot.
const LINE_FEEDS: &str = "line feeds: tr '\\r' '\\n' writes them";

/// A table of text, read as nothing but cells.
#[derive(Debug, Clone)]
pub struct Survey {
    /// What parts its cells.
    pub delimiter: Delimiter,
    /// The cells of its header.
    pub names: Vec<String>,
    /// The cells of each column below, as many as its header has; rows with another number of cells are left out, but for
    /// those that lack only what has no name.
    pub columns: Vec<Vec<String>>,
    /// How it is encoded, where that is not UTF-8.
    pub encoding: Option<Remark>,
}

/// Reads `file`, whose cells are parted as `dialect` says or, where it does not, as its header shows; of the dialect nothing else counts
/// than this, the lines before the header and the columns of the time.
///
/// # Errors
/// [`IngestError`] where it cannot be read, or has no header or no row.
pub fn survey(file: &Path, dialect: &Dialect) -> Result<Survey, IngestError> {
    let bytes = read_bytes(file)?;
    let mut transcoder = Transcoder::default();
    let bytes = transcoder.feed(&bytes);
    let mut encoding = transcoder.is_utf16().then(Remark::utf16);
    let mut lines = bytes
        .split(|byte| *byte == b'\n')
        .zip(1..)
        .map(|(line, number)| {
            let text = std::str::from_utf8(line).map(Cow::Borrowed);
            text.unwrap_or_else(|_| {
                encoding.get_or_insert_with(|| Remark::latin1(number));
                Cow::Owned(latin1(line).unwrap_or_default())
            })
        });
    let bad = |line, column: &str, problem, expected| IngestError::Header {
        file: file.into(),
        line,
        column: column.to_owned(),
        problem,
        expected,
    };
    if bytes.contains(&b'\r') && !bytes.contains(&b'\n') {
        let problem = "its lines end in carriage returns alone";
        return Err(bad(1, "(any)", problem, LINE_FEEDS));
    }
    let empty = |missing| IngestError::Empty {
        file: file.into(),
        missing,
    };
    let (line, header) = (1..)
        .zip(lines.by_ref())
        .find(|(line, text)| !stands_before_header(*line, text, dialect))
        .unwrap_or_default();
    let header = header.strip_prefix('\u{feff}').unwrap_or(&header);
    let delimiter = (dialect.delimiter).unwrap_or_else(|| Delimiter::of_header(header));
    let (mut splitter, mut cells) = (Splitter::new(delimiter), StringRecord::new());
    if let Err(found) = splitter.split(header, &mut cells) {
        let file = file.into();
        return Err(IngestError::BadHeader { file, line, found });
    }
    let names: Vec<String> = cells.iter().map(str::to_owned).collect();
    if let ([only], None) = (&names[..], dialect.delimiter)
        && let Some(problem) = other_delimiter(only)
    {
        return Err(bad(line, only, problem, A_DELIMITER));
    }
    if names.is_empty() {
        return Err(empty("header"));
    }
    // Behind a last mark there may be nothing, with no name.
    let unnamed = names.iter().rev().take_while(|name| name.is_empty());
    let least = names.len() - unnamed.count();
    let below = RowsBelow {
        header,
        names: &names,
        least,
        dialect,
    };
    let columns = match below.columns(lines, &mut splitter) {
        Ok(columns) if columns.iter().all(Vec::is_empty) => return Err(empty("row")),
        Ok(columns) => columns,
        Err(problem) => {
            return Err(bad(line, &names[0], problem, THE_HEADER));
        }
    };
    Ok(Survey {
        delimiter,
        names,
        columns,
        encoding,
    })
}

/// The same of the objects in a file of messages that are rows of a table, with the keys of the first one for a header; `None` where it has none.
///
/// # Errors
/// [`IngestError`] where it cannot be read.
pub fn survey_objects(file: &Path) -> Result<Option<Survey>, IngestError> {
    let bytes = read_bytes(file)?;
    let (mut names, mut columns) = (Vec::<String>::new(), Vec::<Vec<String>>::new());
    for line in bytes.split(|byte| *byte == b'\n').take(MOST_ROWS) {
        let Ok(object) = serde_json::from_slice::<Map<String, Value>>(line) else {
            continue;
        };
        if object.contains_key("benchmark") || object.contains_key("channel") {
            continue;
        }
        let keys: Vec<String> = object.keys().map(|key| key.trim().to_owned()).collect();
        if names.is_empty() {
            columns = vec![Vec::new(); keys.len()];
            names = keys;
        } else if names != keys {
            continue;
        }
        for (column, value) in columns.iter_mut().zip(object.values()) {
            column.push(cell(value));
        }
    }
    Ok((!names.is_empty()).then_some(Survey {
        delimiter: Delimiter::Comma,
        names,
        columns,
        encoding: None,
    }))
}

/// What the rows below a header are read by.
struct RowsBelow<'a> {
    header: &'a str,
    names: &'a [String],
    /// Cells that a row has at least.
    least: usize,
    dialect: &'a Dialect,
}

impl RowsBelow<'_> {
    /// The cells of each column; a line of units is none of the rows.
    fn columns<'a>(
        &self,
        lines: impl Iterator<Item = Cow<'a, str>>,
        splitter: &mut Splitter,
    ) -> Result<Vec<Vec<String>>, &'static str> {
        let (least, most) = (self.least, self.names.len());
        let mut cells = StringRecord::new();
        let (mut columns, mut is_other_table) = (vec![Vec::new(); most], false);
        let mut is_below_header = true;
        for line in lines.take(MOST_ROWS) {
            // A logger that starts again writes its header again.
            if line.trim_end() == self.header.trim_end() {
                is_below_header = true;
                continue;
            }
            if splitter.split(&line, &mut cells).is_ok() && (least..=most).contains(&cells.len()) {
                if std::mem::take(&mut is_below_header)
                    && units_row::units_of(&cells, self.names, self.dialect).is_some()
                {
                    continue;
                }
                for (index, column) in columns.iter_mut().enumerate() {
                    column.push(cells.get(index).unwrap_or_default().to_owned());
                }
            } else {
                is_other_table |= !line.trim().is_empty();
            }
        }
        if is_other_table && columns.iter().all(Vec::is_empty) {
            return Err("no row below has as many cells");
        }
        Ok(columns)
    }
}

/// What parts the names of a header that has no comma, semicolon or tab.
fn other_delimiter(header: &str) -> Option<&'static str> {
    let words = header.split_whitespace();
    let are_named = |word: &str| {
        word.eq_ignore_ascii_case("time") || unit_in_name(word).is_some() || word == "t_days"
    };
    if header.contains('|') {
        Some("its cells are parted by |")
    } else if words.clone().count() > 1 && words.clone().any(are_named) {
        Some("its cells are parted by blanks")
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_parts_cells_and_lines_is_named_where_it_cannot_be_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.csv");
        for (text, named) in [
            (
                "time|P1_displacement_mm\n2026-11-28T19:00:00Z|1\n",
                "parted by |",
            ),
            (
                "time P1_displacement_mm\n2026-11-28T19:00:00Z 1\n",
                "parted by blanks",
            ),
            (
                "time,P1_displacement_mm\r2026-11-28T19:00:00Z,1\r",
                "carriage returns",
            ),
        ] {
            std::fs::write(&file, text).unwrap();
            let said = survey(&file, &Dialect::default()).unwrap_err().to_string();
            assert!(said.contains(named), "{said}");
        }
    }
}
