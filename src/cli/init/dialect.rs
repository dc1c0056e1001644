//! How a table is written, by its cells; where they leave a choice, the flag that makes it.

use super::times::{self, FoundTimes};
use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Dialect};
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
    let decimal = stated.decimal.map_or_else(|| decimal(survey), Ok);
    let decimal_mark = decimal.clone().unwrap_or_default();
    let time = times::find(survey, stated, decimal_mark);
    match (decimal, time) {
        (Ok(decimal), Ok(found)) => {
            let mut written = in_words(survey, decimal, found);
            written.dialect.skip_lines = stated.skip_lines.unwrap_or_default();
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
            time_columns: found.columns,
            time_format: found.format,
            skip_lines: 0,
        },
        needs_zone: found.needs_zone,
    }
}

/// A decimal comma is certain where a comma stands before another number of digits than three.
fn decimal(survey: &Survey) -> Result<DecimalMark, String> {
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
         give --decimal comma, or have the file written without marks for thousands"
    ))
}

fn is_number_with_comma(cell: &str) -> bool {
    cell.matches(',').count() == 1
        && !cell.contains('.')
        && cell.replacen(',', ".", 1).parse::<f64>().is_ok()
}
