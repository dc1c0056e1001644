//! Aligned columns for people.

use crate::plot::escaped;
use crate::reading::Timestamp;
use std::fmt::{self, Write as _};

/// Rows of cells, each column as wide as its widest cell.
#[derive(Debug, Clone, Default)]
pub(super) struct Table {
    rows: Vec<Vec<String>>,
    is_headed: bool,
}

impl Table {
    /// Rows without a heading.
    pub(super) fn plain() -> Self {
        Self::default()
    }

    /// The first row names the columns.
    pub(super) fn headed<S: Into<String>>(names: impl IntoIterator<Item = S>) -> Self {
        let mut table = Self {
            is_headed: true,
            ..Self::default()
        };
        table.row(names);
        table
    }

    /// Adds a row.
    pub(super) fn row<S: Into<String>>(&mut self, cells: impl IntoIterator<Item = S>) {
        self.rows.push(cells.into_iter().map(Into::into).collect());
    }

    /// The same as an element of a page.
    pub(super) fn html(&self) -> String {
        let mut out = String::from("<table>\n");
        for (index, row) in self.rows.iter().enumerate() {
            let tag = if self.is_headed && index == 0 {
                "th"
            } else {
                "td"
            };
            out.push_str("<tr>");
            for cell in row {
                // Writing to a string cannot fail.
                let _ = write!(out, "<{tag}>{}</{tag}>", escaped(cell));
            }
            out.push_str("</tr>\n");
        }
        out.push_str("</table>");
        out
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            let cells = self.rows.iter().filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        let widths: Vec<usize> = (0..columns).map(width).collect();
        for row in &self.rows {
            let mut line = String::new();
            for (cell, width) in row.iter().zip(&widths) {
                line.push_str(cell);
                let gap = (width + 2).saturating_sub(cell.chars().count());
                line.extend(std::iter::repeat_n(' ', gap));
            }
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

/// Four significant digits; a dash for what does not exist.
pub(super) fn number(value: Option<f64>) -> String {
    let Some(value) = value else {
        return "-".to_owned();
    };
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if !(1e-4..1e6).contains(&size) {
        format!("{value:.3e}")
    } else if size >= 1000.0 {
        format!("{value:.0}")
    } else if size >= 10.0 {
        format!("{value:.2}")
    } else if size >= 0.1 {
        format!("{value:.4}")
    } else {
        format!("{value:.6}")
    }
}

/// To the minute, UTC; a dash for what does not come.
pub(super) fn time(time: Option<Timestamp>) -> String {
    let minute = |time: Timestamp| time.strftime("%Y-%m-%dT%H:%MZ").to_string();
    time.map_or("-".to_owned(), minute)
}
