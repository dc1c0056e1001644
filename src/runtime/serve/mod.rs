//! Answers over HTTP: whether the daemon runs and is ready, its metrics, its status, its events, its page.

mod acknowledge;
mod caller;
mod connections;
mod metrics;
mod page;
mod routes;
mod threads;
mod views;

pub use metrics::CONTENT_TYPE;
pub use routes::{Archive, ArchiveError, DaemonStatus, Page};

use super::shutdown::{self, Trigger};
use super::view::{Facts, SiteReader};
use super::vitals::Vitals;
use crate::config::Token;
use caller::SharedToken;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::TcpListener;
use tokio::task::JoinHandle;

/// What one caller may take up.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Limits {
    /// Connections at once; one more takes the place of the oldest.
    pub connections: usize,
    /// By when the head of a request must be there.
    pub head_time: Duration,
    /// By when a request must be answered.
    pub request_time: Duration,
    /// A work loop that has not turned for so long is stuck, and `/healthz` says so.
    pub turn_time: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            connections: 64,
            head_time: Duration::from_secs(10),
            request_time: Duration::from_secs(30),
            turn_time: Duration::from_secs(30),
        }
    }
}

/// Where to listen, and to whom to open.
#[derive(Debug, Clone)]
pub struct ListenOptions {
    /// The address; port 0 takes a free one.
    pub listen: SocketAddr,
    /// What a caller must know; `None` opens to everyone who can reach the address.
    pub token: Option<Token>,
    /// What one caller may take up.
    pub limits: Limits,
}

/// The address cannot be listened on.
#[derive(Debug, thiserror::Error)]
#[error("cannot listen on {address}: {source}")]
pub struct ListenError {
    /// The address.
    pub address: SocketAddr,
    /// What the system said.
    pub source: io::Error,
}

/// The server at work.
#[derive(Debug)]
pub struct Server {
    address: SocketAddr,
    token: SharedToken,
    reader: Option<Arc<SiteReader>>,
    stop: Trigger,
    task: JoinHandle<()>,
}

/// What is served beside the daemon's health.
#[derive(Debug, Clone, Default)]
pub struct ServedState {
    /// Past events.
    pub archive: Option<Arc<dyn Archive>>,
    /// What the page shows.
    pub reader: Option<Arc<SiteReader>>,
}

impl Server {
    /// Starts to listen; needs a tokio runtime. `archive` answers for past events, where there is one.
    ///
    /// # Errors
    /// [`ListenError`].
    pub async fn start(
        options: ListenOptions,
        vitals: Arc<Vitals>,
        archive: Option<Arc<dyn Archive>>,
    ) -> Result<Self, ListenError> {
        let reader = None;
        Self::open(options, vitals, ServedState { archive, reader }).await
    }

    /// Starts to listen, with the page where there is a reader.
    ///
    /// # Errors
    /// [`ListenError`].
    pub async fn open(
        options: ListenOptions,
        vitals: Arc<Vitals>,
        served: ServedState,
    ) -> Result<Self, ListenError> {
        let fail = |source| ListenError {
            address: options.listen,
            source,
        };
        let listener = TcpListener::bind(options.listen).await.map_err(fail)?;
        let address = listener.local_addr().map_err(fail)?;
        let (stop, stopped) = shutdown::pair();
        let token = SharedToken::new(options.token.clone());
        let reader = served.reader.clone();
        let router = routes::router(&options, token.clone(), vitals, served);
        let task = tokio::spawn(connections::serve(
            listener,
            router,
            options.limits,
            stopped,
        ));
        tracing::info!(%address, "listening");
        Ok(Self {
            address,
            token,
            reader,
            stop,
            task,
        })
    }

    /// Callers must know another token from here on, and the page shows another config.
    pub fn follow(&self, token: Option<Token>, facts: Facts) {
        self.token.change(token);
        if let Some(reader) = &self.reader {
            reader.follow(facts);
        }
    }

    /// Where it listens.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// Ends it; what is being answered is broken off.
    pub async fn stop(self) {
        self.stop.request();
        if let Err(error) = self.task.await {
            tracing::error!(%error, "the server broke off");
        }
    }
}
