//! The keys that every way out for alerts has: which alerts, of what, when, and how long an attempt may take.

use super::duty::{DutyHours, Shift};
use super::table::Section;
use super::{ExtraMessages, HookConfig, SharedDestination, value};
use crate::alert::Level;
use crate::reading::BenchmarkId;
use jiff::SignedDuration;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

/// Of one attempt, where the config states none.
const TIMEOUT: Duration = Duration::from_secs(10);
/// An attempt that may take longer than this keeps those after it waiting.
const LONG_TIMEOUT: SignedDuration = SignedDuration::from_mins(15);

/// What all ways out have in common.
pub(super) struct Common {
    pub(super) levels: Vec<Level>,
    pub(super) benchmarks: BTreeSet<BenchmarkId>,
    pub(super) site: bool,
    pub(super) timeout: Duration,
    pub(super) escalate_after: Option<Duration>,
    pub(super) hours: Option<DutyHours>,
    pub(super) extra: ExtraMessages,
}

impl Common {
    /// The way to this destination; a relative path in it starts at `base`.
    pub(super) fn to(self, destination: SharedDestination, base: &Path) -> HookConfig {
        HookConfig {
            to: Some(destination),
            ..self.without_a_way_out(base)
        }
    }

    /// All but where the alerts go.
    pub(super) fn without_a_way_out(self, base: &Path) -> HookConfig {
        HookConfig {
            run: Vec::new(),
            to: None,
            levels: self.levels,
            benchmarks: self.benchmarks,
            site: self.site,
            timeout: self.timeout,
            escalate_after: self.escalate_after,
            hours: self.hours,
            extra: self.extra,
            links: None,
            zone: "UTC".to_owned(),
            folder: base.to_owned(),
            sandbox: false,
            writable: Vec::new(),
            launcher: None,
        }
    }
}

/// Reads them.
pub(super) fn common(section: &mut Section<'_>) -> Common {
    let benchmarks = section.texts("benchmarks");
    if let Some(given) = &benchmarks
        && given.value.is_empty()
    {
        section.error(
            &given.at,
            format!(
                "{} is empty: no alert would be sent",
                section.path("benchmarks")
            ),
            "leave it out for all, or write benchmarks = [\"5\"]",
        );
    }
    let benchmarks = benchmarks.map_or_else(Vec::new, |given| given.value);
    let timeout = section.parsed("timeout", value::duration);
    if let Some(given) = timeout.as_ref().filter(|given| given.value > LONG_TIMEOUT) {
        section.warning(
            &given.at,
            format!(
                "{} {:#}: while an attempt hangs for so long, it is not repeated and alerts after it wait",
                section.path("timeout"),
                given.value
            ),
            "write how long an attempt takes at most, such as \"30s\"",
        );
    }
    let escalate_after = section.parsed("escalate_after", value::duration);
    Common {
        levels: levels(section),
        benchmarks: (benchmarks.into_iter())
            .map(|word| BenchmarkId::new(word.value))
            .collect(),
        site: section.switch("site").unwrap_or(false),
        hours: hours(section),
        extra: ExtraMessages {
            drills: section.switch("drills").unwrap_or(false),
            corrections: section.switch("corrections").unwrap_or(false),
        },
        timeout: timeout.map_or(TIMEOUT, |given| given.value.unsigned_abs()),
        escalate_after: escalate_after.map(|given| given.value.unsigned_abs()),
    }
}

/// When it is on duty, by UTC until the site's time zone is known; `None`: always.
fn hours(section: &mut Section<'_>) -> Option<DutyHours> {
    let texts = section.texts("hours")?;
    let path = section.path("hours");
    if texts.value.is_empty() {
        section.error(
            &texts.at,
            format!("{path} is empty: no alert would ever be sent"),
            "leave it out for always, or write hours = [\"mon-fri 07:00-19:00\"]",
        );
        return None;
    }
    let mut shifts = Vec::new();
    for text in &texts.value {
        match Shift::parse(&text.value) {
            Ok(shift) => shifts.push(shift),
            Err(fix) => {
                let what = format!("{:?} in {path} is no shift", text.value);
                section.error(&text.at, what, fix);
            }
        }
    }
    Some(DutyHours::new(shifts))
}

fn levels(section: &mut Section<'_>) -> Vec<Level> {
    let Some(words) = section.texts("levels") else {
        return vec![Level::Orange, Level::Red, Level::Unknown];
    };
    let path = section.path("levels");
    if words.value.is_empty() {
        section.error(
            &words.at,
            format!("{path} is empty: no alert would be sent"),
            "write levels = [\"orange\", \"red\"]",
        );
    }
    let mut levels = Vec::new();
    for word in words.value {
        match value::level(&word.value) {
            Ok(level) => levels.push(level),
            Err(fix) => section.error(
                &word.at,
                format!("{path} has {:?}, which is no level", word.value),
                fix,
            ),
        }
    }
    levels
}
