//! Whether a broker is reached, as it stands among the faults: a connection that ends within seconds each time is none.

use crate::config::Broker;
use crate::runtime::clock::Stopwatch;
use crate::runtime::service_faults::{FaultPlace, ServiceFaultKind, ServiceFaults};
use std::time::Duration;
use tokio::task::JoinSet;

/// A connection that has stood for so long is reached.
const STEADY: Duration = Duration::from_secs(10);
/// So many in a row that ended sooner are no accident.
const MOST_SHORT: u32 = 3;

/// The connection of one source.
pub(super) struct Connection {
    faults: ServiceFaults,
    place: FaultPlace,
    broker: Broker,
    client: String,
    /// Since when it stands.
    since: Option<Stopwatch>,
    /// How many in a row have ended within [`STEADY`].
    short: u32,
    /// Whether we are ending it.
    is_over: bool,
    /// Ends the fault once it is steady.
    settling: JoinSet<()>,
}

impl Connection {
    /// One that does not stand yet.
    pub(super) fn new(broker: &Broker, client: &str, faults: &ServiceFaults) -> Self {
        Self {
            faults: faults.clone(),
            place: FaultPlace::of_source(ServiceFaultKind::BrokerUnreachable, &broker.id),
            broker: broker.clone(),
            client: client.to_owned(),
            since: None,
            short: 0,
            is_over: false,
            settling: JoinSet::new(),
        }
    }

    /// The broker has accepted it.
    pub(super) fn begins(&mut self) {
        self.since = Some(Stopwatch::start());
        while self.settling.try_join_next().is_some() {}
        let (faults, place) = (self.faults.clone(), self.place.clone());
        self.settling.spawn(async move {
            tokio::time::sleep(STEADY).await;
            faults.end_fault(&place);
        });
    }

    /// We end it ourselves: the broker has been reached.
    pub(super) fn note_our_end(&mut self) {
        self.is_over = true;
    }

    /// It has ended, or there was none.
    pub(super) fn ends(&mut self, error: &str) {
        self.settling.abort_all();
        if std::mem::take(&mut self.is_over) {
            self.since = None;
            return self.faults.end_fault(&self.place);
        }
        self.short = match self.since.take() {
            Some(since) if since.elapsed() < STEADY => self.short + 1,
            Some(_) | None => 0,
        };
        let (host, port) = (&self.broker.address.host, self.broker.address.port);
        let taken = if self.short >= MOST_SHORT {
            format!(
                " ({} connections in a row ended within seconds: is another client of the name {:?} at work, such as a daemon on a copy of this state?)",
                self.short, self.client
            )
        } else {
            String::new()
        };
        let text = format!("no connection to {host}:{port}: {error}{taken}");
        self.faults.begin_fault(self.place.clone(), &text);
    }
}
