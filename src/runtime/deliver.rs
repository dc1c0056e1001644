//! Takes alerts to the hooks: a worker and a bounded queue each, retries that hold nothing up.
//!
//! Orange, red and unknown are tried until the hook takes them, they are resolved or superseded, or
//! the daemon stops; the next start then offers them again. Whatever else is given up in the end.

use super::clock;
use super::delivered::Delivered;
use super::hook::{self, Alert, Outcome};
use super::in_hand::InHand;
use crate::config::HookConfig;
use crate::store::Fate;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::Instant;

/// Alerts that may wait for one hook.
const QUEUE: usize = 1024;

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
struct Way {
    hook: HookConfig,
    queue: mpsc::Sender<Alert>,
    in_hand: Arc<Mutex<InHand>>,
}

/// The way to all hooks.
#[derive(Debug)]
pub struct Dispatcher {
    hooks: Vec<Way>,
    workers: JoinSet<usize>,
    delivered: Arc<Mutex<Delivered>>,
}

impl Dispatcher {
    /// Starts a worker for each hook; needs a tokio runtime.
    pub fn start(hooks: &[HookConfig], retry: &Retry, delivered: Delivered) -> Self {
        let delivered = Arc::new(Mutex::new(delivered));
        let mut workers = JoinSet::new();
        let mut queues = Vec::new();
        for hook in hooks {
            let (queue, receiver) = mpsc::channel(QUEUE);
            let in_hand = Arc::new(Mutex::new(InHand::default()));
            let worker = Worker {
                hook: Arc::new(hook.clone()),
                retry: retry.clone(),
                delivered: Arc::clone(&delivered),
                in_hand: Arc::clone(&in_hand),
                waiting: BTreeMap::new(),
                untried: 0,
                taken: 0,
                lost: 0,
            };
            workers.spawn(worker.run(receiver));
            let hook = hook.clone();
            queues.push(Way {
                hook,
                queue,
                in_hand,
            });
        }
        Self {
            hooks: queues,
            workers,
            delivered,
        }
    }

    /// Hands `alert` to every hook that asks for it, has not taken it before and does not
    /// have it in hand. Never waits: what finds a queue full is not taken in hand, and said to be;
    /// `false` then.
    pub fn offer(&self, alert: &Alert) -> bool {
        self.supersede(alert);
        let mut is_taken = true;
        for way in &self.hooks {
            if way.hook.asks_for(alert) {
                is_taken &= self.offer_to(way, alert);
            }
        }
        is_taken
    }

    /// The names of the hooks that ask for such an alert.
    pub(super) fn asking(&self, alert: &Alert) -> Vec<String> {
        let asks = |way: &&Way| way.hook.asks_for(alert);
        self.hooks
            .iter()
            .filter(asks)
            .map(|way| way.hook.name())
            .collect()
    }

    /// Makes the receipts durable that found no room on the disk before.
    pub fn commit(&self) {
        if let Err(error) = locked(&self.delivered).commit() {
            tracing::warn!(%error, "receipts lost: a restart may send their alerts again");
        }
    }

    /// What `alert` supersedes or resolves is not tried again, whether a hook hears of `alert` or not.
    pub fn supersede(&self, alert: &Alert) {
        for way in &self.hooks {
            locked(&way.in_hand).supersede(alert);
        }
    }

    /// Somebody has seen `alert`: it is not tried again.
    pub fn end(&self, alert: &Alert) {
        for way in &self.hooks {
            locked(&way.in_hand).end(alert);
        }
    }

    fn offer_to(&self, way: &Way, alert: &Alert) -> bool {
        let (name, key) = (way.hook.name(), &alert.key);
        // In hand first: a worker notes the receipt before it lets go.
        let mut in_hand = locked(&way.in_hand);
        if !in_hand.take(alert) {
            return true;
        }
        if locked(&self.delivered).has(alert, &name) {
            in_hand.release(alert);
            tracing::debug!(hook = name, key, "delivered before");
        } else if let Err(error) = way.queue.try_send(alert.clone()) {
            in_hand.release(alert);
            tracing::error!(hook = name, key, %error, "no room for an alert");
            return false;
        }
        true
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
    /// What logs and receipts call it: its command line.
    pub fn name(&self) -> String {
        self.run.join(" ")
    }

    /// Whether it is told of an alert of this level, at a benchmark or the whole site. What tells of many benchmarks
    /// at once stands for theirs.
    fn asks_for(&self, alert: &Alert) -> bool {
        let is_of_the_site = alert.event.benchmark.is_none() && !alert.is_flood();
        self.levels.contains(&alert.level) && self.site == is_of_the_site
    }
}

fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

#[derive(Debug)]
struct Waiting {
    alert: Alert,
    /// Counts from 1, over restarts.
    attempt: u32,
    /// Not tried since the start.
    is_new: bool,
}

#[derive(Debug)]
struct Worker {
    hook: Arc<HookConfig>,
    retry: Retry,
    delivered: Arc<Mutex<Delivered>>,
    in_hand: Arc<Mutex<InHand>>,
    /// By when it is due, then in order of arrival: a retry never holds up a new alert.
    waiting: BTreeMap<(Instant, u64), Waiting>,
    /// How many of them wait for their first attempt. Only these keep the queue waiting: those
    /// that must arrive are few, because their benchmark's next one ends their retries.
    untried: usize,
    taken: u64,
    lost: usize,
}

impl Worker {
    async fn run(mut self, mut queue: mpsc::Receiver<Alert>) -> usize {
        let mut open = true;
        let mut running: Option<Running> = None;
        loop {
            if running.is_none() {
                running = self.next_run(open);
            }
            if !open && running.is_none() {
                return self.lost;
            }
            let due = self.waiting.keys().next().map(|(due, _)| *due);
            tokio::select! {
                alert = queue.recv(), if open && self.untried < QUEUE => match alert {
                    Some(alert) => self.begin(alert),
                    None => open = false,
                },
                outcome = finished(&mut running), if running.is_some() => {
                    if let Some(run) = running.take() {
                        self.settle(&run.waiting, outcome.as_ref(), open);
                    }
                }
                () = until(due), if running.is_none() && due.is_some() => {}
            }
        }
    }

    /// Starts the first alert that is due; on the way out everything is.
    fn next_run(&mut self, open: bool) -> Option<Running> {
        loop {
            let (due, _) = *self.waiting.keys().next()?;
            if open && due > clock::later(Duration::ZERO) {
                return None;
            }
            let (_, waiting) = self.waiting.pop_first()?;
            if waiting.is_new {
                self.untried -= 1;
            } else if self.is_over(&waiting.alert) {
                self.drop_over(&waiting.alert);
                continue;
            }
            let (hook, alert) = (Arc::clone(&self.hook), waiting.alert.clone());
            let attempt = waiting.attempt;
            let task = tokio::spawn(async move { hook::run(&hook, &alert, attempt).await });
            return Some(Running { task, waiting });
        }
    }

    fn settle(&mut self, waiting: &Waiting, outcome: Option<&Outcome>, open: bool) {
        let (hook, key) = (self.hook.name(), waiting.alert.key.clone());
        let attempt = waiting.attempt;
        let goes_on = waiting.alert.must_arrive() || attempt < self.retry.attempts;
        if outcome == Some(&Outcome::Done) {
            self.let_go(&waiting.alert, Fate::Delivered);
        } else if self.is_over(&waiting.alert) {
            self.drop_over(&waiting.alert);
        } else if open && goes_on {
            let delay = self.retry.delay(&key, attempt);
            let delay_s = delay.as_secs_f64();
            tracing::warn!(
                hook,
                key,
                attempt,
                ?outcome,
                delay_s,
                "hook will be retried"
            );
            self.note(&waiting.alert, Fate::Waiting);
            let again = Waiting {
                alert: waiting.alert.clone(),
                attempt: attempt.saturating_add(1),
                is_new: false,
            };
            self.wait(again, clock::later(delay));
        } else {
            tracing::error!(hook, key, attempt, ?outcome, "alert not delivered");
            self.lost += 1;
            // What is given up only because the daemon stops, the next start tries again.
            let fate = if open { Fate::Dead } else { Fate::Waiting };
            self.let_go(&waiting.alert, fate);
        }
    }

    /// Notes what became of an alert, then lets go of it.
    fn let_go(&self, alert: &Alert, fate: Fate) {
        self.note(alert, fate);
        locked(&self.in_hand).release(alert);
    }

    fn note(&self, alert: &Alert, fate: Fate) {
        let hook = self.hook.name();
        if let Err(error) = locked(&self.delivered).note(alert, &hook, fate) {
            let key = &alert.key;
            tracing::warn!(hook, key, %error, "no receipt: a restart may send it again");
        }
    }

    fn is_over(&self, alert: &Alert) -> bool {
        locked(&self.in_hand).is_over(alert)
    }

    fn drop_over(&mut self, alert: &Alert) {
        let (hook, key) = (self.hook.name(), &alert.key);
        tracing::error!(hook, key, "alert not delivered before it was over");
        self.lost += 1;
        self.let_go(alert, Fate::Over);
    }

    fn begin(&mut self, alert: Alert) {
        let before = locked(&self.delivered).attempts(&alert, &self.hook.name());
        let waiting = Waiting {
            alert,
            attempt: before.saturating_add(1),
            is_new: true,
        };
        self.wait(waiting, clock::later(Duration::ZERO));
    }

    fn wait(&mut self, waiting: Waiting, due: Instant) {
        self.taken += 1;
        self.untried += usize::from(waiting.is_new);
        self.waiting.insert((due, self.taken), waiting);
    }
}

/// A hook's run, and for what. It ends with its worker.
#[derive(Debug)]
struct Running {
    task: JoinHandle<Outcome>,
    waiting: Waiting,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.task.abort();
    }
}

/// `None` when the run broke off.
async fn finished(running: &mut Option<Running>) -> Option<Outcome> {
    match running {
        Some(run) => (&mut run.task).await.ok(),
        None => None,
    }
}

async fn until(due: Option<Instant>) {
    if let Some(due) = due {
        tokio::time::sleep_until(due).await;
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
