//! Many alerts at once: the most severe are sent singly, the others are reported in one message.
//!
//! EEMUA 191 calls ten alarms in ten minutes a flood: beyond that nobody can act on them one by one. Whoever received the beginning
//! of an alert singly receives its end by the same key, however many end at once.

use crate::alert::Level;
use crate::monitor::{AlertState, Event, EventKind};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::hook::{Alert, FLOOD, MessageState, state_name};
use crate::runtime::many::{FloodMember, ManyAlerts};
use fnv::FnvHasher;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{Hash, Hasher as _};

/// Alerts of one level and state that go out singly in one commit.
const MOST_AT_ONCE: usize = 10;
/// Benchmarks that one message names.
const NAMED: usize = 20;

/// What becomes of the alerts of one commit that a hook is to receive.
#[derive(Debug, Default)]
pub(super) struct OutgoingAlerts {
    /// The hook is given these.
    pub(super) sent: Vec<Alert>,
    /// One of those reports these.
    pub(super) reported_together: Vec<Alert>,
}

impl OutgoingAlerts {
    /// All of `alerts`, in their order, or of each level and state the first ten by forecast time of failure and one
    /// that stands for the others. `audience`: the benchmarks that the hook asks for, none where it asks for all.
    pub(super) fn of(alerts: &[Alert], audience: &BTreeSet<BenchmarkId>) -> Self {
        let mut outgoing = Self::default();
        let mut groups: BTreeMap<(Level, &str), Vec<&Alert>> = BTreeMap::new();
        // The end of a flood stands for many already.
        let is_single = |alert: &&Alert| alert.is_flood() || alert.state == MessageState::Resolved;
        for alert in alerts.iter().filter(|alert| !is_single(alert)) {
            let group = (alert.level, state_name(alert.state));
            groups.entry(group).or_default().push(alert);
        }
        if groups.values().all(|group| group.len() <= MOST_AT_ONCE + 1) {
            alerts.clone_into(&mut outgoing.sent);
            return outgoing;
        }
        outgoing
            .sent
            .extend(alerts.iter().filter(is_single).cloned());
        // The most severe level first.
        for mut group in groups.into_values().rev() {
            if group.len() > MOST_AT_ONCE + 1 {
                group.sort_by_key(|alert| (alert.failure_time.is_none(), alert.failure_time));
                let others = group.split_off(MOST_AT_ONCE);
                outgoing.sent.extend(group.into_iter().cloned());
                outgoing.sent.extend(together(&others, audience));
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
fn together(others: &[&Alert], audience: &BTreeSet<BenchmarkId>) -> Option<Alert> {
    let first = *others.first()?;
    let time = others.iter().map(|alert| alert.event.time).max()?;
    let members = others.iter().map(|alert| FloodMember {
        benchmark: alert.event.benchmark.clone(),
        key: alert.key.clone(),
    });
    let many = ManyAlerts {
        audience: audience.clone(),
        members: members.collect(),
    };
    let (count, level) = (others.len(), first.level);
    let (named, rest) = names(&many.members);
    // Hooks that ask for different benchmarks may have the same first one, not the same members.
    let mut hasher = FnvHasher::default();
    (others.iter().map(|alert| &alert.key)).for_each(|key| key.hash(&mut hasher));
    let key = format!("{FLOOD}/{:08x}/{}", hasher.finish() >> 32, first.key);
    let alert = |state: AlertState, what: &str| EventKind::Alert {
        level,
        state,
        key: key.clone(),
        rule: FLOOD.to_owned(),
        text: format!("{count} more benchmarks {what} {level}: {named}{rest}"),
    };
    let kind = match first.state {
        MessageState::Firing => alert(AlertState::Firing, "at"),
        // No ends are reported together but those of what began so.
        MessageState::Resolved => return None,
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
        earlier: (others.iter().flat_map(|alert| alert.earlier.clone())).collect(),
        many: Some(many),
        ..first.clone()
    })
}

/// The first benchmarks of `members`, and how many more there are.
fn names(members: &[FloodMember]) -> (String, String) {
    let named: Vec<&str> = (members.iter().take(NAMED))
        .filter_map(|one| Some(one.benchmark.as_ref()?.as_str()))
        .collect();
    let rest = match members.len().saturating_sub(named.len()) {
        0 => String::new(),
        rest => format!(" and {rest} more"),
    };
    (named.join(", "), rest)
}

/// The end of what `flood` has reported, at `time`, by the same key.
pub(super) fn end(flood: &Alert, time: Timestamp) -> Alert {
    let members = flood.many.as_ref().map_or(&[][..], |many| &many.members);
    let ((named, rest), count, level) = (names(members), members.len(), flood.level);
    let mut end = flood.clone();
    end.state = MessageState::Resolved;
    end.called = Some(flood.event.time);
    end.event.time = time.max(flood.event.time);
    end.event.kind = EventKind::Alert {
        level,
        state: AlertState::Resolved,
        key: flood.key.clone(),
        rule: FLOOD.to_owned(),
        text: format!("{count} more benchmarks no longer at {level}: {named}{rest}"),
    };
    end
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
