//! What a covariate measures: decided here alone, from what the config states, or else from its unit and its name.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// What a covariate measures.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, JsonSchema, Serialize, Deserialize,
)]
#[serde(rename_all = "lowercase")]
pub enum CovariateKind {
    /// Rain or snow as it falls: comes and goes, never below zero. It leads the water that it feeds.
    Rain,
    /// A discharge, as of a river or a spring: never below zero, and peaks are its way.
    Flow,
    /// The level of a water: a lake, a river, the water in the slope.
    Level,
    /// A temperature: it may stand in the reading itself.
    Temperature,
    /// The humidity of the air, a share of a hundred.
    Humidity,
    /// A pressure, of the air or of the water in the pores.
    Pressure,
    /// Anything else.
    Other,
}

/// Units of a discharge, as names end in them.
const FLOW_UNITS: [&str; 5] = ["m3_s", "m3_per_s", "l_s", "l_per_s", "cfs"];
/// Degrees Celsius.
const CELSIUS: [&str; 3] = ["c", "degc", "deg_c"];
/// Degrees Fahrenheit.
const FAHRENHEIT: [&str; 3] = ["f", "degf", "deg_f"];
/// Kelvin.
const KELVIN: [&str; 1] = ["k"];
/// Units of a pressure.
const PRESSURE_UNITS: [&str; 7] = ["pa", "hpa", "kpa", "mpa", "bar", "mbar", "psi"];

/// Within a name: a temperature (`temp`, `air_temperature`).
const TEMPERATURE: [&str; 1] = ["temp"];
/// Within a name: rain and snow as they fall (`rainfall`, `precipitation`, `precip`, `snowfall`), and rain as it is called in German,
/// Italian, French, Spanish, Portuguese and the languages of Scandinavia.
const RAIN: [&str; 11] = [
    "rain",
    "precip",
    "snowfall",
    "regen",
    "niederschlag",
    "pioggia",
    "pluie",
    "pluvio",
    "lluvia",
    "chuva",
    "nedbør",
];
/// Words with `rain` in them that have nothing to do with it.
const NO_RAIN: [&str; 5] = ["drain", "strain", "train", "terrain", "grain"];
/// Within a name: a discharge (`inflow`, `river_flow`, `discharge`, `runoff`).
const FLOW: [&str; 3] = ["flow", "discharge", "runoff"];
/// Within a name: the humidity of the air (`humidity`, `humid`).
const HUMIDITY: [&str; 1] = ["humid"];
/// Within a name: the level of a water (`lake_level`, `creek_stage`, `piezometer`, `groundwater`, `water_table`).
const LEVEL: [&str; 5] = ["level", "stage", "piezo", "groundwater", "water_table"];
/// Within a name: a pressure (`air_pressure`, `barometer`).
const PRESSURE: [&str; 2] = ["pressure", "baromet"];

impl CovariateKind {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Rain,
        Self::Flow,
        Self::Level,
        Self::Temperature,
        Self::Humidity,
        Self::Pressure,
        Self::Other,
    ];

    /// The word in configs and in output.
    pub fn name(self) -> &'static str {
        match self {
            Self::Rain => "rain",
            Self::Flow => "flow",
            Self::Level => "level",
            Self::Temperature => "temperature",
            Self::Humidity => "humidity",
            Self::Pressure => "pressure",
            Self::Other => "other",
        }
    }

    /// By the word in configs.
    ///
    /// # Errors
    /// What to write instead.
    pub fn parse(word: &str) -> Result<Self, String> {
        let known = Self::ALL.into_iter().find(|kind| kind.name() == word);
        known.ok_or_else(|| format!("write one of {}", Self::ALL.map(Self::name).join(", ")))
    }

    /// As it is stated, or else by the column's unit and name.
    pub fn stated_or_of(stated: Option<Self>, name: &str, unit: Option<&str>) -> Self {
        stated.unwrap_or_else(|| Self::of(name, unit))
    }

    /// By a column's unit and name. A unit of temperature or of discharge says it whatever the name is; then the words within the
    /// name do, in the order of temperature, rain, flow, humidity, level and pressure; then a unit of pressure.
    pub fn of(name: &str, unit: Option<&str>) -> Self {
        let name = name.to_ascii_lowercase();
        let unit = unit.unwrap_or("").to_ascii_lowercase();
        let is_in = |units: &[&str]| units.contains(&unit.as_str());
        let says = |words: &[&str]| words.iter().any(|word| name.contains(word));
        if is_in(&CELSIUS) || is_in(&FAHRENHEIT) || is_in(&KELVIN) {
            Self::Temperature
        } else if is_in(&FLOW_UNITS) {
            Self::Flow
        } else if says(&TEMPERATURE) {
            Self::Temperature
        } else if says_rain(&name) {
            Self::Rain
        } else if says(&FLOW) {
            Self::Flow
        } else if says(&HUMIDITY) {
            Self::Humidity
        } else if says(&LEVEL) {
            Self::Level
        } else if says(&PRESSURE) || is_in(&PRESSURE_UNITS) {
            Self::Pressure
        } else {
            Self::Other
        }
    }

    /// What values of it may be in this unit, both ends included. Humidity has the slack that sensors need.
    pub fn bounds(self, unit: Option<&str>) -> (f64, f64) {
        let unit = unit.unwrap_or("").to_ascii_lowercase();
        let is_in = |units: &[&str]| units.contains(&unit.as_str());
        match self {
            Self::Rain | Self::Flow => (0.0, f64::INFINITY),
            Self::Humidity => (-2.0, 105.0),
            Self::Temperature if is_in(&CELSIUS) => (-90.0, 100.0),
            Self::Temperature if is_in(&FAHRENHEIT) => (-130.0, 212.0),
            Self::Temperature | Self::Level | Self::Pressure | Self::Other => {
                (f64::NEG_INFINITY, f64::INFINITY)
            }
        }
    }
}

/// Whether one part of a name, in lower case, is a word of rain.
fn says_rain(name: &str) -> bool {
    let mut parts = name.split(|c: char| !c.is_alphanumeric());
    parts.any(|part| {
        let is_another = NO_RAIN.iter().any(|word| part.contains(word));
        let mut words = RAIN.iter();
        words.any(|word| part.contains(word) && !(*word == "rain" && is_another))
    })
}

impl fmt::Display for CovariateKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_or_a_unit_says_what_a_covariate_is() {
        let cases = [
            ("rain_mm", Some("mm"), CovariateKind::Rain),
            ("DailyRain", None, CovariateKind::Rain),
            ("Regen_mm", Some("mm"), CovariateKind::Rain),
            ("Niederschlag (mm)", Some("mm"), CovariateKind::Rain),
            ("Pioggia [mm]", Some("mm"), CovariateKind::Rain),
            ("precipitation_mm", Some("mm"), CovariateKind::Rain),
            ("snowfall_cm", Some("cm"), CovariateKind::Rain),
            ("terrain_rain_mm", Some("mm"), CovariateKind::Rain),
            ("drain_flow", None, CovariateKind::Flow),
            ("strain_gauge_mv", Some("mv"), CovariateKind::Other),
            ("river_cfs", Some("cfs"), CovariateKind::Flow),
            ("spring_l_s", Some("l_s"), CovariateKind::Flow),
            ("inflow", None, CovariateKind::Flow),
            ("runoff_mm", Some("mm"), CovariateKind::Flow),
            ("rock_c", Some("c"), CovariateKind::Temperature),
            ("AirTC_C", Some("C"), CovariateKind::Temperature),
            (
                "air_temperature_max_f",
                Some("f"),
                CovariateKind::Temperature,
            ),
            ("temp2m", None, CovariateKind::Temperature),
            ("inflow_c", Some("c"), CovariateKind::Temperature),
            ("humidity_percent", Some("percent"), CovariateKind::Humidity),
            ("lake_level_m", Some("m"), CovariateKind::Level),
            ("creek_stage_m", Some("m"), CovariateKind::Level),
            ("piezometer_3_kpa", Some("kpa"), CovariateKind::Level),
            ("air_hpa", Some("hpa"), CovariateKind::Pressure),
            ("lake_m", Some("m"), CovariateKind::Other),
            ("Pegel", None, CovariateKind::Other),
        ];
        for (name, unit, kind) in cases {
            assert_eq!(CovariateKind::of(name, unit), kind, "{name}");
        }
    }

    #[test]
    fn every_kind_is_written_and_read_by_the_same_word() {
        for kind in CovariateKind::ALL {
            assert_eq!(CovariateKind::parse(kind.name()), Ok(kind));
            assert_eq!(serde_json::to_string(&kind).unwrap(), format!("\"{kind}\""));
        }
        let error = CovariateKind::parse("snow").unwrap_err();
        assert!(error.contains("rain, flow, level"), "{error}");
    }
}
