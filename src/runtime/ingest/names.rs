//! What the name of a column says: whose readings it holds, or the unit of a covariate.

use super::column_map::{ColumnMap, Measure};
use crate::reading::{Unit, in_brackets};

/// What a column's name says.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Name<'a> {
    Time,
    Days,
    /// The ID, where the name has one.
    Measure(Option<&'a str>, Measure),
    Channel(Option<&'a str>),
    /// `displacement` and the like, with no known unit.
    WithoutUnit,
}

/// Words by which a column is one of readings.
const KEYWORDS: [&str; 3] = ["displacement", "velocity", "sigma"];

/// Reads a column's name.
pub(super) fn name_of(column: &str) -> Name<'_> {
    let plain = column.to_ascii_lowercase();
    match plain.as_str() {
        "time" => return Name::Time,
        "t_days" => return Name::Days,
        _ => {}
    }
    for keyword in KEYWORDS {
        for (at, _) in plain.rmatch_indices(keyword) {
            if let Some(measure) = measure_at(&plain, at, keyword) {
                match column[..at].strip_suffix('_') {
                    None if at == 0 => return Name::Measure(None, measure),
                    Some(id) if !id.is_empty() => return Name::Measure(Some(id), measure),
                    _ => {}
                }
            }
        }
    }
    if lacks_a_unit(&plain) {
        return Name::WithoutUnit;
    }
    Name::Channel(channel_unit(column))
}

/// The unit in the name of a column of readings.
pub fn unit_in_name(column: &str) -> Option<Unit> {
    if let Name::Measure(_, Measure::Reading(unit)) = name_of(column) {
        Some(unit)
    } else {
        None
    }
}

/// The name of a column of readings with its unit, `5_displacement_mm` of `5_displacement` in mm; `None` where it is no reading by that.
pub(super) fn with_unit_of_motion(name: &str, unit: Unit) -> Option<String> {
    let full = format!("{name}_{}", unit.column_suffix());
    matches!(name_of(&full), Name::Measure(..)).then_some(full)
}

/// The column `name` where it differs from that of `map` only by its unit, which is then that of the readings: where the name in `map` states a
/// unit, and no other one is stated of it.
pub(super) fn in_unit_of(name: &str, map: &ColumnMap) -> Option<ColumnMap> {
    let (own, unit) = match (name_of(&map.column), name_of(name)) {
        (
            Name::Measure(own_id, Measure::Reading(own)),
            Name::Measure(id, Measure::Reading(unit)),
        ) if own_id == id => (own, unit),
        // Both names are the same but for what stands in brackets at their ends: `Ext1 [mm]` and `Ext1 [cm]`.
        _ => {
            let (before, own) = before_brackets(&map.column)?;
            let (same, unit) = before_brackets(name)?;
            (before == same).then_some((own, unit))?
        }
    };
    (own.quantity() == unit.quantity() && map.measure == Measure::Reading(own)).then(|| ColumnMap {
        column: name.to_owned(),
        benchmark: map.benchmark.clone(),
        measure: Measure::Reading(unit),
    })
}

/// What stands before the unit in brackets at the end of a name, and that unit.
fn before_brackets(name: &str) -> Option<(&str, Unit)> {
    let at = name.rfind(['[', '('])?;
    Some((name[..at].trim_end(), Unit::in_brackets_of(name)?))
}

fn measure_at(plain: &str, at: usize, keyword: &str) -> Option<Measure> {
    let rest = &plain[at + keyword.len()..];
    let unit = rest.strip_prefix('_').or_else(|| in_brackets(rest))?;
    let unit = Unit::parse(unit).ok()?;
    match keyword {
        "sigma" => Some(Measure::Sigma(unit)),
        _ if unit.quantity().name() == keyword => Some(Measure::Reading(unit)),
        _ => None,
    }
}

/// Words of units of length and of velocity.
const WORDS_OF_UNITS: [&str; 24] = [
    "um", "mm", "cm", "dm", "m", "km", "in", "inch", "inches", "ft", "foot", "feet", "per", "s",
    "sec", "min", "h", "hr", "hour", "d", "day", "month", "yr", "year",
];

/// Whether a text is a unit of length or of velocity, whether it can be read or not: `m_per_s`, `km`.
pub(super) fn is_unit_of_motion(text: &str) -> bool {
    let mut words = text.split(['_', '/']);
    Unit::parse(text).is_ok()
        || !text.is_empty() && words.all(|word| WORDS_OF_UNITS.contains(&word))
}

/// `velocity_kmh` is a reading in a unit that is not known; `displacement_sensor_voltage_v` is a
/// covariate.
fn lacks_a_unit(plain: &str) -> bool {
    KEYWORDS
        .iter()
        .filter_map(|keyword| plain.strip_prefix(keyword))
        .any(|rest| match rest.strip_prefix('_') {
            None => rest.is_empty(),
            Some(unit) => !unit.replacen("_per_", "/", 1).contains('_'),
        })
}

/// Units at the end of a covariate's name, as loggers and surveys write them.
const CHANNEL_UNITS: [&str; 41] = [
    "mm", "cm", "m", "in", "ft", "km", "c", "f", "k", "degc", "degf", "deg_c", "deg_f", "deg",
    "m3_s", "m3_per_s", "l_s", "l_per_s", "cfs", "m_s", "m_per_s", "km_h", "km_per_h", "pa", "hpa",
    "kpa", "mpa", "bar", "mbar", "psi", "kn", "percent", "pct", "v", "mv", "ma", "hz", "s", "w_m2",
    "g", "ppm",
];

/// The longest known unit at a name's end: `mm_per_day` of `rain_mm_per_day`.
pub(super) fn channel_unit(name: &str) -> Option<&str> {
    let is_known = |unit: &&str| {
        let plain = unit.to_ascii_lowercase();
        CHANNEL_UNITS.contains(&plain.as_str()) || Unit::parse(&plain).is_ok()
    };
    let bracketed = name
        .find(['[', '('])
        .and_then(|at| in_brackets(&name[at..]));
    let suffixes = name.match_indices('_').map(|(at, _)| &name[at + 1..]);
    bracketed
        .filter(is_known)
        .or_else(|| suffixes.into_iter().find(is_known))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_that_is_named_by_another_unit_is_the_same_in_that_unit() {
        let map: ColumnMap = "d_displacement_mm=5:displacement:mm".parse().unwrap();
        let in_metres = in_unit_of("d_displacement_m", &map).unwrap();
        assert_eq!(in_metres.benchmark, map.benchmark);
        let metres = Unit::parse("m").unwrap();
        assert_eq!(in_metres.measure, Measure::Reading(metres));
        for other in ["e_displacement_m", "d_velocity_m_per_day", "d"] {
            assert_eq!(in_unit_of(other, &map), None, "{other}");
        }
        let bracketed: ColumnMap = "Ext1 [mm]=5:displacement:mm".parse().unwrap();
        let in_centimetres = in_unit_of("Ext1 (cm)", &bracketed).unwrap();
        let centimetres = Unit::parse("cm").unwrap();
        assert_eq!(in_centimetres.measure, Measure::Reading(centimetres));
        for other in ["Ext2 [cm]", "Ext1 [mm/h]", "Ext1 [furlong]", "Ext1"] {
            assert_eq!(in_unit_of(other, &bracketed), None, "{other}");
        }
        let restated: ColumnMap = "d_displacement_mm=5:displacement:cm".parse().unwrap();
        assert_eq!(in_unit_of("d_displacement_m", &restated), None);
    }

    #[test]
    fn a_name_says_benchmark_quantity_and_unit() {
        let per_hour = Unit::parse("mm/h").unwrap();
        let cases = [
            ("displacement_mm", None, Measure::Reading(Unit::MM)),
            ("velocity_mm_per_h", None, Measure::Reading(per_hour)),
            (
                "31-1930_displacement_mm",
                Some("31-1930"),
                Measure::Reading(Unit::MM),
            ),
            (
                "a_b_velocity_mm_per_d",
                Some("a_b"),
                Measure::Reading(Unit::MM_PER_DAY),
            ),
            ("blkm_sigma_mm", Some("blkm"), Measure::Sigma(Unit::MM)),
            ("A_Displacement_MM", Some("A"), Measure::Reading(Unit::MM)),
        ];
        for (name, id, measure) in cases {
            assert_eq!(name_of(name), Name::Measure(id, measure), "{name}");
        }
    }

    #[test]
    fn every_other_name_is_a_channel_with_its_longest_unit() {
        let cases = [
            ("lake_level_m", Some("m")),
            ("rain_mm_per_day", Some("mm_per_day")),
            ("river_flow_cfs", Some("cfs")),
            ("inflow_m3_s", Some("m3_s")),
            ("air_temperature_max_f", Some("f")),
            ("wind_velocity_m_per_s", Some("m_per_s")),
            ("displacement_sensor_voltage_v", Some("v")),
            ("humidity_percent", Some("percent")),
            ("quality", None),
            ("m", None),
        ];
        for (name, unit) in cases {
            assert_eq!(name_of(name), Name::Channel(unit), "{name}");
        }
    }

    #[test]
    fn a_reading_in_no_known_unit_is_refused_rather_than_taken_for_a_covariate() {
        for name in ["displacement", "velocity_kmh", "velocity_m_per_s", "sigma"] {
            assert_eq!(name_of(name), Name::WithoutUnit, "{name}");
        }
    }
}
