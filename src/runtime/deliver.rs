//! Takes alerts to the hooks: a worker and a bounded queue each, retries that hold nothing up.

use super::clock;
use super::delivered::Delivered;
use super::hook::{self, Alert, Outcome};
use crate::config::HookConfig;
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::task::{JoinHandle, JoinSet};
use tokio::time::Instant;

/// Alerts that may wait for one hook.
const QUEUE: usize = 1024;

/// How often and how fast a hook is tried again.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Retry {
    /// Attempts in all.
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

/// The way to all hooks.
#[derive(Debug)]
pub struct Dispatcher {
    hooks: Vec<(HookConfig, mpsc::Sender<Alert>)>,
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
            let (sender, receiver) = mpsc::channel(QUEUE);
            let worker = Worker {
                hook: Arc::new(hook.clone()),
                retry: retry.clone(),
                delivered: Arc::clone(&delivered),
                waiting: BTreeMap::new(),
                taken: 0,
                lost: 0,
            };
            workers.spawn(worker.run(receiver));
            queues.push((hook.clone(), sender));
        }
        Self {
            hooks: queues,
            workers,
            delivered,
        }
    }

    /// Hands `alert` to every hook that asks for its level and has not taken it before. Never
    /// waits: what finds a queue full is lost for this run, and said to be.
    pub fn offer(&self, alert: &Alert) {
        for (hook, queue) in &self.hooks {
            if !hook.levels.contains(&alert.level) {
                continue;
            }
            let name = hook.name();
            let delivered = &self.delivered;
            let known = delivered.lock().unwrap_or_else(PoisonError::into_inner);
            if known.has(alert, &name) {
                tracing::debug!(hook = name, key = alert.key, "delivered before");
            } else if let Err(error) = queue.try_send(alert.clone()) {
                tracing::error!(hook = name, key = alert.key, %error, "alert lost: queue full");
            }
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
}

#[derive(Debug)]
struct Waiting {
    alert: Alert,
    attempt: u32,
}

type Run = JoinHandle<(Waiting, Outcome)>;

#[derive(Debug)]
struct Worker {
    hook: Arc<HookConfig>,
    retry: Retry,
    delivered: Arc<Mutex<Delivered>>,
    /// By when it is due, then in order of arrival: a retry never holds up a new alert.
    waiting: BTreeMap<(Instant, u64), Waiting>,
    taken: u64,
    lost: usize,
}

impl Worker {
    async fn run(mut self, mut queue: mpsc::Receiver<Alert>) -> usize {
        let mut open = true;
        let mut running: Option<AbortOnDrop> = None;
        loop {
            if running.is_none() {
                running = self.next_run(open);
            }
            if !open && running.is_none() {
                return self.lost;
            }
            let due = self.waiting.keys().next().map(|(due, _)| *due);
            tokio::select! {
                alert = queue.recv(), if open && self.waiting.len() < QUEUE => match alert {
                    Some(alert) => self.wait(Waiting { alert, attempt: 1 }, clock::later(Duration::ZERO)),
                    None => open = false,
                },
                ended = finished(&mut running), if running.is_some() => {
                    running = None;
                    self.settle(ended, open);
                }
                () = until(due), if running.is_none() && due.is_some() => {}
            }
        }
    }

    /// Starts the first alert that is due; on the way out everything is.
    fn next_run(&mut self, open: bool) -> Option<AbortOnDrop> {
        let (due, _) = *self.waiting.keys().next()?;
        if open && due > clock::later(Duration::ZERO) {
            return None;
        }
        let (_, waiting) = self.waiting.pop_first()?;
        let hook = Arc::clone(&self.hook);
        Some(AbortOnDrop(tokio::spawn(async move {
            let outcome = hook::run(&hook, &waiting.alert, waiting.attempt).await;
            (waiting, outcome)
        })))
    }

    fn settle(&mut self, ended: Option<(Waiting, Outcome)>, open: bool) {
        let Some((mut waiting, outcome)) = ended else {
            tracing::error!(hook = self.hook.name(), "alert lost: its run broke off");
            self.lost += 1;
            return;
        };
        let (hook, key) = (self.hook.name(), waiting.alert.key.clone());
        if outcome == Outcome::Done {
            let mut delivered = self
                .delivered
                .lock()
                .unwrap_or_else(PoisonError::into_inner);
            if let Err(error) = delivered.note(&waiting.alert, &hook) {
                tracing::warn!(hook, key, %error, "no receipt: a restart may send it again");
            }
        } else if open && waiting.attempt < self.retry.attempts {
            let delay = self.retry.delay(&key, waiting.attempt);
            let (attempt, delay_s) = (waiting.attempt, delay.as_secs_f64());
            tracing::warn!(
                hook,
                key,
                attempt,
                ?outcome,
                delay_s,
                "hook will be retried"
            );
            waiting.attempt += 1;
            self.wait(waiting, clock::later(delay));
        } else {
            let attempts = waiting.attempt;
            tracing::error!(hook, key, attempts, ?outcome, "alert not delivered");
            self.lost += 1;
        }
    }

    fn wait(&mut self, waiting: Waiting, due: Instant) {
        self.taken += 1;
        self.waiting.insert((due, self.taken), waiting);
    }
}

/// A hook's run ends with its worker.
#[derive(Debug)]
struct AbortOnDrop(Run);

impl Drop for AbortOnDrop {
    fn drop(&mut self) {
        self.0.abort();
    }
}

async fn finished(running: &mut Option<AbortOnDrop>) -> Option<(Waiting, Outcome)> {
    match running {
        Some(run) => (&mut run.0).await.ok(),
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
