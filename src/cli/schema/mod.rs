//! `schema`: the JSON Schemas of what the program prints, sends and answers, and of a site's config.

mod config;
mod outputs;
mod words;

use anyhow::Context;
use clap::builder::PossibleValuesParser;
use outputs::OUTPUTS;
use schemars::generate::SchemaSettings;
use serde_json::Value;
use std::io::Write;
use std::path::{Path, PathBuf};

/// Print the JSON Schema of an output, or of the config; without a name list them
///
/// Each is of draft 2020-12 and says what this version writes. Later versions may write more keys, so that outputs
/// are open to them; the config is not, because keys that are not known are refused.
#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Which one
    #[arg(value_name = "NAME", value_parser = PossibleValuesParser::new(names()), hide_possible_values = true)]
    name: Option<String>,
    /// Write all of them into this folder instead, each as NAME.json
    #[arg(short, long, value_name = "DIR", conflicts_with = "name")]
    output_dir: Option<PathBuf>,
}

/// The site file, whose schema comes from its reader.
const CONFIG: (&str, &str) = (
    "config",
    "A site file, as JSON that holds what its TOML holds.",
);

/// Prints one, writes all or lists them.
pub(super) fn run(args: &Args) -> anyhow::Result<()> {
    if let Some(folder) = &args.output_dir {
        return write(folder).with_context(|| format!("cannot write to {}", folder.display()));
    }
    let mut stdout = std::io::stdout().lock();
    if let Some(name) = &args.name {
        write!(stdout, "{}", text(name)?)?;
    } else {
        let width = names().map(str::len).max().unwrap_or_default();
        for output in &OUTPUTS {
            writeln!(stdout, "{:width$}  {}", output.name, output.says)?;
        }
        writeln!(stdout, "{:width$}  {}", CONFIG.0, CONFIG.1)?;
    }
    stdout.flush()?;
    Ok(())
}

fn names() -> impl Iterator<Item = &'static str> {
    OUTPUTS
        .iter()
        .map(|output| output.name)
        .chain(std::iter::once(CONFIG.0))
}

fn write(folder: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder)?;
    for name in names() {
        std::fs::write(folder.join(format!("{name}.json")), text(name)?)?;
    }
    Ok(())
}

/// The schema of that name, as a file.
fn text(name: &str) -> anyhow::Result<String> {
    let schema = if let Some(output) = OUTPUTS.iter().find(|output| output.name == name) {
        let settings = SchemaSettings::draft2020_12();
        let settings = if output.is_taken {
            settings.for_deserialize()
        } else {
            settings.for_serialize()
        };
        let mut generator = settings.into_generator();
        let schema = (output.schema)(&mut generator);
        let definitions = generator.take_definitions(true);
        titled((output.name, output.says), schema.to_value(), definitions)
    } else {
        let (schema, definitions) = config::schema()?;
        titled(CONFIG, schema, definitions)
    };
    Ok(serde_json::to_string_pretty(&schema)? + "\n")
}

/// A document of its own: what it is first, the definitions last.
fn titled(
    (name, says): (&str, &str),
    schema: Value,
    definitions: serde_json::Map<String, Value>,
) -> Value {
    let mut document = serde_json::json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": format!("slipwatch {name}"),
        "description": says,
    });
    let Some(members) = document.as_object_mut() else {
        return document;
    };
    if let Value::Object(schema) = schema {
        for (key, value) in schema {
            members.entry(key).or_insert(value);
        }
    }
    if !definitions.is_empty() {
        members.insert("$defs".to_owned(), Value::Object(definitions));
    }
    words::plain(&mut document);
    document
}
