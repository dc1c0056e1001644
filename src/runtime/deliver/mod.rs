//! Takes alerts to the hooks: a worker and a bounded queue each, retries that hold nothing up.
//!
//! The most severe goes first, whatever waits before it; of one benchmark one alert at a time. What has been superseded
//! while it waited is not reported any more.
//!
//! Orange, red and unknown are tried until the hook takes them, they are resolved or superseded, or
//! the daemon stops; the next start then offers them again. Whatever else is given up in the end.

mod at_once;
mod changed;
mod order;
mod repeat;
mod runner;
mod running;
mod shares;
mod worker;

pub use super::way_out::Run;
pub use runner::{Processes, Runner, Senders, run};

use super::delivered::Delivered;
use super::hook::{Alert, MessageState, state_name};
use super::locked::locked;
use super::queued_alerts::QueuedAlerts;
use crate::alert::Level;
use crate::config::HookConfig;
use crate::monitor::EventKind;
use crate::reading::BenchmarkId;
use crate::store::DeliveryOutcome;
use repeat::Repetition;
use std::collections::{BTreeMap, BTreeSet};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{mpsc, oneshot, watch};
use tokio::task::{AbortHandle, JoinSet};
use worker::Worker;

/// Alerts that may wait for one hook.
const QUEUE: usize = 1024;
/// What found no room is offered again once so many have room.
const ENOUGH_ROOM: usize = QUEUE / 2;

/// How often and how fast a hook is tried again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Retry {
    /// Attempts in all, for what need not arrive.
    pub attempts: u32,
    /// The wait after the first; it doubles each time.
    pub first_delay: Duration,
    /// The longest wait.
    pub longest_delay: Duration,
    /// Of the jitter.
    pub seed: u64,
}

impl Default for Retry {
    fn default() -> Self {
        Self {
            attempts: 8,
            first_delay: Duration::from_secs(1),
            longest_delay: Duration::from_secs(300),
            seed: 0,
        }
    }
}

impl Retry {
    /// The wait after attempt number `attempt`: doubled each time, and between half and one and a
    /// half of that, so that many alerts that failed together are not retried together.
    pub fn delay(&self, key: &str, attempt: u32) -> Duration {
        let doubled = self
            .first_delay
            .saturating_mul(1 << attempt.saturating_sub(1).min(20));
        let mut hasher = DefaultHasher::new();
        (self.seed, key, attempt).hash(&mut hasher);
        let jitter = (hasher.finish() >> 11) as f64 / (1_u64 << 53) as f64;
        doubled.min(self.longest_delay).mul_f64(0.5 + jitter)
    }
}

/// The way to one hook.
#[derive(Debug)]
struct HookQueue {
    hook: Arc<HookConfig>,
    queue: mpsc::Sender<Alert>,
    queued: Arc<Mutex<QueuedAlerts>>,
    /// An alert has found the queue full.
    lacks_room: AtomicBool,
    /// What the worker is to go by when the config says something else of the hook; `None` when it has no such hook any more.
    changes: watch::Sender<Option<Arc<HookConfig>>>,
    worker: AbortHandle,
    /// Closed when the worker has ended.
    ended: oneshot::Receiver<()>,
}

impl HookQueue {
    fn supersede(&self, alert: &Alert) {
        let keeps_ends = (self.hook.to.as_ref()).is_some_and(|to| to.goes_by_keys());
        locked(&self.queued).supersede(alert, keeps_ends);
    }
}

/// What one hook is to receive.
#[derive(Debug)]
pub struct HookShare {
    /// Which hook it is, counted from 0.
    pub place: usize,
    /// Its name.
    pub name: String,
    /// The benchmarks that it asks for; empty: all.
    pub audience: BTreeSet<BenchmarkId>,
    /// What it receives.
    pub alerts: Vec<Alert>,
    /// Ends that one of those reports, or whose beginning the hook did not receive.
    pub reported: Vec<Alert>,
}

/// Without the ends that the end of a flood reports, and these.
fn without_reported(alerts: Vec<Alert>) -> (Vec<Alert>, Vec<Alert>) {
    let ends = alerts
        .iter()
        .filter(|alert| alert.state == MessageState::Resolved);
    let members = ends.filter_map(|end| end.many.as_ref());
    let keys: BTreeSet<String> = members
        .flat_map(|many| many.members.iter().map(|one| one.key.clone()))
        .collect();
    alerts
        .into_iter()
        .partition(|alert| alert.state != MessageState::Resolved || !keys.contains(&alert.key))
}

/// The way to all hooks.
#[derive(Debug)]
pub struct Dispatcher {
    hooks: Vec<HookQueue>,
    workers: JoinSet<usize>,
    /// By name the hooks that the config has no more: closed when their workers have ended.
    leaving: BTreeMap<String, oneshot::Receiver<()>>,
    delivered: Arc<Mutex<Delivered>>,
    runner: Arc<dyn Runner>,
    retry: Retry,
    repetition: Mutex<Repetition>,
}

impl Dispatcher {
    /// Starts a worker for each hook, which runs it as a process; needs a tokio runtime.
    pub fn start(hooks: &[HookConfig], retry: &Retry, delivered: Delivered) -> Self {
        let runner: Arc<dyn Runner> = Arc::new(Processes);
        Self::with(&runner, hooks, retry, delivered)
    }

    /// Starts a worker for each hook, which `runner` runs; needs a tokio runtime.
    pub fn with(
        runner: &Arc<dyn Runner>,
        hooks: &[HookConfig],
        retry: &Retry,
        delivered: Delivered,
    ) -> Self {
        let mut started = Self {
            hooks: Vec::new(),
            workers: JoinSet::new(),
            leaving: BTreeMap::new(),
            delivered: Arc::new(Mutex::new(delivered)),
            runner: Arc::clone(runner),
            retry: retry.clone(),
            repetition: Mutex::new(Repetition::new()),
        };
        started.hooks = hooks.iter().map(|hook| started.begin(hook, None)).collect();
        started
    }

    /// Starts the worker of `hook`, where there is a `former` one of that name once it has ended.
    fn begin(&mut self, hook: &HookConfig, former: Option<oneshot::Receiver<()>>) -> HookQueue {
        let hook = Arc::new(hook.clone());
        let (queue, receiver) = mpsc::channel(QUEUE);
        let (changes, changed) = watch::channel(Some(Arc::clone(&hook)));
        let queued = Arc::new(Mutex::new(QueuedAlerts::default()));
        let (delivered, shared) = (Arc::clone(&self.delivered), Arc::clone(&queued));
        let runner = Arc::clone(&self.runner);
        let worker = Worker::new(Arc::clone(&hook), runner, &self.retry, delivered, shared);
        let (at_work, ended) = oneshot::channel::<()>();
        let worker = self.workers.spawn(async move {
            if let Some(former) = former {
                // It sends nothing: closed when the worker has ended.
                let _ = former.await;
            }
            let lost = worker.run(receiver, changed).await;
            drop(at_work);
            lost
        });
        HookQueue {
            hook,
            queue,
            queued,
            lacks_room: AtomicBool::new(false),
            changes,
            worker,
            ended,
        }
    }

    /// Hands `alert` to every hook that asks for it and is `meant`, has not taken it before and does not have it queued; no
    /// attempt is made while `is_muted`, until [`Dispatcher::mute`] says otherwise. Never waits: what finds a queue full is logged and
    /// not queued, until [`Dispatcher::finds_room`].
    pub(super) fn offer_where(
        &self,
        alert: &Alert,
        is_muted: bool,
        meant: &dyn Fn(&HookConfig) -> bool,
    ) {
        self.supersede(alert);
        for way in &self.hooks {
            if way.hook.asks_for(alert) && meant(&way.hook) {
                self.offer_to(way, alert, is_muted);
            }
        }
    }

    /// Whether a hook that had no room for an alert has some again: said once, and until then nothing offers that alert again.
    pub fn finds_room(&self) -> bool {
        let mut finds = false;
        for way in &self.hooks {
            finds |= way.queue.capacity() >= ENOUGH_ROOM && way.lacks_room.swap(false, Relaxed);
        }
        finds
    }

    /// Hands these alerts to the hook of a [`HookShare`]; a queue that is full as above.
    pub fn offer_share(&self, place: usize, alerts: &[Alert]) {
        let Some(way) = self.hooks.get(place) else {
            return;
        };
        for alert in alerts {
            way.supersede(alert);
            self.offer_to(way, alert, false);
        }
    }

    /// The names of the hooks that ask for such an alert.
    pub(super) fn asking(&self, alert: &Alert) -> Vec<String> {
        let asks = |way: &&HookQueue| way.hook.asks_for(alert);
        self.hooks
            .iter()
            .filter(asks)
            .map(|way| way.hook.name())
            .collect()
    }

    /// Whether the config has a hook of this name.
    pub(super) fn has_hook(&self, name: &str) -> bool {
        self.hooks.iter().any(|way| way.hook.name() == name)
    }

    /// Makes the receipts durable that are not yet, as those that found no room on the disk before.
    pub fn commit(&self) {
        locked(&self.delivered).commit_or_log();
    }

    /// What `alert` supersedes or resolves is not tried again, whether a hook is notified of `alert` or not.
    pub fn supersede(&self, alert: &Alert) {
        for way in &self.hooks {
            way.supersede(alert);
        }
    }

    /// Somebody has seen `alert`: no hook that has not taken it is tried, or tried again; from the next [`Dispatcher::commit`] on
    /// also after a restart.
    pub fn end(&self, alert: &Alert) {
        for way in &self.hooks {
            locked(&way.queued).end(alert);
            if way.hook.asks_for(alert) {
                self.call_off(way, alert, DeliveryOutcome::Acknowledged);
            }
        }
    }

    /// Somebody sees to `alert`: where it waits for its escalation it is not sent; [`Dispatcher::commit`] as above.
    pub fn spare(&self, alert: &Alert) {
        for way in &self.hooks {
            let is_escalation = way.hook.escalate_after.is_some() && way.hook.asks_for(alert);
            if is_escalation && !self.has_received(way, alert) {
                self.call_off(way, alert, DeliveryOutcome::Silenced);
            }
        }
    }

    /// Somebody has seen everything: what reports many benchmarks at once too, where it `is_seen`.
    pub fn end_those_of_many(&self, is_seen: &dyn Fn(&Alert) -> bool) {
        for way in &self.hooks {
            let of_many = locked(&way.queued).of_many();
            let is_meant = |one: &&Alert| one.state != MessageState::Resolved && is_seen(one);
            for alert in of_many.iter().filter(is_meant) {
                locked(&way.queued).end(alert);
                self.call_off(way, alert, DeliveryOutcome::Acknowledged);
            }
        }
    }

    /// Nobody is notified, for now, of what is muted by its place and level; of everything else they are.
    pub(super) fn mute(&self, is_muted: &dyn Fn(Option<&BenchmarkId>, Level) -> bool) {
        for way in &self.hooks {
            locked(&way.queued).mute(is_muted);
        }
    }

    /// What `alert` reports is over: it is not tried any more.
    pub(super) fn stop_trying(&self, alert: &Alert) {
        for way in &self.hooks {
            locked(&way.queued).end(alert);
        }
    }

    /// What waited for these hooks, and is over by now, is not sent to them.
    pub(super) fn leave_out(&self, alert: &Alert, hooks: &[String]) {
        for name in hooks {
            let key = &alert.key;
            tracing::info!(hook = name, key, "over before it was reported");
            if let Err(error) = locked(&self.delivered).note(alert, name, DeliveryOutcome::Over) {
                tracing::warn!(hook = name, key, %error, "no receipt: a restart looks at it again");
            }
        }
    }

    /// Notes that a hook is not to be tried, or tried again, with an alert that it has not taken: durable from the next
    /// [`Dispatcher::commit`] on.
    fn call_off(&self, way: &HookQueue, alert: &Alert, outcome: DeliveryOutcome) {
        let name = way.hook.name();
        let mut queued = locked(&way.queued);
        let mut delivered = locked(&self.delivered);
        if delivered.has(alert, &name) {
            return;
        }
        queued.end(alert);
        let key = &alert.key;
        tracing::info!(hook = name, key, ?outcome, "not sent, or not tried again");
        if let Err(error) = delivered.record_outcome(alert, &name, outcome) {
            tracing::warn!(hook = name, key, %error, "no receipt: a restart may send it");
        }
    }

    /// Whether this is the end of what was called off, or waited, and was never reported: neither of them is then.
    fn ends_unreported(&self, way: &HookQueue, queued: &mut QueuedAlerts, alert: &Alert) -> bool {
        // Of what ends together only what was reported is named.
        if alert.state != MessageState::Resolved || alert.is_flood() {
            return false;
        }
        let (name, firing) = (way.hook.name(), alert.beginning());
        let mut delivered = locked(&self.delivered);
        if !way.hook.may_wait() && !delivered.is_called_off(&firing, &name) {
            return false;
        }
        if delivered.was_notified(&firing, &name)
            || queued.was_tried(&firing)
            || delivered.attempts(&firing, &name) > 0
        {
            return false;
        }
        queued.end(&firing);
        for one in [&firing, alert] {
            if let Err(error) = delivered.note(one, &name, DeliveryOutcome::Over) {
                let key = &alert.key;
                tracing::warn!(hook = name, key, %error, "no receipt: a restart may send it");
            }
        }
        true
    }

    fn offer_to(&self, way: &HookQueue, alert: &Alert, is_muted: bool) {
        let (name, key) = (way.hook.name(), &alert.key);
        if way.hook.to.as_ref().is_some_and(|to| to.forgets()) {
            locked(&self.repetition).note(alert);
        }
        // Queued first: a worker notes the receipt before it lets go.
        let mut queued = locked(&way.queued);
        if self.ends_unreported(way, &mut queued, alert) {
            return;
        }
        if queued.cancels(alert) {
            tracing::debug!(hook = name, key, "over before it was reported");
            if let Err(error) = locked(&self.delivered).note(alert, &name, DeliveryOutcome::Over) {
                tracing::warn!(hook = name, key, %error, "no receipt: a restart may send it");
            }
            return;
        }
        if !queued.take(alert, is_muted) {
            return;
        }
        if locked(&self.delivered).has(alert, &name) {
            queued.release(alert);
            tracing::debug!(hook = name, key, "delivered before");
        } else if let Err(error) = way.queue.try_send(alert.clone()) {
            queued.release(alert);
            way.lacks_room.store(true, Relaxed);
            let state = state_name(alert.state);
            tracing::error!(hook = name, key, state, %error, "no room for an alert: it is offered again when there is");
        }
    }

    /// Lets the workers finish what waits, each alert once more at most, and stops them after
    /// `limit`. Returns how many alerts no hook has taken; `None` when the limit was reached.
    pub async fn close(mut self, limit: Duration) -> Option<usize> {
        self.hooks.clear();
        let all = async {
            let mut lost = 0;
            while let Some(worker) = self.workers.join_next().await {
                lost += worker.unwrap_or(0);
            }
            lost
        };
        let lost = tokio::time::timeout(limit, all).await.ok();
        self.commit();
        if lost.is_none() {
            tracing::error!(limit_s = limit.as_secs_f64(), "hooks stopped half-way");
        }
        lost
    }
}

impl HookConfig {
    /// What logs and receipts call it: its command line, or the name of where its alerts go.
    pub fn name(&self) -> String {
        let to = self.to.as_ref();
        to.map_or_else(|| self.run.join(" "), |to| to.name())
    }

    /// Whether its alerts may wait: for an acknowledgement that does not come in time, or for somebody on duty.
    pub(super) fn may_wait(&self) -> bool {
        self.escalate_after.is_some() || self.hours.is_some()
    }

    /// Whether a message of many benchmarks was made for hooks that ask for the same ones.
    pub(super) fn is_audience_of(&self, alert: &Alert) -> bool {
        let many = alert.many.as_ref();
        many.is_none_or(|many| many.audience == self.benchmarks)
    }

    /// Whether it is notified of an alert of this level, at a benchmark or the whole site. What reports many benchmarks
    /// at once stands for theirs, each of which it is to ask for; that the clock is wrong concerns everyone. Of a correction it is where it asks for these
    /// and for the level that was in force or the one that would have been.
    fn asks_for(&self, alert: &Alert) -> bool {
        let is_of_the_site = alert.event.benchmark.is_none() && !alert.is_flood();
        let is_ours = self.site == is_of_the_site || alert.is_of_the_clock();
        let is_mine = |place: Option<&BenchmarkId>| {
            self.benchmarks.is_empty() || place.is_none_or(|one| self.benchmarks.contains(one))
        };
        let is_of_ours = is_mine(alert.event.benchmark.as_ref())
            && (alert.many.iter().flat_map(|many| &many.members))
                .all(|one| is_mine(one.benchmark.as_ref()));
        let is_of_our_levels = if let EventKind::Correction {
            level_then,
            level_now,
            ..
        } = &alert.event.kind
        {
            self.extra.corrections
                && [level_then, level_now]
                    .iter()
                    .any(|one| self.levels.contains(one))
        } else {
            self.levels.contains(&alert.level)
        };
        is_of_our_levels && is_ours && is_of_ours
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_wait_grows_is_jittered_and_is_the_same_for_the_same_seed() {
        let retry = Retry::default();
        for attempt in 1..8 {
            let doubled = Duration::from_secs(1 << (attempt - 1));
            let delay = retry.delay("k", attempt);
            assert!(
                delay >= doubled / 2 && delay <= doubled * 3 / 2,
                "{delay:?}"
            );
            assert_eq!(delay, retry.delay("k", attempt));
        }
        assert_ne!(retry.delay("k", 1), retry.delay("l", 1));
        assert!(retry.delay("k", 4_000_000) <= Duration::from_secs(450));
    }
}
