//! `[drill]`: how often the whole way of an alert is tried, from a file to the people who acknowledge it.

use super::table::Section;
use super::value;
use super::{Benchmark, HookConfig};
use jiff::SignedDuration;
use jiff::civil::Time;

/// The benchmark of every drill.
pub const EXERCISE: &str = "exercise";
/// Oftener is noise to people.
const SHORTEST: SignedDuration = SignedDuration::from_mins(1);

/// `[drill]`: when the hooks that ask for it are run by a synthetic failure.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Drill {
    /// How often.
    pub every: SignedDuration,
    /// At which time of day, in the site's zone; `None`: as soon as the time is over.
    pub at: Option<Time>,
    /// Within which time somebody has to acknowledge it; `None`: nobody has to.
    pub acknowledge_within: Option<SignedDuration>,
}

/// The table; `None` without one.
pub(super) fn drill(
    root: &mut Section<'_>,
    hooks: &[HookConfig],
    benchmarks: &[Benchmark],
) -> Option<Drill> {
    let is_there = root.has("drill");
    let mut section = root.table("drill", "drill");
    if !is_there {
        if hooks.iter().any(|hook| hook.extra.drills) {
            root.warning(
                root.at(),
                "a hook has drills = true, and there is no [drill]".to_owned(),
                "add [drill] with every = \"7d\"",
            );
        }
        return None;
    }
    section.required("every", "\"7d\"");
    let every = section.parsed("every", |text| {
        let every = value::duration(text)?;
        (every >= SHORTEST)
            .then_some(every)
            .ok_or_else(|| "write a minute or more, such as \"7d\"".to_owned())
    });
    let at = section.parsed("at", |text| {
        let time = Time::strptime("%H:%M", text);
        time.map_err(|_| "write a time of day: \"10:00\"".to_owned())
    });
    let within = section.parsed("acknowledge_within", value::duration);
    if let (Some(every), Some(within)) = (&every, &within)
        && within.value >= every.value
    {
        section.error(
            &within.at,
            "drill.acknowledge_within is not shorter than every".to_owned(),
            "write a shorter one: the next drill would begin before this one ends",
        );
    }
    if !hooks.iter().any(|hook| hook.extra.drills) {
        section.error(
            section.at(),
            "no hook has drills = true: a drill would reach nobody".to_owned(),
            "add drills = true to the [[hook]], [[webhook]] or [[cap]] that it is to reach",
        );
    }
    if benchmarks.iter().any(|one| one.id.as_str() == EXERCISE) {
        section.error(
            section.at(),
            format!("{EXERCISE:?} is a benchmark, and what a drill calls its own"),
            "give the benchmark another id",
        );
    }
    section.finish();
    Some(Drill {
        every: every?.value,
        at: at.map(|given| given.value),
        acknowledge_within: within.map(|given| given.value),
    })
}
