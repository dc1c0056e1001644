//! The ways out for alerts: `[[hook]]`, and the table of the others.

use super::every_way::common;
use super::table::Section;
use super::{HookConfig, cap, mqtt_out, webhook};
use std::collections::BTreeSet;
use std::path::Path;

/// What is said where nobody is notified.
pub const NO_HOOK: &str = "there is no [[hook]]: nobody is notified of an alert";
/// What to do then.
pub const ADD_HOOK: &str = "add [[hook]] with run = [\"./notify.sh\"]";

/// Reads one table of the config; the set has what the ways out before it are called.
type ReadWayOut = fn(Section<'_>, &Path, &mut BTreeSet<String>) -> Option<HookConfig>;

/// The ways out beside programs, by their tables, in the order in which a config's hooks stand.
const TABLES: [(&str, ReadWayOut); 3] = [
    ("webhook", webhook::read),
    ("cap", cap::read),
    ("mqtt_out", mqtt_out::read),
];

/// The names of the tables that are ways out beside programs.
pub fn way_out_tables() -> impl Iterator<Item = &'static str> {
    TABLES.into_iter().map(|(table, _)| table)
}

/// All of them: the programs first.
pub(super) fn hooks(root: &mut Section<'_>, base: &Path) -> Vec<HookConfig> {
    let programs = root.tables("hook", "hook").into_iter();
    let mut hooks: Vec<HookConfig> = programs
        .filter_map(|section| program(section, base))
        .collect();
    let mut taken = BTreeSet::new();
    for (table, read) in TABLES {
        for section in root.tables(table, table) {
            hooks.extend(read(section, base, &mut taken));
        }
    }
    unlike(root, &hooks);
    let mut tables = std::iter::once("hook").chain(way_out_tables());
    if hooks.is_empty() && tables.all(|table| !root.has(table)) {
        root.warning(root.at(), NO_HOOK.to_owned(), ADD_HOOK);
    }
    hooks
}

/// The outbox knows a hook by its command line: one that is run at once and again later needs two.
fn unlike(root: &Section<'_>, hooks: &[HookConfig]) {
    for (place, hook) in hooks.iter().enumerate() {
        let name = hook.name();
        let is_other = |one: &HookConfig| one.name() == name && one.run != hook.run;
        if hooks[..place].iter().any(is_other) {
            root.error(
                root.at(),
                format!("two hooks that are not the same are named {name:?}: what one of them was notified of would count for the other"),
                "give one of them an argument of its own, as in run = [\"./notify.sh\", \"second\"]",
            );
            return;
        }
    }
    let later = hooks.iter().filter(|hook| hook.waits_on_purpose());
    for hook in later.filter(|hook| !hook.run.is_empty()) {
        if hooks.iter().filter(|one| one.run == hook.run).count() > 1 {
            root.error(
                root.at(),
                format!(
                    "two hooks run {:?}, one of them with escalate_after or hours: they cannot be distinguished",
                    hook.run.join(" ")
                ),
                "give one of them an argument of its own, as in run = [\"./notify.sh\", \"escalation\"]",
            );
            return;
        }
    }
    for (place, hook) in hooks.iter().enumerate() {
        let mut before = hooks[..place].iter();
        if !hook.run.is_empty() && before.any(|one| one.run == hook.run && overlap(one, hook)) {
            root.warning(
                root.at(),
                format!(
                    "two hooks run {:?} and ask for the same alerts: it is run once for each of these",
                    hook.run.join(" ")
                ),
                "leave one of them out, or give one an argument of its own",
            );
            return;
        }
    }
}

/// Whether there may be an alert that both ask for.
fn overlap(one: &HookConfig, other: &HookConfig) -> bool {
    let levels = one.levels.iter().any(|level| other.levels.contains(level));
    let benchmarks = one.benchmarks.is_empty()
        || other.benchmarks.is_empty()
        || !one.benchmarks.is_disjoint(&other.benchmarks);
    levels && benchmarks && one.site == other.site
}

fn program(mut section: Section<'_>, base: &Path) -> Option<HookConfig> {
    let run = section.texts("run");
    if run.as_ref().is_none_or(|run| run.value.is_empty()) {
        let at = run.as_ref().map_or(section.at(), |run| &run.at);
        section.error(
            at,
            "hook.run names no program".to_owned(),
            "write run = [\"./notify.sh\"]",
        );
    }
    let common = common(&mut section);
    let sandbox = section.switch("sandbox").unwrap_or(true);
    let writable = section.texts("writable");
    if let Some(paths) = writable.as_ref().filter(|_| !sandbox) {
        section.warning(
            &paths.at,
            "hook.writable without a sandbox allows nothing more".to_owned(),
            "leave it out, or write sandbox = true",
        );
    }
    let writable = writable.map_or_else(Vec::new, |paths| paths.value);
    section.finish();
    Some(HookConfig {
        run: run?.value.into_iter().map(|word| word.value).collect(),
        sandbox,
        writable: (writable.iter().map(|path| base.join(&path.value))).collect(),
        ..common.without_a_way_out(base)
    })
}
