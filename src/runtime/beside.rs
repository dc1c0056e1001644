//! What works beside the work loop for as long as a config holds: heartbeats and drills.

use super::shutdown::Shutdown;
use super::vitals::Vitals;
use super::{drill, heartbeat};
use crate::config::Config;
use crate::store::Store;
use std::sync::Arc;
use tokio::task::JoinSet;

/// The tasks, and what they need.
#[derive(Debug)]
pub(super) struct SideTasks {
    config: Config,
    store: Arc<Store>,
    vitals: Arc<Vitals>,
    shutdown: Shutdown,
    heartbeats: JoinSet<()>,
    drills: JoinSet<()>,
}

impl SideTasks {
    /// Starts what `config` asks for; it ends with the shutdown.
    pub(super) fn start(
        config: &Config,
        store: &Arc<Store>,
        vitals: &Arc<Vitals>,
        shutdown: &Shutdown,
    ) -> Self {
        Self {
            config: config.clone(),
            store: Arc::clone(store),
            vitals: Arc::clone(vitals),
            shutdown: shutdown.clone(),
            heartbeats: heartbeat::start(&config.heartbeats, vitals, shutdown),
            drills: drill::start(config, store, vitals, shutdown),
        }
    }

    /// Goes by another config: what it changes ends and begins again. A drill that is under way is broken off, and held again.
    pub(super) async fn follow(&mut self, config: &Config) {
        let (vitals, shutdown) = (&self.vitals, &self.shutdown);
        if config.heartbeats != self.config.heartbeats {
            self.heartbeats.shutdown().await;
            self.heartbeats = heartbeat::start(&config.heartbeats, vitals, shutdown);
        }
        if config.drill != self.config.drill || config.hooks != self.config.hooks {
            self.drills.shutdown().await;
            self.drills = drill::start(config, &self.store, vitals, shutdown);
        }
        self.config = config.clone();
    }

    /// Ends it all.
    pub(super) async fn stop(mut self) {
        self.heartbeats.shutdown().await;
        self.drills.shutdown().await;
    }
}
