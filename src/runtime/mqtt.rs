//! Readings from an MQTT broker, each message acknowledged by whoever has made it durable.
//!
//! The session is kept under a stable name and acknowledgements are ours to give: what was not
//! acknowledged when the process or the connection ended comes again.

mod connection;
mod publish;
mod refused;
mod session;

pub(super) use publish::MQTT_OUT;
pub(super) use session::MOST_UNACKNOWLEDGED;

use super::clock::Stopwatch;
use super::log::is_logged;
use super::service_faults::{FaultPlace, ServiceFaultKind, ServiceFaults};
use super::shutdown::Shutdown;
use super::tail::{Arrival, Decoder, guarded};
use crate::config::{Benchmark, Broker};
use crate::monitor::Input;
use crate::reading::Timestamp;
use connection::Connection;
use refused::RefusedTopics;
use session::{BrokerMessage, NoConnection, Session, SessionEvent};
use std::path::Path;
use std::sync::{Arc, OnceLock};
use std::time::Duration;
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

/// Longest message whose lines are read, bytes.
const LONGEST_MESSAGE: usize = 1 << 20;
/// Values of one broker's messages that may wait to be taken; what one message holds beyond that waits too, alone.
const MOST_VALUES: u32 = 1 << 16;
/// First and longest wait before connecting again.
const RECONNECT: (Duration, Duration) = (Duration::from_secs(1), Duration::from_secs(60));

/// After so long with a subscription what the broker kept for us is coming in.
const SETTLED: Duration = Duration::from_secs(2);

/// As whom a source subscribes, and since when the subscription stands; it may come late, and with it what was sent while the daemon was off.
#[derive(Debug, Clone)]
pub struct Subscription {
    /// The session's name: one for each daemon and source, and always the same.
    pub client: String,
    /// Whether the broker has granted it to an earlier run: it should have kept the session.
    pub is_known: bool,
    since: Arc<OnceLock<Stopwatch>>,
}

impl Subscription {
    /// One that does not stand yet.
    pub fn new(client: String, is_known: bool) -> Self {
        Self {
            client,
            is_known,
            since: Arc::default(),
        }
    }

    fn begin(&self) {
        self.since.get_or_init(Stopwatch::start);
    }

    /// Whether the broker has granted it.
    pub(super) fn stands(&self) -> bool {
        self.since.get().is_some()
    }

    /// Whether it has stood for so long that what the broker kept for us is coming in.
    pub(super) fn has_settled(&self) -> bool {
        let since = self.since.get();
        since.is_some_and(|since| since.elapsed() >= SETTLED)
    }
}

/// One message, on its way to be made durable.
#[derive(Debug)]
pub struct ReceivedMessage {
    /// What it holds; nothing where it cannot be used.
    pub arrivals: Vec<Arrival>,
    /// The source that it is from.
    pub source: String,
    /// Runs since it came.
    pub found: Stopwatch,
    /// Lines in it that cannot be used; one where nothing in it is for this site.
    pub quarantined: u64,
    /// Whether the broker keeps it for whoever subscribes, so that it comes again.
    pub is_retained: bool,
    /// To be given back once that is durable.
    pub receipt: Receipt,
    /// Its share of what may wait to be taken.
    pub room: Option<OwnedSemaphorePermit>,
}

/// The acknowledgement that a message waits for.
#[derive(Debug)]
pub struct Receipt(ReceiptOf);

/// What is acknowledged.
#[derive(Debug)]
enum ReceiptOf {
    Message(Box<BrokerMessage>),
    Number(u64, mpsc::UnboundedSender<u64>),
    /// No message.
    Nothing,
}

impl Receipt {
    /// For a broker that is no broker: it gets the number.
    pub fn numbered(number: u64, acknowledged: mpsc::UnboundedSender<u64>) -> Self {
        Self(ReceiptOf::Number(number, acknowledged))
    }

    /// Acknowledges the message to the broker, so that it does not come again. Not to be called by the task that runs
    /// [`follow`].
    ///
    /// # Errors
    /// When that task, or the connection that the message came by, has ended; the message comes again.
    pub async fn acknowledge(self) -> Result<(), NoConnection> {
        match self.0 {
            ReceiptOf::Message(message) => message.acknowledge().await,
            ReceiptOf::Number(number, acknowledged) => {
                // Whoever does not listen any more needs no answer.
                let _ = acknowledged.send(number);
                Ok(())
            }
            ReceiptOf::Nothing => Ok(()),
        }
    }
}

/// Takes the broker's messages until `shutdown` is asked for or nobody takes the deliveries any
/// more; a connection that breaks is made again. Where the broker has not kept a session that it had granted, this is said
/// as a possible gap.
pub async fn follow(
    broker: Broker,
    benchmarks: Vec<Benchmark>,
    deliveries: mpsc::Sender<ReceivedMessage>,
    faults: ServiceFaults,
    subscription: Subscription,
    mut shutdown: Shutdown,
) {
    use ServiceFaultKind::{MessagesRefused, SubscriptionRefused};
    let [refused, useless] =
        [SubscriptionRefused, MessagesRefused].map(|kind| FaultPlace::of_source(kind, &broker.id));
    let mut connection = Connection::new(&broker, &subscription.client, &faults);
    let mut session = Session::new(broker.clone(), subscription.client.clone());
    let mut was_granted = subscription.is_known;
    let mut reader = Reader {
        source: broker.id.clone(),
        filter: broker.topic.clone(),
        decoder: Decoder::of_messages(&broker, &benchmarks),
        quarantined: 0,
        refused: RefusedTopics::default(),
    };
    let room = Arc::new(Semaphore::new(MOST_VALUES as usize));
    let mut wait = RECONNECT.0;
    loop {
        tokio::select! {
            biased;
            () = shutdown.requested() => return,
            came = session.next() => match came {
                Ok(SessionEvent::Connected { is_kept }) => {
                    tracing::info!(source = broker.id, ?broker.address, version = session.version(), "connected");
                    if was_granted && !is_kept {
                        let _ = deliveries.send(possible_gap(&broker.id)).await;
                    }
                    wait = RECONNECT.0;
                    connection.begins();
                    // Again each time: a broker that lost its sessions has forgotten it.
                    if let Err(error) = session.subscribe(&broker.topic) {
                        tracing::error!(source = broker.id, %error, "cannot subscribe");
                    }
                }
                Ok(SessionEvent::Message(message)) => {
                    let delivery = reader.delivery(message);
                    reader.refused.report(&faults, &useless);
                    tokio::select! {
                        sent = send(delivery, &room, &deliveries) => if sent.is_err() { return },
                        () = shutdown.requested() => return,
                    }
                }
                Ok(SessionEvent::Subscribed { is_kept }) => {
                    note_granted(&faults, &refused, is_kept);
                    was_granted = true;
                    subscription.begin();
                }
                Ok(SessionEvent::SubscriptionRefused) => {
                    let (source, topic) = (&broker.id, &broker.topic);
                    let what = format!("the broker refuses the subscription to {topic:?}: nothing comes from it");
                    faults.begin_fault(refused.clone(), &what);
                    tracing::error!(source, topic, ?RECONNECT, "the broker refuses the subscription: nothing comes from it");
                    // Asked again after a while: its rules may be others then.
                    connection.note_our_end();
                    session.disconnect();
                    if !waits(RECONNECT.1, &mut shutdown).await {
                        return;
                    }
                }
                Ok(SessionEvent::Nothing) => {}
                Err(error) => {
                    tracing::warn!(source = broker.id, %error, ?wait, "no connection; will connect again");
                    connection.ends(&error.to_string());
                    if !waits(wait, &mut shutdown).await {
                        return;
                    }
                    wait = (2 * wait).min(RECONNECT.1);
                }
            }
        }
    }
}

/// Whether the broker takes us and the subscription: asked as another client, so that the daemon's session goes on.
///
/// # Errors
/// Why there is no connection, or that the subscription is refused.
pub(super) async fn try_out(broker: &Broker) -> Result<(), String> {
    let id = format!("slipwatch-doctor-{}", std::process::id());
    let mut session = Session::passing(broker.clone(), id);
    let mut failed = 0;
    loop {
        match session.next().await {
            // One more of those who share a subscription would take messages from the others.
            Ok(SessionEvent::Connected { .. }) if broker.topic.starts_with("$share/") => break,
            Ok(SessionEvent::Connected { .. }) => {
                (session.subscribe(&broker.topic)).map_err(|error| error.to_string())?;
            }
            Ok(SessionEvent::Subscribed { is_kept: true }) => break,
            Ok(SessionEvent::Subscribed { is_kept: false }) => return Err(GRANTS_LESS.to_owned()),
            Ok(SessionEvent::SubscriptionRefused) => {
                return Err(format!("refuses the subscription to {:?}", broker.topic));
            }
            Ok(SessionEvent::Message(_) | SessionEvent::Nothing) => {}
            Err(error) => {
                failed += 1;
                // The second time in the other version of the protocol.
                if failed == 2 {
                    return Err(format!("cannot be reached: {error}"));
                }
            }
        }
    }
    session.disconnect();
    // Sends it; how the connection ends does not matter.
    let _ = session.next().await.is_ok();
    Ok(())
}

/// What a broker does that grants QoS 0 where QoS 1 is asked for.
const GRANTS_LESS: &str =
    "grants the subscription at QoS 0 alone: what is sent while there is no connection is lost";

/// The subscription stands, but not always as it was asked for.
fn note_granted(faults: &ServiceFaults, refused: &FaultPlace, is_kept: bool) {
    if is_kept {
        faults.end_fault(refused);
    } else {
        tracing::warn!(source = refused.source, "the broker {GRANTS_LESS}");
        faults.begin_fault(refused.clone(), &format!("the broker {GRANTS_LESS}"));
    }
}

/// Waits for so long; whether to go on then.
async fn waits(span: Duration, shutdown: &mut Shutdown) -> bool {
    tokio::select! {
        () = tokio::time::sleep(span) => true,
        () = shutdown.requested() => false,
    }
}

/// That messages of `source` may be missing: the broker did not keep the session for which it was to keep them.
fn possible_gap(source: &str) -> ReceivedMessage {
    tracing::warn!(
        source,
        "the broker has not kept the session: messages may be missing"
    );
    let text = format!(
        "source {source}: the broker has not kept the session of this daemon, or is another one than before; what was sent while there was no connection may be missing"
    );
    unreceived(source, text)
}

/// That messages may be missing which a broker keeps for sources that the config does not have any more.
pub(super) fn left_with_broker(sources: &[(String, String)]) -> ReceivedMessage {
    let named = sources.iter();
    let named = named.map(|(source, client)| format!("{source} (client {client:?})"));
    let text = format!(
        "the config does not have these sources any more, and others instead: {}; what their brokers keep for them is not taken. \
         A source of another id is another session",
        named.collect::<Vec<String>>().join(", ")
    );
    tracing::warn!("{text}");
    unreceived(sources.first().map_or("", |(source, _)| source), text)
}

fn unreceived(source: &str, text: String) -> ReceivedMessage {
    let kind = "possible-gap".to_owned();
    ReceivedMessage {
        arrivals: vec![Arrival {
            time: Timestamp::MIN,
            input: Input::Trouble { kind, text },
        }],
        source: source.to_owned(),
        found: Stopwatch::start(),
        quarantined: 0,
        is_retained: false,
        receipt: Receipt(ReceiptOf::Nothing),
        room: None,
    }
}

/// Sends it when there is room for its values.
async fn send(
    mut delivery: ReceivedMessage,
    room: &Arc<Semaphore>,
    deliveries: &mpsc::Sender<ReceivedMessage>,
) -> Result<(), mpsc::error::SendError<ReceivedMessage>> {
    let values = u32::try_from(delivery.arrivals.len()).unwrap_or(MOST_VALUES);
    let share = Arc::clone(room).acquire_many_owned(values.min(MOST_VALUES));
    // It is never closed.
    delivery.room = share.await.ok();
    deliveries.send(delivery).await
}

struct Reader {
    source: String,
    /// The topics that it takes.
    filter: String,
    decoder: Decoder,
    /// Lines and whole messages that could not be used.
    quarantined: u64,
    refused: RefusedTopics,
}

impl Reader {
    fn delivery(&mut self, mut message: BrokerMessage) -> ReceivedMessage {
        let found = Stopwatch::start();
        let (arrivals, quarantined) = self.read(&message.topic(), message.payload());
        message.forget_payload();
        ReceivedMessage {
            arrivals,
            source: self.source.clone(),
            found,
            quarantined,
            is_retained: message.is_retained(),
            receipt: Receipt(ReceiptOf::Message(Box::new(message))),
            room: None,
        }
    }

    /// The values of a message, and the lines of it that cannot be used.
    fn read(&mut self, topic: &str, payload: &[u8]) -> (Vec<Arrival>, u64) {
        let mut arrivals = Vec::new();
        let mut faults: Vec<Box<dyn std::error::Error>> = Vec::new();
        if !is_of(&self.filter, topic) {
            // A session keeps what an earlier config subscribed to.
            let filter = self.filter.clone();
            return (
                Vec::new(),
                self.set_aside(topic, &[OtherTopic(filter).into()]),
            );
        }
        let rows = self.decoder.text_rows(Path::new(topic));
        match (rows, text(payload)) {
            (Some(mut rows), Ok(text)) => {
                for (line, number) in text.lines().zip(1..) {
                    let taken = match guarded(|| rows.take(number, line)) {
                        Ok(taken) => taken,
                        Err(fault) => {
                            faults.push(fault.into());
                            continue;
                        }
                    };
                    let items = taken.items.into_iter();
                    arrivals.extend(items.filter_map(|item| self.decoder.arrival(item)));
                    faults.extend(taken.fault.map(Into::into));
                }
            }
            (_, Err(error)) => faults.push(error.into()),
            (None, Ok(_)) => {}
        }
        if arrivals.is_empty() && faults.is_empty() {
            faults.push(GivesNothing.into());
        }
        let first = faults.first().map(|fault| &**fault);
        self.refused.note(topic, !arrivals.is_empty(), first);
        (arrivals, self.set_aside(topic, &faults))
    }

    /// Counts what cannot be used, and logs it now and then.
    fn set_aside(&mut self, topic: &str, faults: &[Box<dyn std::error::Error>]) -> u64 {
        for error in faults {
            self.quarantined += 1;
            let total = self.quarantined;
            if is_logged(total) {
                tracing::warn!(topic, %error, total, "message, or line of one, quarantined");
            }
        }
        faults.len() as u64
    }
}

/// Whether a topic is one of those that `filter` subscribes to, alone or as one of a group that shares them.
fn is_of(filter: &str, topic: &str) -> bool {
    let shared = filter.strip_prefix("$share/");
    let own = shared.and_then(|shared| shared.split_once('/'));
    rumqttc::matches(topic, own.map_or(filter, |(_, own)| own))
}

/// A message that this site does not ask for any more.
#[derive(Debug, thiserror::Error)]
#[error(
    "its topic is not of {0:?}, which this source takes: the broker has it from an earlier config"
)]
struct OtherTopic(String);

/// A message that can be read, and in which nothing is for this site.
#[derive(Debug, thiserror::Error)]
#[error(
    "the message gives no value: none of its benchmarks is watched and it has no covariate; \
     is the id right? docs/messages.md shows what a message looks like"
)]
struct GivesNothing;

/// Why a message is no text.
#[derive(Debug, thiserror::Error)]
enum NoText {
    #[error("longer than {LONGEST_MESSAGE} bytes")]
    TooLong,
    #[error(transparent)]
    NotUtf8(#[from] std::str::Utf8Error),
}

fn text(payload: &[u8]) -> Result<&str, NoText> {
    if payload.len() > LONGEST_MESSAGE {
        return Err(NoText::TooLong);
    }
    Ok(std::str::from_utf8(payload)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config;
    use std::fs;

    /// What a reader of this site makes of one message: its values, and what could not be used.
    fn read(payload: &str) -> (usize, u64) {
        let site = "[site]\nname = \"Toc\"\nstate_dir = \"state\"\n[[source]]\nid = \"radio\"\nkind = \"mqtt\"\n\
                    url = \"mqtt://127.0.0.1:1883\"\ntopic = \"site/+/displacement\"\n[[benchmark]]\nid = \"P1\"\n";
        let config = config::parse(site, Path::new("site.toml")).unwrap();
        let broker = &config.brokers[0];
        let mut reader = Reader {
            source: broker.id.clone(),
            filter: broker.topic.clone(),
            decoder: Decoder::of_messages(broker, &config.benchmarks),
            quarantined: 0,
            refused: RefusedTopics::default(),
        };
        let (arrivals, quarantined) = reader.read("site/P1/displacement", payload.as_bytes());
        assert_eq!(reader.quarantined, quarantined);
        (arrivals.len(), quarantined)
    }

    #[test]
    fn a_topic_that_only_an_earlier_config_asked_for_is_not_taken() {
        for (filter, topic, takes) in [
            ("site/+/displacement", "site/P1/displacement", true),
            ("site/+/displacement", "test/P1/displacement", false),
            ("site/#", "site/P1/displacement", true),
            ("$share/two/site/#", "site/P1", true),
            ("$share/two/site/#", "test/P1", false),
        ] {
            assert_eq!(is_of(filter, topic), takes, "{filter} {topic}");
        }
    }

    #[test]
    fn a_message_that_gives_nothing_is_counted_and_every_example_of_the_documentation_gives_a_value()
     {
        let nothing =
            r#"{"benchmark": "P9", "time": "2017-06-06T17:00:00Z", "value": 1, "unit": "mm"}"#;
        assert_eq!(read(nothing), (0, 1));
        assert_eq!(read(""), (0, 1));
        assert_eq!(read("no JSON"), (0, 1));
        let page = fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/docs/messages.md"));
        let page = page.unwrap();
        let examples: Vec<&str> = page.lines().filter(|line| line.starts_with('{')).collect();
        assert!(examples.len() >= 5, "{examples:?}");
        for line in examples {
            let (values, refused) = read(line);
            assert_eq!((values >= 1, refused), (true, 0), "{line}");
        }
    }
}
