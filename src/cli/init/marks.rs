//! The decimal mark of a table and the mark between its thousands, judged column by column: those of readings first.

use super::times;
use crate::cli::args::DialectArgs;
use crate::reading::{DecimalMark, Delimiter, Dialect, LengthUnit, ThousandsMark, Unit};
use crate::runtime::ingest::Survey;
use std::collections::BTreeSet;

/// Of the cells of a column with a mark, one in so many may have the other one: a slip of one row decides nothing.
const ONE_IN: usize = 10;

/// So many different whole numbers below 1000 in a column, beside numbers with a point and three digits behind it, show that the point parts
/// thousands: a logger that writes three decimals writes them of every number. One may be a mark for no value, such as 999.
const WHOLE_NUMBERS: usize = 2;

/// Other marks between thousands.
const OTHERS: &str = "'\u{2019} \u{a0}\u{202f}\u{2009}";

/// The cells of one column that hold a number with a point or a comma, by what they can mean.
#[derive(Debug, Clone, Default)]
struct MarkedCells {
    /// Points before decimals.
    point: Vec<String>,
    /// Points that may part thousands as well, as in `12.345`.
    open_point: Vec<String>,
    comma: Vec<String>,
    open_comma: Vec<String>,
    /// Thousands parted by points, as in `1.234,5`, and by commas.
    parted_by_points: Vec<String>,
    parted_by_commas: Vec<String>,
    /// Whole numbers from 1 to 999, each once.
    whole: BTreeSet<String>,
}

/// What the columns of one kind say.
#[derive(Debug, Clone, PartialEq, Eq)]
enum MarkVerdict {
    Nothing,
    Sure(DecimalMark, String),
    /// The mark stands there, and may part thousands.
    Open(DecimalMark, String),
    /// A cell with a decimal point, and one with a comma.
    Contradiction(String, String),
}

impl MarkedCells {
    fn of(cells: &[String]) -> Self {
        let mut marked = Self::default();
        for cell in cells {
            let plain: String = cell.chars().filter(|one| !OTHERS.contains(*one)).collect();
            let plain = plain.as_str();
            let place = match (plain.matches('.').count(), plain.matches(',').count()) {
                (1, 0) if is_number(plain) => {
                    if may_part_thousands(plain, '.') {
                        &mut marked.open_point
                    } else {
                        &mut marked.point
                    }
                }
                (0, 1) if is_number(&plain.replace(',', ".")) => {
                    if may_part_thousands(plain, ',') {
                        &mut marked.open_comma
                    } else {
                        &mut marked.comma
                    }
                }
                (0, 0) => {
                    if plain
                        .parse()
                        .is_ok_and(|number| (1..1000).contains(&number))
                    {
                        marked.whole.insert(cell.clone());
                    }
                    continue;
                }
                _ if are_parted(cell, DecimalMark::Comma, ThousandsMark::Point) => {
                    &mut marked.parted_by_points
                }
                _ if are_parted(cell, DecimalMark::Point, ThousandsMark::Comma) => {
                    &mut marked.parted_by_commas
                }
                _ => continue,
            };
            place.push(cell.clone());
        }
        marked
    }

    fn verdict(&self) -> MarkVerdict {
        let sure_point = [&self.point[..], &self.parted_by_commas].concat();
        let sure_comma = [&self.comma[..], &self.parted_by_points].concat();
        // What parts thousands in one cell may do so in the others.
        let open_point = match &self.parted_by_points[..] {
            [] => &self.open_point[..],
            _ => &[],
        };
        let open_comma = match &self.parted_by_commas[..] {
            [] => &self.open_comma[..],
            _ => &[],
        };
        let points = [&sure_point, open_point].concat();
        let commas = [&sure_comma, open_comma].concat();
        match (points.first(), commas.first()) {
            (None, None) => MarkVerdict::Nothing,
            (Some(point), None) => match sure_point.first() {
                Some(sure) => MarkVerdict::Sure(DecimalMark::Point, sure.clone()),
                None => MarkVerdict::Open(DecimalMark::Point, point.clone()),
            },
            (None, Some(comma)) => match sure_comma.first() {
                Some(sure) => MarkVerdict::Sure(DecimalMark::Comma, sure.clone()),
                None => MarkVerdict::Open(DecimalMark::Comma, comma.clone()),
            },
            (Some(point), Some(comma)) => {
                let is_slip = |few: usize, many: usize| ONE_IN * few <= few + many;
                if is_slip(commas.len(), sure_point.len()) {
                    MarkVerdict::Sure(DecimalMark::Point, sure_point[0].clone())
                } else if is_slip(points.len(), sure_comma.len()) {
                    MarkVerdict::Sure(DecimalMark::Comma, sure_comma[0].clone())
                } else {
                    MarkVerdict::Contradiction(point.clone(), comma.clone())
                }
            }
        }
    }
}

/// Whether the one mark in the cell may part thousands: three digits behind it, three at most before it, and not `0`.
fn may_part_thousands(cell: &str, mark: char) -> bool {
    let (whole, rest) = cell.split_once(mark).unwrap_or_default();
    let whole = whole.trim_start_matches(['-', '+']);
    let are_digits = |part: &str| part.bytes().all(|digit| digit.is_ascii_digit());
    rest.len() == 3
        && (1..=3).contains(&whole.len())
        && whole != "0"
        && are_digits(rest)
        && are_digits(whole)
}

fn is_number(cell: &str) -> bool {
    cell.parse::<f64>().is_ok_and(f64::is_finite)
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

/// Which columns of a table decide: those of readings, other ones of numbers, and what may be times.
struct MarkColumns<'a> {
    readings: Vec<&'a Vec<String>>,
    others: Vec<&'a Vec<String>>,
    rest: Vec<&'a Vec<String>>,
}

impl<'a> MarkColumns<'a> {
    fn of(
        survey: &'a Survey,
        stated: &DialectArgs,
        unit_of: &dyn Fn(&str) -> Option<Unit>,
    ) -> Self {
        let (mut readings, mut others, mut rest) = (Vec::new(), Vec::new(), Vec::new());
        for (at, (name, cells)) in survey.names.iter().zip(&survey.columns).enumerate() {
            let is_time = stated.time_columns.contains(name) || times::may_be_time(survey, at);
            if unit_of(name).is_some() {
                readings.push(cells);
            } else if !is_time && are_numbers(cells) {
                others.push(cells);
            } else {
                rest.push(cells);
            }
        }
        Self {
            readings,
            others,
            rest,
        }
    }

    fn of_numbers(&self) -> impl Iterator<Item = &'a Vec<String>> {
        self.readings.iter().chain(&self.others).copied()
    }
}

/// Whether a column holds numbers in more than half of the cells that are filled, and one row of ten has one.
fn are_numbers(cells: &[String]) -> bool {
    let filled = || cells.iter().filter(|cell| !cell.is_empty());
    let numbers = filled().filter(|cell| {
        cell.chars()
            .all(|one| one.is_ascii_digit() || "+-.,eE".contains(one) || OTHERS.contains(one))
    });
    2 * numbers.count() > filled().count() && ONE_IN * filled().count() >= cells.len()
}

/// What all of these columns say; where one contradicts another, a cell of each.
fn verdict_of(columns: &[&Vec<String>]) -> MarkVerdict {
    let marked: Vec<MarkedCells> = columns.iter().map(|cells| MarkedCells::of(cells)).collect();
    let each: Vec<MarkVerdict> = marked.iter().map(MarkedCells::verdict).collect();
    let mut contradictions = each
        .iter()
        .filter(|one| matches!(one, MarkVerdict::Contradiction(..)));
    if let Some(found) = contradictions.next() {
        return found.clone();
    }
    let sure = |wanted| {
        each.iter().find_map(|one| {
            if let MarkVerdict::Sure(mark, cell) = one {
                (*mark == wanted).then_some(cell)
            } else {
                None
            }
        })
    };
    let open = |wanted| {
        each.iter().find_map(|one| {
            if let MarkVerdict::Open(mark, cell) = one {
                (*mark == wanted).then_some(cell)
            } else {
                None
            }
        })
    };
    let (point, comma) = (sure(DecimalMark::Point), sure(DecimalMark::Comma));
    let is_parted =
        |part: fn(&MarkedCells) -> &Vec<String>| marked.iter().any(|one| !part(one).is_empty());
    let open_point = open(DecimalMark::Point).filter(|_| !is_parted(|one| &one.parted_by_points));
    let open_comma = open(DecimalMark::Comma).filter(|_| !is_parted(|one| &one.parted_by_commas));
    match (point.or(open_point), comma.or(open_comma)) {
        (Some(point), Some(comma)) => MarkVerdict::Contradiction(point.clone(), comma.clone()),
        (Some(cell), None) if point.is_some() => {
            MarkVerdict::Sure(DecimalMark::Point, cell.clone())
        }
        (None, Some(cell)) if comma.is_some() => {
            MarkVerdict::Sure(DecimalMark::Comma, cell.clone())
        }
        (Some(cell), None) => MarkVerdict::Open(DecimalMark::Point, cell.clone()),
        (None, Some(cell)) => MarkVerdict::Open(DecimalMark::Comma, cell.clone()),
        (None, None) => MarkVerdict::Nothing,
    }
}

/// The decimal mark of a table, or which flag decides it; `unit_of`: what a column's name or a flag says, of columns of readings.
pub(super) fn decimal(
    survey: &Survey,
    stated: &DialectArgs,
    unit_of: &dyn Fn(&str) -> Option<Unit>,
) -> Result<DecimalMark, String> {
    if let Some(decimal) = stated.decimal {
        return Ok(decimal);
    }
    match stated.thousands {
        Some(ThousandsMark::Comma) => return Ok(DecimalMark::Point),
        Some(ThousandsMark::Point) => return Ok(DecimalMark::Comma),
        Some(ThousandsMark::Blank | ThousandsMark::Apostrophe) | None => {}
    }
    let columns = MarkColumns::of(survey, stated, unit_of);
    let others = verdict_of(&columns.others);
    match (verdict_of(&columns.readings), others) {
        (MarkVerdict::Sure(mark, _), _) | (MarkVerdict::Nothing, MarkVerdict::Sure(mark, _)) => {
            Ok(mark)
        }
        (MarkVerdict::Contradiction(point, comma), _)
        | (MarkVerdict::Nothing, MarkVerdict::Contradiction(point, comma)) => {
            Err(contradiction(&point, &comma))
        }
        (
            MarkVerdict::Open(DecimalMark::Point, point),
            MarkVerdict::Sure(DecimalMark::Comma, comma),
        ) => Err(contradiction(&point, &comma)),
        (MarkVerdict::Open(DecimalMark::Point, _), others) => {
            let is_sure = matches!(others, MarkVerdict::Sure(DecimalMark::Point, _));
            let doubts = PointDoubts::of(survey, is_sure, unit_of);
            doubts.question().map_or(Ok(DecimalMark::Point), Err)
        }
        (MarkVerdict::Nothing, MarkVerdict::Open(DecimalMark::Point, _)) => Ok(DecimalMark::Point),
        (MarkVerdict::Open(DecimalMark::Comma, _), MarkVerdict::Sure(DecimalMark::Comma, _)) => {
            Ok(DecimalMark::Comma)
        }
        (MarkVerdict::Open(DecimalMark::Comma, cell), _)
        | (MarkVerdict::Nothing, MarkVerdict::Open(DecimalMark::Comma, cell)) => Err(format!(
            "numbers like {cell:?}: the comma may stand before decimals or part thousands; \
             give --decimal comma or --thousands comma"
        )),
        (MarkVerdict::Nothing, MarkVerdict::Nothing) => Ok(match verdict_of(&columns.rest) {
            MarkVerdict::Sure(mark, _) => mark,
            MarkVerdict::Nothing | MarkVerdict::Open(..) | MarkVerdict::Contradiction(..) => {
                DecimalMark::Point
            }
        }),
    }
}

fn contradiction(point: &str, comma: &str) -> String {
    format!(
        "there are numbers like {point:?} and like {comma:?}, and one of both marks stands before decimals: give --decimal point, \
         or --decimal comma (with --thousands point where the points part thousands)"
    )
}

/// Columns of readings in which every point has three digits behind it, and what speaks for points between thousands.
#[derive(Debug, Default)]
struct PointDoubts {
    /// A number with a point, and a whole one of the same column.
    beside_whole: Option<(String, String)>,
    /// A number of micrometres, which loggers write without decimals.
    micrometres: Option<String>,
    /// A number of millimetres or centimetres.
    other: Option<String>,
}

impl PointDoubts {
    /// `has_decimals`: other columns of the table have a decimal point for sure.
    fn of(survey: &Survey, has_decimals: bool, unit_of: &dyn Fn(&str) -> Option<Unit>) -> Self {
        let is_of_commas = survey.delimiter == Delimiter::Comma;
        let may_part = !has_decimals && (!is_of_commas || has_dates_with_points(survey));
        let mut doubts = Self::default();
        for (name, cells) in survey.names.iter().zip(&survey.columns) {
            let Some(Unit::Length(length) | Unit::Rate(length, _)) = unit_of(name) else {
                continue;
            };
            let marked = MarkedCells::of(cells);
            let Some(cell) = marked.open_point.first() else {
                continue;
            };
            if marked.whole.len() >= WHOLE_NUMBERS {
                let whole = marked.whole.first().cloned().unwrap_or_default();
                doubts.beside_whole.get_or_insert((cell.clone(), whole));
            }
            let place = match length {
                LengthUnit::Micrometre => &mut doubts.micrometres,
                LengthUnit::Millimetre | LengthUnit::Centimetre => &mut doubts.other,
                // Three decimals are what such a reading has.
                LengthUnit::Metre | LengthUnit::Inch | LengthUnit::Foot => continue,
            };
            if may_part {
                place.get_or_insert(cell.clone());
            }
        }
        doubts
    }

    /// What has to be said with a flag.
    fn question(&self) -> Option<String> {
        let (cell, why) = if let Some((cell, whole)) = &self.beside_whole {
            (cell, format!("whole ones like {whole:?} stand beside them"))
        } else {
            let cell = self.micrometres.as_ref()?;
            (cell, "they are micrometres".to_owned())
        };
        Some(format!(
            "numbers like {cell:?}, all with three digits behind the point, and {why}: the point may stand before decimals or part thousands; \
             give --decimal point or --thousands point"
        ))
    }
}

/// Whether a column has dates such as 01.09.2026, as they are written where points part thousands.
fn has_dates_with_points(survey: &Survey) -> bool {
    let is_date = |cell: &String| {
        let date = cell.split(' ').next().unwrap_or_default();
        let parts: Vec<&str> = date.split('.').collect();
        let are_digits = parts
            .iter()
            .all(|part| !part.is_empty() && part.bytes().all(|digit| digit.is_ascii_digit()));
        parts.len() == 3 && parts[0].len() <= 2 && are_digits
    };
    let first = |cells: &Vec<String>| cells.iter().find(|cell| !cell.is_empty()).cloned();
    let mut firsts = survey.columns.iter().filter_map(first);
    firsts.any(|cell| is_date(&cell))
}

/// What is said of a table whose readings were taken with decimal points though nothing in it shows that the points do not part thousands.
pub(super) fn doubt(
    survey: &Survey,
    stated: &DialectArgs,
    unit_of: &dyn Fn(&str) -> Option<Unit>,
) -> Option<String> {
    if stated.decimal.is_some() || stated.thousands.is_some() || !has_dates_with_points(survey) {
        return None;
    }
    let columns = MarkColumns::of(survey, stated, unit_of);
    let is_open = matches!(
        verdict_of(&columns.readings),
        MarkVerdict::Open(DecimalMark::Point, _)
    );
    let is_sure = matches!(
        verdict_of(&columns.others),
        MarkVerdict::Sure(DecimalMark::Point, _)
    );
    let cell = PointDoubts::of(survey, is_sure, unit_of)
        .other
        .filter(|_| is_open)?;
    Some(format!(
        "numbers like {cell:?}, all with three digits behind the point: the point is taken as the one before decimals; where it parts thousands, give \
         --thousands point, and where this is right, --decimal point"
    ))
}

/// What parts thousands, where a number that nothing else explains shows it.
pub(super) fn thousands(
    survey: &Survey,
    decimal: DecimalMark,
    stated: &DialectArgs,
    unit_of: &dyn Fn(&str) -> Option<Unit>,
) -> Option<ThousandsMark> {
    if stated.thousands.is_some() {
        return stated.thousands;
    }
    let columns = MarkColumns::of(survey, stated, unit_of);
    let has_parted = |mark: ThousandsMark| {
        let mut cells = columns.of_numbers().flatten();
        cells.any(|cell| {
            let marks = cell.matches(['.', ',']).count();
            // One point or comma alone may as well stand before decimals.
            are_parted(cell, decimal, mark) && (marks != 1 || !mark.may_be_decimal())
        })
    };
    let marks = [
        ThousandsMark::Comma,
        ThousandsMark::Point,
        ThousandsMark::Blank,
        ThousandsMark::Apostrophe,
    ];
    let mut others = marks.into_iter().filter(|mark| !mark.is_decimal(decimal));
    others.find(|mark| has_parted(*mark))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table of columns by name, each cell written as it stands.
    fn table(columns: &[(&str, Vec<String>)]) -> Survey {
        Survey {
            delimiter: Delimiter::Semicolon,
            names: columns.iter().map(|(name, _)| (*name).to_owned()).collect(),
            columns: columns.iter().map(|(_, cells)| cells.clone()).collect(),
            encoding: None,
        }
    }

    fn said(survey: &Survey) -> Result<(DecimalMark, Option<ThousandsMark>), String> {
        let stated = DialectArgs::default();
        let decimal = decimal(survey, &stated, &unit_of)?;
        Ok((decimal, thousands(survey, decimal, &stated, &unit_of)))
    }

    /// Of the tests' columns: those of readings begin with a P, and end with their unit.
    fn unit_of(name: &str) -> Option<Unit> {
        let unit = Unit::at_end_of(name).unwrap_or(Unit::MM);
        name.starts_with('P').then_some(unit)
    }

    fn column(cell: impl Fn(usize) -> String) -> Vec<String> {
        (0..200).map(cell).collect()
    }

    /// The same with another cell in row 50.
    fn with(mut cells: Vec<String>, odd: &str) -> Vec<String> {
        odd.clone_into(&mut cells[50]);
        cells
    }

    #[test]
    fn one_cell_with_a_comma_does_not_decide_how_readings_with_points_are_read() {
        let three = column(|row| format!("2{:02}.000", row % 100));
        let two = column(|row| format!("2{:02}.25", row % 100));
        let (empty, point) = (column(|_| String::new()), Ok((DecimalMark::Point, None)));
        let remark = with(empty, "12,5");
        assert_eq!(
            said(&table(&[("P1", three.clone()), ("Remark", remark)])),
            point
        );
        for odd in ["212,05", "212,050"] {
            assert_eq!(
                said(&table(&[("P1", with(two.clone(), odd))])),
                point,
                "{odd}"
            );
        }
        let battery = column(|_| "12,6".to_owned());
        assert_eq!(
            said(&table(&[("P1", two), ("Battery", battery.clone())])),
            point
        );
        // Three digits behind a point may be thousands, and nothing is guessed then.
        for table in [
            table(&[("P1", with(three.clone(), "212,05"))]),
            table(&[("P1", three), ("Battery", battery)]),
        ] {
            let refused = said(&table).unwrap_err();
            assert!(
                refused.contains("\"200.000\"") && refused.contains("--decimal point"),
                "{refused}"
            );
        }
    }

    #[test]
    fn a_point_with_three_digits_behind_it_is_asked_about_where_it_may_part_thousands() {
        let day = |row: usize| format!("{:02}.09.2026 00:00", 1 + row % 30);
        let (days, point) = (column(day), Ok((DecimalMark::Point, None)));
        let three = || column(|row| format!("{}.{:03}", 2 + row % 7, row));
        let with_days = |name, cells| table(&[("Zeit", days.clone()), (name, cells)]);
        let asked = said(&with_days("P1_um", three())).unwrap_err();
        assert!(
            asked.contains("\"2.000\"") && asked.contains("--thousands point"),
            "{asked}"
        );
        // Three decimals are usual of millimetres, and what they may be besides is said.
        let millimetres = with_days("P1_mm", three());
        assert_eq!(said(&millimetres), point);
        let doubt_of = |survey: &Survey| doubt(survey, &DialectArgs::default(), &unit_of);
        assert!(doubt_of(&millimetres).is_some_and(|said| said.contains("--thousands point")));
        let metres = with_days("P1_m", three());
        assert_eq!((said(&metres), doubt_of(&metres)), (point.clone(), None));
        // Whole numbers among them have no decimals.
        let grown = column(|row| match row {
            0..100 => (900 + row).to_string(),
            row => format!("1.{row:03}"),
        });
        let asked = said(&with_days("P1_mm", grown)).unwrap_err();
        assert!(asked.contains("\"900\""), "{asked}");
        // One number elsewhere that can be read in one way alone decides.
        for (name, cells) in [
            ("P1_um", with(three(), "0.512")),
            ("P1_um", with(three(), "12.5")),
            ("P1_mm", with(three(), "999")),
        ] {
            let survey = with_days(name, cells);
            assert_eq!(said(&survey), point, "{name}");
        }
        let battery = column(|_| "12.6".to_owned());
        let beside = table(&[
            ("Zeit", days.clone()),
            ("P1_um", three()),
            ("Batt", battery),
        ]);
        assert_eq!((said(&beside), doubt_of(&beside)), (point.clone(), None));
        let mut english = with_days("P1_um", three());
        english.delimiter = Delimiter::Comma;
        english.columns[0] = column(|_| "2026-09-01 00:00".to_owned());
        assert_eq!(said(&english), point);
    }

    #[test]
    fn a_decimal_comma_and_its_thousands_are_seen_in_the_readings() {
        let comma = |thousands| Ok((DecimalMark::Comma, thousands));
        let cells = column(|row| format!("{row},25"));
        let battery = column(|_| "12.6".to_owned());
        assert_eq!(
            said(&table(&[("P1", cells), ("Battery", battery)])),
            comma(None)
        );
        let german = column(|row| {
            if row.is_multiple_of(2) {
                format!("1.{row:03},5")
            } else {
                format!("1.{row:03}")
            }
        });
        assert_eq!(
            said(&table(&[("P1", german)])),
            comma(Some(ThousandsMark::Point))
        );
        let open = column(|row| format!("1,{row:03}"));
        let rain = column(|_| "0,2".to_owned());
        assert!(said(&table(&[("P1", open.clone())])).is_err());
        assert_eq!(said(&table(&[("P1", open), ("rain", rain)])), comma(None));
    }
}
