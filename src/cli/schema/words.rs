//! What is derived from the code, as one who reads JSON needs it.

use serde_json::Value;

/// Rewrites every description in `schema`: one line, no links into the code, `null` for what is absent. Defaults go:
/// they are what the program takes where its own older state lacks a key.
pub(super) fn plain(schema: &mut Value) {
    match schema {
        Value::Object(members) => {
            members.shift_remove("default");
            for (key, value) in members {
                if let (Value::String(text), "description") = (&mut *value, key.as_str()) {
                    *text = reworded(text);
                } else {
                    plain(value);
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(plain),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => {}
    }
}

fn reworded(text: &str) -> String {
    text.replace("\n\n", "\u{0}")
        .replace('\n', " ")
        .replace('\u{0}', "\n")
        .replace("[`", "`")
        .replace("`]", "`")
        .replace("`None`", "null")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_reads_as_a_sentence_on_json() {
        let mut schema = serde_json::json!({"properties": {"low": {
            "description": "See [`Score::high`];\n`None` without.",
        }}});
        plain(&mut schema);
        let said = &schema["properties"]["low"]["description"];
        assert_eq!(said, "See `Score::high`; null without.");
    }
}
