//! Many alerts at once: the most severe are sent singly, the others are reported in one message.
//!
//! EEMUA 191 calls ten alarms in ten minutes a flood: beyond that nobody can act on them one by one.

use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind};
use crate::runtime::hook::{Alert, FLOOD, MessageState, state_name};
use std::collections::BTreeMap;

/// Alerts of one level and state that go out singly in one commit.
const MOST_AT_ONCE: usize = 10;
/// Benchmarks that one message names.
const NAMED: usize = 20;

/// What becomes of the alerts of one commit.
#[derive(Debug, Default)]
pub(super) struct OutgoingAlerts {
    /// The hooks are given these.
    pub(super) sent: Vec<Alert>,
    /// One of those reports these.
    pub(super) reported_together: Vec<Alert>,
}

impl OutgoingAlerts {
    /// All of `alerts`, in their order, or of each level and state the first ten by forecast time of failure and one
    /// that stands for the others.
    pub(super) fn of(alerts: &[Alert]) -> Self {
        let mut outgoing = Self::default();
        let mut groups: BTreeMap<(Level, &str), Vec<&Alert>> = BTreeMap::new();
        for alert in alerts {
            let group = (alert.level, state_name(alert.state));
            groups.entry(group).or_default().push(alert);
        }
        if groups.values().all(|group| group.len() <= MOST_AT_ONCE + 1) {
            alerts.clone_into(&mut outgoing.sent);
            return outgoing;
        }
        // The most severe level first.
        for mut group in groups.into_values().rev() {
            if group.len() > MOST_AT_ONCE + 1 {
                group.sort_by_key(|alert| (alert.failure_time.is_none(), alert.failure_time));
                let others = group.split_off(MOST_AT_ONCE);
                outgoing.sent.extend(group.into_iter().cloned());
                outgoing.sent.extend(together(&others));
                outgoing
                    .reported_together
                    .extend(others.into_iter().cloned());
            } else {
                outgoing.sent.extend(group.into_iter().cloned());
            }
        }
        outgoing
    }
}

/// The alert that stands for `others`, which are of one level and state; `None` where there are none.
fn together(others: &[&Alert]) -> Option<Alert> {
    let first = *others.first()?;
    let time = others.iter().map(|alert| alert.event.time).max()?;
    let named: Vec<&str> = (others.iter().take(NAMED))
        .filter_map(|alert| Some(alert.event.benchmark.as_ref()?.as_str()))
        .collect();
    let rest = match others.len().saturating_sub(named.len()) {
        0 => String::new(),
        rest => format!(" and {rest} more"),
    };
    let (count, level, named) = (others.len(), first.level, named.join(", "));
    // That of the first is no other's.
    let key = format!("{FLOOD}/{}", first.key);
    let alert = |state: AlertState, what: &str| EventKind::Alert {
        level,
        state,
        key: key.clone(),
        rule: FLOOD.to_owned(),
        text: format!("{count} more benchmarks {what} {level}: {named}{rest}"),
    };
    let kind = match first.state {
        MessageState::Firing => alert(AlertState::Firing, "at"),
        MessageState::Resolved => alert(AlertState::Resolved, "no longer at"),
        MessageState::Correction => corrections(others, |level_then| {
            format!(
                "{count} more benchmarks: with the readings that came late or were corrected, {level} would have been \
                 called; the highest level that was in force is {level_then}: {named}{rest}"
            )
        })?,
    };
    Some(Alert {
        event: Event {
            time,
            benchmark: None,
            kind,
        },
        key,
        failure_time: others.iter().filter_map(|alert| alert.failure_time).min(),
        ..first.clone()
    })
}

/// The event of all `others`, which are corrections of one level; `text` is given the highest level that was in force.
fn corrections(others: &[&Alert], text: impl Fn(Level) -> String) -> Option<EventKind> {
    let each = others.iter().filter_map(|alert| {
        let EventKind::Correction {
            since,
            level_then,
            level_now,
            alerts,
            ..
        } = &alert.event.kind
        else {
            return None;
        };
        Some((*since, *level_then, *level_now, alerts))
    });
    let level_then = each.clone().map(|(_, then, ..)| then).max()?;
    Some(EventKind::Correction {
        since: each.clone().map(|(since, ..)| since).min()?,
        level_then,
        level_now: each.clone().map(|(_, _, now, _)| now).max()?,
        alerts: each.flat_map(|(.., alerts)| alerts.clone()).collect(),
        text: text(level_then),
    })
}
