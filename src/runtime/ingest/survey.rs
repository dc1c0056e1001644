//! The cells of a table as they stand, before anyone has said what they mean.

use super::bytes::read_bytes;
use super::encoding::{Transcoder, latin1};
use super::split::Splitter;
use super::{IngestError, Remark};
use crate::reading::Delimiter;
use ::csv::StringRecord;
use std::borrow::Cow;
use std::path::Path;

/// Rows that are looked at.
const MOST_ROWS: usize = 200_000;

/// A table of text, read as nothing but cells.
#[derive(Debug, Clone)]
pub struct Survey {
    /// What parts its cells.
    pub delimiter: Delimiter,
    /// The cells of its first line.
    pub names: Vec<String>,
    /// The cells of each column below, as many as its first line has; rows with another number of cells are left out, but for
    /// those that lack only what has no name.
    pub columns: Vec<Vec<String>>,
    /// How it is encoded, where that is not UTF-8.
    pub encoding: Option<Remark>,
}

/// Reads `file`, whose cells are parted by `delimiter` or, with none, as its first line shows.
///
/// # Errors
/// [`IngestError`] where it cannot be read, or has no header or no row.
pub fn survey(file: &Path, delimiter: Option<Delimiter>) -> Result<Survey, IngestError> {
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
    let empty = |missing| IngestError::Empty {
        file: file.into(),
        missing,
    };
    let header = lines.next().unwrap_or_default();
    let header = header.strip_prefix('\u{feff}').unwrap_or(&header);
    let delimiter = delimiter.unwrap_or_else(|| Delimiter::of_header(header));
    let (mut splitter, mut cells) = (Splitter::new(delimiter), StringRecord::new());
    let split = splitter.split(header, &mut cells);
    split.map_err(|found| IngestError::BadHeader {
        file: file.into(),
        line: 1,
        found,
    })?;
    let names: Vec<String> = cells.iter().map(str::to_owned).collect();
    if names.is_empty() {
        return Err(empty("header"));
    }
    // Behind a last mark there may be nothing, with no name.
    let unnamed = names.iter().rev().take_while(|name| name.is_empty());
    let least = names.len() - unnamed.count();
    let mut columns = vec![Vec::new(); names.len()];
    for line in lines.take(MOST_ROWS) {
        if splitter.split(&line, &mut cells).is_ok() && (least..=names.len()).contains(&cells.len())
        {
            for (index, column) in columns.iter_mut().enumerate() {
                column.push(cells.get(index).unwrap_or_default().to_owned());
            }
        }
    }
    if columns.iter().all(Vec::is_empty) {
        return Err(empty("row"));
    }
    Ok(Survey {
        delimiter,
        names,
        columns,
        encoding,
    })
}
