//! What the work loop shows of itself to those outside: its vitals, the server, the service manager.

use super::serve::{Limits, ListenError, ListenOptions, ServedState, Server};
use super::service::Service;
use super::view::Facts;
use super::vitals::Vitals;
use crate::config::{SiteConfig, Token, WordFileError};
use std::sync::Arc;

/// The address at which the daemon is asked cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ReportingError {
    /// The token that callers are asked for.
    #[error(transparent)]
    Token(#[from] WordFileError),
    /// The address cannot be listened on.
    #[error(transparent)]
    Listen(#[from] ListenError),
}

/// Held by the work loop.
#[derive(Debug)]
pub struct Reporting {
    /// What it knows of its health.
    pub vitals: Arc<Vitals>,
    /// The service manager.
    pub service: Service,
    server: Option<Server>,
}

impl Reporting {
    /// Starts to listen, where the site does, and notifies the service manager that we are up. `vitals`: what is shown from the
    /// first moment on.
    ///
    /// # Errors
    /// [`ReportingError`].
    pub async fn start(
        site: &SiteConfig,
        vitals: Arc<Vitals>,
        served: ServedState,
    ) -> Result<Self, ReportingError> {
        let server = match site.listen {
            None => None,
            Some(listen) => {
                let options = ListenOptions {
                    listen,
                    token: site.token()?,
                    limits: Limits::default(),
                };
                Some(Server::open(options, Arc::clone(&vitals), served).await?)
            }
        };
        let service = Service::of_environment();
        service.ready("reading the past");
        Ok(Self {
            vitals,
            service,
            server,
        })
    }

    /// Of what works beside the daemon: nobody is let in, and no service manager is notified.
    pub(super) fn inward() -> Self {
        Self {
            vitals: Arc::new(Vitals::default()),
            service: Service::none(),
            server: None,
        }
    }

    /// Those outside are let in by another token, and see another config.
    pub(super) fn follow(&self, token: Option<Token>, facts: Facts) {
        if let Some(server) = &self.server {
            server.follow(token, facts);
        }
    }

    /// The work loop has turned; also called between two values, because a batch may take long.
    pub fn turn(&mut self) {
        self.vitals.turned();
        self.service.beat();
    }

    /// The past has been read.
    pub fn caught_up(&self) {
        self.vitals.update(|health| health.is_caught_up = true);
        self.service.status("watching");
    }

    /// The end of the work.
    pub async fn stop(self) {
        self.service.stopping();
        if let Some(server) = self.server {
            server.stop().await;
        }
    }
}
