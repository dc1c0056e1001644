//! The site file that is written: what was found, and what can be added, in comments.

use super::times::word;
use super::{DayZero, InitPlan, dated};
use crate::config::SourceKind;
use crate::reading::{DecimalMark, Delimiter, TimeFormat};
use std::fmt::Write as _;

/// The whole file.
pub(super) fn config(plan: &InitPlan) -> String {
    let mut text = format!(
        "# What slipwatch watches here. Paths are relative to this file. After a change: slipwatch check FILE\n\n\
         [site]\nname = {}\n{:35}# everything the daemon knows; created when missing\n\
         # listen = \"127.0.0.1:8642\"        # /healthz, /readyz, /metrics, /api/status over HTTP\n",
        quoted(&plan.name),
        format!("state_dir = {}", quoted(&plan.state_dir))
    );
    if let Some(zone) = &plan.zone {
        let _ = writeln!(text, "time_zone = {}", quoted(zone));
    }
    for source in &plan.sources {
        source_lines(&mut text, source, plan);
    }
    text.push_str("\n# The points that are watched.\n");
    for benchmark in &plan.benchmarks {
        let _ = write!(
            text,
            "[[benchmark]]\nid = {}\nsource = {}\n",
            quoted(&benchmark.id),
            quoted(&benchmark.source)
        );
        if let Some((column, unit)) = &benchmark.column {
            let _ = write!(
                text,
                "column = {}\nunit = {}\n",
                quoted(column),
                quoted(unit)
            );
        }
        if benchmark.has_both {
            text.push_str(
                "quantity = \"displacement\"         # or \"velocity\": its file has both, and one of them is monitored\n",
            );
        }
        if let Some(averaging) = plan.averaging.as_ref().filter(|_| benchmark.is_velocity) {
            let line = format!("averaging = {}", quoted(averaging));
            let _ = writeln!(
                text,
                "{line:35}# each velocity is the mean of the time before it"
            );
        } else if benchmark.is_velocity {
            text.push_str("# averaging = \"1h\"                 # if each velocity is the mean of the time before it\n");
        }
        text.push('\n');
    }
    for (column, kind) in &plan.covariates {
        let _ = write!(
            text,
            "[[covariate]]\ncolumn = {}\nkind = {}\n\n",
            quoted(column),
            quoted(kind.name())
        );
    }
    alert_lines(&mut text, plan);
    text
}

/// What the name of a zone without summer time means: its sign is the other way round.
fn as_an_offset(zone: &str) -> String {
    let turned = |(sign, hours): (char, &str)| {
        format!(": UTC{sign}{hours}, which this name writes with the other sign")
    };
    let rest = zone.strip_prefix("Etc/GMT").unwrap_or_default();
    let hours = rest.strip_prefix('-').map(|hours| ('+', hours));
    let hours = hours.or_else(|| rest.strip_prefix('+').map(|hours| ('-', hours)));
    hours.map_or_else(String::new, turned)
}

/// What follows the file of one day.
fn dated_lines(text: &mut String, source: &super::PlannedSource, plan: &InitPlan) {
    if let Some(pattern) = dated::of_one_day(&source.path, &plan.benchmarks) {
        let _ = writeln!(
            text,
            "# The file's name has a date. If another file begins each day: path = {}, and in [[benchmark]] an id without the\n\
             # date and column = \"NAME\", its column's name in the header.",
            quoted(&pattern)
        );
    }
}

fn source_lines(text: &mut String, source: &super::PlannedSource, plan: &InitPlan) {
    let _ = write!(
        text,
        "\n{}[[source]]\nid = {}\nkind = \"{}\"\npath = {}\n",
        if source.is_beside {
            "# Covariates alone: none of its columns is a point.\n"
        } else {
            ""
        },
        quoted(&source.id),
        source.kind.name(),
        quoted(&source.path)
    );
    dated_lines(text, source, plan);
    let named = source.zone.as_ref().and_then(|zone| zone.iana_name());
    let zone = plan.zone.as_deref().or(named);
    if let Some(zone) = zone.filter(|_| source.kind != SourceKind::Mcap) {
        let _ = writeln!(
            text,
            "time_zone = {}          # of times that state no offset{}",
            quoted(zone),
            as_an_offset(zone)
        );
    }
    if let Some(dst) = &plan.dst {
        let _ = writeln!(text, "dst = {}", quoted(dst));
    }
    if !plan.missing.is_empty() {
        let marks: Vec<String> = plan.missing.iter().map(|mark| quoted(mark)).collect();
        let _ = writeln!(text, "missing = [{}]", marks.join(", "));
    }
    match &source.day_zero {
        Some(DayZero::Stated(epoch)) => {
            let line = format!("epoch = {}", quoted(&epoch.to_string()));
            let _ = writeln!(text, "{line:35}# day 0 of t_days");
        }
        Some(DayZero::Open) => text.push_str(
            "# epoch = \"2000-01-01T00:00:00Z\"   # day 0 of t_days, if it is another one\n",
        ),
        None => {}
    }
    let dialect = &source.dialect;
    if let Some(delimiter @ (Delimiter::Semicolon | Delimiter::Tab)) = dialect.delimiter {
        let _ = writeln!(text, "delimiter = \"{}\"", delimiter.name());
    }
    if dialect.decimal == DecimalMark::Comma {
        text.push_str("decimal = \"comma\"\n");
    }
    if let Some(thousands) = dialect.thousands {
        let _ = writeln!(text, "thousands = \"{}\"", thousands.name());
    }
    match &dialect.time_columns[..] {
        [] => {}
        [one] => {
            let _ = writeln!(text, "time_column = {}", quoted(one));
        }
        several => {
            let names: Vec<String> = several.iter().map(|name| quoted(name)).collect();
            let _ = writeln!(text, "time_column = [{}]", names.join(", "));
        }
    }
    if dialect.time_format != TimeFormat::Rfc3339 {
        let _ = writeln!(text, "time_format = {}", quoted(word(&dialect.time_format)));
    }
    if dialect.skip_lines > 0 {
        let line = format!("skip_lines = {}", dialect.skip_lines);
        let _ = writeln!(text, "{line:35}# so many stand before the header");
    }
}

fn alert_lines(text: &mut String, plan: &InitPlan) {
    let evacuation = match &plan.evacuation_time {
        Some(given) => format!("evacuation_time = {}", quoted(given)),
        None => "# evacuation_time = \"24h\"".to_owned(),
    };
    let _ = write!(
        text,
        "[alert]\n{evacuation:35}# how long it takes to bring everyone out; red looks twice so far ahead\n\
         # outlook = \"30d\"                # yellow and orange look so far ahead\n\
         # critical_velocity = \"1 m/day\"  # its passage is forecast beside the collapse\n\n\
         # A program that is run when a level is entered or left; it gets the alert as JSON on stdin.\n"
    );
    match &plan.hook {
        Some(hook) => {
            let _ = write!(text, "[[hook]]\nrun = [{}]\n", quoted(hook));
            text.push_str("levels = [\"orange\", \"red\", \"unknown\"]\n");
        }
        None => text.push_str(
            "# [[hook]]\n# run = [\"./notify.sh\"]\n# levels = [\"orange\", \"red\", \"unknown\"]\n",
        ),
    }
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_owned()).to_string()
}
