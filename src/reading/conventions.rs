//! How a source writes what its files do not spell out: times without an offset, marks for no value.

use jiff::civil::DateTime;
use jiff::tz::{AmbiguousOffset, Offset, TimeZone};
use jiff::{SignedDuration, Timestamp};

/// What holds for all files and messages of one source.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Conventions {
    /// The clock that times without an offset were read from.
    pub clock: LocalClock,
    /// What stands where the sensor gave nothing.
    pub missing: MissingValues,
}

impl Conventions {
    /// With the defaults of a data logger, whose times never have an offset and whose fault codes
    /// are numbers: UTC where no zone is given, and -7999 and -99999 beside NAN and INF.
    #[must_use]
    pub fn of_a_logger(mut self) -> Self {
        self.clock.zone.get_or_insert(TimeZone::UTC);
        self.missing.numbers.extend(LOGGER_CODES);
        self
    }
}

/// What a Campbell logger writes for a channel out of range, in a two- and a four-byte format.
const LOGGER_CODES: [f64; 2] = [-7999.0, -99_999.0];
/// A zone's summer time and its standard time follow each other within this.
const A_YEAR: SignedDuration = SignedDuration::from_hours(400 * 24);

/// A clock on a host_time, or in a logger.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LocalClock {
    /// Where it hangs; without one, a time must state its offset.
    pub zone: Option<TimeZone>,
    /// What it does when the zone's clocks are changed.
    pub summer_time: SummerTime,
}

/// What becomes of a local time that the zone's clocks showed twice, or never.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum SummerTime {
    /// It is refused: nobody can say when that was.
    #[default]
    Reject,
    /// The earlier of the two instants that it may mean.
    Earlier,
    /// The later of the two.
    Later,
    /// The clock is never changed: it keeps the zone's standard time all year, as loggers do.
    Standard,
}

impl SummerTime {
    /// Parses `reject`, `earlier`, `later` or `standard`.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(text: &str) -> Result<Self, String> {
        match text {
            "reject" => Ok(Self::Reject),
            "earlier" => Ok(Self::Earlier),
            "later" => Ok(Self::Later),
            "standard" => Ok(Self::Standard),
            _ => Err(
                "write reject, earlier, later or standard (a logger without summer time)"
                    .to_owned(),
            ),
        }
    }
}

/// Why a text is no instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TimeFault {
    /// It is no date and time, or one without offset where no zone is known.
    NotATime,
    /// The clocks showed it twice.
    Twice,
    /// The clocks skipped it.
    Never,
    /// It states no offset, and no zone is known.
    NoZone,
    /// It is not as the pattern says.
    NotThePattern,
    /// It is no number of seconds or milliseconds since 1970.
    NotUnix,
    /// It is a number of seconds since 1970, where one of milliseconds was expected.
    SecondsNotMilliseconds,
    /// Its year has two digits, where four were expected.
    ShortYear,
    /// It is no number of days since 1900.
    NotExcel,
    /// It is no number of days since 1858-11-17.
    NotJulian,
    /// It may be a number of days since 1900, where none was expected.
    LikeExcel,
    /// It may be such a number of seconds, where none was expected.
    LikeUnix,
    /// It begins with a day or with a month.
    LikeDayOrMonthFirst,
    /// It begins with the year, and not as in RFC 3339.
    LikeAPattern,
    /// It has no time of day.
    OnlyADate,
    /// It is written as a date that no calendar has.
    NoSuchDate,
}

impl TimeFault {
    /// What would have been right.
    pub fn expected(self) -> &'static str {
        match self {
            Self::NotATime => {
                "an RFC 3339 time with its offset, such as 2013-11-20T20:31:19+10:00, or one without where the source's time_zone (--time-zone) is given"
            }
            Self::Twice => {
                "a local time that the zone's clocks showed once; this one they showed twice: set dst (--dst) to standard, earlier or later"
            }
            Self::Never => {
                "a local time that the zone's clocks showed; this one they skipped: set dst (--dst) to standard, earlier or later"
            }
            Self::NoZone => {
                "a time with its offset, or the source's time_zone (--time-zone), such as Europe/Rome"
            }
            Self::NotThePattern => "a time as time_format (--time-format) says",
            Self::NotUnix => {
                "seconds since 1970 (unix) or milliseconds (unix_ms), as time_format (--time-format) says; what counts otherwise, such as in microseconds, must be converted"
            }
            Self::SecondsNotMilliseconds => {
                "milliseconds since 1970, as time_format (--time-format) says; unix for seconds"
            }
            Self::ShortYear => {
                "a year of four digits, as %Y in time_format (--time-format) says; %y for two"
            }
            Self::NotExcel => "days since 1900, as time_format (--time-format) = excel says",
            Self::NotJulian => {
                "modified Julian days, days since 1858-11-17, as time_format (--time-format) = mjd says; a Julian date is 2400000.5 more"
            }
            Self::LikeExcel => {
                "an RFC 3339 time; if this is a date of Excel's, set time_format (--time-format) to excel, if a modified Julian date, to mjd"
            }
            Self::LikeUnix => {
                "an RFC 3339 time; if these are seconds since 1970, set time_format (--time-format) to unix, for milliseconds to unix_ms"
            }
            Self::LikeDayOrMonthFirst => {
                "an RFC 3339 time; set time_format (--time-format), as in %d.%m.%Y %H:%M where the day stands first or %m/%d/%Y %H:%M where the month does"
            }
            Self::LikeAPattern => {
                "an RFC 3339 time; set time_format (--time-format), as in %Y/%m/%d %H:%M:%S"
            }
            Self::OnlyADate => {
                "an RFC 3339 time with its hour; if midnight is meant, set time_format (--time-format) to %Y-%m-%d, and time_zone (--time-zone)"
            }
            Self::NoSuchDate => "a date that the calendar has",
        }
    }
}

impl LocalClock {
    /// The instant of an RFC 3339 time, or of `2017-06-06 17:00:00` on this clock.
    ///
    /// # Errors
    /// [`TimeFault`] says why there is no such instant, or no single one.
    pub fn instant(&self, text: &str) -> Result<Timestamp, TimeFault> {
        // A date has two dashes in its first ten places; a sign or a Z after them is an offset.
        let states_offset = || {
            let time = text.get(10..);
            time.is_some_and(|time| time.contains(['Z', 'z', '+', '-']))
        };
        let Some(zone) = self.zone.as_ref().filter(|_| !states_offset()) else {
            return text.parse().map_err(|_| TimeFault::NotATime);
        };
        if !text.contains(':') {
            return Err(TimeFault::NotATime);
        }
        let local: DateTime = text.parse().map_err(|_| TimeFault::NotATime)?;
        self.resolve(zone, local)
    }

    /// The instant at which the clock showed this.
    ///
    /// # Errors
    /// [`TimeFault`] says why there is no such instant, or no single one.
    pub fn of_local(&self, local: DateTime) -> Result<Timestamp, TimeFault> {
        let zone = self.zone.as_ref().ok_or(TimeFault::NoZone)?;
        self.resolve(zone, local)
    }

    fn resolve(&self, zone: &TimeZone, local: DateTime) -> Result<Timestamp, TimeFault> {
        let at = |offset: Offset| offset.to_timestamp(local).map_err(|_| TimeFault::NotATime);
        if self.summer_time == SummerTime::Standard {
            return at(standard_offset(zone, at(Offset::UTC)?));
        }
        let (one, other, fault) = match zone.to_ambiguous_timestamp(local).offset() {
            AmbiguousOffset::Unambiguous { offset } => return at(offset),
            AmbiguousOffset::Fold { before, after } => (at(before)?, at(after)?, TimeFault::Twice),
            AmbiguousOffset::Gap { before, after } => (at(before)?, at(after)?, TimeFault::Never),
        };
        match self.summer_time {
            SummerTime::Earlier => Ok(one.min(other)),
            SummerTime::Later => Ok(one.max(other)),
            SummerTime::Reject | SummerTime::Standard => Err(fault),
        }
    }
}

/// The offset of the zone's standard time around `near`: the smaller one of the two that summer time
/// switches between, for there are zones (Dublin) whose database entry calls the summer standard.
fn standard_offset(zone: &TimeZone, near: Timestamp) -> Offset {
    let now = zone.to_offset_info(near);
    let other = zone
        .preceding(near)
        .take_while(|change| near.duration_since(change.timestamp()) < A_YEAR)
        .find(|change| change.dst() != now.dst());
    other.map_or(now.offset(), |other| other.offset().min(now.offset()))
}

/// Marks that stand where a sensor gave no value; each is matched by the whole cell.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MissingValues {
    words: Vec<String>,
    numbers: Vec<f64>,
}

impl MissingValues {
    /// Adds a mark: a number stands for every way to write it, a word for every case of its letters.
    pub fn add(&mut self, mark: &str) {
        match mark.trim().parse::<f64>() {
            Ok(number) => self.numbers.push(number),
            Err(_) => self.words.push(mark.trim().to_owned()),
        }
    }

    /// The marks, but for those that a data logger's files have in any case; empty where there are none.
    pub fn in_words(&self) -> String {
        let stated = |number: &&f64| !LOGGER_CODES.contains(number);
        let numbers = self.numbers.iter().filter(stated).map(f64::to_string);
        let all: Vec<String> = numbers.chain(self.words.iter().cloned()).collect();
        all.join(" ")
    }

    /// Whether a cell holds such a mark; NAN and INF always are.
    pub fn has(&self, cell: &str) -> bool {
        match cell.parse::<f64>() {
            Ok(number) if number.is_finite() => self.has_number(number),
            // A number too large for the format is not a word for infinity.
            Ok(_) => !cell.bytes().any(|byte| byte.is_ascii_digit()),
            Err(_) => self
                .words
                .iter()
                .any(|word| word.eq_ignore_ascii_case(cell)),
        }
    }

    /// Whether a mark, where it is one, is that of a value out of the instrument's range: INF, or a Campbell logger's -7999 or
    /// -99999.
    pub fn is_out_of_range(mark: &str) -> bool {
        let number = mark.trim().parse::<f64>();
        number.is_ok_and(|number| number.is_infinite() || LOGGER_CODES.contains(&number))
    }

    /// Whether a number is such a mark.
    pub fn has_number(&self, number: f64) -> bool {
        self.numbers.contains(&number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clock(zone: &str, summer_time: SummerTime) -> LocalClock {
        LocalClock {
            zone: Some(TimeZone::get(zone).unwrap()),
            summer_time,
        }
    }

    fn utc(clock: &LocalClock, local: &str) -> String {
        match clock.instant(local) {
            Ok(instant) => instant.to_string(),
            Err(fault) => format!("{fault:?}"),
        }
    }

    #[test]
    fn a_time_without_an_offset_is_that_of_the_zone_in_summer_and_winter() {
        let rome = clock("Europe/Rome", SummerTime::Reject);
        let cases = [
            ("2017-06-06 17:00:00", "2017-06-06T15:00:00Z"),
            ("2017-01-06T17:00:00.25", "2017-01-06T16:00:00.25Z"),
            ("2017-06-06 17:00", "2017-06-06T15:00:00Z"),
            ("2017-06-06T17:00:00Z", "2017-06-06T17:00:00Z"),
            ("2017-06-06T17:00:00-03:00", "2017-06-06T20:00:00Z"),
            ("2017-06-06", "NotATime"),
            ("noon", "NotATime"),
            ("1577836800", "NotATime"),
        ];
        for (local, expected) in cases {
            assert_eq!(utc(&rome, local), expected, "{local}");
        }
        let nowhere = LocalClock::default();
        assert_eq!(utc(&nowhere, "2017-06-06 17:00:00"), "NotATime");
    }

    #[test]
    fn an_hour_that_came_twice_or_never_is_resolved_by_the_policy_alone() {
        // Rome, 2017: 02:00-03:00 was skipped on 26 March and came twice on 29 October.
        let cases = [
            (SummerTime::Reject, "Never", "Twice"),
            (
                SummerTime::Earlier,
                "2017-03-26T00:30:00Z",
                "2017-10-29T00:30:00Z",
            ),
            (
                SummerTime::Later,
                "2017-03-26T01:30:00Z",
                "2017-10-29T01:30:00Z",
            ),
            (
                SummerTime::Standard,
                "2017-03-26T01:30:00Z",
                "2017-10-29T01:30:00Z",
            ),
        ];
        for (policy, gap, fold) in cases {
            let rome = clock("Europe/Rome", policy);
            assert_eq!(utc(&rome, "2017-03-26 02:30:00"), gap, "{policy:?}");
            assert_eq!(utc(&rome, "2017-10-29 02:30:00"), fold, "{policy:?}");
        }
    }

    #[test]
    fn standard_time_is_the_winters_all_year_in_either_hemisphere_and_in_dublin() {
        let cases = [
            ("Europe/Rome", 1),
            ("Europe/Dublin", 0),
            ("Australia/Sydney", 10),
            ("America/Denver", -7),
            ("Asia/Tokyo", 9),
            ("Europe/Moscow", 3),
        ];
        for (zone, hours) in cases {
            let clock = clock(zone, SummerTime::Standard);
            for local in ["2017-01-15 12:00:00", "2017-07-15 12:00:00"] {
                let date: DateTime = local.parse().unwrap();
                let expected = Offset::constant(hours).to_timestamp(date).unwrap();
                assert_eq!(clock.instant(local), Ok(expected), "{zone} {local}");
            }
        }
    }

    #[test]
    fn a_mark_is_matched_by_the_whole_cell_in_any_spelling() {
        let plain = MissingValues::default();
        for cell in ["NAN", "nan", "-NaN", "INF", "-inf", "Infinity"] {
            assert!(plain.has(cell), "{cell}");
        }
        for cell in ["", "1e999", "-7999", "NANA", "12"] {
            assert!(!plain.has(cell), "{cell}");
        }
        let mut logger = Conventions::default().of_a_logger().missing;
        logger.add("bad");
        logger.add("9999.9");
        for cell in ["-7999", "-7999.0", "-7.999e3", "-99999", "BAD", "9999.90"] {
            assert!(logger.has(cell), "{cell}");
        }
        for cell in ["-7999.5", "7999", "99999", "badly"] {
            assert!(!logger.has(cell), "{cell}");
        }
    }
}
