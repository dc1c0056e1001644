//! The worker of one hook: what is due, in the order of its severity, a few at once.

use super::order::{is_red, is_severe, place, severity};
use super::running::{Running, Waiting, finished, news, until};
use super::{QUEUE, Retry, Runner, locked};
use crate::alert::Level;
use crate::config::HookConfig;
use crate::reading::{Timestamp, counted};
use crate::runtime::clock;
use crate::runtime::delivered::Delivered;
use crate::runtime::hook::{Alert, HookOutcome, MessageState};
use crate::runtime::queued_alerts::QueuedAlerts;
use crate::store::DeliveryOutcome;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Duration;
use tokio::sync::{mpsc, watch};
use tokio::time::Instant;

/// So long at most until what waits for its escalation or for somebody on duty is looked at again: the host's clock may be
/// corrected meanwhile.
const LOOK_AGAIN: Duration = Duration::from_secs(30);
/// The same of what is silenced or shelved, which people may end.
const LOOK_AGAIN_MUTED: Duration = Duration::from_secs(1);

/// Runs of one hook at a time, each for another benchmark.
const MOST_AT_ONCE: usize = 4;
/// So many more of orange, and of red twice as many: runs for less that hang keep none of them waiting.
const MORE_OF_SEVERE: usize = 2;
/// A run that lasts longer than this does not keep a more severe alert of its own benchmark waiting either, and is broken off for it. The run of an
/// end does, but for red: it is then tried again.
const KEEPS_WAITING: Duration = Duration::from_secs(10);

/// What is shown of a hook where others than its owner look: without its arguments, which may hold addresses and secrets.
fn short_name(hook: &HookConfig) -> String {
    let program = || {
        let file = hook.run.first().map(Path::new).and_then(Path::file_name);
        file.map_or_else(String::new, |file| file.to_string_lossy().into_owned())
    };
    let to = hook.to.as_ref();
    to.map_or_else(program, |to| to.name())
}

/// By when it is due, then in order of arrival.
type Turn = (Instant, u64);

/// The turn of `waiting`, or of an end at its place that came before it and has not been tried: a receiver that goes by the order takes
/// the newest message for what holds. An end that has failed once keeps nothing waiting.
fn end_before(turn: &Turn, waiting: &Waiting, due: &[(&Turn, &Waiting)]) -> Turn {
    let is_before = |(other, end): &&(&Turn, &Waiting)| {
        end.is_new
            && end.alert.state == MessageState::Resolved
            && other.1 < turn.1
            && place(&end.alert) == place(&waiting.alert)
    };
    let mut ends = due.iter().filter(is_before);
    if waiting.alert.state != MessageState::Firing {
        return *turn;
    }
    ends.next().map_or(*turn, |(turn, _)| **turn)
}

#[derive(Debug)]
pub(super) struct Worker {
    hook: Arc<HookConfig>,
    runner: Arc<dyn Runner>,
    retry: Retry,
    delivered: Arc<Mutex<Delivered>>,
    queued: Arc<Mutex<QueuedAlerts>>,
    /// A retry never holds up a new alert.
    waiting: BTreeMap<Turn, Waiting>,
    running: Vec<Running>,
    /// How many of them wait for their first attempt. Only these keep the queue waiting: those
    /// that must arrive are few, because their benchmark's next one ends their retries.
    untried: usize,
    taken: u64,
    lost: usize,
    /// The config has this hook no more: it only ends what it runs.
    is_left_out: bool,
}

impl Worker {
    pub(super) fn new(
        hook: Arc<HookConfig>,
        runner: Arc<dyn Runner>,
        retry: &Retry,
        delivered: Arc<Mutex<Delivered>>,
        queued: Arc<Mutex<QueuedAlerts>>,
    ) -> Self {
        Self {
            hook,
            runner,
            retry: retry.clone(),
            delivered,
            queued,
            waiting: BTreeMap::new(),
            running: Vec::new(),
            untried: 0,
            taken: 0,
            lost: 0,
            is_left_out: false,
        }
    }

    pub(super) async fn run(
        mut self,
        mut queue: mpsc::Receiver<Alert>,
        mut changes: watch::Receiver<Option<Arc<HookConfig>>>,
    ) -> usize {
        let mut open = true;
        loop {
            // Before what has come: that is for the hook as it is now.
            if let Some(hook) = news(&mut changes) {
                self.change(hook);
            }
            // What has come by now is weighed together.
            while open && self.untried < QUEUE {
                match queue.try_recv() {
                    Ok(alert) => self.begin(alert),
                    Err(_) => break,
                }
            }
            while self.start_next(open) {}
            if !open && self.running.is_empty() {
                return self.lost;
            }
            let due = self.next_due(open);
            tokio::select! {
                biased;
                Ok(()) = changes.changed(), if open => changes.mark_changed(),
                alert = queue.recv(), if open && self.untried < QUEUE => match alert {
                    Some(alert) => self.begin(alert),
                    None => open = false,
                },
                (run, outcome) = finished(&mut self.running), if !self.running.is_empty() => {
                    let run = self.running.swap_remove(run);
                    self.note_outcome(&run.waiting, outcome.as_ref(), open);
                }
                () = until(due), if due.is_some() => {}
            }
        }
    }

    /// When the next one may be started; on the way out all are due but those that are held, which stay in the outbox.
    fn next_due(&self, open: bool) -> Option<Instant> {
        let waiting = self.waiting.iter().filter(|(_, one)| open || !one.is_held);
        let now = clock::later(Duration::ZERO);
        let due = |due: Instant| if open { due } else { now };
        let each = waiting.filter_map(|((at, _), one)| self.free_from(due(*at), one));
        each.min()
    }

    /// From when on it may be started, at `due` or later; `None` before another run has ended.
    fn free_from(&self, due: Instant, waiting: &Waiting) -> Option<Instant> {
        let is_severe = is_severe(&waiting.alert);
        let levels = usize::from(is_severe) + usize::from(is_red(&waiting.alert));
        if self.running.len() >= MOST_AT_ONCE + levels * MORE_OF_SEVERE {
            return None;
        }
        let mut at_its_place = self
            .running
            .iter()
            .filter(|run| place(&run.waiting.alert) == place(&waiting.alert));
        at_its_place.try_fold(due, |from, run| {
            let of_less = severity(&waiting.alert) > severity(&run.waiting.alert);
            let gives_way = match run.waiting.alert.state {
                MessageState::Firing => is_severe,
                // The end of another red comes before a red that begins.
                MessageState::Resolved => {
                    is_red(&waiting.alert) && run.waiting.alert.level != Level::Red
                }
                MessageState::Correction => false,
            };
            (gives_way && of_less).then(|| from.max(run.started + KEEPS_WAITING))
        })
    }

    /// Starts the most severe alert that is due; on the way out everything is.
    fn start_next(&mut self, open: bool) -> bool {
        self.drop_what_is_over(open);
        self.hold_back(open);
        let now = clock::later(Duration::ZERO);
        let due = self.waiting.iter();
        let due = due.take_while(|((due, _), _)| !open || *due <= now);
        let due: Vec<(&Turn, &Waiting)> = due.filter(|(_, waiting)| !waiting.is_held).collect();
        let is_free = |(_, waiting): &&(&Turn, &Waiting)| {
            let from = self.free_from(now, waiting);
            from.is_some_and(|from| from <= now)
        };
        let free = due.iter().filter(is_free);
        let next = free.max_by_key(|((due, number), waiting)| {
            (severity(&waiting.alert), std::cmp::Reverse((*due, *number)))
        });
        let Some(turn) = next.map(|(turn, waiting)| end_before(turn, waiting, &due)) else {
            return false;
        };
        let Some(waiting) = self.waiting.remove(&turn) else {
            return false;
        };
        self.untried -= usize::from(waiting.is_new);
        self.break_off(&waiting.alert);
        locked(&self.queued).note_tried(&waiting.alert);
        let (hook, alert) = (Arc::clone(&self.hook), waiting.alert.clone());
        let task = tokio::spawn(self.runner.run(hook, alert, waiting.attempt));
        self.running.push(Running {
            task,
            waiting,
            started: now,
        });
        true
    }

    /// Ends the runs for less at the place of a more severe alert that does not wait for them any more: what they say would come after it.
    fn break_off(&mut self, severer: &Alert) {
        let is_there = |run: &mut Running| place(&run.waiting.alert) == place(severer);
        let broken_off: Vec<Running> = self.running.extract_if(.., is_there).collect();
        for run in broken_off {
            let Waiting { alert, attempt, .. } = &run.waiting;
            if alert.state == MessageState::Resolved {
                self.try_again(alert, *attempt);
            } else {
                self.drop_over(alert);
            }
        }
    }

    /// Of what is due: what waits for its escalation, for somebody on duty or for the end of a silence waits on.
    fn hold_back(&mut self, open: bool) {
        let now = clock::later(Duration::ZERO);
        let off_duty = self.duty_wait();
        let queued = locked(&self.queued);
        let due = (self.waiting.iter_mut()).take_while(|((due, _), _)| !open || *due <= now);
        let mut later = Vec::new();
        for (turn, waiting) in due {
            let wait = self
                .hook
                .unacknowledged_wait(waiting.escalation, now)
                .max(off_duty);
            let wait = if queued.is_muted(&waiting.alert) {
                LOOK_AGAIN_MUTED
            } else {
                wait.min(LOOK_AGAIN)
            };
            waiting.is_held = wait > Duration::ZERO;
            if waiting.is_held {
                later.push((*turn, now + wait));
            }
        }
        drop(queued);
        for (turn, due) in later {
            if let Some(waiting) = self.waiting.remove(&turn) {
                self.waiting.insert((due, turn.1), waiting);
            }
        }
    }

    /// What was superseded or resolved while it waited, as far as it is due.
    fn drop_what_is_over(&mut self, open: bool) {
        let now = clock::later(Duration::ZERO);
        let due = self.waiting.iter();
        // An escalation that is called off does not wait for its time, nor what is over for somebody on duty.
        let due = due.filter(|((due, _), waiting)| !open || waiting.is_held || *due <= now);
        let over = due.filter(|(_, waiting)| self.is_over(&waiting.alert));
        let over: Vec<Turn> = over.map(|(turn, _)| *turn).collect();
        for turn in over {
            let Some(waiting) = self.waiting.remove(&turn) else {
                continue;
            };
            if waiting.is_new {
                self.untried -= 1;
                let (hook, key) = (self.hook.name(), &waiting.alert.key);
                tracing::info!(hook, key, "superseded before it was reported");
                self.finish(&waiting.alert, DeliveryOutcome::Over);
            } else {
                self.drop_over(&waiting.alert);
            }
        }
    }

    fn note_outcome(&mut self, waiting: &Waiting, outcome: Option<&HookOutcome>, open: bool) {
        let (hook, key) = (self.hook.name(), waiting.alert.key.clone());
        let attempt = waiting.attempt;
        let goes_on = waiting.alert.must_arrive() || attempt < self.retry.attempts;
        self.report(waiting, outcome);
        if outcome == Some(&HookOutcome::Done) {
            self.finish(&waiting.alert, DeliveryOutcome::Delivered);
        } else if !self.is_wanted(&waiting.alert) {
            // It is closed already, and goes to the hooks that ask for it.
            tracing::warn!(
                hook,
                key,
                attempt,
                ?outcome,
                "alert not delivered: by the config as it is now the hook does not ask for it"
            );
            locked(&self.queued).release(&waiting.alert);
        } else if self.is_over(&waiting.alert) {
            self.drop_over(&waiting.alert);
        } else if open && goes_on {
            let delay_s = self.try_again(&waiting.alert, attempt).as_secs_f64();
            tracing::warn!(
                hook,
                key,
                attempt,
                ?outcome,
                delay_s,
                "hook will be retried"
            );
        } else {
            self.lost += 1;
            let outcome = if open {
                tracing::error!(hook, key, attempt, ?outcome, "alert not delivered");
                DeliveryOutcome::Dead
            } else {
                let text = "alert not delivered yet: it is sent again after the next start";
                tracing::warn!(hook, key, attempt, ?outcome, "{text}");
                DeliveryOutcome::Waiting
            };
            self.finish(&waiting.alert, outcome);
        }
    }

    /// Has it wait for its next attempt: for how long.
    fn try_again(&mut self, alert: &Alert, attempt: u32) -> Duration {
        let delay = self.retry.delay(&alert.key, attempt);
        self.note(alert, DeliveryOutcome::Waiting);
        let again = Waiting {
            alert: alert.clone(),
            attempt: attempt.saturating_add(1),
            is_new: false,
            escalation: None,
            is_held: false,
        };
        self.wait(again, clock::later(delay));
        delay
    }

    /// A hook that fails is shown as such until it takes an alert.
    fn report(&self, waiting: &Waiting, outcome: Option<&HookOutcome>) {
        let hook = self.hook.name();
        let delivered = locked(&self.delivered);
        match outcome {
            Some(HookOutcome::Done) => delivered.fails_no_more(&hook),
            Some(failed) => {
                let how = format!(
                    "hook {} in {}: {}",
                    short_name(&self.hook),
                    counted(waiting.attempt, "attempt", "attempts"),
                    failed.in_words()
                );
                delivered.fails(&hook, &waiting.alert, &how);
            }
            None => {}
        }
    }

    /// Notes what became of an alert, then lets go of it.
    fn finish(&self, alert: &Alert, outcome: DeliveryOutcome) {
        self.note(alert, outcome);
        locked(&self.queued).release(alert);
    }

    fn note(&self, alert: &Alert, outcome: DeliveryOutcome) {
        let hook = self.hook.name();
        if let Err(error) = locked(&self.delivered).note(alert, &hook, outcome) {
            let key = &alert.key;
            tracing::warn!(hook, key, %error, "no receipt: a restart may send it again");
        }
    }

    fn is_over(&self, alert: &Alert) -> bool {
        locked(&self.queued).is_over(alert)
    }

    fn drop_over(&mut self, alert: &Alert) {
        let (hook, key) = (self.hook.name(), &alert.key);
        let is_called_off = locked(&self.delivered).is_called_off(alert, &hook);
        if is_called_off {
            tracing::info!(
                hook,
                key,
                "not sent again: the alert is acknowledged or silenced"
            );
        } else {
            tracing::error!(hook, key, "alert not delivered before it was over");
            self.lost += 1;
        }
        self.finish(alert, DeliveryOutcome::Over);
    }

    /// Goes by what the config says of the hook now. What it does not ask for any more is not sent to it, and nothing that waits where the config
    /// has it no more.
    fn change(&mut self, hook: Option<Arc<HookConfig>>) {
        self.is_left_out = hook.is_none();
        if let Some(hook) = hook {
            self.hook = hook;
        }
        for (turn, mut waiting) in std::mem::take(&mut self.waiting) {
            self.untried -= usize::from(waiting.is_new);
            if !self.is_wanted(&waiting.alert) {
                locked(&self.queued).release(&waiting.alert);
                continue;
            }
            if waiting.is_new {
                self.untried += 1;
                waiting.escalation = self.escalation(&waiting.alert);
            }
            // What was held back may be due by what the config says now.
            let due = if waiting.is_held {
                clock::later(Duration::ZERO)
            } else {
                turn.0
            };
            self.waiting.insert((due, turn.1), waiting);
        }
    }

    /// Whether the hook asks for it; an end goes to whoever has received the beginning.
    fn is_wanted(&self, alert: &Alert) -> bool {
        !self.is_left_out && (alert.state == MessageState::Resolved || self.hook.asks_for(alert))
    }

    fn begin(&mut self, alert: Alert) {
        let name = self.hook.name();
        let before = locked(&self.delivered).attempts(&alert, &name);
        // A worker before this one may have had it taken, where the hook was left out of the config and put back.
        let is_taken = before > 0 && locked(&self.delivered).has(&alert, &name);
        if is_taken || !self.is_wanted(&alert) {
            locked(&self.queued).release(&alert);
            return;
        }
        let escalation = (before == 0).then(|| self.escalation(&alert)).flatten();
        let waiting = Waiting {
            alert,
            attempt: before.saturating_add(1),
            is_new: true,
            escalation,
            is_held: false,
        };
        self.wait(waiting, clock::later(Duration::ZERO));
    }

    /// Until when an escalation waits for an acknowledgement, and when it was noted. The time is counted from when the alert came
    /// into the outbox, by the host's clock: a restart neither loses nor renews it. Whatever that clock does, it is never
    /// longer than the whole.
    fn escalation(&self, alert: &Alert) -> Option<(Instant, Option<Timestamp>)> {
        if alert.state != MessageState::Firing {
            return None;
        }
        let after = self.hook.escalate_after?;
        let noted = locked(&self.delivered).noted(alert, &self.hook.name());
        Some((clock::later(after), noted))
    }

    /// How long nobody behind the hook is on duty yet.
    fn duty_wait(&self) -> Duration {
        let hours = self.hook.hours.as_ref();
        hours.map_or(Duration::ZERO, |hours| hours.wait(clock::now()))
    }

    fn wait(&mut self, waiting: Waiting, due: Instant) {
        self.taken += 1;
        self.untried += usize::from(waiting.is_new);
        self.waiting.insert((due, self.taken), waiting);
    }
}

impl HookConfig {
    /// How long an escalation still waits for an acknowledgement at `now`.
    fn unacknowledged_wait(
        &self,
        escalation: Option<(Instant, Option<Timestamp>)>,
        now: Instant,
    ) -> Duration {
        let (Some(after), Some((latest, noted))) = (self.escalate_after, escalation) else {
            return Duration::ZERO;
        };
        let gone = noted.map(|noted| clock::now().duration_since(noted));
        // Before the beginning there is only a clock that was set back.
        let gone = gone.and_then(|gone| Duration::try_from(gone).ok());
        let left = after.saturating_sub(gone.unwrap_or(Duration::ZERO));
        left.min(latest.saturating_duration_since(now))
    }
}
