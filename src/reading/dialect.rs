//! How a table of text is written: what parts its cells, how its numbers and its times look.

use super::leading_zeros::with_leading_zeros;
use super::{LocalClock, TimeFault};
use jiff::civil::{Date, DateTime, Time};
use jiff::fmt::strtime::BrokenDownTime;
use jiff::tz::TimeZone;
use jiff::{SignedDuration, Timestamp};

/// What holds for every file of a source, where it is not as in CSV with RFC 3339 times.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Dialect {
    /// What separates the cells; with none, it is that of the header, see [`Delimiter::of_header`].
    pub delimiter: Option<Delimiter>,
    /// The decimal mark.
    pub decimal: DecimalMark,
    /// What parts the thousands of numbers, where something does.
    pub thousands: Option<ThousandsMark>,
    /// The columns that give the time, joined by a blank; with none, the one named `time` or `t_days`.
    pub time_columns: Vec<String>,
    /// How a time is written.
    pub time_format: TimeFormat,
    /// So many lines stand before the header.
    pub skip_lines: u64,
}

/// More lines stand before no header.
pub const MOST_SKIPPED: u64 = 1000;

impl Dialect {
    /// The instant that a time of such a file means; 24:00 is the end of its day.
    ///
    /// # Errors
    /// [`TimeFault`] says what is wrong with it.
    pub fn instant(&self, text: &str, clock: &LocalClock) -> Result<Timestamp, TimeFault> {
        self.within_day(text, clock).or_else(|fault| {
            let end = day_that_ends(text).and_then(|day| self.day_after(&day, clock));
            end.unwrap_or(Err(fault))
        })
    }

    /// A day after the time that `text` gives, on the same clock; `None` where it gives none.
    fn day_after(&self, text: &str, clock: &LocalClock) -> Option<Result<Timestamp, TimeFault>> {
        // Without a zone only a time that states its offset can be read.
        if let Ok(instant) = self.within_day(text, &LocalClock::default()) {
            let after = instant.checked_add(SignedDuration::from_hours(24));
            return Some(after.map_err(|_| TimeFault::NotATime));
        }
        let anywhere = LocalClock {
            zone: Some(TimeZone::UTC),
            ..LocalClock::default()
        };
        let begins = self.within_day(text, &anywhere).ok()?;
        let local = begins.to_zoned(TimeZone::UTC).datetime();
        Some(clock.of_local(local.checked_add(SignedDuration::from_hours(24)).ok()?))
    }

    fn within_day(&self, text: &str, clock: &LocalClock) -> Result<Timestamp, TimeFault> {
        match &self.time_format {
            TimeFormat::Rfc3339 => clock.instant(text).map_err(|fault| {
                if fault == TimeFault::NotATime {
                    likely_fault(text)
                } else {
                    fault
                }
            }),
            TimeFormat::Pattern(pattern) => by_pattern(pattern, text, clock),
            TimeFormat::UnixSeconds => {
                let seconds = self
                    .number(text)
                    .filter(|one| one.abs() < LATEST_UNIX_SECOND);
                from_milliseconds(seconds.map(|one| one * 1e3)).ok_or(TimeFault::NotUnix)
            }
            TimeFormat::UnixMilliseconds => {
                let milliseconds = self.number(text);
                if milliseconds.is_some_and(|one| SECONDS_OF_NOW.contains(&one)) {
                    return Err(TimeFault::SecondsNotMilliseconds);
                }
                from_milliseconds(milliseconds).ok_or(TimeFault::NotUnix)
            }
            TimeFormat::ExcelDays => {
                let days = self.number(text).filter(|days| EXCEL_DAYS.contains(days));
                let local = days.and_then(excel_date).ok_or(TimeFault::NotExcel)?;
                clock.of_local(local)
            }
            TimeFormat::JulianDays => {
                let days = self.number(text).filter(|days| JULIAN_DAYS.contains(days));
                from_julian_days(days.ok_or(TimeFault::NotJulian)?)
            }
        }
    }

    /// The number that a cell holds, also `inf` and `NaN`: the caller refuses what is not finite.
    pub fn number(&self, cell: &str) -> Option<f64> {
        let (ascii, plain);
        // Office programs write the minus sign of typography.
        let cell = match cell.strip_prefix('\u{2212}') {
            Some(digits) => {
                ascii = format!("-{digits}");
                &ascii
            }
            None => cell,
        };
        let cell = match self.thousands {
            Some(mark) if mark.stands_in(cell) => {
                plain = self.without_thousands(cell, mark)?;
                &plain
            }
            Some(_) | None => cell,
        };
        let number: f64 = match self.decimal {
            DecimalMark::Point => cell.parse().ok()?,
            // A point beside a decimal comma parts thousands in some countries: nothing is guessed.
            DecimalMark::Comma if cell.contains('.') => return None,
            DecimalMark::Comma => cell.replacen(',', ".", 1).parse().ok()?,
        };
        Some(number)
    }

    /// The same without the marks between thousands: at most three digits before the first, three after each, and none behind the
    /// decimal mark. `None` where that is not so.
    fn without_thousands(&self, cell: &str, mark: ThousandsMark) -> Option<String> {
        let decimal = match self.decimal {
            DecimalMark::Point => '.',
            DecimalMark::Comma => ',',
        };
        let from = usize::from(cell.starts_with(['-', '+']));
        let until = cell.find(decimal).unwrap_or(cell.len());
        let groups: Vec<&str> = cell.get(from..until)?.split(|one| mark.is(one)).collect();
        let are_digits = |group: &&str| group.bytes().all(|byte| byte.is_ascii_digit());
        let (first, others) = groups.split_first()?;
        let is_number = (1..=3).contains(&first.len())
            && others.iter().all(|group| group.len() == 3)
            && groups.iter().all(are_digits)
            && !mark.stands_in(&cell[until..]);
        is_number.then(|| [&cell[..from], &groups.concat(), &cell[until..]].concat())
    }
}

/// What separates the cells of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Delimiter {
    /// `,`
    Comma,
    /// `;`
    Semicolon,
    /// A tab.
    Tab,
}

impl Delimiter {
    /// Parses `,`, `;` or a tab, or `comma`, `semicolon`, `tab`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "," | "comma" => Ok(Self::Comma),
            ";" | "semicolon" => Ok(Self::Semicolon),
            "\t" | "tab" | "\\t" => Ok(Self::Tab),
            _ => Err("write comma, semicolon or tab".to_owned()),
        }
    }

    /// The word in the config.
    pub fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma",
            Self::Semicolon => "semicolon",
            Self::Tab => "tab",
        }
    }

    /// The byte itself.
    pub fn byte(self) -> u8 {
        match self {
            Self::Comma => b',',
            Self::Semicolon => b';',
            Self::Tab => b'\t',
        }
    }

    /// A comma, unless the header has none and has tabs or semicolons.
    pub fn of_header(header: &str) -> Self {
        let has = |mark: char| header.contains(mark);
        match (has(','), has('\t'), has(';')) {
            (false, true, _) => Self::Tab,
            (false, false, true) => Self::Semicolon,
            (true, _, _) | (false, false, false) => Self::Comma,
        }
    }
}

/// The decimal mark of a number.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum DecimalMark {
    /// `12.5`
    #[default]
    Point,
    /// `12,5`
    Comma,
}

impl DecimalMark {
    /// Parses `.` or `,`, or `point`, `comma`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "." | "point" => Ok(Self::Point),
            "," | "comma" => Ok(Self::Comma),
            _ => Err("write point or comma".to_owned()),
        }
    }
}

/// What parts the thousands of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ThousandsMark {
    /// `1,234.5`
    Comma,
    /// `1.234,5`
    Point,
    /// `1 234.5`, also with blanks that no line is broken at.
    Blank,
    /// `1'234.5`
    Apostrophe,
}

impl ThousandsMark {
    /// Parses `,`, `.`, a blank or `'`, or `comma`, `point`, `blank`, `apostrophe`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "," | "comma" => Ok(Self::Comma),
            "." | "point" => Ok(Self::Point),
            " " | "blank" => Ok(Self::Blank),
            "'" | "apostrophe" => Ok(Self::Apostrophe),
            _ => Err("write comma, point, blank or apostrophe".to_owned()),
        }
    }

    /// The word of a config.
    pub fn name(self) -> &'static str {
        match self {
            Self::Comma => "comma",
            Self::Point => "point",
            Self::Blank => "blank",
            Self::Apostrophe => "apostrophe",
        }
    }

    /// Whether it is what stands before the decimals too.
    pub fn is_decimal(self, decimal: DecimalMark) -> bool {
        matches!(
            (self, decimal),
            (Self::Comma, DecimalMark::Comma) | (Self::Point, DecimalMark::Point)
        )
    }

    /// Whether the same stands before decimals elsewhere.
    pub fn may_be_decimal(self) -> bool {
        matches!(self, Self::Comma | Self::Point)
    }

    fn is(self, one: char) -> bool {
        match self {
            Self::Comma => one == ',',
            Self::Point => one == '.',
            Self::Blank => matches!(one, ' ' | '\u{a0}' | '\u{202f}' | '\u{2009}'),
            Self::Apostrophe => matches!(one, '\'' | '\u{2019}'),
        }
    }

    fn stands_in(self, text: &str) -> bool {
        text.contains(|one| self.is(one))
    }
}

/// How the times of a file are written.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub enum TimeFormat {
    /// `2017-06-06T17:00:00+02:00`, or without the offset where the zone is known.
    #[default]
    Rfc3339,
    /// As a pattern says: `%d.%m.%Y %H:%M`.
    Pattern(String),
    /// Seconds since 1970-01-01T00:00:00Z.
    UnixSeconds,
    /// Milliseconds since 1970-01-01T00:00:00Z.
    UnixMilliseconds,
    /// Days since 1899-12-30 on the local clock, as Excel keeps a date.
    ExcelDays,
    /// Modified Julian days: days since 1858-11-17T00:00:00Z, as GNSS solutions are dated.
    JulianDays,
}

/// The year 5138; what is larger is not in seconds.
const LATEST_UNIX_SECOND: f64 = 1e11;
/// From 1973 to 2286 in seconds; as milliseconds they would all lie in early 1970.
const SECONDS_OF_NOW: std::ops::Range<f64> = 1e8..1e10;
/// The first year of four digits that is taken: jiff reads `26` as a year by `%Y` too.
const FIRST_LONG_YEAR: i16 = 100;
/// From 1900 to 2173.
const EXCEL_DAYS: std::ops::Range<f64> = 1.0..100_000.0;
/// From 1900 to 2173.
const JULIAN_DAYS: std::ops::Range<f64> = 15_020.0..115_000.0;
/// Seconds from day 0 of the modified Julian days to 1970.
const JULIAN_SECONDS: f64 = 40_587.0 * super::SECONDS_PER_DAY;
/// Day 0 of Excel's dates after February 1900.
const EXCEL_EPOCH: Date = Date::constant(1899, 12, 30);
/// An instant that every part of a pattern can write.
const TRIAL: DateTime = DateTime::constant(2017, 11, 23, 17, 46, 39, 0);

impl TimeFormat {
    /// Parses `rfc3339`, `unix`, `unix_ms`, `excel`, `mjd` or a pattern of `%Y %m %d %H %M %S`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "rfc3339" => Ok(Self::Rfc3339),
            "unix" => Ok(Self::UnixSeconds),
            "unix_ms" => Ok(Self::UnixMilliseconds),
            "excel" => Ok(Self::ExcelDays),
            "mjd" => Ok(Self::JulianDays),
            pattern if is_pattern(pattern) => Ok(Self::Pattern(pattern.to_owned())),
            _ => Err(
                "write a pattern with day, month and year, such as \"%d.%m.%Y %H:%M\" or \"%m/%d/%Y %I:%M %p\", \
                 or one of rfc3339, unix, unix_ms, excel, mjd"
                    .to_owned(),
            ),
        }
    }
}

/// Whether a date that the pattern writes is read as the same date again.
fn is_pattern(pattern: &str) -> bool {
    let Ok(zoned) = TRIAL.to_zoned(jiff::tz::TimeZone::UTC) else {
        return false;
    };
    let Ok(written) = BrokenDownTime::from(&zoned).to_string(pattern) else {
        return false;
    };
    let read = BrokenDownTime::parse(pattern, &written);
    read.and_then(|read| read.to_date())
        .is_ok_and(|date| date == TRIAL.date())
}

/// The time at which the day begins that ends at the time `text`: `2024-05-01 00:00` for `2024-05-01 24:00`.
fn day_that_ends(text: &str) -> Option<String> {
    // Hours from 1 to 24, and times without a colon.
    for (end, begin) in [(" 2400", " 0000"), (" 24", " 00")] {
        if let Some(date) = text.strip_suffix(end) {
            return Some(format!("{date}{begin}"));
        }
    }
    let (date, time) = text.split_once([' ', 'T', 't'])?;
    let rest = time.trim_start().strip_prefix("24:00")?;
    let after = rest.strip_prefix(":00").unwrap_or(rest);
    let is_end = !after.starts_with([':', '.']) || after.trim_start_matches(['.', '0']).is_empty();
    is_end.then(|| format!("{date}{}00:00{rest}", &text[date.len()..=date.len()]))
}

fn by_pattern(pattern: &str, text: &str, clock: &LocalClock) -> Result<Timestamp, TimeFault> {
    let text = &*with_leading_zeros(pattern, text);
    let read = BrokenDownTime::parse(pattern, text).map_err(|_| TimeFault::NotThePattern)?;
    let date = read.to_date().map_err(|_| TimeFault::NotThePattern);
    if (date.as_ref()).is_ok_and(|date| (0..FIRST_LONG_YEAR).contains(&date.year())) {
        return Err(TimeFault::ShortYear);
    }
    if read.offset().is_some() {
        return read.to_timestamp().map_err(|_| TimeFault::NotThePattern);
    }
    let date = date?;
    let time = match read.hour() {
        None => Time::midnight(),
        Some(_) => read.to_time().map_err(|_| TimeFault::NotThePattern)?,
    };
    clock.of_local(date.to_datetime(time))
}

fn from_milliseconds(milliseconds: Option<f64>) -> Option<Timestamp> {
    let milliseconds = milliseconds?.round();
    if !milliseconds.is_finite() || milliseconds.abs() > LATEST_UNIX_SECOND * 1e3 {
        return None;
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "bounded by 1e14 just above"
    )]
    let milliseconds = milliseconds as i64;
    Timestamp::from_millisecond(milliseconds).ok()
}

/// To the nearest second, as a day is given to five decimals.
fn from_julian_days(days: f64) -> Result<Timestamp, TimeFault> {
    #[expect(clippy::cast_possible_truncation, reason = "bounded by JULIAN_DAYS")]
    let second = (days * super::SECONDS_PER_DAY - JULIAN_SECONDS).round() as i64;
    Timestamp::from_second(second).map_err(|_| TimeFault::NotJulian)
}

/// To the nearest second: a day is kept as a number of 15 digits.
fn excel_date(days: f64) -> Option<DateTime> {
    #[expect(clippy::cast_possible_truncation, reason = "bounded by EXCEL_DAYS")]
    let seconds = (days * super::SECONDS_PER_DAY).round() as i64;
    let start = EXCEL_EPOCH.to_datetime(Time::midnight());
    start.checked_add(SignedDuration::from_secs(seconds)).ok()
}

/// What a text most likely is that is no RFC 3339 time.
fn likely_fault(text: &str) -> TimeFault {
    if let Ok(number) = text.parse::<f64>() {
        return match number {
            20_000.0..80_000.0 => TimeFault::LikeExcel,
            1e8..1e13 => TimeFault::LikeUnix,
            _ => TimeFault::NotATime,
        };
    }
    let digits = text.bytes().take_while(u8::is_ascii_digit).count();
    let mark = text.as_bytes().get(digits).copied().unwrap_or_default();
    match (digits, mark) {
        (1 | 2, b'.' | b'/' | b'-') => TimeFault::LikeDayOrMonthFirst,
        (4, b'/' | b'.') => TimeFault::LikeAPattern,
        (4, b'-') if text.parse::<Date>().is_ok() && !text.contains(':') => TimeFault::OnlyADate,
        (4, b'-') if is_written_as_a_date(text) && text[..DATE_LENGTH].parse::<Date>().is_err() => {
            TimeFault::NoSuchDate
        }
        _ => TimeFault::NotATime,
    }
}

/// Characters of a date such as 2026-02-28.
const DATE_LENGTH: usize = 10;

/// Whether it begins with four digits, two and two, with dashes between.
fn is_written_as_a_date(text: &str) -> bool {
    let date = text.as_bytes().get(..DATE_LENGTH).unwrap_or_default();
    let is_in_place = |(place, byte): (usize, &u8)| match place {
        4 | 7 => *byte == b'-',
        _ => byte.is_ascii_digit(),
    };
    date.len() == DATE_LENGTH && date.iter().enumerate().all(is_in_place)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reading::SummerTime;

    fn rome() -> LocalClock {
        LocalClock {
            zone: Some(jiff::tz::TimeZone::get("Europe/Rome").unwrap()),
            summer_time: SummerTime::Reject,
        }
    }

    fn utc(format: &str, text: &str) -> String {
        let dialect = Dialect {
            time_format: TimeFormat::parse(format).unwrap(),
            ..Dialect::default()
        };
        match dialect.instant(text, &rome()) {
            Ok(time) => time.to_string(),
            Err(fault) => format!("{fault:?}"),
        }
    }

    #[test]
    fn a_time_is_read_as_its_format_says() {
        let cases = [
            ("%d.%m.%Y %H:%M", "06.07.2017 17:00", "2017-07-06T15:00:00Z"),
            ("%d.%m.%Y %H:%M", "6.7.2017 17:00", "2017-07-06T15:00:00Z"),
            (
                "%m/%d/%Y %H:%M:%S",
                "06/07/2017 17:00:30",
                "2017-06-07T15:00:30Z",
            ),
            (
                "%m/%d/%Y %I:%M %p",
                "06/07/2017 05:00 PM",
                "2017-06-07T15:00:00Z",
            ),
            ("%d/%m/%Y", "06/07/2017", "2017-07-05T22:00:00Z"),
            (
                "%Y-%m-%d %H:%M:%S%z",
                "2017-07-06 17:00:00+0500",
                "2017-07-06T12:00:00Z",
            ),
            ("%d.%m.%Y %H:%M", "07/06/2017 17:00", "NotThePattern"),
            ("%d.%m.%Y %H:%M", "06.07.17 17:00", "ShortYear"),
            ("%d.%m.%y %H:%M", "06.07.17 17:00", "2017-07-06T15:00:00Z"),
            ("%d.%m.%Y %H:%M %z", "06.07.17 17:00 +0200", "ShortYear"),
            (
                "%d.%m.%y %H:%M %z",
                "06.07.17 17:00 +0200",
                "2017-07-06T15:00:00Z",
            ),
            ("unix", "1499353200", "2017-07-06T15:00:00Z"),
            ("unix", "1499353200000", "NotUnix"),
            ("unix_ms", "1499353200000", "2017-07-06T15:00:00Z"),
            ("unix_ms", "1499353200", "SecondsNotMilliseconds"),
            ("unix_ms", "60000", "1970-01-01T00:01:00Z"),
            ("excel", "42922.708333333", "2017-07-06T15:00:00Z"),
            ("excel", "1499353200", "NotExcel"),
            ("mjd", "57940.625", "2017-07-06T15:00:00Z"),
            ("mjd", "57940.62501", "2017-07-06T15:00:01Z"),
            ("mjd", "2457941.125", "NotJulian"),
            ("rfc3339", "06/07/2017 17:00", "LikeDayOrMonthFirst"),
            ("rfc3339", "42922.7083", "LikeExcel"),
            ("rfc3339", "1499353200", "LikeUnix"),
            ("rfc3339", "2017/07/06 17:00", "LikeAPattern"),
            ("rfc3339", "2017-07-06", "OnlyADate"),
            ("rfc3339", "2026-02-29T10:00:00Z", "NoSuchDate"),
            ("rfc3339", "noon", "NotATime"),
        ];
        for (format, text, expected) in cases {
            assert_eq!(utc(format, text), expected, "{format}: {text}");
        }
    }

    #[test]
    fn hour_24_is_the_end_of_the_day_on_the_loggers_clock() {
        let cases = [
            ("rfc3339", "2017-07-06T24:00:00Z", "2017-07-07T00:00:00Z"),
            ("rfc3339", "2017-07-06 24:00", "2017-07-06T22:00:00Z"),
            // The clocks are put forward at 02:00 on the 26th, and the day before has 24 hours.
            ("rfc3339", "2017-03-25 24:00:00", "2017-03-25T23:00:00Z"),
            ("rfc3339", "2017-03-26 24:00:00.000", "2017-03-26T22:00:00Z"),
            ("%d.%m.%Y %H:%M", "31.12.2017 24:00", "2017-12-31T23:00:00Z"),
            ("rfc3339", "2017-07-06T24:01:00Z", "NotATime"),
            ("rfc3339", "2017-07-06T24:00:01Z", "NotATime"),
            ("rfc3339", "9999-12-30T24:00:00Z", "NotATime"),
            ("rfc3339", "9999-12-31T24:00:00+02:00", "NotATime"),
            ("%d.%m.%Y %H:%M", "31.12.2017 24:10", "NotThePattern"),
            ("%d.%m.%Y %H:%M", "24:00", "NotThePattern"),
        ];
        for (format, text, expected) in cases {
            assert_eq!(utc(format, text), expected, "{format}: {text}");
        }
    }

    #[test]
    fn a_pattern_that_gives_no_date_is_refused() {
        for text in ["", "dd.mm.yyyy", "%H:%M", "%d.%m", "%Q", "Excel"] {
            assert!(TimeFormat::parse(text).is_err(), "{text}");
        }
    }

    #[test]
    fn a_decimal_comma_is_one_only_where_that_is_said() {
        let comma = Dialect {
            decimal: DecimalMark::Comma,
            ..Dialect::default()
        };
        assert_eq!(comma.number("-12,5"), Some(-12.5));
        assert_eq!(comma.number("12"), Some(12.0));
        assert_eq!(comma.number("1.234,5"), None);
        assert_eq!(Dialect::default().number("12,5"), None);
    }

    #[test]
    fn thousands_are_parted_by_the_mark_that_is_said_and_by_no_other() {
        let with = |decimal, thousands| Dialect {
            decimal,
            thousands: Some(thousands),
            ..Dialect::default()
        };
        let german = with(DecimalMark::Comma, ThousandsMark::Point);
        let english = with(DecimalMark::Point, ThousandsMark::Comma);
        let swiss = with(DecimalMark::Point, ThousandsMark::Apostrophe);
        let french = with(DecimalMark::Comma, ThousandsMark::Blank);
        let cases = [
            (&german, "-1.234.567,25", Some(-1_234_567.25)),
            (&german, "1.234", Some(1234.0)),
            (&german, "1234,5", Some(1234.5)),
            (&german, "12,5", Some(12.5)),
            (&german, "1.23", None),
            (&german, "1.2345,5", None),
            (&german, "1234.567,5", None),
            (&german, ".234", None),
            (&german, "1,234.5", None),
            (&english, "+1,234.5", Some(1234.5)),
            (&english, "1.234,5", None),
            (&swiss, "1'234.5", Some(1234.5)),
            (&swiss, "1\u{2019}234", Some(1234.0)),
            (&french, "12\u{202f}345,5", Some(12345.5)),
            (&french, "1 234 567", Some(1_234_567.0)),
        ];
        for (dialect, cell, number) in cases {
            assert_eq!(dialect.number(cell), number, "{cell}");
        }
        // What would be both is neither.
        let both = with(DecimalMark::Point, ThousandsMark::Point);
        assert_eq!(both.number("1.234.567"), None);
    }

    #[test]
    fn a_header_without_commas_shows_what_parts_its_cells() {
        let cases = [
            ("time,a", Delimiter::Comma),
            ("time;a", Delimiter::Semicolon),
            ("time\ta", Delimiter::Tab),
            ("time;a,b", Delimiter::Comma),
            ("time", Delimiter::Comma),
        ];
        for (header, delimiter) in cases {
            assert_eq!(Delimiter::of_header(header), delimiter, "{header}");
        }
    }
}
