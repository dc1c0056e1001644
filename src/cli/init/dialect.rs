//! How a table is written, by its cells; where they leave a choice, the flag that makes it.

use super::times::{self, FoundTimes};
use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Dialect, ThousandsMark};
use crate::runtime::ingest::Survey;

/// What a table's cells and the flags say of it.
#[derive(Debug, Clone)]
pub(super) struct Written {
    pub(super) dialect: Dialect,
    /// Whether its times say nothing of their zone.
    pub(super) needs_zone: bool,
    /// Whether they are days since a day 0, in a column `t_days`.
    pub(super) is_in_days: bool,
}

/// How the table is written, or what the file leaves open.
pub(super) fn written(survey: &Survey, stated: &DialectArgs) -> Result<Written, Vec<String>> {
    let decimal = stated
        .decimal
        .map_or_else(|| decimal(survey, stated.thousands), Ok);
    let decimal_mark = decimal.clone().unwrap_or_default();
    let time = times::find(survey, stated, decimal_mark);
    match (decimal, time) {
        (Ok(decimal), Ok(found)) => {
            let mut written = in_words(survey, decimal, found);
            written.dialect.skip_lines = stated.skip_lines.unwrap_or_default();
            written.dialect.thousands = stated.thousands.or_else(|| thousands(survey, decimal));
            Ok(written)
        }
        (decimal, time) => {
            let problems = [decimal.err(), time.err()];
            Err(problems.into_iter().flatten().collect())
        }
    }
}

fn in_words(survey: &Survey, decimal: DecimalMark, found: FoundTimes) -> Written {
    let has = |wanted: &str| {
        let mut names = survey.names.iter();
        names.any(|name| name.eq_ignore_ascii_case(wanted))
    };
    Written {
        is_in_days: found.columns.is_empty() && has("t_days") && !has("time"),
        dialect: Dialect {
            delimiter: Some(survey.delimiter),
            decimal,
            thousands: None,
            time_columns: found.columns,
            time_format: found.format,
            skip_lines: 0,
        },
        needs_zone: found.needs_zone,
    }
}

/// What parts thousands, where a number that no other mark explains shows it.
fn thousands(survey: &Survey, decimal: DecimalMark) -> Option<ThousandsMark> {
    let marks = [
        ThousandsMark::Comma,
        ThousandsMark::Point,
        ThousandsMark::Blank,
        ThousandsMark::Apostrophe,
    ];
    let mut others = marks.into_iter().filter(|mark| !mark.is_decimal(decimal));
    others.find(|mark| {
        let mut cells = survey.columns.iter().flatten();
        cells.any(|cell| are_parted(cell, decimal, *mark))
    })
}

/// Whether the cell is a number with this mark between its thousands, and none without.
fn are_parted(cell: &str, decimal: DecimalMark, mark: ThousandsMark) -> bool {
    let plain = Dialect {
        decimal,
        ..Dialect::default()
    };
    let parted = Dialect {
        thousands: Some(mark),
        ..plain.clone()
    };
    plain.number(cell).is_none() && parted.number(cell).is_some()
}

/// A decimal comma is certain where a comma stands before another number of digits than three, or behind thousands that points part.
fn decimal(survey: &Survey, thousands: Option<ThousandsMark>) -> Result<DecimalMark, String> {
    let has = |decimal, mark| {
        let mut cells = survey.columns.iter().flatten();
        cells
            .any(|cell| cell.contains(',') && cell.contains('.') && are_parted(cell, decimal, mark))
    };
    if thousands == Some(ThousandsMark::Comma) || has(DecimalMark::Point, ThousandsMark::Comma) {
        return Ok(DecimalMark::Point);
    }
    if thousands == Some(ThousandsMark::Point) || has(DecimalMark::Comma, ThousandsMark::Point) {
        return Ok(DecimalMark::Comma);
    }
    let cells = survey.columns.iter().flatten();
    let mut with_comma = cells.filter(|cell| is_number_with_comma(cell)).peekable();
    let Some(first) = with_comma.peek().map(|cell| (*cell).clone()) else {
        return Ok(DecimalMark::Point);
    };
    let is_sure = |cell: &String| {
        let (whole, decimals) = cell.split_once(',').unwrap_or_default();
        decimals.len() != 3 || whole.trim_start_matches(['-', '+']) == "0"
    };
    if with_comma.any(is_sure) {
        return Ok(DecimalMark::Comma);
    }
    Err(format!(
        "numbers like {first:?}: the comma may stand before decimals or part thousands; \
         give --decimal comma or --thousands comma"
    ))
}

fn is_number_with_comma(cell: &str) -> bool {
    cell.matches(',').count() == 1
        && !cell.contains('.')
        && cell.replacen(',', ".", 1).parse::<f64>().is_ok()
}
