//! Where a daemon's values come from: files that are followed, brokers that are listened to.

use super::clock::Stopwatch;
use super::mqtt::{self, Receipt, ReceivedMessage, Subscription};
use super::service_faults::{FaultPlace, ServiceFaultKind, ServiceFaults};
use super::shutdown::{self, Shutdown, Trigger};
use super::tail::{self, ArrivalBatch, FollowedFiles};
use crate::config::{Benchmark, Broker, Config};
use crate::store::{Store, StoreError};
use std::collections::VecDeque;
use std::task::{Context, Waker};
use std::time::Duration;
use tokio::sync::mpsc;
use tokio::task::{JoinError, JoinHandle};

/// Batches between the files and the monitor.
const BATCHES: usize = 4;
/// Messages that may wait to be taken, or to be acknowledged.
pub(super) const MESSAGES: usize = mqtt::MOST_UNACKNOWLEDGED as usize;

/// Messages that are looked at together at most; with half of them left more are asked for. Each time the channel is asked it wakes
/// whoever waits for room in it.
const FEW: usize = 256;

/// Between a failure of the program and the next connection to the same broker.
const AFTER_FAILURE: Duration = Duration::from_secs(10);

/// A broker that cannot be reached within this time, or does not answer, is not waited for.
const LONGEST_SILENT: Duration = Duration::from_secs(30);

/// What following a broker needs.
struct MqttFollower {
    broker: Broker,
    benchmarks: Vec<Benchmark>,
    messages: mpsc::Sender<ReceivedMessage>,
    faults: ServiceFaults,
    subscription: Subscription,
    stopped: Shutdown,
}

impl MqttFollower {
    /// Follows until it is asked to stop, also where the program fails meanwhile: it then begins anew.
    async fn run(mut self) {
        let follow = |one: &Self| {
            tokio::spawn(mqtt::follow(
                one.broker.clone(),
                one.benchmarks.clone(),
                one.messages.clone(),
                one.faults.clone(),
                one.subscription.clone(),
                one.stopped.clone(),
            ))
        };
        while let Err(error) = follow(&self).await {
            let source = &self.broker.id;
            tracing::error!(source, %error, "the program failed while it took messages, and begins anew; please report it");
            let text =
                "the program failed while it took messages, and begins anew: the log says where";
            let place = FaultPlace::of_source(ServiceFaultKind::BrokerUnreachable, source);
            self.faults.begin_fault(place, text);
            tokio::select! {
                () = tokio::time::sleep(AFTER_FAILURE) => {}
                () = self.stopped.requested() => return,
            }
        }
    }
}

/// The sources at work.
#[derive(Debug)]
pub struct Sources {
    /// What files hold.
    pub batches: mpsc::Receiver<ArrivalBatch>,
    /// What brokers send.
    pub deliveries: mpsc::Receiver<ReceivedMessage>,
    /// What has been taken and is not durable yet.
    unacknowledged: Vec<Receipt>,
    /// Held, so that without a broker the other end waits.
    messages: mpsc::Sender<ReceivedMessage>,
    /// Of each broker, by its source; and since when they are followed.
    subscriptions: Vec<(String, Subscription)>,
    /// Sources of brokers that the config does not have any more, and the state still has.
    gone: Vec<String>,
    started: Stopwatch,
    /// Stops them, also when it is dropped.
    stop: Trigger,
    task: JoinHandle<Result<(), JoinError>>,
}

impl Sources {
    /// Goes on where `store` says that the files had been read to. What keeps them from being read is kept in `faults`.
    pub(super) fn start(
        config: &Config,
        store: &Store,
        faults: &ServiceFaults,
    ) -> Result<Self, StoreError> {
        faults.forget_sources();
        let (messages, deliveries) = mpsc::channel(MESSAGES);
        let (stop, stopped) = shutdown::pair();
        let files = FollowedFiles::new(&config.sources, &config.benchmarks, store.positions()?);
        let (sender, batches) = mpsc::channel(BATCHES);
        let task = tokio::spawn(tail::follow(files, sender, faults.clone(), stopped.clone()));
        let mut sources = Self::of(messages, deliveries, stop);
        (sources.batches, sources.task) = (batches, task);
        sources.listen(config, store, faults, &stopped)?;
        Ok(sources)
    }

    /// Messages that somebody else brings, and no files; needs a tokio runtime.
    pub fn of(
        messages: mpsc::Sender<ReceivedMessage>,
        deliveries: mpsc::Receiver<ReceivedMessage>,
        stop: Trigger,
    ) -> Self {
        let (_, batches) = mpsc::channel(1);
        Self {
            batches,
            deliveries,
            unacknowledged: Vec::new(),
            messages,
            subscriptions: Vec::new(),
            gone: Vec::new(),
            started: Stopwatch::start(),
            stop,
            task: tokio::spawn(async { Ok(()) }),
        }
    }

    /// Whether each broker sends what it kept for us, or has had its time to.
    pub(super) fn have_begun(&self) -> bool {
        let mut each = self.subscriptions.iter();
        each.all(|(_, one)| one.has_settled()) || self.started.elapsed() >= LONGEST_SILENT
    }

    /// Notes in `store` which brokers have granted a session, so that a later run knows that it should have been kept.
    pub(super) fn note_sessions(&mut self, store: &Store) -> Result<(), StoreError> {
        for (source, one) in &mut self.subscriptions {
            if one.stands() && !one.is_known {
                store.note_broker_session(source, &one.client)?;
                one.is_known = true;
            }
        }
        while let Some(source) = self.gone.last() {
            store.forget_broker_session(source)?;
            self.gone.pop();
        }
        Ok(())
    }

    /// Asks them to stop; what they have read already can still be taken.
    pub(super) fn stop(&self) {
        self.stop.request();
    }

    /// Waits for their end.
    pub(super) async fn join(self) -> Result<(), JoinError> {
        self.stop();
        drop(self.batches);
        self.task.await?
    }

    /// Keeps the acknowledgement until what it is for is durable.
    pub(super) fn hold(&mut self, receipt: Receipt) {
        self.unacknowledged.push(receipt);
    }

    /// Adds the messages that have come by now to those that wait to be taken, a few at once, as far as there is room.
    pub(super) fn receive_more(&mut self, waiting: &mut VecDeque<ReceivedMessage>) {
        if waiting.len() > FEW / 2 {
            return;
        }
        let room = MESSAGES.saturating_sub(self.unacknowledged.len() + waiting.len());
        let most = room.min(FEW - waiting.len());
        let mut more = Vec::new();
        if most > 0 {
            // What has come by now; `recv` sees to being woken by the next.
            let mut context = Context::from_waker(Waker::noop());
            let _ = self
                .deliveries
                .poll_recv_many(&mut context, &mut more, most);
        }
        waiting.extend(more);
    }

    /// Whether another message may wait to be acknowledged.
    pub fn has_room(&self) -> bool {
        self.unacknowledged.len() < MESSAGES
    }

    /// Everything that was taken is durable: acknowledges to the brokers.
    pub(super) fn acknowledge(&mut self) {
        if self.unacknowledged.is_empty() {
            return;
        }
        let receipts = std::mem::take(&mut self.unacknowledged);
        tokio::spawn(async move {
            for receipt in receipts {
                // Those behind it may be of another broker, or of the connection after this one.
                if receipt.acknowledge().await.is_err() {
                    tracing::debug!("the connection has gone: its messages come again");
                }
            }
        });
    }

    /// Follows the brokers. Sources of which the state knows a session, and the config nothing, are kept until [`Sources::note_sessions`].
    fn listen(
        &mut self,
        config: &Config,
        store: &Store,
        faults: &ServiceFaults,
        stopped: &Shutdown,
    ) -> Result<(), StoreError> {
        let (instance, known) = (store.instance()?, store.broker_sessions()?);
        for broker in &config.brokers {
            // One session for each state and source, found again after a restart. Two daemons of one site's name would
            // each get a part of the messages.
            let fresh = || {
                let (site, source) = (&config.site.name, &broker.id);
                format!("slipwatch-{site}-{source}-{instance:016x}")
            };
            let client = known.get(&broker.id).cloned();
            let is_known = client.is_some();
            let subscription = Subscription::new(client.unwrap_or_else(fresh), is_known);
            let follower = MqttFollower {
                broker: broker.clone(),
                benchmarks: config.benchmarks.clone(),
                messages: self.messages.clone(),
                faults: faults.clone(),
                subscription: subscription.clone(),
                stopped: stopped.clone(),
            };
            tokio::spawn(follower.run());
            self.subscriptions.push((broker.id.clone(), subscription));
        }
        let is_gone = |source: &String| config.brokers.iter().all(|broker| broker.id != *source);
        let gone = known.into_iter().filter(|(source, _)| is_gone(source));
        let gone: Vec<(String, String)> = gone.collect();
        // A source that was only taken out is missed by nobody.
        if !gone.is_empty() && self.subscriptions.iter().any(|(_, one)| !one.is_known) {
            let (gap, messages) = (mqtt::left_with_broker(&gone), self.messages.clone());
            tokio::spawn(async move { messages.send(gap).await.is_ok() });
        }
        self.gone = gone.into_iter().map(|(source, _)| source).collect();
        Ok(())
    }
}
