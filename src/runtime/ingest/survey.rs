//! The cells of a table as they stand, before anyone has said what they mean.

use super::bytes::read_bytes;
use super::csv::stands_before_header;
use super::encoding::{Transcoder, latin1};
use super::names::unit_in_name;
use super::split::Splitter;
use super::{IngestError, Remark};
use crate::reading::{Delimiter, Dialect};
use ::csv::StringRecord;
use std::borrow::Cow;
use std::path::Path;

/// Rows that are looked at.
const MOST_ROWS: usize = 200_000;

/// What is expected where rows are others than their header says,
const THE_HEADER: &str = "the header of the rows; where other lines stand before it, skip_lines (--skip-lines) with their number";
/// and where their cells cannot be distinguished.
const A_DELIMITER: &str = "commas, semicolons or tabs between the cells: let the logger write one of them, or replace what stands there";

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
        return Err(bad(
            1,
            "(any)",
            problem,
            "line feeds: tr '\\r' '\\n' writes them",
        ));
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
    let columns = match columns(lines, header, &mut splitter, (least, names.len())) {
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

/// The cells of each column below `header`, in rows of at least and at most so many cells.
fn columns<'a>(
    lines: impl Iterator<Item = Cow<'a, str>>,
    header: &str,
    splitter: &mut Splitter,
    (least, most): (usize, usize),
) -> Result<Vec<Vec<String>>, &'static str> {
    let mut cells = StringRecord::new();
    let (mut columns, mut is_other_table) = (vec![Vec::new(); most], false);
    for line in lines.take(MOST_ROWS) {
        // A logger that starts again writes its header again.
        if line.trim_end() == header.trim_end() {
            continue;
        }
        if splitter.split(&line, &mut cells).is_ok() && (least..=most).contains(&cells.len()) {
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
