//! Aligned columns for people.

use crate::plot::escaped;
use crate::reading::Timestamp;
use std::fmt;

/// Rows of cells, each column as wide as its widest cell.
#[derive(Debug, Clone, Default)]
pub(super) struct TextTable {
    rows: Vec<Vec<String>>,
    is_headed: bool,
}

impl TextTable {
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
        // On paper the head of a table is on each of its sheets.
        let (head, body) = self.rows.split_at(usize::from(self.is_headed));
        let rows = |rows: &[Vec<String>], tag: &str| -> String {
            rows.iter().map(|row| html_row(row, tag)).collect()
        };
        let head = match head {
            [] => String::new(),
            head => format!("<thead>\n{}</thead>\n", rows(head, "th")),
        };
        format!(
            "<table>\n{head}<tbody>\n{}</tbody>\n</table>",
            rows(body, "td")
        )
    }

    /// The width of each column, in characters.
    fn widths(&self) -> Vec<usize> {
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(0);
        let width = |column: usize| {
            // What stands alone on its line is in no column.
            let rows = self.rows.iter().filter(|row| row.len() > 1 || columns == 1);
            let cells = rows.filter_map(|row| row.get(column));
            cells.map(|cell| cell.chars().count()).max().unwrap_or(0)
        };
        (0..columns).map(width).collect()
    }

    /// The same in so many characters, as far as the other columns allow: a first cell that is too long for that stands on
    /// a line of its own above its row.
    pub(super) fn within(self, characters: usize) -> Self {
        let others: usize = self.widths().iter().skip(1).map(|width| width + GAP).sum();
        let room = characters.saturating_sub(others);
        let mut fitted = Self {
            rows: Vec::new(),
            ..self
        };
        for mut row in self.rows {
            let is_long = row.first().is_some_and(|cell| cell.chars().count() > room);
            if is_long && row.len() > 1 {
                fitted.rows.push(vec![std::mem::take(&mut row[0])]);
            }
            fitted.rows.push(row);
        }
        fitted
    }
}

fn html_row(row: &[String], tag: &str) -> String {
    let cells = row
        .iter()
        .map(|cell| format!("<{tag}>{}</{tag}>", escaped(cell)));
    format!("<tr>{}</tr>\n", cells.collect::<String>())
}

/// Blanks between two columns.
const GAP: usize = 2;

impl fmt::Display for TextTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let widths = self.widths();
        for row in &self.rows {
            let mut line = String::new();
            for (cell, width) in row.iter().zip(&widths) {
                line.push_str(cell);
                let gap = (width + GAP).saturating_sub(cell.chars().count());
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_that_is_too_long_stands_above_its_row_and_nothing_is_lost() {
        let mut table = TextTable::headed(["benchmark", "level", "newest"]);
        table.row(["5", "green", "2020-01-31"]);
        table.row(["the upper extensometer in the scar", "red", "2020-01-30"]);
        let text = table.clone().within(30).to_string();
        assert_eq!(
            text,
            "benchmark  level  newest\n5          green  2020-01-31\n\
             the upper extensometer in the scar\n           red    2020-01-30\n"
        );
        assert_eq!(table.clone().within(80).to_string(), table.to_string());
    }
}
