//! Who asked not to be notified, of what, until when.

use super::Site;
use super::standing::Attention;
use crate::alert::Level;
use crate::monitor::{AlertState, EventKind, KindShown, Order};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::clock::Stopwatch;
use crate::runtime::hook::Alert;
use crate::runtime::mute::Mute;
use crate::runtime::standing::every_since;
use crate::store::StoreError;
use std::time::Duration;

/// Orders in force at most; the oldest goes.
const MOST: usize = 256;
/// Ends of alerts that are kept through a silence at most; the oldest goes.
const MOST_PUT_OFF: usize = 4096;

/// An order, and the time that it has left by a stopwatch: a clock that is set back by less than what counts as wrong does not
/// prolong it.
#[derive(Debug)]
struct TimedMute {
    mute: Mute,
    /// From the first commit after it was given, or after a start.
    left: Option<(Stopwatch, Duration)>,
}

impl TimedMute {
    fn new(mute: Mute) -> Self {
        Self { mute, left: None }
    }

    fn start(&mut self, host_time: Timestamp) {
        let left = self.mute.until.duration_since(host_time);
        self.left
            .get_or_insert_with(|| (Stopwatch::start(), left.try_into().unwrap_or_default()));
    }

    fn is_in_force(&self, host_time: Timestamp) -> bool {
        let has_run_out = |(stopwatch, left): (Stopwatch, Duration)| stopwatch.elapsed() >= left;
        !self.left.is_some_and(has_run_out) && self.mute.is_in_force(host_time)
    }
}

/// Who asked not to be notified, and what waits for that to be over.
#[derive(Debug, Default)]
pub(super) struct Mutes {
    orders: Vec<TimedMute>,
    /// Ends of alerts that people were notified of, which fell into a silence: they are sent after it.
    put_off: Vec<Alert>,
}

impl Mutes {
    /// As the memory has them.
    pub(super) fn remembered(orders: Vec<Mute>, put_off: Vec<Alert>) -> Self {
        let orders = orders.into_iter().map(TimedMute::new).collect();
        Self { orders, put_off }
    }

    /// For the memory: the orders, and the ends that were put off.
    pub(super) fn to_remember(&self) -> (Vec<Mute>, Vec<Alert>) {
        let orders = self.orders.iter().map(|one| one.mute.clone()).collect();
        (orders, self.put_off.clone())
    }

    /// Begins to measure the time that those have left which are new.
    pub(super) fn start(&mut self, host_time: Timestamp) {
        self.orders.iter_mut().for_each(|one| one.start(host_time));
    }

    /// In place of the one of the same kind that there is for the same place: the newest order says how long.
    fn add(&mut self, mute: Mute) {
        let stays = |one: &TimedMute| {
            let one = &one.mute;
            one.benchmark != mute.benchmark || one.up_to.is_some() != mute.up_to.is_some()
        };
        self.orders.retain(stays);
        self.orders.push(TimedMute::new(mute));
        let excess = self.orders.len().saturating_sub(MOST);
        self.orders.drain(..excess);
    }

    /// Ends those of a benchmark, or all of them.
    fn end(&mut self, benchmark: Option<&BenchmarkId>) {
        let stays =
            |one: &TimedMute| benchmark.is_some() && one.mute.benchmark.as_ref() != benchmark;
        self.orders.retain(stays);
    }

    /// Keeps the end of an alert until the silence that it fell into is over.
    pub(super) fn put_off(&mut self, alert: &Alert) {
        self.put_off.push(alert.clone());
        let excess = self.put_off.len().saturating_sub(MOST_PUT_OFF);
        self.put_off.drain(..excess);
    }

    /// What was put off and can be sent while the host's clock says `host_time`.
    pub(super) fn no_longer_put_off(&mut self, host_time: Timestamp) -> Vec<Alert> {
        let all = std::mem::take(&mut self.put_off);
        let (muted, due) = all.into_iter().partition(|one| self.are_of(one, host_time));
        self.put_off = muted;
        due
    }

    /// Whether nobody is to be notified of this alert while the host's clock says `host_time`.
    pub(super) fn are_of(&self, alert: &Alert, host_time: Timestamp) -> bool {
        let place = (alert.event.benchmark.as_ref(), alert.level);
        self.cover(place, |one| one.is_in_force(host_time))
    }

    /// Whether somebody asked not to be notified of it, and that may last still: until the next commit says it by the clock.
    pub(super) fn may_be_of(&self, alert: &Alert) -> bool {
        let place = (alert.event.benchmark.as_ref(), alert.level);
        self.cover(place, |_| true)
    }

    fn cover(
        &self,
        (place, level): (Option<&BenchmarkId>, Level),
        lasts: impl Fn(&TimedMute) -> bool,
    ) -> bool {
        self.orders.iter().any(|one| {
            let mute = &one.mute;
            let here = mute.benchmark.is_none() || mute.benchmark.as_ref() == place;
            let low = mute.up_to.is_none_or(|up_to| level <= up_to);
            here && low && lasts(one)
        })
    }
}

/// Says in the log which of those that stood before stand no more: also one that ran out by itself.
pub(in crate::runtime) fn announce_ends(before: &[Mute], now: &[Mute]) {
    for mute in before.iter().filter(|mute| !now.contains(mute)) {
        let Mute {
            benchmark, until, ..
        } = mute;
        tracing::warn!(
            ?benchmark,
            %until,
            "an order by which alerts were not reported has ended"
        );
    }
}

impl Site {
    /// A red is shelved no longer than a silence may last: the next red, which may be the true one, is not reported either.
    pub(super) fn shorten(&self, order: &mut Order) {
        let Order::Shelve {
            benchmark,
            until,
            given,
        } = order
        else {
            return;
        };
        let latest = given
            .given_at
            .and_then(|at| at.checked_add(Order::LONGEST_SILENCE).ok());
        let is_red = self.level_before(benchmark, &given.called_since) == Level::Red;
        *until = latest
            .filter(|_| is_red)
            .map_or(*until, |latest| latest.min(*until));
    }

    /// Does what people ask for, as far as it concerns who is notified.
    pub(super) fn apply(&mut self, order: &Order) {
        match order {
            Order::Acknowledge {
                benchmark,
                alert,
                given,
            } => {
                let since = &given.called_since;
                let is_seen = |place: &Option<BenchmarkId>, key: &String| match alert {
                    Some(only) => key == only,
                    None => (benchmark.is_none() || place == benchmark) && !since.contains(key),
                };
                for one in self.standing.all_mut() {
                    if !is_seen(&one.alert.event.benchmark, &one.alert.key) {
                        continue;
                    }
                    (one.is_sent, one.was_notified) = (true, true);
                    one.attention = Attention::Acknowledged;
                    if let Some(alerts) = &self.sinks.alerts {
                        alerts.end(&one.alert);
                    }
                }
                if let (None, None) = (benchmark, alert) {
                    self.acknowledge_floods(since);
                }
                self.keep_receipts();
            }
            Order::Shelve {
                benchmark,
                until,
                given,
            } => {
                let level = self.level_before(benchmark, &given.called_since);
                self.mute((Some(benchmark), Some(level)), *until, given.given_at);
            }
            Order::Silence {
                benchmark,
                until,
                given,
            } => self.mute((benchmark.as_ref(), None), *until, given.given_at),
            // The monitor ends it.
            Order::Resolve { .. } => {}
            Order::Unsilence { benchmark, .. } => self.mutes.end(benchmark.as_ref()),
        }
    }

    /// Keys of the alerts at a place, everywhere without one, that were called after event number `last`.
    pub(super) fn called_since(
        &self,
        last: i64,
        place: Option<&BenchmarkId>,
    ) -> Result<Vec<String>, StoreError> {
        let mut called = match &self.sinks.store {
            Some(store) => every_since(store, KindShown::ALERT.name, last)?,
            None => Vec::new(),
        };
        called.extend(self.fresh.iter().map(|alert| alert.event.clone()));
        called.retain(|event| place.is_none() || event.benchmark.as_ref() == place);
        let keys = called.into_iter().filter_map(|event| {
            if let EventKind::Alert {
                state: AlertState::Firing,
                key,
                ..
            } = event.kind
            {
                Some(key)
            } else {
                None
            }
        });
        Ok(keys.filter(|key| self.is_present(key)).collect())
    }

    /// Whether the alert with this key stands, or one that followed on it, or comes now: one that was found in the past does not.
    fn is_present(&self, key: &String) -> bool {
        let stands = |alert: &Alert| {
            alert.key == *key || alert.earlier.iter().any(|earlier| earlier.key == *key)
        };
        self.standing.all().any(|one| stands(&one.alert)) || self.fresh.iter().any(stands)
    }

    /// The level in force at a benchmark before the alerts with the keys `since` were called.
    fn level_before(&self, benchmark: &BenchmarkId, since: &[String]) -> Level {
        if since.is_empty() {
            return self.monitor.level(benchmark).unwrap_or(Level::Green);
        }
        self.standing.level_before(benchmark, since)
    }

    fn mute(
        &mut self,
        (benchmark, up_to): (Option<&BenchmarkId>, Option<Level>),
        until: Timestamp,
        given_at: Option<Timestamp>,
    ) {
        self.mutes.add(Mute {
            benchmark: benchmark.cloned(),
            up_to,
            until,
            given_at,
        });
        self.spare_what_is_muted(benchmark, up_to);
    }

    /// Whoever has an alert shelved or silenced sees to it: it is not escalated. What waits for somebody on duty waits on.
    fn spare_what_is_muted(&self, benchmark: Option<&BenchmarkId>, up_to: Option<Level>) {
        let Some(alerts) = &self.sinks.alerts else {
            return;
        };
        for one in self.standing.all() {
            let is_here = benchmark.is_none() || one.alert.event.benchmark.as_ref() == benchmark;
            if is_here && up_to.is_none_or(|up_to| one.alert.level <= up_to) {
                alerts.spare(&one.alert);
            }
        }
        if benchmark.is_none() {
            self.spare_floods();
        }
        self.keep_receipts();
    }

    fn keep_receipts(&self) {
        if let Some(alerts) = &self.sinks.alerts {
            alerts.commit();
        }
    }

    /// Who is not to be notified of what while the host's clock says `host_time`.
    pub fn mutes(&self, host_time: Timestamp) -> Vec<Mute> {
        let all = self.mutes.orders.iter();
        all.filter(|one| one.is_in_force(host_time))
            .map(|one| one.mute.clone())
            .collect()
    }

    /// Has the hooks wait with what they have in hand where nobody is to be notified of it while the host's clock says `host_time`.
    pub(super) fn mute_what_is_in_hand(&self, host_time: Timestamp) {
        if let Some(alerts) = &self.sinks.alerts {
            alerts.mute(&|place, level| {
                self.mutes
                    .cover((place, level), |one| one.is_in_force(host_time))
            });
        }
    }
}
