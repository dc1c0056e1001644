//! The JSON Schemas inside a recording, as plain as readers of MCAP need them: one type a key, no references.

use serde_json::{Map, Value, json};

/// Foxglove's levels of a message.
pub(super) const INFO: u8 = 2;
pub(super) const WARNING: u8 = 3;
pub(super) const ERROR: u8 = 4;
pub(super) const FATAL: u8 = 5;

pub(super) type Schema = (&'static str, String);
/// A key, its type and what it means; it is there in each message where the type has no `?`.
type Field = (&'static str, &'static str, &'static str);

const FIT: [Field; 11] = [
    ("time", "date-time", "Data time of the newest reading used"),
    ("t_max", "date-time", "The newest reading used"),
    ("regime", "string", "The regime, or undetermined"),
    ("probability_unstable", "number", "Probability of kappa > 0"),
    ("probability_accelerating", "number", "Probability of r > 0"),
    (
        "probability_of_acceleration",
        "number",
        "Probability that the slope accelerates, against steady motion",
    ),
    ("velocity_mm_per_day", "number?", "The velocity, mm/day"),
    (
        "transition_time",
        "date-time?",
        "Inflection of the fitted velocity",
    ),
    (
        "inverse_velocity_failure_time",
        "date-time?",
        "Where the line through 1/v meets zero",
    ),
    (
        "inverse_velocity_failure_days",
        "number?",
        "The same, days from time",
    ),
    ("inverse_velocity_r_squared", "number?", "Of that line"),
];

/// Of the times of collapse, and with other keys of those of the critical velocity.
const QUANTILES: [Field; 8] = [
    (
        "low",
        "date-time?",
        "5 % quantile, where it is reached within the horizon",
    ),
    (
        "median",
        "date-time?",
        "Median, where it is reached within the horizon",
    ),
    (
        "high",
        "date-time?",
        "95 % quantile, where it is reached within the horizon",
    ),
    ("low_days", "number?", "5 % quantile, days from time"),
    ("median_days", "number?", "Median, days from time"),
    ("high_days", "number?", "95 % quantile, days from time"),
    ("probability", "number", "Chance within the horizon"),
    ("horizon_days", "number", "How far the forecast looks, days"),
];

const CHANCES: [Field; 5] = [
    ("time", "date-time", "When the forecast was made, data time"),
    (
        "chance_within_evacuation_time",
        "number",
        "Chance of collapse within the evacuation time, as levels use it",
    ),
    (
        "chance_within_outlook",
        "number",
        "Chance of collapse within the outlook, as levels use it",
    ),
    (
        "chance_within_2_days",
        "number?",
        "Chance that a collapse comes within 2 days",
    ),
    (
        "chance_within_30_days",
        "number?",
        "Chance that a collapse comes within 30 days",
    ),
];

const LEVEL: [Field; 4] = [
    ("time", "date-time", "Since when, data time"),
    ("level", "string", "green, yellow, orange or red"),
    ("number", "integer", "0 for green to 3 for red"),
    (
        "is_unknown",
        "boolean",
        "Whether nothing can be said: beside the level, never instead of it",
    ),
];

const ALERT: [Field; 7] = [
    ("time", "date-time", "Data time of the change"),
    ("benchmark", "string?", "Where; missing for the whole site"),
    ("level", "string", "The level"),
    ("state", "string", "firing or resolved"),
    ("key", "string", "Stable over retries, restarts and replays"),
    ("rule", "string", "The rule that called it"),
    ("text", "string", "One line for a person"),
];

pub(super) fn fit() -> Schema {
    let fields = FIT.map(|(key, kind, says)| (key.to_owned(), kind, says));
    object("slipwatch.Fit", "The law fitted again", fields)
}

pub(super) fn forecast() -> Schema {
    let own = CHANCES
        .iter()
        .map(|(key, kind, says)| ((*key).to_owned(), *kind, *says));
    let quantiles = ["", "critical_velocity_"].into_iter().flat_map(|before| {
        QUANTILES
            .iter()
            .map(move |(key, kind, says)| (format!("{before}{key}"), *kind, *says))
    });
    let says = "When the slope collapses and, with critical_velocity, when it passes that; quantiles are unconditional";
    object("slipwatch.Forecast", says, own.chain(quantiles))
}

pub(super) fn level() -> Schema {
    let fields = LEVEL.map(|(key, kind, says)| (key.to_owned(), kind, says));
    object("slipwatch.Level", "The level in force from then on", fields)
}

pub(super) fn alert() -> Schema {
    let fields = ALERT.map(|(key, kind, says)| (key.to_owned(), kind, says));
    object("slipwatch.Alert", "A level was entered or left", fields)
}

fn object(
    name: &'static str,
    says: &str,
    fields: impl IntoIterator<Item = (String, &'static str, &'static str)>,
) -> Schema {
    let (mut properties, mut required) = (Map::new(), Vec::new());
    for (key, kind, says) in fields {
        let bare = kind.strip_suffix('?');
        if bare.is_none() {
            required.push(key.clone());
        }
        let property = match bare.unwrap_or(kind) {
            "date-time" => json!({ "type": "string", "format": "date-time", "description": says }),
            other => json!({ "type": other, "description": says }),
        };
        properties.insert(key, property);
    }
    let schema = json!({
        "title": name,
        "description": says,
        "type": "object",
        "properties": properties,
        "required": required,
    });
    (name, schema.to_string())
}

/// Foxglove's own, by its published definition (foxglove-sdk, schemas/jsonschema/Log.json).
pub(super) fn log() -> Schema {
    let level = |(number, title): (usize, &&str)| json!({ "title": title, "const": number });
    let levels = ["UNKNOWN", "DEBUG", "INFO", "WARNING", "ERROR", "FATAL"];
    let levels: Vec<Value> = levels.iter().enumerate().map(level).collect();
    let schema = json!({
        "title": "foxglove.Log",
        "description": "A log message",
        "type": "object",
        "properties": {
            "timestamp": {
                "type": "object",
                "title": "time",
                "properties": {
                    "sec": { "type": "integer" },
                    "nsec": { "type": "integer", "minimum": 0, "maximum": 999_999_999 },
                },
                "description": "Timestamp of log message",
            },
            "level": { "title": "foxglove.LogLevel", "description": "Log level", "oneOf": levels },
            "message": { "type": "string", "description": "Log message" },
            "name": { "type": "string", "description": "The benchmark, or site" },
            "file": { "type": "string", "description": "The kind of event" },
            "line": { "type": "integer", "minimum": 0, "description": "0" },
        },
    });
    ("foxglove.Log", schema.to_string())
}
