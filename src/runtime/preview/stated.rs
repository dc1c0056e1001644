//! Covariates that the config states and the files do not have.

use super::view::Preview;
use crate::config::{Config, ConfigProblem};
use std::collections::BTreeSet;

/// By what `preview` shows of the files; nothing where they were not all read, where there are none, and where some come by a
/// broker.
pub(super) fn absent(preview: &Preview, config: &Config) -> Vec<ConfigProblem> {
    let has_files = preview.sources.iter().any(|source| source.files > 0);
    if !preview.is_whole || !has_files || !config.brokers.is_empty() {
        return Vec::new();
    }
    let there: BTreeSet<&str> = (preview.covariates.iter())
        .map(|one| one.name.as_str())
        .collect();
    let fix = if there.is_empty() {
        "the files have none".to_owned()
    } else {
        let names: Vec<&str> = there.iter().copied().collect();
        format!("covariates in the files: {}", names.join(", "))
    };
    let absent = config.covariates.iter();
    let absent = absent.filter(|one| !there.contains(one.column.as_str()));
    absent
        .map(|one| ConfigProblem {
            fix: fix.clone(),
            ..one.absent.clone()
        })
        .collect()
}
