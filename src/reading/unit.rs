//! Units of displacement and velocity: their names in files, and their size in mm and days.

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::fmt;

/// No displacement in mm is larger, a coordinate of a map projection neither: a hundred thousand kilometres.
const FARTHEST_MM: f64 = 1e11;
/// No velocity in mm/day is larger: a thousand kilometres a day.
const FASTEST: f64 = 1e9;

/// What a reading measures.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum Quantity {
    /// Cumulative downslope displacement.
    Displacement,
    /// Downslope velocity.
    Velocity,
}

impl Quantity {
    /// The word used in file columns, topics and output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Displacement => "displacement",
            Self::Velocity => "velocity",
        }
    }

    /// No reading of it is larger, mm or mm/day.
    pub fn farthest(self) -> f64 {
        match self {
            Self::Displacement => FARTHEST_MM,
            Self::Velocity => FASTEST,
        }
    }
}

impl fmt::Display for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// A unit of length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum LengthUnit {
    /// Micrometre.
    Micrometre,
    /// Millimetre.
    Millimetre,
    /// Centimetre.
    Centimetre,
    /// Metre.
    Metre,
    /// Inch, 25.4 mm.
    Inch,
    /// International foot, 304.8 mm.
    Foot,
}

impl LengthUnit {
    const ALL: [Self; 6] = [
        Self::Micrometre,
        Self::Millimetre,
        Self::Centimetre,
        Self::Metre,
        Self::Inch,
        Self::Foot,
    ];

    /// The symbol in output: `um mm cm m in ft`.
    pub fn symbol(self) -> &'static str {
        self.spellings()[0]
    }

    /// The symbol, and how files write it besides.
    fn spellings(self) -> &'static [&'static str] {
        match self {
            Self::Micrometre => &["um", "\u{b5}m", "\u{3bc}m"],
            Self::Millimetre => &["mm"],
            Self::Centimetre => &["cm"],
            Self::Metre => &["m"],
            Self::Inch => &["in", "inch", "inches"],
            Self::Foot => &["ft", "foot", "feet"],
        }
    }

    /// Millimetres in one of this unit.
    pub fn millimetres(self) -> f64 {
        match self {
            Self::Micrometre => 1e-3,
            Self::Millimetre => 1.0,
            Self::Centimetre => 10.0,
            Self::Metre => 1000.0,
            Self::Inch => 25.4,
            Self::Foot => 304.8,
        }
    }
}

/// The time in a velocity's denominator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum TimeUnit {
    /// Minute.
    Minute,
    /// Hour.
    Hour,
    /// Day of 24 hours.
    Day,
    /// Julian year of 365.25 days.
    Year,
}

impl TimeUnit {
    const ALL: [Self; 4] = [Self::Minute, Self::Hour, Self::Day, Self::Year];

    /// The word in output: `min`, `h`, `day`, `yr`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Minute => "min",
            Self::Hour => "h",
            Self::Day => "day",
            Self::Year => "yr",
        }
    }

    fn spellings(self) -> &'static [&'static str] {
        match self {
            Self::Minute => &["min", "minute"],
            Self::Hour => &["h", "hour", "hr"],
            Self::Day => &["day", "d"],
            Self::Year => &["yr", "year", "a"],
        }
    }

    /// Days in one of this unit.
    pub fn days(self) -> f64 {
        match self {
            Self::Minute => 1.0 / 1440.0,
            Self::Hour => 1.0 / 24.0,
            Self::Day => 1.0,
            Self::Year => super::DAYS_PER_YEAR,
        }
    }
}

/// The unit of a benchmark's readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Unit {
    /// A displacement.
    Length(LengthUnit),
    /// A velocity.
    Rate(LengthUnit, TimeUnit),
}

/// A unit that is not one of those known.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "unknown unit {given:?}: expected um, mm, cm, m, in or ft, or one of these per min, h, day or yr (mm_per_h, m/day)"
)]
pub struct UnitError {
    /// The text that was given.
    pub given: String,
}

impl Unit {
    /// Millimetres.
    pub const MM: Self = Self::Length(LengthUnit::Millimetre);
    /// Millimetres per day.
    pub const MM_PER_DAY: Self = Self::Rate(LengthUnit::Millimetre, TimeUnit::Day);

    /// The quantity that this unit measures.
    pub fn quantity(self) -> Quantity {
        match self {
            Self::Length(_) => Quantity::Displacement,
            Self::Rate(..) => Quantity::Velocity,
        }
    }

    /// How many mm (or mm/day) one of this unit is.
    pub fn factor(self) -> f64 {
        match self {
            Self::Length(length) => length.millimetres(),
            Self::Rate(length, time) => length.millimetres() / time.days(),
        }
    }

    /// Whether a reading of `value` in this unit may be one of a slope: it is no larger than [`Quantity::farthest`].
    pub fn is_within_reach(self, value: f64) -> bool {
        (value * self.factor()).abs() <= self.quantity().farthest()
    }

    /// The suffix of a file column: `mm`, `mm_per_day`.
    pub fn column_suffix(self) -> String {
        match self {
            Self::Length(length) => length.symbol().to_owned(),
            Self::Rate(length, time) => format!("{}_per_{}", length.symbol(), time.symbol()),
        }
    }

    /// The unit in brackets at the end of a column's name: m of `P1 East [m]`.
    pub fn in_brackets_of(name: &str) -> Option<Self> {
        Self::parse(bracketed(name)?).ok()
    }

    /// The longest unit at the end of a component's name, or that in brackets there: mm of `east_mm`.
    pub fn at_end_of(name: &str) -> Option<Self> {
        let mut places = name.match_indices('_');
        let at_end = places.find_map(|(at, _)| Self::parse(&name[at + 1..]).ok());
        at_end.or_else(|| Self::in_brackets_of(name))
    }

    /// Parses `mm`, `mm_per_day`, `mm/d`, `m per day`, `cm/yr`.
    ///
    /// # Errors
    /// [`UnitError`] names the text when it is no known unit.
    pub fn parse(text: &str) -> Result<Self, UnitError> {
        let fail = || UnitError {
            given: text.to_owned(),
        };
        let plain = text.trim().to_ascii_lowercase();
        let (length, time) = split_rate(&plain);
        let length = LengthUnit::ALL
            .into_iter()
            .find(|unit| unit.spellings().contains(&length))
            .ok_or_else(fail)?;
        match time {
            None => Ok(Self::Length(length)),
            Some(time) => TimeUnit::ALL
                .into_iter()
                .find(|unit| unit.spellings().contains(&time))
                .map(|time| Self::Rate(length, time))
                .ok_or_else(fail),
        }
    }
}

/// What stands in brackets, of a text that is nothing else: `mm/d` of ` [mm/d]` or `(mm/d)`.
pub fn in_brackets(rest: &str) -> Option<&str> {
    let rest = rest.trim();
    let inner = |open, close| rest.strip_prefix(open)?.strip_suffix(close);
    inner('[', ']').or_else(|| inner('(', ')')).map(str::trim)
}

/// What stands in brackets at the end of a name: `mm/h` of `E [mm/h]`.
pub fn bracketed(name: &str) -> Option<&str> {
    in_brackets(&name[name.rfind(['[', '('])?..])
}

fn split_rate(text: &str) -> (&str, Option<&str>) {
    for separator in ["_per_", " per ", "/"] {
        if let Some((length, time)) = text.split_once(separator) {
            return (length.trim(), Some(time.trim()));
        }
    }
    (text, None)
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length(length) => f.write_str(length.symbol()),
            Self::Rate(length, time) => write!(f, "{}/{}", length.symbol(), time.symbol()),
        }
    }
}

impl Serialize for Unit {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl JsonSchema for Unit {
    fn schema_name() -> Cow<'static, str> {
        "Unit".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "type": "string",
            "description": "The unit of a benchmark's readings: a length, or a length per time.",
            "pattern": "^(um|mm|cm|m|in|ft)(/(min|h|day|yr))?$",
        })
    }
}

impl<'de> Deserialize<'de> for Unit {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        Self::parse(&text).map_err(serde::de::Error::custom)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_is_read_in_every_spelling_that_files_use() {
        for text in ["mm_per_day", "mm/d", "mm per day", " MM/Day "] {
            assert_eq!(Unit::parse(text).unwrap(), Unit::MM_PER_DAY, "{text}");
        }
        for (text, millimetres) in [
            ("\u{b5}m", 1e-3),
            ("\u{3bc}m", 1e-3),
            ("um", 1e-3),
            ("Inches", 25.4),
            ("feet", 304.8),
            ("in/day", 25.4),
            ("mm/min", 1440.0),
        ] {
            let factor = Unit::parse(text).unwrap().factor();
            assert!((factor / millimetres - 1.0).abs() < 1e-12, "{text}");
        }
        assert!((Unit::parse("ft").unwrap().factor() - 304.8).abs() < 1e-12);
        assert!((Unit::parse("m/yr").unwrap().factor() - 1000.0 / 365.25).abs() < 1e-12);
    }

    #[test]
    fn an_unknown_unit_is_named_in_the_error() {
        for text in ["furlong", "mm/fortnight", "", "mm/"] {
            let error = Unit::parse(text).unwrap_err();
            assert!(error.to_string().contains(&format!("{text:?}")), "{error}");
        }
    }
}
