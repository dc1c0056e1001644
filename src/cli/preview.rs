//! What a site's files hold, for people.

use super::text::{clock, plain};
use crate::reading::{CovariateKind, Timestamp, whole_figure};
use crate::runtime::ingest::Meaning;
use crate::runtime::preview::{
    BenchmarkPreview, ColumnView, CovariateView, Preview, Refusal, SourceView,
};
use jiff::SignedDuration;
use jiff::tz::TimeZone;

/// The sources with their columns, the benchmarks and the covariates.
pub(super) fn shown(preview: &Preview, zone: &TimeZone) -> String {
    let mut text = String::new();
    for source in &preview.sources {
        source_lines(&mut text, source);
    }
    for benchmark in &preview.benchmarks {
        benchmark_lines(&mut text, benchmark, zone);
    }
    for covariate in &preview.covariates {
        covariate_line(&mut text, covariate);
    }
    for id in &preview.unwatched {
        text.push('\n');
        put(
            &mut text,
            &format!("not watched: {id} is in the files, and no [[benchmark]] names it"),
        );
    }
    if !preview.is_whole {
        text.push_str("\nonly the first values were read, there are very many\n");
    }
    text
}

/// One line: what stands in a file makes no other of it.
fn put(text: &mut String, line: &str) {
    text.push_str(&plain(line));
    text.push('\n');
}

fn source_lines(text: &mut String, source: &SourceView) {
    let SourceView {
        id,
        kind,
        path,
        times,
        files,
        ..
    } = source;
    let files = match files {
        0 => "no file yet".to_owned(),
        1 => "1 file".to_owned(),
        many => format!("{many} files"),
    };
    text.push('\n');
    put(
        text,
        &format!("source {id} ({kind}): {path}, {files}; times {times}"),
    );
    for layout in &source.layouts {
        let more = match layout.files {
            1 => String::new(),
            many => format!(" and {} more with the same columns", many - 1),
        };
        put(text, &format!("  {}{more}", layout.file.display()));
        let columns = layout.columns.iter();
        let width = columns.map(|column| column.name.chars().count()).max();
        for column in &layout.columns {
            let (name, width) = (&column.name, width.unwrap_or_default());
            put(text, &format!("    {name:width$}  {}", meaning(column)));
        }
    }
    for refusal in &source.refused {
        put(text, &format!("  refused: {}", refused(refusal)));
    }
    for remark in &source.remarks {
        put(text, &format!("  {remark}"));
    }
}

/// How many rows of one kind cannot be used, and the first.
pub(super) fn refused(refusal: &Refusal) -> String {
    let rows = match refusal.rows {
        1 => "1 row".to_owned(),
        many => format!("{many} rows"),
    };
    format!("{rows}, the first: {}", refusal.first)
}

fn meaning(column: &ColumnView) -> String {
    match &column.meaning {
        Meaning::Time => "time".to_owned(),
        Meaning::Reading { benchmark, unit } => format!("benchmark {benchmark}, {unit}"),
        Meaning::Sigma => "standard error of the readings".to_owned(),
        Meaning::Component { benchmark, unit } => {
            format!("one component of benchmark {benchmark}, {unit}")
        }
        Meaning::Covariate { unit: Some(unit) } => format!("covariate, {unit}"),
        Meaning::Covariate { unit: None } => "covariate without a unit in its name".to_owned(),
        Meaning::Text => "not used: text".to_owned(),
        Meaning::Empty => "not used: empty so far".to_owned(),
        Meaning::Unused => "not used".to_owned(),
    }
}

fn benchmark_lines(text: &mut String, benchmark: &BenchmarkPreview, zone: &TimeZone) {
    let BenchmarkPreview {
        id,
        source,
        quantity,
        unit,
        readings,
        corrected,
        repeated,
        ahead,
        missing,
        out_of_range,
        first,
        last,
        moved_mm: _,
        every_s,
        suspicions,
        remarks,
    } = benchmark;
    let every = every_s.map_or(String::new(), |seconds| {
        format!(", every {:#}", SignedDuration::from_secs(seconds))
    });
    text.push('\n');
    put(
        text,
        &format!("benchmark {id} ({source}): {readings} readings of {quantity}{every}"),
    );
    for (which, (time, value)) in [("first", first), ("last ", last)] {
        put(
            text,
            &format!(
                "  {which} {time}{}  {} {unit}",
                there(*time, zone),
                whole_figure(*value)
            ),
        );
    }
    let dropped = [
        (corrected, "corrected by another reading of the same time"),
        (repeated, "dropped, the same again"),
        (ahead, "refused, ahead of this machine's clock"),
    ];
    for (count, what) in dropped.iter().filter(|(count, _)| **count > 0) {
        put(text, &format!("  {what}: {count}"));
    }
    if *missing > 0 {
        put(
            text,
            &format!("  missing: {missing}, of these out of range: {out_of_range}"),
        );
    }
    for line in remarks {
        put(text, &format!("  {line}"));
    }
    for line in suspicions {
        put(text, &format!("  suspicion: {line}"));
    }
}

/// The same time on the clocks of the site.
fn there(time: Timestamp, zone: &TimeZone) -> String {
    if *zone == TimeZone::UTC {
        return String::new();
    }
    format!(" ({})", clock(time, zone))
}

fn covariate_line(text: &mut String, covariate: &CovariateView) {
    let CovariateView {
        name,
        unit,
        kind,
        is_stated,
        source,
        values,
        first,
        last,
        suspicions,
        remarks,
    } = covariate;
    let kind = match (kind, is_stated) {
        (_, true) => format!("; {kind}, as the config states"),
        (CovariateKind::Other, false) => {
            "; no sensor that is monitored; what it measures its name does not say: state it in [[covariate]], or in --column if it is a sensor of motion"
                .to_owned()
        }
        (_, false) => format!("; {kind}"),
    };
    let unit = unit
        .as_ref()
        .map_or(String::new(), |unit| format!(", {unit}"));
    text.push('\n');
    put(
        text,
        &format!("covariate {name} ({source}): {values} values{unit}, {first} to {last}{kind}"),
    );
    for line in remarks {
        put(text, &format!("  {line}"));
    }
    for line in suspicions {
        put(text, &format!("  suspicion: {line}"));
    }
}
