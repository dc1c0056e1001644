//! What the config names and the files do not have.

use super::view::{BenchmarkWithoutReadings, Preview, Refusal, SourceView};
use crate::config::Config;
use crate::reading::BenchmarkId;

/// How a column comes to be a benchmark's.
const NAME_THEM: &str = "name the column [ID_]displacement_UNIT or [ID_]velocity_UNIT, or say in [[benchmark]] its column and unit";

/// By what `preview` shows of the files; nothing where they were not all read.
pub(super) fn without_readings(
    preview: &Preview,
    config: &Config,
) -> Vec<BenchmarkWithoutReadings> {
    if !preview.is_whole {
        return Vec::new();
    }
    let fed = || preview.benchmarks.iter().filter(|one| one.readings > 0);
    let mut without_readings = Vec::new();
    for view in &preview.sources {
        let has = |id: &BenchmarkId| fed().any(|one| one.source == view.id && one.id == *id);
        let mut named = config
            .benchmarks
            .iter()
            .filter(|one| one.source == view.id)
            .peekable();
        let is_open = named.peek().is_none();
        let absent = named
            .filter(|one| !has(&one.id))
            .map(|one| Some(one.id.clone()));
        let mut absent: Vec<Option<BenchmarkId>> = absent.collect();
        if is_open
            && view.files > 0
            && fed().all(|one| one.source != view.id)
            && preview.covariates.iter().all(|one| one.source != view.id)
        {
            absent.push(None);
        }
        without_readings.extend(
            absent
                .into_iter()
                .map(|benchmark| BenchmarkWithoutReadings {
                    text: why(view, benchmark.as_ref(), config),
                    benchmark,
                    source: view.id.clone(),
                }),
        );
    }
    if without_readings.is_empty() && fed().next().is_none() && config.brokers.is_empty() {
        without_readings.push(BenchmarkWithoutReadings {
            benchmark: None,
            source: String::new(),
            text: format!("no file has readings of a benchmark: nothing is watched; {NAME_THEM}"),
        });
    }
    without_readings
}

/// What is said of benchmarks of one source that name one column: none of them is read from a file that is not named after it.
fn of_one_column(view: &SourceView, benchmark: &BenchmarkId, config: &Config) -> Option<String> {
    let of_source = || config.benchmarks.iter().filter(|one| one.source == view.id);
    let column = of_source()
        .find(|one| one.id == *benchmark)?
        .column
        .as_ref()?;
    let same = of_source().filter(|one| one.column.as_ref() == Some(column));
    let same: Vec<&str> = same.map(|one| one.id.as_str()).collect();
    (same.len() > 1).then(|| {
        format!(
            "several [[benchmark]] ({}) have column = {column:?}: of them only the one is read that the file is named after; give each its own \
             column, or its own source",
            same.join(", ")
        )
    })
}

fn why(view: &SourceView, benchmark: Option<&BenchmarkId>, config: &Config) -> String {
    let SourceView { id, path, .. } = view;
    let whose = benchmark.map_or_else(
        || format!("source {id:?}"),
        |benchmark| format!("benchmark {:?}", benchmark.as_str()),
    );
    if let Some(problem) = &view.unreadable {
        return format!(
            "{whose}: there is no reading of it: {problem}; the daemon's user must be able to read the folder and the files"
        );
    }
    if view.files == 0 {
        return format!("{whose}: there is no file {path}; is the path right?");
    }
    let refused = view.refused.first();
    let refused = refused.map(|one| {
        let Refusal { rows, first } = one;
        format!("the daemon refuses what they have ({rows} times), the first: {first}")
    });
    if benchmark.is_none() {
        let hint = refused.unwrap_or_else(|| NAME_THEM.to_owned());
        return format!("{whose}: its files have no reading of any benchmark; {hint}");
    }
    let of_one_column = benchmark.and_then(|id| of_one_column(view, id, config));
    if let Some(problem) = of_one_column {
        return format!(
            "{whose}: the files that are there have no reading of it, and it is not watched; {problem}"
        );
    }
    let others: Vec<&str> = view.unwatched.iter().map(BenchmarkId::as_str).collect();
    let others = (!others.is_empty()).then(|| {
        format!(
            "they have {}, which no [[benchmark]] names; is the id right?",
            others.join(", ")
        )
    });
    let missing = benchmark.and_then(|benchmark| {
        let (all, _) = view.missing.get(benchmark)?;
        let marks = all - view.unread.get(benchmark).copied().unwrap_or_default();
        (marks > 0).then(|| {
            format!("they have a mark of no value where its readings should be ({marks} times)")
        })
    });
    let hints: Vec<String> = [others, missing, refused].into_iter().flatten().collect();
    let hint = match &hints[..] {
        [] => NAME_THEM.to_owned(),
        hints => hints.join("; "),
    };
    format!(
        "{whose}: the files that are there have no reading of it, and it is not watched; {hint}"
    )
}
