//! A crisis as it unfolds: a line for each change of a level, with its reason; then velocity, level and forecast as marks.

use super::marks::{self, MarkScale};
use crate::alert::{Level, Policy, percent_in_words, span_in_words};
use crate::cli::text::plain;
use crate::monitor::{AlertState, Event, EventKind, FailureTime, LevelChance};
use crate::reading::{BenchmarkId, TimeSpan, Timestamp, days_since, figure};
use std::collections::BTreeMap;
use std::fmt::Write;

/// Lines that one crisis may take; what changes beyond is counted.
const MOST_LINES: usize = 12;
/// Marks in a row.
const MARKS: usize = 52;

/// What is printed before the first crisis.
pub(super) fn legend() -> String {
    let policy = Policy::default();
    let percent = |chance: f64| (100.0 * chance).round();
    format!(
        "\
Four archived slopes, replayed through the monitor reading by reading. A line
is printed whenever the level of a measured point changes, with the reason:

  green    nothing to do; every point begins so
  yellow   look closer: collapse within 30 days has a chance of {} % or more, or
           the motion has changed its kind
  orange   prepare: collapse within 30 days has a chance of {} % or more
  red      leave: collapse within twice the time that an evacuation takes, from
           the next reading on, has a chance of {} % or more
  unknown  nothing can be said: no readings, or a sensor at fault

\"74 % in 30 days\" is that chance; the median date is put on the early side: the
chance of a collapse before it may be under one half. A level falls only when
the slope has slowed down or has been steady for long enough.

Below stand, over the same time, from left to right: the velocity, from the
slowest to the fastest (logarithmic); the level (. green, y, o, r); the days
that were left to the collapse by the forecast of that time, from the fewest to
the most (logarithmic), blank where no collapse was likely.",
        percent(policy.yellow_chance),
        percent(policy.orange_chance),
        percent(policy.red_chance)
    )
}

/// What the monitor said with one reading.
#[derive(Debug, Clone, Copy)]
struct DemoMoment {
    time: Timestamp,
    velocity_mm_per_day: Option<f64>,
    within_evacuation: f64,
    /// What red is called by; `None` in states of older versions.
    red: Option<LevelChance>,
    within_outlook: f64,
    /// Of a collapse within 30 days, as it is reported.
    reported: Option<f64>,
    failure: FailureTime,
    level: Level,
}

/// What became of one benchmark.
#[derive(Debug, Clone, Default)]
pub(super) struct DemoRecord {
    pub(super) first: BTreeMap<Level, Timestamp>,
    level: Option<Level>,
    pub(super) forecasts: Vec<(Timestamp, FailureTime)>,
    moments: Vec<DemoMoment>,
    /// The end of a level, before it is known whether a lower one follows.
    fall: Option<Fall>,
}

#[derive(Debug, Clone)]
struct Fall {
    time: Timestamp,
    line: String,
    rule: String,
}

/// Follows the events of one crisis.
#[derive(Debug)]
pub(in crate::cli) struct Timeline {
    lines: usize,
    left_out: usize,
    pub(super) records: BTreeMap<BenchmarkId, DemoRecord>,
}

impl Timeline {
    pub(in crate::cli) fn new() -> Self {
        Self {
            lines: 0,
            left_out: 0,
            records: BTreeMap::new(),
        }
    }

    /// The line for an event that changes a level.
    pub(in crate::cli) fn take(&mut self, event: &Event) -> Option<String> {
        let id = event.benchmark.as_ref()?;
        let record = self.records.entry(id.clone()).or_default();
        if let EventKind::Refit {
            failure_time,
            velocity_mm_per_day,
            chance_within_evacuation_time,
            chance_within_outlook,
            chances_of_collapse,
            called,
            ..
        } = &event.kind
        {
            record.forecasts.push((event.time, *failure_time));
            record.moments.push(DemoMoment {
                time: event.time,
                velocity_mm_per_day: *velocity_mm_per_day,
                within_evacuation: *chance_within_evacuation_time,
                red: called.as_ref().map(|called| called.red),
                within_outlook: *chance_within_outlook,
                reported: chances_of_collapse
                    .as_deref()
                    .map(|chances| chances.within_30_days),
                failure: *failure_time,
                level: record.level.unwrap_or(Level::Green),
            });
            return None;
        }
        let EventKind::Alert {
            level, state, rule, ..
        } = &event.kind
        else {
            return None;
        };
        let fall = record.fall.take();
        if *level == Level::Unknown && *state == AlertState::Resolved {
            let stays = record.level.unwrap_or(Level::Green);
            let line = format!(
                "{} {:<8} {:<8} there are readings again: no longer unknown",
                day(event.time),
                id.as_str(),
                stays.name()
            );
            return self.counted([fall.map(|fall| fall.line), Some(line)]);
        }
        let shown = record.changed(*level, *state, event.time);
        let place = format!("{} {:<8}", day(event.time), id.as_str());
        if *state == AlertState::Resolved {
            // Where a lower level holds from now on, the next event says so.
            record.fall = shown.map(|level| Fall {
                time: event.time,
                line: format!("{place} {:<8} {}", level.name(), words(rule)),
                rule: rule.clone(),
            });
            return self.counted([fall.map(|fall| fall.line)]);
        }
        let (before, reason) = match fall {
            Some(fall) if fall.time == event.time => (None, words(&fall.rule)),
            other => {
                let reason = reason(rule, record.moments.last());
                (other.map(|fall| fall.line), reason)
            }
        };
        let line = shown.map(|level| format!("{place} {:<8} {reason}", level.name()));
        self.counted([before, line].into_iter().flatten().map(Some))
    }

    /// As many of these lines as may still be printed.
    fn counted(&mut self, lines: impl IntoIterator<Item = Option<String>>) -> Option<String> {
        let mut kept = Vec::new();
        for line in lines.into_iter().flatten() {
            if self.lines < MOST_LINES {
                self.lines += 1;
                kept.push(line);
            } else {
                self.left_out += 1;
            }
        }
        (!kept.is_empty()).then(|| kept.join("\n"))
    }

    /// Velocity, level and forecast of each benchmark.
    pub(super) fn pictures(&mut self) -> String {
        let falls = self
            .records
            .values_mut()
            .filter_map(|record| record.fall.take());
        let falls: Vec<Option<String>> = falls.map(|fall| Some(fall.line)).collect();
        let mut text = self
            .counted(falls)
            .map_or_else(String::new, |lines| lines + "\n");
        if self.left_out > 0 {
            let _ = writeln!(text, "and {} more changes of a level", self.left_out);
        }
        text + &self.bands()
    }

    /// The same without the changes that no line was printed of.
    pub(in crate::cli) fn bands(&self) -> String {
        let mut text = String::new();
        for (id, record) in &self.records {
            record.picture(&mut text, id);
        }
        text
    }
}

impl DemoRecord {
    /// The level after an alert, where it is another or nothing can be said.
    fn changed(&mut self, level: Level, state: AlertState, time: Timestamp) -> Option<Level> {
        let shown = match state {
            AlertState::Firing if level == Level::Unknown => return Some(level),
            AlertState::Firing => {
                self.first.entry(level).or_insert(time);
                self.level = Some(level);
                level
            }
            AlertState::Resolved if self.level == Some(level) => {
                self.level = None;
                Level::Green
            }
            AlertState::Resolved => return None,
        };
        if let Some(moment) = self.moments.last_mut().filter(|moment| moment.time == time) {
            moment.level = shown;
        }
        Some(shown)
    }

    fn picture(&self, text: &mut String, id: &BenchmarkId) {
        let (Some(first), Some(last)) = (self.moments.first(), self.moments.last()) else {
            return;
        };
        let span = TimeSpan::new(first.time, last.time);
        let over = |values: &dyn Fn(&DemoMoment) -> Option<f64>| {
            let points = self
                .moments
                .iter()
                .filter_map(|one| Some((one.time, values(one)?)));
            MarkScale::of(points.collect(), span, MARKS)
        };
        let velocity = over(&|one| one.velocity_mm_per_day.filter(|v| *v > 0.0));
        let left = over(&|one| {
            let left = days_since(one.time, one.failure.median?);
            (left > 0.0).then_some(left)
        });
        let levels = marks::levels(
            self.moments.iter().map(|one| (one.time, one.level)),
            span,
            MARKS,
        );
        let (from, to) = (day(first.time), day(last.time));
        let _ = writeln!(text, "\n{:<8} {from} to {to}", plain(id.as_str()));
        let _ = writeln!(
            text,
            "velocity  {}  {} mm/day",
            velocity.marks,
            velocity.ends()
        );
        let _ = writeln!(text, "level     {levels}");
        let _ = writeln!(text, "forecast  {}  {} days", left.marks, left.ends());
    }
}

/// Why a level was called: the velocity, and the chance that passed a threshold, or the rule in words.
fn reason(rule: &str, moment: Option<&DemoMoment>) -> String {
    let Some(moment) = moment.filter(|_| rule != "no-data") else {
        return words(rule);
    };
    let velocity = moment
        .velocity_mm_per_day
        .map_or_else(String::new, |v| format!("{} mm/day; ", figure(v, 1)));
    let median = moment
        .failure
        .median
        .map_or_else(String::new, |time| format!("; median {}", day(time)));
    let why = match rule {
        "chance-within-outlook" => {
            let chance = percent_in_words(moment.within_outlook);
            format!("{chance} in 30 days{median}")
        }
        "reported-chance" => {
            let chance = moment.reported.map_or_else(String::new, percent_in_words);
            format!("{chance} in 30 days; levels count less")
        }
        "chance-within-evacuation-time" => {
            let (chance, span) = moment.red.map_or_else(
                || (moment.within_evacuation, "time".to_owned()),
                |red| (red.chance, span_in_words(red.within())),
            );
            format!("{} in {span}{median}", percent_in_words(chance))
        }
        other => words(other),
    };
    velocity + &why
}

/// A rule in words.
fn words(rule: &str) -> String {
    match rule {
        "critical-velocity" => "faster than the critical 1 m/day",
        "decelerated" => "it has slowed down",
        "steady" | "quiet" => "steady for long enough",
        "regime-flip" => "an unstable acceleration has begun",
        "intercept-drifting-in" => "the forecast date moves nearer",
        "transition-drifting-in" => "the inflection of the velocity moves nearer",
        "unexplained-residual" => "readings leave the law, cause unknown",
        "no-data" => "no reading when one was due",
        other => return other.replace('-', " "),
    }
    .to_owned()
}

/// The date alone.
pub(super) fn day(time: Timestamp) -> String {
    time.strftime("%Y-%m-%d").to_string()
}
