//! The schema of a site file: its keys from the reader itself, what they mean from the example with every key.

use crate::config::{Key, Keys, ValueShape, keys, way_out_tables};
use anyhow::Context;
use serde_json::{Map, Value, json};

/// The config with every key, as it is tested; in lines that begin with `# ` stands what may be added.
const EXAMPLE: &str = include_str!("../../../config/example.toml");
/// Where a table says nothing of a key, this one may.
const LIKE: [(&str, &str); 1] = [("benchmark.alert", "alert")];

/// The other table, if there is one.
fn like(table: &str) -> Option<&'static str> {
    let stated = LIKE.iter().find(|(one, _)| *one == table);
    let way_out = || way_out_tables().any(|one| one == table).then_some("hook");
    stated.map(|(_, other)| *other).or_else(way_out)
}

/// The schema of the whole file and, by name, those of its tables.
pub(super) fn schema() -> anyhow::Result<(Value, Map<String, Value>)> {
    let keys = keys(&uncommented(EXAMPLE));
    let notes = notes(EXAMPLE);
    let mut definitions = Map::new();
    for table in keys.tables.keys().filter(|table| !table.is_empty()) {
        definitions.insert((*table).to_owned(), self::table(table, &keys, &notes)?);
    }
    Ok((table("", &keys, &notes)?, definitions))
}

fn table(name: &str, keys: &Keys, notes: &[Note]) -> anyhow::Result<Value> {
    let known = keys.tables.get(name);
    let known = known.with_context(|| format!("the example has no table {name}"))?;
    // Without a table the keys that it must have are missing too.
    let must_have = |table: &str| {
        let keys = keys.tables.get(table).into_iter().flatten();
        keys.copied().any(|key| key.is_required)
    };
    let is_required = |key: &&Key| {
        key.is_required || matches!(key.shape, ValueShape::Table(table) if must_have(table))
    };
    let required = known.iter().filter(is_required);
    let required: Vec<&str> = required.map(|key| key.name).collect();
    let properties = known
        .iter()
        .map(|key| (key.name.to_owned(), property(name, key, notes)));
    Ok(json!({
        "type": "object",
        "properties": properties.collect::<Map<_, _>>(),
        "required": required,
        "additionalProperties": false,
    }))
}

fn property(table: &str, key: &Key, notes: &[Note]) -> Value {
    let mut schema = of_shape(key.shape);
    let tables = [Some(table), like(table)];
    let of = |table: &str| {
        let of_key = |note: &&Note| note.table == table && note.key == key.name;
        notes.iter().filter(of_key).collect::<Vec<_>>()
    };
    let notes: Vec<&Note> = tables.into_iter().flatten().flat_map(of).collect();
    let says = notes.iter().find(|note| !note.says.is_empty());
    let example = notes.iter().find_map(|note| note.example.as_ref());
    if let Some(members) = schema.as_object_mut() {
        members.extend(says.map(|note| ("description".to_owned(), json!(note.says))));
        members.extend(example.map(|example| ("examples".to_owned(), json!([example]))));
    }
    schema
}

fn of_shape(shape: ValueShape) -> Value {
    let reference = |name: &str| json!({ "$ref": format!("#/$defs/{name}") });
    match shape {
        ValueShape::Text => json!({ "type": "string" }),
        ValueShape::Texts => json!({ "type": "array", "items": { "type": "string" } }),
        ValueShape::TextOrTexts => {
            json!({ "type": ["string", "array"], "items": { "type": "string" } })
        }
        ValueShape::Switch => json!({ "type": "boolean" }),
        ValueShape::Number => json!({ "type": "number" }),
        ValueShape::Chance => {
            json!({ "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1 })
        }
        ValueShape::Numbers => json!({ "type": "array", "items": { "type": "number" } }),
        ValueShape::Marks => json!({ "type": "array", "items": { "type": ["number", "string"] } }),
        ValueShape::Table(name) => reference(name),
        ValueShape::Tables(name) => json!({ "type": "array", "items": reference(name) }),
    }
}

/// What the example says of one key.
struct Note {
    table: String,
    key: String,
    says: String,
    example: Option<Value>,
}

/// Every key of the example, with the comment behind it and below it.
fn notes(example: &str) -> Vec<Note> {
    let mut notes: Vec<Note> = Vec::new();
    let mut table = String::new();
    let mut is_noted = false;
    for line in example.lines() {
        let bare = bare(line);
        if let Some(name) = header(bare) {
            name.clone_into(&mut table);
            is_noted = false;
        } else if let Some((key, value, says)) = assignment(bare) {
            let parsed: Option<toml::Table> = toml::from_str(&format!("value = {value}")).ok();
            notes.push(Note {
                table: table.clone(),
                key: key.to_owned(),
                says: says.to_owned(),
                example: parsed.and_then(|parsed| serde_json::to_value(parsed.get("value")?).ok()),
            });
            is_noted = !says.is_empty();
        } else {
            let more = continuation(line).filter(|_| is_noted);
            is_noted = more.is_some();
            if let Some((more, last)) = more.zip(notes.last_mut()) {
                last.says.push(' ');
                last.says.push_str(more);
            }
        }
    }
    notes
}

/// The line, without the mark that leaves it out of the example.
fn bare(line: &str) -> &str {
    let after = line.strip_prefix("# ").unwrap_or(line);
    let is_meant = header(after).is_some() || assignment(after).is_some();
    if is_meant { after } else { line }
}

fn uncommented(example: &str) -> String {
    example
        .lines()
        .map(|line| bare(line).to_owned() + "\n")
        .collect()
}

/// The name in `[name]` or `[[name]]`.
fn header(line: &str) -> Option<&str> {
    let inner = line.trim_end().split("  #").next()?.trim_end();
    let name = inner.strip_prefix('[')?.strip_suffix(']')?;
    let name = name
        .strip_prefix('[')
        .and_then(|name| name.strip_suffix(']'))
        .unwrap_or(name);
    let is_name = name
        .bytes()
        .all(|byte| byte.is_ascii_lowercase() || matches!(byte, b'.' | b'_'));
    is_name.then_some(name)
}

/// Key, value and comment of `key = value  # comment`.
fn assignment(line: &str) -> Option<(&str, &str, &str)> {
    let (key, rest) = line.split_once(" = ")?;
    let is_key = key
        .bytes()
        .all(|byte| byte.is_ascii_lowercase() || byte == b'_');
    let (value, says) = rest.split_once("  #").unwrap_or((rest, ""));
    is_key.then_some((key, value.trim(), says.trim()))
}

/// The rest of a comment that began behind the key above.
fn continuation(line: &str) -> Option<&str> {
    let text = line.strip_prefix('#').unwrap_or(line);
    let says = text
        .strip_prefix("          ")?
        .trim_start()
        .strip_prefix('#')?;
    Some(says.trim())
}
