//! How a table is written, by its cells; where they leave a choice, the flag that makes it.

use super::times::{self, FoundTimes};
use super::{clock, marks};
use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Dialect, Unit};
use crate::runtime::ingest::Survey;
use jiff::tz::TimeZone;

/// What a table's cells and the flags say of it.
#[derive(Debug, Clone)]
pub(super) struct Written {
    pub(super) dialect: Dialect,
    /// Whether its times say nothing of their zone.
    pub(super) needs_zone: bool,
    /// The zone that the name of their column has.
    pub(super) zone: Option<TimeZone>,
    /// Whether they are days since a day 0, in a column `t_days`.
    pub(super) is_in_days: bool,
    /// What of it is taken in one way, and may be meant in another.
    pub(super) doubts: Vec<String>,
}

/// How the table is written, or what the file leaves open; `unit_of`: what a column's name or a flag says, of columns of readings.
pub(super) fn written(
    survey: &Survey,
    stated: &DialectArgs,
    unit_of: &dyn Fn(&str) -> Option<Unit>,
) -> Result<Written, Vec<String>> {
    let decimal = marks::decimal(survey, stated, unit_of);
    let decimal_mark = decimal.clone().unwrap_or_default();
    let time = times::find(survey, stated, decimal_mark);
    match (decimal, time) {
        (Ok(decimal), Ok(found)) => {
            let mut written = in_words(survey, decimal, found);
            written.dialect.skip_lines = stated.skip_lines.unwrap_or_default();
            written.dialect.thousands = marks::thousands(survey, decimal, stated, unit_of);
            written.doubts.extend(marks::doubt(survey, stated, unit_of));
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
    let zone = found
        .columns
        .iter()
        .find_map(|name| clock::zone_in_name(name));
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
        zone,
        doubts: Vec::new(),
    }
}
