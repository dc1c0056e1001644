//! NDJSON, one object a line: a message like those of MCAP, or a row like those of CSV.
//!
//! `{"benchmark": "5", "time": …, "value": 1.5, "unit": "mm", "sigma"?, "quantity"?, "averaging_s"?}` is one
//! reading, `{"channel": "lake_level_m", …}` one value of a covariate, and any other object a row whose
//! keys are columns of a CSV file. In a message a value of null is a missing reading; in a row it is
//! an empty cell.
//!
//! A writer that was killed leaves a torn object, and the next one begins behind it on the same line:
//! that one is kept.

use super::columns::{Layout, Meaning};
use super::message::{AVERAGING, Fields, MessageError, Topic};
use super::ndjson_write::write_ndjson;
use super::remark::Remark;
use super::table::TableRows;
use super::taken::LineResult;
use super::text_format::{LineReader, TextFormat};
use super::{IngestError, Item, ReadOptions};
use crate::reading::{BenchmarkId, MissingValues, Quantity, Unit};
use ::csv::StringRecord;
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Kinds of rows, by their keys, that are remembered.
const MOST_LAYOUTS: usize = 64;
/// Beginnings of an object that are tried in one line.
const MOST_TRIES: usize = 1000;
/// What some writers put where JSON has no number.
const NOT_JSON: [&str; 3] = ["-Infinity", "Infinity", "NaN"];

type Object = Map<String, Value>;

/// What a message is about.
#[derive(Clone, Copy)]
enum MessageKind {
    Benchmark,
    Channel,
}

impl MessageKind {
    /// How the topic of such a message begins in MCAP.
    fn folder(self) -> &'static str {
        match self {
            Self::Benchmark => "/benchmarks/",
            Self::Channel => "/channels/",
        }
    }
}

/// A JSON object a line.
pub static NDJSON: TextFormat = TextFormat {
    name: "ndjson",
    extensions: &["ndjson", "jsonl"],
    begins: |text| text.starts_with(b"{"),
    reader: |file, options| Box::new(NdjsonRows::new(file, options)),
    write: |recording, out| write_ndjson(recording, out),
    states_averaging: true,
};

impl LineReader for NdjsonRows {
    fn take(&mut self, line: u64, text: &str) -> LineResult {
        self.row(line, text)
    }

    fn take_remarks(&mut self) -> Vec<Remark> {
        let tables = self.tables.values_mut();
        tables.flat_map(TableRows::take_remarks).collect()
    }

    fn take_fault(&mut self) -> Option<IngestError> {
        let tables = self.tables.values_mut();
        let faults: Vec<IngestError> = tables.filter_map(TableRows::take_fault).collect();
        faults.into_iter().next()
    }

    fn meanings(&self) -> Vec<(String, Meaning)> {
        self.tables.values().flat_map(TableRows::meanings).collect()
    }
}

/// Reads one file line by line.
#[derive(Debug)]
struct NdjsonRows {
    file: PathBuf,
    options: ReadOptions,
    tables: BTreeMap<Vec<String>, TableRows>,
}

impl NdjsonRows {
    fn new(file: &Path, options: &ReadOptions) -> Self {
        Self {
            file: file.into(),
            options: options.clone(),
            tables: BTreeMap::new(),
        }
    }

    /// All that is intact in one line, and what is wrong with the rest.
    fn row(&mut self, line: u64, text: &str) -> LineResult {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut found = objects(text);
        if found.torn.is_some()
            && let Some(repaired) = with_quoted_nan(text)
        {
            let again = objects(&repaired);
            if again.torn.is_none() {
                found = again;
            }
        }
        let mut taken = LineResult::default();
        for object in &found.whole {
            match self.object(line, object) {
                Ok(items) => taken.items.extend(items),
                Err(error) => taken.fault = taken.fault.or(Some(error)),
            }
        }
        taken.fault = taken.fault.or(found.torn.map(|found| IngestError::Torn {
            file: self.file.clone(),
            line,
            found,
        }));
        taken
    }

    fn object(&mut self, line: u64, object: &Object) -> Result<Vec<Item>, IngestError> {
        let (name, kind) = match (object.get("benchmark"), object.get("channel")) {
            (Some(name), _) => (name, MessageKind::Benchmark),
            (None, Some(name)) => (name, MessageKind::Channel),
            (None, None) => return self.cells(line, object),
        };
        self.message(object, name, kind)
            .map(|item| vec![item])
            .map_err(|problem| IngestError::Record {
                file: self.file.clone(),
                line,
                problem: Box::new(problem),
            })
    }

    fn message(
        &self,
        object: &Object,
        name: &Value,
        kind: MessageKind,
    ) -> Result<Item, MessageError> {
        let fields = Fields::new(format!("{}{name}", kind.folder()), object);
        let name = match name {
            Value::String(name) if !name.trim().is_empty() => name.clone(),
            Value::Number(number) => number.to_string(),
            Value::Null
            | Value::Bool(_)
            | Value::String(_)
            | Value::Array(_)
            | Value::Object(_) => return Err(fields.fail("name", name.to_string(), "a name")),
        };
        let conventions = &self.options.conventions;
        let text = match object.get("time") {
            // As time_format = "unix" has it.
            Some(Value::Number(number)) => number.to_string(),
            Some(_) | None => fields.text("time")?.unwrap_or_default().to_owned(),
        };
        let time = (self.options.dialect.instant(&text, &conventions.clock))
            .map_err(|fault| fields.fail("time", format!("{text:?}"), fault.expected()))?;
        let value = object.get("value");
        let topic = match kind {
            MessageKind::Channel => Topic::Channel(name),
            MessageKind::Benchmark => {
                let benchmark = BenchmarkId::new(name);
                if let Some(what) = value.and_then(|value| missing(&conventions.missing, value)) {
                    return Ok(Item::Missing {
                        benchmark,
                        time,
                        what,
                    });
                }
                Topic::Benchmark(benchmark, quantity(&fields)?)
            }
        };
        let mut metadata = BTreeMap::new();
        if let Some(span) = object.get(AVERAGING) {
            metadata.insert(AVERAGING.to_owned(), span.to_string());
        }
        let mut item = fields.item(topic, time, &metadata)?;
        if let Item::Reading {
            unit, averaging, ..
        } = &mut item
        {
            *averaging = self.options.averaging_of(*unit, *averaging);
        }
        Ok(item)
    }

    /// An object as a row of a table with its keys for a header.
    fn cells(&mut self, line: u64, object: &Object) -> Result<Vec<Item>, IngestError> {
        let names: Vec<String> = object.keys().map(|key| key.trim().to_owned()).collect();
        if !self.tables.contains_key(&names) {
            let layout = Layout::new(&self.file, line, names.clone(), &self.options)?;
            if self.tables.len() >= MOST_LAYOUTS {
                self.tables.clear();
            }
            let table = TableRows::new(&self.file, layout, &self.options);
            self.tables.insert(names.clone(), table);
        }
        let cells: StringRecord = object.values().map(cell).collect();
        match self.tables.get_mut(&names) {
            Some(table) => table.items(line, &cells),
            None => Ok(Vec::new()),
        }
    }
}

/// What a value is in a cell of a table.
pub(super) fn cell(value: &Value) -> String {
    match value {
        Value::Null => String::new(),
        Value::String(text) => text.trim().to_owned(),
        Value::Bool(_) | Value::Number(_) | Value::Array(_) | Value::Object(_) => value.to_string(),
    }
}

/// What stands in place of a value, where it means that there is none.
fn missing(marks: &MissingValues, value: &Value) -> Option<String> {
    let is_missing = match value {
        Value::Null => true,
        Value::String(text) => marks.has(text),
        Value::Number(number) => number
            .as_f64()
            .is_some_and(|number| marks.has_number(number)),
        Value::Bool(_) | Value::Array(_) | Value::Object(_) => false,
    };
    is_missing.then(|| value.to_string())
}

/// As the message says it, or else as its unit does.
fn quantity(fields: &Fields<'_>) -> Result<Quantity, MessageError> {
    if let Some(word) = fields.text("quantity")? {
        return [Quantity::Displacement, Quantity::Velocity]
            .into_iter()
            .find(|one| one.name() == word)
            .ok_or_else(|| fields.fail("quantity", word, "displacement or velocity"));
    }
    let unit = fields.text("unit")?.unwrap_or_default();
    Unit::parse(unit)
        .map(Unit::quantity)
        .map_err(|_| fields.fail("unit", format!("{unit:?}"), "a unit such as mm or mm/day"))
}

/// The objects of a line.
struct Objects {
    whole: Vec<Object>,
    /// What belongs to none of them.
    torn: Option<String>,
}

fn objects(text: &str) -> Objects {
    let mut found = Objects {
        whole: Vec::new(),
        torn: None,
    };
    let (mut at, mut torn_from) = (0, 0);
    for _ in 0..MOST_TRIES {
        let Some(start) = text[at..].find('{').map(|brace| at + brace) else {
            break;
        };
        let mut stream = serde_json::Deserializer::from_str(&text[start..]).into_iter::<Object>();
        if let Some(Ok(object)) = stream.next() {
            found.note_torn(&text[torn_from..start]);
            found.whole.push(object);
            at = start + stream.byte_offset();
            torn_from = at;
        } else {
            at = start + 1;
        }
    }
    found.note_torn(&text[torn_from..]);
    found
}

impl Objects {
    fn note_torn(&mut self, text: &str) {
        if !text.trim().is_empty() && self.torn.is_none() {
            self.torn = Some(text.trim().chars().take(200).collect());
        }
    }
}

/// The line with a bare NaN or Infinity put in quotes; `None` where it has none.
fn with_quoted_nan(text: &str) -> Option<String> {
    let mut out = String::with_capacity(text.len() + 16);
    let (mut rest, mut is_text, mut has_any) = (text, false, false);
    while let Some(c) = rest.chars().next() {
        let word = NOT_JSON.into_iter().find(|word| rest.starts_with(word));
        let length = match word {
            Some(word) if !is_text => {
                has_any = true;
                out.extend(["\"", word, "\""]);
                word.len()
            }
            _ => {
                is_text ^= c == '"';
                // What follows a backslash ends no text.
                let escaped = if is_text && c == '\\' {
                    rest[1..].chars().next()
                } else {
                    None
                };
                let length = c.len_utf8() + escaped.map_or(0, char::len_utf8);
                out.push_str(&rest[..length]);
                length
            }
        };
        rest = &rest[length..];
    }
    has_any.then_some(out)
}
