//! The columns of a table, from the JSON Schema of its rows: one for each key, `failure_time.median` for one inside.

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value};

/// What a column holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum ColumnKind {
    /// Numbers.
    Number,
    /// Whole numbers.
    Whole,
    /// true and false.
    Flag,
    /// Times in UTC, nanoseconds since 1970.
    Time,
    /// Words.
    Text,
    /// What has no type of its own here, as JSON: lists, and objects whose keys are not known beforehand.
    Json,
}

/// One column.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct TableColumn {
    /// The keys that lead to it.
    pub(super) path: Vec<String>,
    pub(super) kind: ColumnKind,
    /// What it means, and in which unit.
    pub(super) says: String,
}

/// The columns of `T`, in the order of its keys.
pub(super) fn of<T: JsonSchema>() -> Vec<TableColumn> {
    let generator = SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator();
    let schema = generator.into_root_schema_for::<T>().to_value();
    let mut found = Found {
        definitions: schema.get("$defs").and_then(Value::as_object).cloned(),
        columns: Vec::new(),
    };
    found.keys(&schema, &[]);
    found.columns
}

struct Found {
    definitions: Option<Map<String, Value>>,
    columns: Vec<TableColumn>,
}

impl Found {
    /// Takes the keys of an object, and of each of the forms that it may have.
    fn keys(&mut self, schema: &Value, path: &[String]) {
        let schema = self.meant(schema);
        for (key, property) in schema["properties"].as_object().into_iter().flatten() {
            let path = [path, std::slice::from_ref(key)].concat();
            self.key(property, path);
        }
        for form in ["oneOf", "anyOf", "allOf"] {
            for one in schema[form].as_array().into_iter().flatten() {
                self.keys(one, path);
            }
        }
    }

    fn key(&mut self, property: &Value, path: Vec<String>) {
        let schema = self.meant(property);
        if self.has_keys(&schema) {
            self.keys(&schema, &path);
            return;
        }
        let says = [property, &schema]
            .iter()
            .find_map(|one| one["description"].as_str());
        let says = says.unwrap_or_default().replace('\n', " ");
        let kind = self.kind(&schema);
        let known = self.columns.iter_mut().find(|known| known.path == path);
        match known {
            // What is a number here and a word there is JSON in both.
            Some(known) if known.kind != kind => known.kind = ColumnKind::Json,
            Some(_) => {}
            None => self.columns.push(TableColumn { path, kind, says }),
        }
    }

    /// What a reference leads to, and what may also be null without that.
    fn meant(&self, schema: &Value) -> Value {
        if let Some(name) = schema["$ref"].as_str() {
            let name = name.rsplit('/').next().unwrap_or_default();
            let known = self.definitions.as_ref().and_then(|all| all.get(name));
            let mut known = known.map_or(Value::Null, |known| self.meant(known));
            // Keys may stand beside a reference.
            if let (Some(own), Some(known)) =
                (schema["properties"].as_object(), known.as_object_mut())
            {
                let all = known
                    .entry("properties")
                    .or_insert_with(|| Map::new().into());
                if let Some(all) = all.as_object_mut() {
                    all.extend(own.clone());
                }
            }
            return known;
        }
        let forms = schema["anyOf"].as_array().map(Vec::as_slice);
        let is_null = |form: &&Value| form["type"] == "null";
        match forms {
            Some([one, null]) if is_null(&null) => self.meant(one),
            Some(_) | None => schema.clone(),
        }
    }

    fn has_keys(&self, schema: &Value) -> bool {
        let forms = ["oneOf", "anyOf", "allOf"].map(|form| schema[form].as_array());
        let mut forms = forms.into_iter().flatten().flatten();
        schema["properties"].is_object() || forms.any(|form| self.has_keys(&self.meant(form)))
    }

    fn kind(&self, schema: &Value) -> ColumnKind {
        let types = match &schema["type"] {
            Value::Array(types) => types.iter().filter_map(Value::as_str).collect(),
            Value::String(one) => vec![one.as_str()],
            Value::Null | Value::Bool(_) | Value::Number(_) | Value::Object(_) => Vec::new(),
        };
        let types: Vec<&str> = types.into_iter().filter(|one| *one != "null").collect();
        match types[..] {
            ["number"] => ColumnKind::Number,
            ["integer"] => ColumnKind::Whole,
            ["boolean"] => ColumnKind::Flag,
            ["string"] if schema["format"] == "date-time" => ColumnKind::Time,
            ["string"] => ColumnKind::Text,
            _ if self.is_word(schema) => ColumnKind::Text,
            _ => ColumnKind::Json,
        }
    }

    /// Whether every form of it is a word.
    fn is_word(&self, schema: &Value) -> bool {
        let is_one = |one: &Value| self.kind(&self.meant(one)) == ColumnKind::Text;
        schema["const"].is_string()
            || (schema["oneOf"].as_array()).is_some_and(|forms| forms.iter().all(is_one))
    }
}
