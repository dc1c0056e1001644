//! Whether the hooks could be run; none is.

use super::{CheckVerdict, Finding};
use crate::config::{Config, HookConfig};
use crate::runtime::sandbox::{self, WriteLimits};
use crate::runtime::ways_out::WAYS_OUT;

/// Whether an attempt could be made.
pub(super) fn finding(hook: &HookConfig) -> Finding {
    let table = hook.table();
    let way = WAYS_OUT.iter().find(|way| way.table == table);
    let ready = way.map_or_else(
        || Err(format!("no way out is called {table}")),
        |way| (way.ready)(hook),
    );
    let (verdict, text) = match ready {
        Ok(text) => (CheckVerdict::Good, text),
        Err(text) => (
            CheckVerdict::Wrong,
            format!("{text}: alerts would go nowhere"),
        ),
    };
    Finding::new(table, verdict, text)
}

/// A line for each program of a hook that is there and cannot be run.
pub fn unstartable(config: &Config) -> Vec<String> {
    let programs = config.hooks.iter().filter(|hook| hook.to.is_none());
    let there = programs.filter(|hook| hook.program().is_file());
    let found = there.map(finding);
    found
        .filter(|found| found.verdict == CheckVerdict::Wrong)
        .map(|found| format!("{}: {}", found.check, found.text))
        .collect()
}

/// Whether the kernel would limit where hooks write, where one is to be limited.
pub(super) fn write_limits(hooks: &[HookConfig]) -> Option<Finding> {
    let is_needed = hooks.iter().any(|hook| hook.sandbox);
    let finding = |verdict, text: &str| Finding::new("sandbox", verdict, text);
    is_needed.then(|| match sandbox::probe() {
        WriteLimits::Full => finding(
            CheckVerdict::Good,
            "hooks can write only where they are allowed to",
        ),
        WriteLimits::Partial => finding(
            CheckVerdict::Doubtful,
            "an old kernel keeps hooks from most writes elsewhere, not from all",
        ),
        WriteLimits::Unsupported => finding(
            CheckVerdict::Doubtful,
            "the kernel has no landlock: hooks can write wherever the daemon can",
        ),
    })
}
