//! The commit: what has happened is made durable, then the hooks are notified.

use super::flood::OutgoingAlerts;
use super::standing::Attention;
use super::{BEFORE_ALL, LEAST_FRESHNESS, LEAST_WATCHED, MOST_UNWRITTEN, Site};
use crate::alert::{Level, Policy};
use crate::config::HookConfig;
use crate::monitor::Event;
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::deliver::Dispatcher;
use crate::runtime::delivered::delivery;
use crate::runtime::hook::Alert;
use crate::store::StoreError;
use jiff::SignedDuration;
use std::time::Duration;

impl Site {
    /// Makes everything since the last commit durable in one transaction, then hands the alerts to the hooks, but
    /// for what began longer before `host_time` than twice the evacuation time: of that, [`Site::caught_up`] sends what
    /// is still in force. Of the end of what they were notified of they are notified however long ago it was.
    ///
    /// On a full disk everything waits for the next commit, and the hooks are notified all the same: an alert may then
    /// come twice after a crash, with the same key.
    ///
    /// # Errors
    /// When it cannot be made durable for another reason; the alerts have gone out all the same.
    pub fn commit(&mut self, host_time: Timestamp) -> Result<(), StoreError> {
        let now = self.keeper.now(host_time);
        let mut to_send = Vec::new();
        for mut alert in std::mem::take(&mut self.fresh) {
            let age = now.duration_since(alert.event.time);
            if alert.event.time <= BEFORE_ALL {
                // Before the first reading there is no data time: people are given the time of the decision.
                alert.event.time = now;
            }
            self.standing.date_end(&mut alert);
            self.standing.follow_on(&mut alert);
            let is_fresh =
                age <= self.freshness(alert.event.benchmark.as_ref()) || self.never_read(&alert);
            let is_waited_for = self.standing.is_waited_for(&alert);
            let is_due = is_fresh && !self.standing.ends_unreported(&alert) || is_waited_for;
            let is_muted = self.mutes.are_of(&alert, host_time);
            let is_sent = is_due && !is_muted;
            if alert.is_correction() {
                to_send.extend(is_sent.then_some(alert));
                continue;
            }
            if is_muted && is_waited_for {
                self.mutes.put_off(&alert);
            }
            if is_sent {
                to_send.push(alert.clone());
            } else {
                // The whole site's repeats those of its benchmarks.
                self.counts.long_past += u64::from(alert.event.benchmark.is_some());
                if let Some(alerts) = &self.sinks.alerts {
                    alerts.supersede(&alert);
                }
            }
            self.standing.stand(alert, is_sent);
        }
        for end in self.ended_floods(now) {
            if self.mutes.are_of(&end, host_time) {
                self.mutes.put_off(&end);
            } else {
                to_send.push(end);
            }
        }
        self.mutes.start(host_time);
        self.mute_what_is_in_hand(host_time);
        self.repeat_what_is_in_force();
        self.record_and_send(&to_send)
    }

    fn repeat_what_is_in_force(&self) {
        let standing = &self.standing;
        if let Some(alerts) = &self.sinks.alerts {
            alerts.repeat(|| {
                let floods = standing.floods().map(|flood| &flood.alert);
                Box::new(standing.all().map(|one| &one.alert).chain(floods))
            });
        }
    }

    fn record_and_send(&mut self, alerts: &[Alert]) -> Result<(), StoreError> {
        let shares = self.sinks.alerts.as_ref();
        let shares = shares.map_or_else(Vec::new, |dispatcher| dispatcher.shares(alerts));
        let mut to_offer = Vec::new();
        for share in shares {
            let OutgoingAlerts {
                sent,
                reported_together,
            } = OutgoingAlerts::of(&share.alerts, &share.audience);
            for alert in &sent {
                self.standing.stand_for_many(alert);
                if self.sinks.store.is_some() {
                    self.batch.deliver(delivery(alert, &share.name)?);
                }
            }
            for alert in reported_together.iter().chain(&share.reported) {
                self.note_reported_together(alert, &share.name)?;
            }
            to_offer.push((share.place, sent));
        }
        let recorded = self.record();
        if let Some(dispatcher) = &self.sinks.alerts {
            for alert in alerts {
                dispatcher.supersede(alert);
            }
            for (place, sent) in to_offer {
                dispatcher.offer_share(place, &sent);
            }
            dispatcher.commit();
        }
        recorded
    }

    /// Notes that an alert of many benchmarks reports this one to a hook too.
    fn note_reported_together(&mut self, alert: &Alert, hook: &str) -> Result<(), StoreError> {
        self.standing.note_reported_together(alert);
        if self.sinks.store.is_some() {
            self.batch.deliver_together(delivery(alert, hook)?);
        }
        Ok(())
    }

    /// Writes the batch; where there is no room it is kept for the next time.
    fn record(&mut self) -> Result<(), StoreError> {
        let Some(store) = self.sinks.store.clone() else {
            return Ok(());
        };
        let memory = self.memory();
        let saves = memory.is_some();
        self.batch.memory(memory);
        match store.commit(&self.batch) {
            Ok(()) => {
                if std::mem::take(&mut self.is_full) {
                    let steps = self.batch.steps();
                    tracing::info!(steps, "there is room on the disk again");
                }
                self.batch.clear();
                if saves {
                    self.monitor.mark_saved();
                    self.steps_since_memory = 0;
                }
                Ok(())
            }
            Err(error) if error.is_full() => {
                if !std::mem::replace(&mut self.is_full, true) {
                    let waiting = self.batch.steps();
                    tracing::error!(%error, waiting, "no room on the disk: what was taken in waits unacknowledged");
                }
                Ok(())
            }
            Err(error) => Err(error),
        }
    }

    /// Steps that wait for room on the disk.
    pub fn unwritten(&self) -> u64 {
        if self.is_full {
            self.batch.steps() as u64
        } else {
            0
        }
    }

    /// Steps since the last commit.
    pub(in crate::runtime) fn uncommitted(&self) -> usize {
        self.batch.steps()
    }

    /// Searches that are at work.
    pub fn searching(&self) -> usize {
        self.searches.jobs().count()
    }

    /// Whether anything waits for room on the disk.
    pub fn is_waiting(&self) -> bool {
        self.is_full
    }

    /// Notifies `hooks` from here on, first what some hook has not taken yet; those that are in the config already go on. Where
    /// `is_reread`, each is set up anew; one that is left out ends what it runs within `limit`.
    ///
    /// # Errors
    /// When the state cannot be read.
    pub fn change_hooks(
        &mut self,
        hooks: &[HookConfig],
        is_reread: bool,
        limit: Duration,
    ) -> Result<(), StoreError> {
        if let Some(alerts) = &mut self.sinks.alerts {
            alerts.change_hooks(hooks, is_reread, limit);
        }
        self.wait_for_hooks()
    }

    /// Offers the hooks again what found no room, ends too, once there is some: as the state has it.
    ///
    /// # Errors
    /// When the state cannot be read.
    pub fn offer_refused(&mut self) -> Result<(), StoreError> {
        let alerts = self.sinks.alerts.as_ref();
        // What is not written yet cannot be read there.
        if !self.is_full && alerts.is_some_and(Dispatcher::finds_room) {
            tracing::info!("what a hook had no room for is offered again");
            self.wait_for_hooks()?;
        }
        Ok(())
    }

    /// Whether so much waits for room on the disk that nothing more is to be taken in.
    pub fn is_stalled(&self) -> bool {
        self.is_full && self.batch.steps() >= MOST_UNWRITTEN || self.holds_too_many()
    }

    /// Whether it says that a benchmark has given no reading: that is never long past.
    fn never_read(&self, alert: &Alert) -> bool {
        let benchmark = alert.event.benchmark.as_ref();
        alert.level == Level::Unknown
            && benchmark.is_some_and(|one| self.read.newest(one).is_none())
    }

    /// Everything there is has been read: what is in force and was not sent because it began long
    /// ago goes out, however long ago that was.
    ///
    /// Only a benchmark that nobody watches any more is spared. Its newest reading is older than
    /// 30 days, the outlook and twice the evacuation time, whichever is the longest: an archive.
    /// Readings that merely stop do not make an alert past; silence is not safety.
    ///
    /// # Errors
    /// As [`Site::commit`].
    pub fn caught_up(&mut self, host_time: Timestamp) -> Result<Vec<Event>, StoreError> {
        let events = self.rest(host_time);
        if !events.is_empty() {
            self.commit(host_time)?;
        }
        let now = self.keeper.now(host_time);
        let mut to_send = self.mutes.no_longer_put_off(host_time);
        let mut standing = std::mem::take(&mut self.standing);
        for one in standing.all_mut() {
            if one.is_sent {
                // Again: there may have been no room for it. The hooks that have it ignore it.
                // Nor does one that was reported together go singly to those who received that.
                if one.alert.must_arrive()
                    && one.attention == Attention::Awaited
                    && !self.mutes.are_of(&one.alert, host_time)
                {
                    let together = one.is_reported_together;
                    self.send_where(&one.alert, false, &|hook| {
                        !together || !hook.benchmarks.is_empty()
                    });
                }
            } else if (self.never_read(&one.alert)
                || self.is_watched(one.alert.event.benchmark.as_ref(), now))
                && !self.mutes.are_of(&one.alert, host_time)
            {
                if one.alert.event.time <= BEFORE_ALL {
                    one.alert.event.time = now;
                }
                to_send.push(one.alert.clone());
                (one.is_sent, one.was_notified) = (true, true);
                let counted = u64::from(one.alert.event.benchmark.is_some());
                self.counts.long_past = self.counts.long_past.saturating_sub(counted);
            }
        }
        self.standing = standing;
        self.offer_floods_again(host_time);
        if !to_send.is_empty() {
            self.record_and_send(&to_send)?;
        }
        Ok(events)
    }

    /// Whether something has been called that people are to be notified of at once.
    pub fn is_urgent(&self, host_time: Timestamp) -> bool {
        let now = self.keeper.now(host_time);
        self.fresh.iter().any(|alert| {
            let age = now.duration_since(alert.event.time);
            alert.must_arrive() && age <= self.freshness(alert.event.benchmark.as_ref())
        })
    }

    fn is_watched(&self, benchmark: Option<&BenchmarkId>, host_time: Timestamp) -> bool {
        let newest = match benchmark {
            Some(benchmark) => self.read.newest(benchmark),
            None => self.read.newest_of_all(),
        };
        let limit = (self.freshness(benchmark))
            .max(self.policy(benchmark).outlook)
            .max(LEAST_WATCHED);
        newest.is_some_and(|newest| host_time.duration_since(newest) <= limit)
    }

    /// Offers it to those of the hooks that are `meant`; they wait with it while it `is_muted`.
    pub(super) fn send_where(
        &self,
        alert: &Alert,
        is_muted: bool,
        meant: &dyn Fn(&HookConfig) -> bool,
    ) {
        if let Some(alerts) = &self.sinks.alerts {
            alerts.offer_where(alert, is_muted, meant);
        }
    }

    fn freshness(&self, benchmark: Option<&BenchmarkId>) -> SignedDuration {
        (self.policy(benchmark).evacuation_time)
            .checked_mul(2)
            .unwrap_or(SignedDuration::MAX)
            .max(LEAST_FRESHNESS)
    }

    fn policy(&self, benchmark: Option<&BenchmarkId>) -> &Policy {
        benchmark.map_or(&self.settings.policy, |one| self.settings.policy(one))
    }
}
