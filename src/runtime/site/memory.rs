//! What a restart goes on from: the memory last saved, and the steps since.

use super::mutes::Mutes;
use super::read_times::ReadTimes;
use super::standing::{AlertInForce, AlertPlace, Attention, StandingAlerts};
use super::{
    BEFORE_ALL, Counts, OWN, STEPS_A_BENCHMARK, STEPS_A_MEMORY, STEPS_UNJUDGED, Sinks, Site,
};
use crate::alert::Level;
use crate::monitor::{
    AlertState, EventKind, Input, KindShown, MemoryPart, Monitor, Notice, SavedError, SearchJob,
    Settings, from_bytes,
};
use crate::reading::{BenchmarkId, Timestamp};
use crate::runtime::delivered::delivery;
use crate::runtime::hook::{Alert, MessageState};
use crate::runtime::mute::Mute;
use crate::runtime::standing::every;
use crate::runtime::vitals::Vitals;
use crate::store::{Delivery, DeliveryOutcome, Recorded, Store, StoreError};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Taking a piece of the past again, of sixteen refits, takes as long as so many readings.
const STEPS_A_PIECE_OF_PAST: usize = 50;

/// What the site remembers beside the monitor.
#[derive(Debug, Serialize, Deserialize)]
struct SiteMemory {
    asked: Vec<SearchJob>,
    now: Option<Timestamp>,
    newest: BTreeMap<BenchmarkId, Timestamp>,
    #[serde(default)]
    ahead: BTreeMap<BenchmarkId, Timestamp>,
    #[serde(default)]
    read_anew: BTreeMap<BenchmarkId, i64>,
    failure_times: BTreeMap<Option<BenchmarkId>, Timestamp>,
    standing: Vec<(AlertPlace, AlertInForce)>,
    mutes: Vec<Mute>,
    #[serde(default)]
    put_off: Vec<Alert>,
    counts: Counts,
}

impl Site {
    /// The site as its state has it: as if it had never stopped, but for settings that are others now. `turn` is called
    /// now and then on the way, and may break it off: `None` then, and nothing has changed.
    ///
    /// # Errors
    /// When the state cannot be read.
    pub fn resume(
        name: &str,
        settings: Settings,
        sinks: Sinks,
        turn: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<Option<Self>, StoreError> {
        let Some(store) = sinks.store.clone() else {
            return Ok(Some(Self::new(name, settings, sinks)));
        };
        let mut site = Self::new(name, Settings::default(), sinks);
        let recorded = store.memory()?;
        let mut step = recorded.step;
        if step > 0
            && let Err(error) = site.remember(&recorded)
        {
            tracing::warn!(%error, "the saved state cannot be used: all stored readings are judged again");
            step = 0;
        }
        // What was sent, or called off, stands in the outbox.
        let alerts = site.sinks.alerts.take();
        if site.catch_up(&store, step, turn)?.is_break() {
            return Ok(None);
        }
        site.sinks.alerts = alerts;
        site.recall_floods(&store)?;
        // What people ordered meanwhile: no hook is to be tried first with what they have acknowledged, silenced or ended.
        for order in store.orders()? {
            site.order(order)?;
        }
        site.wait_for_hooks()?;
        if *site.monitor.settings() != settings || store.last_step() == 0 {
            site.change_settings(settings);
        }
        site.begin();
        Ok(Some(site))
    }

    /// Shows how the benchmarks stand.
    pub fn show(&self, vitals: &Vitals) {
        for (benchmark, newest) in self.read.each() {
            let level = self.monitor.level(benchmark).unwrap_or(Level::Green);
            let is_unknown = self.monitor.is_unknown(benchmark);
            vitals.resume(benchmark, Some(newest), level, is_unknown);
        }
        for benchmark in &self.monitor.settings().watched.named {
            if self.read.newest(benchmark).is_none() {
                let is_unknown = self.monitor.is_unknown(benchmark);
                vitals.resume(benchmark, None, Level::Green, is_unknown);
            }
        }
    }

    /// Whether it is one of those that [`Site::show`] shows.
    pub(in crate::runtime) fn shows(&self, benchmark: &BenchmarkId) -> bool {
        let named = &self.monitor.settings().watched.named;
        self.read.newest(benchmark).is_some() || named.contains(benchmark)
    }

    fn remember(&mut self, recorded: &Recorded) -> Result<(), SavedError> {
        let (own, parts): (Vec<MemoryPart>, Vec<MemoryPart>) = recorded
            .parts
            .iter()
            .cloned()
            .partition(|part| part.name == OWN);
        let body = own
            .into_iter()
            .find_map(|part| part.body)
            .ok_or(SavedError::Incomplete)?;
        let own: SiteMemory = from_bytes(&body).map_err(|source| SavedError::Unreadable {
            name: "site".to_owned(),
            source,
        })?;
        self.monitor = Monitor::restore(&parts)?;
        own.asked
            .into_iter()
            .for_each(|job| self.searches.note(job));
        self.now = own.now;
        self.read = ReadTimes::remembered((own.newest, own.ahead, own.read_anew));
        self.failure_times = own.failure_times;
        self.standing = StandingAlerts::remembered(own.standing);
        self.mutes = Mutes::remembered(own.mutes, own.put_off);
        self.counts = own.counts;
        Ok(())
    }

    /// Takes the steps after number `after` again; all of it stands in the state already.
    fn catch_up(
        &mut self,
        store: &Arc<Store>,
        mut after: i64,
        turn: &mut dyn FnMut() -> ControlFlow<()>,
    ) -> Result<ControlFlow<()>, StoreError> {
        let from = after;
        loop {
            let rows = store.steps(after)?;
            let Some(last) = rows.last() else { break };
            after = last.seq;
            for row in &rows {
                if turn().is_break() {
                    return Ok(ControlFlow::Break(()));
                }
                if let Input::Found(finding) = &row.input {
                    self.searches.forget(&finding.benchmark);
                }
                self.counts.taken += u64::from(matches!(
                    row.input,
                    Input::Reading { .. } | Input::Sample { .. }
                ));
                if let Input::Settings(settings) = &row.input {
                    self.forget_values(settings, row.seq - 1);
                }
                self.follow(row.now, &row.input);
                for job in self.monitor.searches() {
                    self.searches.note(job);
                }
                self.note_step(&row.input);
                // Before the next step: it may be an order that concerns them.
                self.stand_again(store)?;
            }
            // Where all of them are judged again, because what was saved cannot be read, a stop on the way must not begin it anew.
            // All of it: nothing of what was saved before is to stand beside it.
            if from == 0
                && self.steps_since_memory >= STEPS_A_MEMORY
                && let Some(parts) = self.memory_now()
            {
                self.steps_since_memory = 0;
                if let Err(error) = store.replace_memory(&parts, after) {
                    tracing::warn!(%error, "stored steps judged again so far: not saved");
                } else {
                    tracing::info!(step = after, "stored steps judged again so far: saved");
                }
            }
        }
        tracing::info!(steps = after - from, of = after, "stored steps replayed");
        self.settings = self.monitor.settings().clone();
        self.searches.resume();
        Ok(ControlFlow::Continue(()))
    }

    /// One more step that a restart would take again. One that judges a piece of the past takes as long as many readings.
    pub(super) fn note_step(&mut self, input: &Input) {
        let judges_past = matches!(input, Input::Notice(Notice::Retrace | Notice::Current));
        let weight = if judges_past {
            STEPS_A_PIECE_OF_PAST
        } else {
            1
        };
        self.steps_since_memory = self.steps_since_memory.saturating_add(weight);
    }

    /// The memory is saved with the next commit: a restart is not to judge again what has been judged.
    pub fn save_memory(&mut self) {
        self.steps_since_memory = usize::MAX;
    }

    /// What a step led to that is taken again.
    fn stand_again(&mut self, store: &Store) -> Result<(), StoreError> {
        for mut alert in std::mem::take(&mut self.fresh) {
            if alert.event.time <= BEFORE_ALL {
                let given = store.time_given(alert.identity())?;
                alert.event.time = given.unwrap_or(BEFORE_ALL);
            }
            self.standing.date_end(&mut alert);
            self.standing.follow_on(&mut alert);
            let is_sent = store.is_noted(alert.identity(), None, None)?;
            // What is due is noted with the step itself: this one fell into a silence.
            if !is_sent && self.standing.is_waited_for(&alert) {
                self.mutes.put_off(&alert);
            }
            self.standing.stand(alert, is_sent);
        }
        Ok(())
    }

    /// What some hook has not taken yet goes out again.
    pub(super) fn wait_for_hooks(&mut self) -> Result<(), StoreError> {
        let Some(store) = self.sinks.store.clone() else {
            return Ok(());
        };
        for one in self.standing.all_mut() {
            let identity = one.alert.identity();
            one.is_sent |= store.is_noted(identity, None, None)?;
            one.was_notified |= one.is_sent;
            one.is_reported_together |=
                store.is_noted(identity, None, Some(DeliveryOutcome::Over))?;
        }
        let mut waiting = waiting_alerts(&store)?;
        match self.close_what_nobody_takes(&store, &waiting) {
            // The next start does it.
            Err(error) if error.is_full() => tracing::warn!(%error, "deliveries are not closed"),
            Ok(true) => waiting = waiting_alerts(&store)?,
            closed => {
                closed?;
            }
        }
        let mut ended = EndedKeys::default();
        for alert in &waiting {
            self.take_up(&store, alert, &mut ended)?;
        }
        if let Some(alerts) = &self.sinks.alerts {
            alerts.commit();
        }
        Ok(())
    }

    /// Hands an alert that waited to its hooks, but not the beginning of what is over, or was acknowledged.
    fn take_up(
        &self,
        store: &Store,
        alert: &Alert,
        ended: &mut EndedKeys,
    ) -> Result<(), StoreError> {
        let Some(alerts) = &self.sinks.alerts else {
            return Ok(());
        };
        let is_beginning = alert.state == MessageState::Firing;
        let standing = self.standing.at_place_of(alert);
        // What people ended while no daemon ran is not written yet.
        let is_end = |one: &Alert| one.key == alert.key && one.state == MessageState::Resolved;
        let is_ended = self.fresh.iter().any(is_end);
        let standing = standing.filter(|one| one.alert.key == alert.key && !is_ended);
        if is_beginning && standing.is_some_and(|one| one.attention == Attention::Acknowledged) {
            alerts.end(alert);
            return Ok(());
        }
        let awaited = store.awaited(alert.identity())?;
        let is_gone = is_beginning && standing.is_none();
        if is_gone && (is_ended || self.is_over(store, alert, ended)?) {
            alerts.leave_out(alert, &awaited);
            return Ok(());
        }
        // Of what is reported together, and of an end, others may have been notified by another message.
        let is_for_all = is_beginning && !alert.is_flood();
        self.send_where(alert, self.mutes.may_be_of(alert), &|hook| {
            is_for_all || awaited.contains(&hook.name())
        });
        Ok(())
    }

    /// Whether an alert that does not stand has ended, or a higher level has come.
    fn is_over(
        &self,
        store: &Store,
        alert: &Alert,
        ended: &mut EndedKeys,
    ) -> Result<bool, StoreError> {
        if alert.is_flood() {
            // One of an older version does not name its members.
            return Ok(alert.many.is_some() && !self.standing.has_in_force(alert));
        }
        // What is unknown for several reasons has one place for all of them.
        if alert.level != Level::Unknown && self.standing.at_place_of(alert).is_some() {
            return Ok(true);
        }
        ended.has(store, &alert.key)
    }

    /// What waits for a hook that is not in the config any more, or that does not ask for it any more, is closed, and
    /// waits for the hooks that ask for it now. Of what reports many benchmarks together a hook that asks for some of them now
    /// receives these singly. Whether there was any.
    fn close_what_nobody_takes(
        &self,
        store: &Store,
        waiting: &[Alert],
    ) -> Result<bool, StoreError> {
        let Some(dispatcher) = &self.sinks.alerts else {
            return Ok(false);
        };
        let (mut ended, mut instead, mut singly) = (Vec::new(), Vec::new(), Vec::new());
        for alert in waiting {
            let asking = dispatcher.asking(alert);
            let awaited = store.awaited(alert.identity())?;
            // Whoever received the beginning receives the end too, whatever is asked for by now.
            let is_end = alert.state == MessageState::Resolved;
            let takes =
                |hook: &String| asking.contains(hook) || is_end && dispatcher.has_hook(hook);
            let gone = awaited.iter().filter(|hook| !takes(hook));
            let gone: Vec<&String> = gone.collect();
            for hook in &gone {
                ended.push(delivery(alert, hook)?);
            }
            for hook in asking.iter().filter(|_| !gone.is_empty()) {
                instead.push(delivery(alert, hook)?);
            }
            if gone.is_empty() || alert.state != MessageState::Firing {
                continue;
            }
            for member in self.standing.members_in_force(alert) {
                for hook in dispatcher.asking(member) {
                    if gone.contains(&&hook) {
                        singly.push(delivery(member, &hook)?);
                    }
                }
            }
        }
        if !ended.is_empty() {
            store.close_deliveries(&ended, &instead, &singly)?;
            announce_closed(&ended);
        }
        Ok(!ended.is_empty())
    }

    /// The memory as of the last step, where it is time to save it.
    pub(super) fn memory(&self) -> Option<Vec<MemoryPart>> {
        let mut many = STEPS_A_MEMORY.max(STEPS_A_BENCHMARK * self.read.count());
        if self.monitor.reads_past() || self.monitor.queues() {
            many *= STEPS_UNJUDGED;
        }
        (self.steps_since_memory >= many).then(|| self.memory_now())?
    }

    /// The memory as of the last step.
    fn memory_now(&self) -> Option<Vec<MemoryPart>> {
        let (newest, ahead, read_anew) = self.read.to_remember();
        let (mutes, put_off) = self.mutes.to_remember();
        let own = SiteMemory {
            asked: self.searches.jobs().cloned().collect(),
            now: self.now,
            newest,
            ahead,
            read_anew,
            failure_times: self.failure_times.clone(),
            standing: self.standing.to_remember(),
            mutes,
            put_off,
            counts: self.counts,
        };
        let saved = self.monitor.save().map_err(|error| error.to_string());
        let own = rmp_serde::to_vec_named(&own).map_err(|error| error.to_string());
        match saved.and_then(|parts| Ok((parts, own?))) {
            Ok((mut parts, own)) => {
                let body = Some(own);
                let name = OWN.to_owned();
                parts.push(MemoryPart { name, body });
                Some(parts)
            }
            Err(error) => {
                tracing::error!(
                    error,
                    "no memory saved: a restart goes through more of the past again"
                );
                None
            }
        }
    }
}

/// The alerts that some hook has not taken yet.
fn waiting_alerts(store: &Store) -> Result<Vec<Alert>, StoreError> {
    let mut waiting = Vec::new();
    for body in store.waiting()? {
        match from_bytes::<Alert>(&body) {
            Ok(alert) => waiting.push(alert),
            Err(error) => tracing::error!(%error, "an alert that waited cannot be read"),
        }
    }
    Ok(waiting)
}

/// Says it once a hook, not once a delivery: there may be thousands.
fn announce_closed(ended: &[Delivery]) {
    let mut by_hook: BTreeMap<&str, Vec<&Delivery>> = BTreeMap::new();
    for one in ended {
        by_hook.entry(&one.hook).or_default().push(one);
    }
    for (hook, closed) in by_hook {
        let (count, key) = (closed.len(), closed.first().map(|one| &one.key));
        tracing::error!(
            hook,
            count,
            ?key,
            "alerts waited for a hook that does not ask for them any more: they are closed, and go to the hooks that do"
        );
    }
}

/// The keys of all alerts that have ended, read where one is asked for.
#[derive(Debug, Default)]
struct EndedKeys(Option<BTreeSet<String>>);

impl EndedKeys {
    fn has(&mut self, store: &Store, key: &str) -> Result<bool, StoreError> {
        let keys = match &mut self.0 {
            Some(keys) => keys,
            keys => {
                let ended = every(store, KindShown::ALERT.name)?
                    .into_iter()
                    .filter_map(|event| {
                        if let EventKind::Alert {
                            key,
                            state: AlertState::Resolved,
                            ..
                        } = event.kind
                        {
                            Some(key)
                        } else {
                            None
                        }
                    });
                keys.insert(ended.collect())
            }
        };
        Ok(keys.contains(key))
    }
}
