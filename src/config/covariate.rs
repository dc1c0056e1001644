//! `[[covariate]]`: what a column measures whose name does not say it.

use super::Benchmark;
use super::problem::ConfigProblem;
use super::table::Section;
use crate::reading::CovariateKind;

/// One covariate, as the config states it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StatedCovariate {
    /// The column's name in the files, or the channel's in messages and recordings.
    pub column: String,
    /// What it measures.
    pub kind: CovariateKind,
    /// What is wrong where nothing is called so: only the files can show that.
    pub absent: ConfigProblem,
}

pub(super) fn covariates(root: &mut Section<'_>, benchmarks: &[Benchmark]) -> Vec<StatedCovariate> {
    let mut known: Vec<StatedCovariate> = Vec::new();
    for section in root.tables("covariate", "covariate") {
        if let Some(one) = covariate(section, benchmarks, &known) {
            known.push(one);
        }
    }
    known
}

fn covariate(
    mut section: Section<'_>,
    benchmarks: &[Benchmark],
    known: &[StatedCovariate],
) -> Option<StatedCovariate> {
    let column = section.required("column", "\"Nied_1h\"");
    let kind = section
        .required("kind", "\"rain\"")
        .and_then(|_| section.parsed("kind", CovariateKind::parse));
    let what = |column: &str| format!("covariate.column = {column:?}");
    if let Some(column) = &column {
        let what = what(&column.value);
        let named = |one: &&Benchmark| {
            let is_component = |vector: &super::Vector| vector.components.contains(&column.value);
            one.column.as_ref() == Some(&column.value)
                || one.vector.as_ref().is_some_and(is_component)
        };
        if known.iter().any(|one| one.column == column.value) {
            let fix = "state each column once";
            section.error(&column.at, format!("{what} is there twice"), fix);
        } else if let Some(benchmark) = benchmarks.iter().find(named) {
            section.error(
                &column.at,
                format!(
                    "{what} holds the readings of benchmark {:?}",
                    benchmark.id.as_str()
                ),
                "name a column that no [[benchmark]] takes",
            );
        }
    }
    let absent = column.as_ref().map(|column| {
        let what = format!("{} is no covariate in the files", what(&column.value));
        section.doubt(&column.at, what, "write a column as the files name it")
    });
    section.finish();
    Some(StatedCovariate {
        column: column?.value,
        kind: kind?.value,
        absent: absent?,
    })
}
