//! The bundle of one alert: what the decision rests on, and the command that reproduces it from the bundle alone.

use super::words;
use crate::config::Config;
use crate::figures::Replayed;
use crate::monitor::{Event, Input, Measured};
use crate::reading::{BenchmarkId, Series};
use crate::runtime::origin::Origins;
use crate::runtime::view::AlertView;
use crate::store::Store;
use anyhow::Context;
use serde_json::json;
use sha2::{Digest, Sha256};
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write;
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// Run in the folder that the bundle was unpacked to, it prints the alert as it was called, and exits 0 only then.
const COMMAND: &str = "slipwatch replay --state state --format json | grep --line-regexp --fixed-strings --file=decision.json";

/// Writes the bundle of `alert` to `file`, which is replaced when it is there.
pub(super) fn write(
    file: &Path,
    alert: &AlertView,
    config: &Config,
    store: &Store,
) -> anyhow::Result<()> {
    let folder = tempfile::tempdir().context("cannot make a temporary folder")?;
    let copy = folder.path().join("slipwatch.db");
    store.copy_steps(alert.step, &copy)?;
    let taken = taken(store, alert)?;
    let events = events(store, alert)?;
    let config_text = std::fs::read(&config.file);
    let mut parts = vec![
        ("decision.json", line(&alert.decision)),
        ("alert.json", line(&serde_json::to_string_pretty(alert)?)),
        (
            "alert.txt",
            words::shown(alert, &config.site.time_zone).into_bytes(),
        ),
        (
            "rule.json",
            line(&serde_json::to_string_pretty(&alert.settings)?),
        ),
        (
            "readings.csv",
            readings(&taken, &Origins::of(config)).into_bytes(),
        ),
        ("events.ndjson", events.lines.into_bytes()),
        ("state/slipwatch.db", std::fs::read(&copy)?),
    ];
    if let Some(refit) = &alert.evidence {
        parts.push(("refit.json", line(&serde_json::to_string_pretty(refit)?)));
    }
    if let Some(svg) = plot(alert, &taken, &events.said) {
        parts.push(("plot.svg", svg.into_bytes()));
    }
    // Read from stdin there is none.
    if let Ok(text) = config_text {
        parts.push(("config.toml", text));
    }
    let sums: serde_json::Map<String, serde_json::Value> = (parts.iter())
        .map(|(name, bytes)| ((*name).to_owned(), json!(sha256(bytes))))
        .collect();
    let manifest = json!({
        "key": alert.key,
        "slipwatch_version": env!("CARGO_PKG_VERSION"),
        "command": COMMAND,
        "settings_sha256": sha256(&serde_json::to_vec(&alert.settings)?),
        "sha256": sums,
    });
    parts.push((
        "manifest.json",
        line(&serde_json::to_string_pretty(&manifest)?),
    ));
    parts.push(("README.txt", read_me(alert).into_bytes()));
    pack(file, &parts).with_context(|| format!("cannot write {}", file.display()))
}

fn pack(file: &Path, parts: &[(&str, Vec<u8>)]) -> anyhow::Result<()> {
    let mut zip = ZipWriter::new(File::create(file)?);
    // No times: one alert's bundle is the same whenever it is written.
    let options = SimpleFileOptions::default().compression_method(CompressionMethod::Deflated);
    for (name, bytes) in parts {
        zip.start_file(*name, options)?;
        zip.write_all(bytes)?;
    }
    zip.finish()?.sync_all()?;
    Ok(())
}

fn line(text: &str) -> Vec<u8> {
    format!("{text}\n").into_bytes()
}

fn sha256(bytes: &[u8]) -> String {
    let mut hex = String::new();
    for byte in Sha256::digest(bytes) {
        // Writing to a string cannot fail.
        let _ = write!(hex, "{byte:02x}");
    }
    hex
}

/// The values that had been taken when the alert was called: of its benchmark, or of all, and of every covariate.
fn taken(store: &Store, alert: &AlertView) -> anyhow::Result<Vec<Input>> {
    let is_wanted = |input: &Input| match input.measured() {
        Some(Measured::Reading { benchmark, .. }) => {
            alert.benchmark.as_ref().is_none_or(|own| own == benchmark)
        }
        Some(Measured::Sample { .. }) => true,
        None => false,
    };
    let (mut taken, mut after) = (Vec::new(), 0);
    loop {
        let rows = store.steps(after)?;
        let Some(last) = rows.last() else {
            return Ok(taken);
        };
        after = last.seq;
        let rows = rows.into_iter().filter(|row| row.seq <= alert.step);
        taken.extend(rows.map(|row| row.input).filter(is_wanted));
        if after >= alert.step {
            return Ok(taken);
        }
    }
}

/// What had been reported until then.
struct EventsUntil {
    lines: String,
    said: Vec<Event>,
}

fn events(store: &Store, alert: &AlertView) -> anyhow::Result<EventsUntil> {
    let benchmark = alert.benchmark.as_ref().map(BenchmarkId::as_str);
    let (mut lines, mut said, mut after) = (String::new(), Vec::new(), 0);
    loop {
        let events = store.events(after, None, benchmark)?;
        let Some((last, _)) = events.last() else {
            return Ok(EventsUntil { lines, said });
        };
        after = *last;
        for (_, body) in events {
            let event: Event = serde_json::from_str(&body)?;
            if event.time <= alert.since {
                lines += &body;
                lines.push('\n');
                said.push(event);
            }
        }
    }
}

/// A table with the file and the line of each value, where the files still hold it.
fn readings(taken: &[Input], origins: &Origins) -> String {
    let mut out = "time,kind,name,value,unit,sigma,file,line\n".to_owned();
    for input in taken {
        let Some(measured) = input.measured() else {
            continue;
        };
        let (kind, name, unit) = match measured {
            Measured::Reading {
                benchmark, unit, ..
            } => ("reading", benchmark.as_str(), unit.to_string()),
            Measured::Sample { channel, unit, .. } => {
                ("covariate", channel, unit.unwrap_or_default().to_owned())
            }
        };
        let (time, value) = (measured.time(), measured.value());
        let origin = origins.find(input);
        let file = origin.map_or_else(String::new, |origin| origin.file.display().to_string());
        let number = origin.map_or_else(String::new, |origin| origin.line.to_string());
        let sigma = (measured.sigma()).map_or_else(String::new, |sigma| sigma.to_string());
        let _ = writeln!(
            out,
            "{time},{kind},{},{value},{},{sigma},{},{number}",
            quoted(name),
            quoted(&unit),
            quoted(&file)
        );
    }
    out
}

/// A field of CSV.
fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// Readings, inverse velocity, forecasts and levels until the alert; none of the whole site.
fn plot(alert: &AlertView, taken: &[Input], events: &[Event]) -> Option<String> {
    let benchmark = alert.benchmark.clone()?;
    let mut series: Option<Series> = None;
    for input in taken {
        let Input::Reading {
            unit,
            averaging,
            reading,
            ..
        } = input
        else {
            continue;
        };
        let own = series.get_or_insert_with(|| Series {
            benchmark: benchmark.clone(),
            unit: *unit,
            averaging: *averaging,
            readings: Vec::new(),
        });
        // Of two quantities the one that came first.
        if own.unit == *unit {
            own.readings.push(*reading);
        }
    }
    let mut series = series?;
    series.put_in_order();
    let replayed = Replayed {
        series: &series,
        events,
        collapse: None,
    };
    Some(replayed.inverse_velocity(&[alert.since]))
}

fn read_me(alert: &AlertView) -> String {
    format!(
        "What the alert {} rests on, as slipwatch {} wrote it.\n\
         \n\
         alert.txt            the alert in words; alert.json the same as JSON\n\
         decision.json        the event that called it, as it stood in the state\n\
         rule.json            the settings in force then, with every figure of the rules\n\
         refit.json           the refit that it rests on\n\
         readings.csv         the values taken until then, with file and line where the files still hold them\n\
         events.ndjson        what the monitor had said until then; of old refits the first of each day\n\
         plot.svg             readings, inverse velocity, the forecast, levels\n\
         config.toml          the site file when the bundle was written\n\
         state/slipwatch.db   everything that the monitor had taken in until then, of every benchmark, in its order\n\
         manifest.json        version, SHA-256 of each file and of the settings\n\
         \n\
         To reproduce the decision, unpack the bundle and run in its folder, with slipwatch {} in the PATH:\n\
         \n    {COMMAND}\n\
         \n\
         It prints the alert as it was called, and exits 0 only then.\n",
        alert.key,
        env!("CARGO_PKG_VERSION"),
        env!("CARGO_PKG_VERSION"),
    )
}
