//! One reading as an MCAP message: its topic, and its JSON.
//!
//! Topics are `/benchmarks/ID/displacement`, `/benchmarks/ID/velocity` and `/channels/NAME`; in an
//! ID or a NAME every byte but letters, digits and `-_.~` stands as `%` and two hexadecimal digits.
//!
//! The message is `{"time", "value", "unit", "sigma"?}`. Its `time` is the truth for when it was
//! measured; where it has none, the MCAP `publish_time` is, in nanoseconds since the instant that
//! `time_base` in the MCAP channel's metadata names, or else since 1970.

use super::Item;
use super::names::channel_unit;
use crate::reading::{BenchmarkId, Quantity, Reading, Sample, Timestamp, Unit, whole_figure};
use jiff::SignedDuration;
use serde::Serialize;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// The metadata key for the span of which a velocity is the mean, in seconds.
pub(super) const AVERAGING: &str = "averaging_s";
/// The metadata key for the instant from which MCAP times count.
pub(super) const TIME_BASE: &str = "time_base";
/// The time base of every time from 1970 on.
pub(super) const UNIX: &str = "unix";
/// What precedes the instant in a time base that is not 1970.
pub(super) const SINCE: &str = "seconds since ";

/// What a reading may be.
pub(super) const WITHIN_REACH: &str = "a reading of 1e11 mm (100,000 km), or 1e9 mm/day, at most, which no slope exceeds; \
     if it means that there is no value, add it to missing (--missing)";

/// A message on one of our topics that is no reading.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("topic {topic}, field {field:?}: found {value}, expected {expected}")]
pub struct MessageError {
    /// The topic.
    pub topic: String,
    /// The field of the message, or of the channel's metadata.
    pub field: &'static str,
    /// What stands there.
    pub value: String,
    /// What would be right.
    pub expected: &'static str,
}

/// What a topic is for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Topic {
    Benchmark(BenchmarkId, Quantity),
    Channel(String),
}

impl Topic {
    /// `None` for a topic that is not ours.
    pub(super) fn parse(topic: &str) -> Option<Self> {
        if let Some(name) = topic.strip_prefix("/channels/") {
            return (!name.is_empty()).then(|| Self::Channel(unescape(name)));
        }
        let (id, quantity) = topic.strip_prefix("/benchmarks/")?.rsplit_once('/')?;
        let quantity = [Quantity::Displacement, Quantity::Velocity]
            .into_iter()
            .find(|one| one.name() == quantity)?;
        (!id.is_empty()).then(|| Self::Benchmark(BenchmarkId::new(unescape(id)), quantity))
    }

    pub(super) fn name(&self) -> String {
        match self {
            Self::Benchmark(id, quantity) => {
                format!("/benchmarks/{}/{quantity}", escape(id.as_str()))
            }
            Self::Channel(name) => format!("/channels/{}", escape(name)),
        }
    }
}

/// Whether a topic is one that a replay writes beside its readings: what was said of them.
pub(super) fn is_said(topic: &str) -> bool {
    let of_a_benchmark = topic.starts_with("/benchmarks/")
        && ["/fit", "/forecast", "/level"]
            .iter()
            .any(|end| topic.ends_with(end));
    of_a_benchmark || ["/alerts", "/log", "/site/level"].contains(&topic)
}

/// The name as a topic has it.
pub(in crate::runtime) fn escape(name: &str) -> String {
    let one = |byte: u8| {
        if byte.is_ascii_alphanumeric() || b"-_.~".contains(&byte) {
            char::from(byte).to_string()
        } else {
            format!("%{byte:02X}")
        }
    };
    name.bytes().map(one).collect()
}

/// A name that others wrote without escapes, or with what only looks like one, stands as it is.
fn unescape(name: &str) -> String {
    escaped_bytes(name.as_bytes())
        .and_then(|bytes| String::from_utf8(bytes).ok())
        .unwrap_or_else(|| name.to_owned())
}

fn escaped_bytes(mut rest: &[u8]) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    while let Some((&byte, after)) = rest.split_first() {
        rest = after;
        if byte == b'%' {
            let (digits, after) = rest.split_at_checked(2)?;
            let digits = std::str::from_utf8(digits).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = after;
        } else {
            bytes.push(byte);
        }
    }
    Some(bytes)
}

/// A message as it is written.
#[derive(Debug, Serialize)]
pub(super) struct Payload<'a> {
    pub(super) time: Timestamp,
    pub(super) value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) unit: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) sigma: Option<f64>,
}

/// How the messages that are read are encoded.
pub const JSON: &str = "json";

/// What an MCAP file says of the channel of a message.
#[derive(Debug, Clone, Copy)]
pub struct MessageChannel<'a> {
    /// Its topic.
    pub topic: &'a str,
    /// Its metadata.
    pub metadata: &'a BTreeMap<String, String>,
    /// How its messages are encoded.
    pub encoding: &'a str,
}

/// Decodes one message; `None` if its topic is not one of ours. `publish_time` is its own, in nanoseconds.
///
/// # Errors
/// [`MessageError`] names the field that is wrong.
pub fn decode_message(
    channel: MessageChannel<'_>,
    publish_time: u64,
    payload: &[u8],
) -> Result<Option<Item>, MessageError> {
    let MessageChannel {
        topic,
        metadata,
        encoding,
    } = channel;
    let Some(meant) = Topic::parse(topic) else {
        return Ok(None);
    };
    if encoding != JSON {
        return Err(MessageError {
            topic: topic.to_owned(),
            field: "message_encoding",
            value: format!("{encoding:?}"),
            expected: JSON,
        });
    }
    let message: Value = serde_json::from_slice(payload).unwrap_or(Value::Null);
    let Value::Object(message) = message else {
        return Err(MessageError {
            topic: topic.to_owned(),
            field: "message",
            value: String::from_utf8_lossy(payload).into_owned(),
            expected: "a JSON object {time, value, unit, sigma?}",
        });
    };
    let fields = Fields::new(topic.to_owned(), &message);
    let time = fields.time(metadata, publish_time)?;
    fields.item(meant, time, metadata).map(Some)
}

/// The fields of one message.
pub(super) struct Fields<'a> {
    topic: String,
    message: &'a Map<String, Value>,
}

impl<'a> Fields<'a> {
    /// `topic` is for the errors.
    pub(super) fn new(topic: String, message: &'a Map<String, Value>) -> Self {
        Self { topic, message }
    }

    /// What the message says of `meant`, measured at `time`.
    pub(super) fn item(
        &self,
        meant: Topic,
        time: Timestamp,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Item, MessageError> {
        let value = self.number("value")?;
        let value = value.ok_or_else(|| self.fail("value", "nothing", "a finite number"))?;
        Ok(match meant {
            Topic::Benchmark(benchmark, quantity) => Item::Reading {
                benchmark,
                unit: self.reaching(value, quantity)?,
                averaging: self.averaging(metadata)?,
                reading: Reading {
                    time,
                    value,
                    sigma: self.sigma()?,
                },
            },
            Topic::Channel(channel) => Item::Sample {
                unit: self
                    .text("unit")?
                    .or_else(|| channel_unit(&channel))
                    .map(str::to_owned),
                channel,
                sample: Sample { time, value },
            },
        })
    }

    pub(super) fn fail(
        &self,
        field: &'static str,
        value: impl Into<String>,
        expected: &'static str,
    ) -> MessageError {
        MessageError {
            topic: self.topic.clone(),
            field,
            value: value.into(),
            expected,
        }
    }

    pub(super) fn text(&self, field: &'static str) -> Result<Option<&str>, MessageError> {
        match self.message.get(field) {
            None | Some(Value::Null) => Ok(None),
            Some(Value::String(text)) => Ok(Some(text)),
            Some(other) => Err(self.fail(field, other.to_string(), "a text")),
        }
    }

    fn number(&self, field: &'static str) -> Result<Option<f64>, MessageError> {
        match self.message.get(field) {
            None => Ok(None),
            Some(found) => match found.as_f64().filter(|number| number.is_finite()) {
                Some(number) => Ok(Some(number)),
                None => Err(self.fail(field, found.to_string(), "a finite number")),
            },
        }
    }

    fn time(
        &self,
        metadata: &BTreeMap<String, String>,
        publish_time: u64,
    ) -> Result<Timestamp, MessageError> {
        if let Some(text) = self.text("time")? {
            let expected = "an RFC 3339 time with its offset";
            return text.parse().map_err(|_| self.fail("time", text, expected));
        }
        let base = match metadata.get(TIME_BASE).map(String::as_str) {
            // A publish time of zero is one that nobody set.
            None | Some(UNIX) if publish_time == 0 => {
                return Err(self.fail("time", "nothing, nor a publish_time", "either of them"));
            }
            None | Some(UNIX) => Timestamp::UNIX_EPOCH,
            Some(text) => text
                .strip_prefix(SINCE)
                .and_then(|instant| instant.parse().ok())
                .ok_or_else(|| {
                    self.fail(TIME_BASE, text, "unix, or seconds since an RFC 3339 time")
                })?,
        };
        let nanosecond = base.as_nanosecond() + i128::from(publish_time);
        Timestamp::from_nanosecond(nanosecond).map_err(|_| {
            self.fail(
                "publish_time",
                publish_time.to_string(),
                "a time within the calendar",
            )
        })
    }

    fn unit(&self, quantity: Quantity) -> Result<Unit, MessageError> {
        let expected = match quantity {
            Quantity::Displacement => "a unit of displacement: um, mm, cm, m, in or ft",
            Quantity::Velocity => "a unit of velocity such as mm/h, mm/day or m/yr",
        };
        let text = self.text("unit")?.unwrap_or_default();
        Unit::parse(text)
            .ok()
            .filter(|unit| unit.quantity() == quantity)
            .ok_or_else(|| self.fail("unit", format!("{text:?}"), expected))
    }

    /// The unit, in which `value` is not larger than what any slope moves by.
    fn reaching(&self, value: f64, quantity: Quantity) -> Result<Unit, MessageError> {
        let unit = self.unit(quantity)?;
        if unit.is_within_reach(value) {
            return Ok(unit);
        }
        let found = format!("{} {unit}", whole_figure(value));
        Err(self.fail("value", found, WITHIN_REACH))
    }

    fn sigma(&self) -> Result<Option<f64>, MessageError> {
        match self.message.get("sigma") {
            Some(Value::Null) => Ok(None),
            _ => match self.number("sigma")? {
                Some(sigma) if sigma <= 0.0 => {
                    Err(self.fail("sigma", sigma.to_string(), "a positive standard error"))
                }
                sigma => Ok(sigma),
            },
        }
    }

    fn averaging(
        &self,
        metadata: &BTreeMap<String, String>,
    ) -> Result<Option<SignedDuration>, MessageError> {
        let Some(text) = metadata.get(AVERAGING) else {
            return Ok(None);
        };
        text.parse()
            .ok()
            .and_then(|seconds| SignedDuration::try_from_secs_f64(seconds).ok())
            .filter(SignedDuration::is_positive)
            .map(Some)
            .ok_or_else(|| {
                self.fail(
                    AVERAGING,
                    format!("{text:?}"),
                    "a positive number of seconds",
                )
            })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of<'a>(topic: &'a str, metadata: &'a BTreeMap<String, String>) -> MessageChannel<'a> {
        MessageChannel {
            topic,
            metadata,
            encoding: JSON,
        }
    }

    fn decode(payload: &str) -> Result<Option<Item>, MessageError> {
        let none = BTreeMap::new();
        let channel = of("/benchmarks/a/displacement", &none);
        decode_message(channel, 1_000_000_000, payload.as_bytes())
    }

    #[test]
    fn messages_that_are_not_json_are_refused_by_their_encoding() {
        let (none, payload) = (BTreeMap::new(), br#"{"value": 1, "unit": "mm"}"#);
        let channel = MessageChannel {
            encoding: "cdr",
            ..of("/benchmarks/a/displacement", &none)
        };
        let refused = decode_message(channel, 1, payload).unwrap_err();
        assert_eq!(
            (refused.field, refused.expected),
            ("message_encoding", "json")
        );
    }

    #[test]
    fn a_name_with_odd_characters_has_a_topic_of_its_own() {
        for name in ["31-1930", "a/b", "a%2Fb", "Ü 5", "/", "displacement"] {
            let topic = Topic::Benchmark(BenchmarkId::new(name), Quantity::Velocity);
            let text = topic.name();
            assert_eq!(text.matches('/').count(), 3, "{text}");
            assert_eq!(Topic::parse(&text), Some(topic));
            let topic = Topic::Channel(name.to_owned());
            assert_eq!(Topic::parse(&topic.name()), Some(topic));
        }
    }

    #[test]
    fn a_name_that_nobody_escaped_stands_as_it_is() {
        let cases = [
            ("/benchmarks/100%/velocity", "100%"),
            ("/benchmarks/west/5/velocity", "west/5"),
            ("/benchmarks/a%ff/velocity", "a%ff"),
        ];
        for (topic, id) in cases {
            let expected = Topic::Benchmark(BenchmarkId::new(id), Quantity::Velocity);
            assert_eq!(Topic::parse(topic), Some(expected));
        }
    }

    #[test]
    fn another_topic_is_none_of_ours() {
        for topic in ["/tf", "/benchmarks/a", "/benchmarks/a/tilt", "/channels/"] {
            assert_eq!(
                decode_message(of(topic, &BTreeMap::new()), 1, b"{}"),
                Ok(None)
            );
        }
    }

    #[test]
    fn the_time_in_the_message_stands_over_its_publish_time() {
        let stated = decode(r#"{"time": "1963-08-02T00:00:00Z", "value": 1, "unit": "mm"}"#);
        let silent = decode(r#"{"value": 1, "unit": "mm"}"#);
        let time = |item| match item {
            Ok(Some(Item::Reading { reading, .. })) => reading.time.to_string(),
            other => panic!("{other:?}"),
        };
        assert_eq!(time(stated), "1963-08-02T00:00:00Z");
        assert_eq!(time(silent), "1970-01-01T00:00:01Z");
    }

    #[test]
    fn the_channels_metadata_say_the_time_base_and_the_averaging() {
        let decode = |key: &str, text: &str| {
            let metadata = [(key.to_owned(), text.to_owned())].into();
            let json = br#"{"value": 1, "unit": "mm/h"}"#;
            decode_message(of("/benchmarks/a/velocity", &metadata), 1_500_000_000, json)
        };
        let since = "seconds since 1963-08-02T00:00:00Z";
        let Ok(Some(Item::Reading { reading, .. })) = decode(TIME_BASE, since) else {
            panic!("no reading")
        };
        assert_eq!(reading.time.to_string(), "1963-08-02T00:00:01.5Z");
        let Ok(Some(Item::Reading { averaging, .. })) = decode(AVERAGING, "0.5") else {
            panic!("no reading")
        };
        assert_eq!(averaging, Some(SignedDuration::from_millis(500)));
        for (key, text) in [(TIME_BASE, "noon"), (AVERAGING, "0"), (AVERAGING, "NaN")] {
            assert_eq!(decode(key, text).unwrap_err().field, key, "{text}");
        }
    }

    #[test]
    fn what_is_no_reading_is_named_by_field_and_value() {
        let cases = [
            ("[1]", "message", "[1]"),
            ("{\"value\": NaN}", "message", "NaN"),
            ("{\"unit\": \"mm\"}", "value", "nothing"),
            ("{\"value\": null, \"unit\": \"mm\"}", "value", "null"),
            ("{\"value\": \"1\", \"unit\": \"mm\"}", "value", "\"1\""),
            ("{\"value\": 1}", "unit", "\"\""),
            ("{\"value\": 1, \"unit\": \"mm/d\"}", "unit", "mm/d"),
            (
                "{\"value\": 1, \"unit\": \"mm\", \"sigma\": 0}",
                "sigma",
                "0",
            ),
            (
                "{\"value\": 1, \"unit\": \"mm\", \"time\": \"noon\"}",
                "time",
                "noon",
            ),
        ];
        for (payload, field, value) in cases {
            let error = decode(payload).unwrap_err();
            assert_eq!(error.field, field, "{payload}");
            assert!(error.value.contains(value), "{error}");
            assert!(error.to_string().contains("/benchmarks/a/displacement"));
        }
    }
}
