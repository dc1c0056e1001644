//! Events as lines for people.

use crate::monitor::{Event, EventKind};
use crate::reading::{Timestamp, minute};
pub(super) use crate::reading::{clock, local, plain};
use jiff::tz::TimeZone;
use textwrap::{Options, WordSplitter};

/// One event on one line: when, where, what, by the clocks of `zone`.
pub(super) fn line(event: &Event, zone: &TimeZone) -> String {
    let place = event.benchmark.as_ref().map_or("site", |id| id.as_str());
    let (time, sentence) = (minute(event.time), event.kind.sentence());
    let text = format!("{time}  {place}  {sentence}{}", ordered(event));
    local(&plain(&text), zone)
}

/// By which way an order came, and when by the host's clock: its event has the time of the newest reading.
fn ordered(event: &Event) -> String {
    let EventKind::Order { given, .. } = &event.kind else {
        return String::new();
    };
    let door = (given.door).map_or_else(String::new, |door| format!(", over {}", door.name()));
    let at = given
        .given_at
        .map_or_else(String::new, |at| format!(", given at {}", minute(at)));
    format!("{door}{at}")
}

/// A line on as many lines of at most `columns` columns as its words need; those after the first begin with `indent`.
pub(super) fn wrapped(line: &str, columns: usize, indent: &str) -> String {
    let options = Options::new(columns).subsequent_indent(indent);
    textwrap::fill(line, options.word_splitter(WordSplitter::NoHyphenation))
}

/// The events, a line each, under a title; nothing where there are none.
pub(super) fn listed(title: &str, events: &[Event], zone: &TimeZone) -> String {
    if events.is_empty() {
        return String::new();
    }
    let lines = events.iter().map(|event| line(event, zone) + "\n");
    format!("\n{title}:\n{}", lines.collect::<String>())
}

/// Alerts that have ended and that nobody has acknowledged, each with the time of its end; nothing where there are none.
pub(super) fn returned<'a>(
    ended: impl Iterator<Item = (&'a Event, &'a Timestamp)>,
    zone: &TimeZone,
) -> String {
    let lines = ended.filter_map(|(event, ended)| {
        let EventKind::Alert { level, text, .. } = &event.kind else {
            return None;
        };
        let place = event.benchmark.as_ref().map_or("site", |id| id.as_str());
        let (from, to) = (clock(event.time, zone), clock(*ended, zone));
        let (place, text) = (plain(place), local(&plain(text), zone));
        Some(format!("{from}  {place}  {level}, ended {to}: {text}\n"))
    });
    let lines: String = lines.collect();
    if lines.is_empty() {
        return lines;
    }
    format!("\nended, not acknowledged:\n{lines}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::alert::Level;
    use crate::monitor::AlertState;
    use crate::reading::BenchmarkId;

    #[test]
    fn an_alert_that_has_ended_is_shown_with_both_its_times_by_the_clocks_of_the_zone() {
        let rome = TimeZone::get("Europe/Rome").unwrap();
        let event = Event {
            time: "2017-06-05T01:00:00Z".parse().unwrap(),
            benchmark: Some(BenchmarkId::new("N3")),
            kind: EventKind::Alert {
                level: Level::Yellow,
                state: AlertState::Firing,
                key: "N3/yellow/2017-06-05T01:00:00Z".to_owned(),
                rule: "chance-within-outlook".to_owned(),
                text: "benchmark N3: yellow; chance of collapse 31 % within 30 days".to_owned(),
            },
        };
        let ended: Timestamp = "2017-06-07T10:00:00Z".parse().unwrap();
        let shown = returned([(&event, &ended)].into_iter(), &rome);
        assert!(
            shown.contains("2017-06-05 03:00 CEST  N3  yellow, ended 2017-06-07 12:00 CEST: "),
            "{shown}"
        );
        assert_eq!(returned([].into_iter(), &rome), "");
    }
}
